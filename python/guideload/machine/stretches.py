"""A machine whose payloads change: its states one after the other, each over a stretch of the motion."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from guideload._core import Scene, Solution, peaks_of_stretches, solve_stretches
from guideload.base.arrays import Array
from guideload.machine.machine import Machine


@dataclass(frozen=True, eq=False)
class Stretches:
    """The payloads on a machine, stretch by stretch; in `solve` and `peaks` it stands for a scene of the core."""

    machine: Machine  # with all its payloads
    payloads: tuple[tuple[str, ...], ...]  # names of those on it, in each stretch
    # index of the first sample of each stretch; the sample before it has the same time
    first: tuple[int, ...]

    @cached_property
    def machines(self) -> tuple[Machine, ...]:
        """The machine of each stretch, with its payloads as part of its body."""
        return tuple(map(self.machine.with_payloads, self.payloads))

    def solve(
        self,
        time: Array,
        acceleration: Array,
        wrench: Array | None,
        travel: Array | None = None,
        **settings: Any,
    ) -> Solution:
        """As `Scene.solve`; no rider moves."""
        assert travel is None
        return solve_stretches(*self._scenes, self.first, time, acceleration, wrench, **settings)

    def peaks(
        self,
        time: Array,
        acceleration: Array,
        wrench: Array | None,
        travel: Array | None = None,
        **settings: Any,
    ) -> list[Array]:
        """As `Scene.peaks`; no rider moves."""
        assert travel is None
        return peaks_of_stretches(*self._scenes, self.first, time, acceleration, wrench, **settings)

    @cached_property
    def _scenes(self) -> tuple[list[Scene], list[Scene]]:
        """Of the stretches, and with the payloads that stay on the machine through each change."""
        pairs = zip(self.payloads, self.payloads[1:], strict=False)
        staying = [self.machine.with_payloads({*before} & {*after}) for before, after in pairs]
        return [one.scene for one in self.machines], [one.scene for one in staying]
