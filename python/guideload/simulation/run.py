"""A run: what was computed with what, before it has labels."""

from __future__ import annotations

from dataclasses import dataclass

from guideload._core import Solution
from guideload.base.arrays import Array
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion

AXES = ("x", "y", "z")


@dataclass(frozen=True, eq=False)
class Run:
    """What `simulate` ran, and the states it got."""

    machine: Machine
    motion: Motion
    solution: Solution
    time: Array
    method: str
    reason: str
    rtol: float
    step: float | None

    def carriage_loads(self, part: str = "total") -> Array:
        """(time, carriage, 6) force [N] and moment about the carriage centre [N m].

        part: total, elastic or damping.
        """
        machine = self.machine
        loads = self.solution.group_loads(machine.links_of_carriages, machine.carriage_centers, part)
        loads.setflags(write=False)  # the labelled arrays are views of it
        return loads
