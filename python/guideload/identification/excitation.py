"""The motion under which a record in time was taken, and the machines whose records have derivatives."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.simulation.start import StartState, start_of

UNEVEN = 1e-3  # steps: stamps closer than this to an even grid are those of the grid, whose propagators recur


@dataclass(frozen=True, eq=False)
class Excitation:
    """A motion, and the state in which its runs start."""

    motion: Motion
    start: StartState

    @classmethod
    def of(cls, machine: Machine, motion: Motion) -> Excitation:
        """Raises ArgumentError for a machine whose motion is not linear in this excitation."""
        _require_linear(machine)
        time, start = motion.time, start_of(machine, motion, "auto")
        grid, step = np.linspace(time[0], time[-1], time.size, retstep=True)
        even = bool(np.abs(grid - time).max() < UNEVEN * step)
        return cls(replace(motion, time=grid) if even else motion, start)

    def within(self, instants: Array) -> Array:
        """The instants (n,) without the rounding by which some may lie outside the motion."""
        return np.asarray(np.clip(instants, self.motion.time[0], self.motion.time[-1]))


def _require_linear(machine: Machine) -> None:
    for what, way_out, there in (
        (
            f"links of the level {machine.model_level}",
            "give its stiffness as one number",
            machine.model_level != "linear",
        ),
        ("riders", "make them part of its body", machine.riders),
        ("payloads", "make them part of its body", machine.payloads),
        ("rails that are not straight", "leave out their profiles", not machine.has_straight_rails),
        ("a base", "leave out [base]", machine.base),
        (
            "a rack that pushes its body",
            "leave out pressure_angle, helix_angle and push_direction",
            machine.drive is not None and machine.drive.push_direction is not None,
        ),
    ):
        if there:
            raise ArgumentError(
                f"{machine.name}: records in time identify a linear machine, and this one has {what}; {way_out}"
            )
