"""A run: its inputs, and the solution of the core."""

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
    """The inputs of `simulate`, the chosen method and its reason, and the solution."""

    machine: Machine
    motion: Motion
    method: str
    reason: str
    rtol: float
    step: float | None
    times: Array | None  # s, the instants to report; None: the samples of the motion
    travel: Array | None = (
        None  # (riders, n, 3) of the riders at the samples of the motion; None if none moves
    )

    @property
    def time(self) -> Array:
        """The reported instants, (time,) [s]."""
        return self.motion.time if self.times is None else self.times

    @cached_property
    def solution(self) -> Solution:
        """The solution under the motion."""
        return self.solution_under(self.motion.acceleration)

    def solution_under(self, acceleration: Array) -> Solution:
        """The solution under another acceleration (n, 3) [m/s2] at the samples of the motion."""
        return self.machine.scene.solve(
            self.motion.time,
            acceleration,
            self.motion.wrench,
            method=self.method,
            rtol=self.rtol,
            step=self.step,
            times=self.times,
            travel=self.travel,
        )

    def link_loads_again(self, method: str, rtol: float, factor: float) -> Array:
        """Link loads (time, link) [N] by a method with step-size control, under the excitation times a factor."""
        motion = self.motion
        wrench = None if motion.wrench is None else factor * motion.wrench
        solution = self.machine.scene.solve(
            motion.time,
            factor * motion.acceleration,
            wrench,
            method=method,
            rtol=rtol,
            times=self.times,
            travel=self.travel,
        )
        return solution.link_loads("total")

    def history(self, name: str) -> Array | None:
        """A history of the cart or its drive, by its name among the quantities; None if it is unknown."""
        if name == "reaction":
            return self.solution.reaction()
        if name == "cart_acceleration":
            return self.solution.inputs()[:, :3]
        if name == "time":
            return self.time
        # Measured histories are not interpolated to other instants.
        known = {"cart_velocity": self.motion.velocity, "cart_position": self.motion.position}
        return known[name] if self.times is None else None

    def carriage_loads(self, part: str = "total", solution: Solution | None = None) -> Array:
        """Loads (time, carriage, 6): force [N] and moment about the carriage centre [N m].

        part: total, elastic or damping. solution: default `self.solution`.
        """
        groups = self.machine.links_of_carriages, self.machine.carriage_centers
        loads = (solution or self.solution).group_loads(*groups, part)
        loads.setflags(write=False)  # arrays of the result are views of it
        return loads
