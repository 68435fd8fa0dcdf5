"""Frequency response of the machine's points to the acceleration of the drive, or to a force at one of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from guideload.base.arguments import checked, real_array
from guideload.base.arrays import Array, Complex
from guideload.base.errors import ArgumentError
from guideload.base.number_text import digits
from guideload.base.ranges import FREQUENCY
from guideload.machine.machine import DOFS, Machine
from guideload.machine.modes import displacement

DRIVE = "drive"
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
# The frequencies by default: over this range around the modes, and finer within some half-widths of each resonance.
BELOW, ABOVE, OVERALL = 0.1, 3.0, 400
HALF_WIDTHS, AROUND_MODE = 8.0, 81
ROUNDING = 1e-12  # of the largest squared frequency: smaller ones are free motion
ROUNDING_OF_MAGNITUDE = 1e-9  # of the largest magnitude: smaller ones are zero by symmetry
UNDAMPED = 1e-9  # of a damping ratio, doubled, and of the distance from such a resonance: smaller is none


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """Complex amplitudes of the points per unit amplitude of the source; exp(i 2 pi f t) convention.

    frequency     (n,) Hz
    displacement  (n, point, 3) in the travelling frame, along x, y, z of the machine [`unit`]
    static        (point, 3) the same at rest, for a constant source [`unit`]; nan if the body is free there
    points        their names
    source        "drive", or the name of the point where the force acts
    direction     (3,) unit vector of the drive's acceleration or of the force
    natural       (k,) Hz, natural frequencies of the machine linearised at rest, without those of free motion
    """

    frequency: Array
    displacement: Complex
    static: Array
    points: tuple[str, ...]
    source: str
    direction: Array
    natural: Array

    @property
    def unit(self) -> str:
        """Unit of the displacement: m per m/s2 of the drive, or m/N."""
        return "m/(m/s2)" if self.source == DRIVE else "m/N"

    @property
    def magnitude(self) -> Array:
        """(n, point, 3) size of the displacement [`unit`]."""
        return np.abs(self.displacement)

    @property
    def least(self) -> float:
        """The smallest magnitude [`unit`] that is more than rounding of the largest one."""
        return ROUNDING_OF_MAGNITUDE * float(self.magnitude.max())

    @property
    def phase(self) -> Array:
        """(n, point, 3) degrees by which the displacement leads the source, -180 to 180; negative: it lags."""
        return np.degrees(np.angle(self.displacement))

    @property
    def absolute_acceleration(self) -> Complex:
        """(n, point, 3) acceleration as a sensor on the body measures it, per m/s2 of the drive [1] or per N [1/kg]."""
        own = -((2.0 * np.pi * self.frequency[:, None, None]) ** 2) * self.displacement
        return np.asarray(own + self.direction) if self.source == DRIVE else np.asarray(own)


@checked
def frequency_response(
    machine: Machine,
    frequency: ArrayLike | None = None,
    *,
    force_at: str | None = None,
    direction: str | Sequence[float] = "x",
) -> FrequencyResponse:
    """The response of all points of a machine, linearised at rest: (K + i w C - w^2 M) q = source.

    frequency  (n,) Hz, above 0; by default 0.1 times the lowest to 3 times the highest mode, finer at resonances
    force_at   name of the point where a force acts; by default the drive accelerates the travelling frame
    direction  of force or acceleration: x, y, z or a vector in the axes of the machine

    The stiffness of a nonlinear link is its slope at rest. Exact in the model: no modes are left out, and damping need
    not be proportional. Raises ArgumentError for a machine without points, an unknown point, impossible frequencies
    or directions, and the frequency of a mode without damping, which is among the default ones.
    """
    if not machine.points:
        raise ArgumentError(f"{machine.name}: expected [[points]] whose response is wanted, got none")
    along = _direction(direction)
    mass, damping, stiffness = linearised(machine)
    source = np.zeros(6)
    if force_at is None:
        source = -mass[:, :3] @ along
    else:
        source[:3], source[3:] = along, np.cross(machine.point(force_at).at, along)
    free = [DOFS.index(dof) for dof in machine.free]
    square = np.ix_(free, free)
    natural, ratio, undamped = _modes(mass[square], damping[square], stiffness[square])
    hertz = _default_frequencies(natural, ratio) if frequency is None else _frequencies(frequency)
    for one in undamped:
        if np.abs(hertz / one - 1.0).min() <= UNDAMPED:
            raise ArgumentError(
                f"{machine.name}: expected damping of the mode at {digits(one, 4)} Hz, got none: its resonance is "
                "infinite; state the damping of carriages and links, or in Python frequencies beside the resonance"
            )
    omega = 2.0 * np.pi * hertz[:, None, None]
    dynamic = stiffness[square] + 1j * omega * damping[square] - omega**2 * mass[square]
    motion = np.zeros((hertz.size, 6), dtype=np.complex128)
    motion[:, free] = np.linalg.solve(dynamic, source[free][None, :, None])[..., 0]
    rest = np.zeros((1, 6), dtype=np.complex128)
    if np.linalg.matrix_rank(stiffness[square]) == len(free):
        rest[0, free] = np.linalg.solve(stiffness[square], source[free])
    else:
        rest[:] = np.nan
    names = tuple(point.name for point in machine.points)
    places = np.array([point.at for point in machine.points])
    moving, static = displacement(places, motion), displacement(places, rest)[0].real
    return FrequencyResponse(hertz, moving, static, names, force_at or DRIVE, along, natural)


def linearised(machine: Machine) -> tuple[Array, Array, Array]:
    """Mass, damping and stiffness (6, 6) of L for small motions about rest."""
    mass, damping, stiffness = machine.nominal_scene.matrices()[0]
    if machine.model_level == "linear":
        return mass, damping, stiffness
    links = machine.link_table()
    rows = links.rows
    deflection = rows @ machine.scene.static_position() - machine.offsets
    slopes = np.array([float(law.tangent(d[None])[0]) for law, d in zip(links.laws, deflection, strict=True)])
    off = links.damping_in_contact & (slopes == 0.0)
    stiffness = stiffness + (rows.T * (slopes - links.stiffness)) @ rows
    return mass, damping - (rows.T * np.where(off, links.damping, 0.0)) @ rows, np.asarray(stiffness)


def _direction(given: str | Sequence[float]) -> Array:
    """The unit vector of x, y, z or of three numbers."""
    if isinstance(given, str):
        vector = np.array(AXES.get(given, ()), dtype=np.float64)
    else:
        vector = real_array("direction", given)
    largest = np.abs(vector).max(initial=0.0)
    if vector.shape != (3,) or not 0.0 < largest < np.inf:
        raise ArgumentError(
            f"direction: expected {', '.join(AXES)} or a finite vector other than zero, got {given!r:.80}"
        )
    return np.asarray(vector / largest / np.linalg.norm(vector / largest))


def _frequencies(given: ArrayLike) -> Array:
    hertz = real_array("frequency", given)
    if hertz.ndim != 1 or not hertz.size or not np.all((hertz > 0.0) & (hertz <= FREQUENCY.most)):
        raise ArgumentError(
            f"frequency: expected frequencies above 0 Hz, at most {FREQUENCY.most:g}, shape (n,), got {given!r:.80}"
        )
    return hertz


def _modes(mass: Array, damping: Array, stiffness: Array) -> tuple[Array, Array, Array]:
    """Natural frequencies [Hz], ascending, damping ratios, and the frequencies without damping; without free motion.

    A mode has no damping if K x = w^2 M x and C x = 0 for some x; of modes at one frequency some may have it.
    """
    lower = np.linalg.inv(np.linalg.cholesky(mass))
    stiffness, damping = (lower @ matrix @ lower.T for matrix in (stiffness, damping))
    squares, shapes = np.linalg.eigh(stiffness)
    vibrating = squares > ROUNDING * squares.max(initial=0.0)
    squares, shapes = squares[vibrating], shapes[:, vibrating]
    omega = np.sqrt(squares)
    ratio = np.diag(shapes.T @ damping @ shapes) / (2.0 * omega)
    left = stiffness - squares[:, None, None] * np.eye(len(mass))
    both = np.concatenate([left, omega[:, None, None] * damping], axis=2)
    undamped = np.linalg.svd(both, compute_uv=False)[:, -1] <= UNDAMPED * squares
    natural = omega / (2.0 * np.pi)
    return natural, ratio, natural[undamped]


def _default_frequencies(natural: Array, ratio: Array) -> Array:
    if not natural.size:
        raise ArgumentError(
            "frequency: the machine has no modes from which a range follows; give the frequencies"
        )
    overall = np.geomspace(BELOW * natural[0], ABOVE * natural[-1], OVERALL)
    near = np.linspace(-HALF_WIDTHS, HALF_WIDTHS, AROUND_MODE)
    fine = natural[:, None] * (1.0 + ratio[:, None] * near)
    return np.unique(np.concatenate([overall, fine[(fine > overall[0]) & (fine < overall[-1])]]))
