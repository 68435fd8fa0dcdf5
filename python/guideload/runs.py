"""A run: what was computed with what, before it has labels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from guideload._core import Solution
from guideload.machine import Machine
from guideload.motion import Motion

Array = NDArray[np.float64]
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
