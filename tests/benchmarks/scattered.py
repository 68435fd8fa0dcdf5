"""The cases of the Monte Carlo benchmark: the draws, guideload's plan for them, and what the peaks really are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from peers.compiled import rk4
from peers.problem import Array, Problem
from peers.scatter import Peaks, Scatter, scatter
from peers.truth import between_events
from reference import cart, cycle, noisy, reference
from scenes import DIGITS

from guideload import Motion
from guideload.study.plan import Plan
from guideload.study.study import Study

CHECKED = 3  # scenes whose truth is computed
CLEARANCE = 5e-6
SCENES, CLEAR_SCENES = 4096, 256  # of a run of guideload
# The yardstick's: mass, centre of mass, then stiffness and damping of each carriage.
VARY = (
    {"path": "body.mass", "distribution": "uniform", "plus_minus": "10 %"},
    {"path": "body.center_of_mass", "each": "value", "distribution": "uniform", "plus_minus": "5 cm"},
    {
        "name": "k",
        "path": ("carriages.*.stiffness_y", "carriages.*.stiffness_z"),
        "each": "carriage",
        "distribution": "lognormal",
        "sigma": 0.2,
    },
    {
        "name": "b",
        "path": "carriages.*.damping",
        "each": "carriage",
        "distribution": "lognormal",
        "sigma": 0.2,
    },
)


@dataclass(frozen=True, eq=False)
class Truth:
    """The peaks to compare with."""

    peaks: Peaks  # of the first scenes
    how: str  # they were computed, and how far another way agrees

    def error(self, peaks: Peaks) -> float:
        """The largest difference, as a part of the scene's largest peak."""
        count = min(len(peaks), len(self.peaks))
        worst = np.abs(peaks[:count] - self.peaks[:count]).max(axis=1) / self.peaks[:count].max(axis=1)
        return float(worst.max()) if np.isfinite(peaks).all() else np.inf


@dataclass(frozen=True, eq=False)
class Case:
    """Scenes and their motion."""

    title: str
    plan: Plan
    values: Array  # (scene, factor)
    scatter: Scatter  # the same for the peers
    rough: bool  # whether every sample is a kink

    def run(self, at_any_time: bool = False) -> Peaks:
        """By guideload, in a batch that is made anew; the peers have the peaks at the samples."""
        plan = replace(self.plan)
        batch = plan.batch() if at_any_time else plan.batch_at_stamps()
        table, failures = batch.run(self.values, 1)
        if failures:
            raise RuntimeError(f"scene {failures[0][0]}: {failures[0][1]}")
        return np.maximum(-table[:, 0::2], table[:, 1::2])  # min and max by turns

    @cached_property
    def truth(self) -> Truth:
        """Independent of guideload, and of the set-up of the batch peers."""
        if self.scatter.clearance:
            return self._between_events()
        peaks = self._peaks(stepped)
        exact = reference(self.scatter.machine_of(0), self.scatter.motion, DIGITS).carriage[:, :, 1:3]
        gap = Truth(peaks[:1], "").error(_largest(exact)[None])
        return Truth(peaks, f"matrix exponential; in {DIGITS} digits it differs by {gap:.0e}")

    def _between_events(self) -> Truth:
        peaks = self._peaks(lambda given: between_events(given)[0])
        fine = _largest(rk4(self.scatter.problem_of(0))(1 / 256))
        gap = Truth(peaks[:1], "").error(fine[None])
        return Truth(
            peaks, f"matrix exponentials between contact changes; RK4 of 1/256 ms differs by {gap:.0e}"
        )

    def _peaks(self, loads: Callable[[Problem], Array]) -> Peaks:
        return np.array([_largest(loads(self.scatter.problem_of(scene))) for scene in range(CHECKED)])


def stepped(given: Problem) -> Array:
    """Loads (time, carriage, 2) of linear links."""
    p, g0, g1 = given.exponential()
    states = np.zeros((given.time.size, given.b.size))
    for k in range(given.time.size - 1):
        states[k + 1] = p @ states[k] + g0 * given.u[k] + g1 * given.u[k + 1]
    return given.loads_yz(states.T)


def _largest(loads: Array) -> Array:
    """(2 carriages,)"""
    return np.abs(loads).max(axis=0).ravel()


def cases() -> list[Case]:
    """The cart on the cycle and on the noisy one, and with clearance on the cycle."""
    clean, noise = cycle(), noisy()
    return [
        _case("linear", clean, 0.0, SCENES, False),
        _case("linear, noisy motion", noise, 0.0, SCENES, True),
        _case("5 \N{MICRO SIGN}m clearance", clean, CLEARANCE, CLEAR_SCENES, False),
    ]


def _case(title: str, motion: Motion, clearance: float, scenes: int, rough: bool) -> Case:
    linear = cart()
    study = Study(
        machine=cart(clearance_y=clearance, clearance_z=clearance),
        motion=motion,
        samples=scenes,
        seed=1,
        quantities=("Fy", "Fz"),
        statistics=("min", "max"),
        vary=VARY,
    )
    plan = study.plan()
    values = plan.values(0, scenes)
    draws = np.split(values, np.cumsum([1, 3, len(linear.carriages)]), axis=1)
    return Case(title, plan, values, scatter(linear, motion, clearance, draws[0][:, 0], *draws[1:]), rough)
