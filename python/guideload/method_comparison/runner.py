"""Runs every method over its tolerances and fixed steps, times it, and compares its loads with a reference."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import zip_longest
from time import perf_counter

import numpy as np

from guideload._core import Solution
from guideload.base.arguments import checked
from guideload.base.arrays import Array, median_step
from guideload.base.errors import ArgumentError, GuideloadError, RunError
from guideload.base.methods import METHODS
from guideload.machine.laws import NO_EXACT
from guideload.machine.machine import Machine
from guideload.method_comparison.diagram import (
    AUTO_RTOL,
    Reference,
    Setting,
    SettingResult,
    WorkPrecision,
    pareto_optimal,
)
from guideload.motion.motion import Motion
from guideload.simulation.simulation import simulate

RTOLS = tuple(float(f"1e-{digits}") for digits in range(3, 13))
STEPS_PER_SAMPLE = (1, 2, 4, 8, 16, 32)  # fixed steps; a longer one would be cut at every sample
# Tried in this order for the reference and its check: of each method the tightest tolerance that it can meet.
REFERENCE_SETTINGS = (
    (Setting("exact"),),
    (Setting("implicit", "rtol", 1e-13), Setting("implicit", "rtol", 1e-12)),
    (Setting("rk45", "rtol", 1e-13), Setting("rk45", "rtol", 1e-12)),
)
HIDDEN = 0.1  # carriages whose loads change by less than this part of what their links' do hide the motion
ROUNDING = 1e-12  # of the largest load: a dynamic load below it is rounding
MOST_REPETITIONS = 15  # give a median that is known to some percent; more would only take longer


@checked
def work_precision(machine: Machine, motion: Motion, *, budget: float = 20.0) -> WorkPrecision:
    """Run every method over its range of tolerances and fixed steps, and compare the loads with a reference.

    Parameters
    ----------
    budget
        Time that all runs together may take [s]. The reference is computed however long it takes. Then every setting
        runs once, coarse ones first; settings that no longer fit into the time are skipped. Time that is left is used
        for repetitions. A run that has begun is not cut short.

    Returns
    -------
    WorkPrecision, in which a method that fails has a row that says why.

    Raises
    ------
    RunError
        If no method gives a reference.
    ArgumentError, TypeError
        For arguments that cannot be used.
    SceneError
        For an unsupported body.
    """
    if not 0.0 < budget < np.inf:
        raise ArgumentError(f"budget: expected a number > 0, in s, got {budget!r}")
    deadline = perf_counter() + budget
    auto_method, auto_reason = _auto(machine, motion)
    if not machine.has_straight_rails:
        raise ArgumentError(
            "machine: methods are compared on straight rails only; leave straightness and waviness out: the force of a "
            "profile is one more excitation, which changes no method"
        )
    machine.require_no_payloads("the comparison of methods")
    machine.require_standing_riders("the comparison of methods")
    reference, _, loads, metric = reference_run(machine, motion)
    runner = _Runner(machine, motion, metric, loads, reference, float(budget), deadline)
    curves = _curves(machine, motion)
    for settings in zip_longest(*curves):
        for setting in filter(None, settings):
            runner.run(setting)
    repetitions = runner.repeat()
    rows = [runner.timed_row(setting) for curve in curves for setting in curve]
    return WorkPrecision(
        machine=machine,
        rows=tuple(replace(row, pareto_optimal=pareto_optimal(row, rows)) for row in rows),
        reference=reference,
        error_metric=metric.text,
        auto_method=auto_method,
        auto_reason=auto_reason,
        samples=motion.time.size,
        duration=float(np.ptp(motion.time)),
        repetitions=repetitions,
        budget=float(budget),
    )


@dataclass(frozen=True, eq=False)
class ErrorMetric:
    """Which loads errors are of: the forces of the carriages, or the loads of the first `links` links."""

    machine: Machine
    links: int | None
    static: Array  # (carriage, 3) or (links,) N, in static equilibrium
    text: str  # which these loads are, and why

    @classmethod
    def choose(cls, machine: Machine, solution: Solution) -> ErrorMetric:
        """The carriages' forces, unless these change much less than the loads of their links.

        The two ends of a carriage can take the motion by opposite forces: in the paper's scene the carriages'
        forces change by 2 N while the load of each of their links changes by 1 556 N.
        """
        static_links = machine.scene.static_link_loads()
        if not machine.carriages:
            text = "the loads of the links: the machine has no carriages"
            return cls(machine, static_links.size, static_links, text)
        forces = machine.static_carriage_loads[:, :3]
        by_carriage = cls(machine, None, forces, "the forces of the carriages along x, y and z")
        count = sum(links.size for links in machine.links_of_carriages)  # these come before the extra links
        by_link = cls(machine, count, static_links[:count], "")
        change, links_change = (
            difference(metric.loads(solution), metric.static) for metric in (by_carriage, by_link)
        )
        if change >= HIDDEN * links_change:
            return by_carriage
        text = (
            "the loads of the carriages' links; the carriages' forces, their sums, hide the motion: they change by "
            f"{change:.3g} N, the links by {links_change:.4g} N"
        )
        return replace(by_link, text=text)

    def loads(self, solution: Solution) -> Array:
        """(time, carriage, 3) or (time, links) [N] of a run."""
        if self.links is not None:
            return solution.link_loads("total")[:, : self.links]
        machine = self.machine
        return solution.group_loads(machine.links_of_carriages, machine.carriage_places, "total")[:, :, :3]


def difference(loads: Array, others: Array) -> float:
    """The largest absolute difference [N] of two arrays of loads."""
    return float(np.abs(loads - others).max(initial=0.0))


def solve(machine: Machine, motion: Motion, setting: Setting) -> Solution:
    """One run of the core, without the checks and labels of `simulate`. Raises RunError."""
    if setting.method == "exact" and machine.model_level == "smooth nonlinear":
        raise RunError(NO_EXACT)
    return machine.scene.solve(
        motion.time,
        motion.acceleration,
        motion.wrench,
        method=setting.method,
        rtol=AUTO_RTOL if setting.kind != "rtol" or setting.value is None else setting.value,
        step=setting.value if setting.kind == "step" else None,
    )


def _auto(machine: Machine, motion: Motion) -> tuple[str | None, str]:
    """The method that `auto` picks and why; None, and the reason, if it fails."""
    try:
        result = simulate(machine, motion, rtol=AUTO_RTOL)
    except RunError as error:
        return None, str(error)
    return result.method, result.reason


def has_exponential(machine: Machine) -> bool:
    """Whether method exponential runs a machine, and not in the place of exact."""
    return machine.model_level == "smooth nonlinear" and not machine.scene.has_segments


def _curves(machine: Machine, motion: Motion) -> list[list[Setting]]:
    """The settings of each curve of the diagram, from coarse to fine."""
    interval = median_step(motion.time)
    steps = [interval / steps for steps in STEPS_PER_SAMPLE] if interval else []
    some = has_exponential(machine)
    methods = sorted(name for name, of in METHODS.items() if of.with_edges or of.with_edges is False and some)
    return [
        [Setting("exact")],
        *([Setting(method, "rtol", rtol) for rtol in RTOLS] for method in methods),
        *([Setting(method, "step", step) for step in steps] for method in methods),
    ]


def reference_run(machine: Machine, motion: Motion) -> tuple[Reference, Solution, Array, ErrorMetric]:
    """The reference, its solution and loads [N], and which loads these are. Raises RunError if no method gives one."""
    problems: list[str] = []
    runs: list[tuple[Setting, Solution, Array]] = []
    metric: ErrorMetric | None = None
    for settings in REFERENCE_SETTINGS:
        for setting in settings if len(runs) < 2 else ():
            try:
                solution = solve(machine, motion, setting)
            except GuideloadError as error:
                problems.append(f"{setting.text}: {error}")
                continue
            metric = metric or ErrorMetric.choose(machine, solution)
            runs.append((setting, solution, metric.loads(solution)))
            break
    if metric is None:
        raise RunError(f"no method gives a reference for the chart. {'. '.join(problems)}")
    (setting, solution, loads), *checks = runs
    largest = float(np.abs(loads).max(initial=0.0))
    dynamic = difference(loads, metric.static)
    rounding = float(np.finfo(float).eps) * largest
    reference = Reference(
        setting=setting,
        check=checks[0][0] if checks else None,
        largest_load=largest,
        largest_dynamic=dynamic if dynamic > ROUNDING * largest else None,
        limit=max(difference(checks[0][2], loads), rounding) if checks else None,
        problems=tuple(problems),
    )
    return reference, solution, loads, metric


@dataclass(eq=False)
class _Runner:
    """Runs settings until the deadline, compares their loads with the reference, and records their times."""

    machine: Machine
    motion: Motion
    metric: ErrorMetric
    expected: Array  # loads of the reference [N]
    reference: Reference
    budget: float  # s
    deadline: float  # of perf_counter [s]
    rows: dict[Setting, SettingResult] = field(default_factory=dict)
    # Times [s] of each setting; settings of the same run share one list.
    times: dict[Setting, list[float]] = field(default_factory=dict)
    # Of each curve the last setting, and the time that it took, or was predicted to take [s].
    last: dict[tuple[str, str | None], tuple[Setting, float]] = field(default_factory=dict)

    def run(self, setting: Setting) -> None:
        """Run a setting once; its row has the errors, or says why it failed or was skipped."""
        # The time predicted is that of the setting before it on the curve.
        before, predicted = self.last.get(setting.curve, (setting, 0.0))
        if setting.kind == "step" and setting.value and before.value:
            predicted *= before.value / setting.value
        left = self.deadline - perf_counter()
        if predicted >= left:
            why = f"it would take about {predicted:.2g} s, and {left:.2g} s of the {self.budget:g} s are left"
            why = why if left > 0.0 else f"the budget of {self.budget:g} s is used up"
            self.rows[setting] = SettingResult(setting, failed=f"skipped: {why}")
            self.last[setting.curve] = setting, predicted
            return
        began = perf_counter()
        try:
            solution = solve(self.machine, self.motion, setting)
            loads = self.metric.loads(solution)
        except GuideloadError as error:
            self.rows[setting] = SettingResult(setting, failed=str(error))
            return
        finally:
            seconds = perf_counter() - began
            self.last[setting.curve] = setting, seconds
        row = self.rows[setting] = self._compared(setting, solution, loads)
        same = (times for other, times in self.times.items() if row.same_run(self.rows[other]))
        self.times[setting] = next(same, [])
        self.times[setting].append(seconds)

    def repeat(self) -> int:
        """Run everything that ran once more, in rounds, while time is left; returns how often each ran at least."""
        runs = {id(times): (setting, times) for setting, times in self.times.items()}
        for repetitions in range(1, MOST_REPETITIONS):
            if perf_counter() + sum(max(times) for _, times in runs.values()) > self.deadline:
                return repetitions
            for setting, times in runs.values():
                began = perf_counter()
                self.metric.loads(solve(self.machine, self.motion, setting))
                times.append(perf_counter() - began)
        return MOST_REPETITIONS

    def timed_row(self, setting: Setting) -> SettingResult:
        """The row of a setting, with its time if it ran."""
        if setting not in self.times:
            return self.rows[setting]
        times = self.times[setting]
        low, middle, high = (float(quartile) for quartile in np.percentile(times, (25, 50, 75)))
        return replace(self.rows[setting], seconds=middle, spread=high - low if len(times) > 1 else None)

    def _compared(self, setting: Setting, solution: Solution, loads: Array) -> SettingResult:
        """The row of a run without its time."""
        limit, distance = self.reference.limit or 0.0, difference(loads, self.expected)
        error = max(distance, limit)
        return SettingResult(
            setting,
            steps=solution.steps,
            rejected=solution.rejected,
            error=error,
            load_error=self.reference.over_load(error),
            dynamic_error=self.reference.over_dynamic(error),
            below_reference=distance <= limit,
        )
