"""An independent reference in 50 digits and more, and the scenes and motions that tests share.

The reference shares no code with guideload: it reads the description of a Machine, assembles M, C, K and Q from
the equations of the paper in mpmath, and propagates the first-order hold by mpmath's exponential of the
augmented matrix. All numbers of the description and of the motion count as exact binary numbers; times that are
uniform to their rounding count as exactly uniform, as guideload takes them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import mpmath
import numpy as np
from machines import body
from moves import GENTLE
from mpmath import MPContext
from numpy.typing import NDArray

from guideload import Audit, Body, Carriage, Link, Machine, Motion, Rail, motion_from_trace, read_trace
from guideload._core import Batch, VariedScene
from guideload.cli.inputs import EXAMPLES
from guideload.parameters.parts import arguments_of

Array = NDArray[np.float64]
Numbers = list[Any]  # of mpmath numbers

# Arguments of `_core.Batch` beside those of its scene.
OF_BATCH = (
    "time",
    "acceleration",
    "wrench",
    "speed",
    "exponent",
    "measures",
    "method",
    "rtol",
    "rules",
    "start",
    "draws",
    "at_samples",
)
DOFS = ("x", "y", "z", "rx", "ry", "rz")
# Squaring and the imbalance of metres against metres per second cost up to ten digits of the 70; 50 are asked.
DIGITS = 70
SMALL = 16  # exponent of two by which the argument of a power series is less than 1

# ---- the scenes and motions of the yardstick


def on_rails(
    centers: Sequence[float], end: float, free: Sequence[str], damping: float, **laws: Any
) -> Machine:
    """Two rails; on each a carriage at each x of `centers`, its ends at x -+ `end`, each 6e7 N/m and `damping`
    along y and along z; `laws`: other values of all carriages."""
    rails = [Rail(name="1", position=(0.05, -0.35)), Rail(name="2", position=(0.05, 0.35))]
    stiffness = {"stiffness_y": 1.2e8, "stiffness_z": 1.2e8}
    values = stiffness | {"damping_y": 2.0 * damping, "damping_z": 2.0 * damping, "length": 2.0 * end} | laws
    carriages = [
        Carriage(name=f"{rail.name}{'abcd'[i]}", rail=rail.name, x=x, **values)
        for rail in rails
        for i, x in enumerate(centers)
    ]
    return Machine(body=body(), rails=rails, carriages=carriages, free=tuple(free))


def cart(damping: float = 5e4, **laws: Any) -> Machine:
    """Four carriages, 16 links, all dofs free that the guides carry."""
    return on_rails((-0.5, 0.5), 0.06, ("y", "z", "rx", "ry", "rz"), damping, **laws)


def two_carriages(**laws: Any) -> Machine:
    """A carriage on each rail, held to one side along y and along z by gravity."""
    bare = on_rails((0.0,), 0.30, ("y", "z", "rx", "ry", "rz"), 5e4, **laws)
    return bare.model_copy(update={"gravity": (0.0, -9.3, -3.1)})


def warnings_of(audit: Audit) -> tuple[str, ...]:
    """The warnings of an audit but those of units: one mode of the cart is damped by more than guides damp."""
    units = ("damping", "frequency", "sag")
    return tuple(text for text in audit.warnings if getattr(text, "key", "") not in units)


def cart_stiff() -> Machine:
    """The cart overdamped: fastest eigenvalue 3.6e4 1/s."""
    return cart(2e6)


def cart_clear() -> Machine:
    """The cart with 5 um of clearance to either side in each link, damped throughout."""
    return cart(clearance_y=5e-6, clearance_z=5e-6)


def rattling(**keys: Any) -> Machine:
    """Dampers that set in at once: every touch is an impact, and multiplies what differs before it."""
    return cart(clearance_y=5e-6, clearance_z=5e-6, damping_in_contact=True, **keys)


def preloaded(preload: float = 1200.0) -> Machine:
    """The cart on preloaded balls: each link 6e7 N/m at no load, half the preload, opening at 1.7 kN for 1200 N."""
    return cart(preload_y=preload, preload_z=preload, rolling="ball")


def paper(free: Sequence[str] = ("rx", "ry", "rz")) -> Machine:
    """Two long carriages and the dofs of the paper's section 4.1."""
    return on_rails((0.0,), 0.30, free, 5e4)


