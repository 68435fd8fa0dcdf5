"""A run: its inputs and the states that the core solved, as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from guideload._core import Solution
from guideload.base.arrays import Array
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion

AXES = ("x", "y", "z")


@dataclass(frozen=True, eq=False)
class Run:
    """The inputs of `simulate`, the method that it took and why, and the solution."""

    machine: Machine
    motion: Motion
    method: str
    reason: str
    rtol: float
    step: float | None
    times: Array | None  # s, the instants to report; None: the samples of the motion

    @property
    def time(self) -> Array:
        """(time,) s, the reported instants."""
        return self.motion.time if self.times is None else self.times

    @cached_property
    def solution(self) -> Solution:
        """The states of the run."""
        return self.solved(self.motion.acceleration)

    def solved(self, acceleration: Array) -> Solution:
        """The states under another acceleration (n, 3) m/s2 at the samples of the motion."""
        return self.machine.scene.solve(
            self.motion.time,
            acceleration,
            self.motion.wrench,
            method=self.method,
            rtol=self.rtol,
            step=self.step,
            times=self.times,
        )

    def carriage_loads(self, part: str = "total", solution: Solution | None = None) -> Array:
        """(time, carriage, 6) force [N] and moment about the carriage centre [N m].

        part: total, elastic or damping; solution: of this run if left out.
        """
        groups = self.machine.links_of_carriages, self.machine.carriage_centers
        loads = (solution or self.solution).group_loads(*groups, part)
        loads.setflags(write=False)  # the labelled arrays are views of it
        return loads
