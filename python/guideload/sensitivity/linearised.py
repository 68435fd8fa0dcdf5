"""The linear equations of a machine at rest, and their derivatives: matrices, static loads, frequency response."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from guideload._core import Scene, VariedSystem
from guideload.base.arguments import real_array
from guideload.base.arrays import Array, Complex, Indices
from guideload.base.errors import ArgumentError
from guideload.base.ranges import FREQUENCY
from guideload.sensitivity.columns import Column
from guideload.sensitivity.modes import Modal, ModeDerivatives


class Linearised:
    """M q'' + C q' + K q = Q for small motions q of L about rest, and exact derivatives by p columns of values.

    All six dofs of L, in the order x y z rx ry rz; SI units; derivatives are per unit of their column.

    columns   what varies
    values    (p,) the values, SI units
    free      (n,) indices of the free dofs
    scene     the scene with these values
    system    its derivatives in the core
    mass, damping, stiffness, weight          (6, 6) three times, (6,)
    d_mass, d_damping, d_stiffness, d_weight  (p, 6, 6) three times, (p, 6)
    static_position, d_static_position             (6,), (p, 6)
    static_link_loads, d_static_link_loads         (links,), (p, links)
    static_carriage_loads, d_static_carriage_loads (carriages, 6), (p, carriages, 6), about the carriage centres
    """

    def __init__(
        self, columns: tuple[Column, ...], values: Array, free: Indices, system: VariedSystem
    ) -> None:
        self.columns, self.values, self.free, self.system = columns, values, free, system
        self.scene: Scene = system.scene()
        (self.mass, self.damping, self.stiffness), self.weight = self.scene.matrices()
        (self.d_mass, self.d_damping, self.d_stiffness), self.d_weight = system.matrices()
        self.static_position, self.d_static_position = self.scene.static_position(), system.static_position()
        self.static_link_loads, self.d_static_link_loads = (
            each.static_link_loads() for each in (self.scene, system)
        )
        self.static_carriage_loads, self.d_static_carriage_loads = system.static_group_loads()

    @cached_property
    def modal(self) -> Modal:
        """The equations in the undamped modes."""
        omega, _, x, _ = self.scene.modes()
        matrices = self.damping, self.d_mass, self.d_damping, self.d_stiffness
        return Modal(omega, x, *(x @ one @ x.T for one in matrices))

    def modes(self) -> ModeDerivatives:
        """The modes and their derivatives. A nonlinear link without contact counts with its nominal stiffness."""
        return self.modal.modes()

    def response(
        self,
        frequency: ArrayLike,
        point: Sequence[float] | None = None,
        direction: Sequence[float] = (1, 0, 0),
    ) -> tuple[Complex, Complex]:
        """Complex amplitudes q (m, 6) of L at m frequencies [Hz] and their derivatives (m, p, 6).

        Per N at a point [m from L] along a direction (a unit vector) or, without point, per m/s2 of the drive along it.
        A point r of the body moves by u + phi x r. Convention exp(i 2 pi f t), as in `frequency_response`.
        """
        out = self.system.out_of_contact()
        if out:
            raise ArgumentError(
                f"links {out} have no contact at rest, so the response has none of their stiffness, and a small change "
                "does not show when they touch; take the response of the machine without them"
            )
        along, hertz = real_array("direction", direction), real_array("frequency", frequency)
        at = np.zeros(3) if point is None else real_array("point", point)
        is_finite = all(np.isfinite(one).all() for one in (along, hertz, at)) and np.all(
            hertz <= FREQUENCY.most
        )
        if along.shape != (3,) or at.shape != (3,) or hertz.ndim != 1 or not is_finite:
            raise ArgumentError(
                f"response: expected finite numbers: frequencies (m,) up to {FREQUENCY.most:g} Hz, a direction (3,) "
                f"and a point (3,), got {frequency!r:.60}, {direction!r:.60} and {point!r:.60}"
            )
        force, d_force = np.zeros(6), np.zeros((len(self.columns), 6))
        if point is None:
            force, d_force = -self.mass[:, :3] @ along, -self.d_mass[:, :, :3] @ along
        else:
            force = np.concatenate([along, np.cross(at, along)])
        return self.modal.response(2.0 * np.pi * hertz, force, d_force)