def example() -> tuple[Machine, Motion]:
    """The packaged manipulator and its measured motion."""
    machine = Machine.from_toml(EXAMPLES / "manipulator.toml")
    return machine, motion_from_trace(read_trace(EXAMPLES / "manipulator.csv"), machine.drive)


def cycle() -> Motion:
    """There and back, jerk-limited: 1.6 m/s, 2.2 m/s2, 25 m/s3; 7062 samples at 1 kHz."""
    time = GENTLE.times(1000.0)
    return Motion.along_x(time, np.interp(time, *GENTLE.corners()), source="cycle")


def noisy() -> Motion:
    """The cycle with white noise of 0.1 m/s2 rms on every sample but the first."""
    clean = cycle()
    noise = np.random.default_rng(0).normal(0.0, 0.1, clean.time.size)
    noise[0] = 0.0
    return Motion.along_x(clean.time, clean.acceleration[:, 0] + noise, source="noisy")


def pulse() -> Motion:
    """Rest but for one half-sine of 2.2 m/s2 from 5.00 to 5.02 s."""
    time = cycle().time
    inside = (time >= 5.0) & (time <= 5.02)
    return Motion.along_x(
        time, np.where(inside, 2.2 * np.sin(np.pi * (time - 5.0) / 0.02), 0.0), source="pulse"
    )


def piece(motion: Motion, start: int, stop: int) -> Motion:
    """Samples `start` to `stop` of a motion; its scene starts at rest there."""
    part = slice(start, stop)
    wrench = None if motion.wrench is None else motion.wrench[part]
    return Motion(motion.time[part], motion.acceleration[part], wrench=wrench, source=motion.source)


# ---- random scenes


def random_body(rng: np.random.Generator) -> Body:
    """Eight point masses: an inertia that a body can have."""
    masses = 10.0 ** rng.uniform(1.0, 3.0, 8)
    points = rng.uniform(-0.6, 0.6, (8, 3))
    center = masses @ points / masses.sum()
    arms = points - center
    inertia = sum(m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(masses, arms, strict=True))
    return Body(mass=float(masses.sum()), center_of_mass=center, inertia=inertia)


def random_base(size: float = 1.0) -> Array:
    """The compliance of a base: some micrometres per kilonewton."""
    root = np.random.default_rng(1).normal(size=(6, 6)) * np.sqrt([1e-9] * 3 + [1e-8] * 3)[:, None]
    return np.asarray(size * root @ root.T)


def on_base(machine: Machine, compliance: Any) -> Machine:
    return machine.model_copy(update={"base": {"compliance": np.asarray(compliance).tolist()}})


def random_links(rng: np.random.Generator, count: int, stiffness: tuple[float, float]) -> list[Link]:
    """Links anywhere in a 2 m cube along any direction; damping 1e-3 s of the stiffness, times 0.1 to 10."""
    links = []
    for i in range(count):
        k = float(10.0 ** rng.uniform(*np.log10(stiffness)))
        links.append(
            Link(
                name=f"{i}",
                point=rng.uniform(-1.0, 1.0, 3),
                direction=rng.normal(size=3),
                stiffness=k,
                damping=k * 1e-3 * float(10.0 ** rng.uniform(-1.0, 1.0)),
            )
        )
    return links


