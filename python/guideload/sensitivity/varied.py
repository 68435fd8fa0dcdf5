"""A machine some of whose numbers vary: its linear equations at rest for any values, with exact derivatives."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from guideload._core import VariedScene
from guideload.base.arguments import checked, real_array
from guideload.base.errors import ArgumentError
from guideload.machine.machine import DOFS, Machine
from guideload.motion.motion import Motion
from guideload.parameters.parameters import Parameters
from guideload.parameters.parts import arguments_of
from guideload.sensitivity.columns import Column, To, resolve_columns
from guideload.sensitivity.linearised import Linearised
from guideload.sensitivity.run import RunDerivatives
from guideload.simulation.start import Start

NO_MOTION = Motion.along_x([0.0, 1.0], [0.0, 0.0])


class VariedMachine:
    """A machine whose numbers at some paths vary.

    machine  with straight rails, on a rigid base, without payloads that come and go; riders stand at their positions
    columns  the values that vary
    """

    @checked
    def __init__(self, machine: Machine, to: To, motion: Motion = NO_MOTION) -> None:
        """to: paths as in a study, such as "carriages.*.stiffness_y": a column for each number that they name; or a
        mapping from names to paths: a column for each name, whose numbers vary together. The paths motion.scale and
        motion.force_scale need the motion. Raises ArgumentError, SceneError.
        """
        machine.require_no_payloads("a sensitivity")
        if not machine.has_straight_rails:
            raise ArgumentError(
                "rails: derivatives are for straight rails, as a profile loads the links; leave "
                "straightness out, or compare runs of simulate"
            )
        self.machine = machine
        parameters = Parameters(machine, motion)
        self.columns: tuple[Column, ...] = resolve_columns(parameters, to)
        riders = [rider.at(rider.position) for rider in machine.riders]
        self._scene = VariedScene(
            **arguments_of(machine),
            payloads=[(one.mass, one.center_of_mass, one.inertia, False, []) for one in riders],
            changes=parameters.changes((column.form, column.paths) for column in self.columns),
            columns=len(self.columns),
        )

    @property
    def values(self) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        """The values of the machine as it is, (columns,) in SI units."""
        return np.array([column.value for column in self.columns])

    @checked
    def run(
        self, motion: Motion, values: ArrayLike | None = None, *, start: Start = "auto"
    ) -> RunDerivatives:
        """The run under a motion from the start on, as by `simulate`, at these values. Raises as `at`; only of a
        machine whose drive has no pressure angle.
        """
        return RunDerivatives(self.machine, self.at(values), motion, start)

    @checked
    def at(self, values: ArrayLike | None = None) -> Linearised:
        """The machine at rest with these values (columns,), by default its own.

        Raises SceneError for values that no machine can have or whose machine does not hold its body, and ArgumentError
        where there is no derivative: a link at a kink of its law, a body that is loose in its clearance, an elastic
        base.
        """
        given = self.values if values is None else real_array("values", values)
        if given.shape != (len(self.columns),) or not np.isfinite(given).all():
            raise ArgumentError(f"values: expected {len(self.columns)} finite numbers, got {values!r:.80}")
        free = np.array([DOFS.index(dof) for dof in self.machine.free])
        return Linearised(self.columns, given, free, self._scene.at(given))
