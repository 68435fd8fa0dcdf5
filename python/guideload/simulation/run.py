"""A run: its inputs, and the solution of the core."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from guideload._core import Scene, Solution
from guideload.base.arrays import Array, Integers
from guideload.machine.links import own_axes
from guideload.machine.machine import Machine
from guideload.machine.stretches import Stretches
from guideload.motion.motion import Motion
from guideload.motion.travel import travel_at
from guideload.simulation.instants import STEP, excitation_with_enough_instants, fastest_vibration
from guideload.simulation.start import StartState
from guideload.simulation.straightness_loads import StraightnessLoads

if TYPE_CHECKING:
    from guideload._core import Rule

AXES = ("x", "y", "z")
# Histories of L and its drive, by their names among the quantities.
OF_SOLUTION = {
    "reaction": Solution.reaction,
    "displacement": Solution.position,
    "velocity": Solution.velocity,
    "acceleration": Solution.acceleration,
}
HISTORIES = ("time", "cart_position", "cart_velocity", "cart_acceleration", "link_load", *OF_SOLUTION)


class Extremes(NamedTuple):
    """Smallest and largest loads of the carriages at any time and their times [s], each (carriage, 8) as in `Peaks`."""

    smallest: Array
    largest: Array
    time_of_smallest: Array
    time_of_largest: Array
    # (rules, 2) of each carriage with a rule: the largest equivalent load [N] without the effect of a preload, and its
    # time [s]
    equivalent: Array


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
    start: StartState | Array  # an array: position and velocity of L in the travelling frame, (2, 6)
    stretches: Stretches | None = None  # between the changes of payload; the motion has two stamps at each
    straightness_loads: StraightnessLoads | None = None  # None: all rails are straight
    travel: Array | None = None  # (riders, n, 3) at the samples of the motion; None if no rider moves
    original_times: Array | None = None  # s, the samples, if the motion has more instants; else None
    motion_without_push: Motion | None = None  # `motion` contains the push of a rack; None: there is no rack

    @property
    def time(self) -> Array:
        """The reported instants, (time,) [s]."""
        return self.motion.time if self.times is None else self.times

    @property
    def sample_times(self) -> Array:
        """The samples of the motion [s], without instants that were put between them."""
        return self.motion.time if self.original_times is None else self.original_times

    @property
    def scene(self) -> Scene | Stretches:
        """What the core runs."""
        return self.stretches or self.machine.scene

    @property
    def machine_at_start(self) -> Machine:
        """The machine with the payloads that are on it at the start, as part of its body."""
        return self.stretches.machines[0] if self.stretches else self.machine

    @cached_property
    def solution(self) -> Solution:
        """The solution under the motion."""
        return self.solved(self.motion, self.stretches)

    def solved(self, motion: Motion, stretches: Stretches | None) -> Solution:
        """The solution under another motion, with its stretches between changes of payload.

        Of a machine with contacts, exact steps are not longer than a sixth of a period: to find all contact changes in
        a longer one takes longer than the shorter ones.
        """
        times = self.times
        if times is None and self.has_long_steps and np.all(np.diff(motion.time) > 0.0):
            times = motion.time
            motion, stretches = (
                self.excitation_for_peaks
                if motion is self.motion
                else excitation_with_enough_instants(self.machine, motion, stretches)
            )
        return (stretches or self.machine.scene).solve(
            motion.time,
            motion.acceleration,
            motion.wrench,
            method=self.method,
            rtol=self.rtol,
            step=self.step,
            times=times,
            start=self.start,
            travel=self.travel_at(motion.time),
        )

    def at_stamps(self, motion: Motion, stretches: Stretches | None) -> Run:
        """The run under its motion with more stamps, and the stretches of its payloads."""
        if motion is self.motion:
            return self
        rails = self.straightness_loads
        return replace(
            self,
            motion=motion,
            stretches=stretches,
            straightness_loads=None if rails is None else rails.at(motion.time),
            travel=self.travel_at(motion.time),
            original_times=self.sample_times,
        )

    def travel_at(self, stamps: Array) -> Array | None:
        """The travel of the riders, as `travel`, at stamps among which are those of the motion."""
        if self.travel is None or np.array_equal(stamps, self.motion.time):
            return self.travel
        return np.stack([travel_at(self.motion.time, samples, stamps) for samples in self.travel])

    @cached_property
    def has_long_steps(self) -> bool:
        """Whether exact steps of a machine with contacts last longer than a sixth of a period."""
        if self.method != "exact" or self.machine.model_level == "linear":
            return False
        longest = float(np.diff(self.sample_times).max(initial=0.0))
        return longest * fastest_vibration(self.machine) > STEP

    @cached_property
    def excitation_for_peaks(self) -> tuple[Motion, Stretches | None]:
        """The excitation with six instants or more per period of the fastest vibration, and its stretches.

        From them on, the core finds the extremes between the instants too. It stays in memory, up to 80 MB.
        """
        return excitation_with_enough_instants(self.machine, self.motion, self.stretches)

    def extremes(self, dynamic: bool = False, rules: Sequence[Rule | None] | None = None) -> Extremes | None:
        """Smallest and largest loads of the carriages at any time.

        dynamic: also the largest magnitudes of the loads less the static ones; the shape is then (2 carriage, 8).
        rules: those of the equivalent loads, whose largest values are computed too; None where a carriage has no rule.
        Returns None if instants were given, or if rails are not straight: the loads are then known at the reported
        instants only.
        """
        if self.times is not None or self.straightness_loads is not None:
            return None
        machine, (motion, stretches) = self.machine, self.excitation_for_peaks
        found = (stretches or machine.scene).peaks(
            motion.time,
            motion.acceleration,
            motion.wrench,
            method=self.method,
            rtol=self.rtol,
            step=self.step,
            groups=machine.links_of_carriages,
            centers=machine.carriage_places,
            start=self.start,
            travel=self.travel_at(motion.time),
            less=self.machine_at_start.static_carriage_loads if dynamic else None,
            rules=rules,
        )
        return Extremes(*found)

    def link_loads_again(self, method: str, rtol: float, factor: float) -> Array:
        """Link loads (time, link) [N] by a method with step-size control, under the excitation times a factor.

        Without what rails that are not straight add to them.
        """
        motion = self.motion
        wrench = None if motion.wrench is None else factor * motion.wrench
        solution = self.scene.solve(
            motion.time,
            factor * motion.acceleration,
            wrench,
            method=method,
            rtol=rtol,
            times=self.times,
            start=self.start,
            travel=self.travel,
        )
        return solution.link_loads("total")

    def history(self, name: str) -> Array | None:
        """A history of the cart, its drive or of L, one of HISTORIES; None if it is unknown."""
        if method := OF_SOLUTION.get(name):
            return method(self.solution)
        if name == "link_load":
            return self.link_loads()
        if name == "cart_acceleration":
            return self.motion.acceleration if self.times is None else self.solution.inputs()[:, :3]
        if name == "time":
            return self.time
        # Measured histories are not interpolated to other instants.
        known = {"cart_velocity": self.motion.velocity, "cart_position": self.motion.position}
        return known[name] if self.times is None else None

    @cached_property
    def _total_loads(self) -> Array:
        return self.carriage_loads("total", self.solution)

    def carriage_loads(self, part: str = "total", solution: Solution | None = None) -> Array:
        """Loads (time, carriage, 6): force [N] and moment about the carriage centre [N m].

        part: total, elastic or damping. solution: default `self.solution`.
        """
        if part == "total" and solution is None:
            return self._total_loads
        loads = self._group_loads(
            self.machine.links_of_carriages, self.machine.carriage_places, part, solution
        )
        loads.setflags(write=False)  # arrays of the result are views of it
        return loads

    def rail_loads(self) -> Array:
        """Loads (time, rail, 6): force [N] and moment about the mean of its carriage centres [N m]."""
        return self._group_loads(self.machine.links_of_rails, self.machine.rail_places, "total", None)

    def link_loads(self, part: str = "total", solution: Solution | None = None) -> Array:
        """Loads along the links (time, link) [N]. Arguments as for `carriage_loads`."""
        loads = (solution or self.solution).link_loads(part)
        return (
            loads
            if self.straightness_loads is None
            else loads + self.straightness_loads.loads(part, self.times)
        )

    def _group_loads(
        self, groups: Sequence[Integers], places: Array, part: str, solution: Solution | None
    ) -> Array:
        """Loads (time, group, 6) of groups of links about their centres, in their own axes."""
        loads = (solution or self.solution).group_loads(groups, places, part)
        if self.straightness_loads is not None:
            table, of_rails = self.machine.link_table(), self.straightness_loads.loads(part, self.times)
            for i, (links, place, axes) in enumerate(zip(groups, places, own_axes(places), strict=True)):
                loads[:, i] += of_rails[:, links] @ table.arms(links, place[:3], axes)
        return loads