def random_machine(
    seed: int,
    damping: float = 1.0,
    stiffness: tuple[float, float] = (1e6, 1e8),
    free: Sequence[str] | None = None,
    carriages: int = 0,
) -> Machine:
    """3 to 10 random links, as many free dofs as they hold at most; gravity in any direction.

    damping multiplies all damping; a spread of stiffness is met exactly by the first two links.
    """
    rng = np.random.default_rng(seed)
    count = int(rng.integers(3, 11))
    if free is None:
        free = rng.permutation(DOFS)[: int(rng.integers(2, min(count, 6) + 1))].tolist()
    links = random_links(rng, max(count, len(free)), stiffness)
    rows = [{name: getattr(link, name) for name in Link.model_fields} for link in links]
    rows[0]["stiffness"], rows[1]["stiffness"] = stiffness
    for row in rows:
        row["damping"] *= damping
    rails = [Rail(name="r", position=rng.uniform(-0.5, 0.5, 2))] if carriages else []
    values = ("stiffness_y", "stiffness_z", "damping_y", "damping_z")
    on_rail = [
        Carriage(
            name=f"c{i}",
            rail="r",
            x=float(rng.uniform(-1.0, 1.0)),
            length=float(rng.uniform(0.05, 0.5)),
            **{name: float(rng.uniform(0.5, 2.0) * (1e5 if "damping" in name else 1e8)) for name in values},
        )
        for i in range(carriages)
    ]
    gravity = rng.normal(size=3)
    return Machine(
        body=random_body(rng),
        links=[Link(**row) for row in rows],
        rails=rails,
        carriages=on_rail,
        free=tuple(free),
        gravity=9.80665 * gravity / np.linalg.norm(gravity),
    )


def random_motion(
    seed: int,
    axes: int = 3,
    count: int = 250,
    wrench: bool = False,
    times: str = "uniform",
    jumps: bool = False,
) -> Motion:
    """Random walk-like acceleration, rms about 1 m/s2, and noise.

    times: uniform, random (12 stamps, every interval its own) or ticks (five lengths, as device clocks have).
    """
    rng = np.random.default_rng(seed)
    if times == "uniform":
        time = rng.uniform(-1.0, 1.0) + np.arange(count) * 1e-3
    elif times == "ticks":
        time = np.cumsum(rng.choice([0.5e-3, 0.75e-3, 1e-3, 1.25e-3, 2e-3], count))
    else:
        count = 12
        time = np.cumsum(10.0 ** rng.uniform(-5.0, -2.0, count))
    if jumps:
        for at in (count // 5, count // 2):
            time[at + 1] = time[at]
    acceleration = np.zeros((count, 3))
    slow = np.sin(np.outer(np.linspace(0.0, 12.0, count), rng.uniform(0.3, 2.0, axes)))
    acceleration[:, :axes] = slow + 0.3 * rng.normal(size=(count, axes))
    if not wrench:
        return Motion(time, acceleration)
    return Motion(
        time, acceleration, wrench=rng.normal(size=(count, 6)) * [500.0, 800.0, 300.0, 90.0, 60.0, 120.0]
    )


# ---- critically damped scenes


def translating(
    mass: float, links: Sequence[tuple[str, tuple[float, float, float], float, float]]
) -> Machine:
    """A body that only translates, on links through L: (dof, direction, k, b)."""
    return Machine(
        body=body(mass=mass, center_of_mass=(0.0, 0.0, 0.0)),
        links=[Link(name=d, point=(0, 0, 0), direction=o, stiffness=k, damping=b) for d, o, k, b in links],
        free=tuple(link[0] for link in links),
    )


def all_modes_critical() -> Machine:
    """M = diag(1024, .., 256, ..) and six links that give omega = 128 and damping 1 to all six modes.

    All numbers are powers of two, so M, C and K are exact in binary: one eigenvalue, six Jordan blocks of size 2.
    """
    k, b, a = 2.0**23, 2.0**17, 0.5
    rows = [("x", 2), ("y", 0), ("z", 1)]  # links along this axis at -+a on that one
    links = []
    for axis, (name, arm) in enumerate(rows):
        for sign in (-1.0, 1.0):
            point, direction = np.zeros(3), np.zeros(3)
            point[arm], direction[axis] = sign * a, 1.0
            links.append(Link(name=f"{name}{sign}", point=point, direction=direction, stiffness=k, damping=b))
    inertia = 256.0 * np.eye(3)
    heavy = Body(mass=1024.0, center_of_mass=(0.0, 0.0, 0.0), inertia=inertia)
    return Machine(body=heavy, links=links, free=DOFS)


# ---- the reference


@dataclass(frozen=True, eq=False)
class Reference:
    """What the reference computes, rounded once to float64. N, N m, m, rad, s; moments about carriage centres."""

    time: Array
    link_load: Array  # (time, link)
    link_load_damping: Array
    carriage: Array  # (time, carriage, 6)
    reaction: Array  # (time, 6)
    displacement: Array  # (time, 6), sag included
    velocity: Array
    acceleration: Array
    static_link_load: Array  # (link,)
    static_carriage: Array  # (carriage, 6)
    static_reaction: Array  # (6,)
    static_displacement: Array


# What the references compute at each instant.
OBSERVED = (
    "link_load", "link_load_damping", "carriage", "reaction", "displacement", "velocity", "acceleration",
)  # fmt: skip


def reference(machine: Machine, motion: Motion, digits: int = DIGITS) -> Reference:
    """The loads of a machine under a motion, from static equilibrium on, with `digits` digits throughout."""
    exact = precise(machine, motion, digits)
    rounded = {name: np.array(values, dtype=np.float64) for name, values in exact.items()}
    carriages = len(machine.carriages)
    rounded["carriage"] = rounded["carriage"].reshape(motion.time.size, carriages, 6)
    rounded["static_carriage"] = rounded["static_carriage"].reshape(carriages, 6)
    assert rounded.keys() == {field.name for field in fields(Reference)}
    return Reference(**rounded)


def precise(machine: Machine, motion: Motion, digits: int = DIGITS) -> dict[str, list[Any]]:
    """The fields of `Reference` as nested lists of mpmath numbers."""
    mp = MPContext()
    mp.dps = digits
    links, mass, damping, stiffness, weight = assembled(mp, machine)
    free = [DOFS.index(dof) for dof in machine.free]
    n = len(free)

    def block(matrix: list[Numbers], of: list[int], by: list[int]) -> Any:
        return mp.matrix([[matrix[i][j] for j in by] for i in of])

    k_ff, m_ff = block(stiffness, free, free), block(mass, free, free)
    rest = mp.lu_solve(k_ff, mp.matrix([weight[i] for i in free]))  # section 3.5

    # x = (q - q_rest, q'), x' = A x + B u; u: the components of the excitation that are not zero throughout.
    zero = np.zeros((motion.time.size, 6))
    inputs = np.hstack([motion.acceleration, zero if motion.wrench is None else motion.wrench])
    used = [j for j in range(9) if inputs[:, j].any()]
    from_input = [[-mass[i][j] if j < 3 else mp.mpf(i == j - 3) for j in range(9)] for i in range(6)]
    inverse = m_ff**-1
    acceleration_rows = [
        (-(inverse * k_ff)).tolist(),
        (-(inverse * block(damping, free, free))).tolist(),
        (inverse * block(from_input, free, list(range(9)))).tolist(),
    ]
    by_elastic, by_velocity, by_input = acceleration_rows
    a = [[mp.mpf(j == n + i) for j in range(2 * n)] for i in range(n)]
    a += [[*by_elastic[i], *by_velocity[i]] for i in range(n)]
    b = [[mp.zero] * len(used) for _ in range(n)] + [[by_input[i][j] for j in used] for i in range(n)]

    values = [[mp.mpf(float(x)) for x in row] for row in inputs]
    drive = [[row[j] for j in used] for row in values]
    propagators: dict[Any, list[Numbers]] = {}
    states = [[mp.zero] * (2 * n)]
    for k, h in enumerate(_intervals(mp, motion.time)):
        if h == 0:  # a jump of the excitation; the state has none
            states.append(states[-1])
            continue
        if h not in propagators:
            propagators[h] = _propagator(mp, a, b, h)
        now = states[-1] + drive[k] + drive[k + 1]
        states.append([mp.fdot(row, now) for row in propagators[h]])

    nothing, rest6 = [mp.zero] * 6, all_dofs(mp, free, rest)
    instants = []
    by_state_and_input = [a[n + i] + by_input[i] for i in range(n)]
    for state, u in zip(states, values, strict=True):
        place = [p + q for p, q in zip(rest6, all_dofs(mp, free, state[:n]), strict=True)]
        rate = all_dofs(mp, free, [mp.fdot(row, state + u) for row in by_state_and_input])
        outer = [mp.fdot(row, u) for row in from_input]
        instants.append((place, all_dofs(mp, free, state[n:]), rate, outer))

    def observed(*instant: Numbers) -> dict[str, Any]:
        parts = loads_of(mp, links, [0] * len(links), *instant[:2])
        return observe(mp, machine, links, parts, (mass, weight), instant)

    static = observed(rest6, nothing, nothing, nothing)
    found = [observed(*instant) for instant in instants]
    at_rest = {
        f"static_{name}": static[name] for name in ("link_load", "carriage", "reaction", "displacement")
    }
    times = {"time": [mp.mpf(float(t)) for t in motion.time]}
    return times | {name: [one[name] for one in found] for name in OBSERVED} | at_rest


def matrices(machine: Machine) -> tuple[Array, Array, Array, Array, Array]:
    """M, C, K, each (6, 6), weight (6,), and the rows d (link, 6), rounded once to float64."""
    mp = MPContext()
    mp.dps = DIGITS
    links, *parts = assembled(mp, machine)
    m, c, k, weight, rows = (
        np.array(part, dtype=np.float64) for part in (*parts, [link.row for link in links])
    )
    return m, c, k, weight, rows


def assembled(mp: Any, machine: Machine) -> tuple[list[PreciseLink], Any, Any, Any, Numbers]:
    """Links, M, C, K, each of all dofs, and weight."""
    links, (mass, weight) = links_of(mp, machine), _body(mp, machine)
    rows = [link.row for link in links]
    damping, stiffness = (
        _sum_of_squares(mp, rows, [getattr(link, name) for link in links]) for name in ("damping", "k")
    )
    return links, mass, damping, stiffness, weight


@dataclass
class PreciseLink:
    """A link whose law is linear between its edges."""

    row: Numbers  # its deflection per unit of (u, phi), eqs. 14-17
    point: Numbers  # m from L
    direction: Numbers  # unit vector
    offset: Any  # m, of its foot
    pieces: list[tuple[Any, Any]]  # F = a + k d
    edges: Numbers
    damping: Any
    in_contact: bool
    carriage: int  # -1: none

    @property
    def k(self) -> Any:
        """Of a linear link."""
        return self.pieces[0][1]

    def segment(self, deflection: Any) -> int:
        return sum(edge <= deflection for edge in self.edges)

    def damping_on(self, segment: int) -> Any:
        return self.damping if self.pieces[segment][1] or not self.in_contact else 0 * self.damping


def _law(mp: Any, part: Any, axis: str, share: Any) -> tuple[list[tuple[Any, Any]], Numbers]:
    curve = getattr(part, f"curve{axis}")
    if curve is not None:
        points = [(mp.mpf(d), share * mp.mpf(force)) for d, force in curve]
        if not points[0][0]:
            points = [(-d, -force) for d, force in points[:0:-1]] + points
        pieces = []
        for (d, force), (next_d, next_force) in zip(points[:-1], points[1:], strict=True):
            slope = (next_force - force) / (next_d - d)
            pieces.append((force - slope * d, slope))
        return pieces, [d for d, _ in points[1:-1]]
    stiffness, clearance = getattr(part, f"stiffness{axis}"), mp.mpf(getattr(part, f"clearance{axis}"))
    sides = [getattr(stiffness, side, stiffness) for side in ("negative", "positive")]
    low, high = (share * mp.mpf(side) for side in sides)
    if not clearance:
        return [(mp.zero, low), (mp.zero, high)], [mp.zero]
    return [(low * clearance, low), (mp.zero, mp.zero), (-high * clearance, high)], [-clearance, clearance]


def links_of(mp: Any, machine: Machine) -> list[PreciseLink]:
    """Four links per carriage (paper, 4.1), at each end one along y and one along z; then the extra ones."""
    links = []

    def add(one: Any, axis: str, share: Any, point: Numbers, o: Numbers, error: Any, carriage: int) -> None:
        row, law = [*o, *_cross(point, o)], _law(mp, one, axis, share)
        damping = share * mp.mpf(getattr(one, f"damping{axis}"))
        links.append(
            PreciseLink(row, point, o, mp.mpf(error), *law, damping, one.damping_in_contact, carriage)
        )

    axes = {"_y": [mp.zero, mp.one, mp.zero], "_z": [mp.zero, mp.zero, mp.one]}
    for i, (carriage, center) in enumerate(zip(machine.carriages, _centers(mp, machine), strict=True)):
        for sign in (-1, 1):
            point = [center[0] + sign * mp.mpf(carriage.length) / 2, center[1], center[2]]
            for (axis, o), error in zip(axes.items(), carriage.mounting_error, strict=True):
                add(carriage, axis, mp.mpf(1) / 2, point, o, error, i)
    for link in machine.links:
        direction = [mp.mpf(x) for x in link.direction]
        length = mp.sqrt(mp.fdot(direction, direction))
        add(link, "", mp.one, [mp.mpf(x) for x in link.point], [x / length for x in direction], 0, -1)
    return links


def all_dofs(mp: Any, free: Sequence[int], part: Any) -> Numbers:
    """Six numbers from those of the free dofs."""
    out = [mp.zero] * 6
    for i, value in zip(free, part, strict=True):
        out[i] = value
    return out


def loads_of(
    mp: Any, links: Sequence[PreciseLink], segments: Sequence[int], place: Numbers, speed: Numbers
) -> tuple[Numbers, Numbers]:
    """Loads of the links on these segments, and the part of their dampers."""
    on = list(zip(links, segments, strict=True))
    damping = [link.damping_on(segment) * mp.fdot(link.row, speed) for link, segment in on]
    deflections = [mp.fdot(link.row, place) - link.offset for link in links]
    pieces = [link.pieces[segment] for link, segment in on]
    loads = [a + k * d + b for (a, k), d, b in zip(pieces, deflections, damping, strict=True)]
    return loads, damping


def observe(
    mp: Any,
    machine: Machine,
    links: Sequence[PreciseLink],
    parts: tuple[Numbers, Numbers],
    body: tuple[list[Numbers], Numbers],
    instant: Sequence[Numbers],
) -> dict[str, Any]:
    """The values of OBSERVED; parts: of `loads_of`, body: of `_body`, instant: position, velocity and acceleration of
    all dofs, and the forces of the motion on them."""
    (loads, damping), (mass, weight), (place, speed, rate, outer) = parts, body, instant
    forces = []  # of each carriage, and their moments about its centre
    for i, center in enumerate(_centers(mp, machine)):
        total = [mp.zero] * 6
        for link, load in zip(links, loads, strict=True):
            if link.carriage == i:
                arm = [x - y for x, y in zip(link.point, center, strict=True)]
                unit = [*link.direction, *_cross(arm, link.direction)]
                total = [t + load * x for t, x in zip(total, unit, strict=True)]
        forces.append(total)
    reaction = [mp.zero] * 6  # eqs. 34-36 for F of the held dofs
    for i in (i for i, dof in enumerate(DOFS) if dof not in machine.free):
        of_links = mp.fsum(load * link.row[i] for link, load in zip(links, loads, strict=True))
        reaction[i] = mp.fdot(mass[i], rate) - outer[i] - weight[i] + of_links
    return dict(zip(OBSERVED, (loads, damping, forces, reaction, place, speed, rate), strict=True))


def _centers(mp: Any, machine: Machine) -> list[Numbers]:
    rails = {rail.name: rail for rail in machine.rails}
    return [[mp.mpf(c.x), *(mp.mpf(x) for x in rails[c.rail].position)] for c in machine.carriages]


def _body(mp: Any, machine: Machine) -> tuple[list[Numbers], Numbers]:
    """Mass matrix of (u, phi) of L (eqs. 8, 11, 12) and the weight, down (eq. 13 with its sign corrected)."""
    m = mp.mpf(machine.body.mass)
    r = [mp.mpf(x) for x in machine.body.center_of_mass]
    s = [[mp.zero, -r[2], r[1]], [r[2], mp.zero, -r[0]], [-r[1], r[0], mp.zero]]  # eq. 5
    inertia = [[mp.mpf(x) for x in row] for row in machine.body.inertia]
    if machine.body.inertia_about == "center_of_mass":
        for i in range(3):
            for j in range(3):
                inertia[i][j] -= m * mp.fdot(s[i], [s[k][j] for k in range(3)])  # J_S - m skew(r)^2
    mass = [[m * (i == j) for j in range(3)] + [-m * x for x in s[i]] for i in range(3)]
    mass += [[m * x for x in s[i]] + inertia[i] for i in range(3)]
    force = [m * mp.mpf(g) for g in machine.gravity]
    return mass, [*force, *_cross(r, force)]


def _sum_of_squares(mp: Any, rows: list[Numbers], factors: Numbers) -> list[Numbers]:
    """Sum of k d d^T (eqs. 21-24, 30-33)."""
    return [
        [mp.fsum(f * row[i] * row[j] for f, row in zip(factors, rows, strict=True)) for j in range(6)]
        for i in range(6)
    ]


def _intervals(mp: Any, time: Array) -> Numbers:
    """Lengths of the intervals; all the same where the stamps are uniform to their rounding."""
    stamps = [mp.mpf(float(t)) for t in time]
    step = (stamps[-1] - stamps[0]) / (len(stamps) - 1)
    rounding = mp.mpf(2) ** -51 * max(abs(stamps[0]), abs(stamps[-1]))
    if all(abs(stamps[0] + k * step - t) <= rounding for k, t in enumerate(stamps)):
        return [step] * (len(stamps) - 1)
    return [b - a for a, b in zip(stamps[:-1], stamps[1:], strict=True)]


def whole(values: Any, bits: int) -> Any:
    """Numbers of mpmath as an array of whole numbers of 2^-bits, which NumPy multiplies far more quickly."""
    return np.vectorize(lambda x: int(mpmath.ldexp(x, bits)), otypes=[object])(np.array(values, dtype=object))


def _propagator(mp: Any, a: list[Numbers], b: list[Numbers], h: Any) -> list[Numbers]:
    """Rows [P, G0, G1] of x(h) = P x(0) + G0 u(0) + G1 u(h), u linear in between.

    exp([[A h, B h, 0], [0, 0, I], [0, 0, 0]]) takes (x(0), u(0), u(h) - u(0)) to (x(h), u(h), u(h) - u(0)).
    """
    n, m = len(a), len(b[0])
    augmented = mp.zeros(n + 2 * m)
    for i in range(n):
        for j, rate in enumerate([*a[i], *b[i]]):
            augmented[i, j] = rate * h
    for j in range(m):
        augmented[n + j, n + m + j] = mp.one
    # Power series of a small part, and squares.
    bits = 2 * mp.prec
    halvings = SMALL + max(0, mp.mag(mp.mnorm(augmented, mp.inf)))
    part = whole(augmented.tolist(), bits) >> halvings
    exponential = term = whole(mp.eye(n + 2 * m).tolist(), bits)
    for order in range(1, bits // SMALL):
        term = (term @ part >> bits) // order
        exponential = exponential + term
    for _ in range(halvings):
        exponential = exponential @ exponential >> bits
    e = [[mp.ldexp(x, -bits) for x in row] for row in exponential[:n].tolist()]
    return [
        row[:n] + [u - w for u, w in zip(row[n : n + m], row[n + m :], strict=True)] + row[n + m :]
        for row in e
    ]


def _cross(a: Numbers, b: Numbers) -> Numbers:
    return [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]


def core_batch(machine: Machine | None = None, **arguments: Any) -> Batch:
    """A batch of the core, of the carriages of a machine or of the scene that the arguments give."""
    if machine is not None:
        arguments = arguments_of(machine) | arguments
    own = {name: arguments.pop(name) for name in OF_BATCH if name in arguments}
    return Batch(VariedScene(**arguments), **own)
