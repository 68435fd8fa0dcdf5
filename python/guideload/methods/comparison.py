"""Every method on a user's own scene, over its tolerances and fixed steps, timed and compared with a reference."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import zip_longest
from time import perf_counter

import numpy as np

from guideload._core import Solution
from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError, GuideloadError, RunError
from guideload.machine.laws import NO_EXACT
from guideload.machine.machine import Machine
from guideload.methods.diagram import AUTO_RTOL, Reference, Row, Setting, WorkPrecision, pareto_optimal
from guideload.methods.error_metric import ErrorMetric, difference
from guideload.motion.motion import Motion
from guideload.simulation.simulation import simulate

RTOLS = tuple(float(f"1e-{digits}") for digits in range(3, 13))
PARTS_OF_A_SAMPLE = (1, 2, 4, 8, 16, 32)  # fixed steps; a longer one would be cut at every sample
# Of a reference, in this order: of each method the tightest tolerance that it can meet.
REFERENCE_METHODS: dict[str, tuple[float | None, ...]] = {
    "exact": (None,),
    "implicit": (1e-13, 1e-12),
    "rk45": (1e-13, 1e-12),
}
STILL = 1e-12  # of the largest load: a dynamic load below it is rounding
MOST_REPETITIONS = 15  # of which the median is known to some percent; more would only take longer


def work_precision(machine: Machine, motion: Motion, *, budget: float = 20.0) -> WorkPrecision:
    """Run every method over its range of tolerances and fixed steps, and compare the loads with a reference.

    budget: s that all runs together may take. The reference is computed whatever it takes; then every setting
    runs once, the coarse ones of all methods first, but for those that the time left is not enough for; and
    again as often as the rest allows. A run under way is not cut short.

    A method that fails is a row that says why. Raises RunError if no method at all gives a reference;
    ArgumentError and TypeError for arguments that are none; SceneError for an unsupported body.
    """
    ends = perf_counter() + _seconds(budget)
    auto_method, auto_reason = _auto(machine, motion)
    reference, expected, judged = _reference(machine, motion)
    bench = _Bench(machine, motion, judged, expected, reference, float(budget), ends)
    ladders = _ladders(motion)
    for turn in zip_longest(*ladders):
        for setting in filter(None, turn):
            bench.add(setting)
    repetitions = bench.repeat()
    rows = [bench.timed(setting) for ladder in ladders for setting in ladder]
    return WorkPrecision(
        machine=machine,
        rows=tuple(replace(row, pareto_optimal=pareto_optimal(row, rows)) for row in rows),
        reference=reference,
        judged=judged.text,
        auto_method=auto_method,
        auto_reason=auto_reason,
        samples=motion.time.size,
        duration=float(np.ptp(motion.time)),
        repetitions=repetitions,
        budget=float(budget),
    )


def _seconds(budget: object) -> float:
    if isinstance(budget, bool) or not isinstance(budget, int | float) or not 0.0 < budget < np.inf:
        raise ArgumentError(f"budget: expected a number > 0, in s, got {budget!r}")
    return float(budget)


def _auto(machine: Machine, motion: Motion) -> tuple[str | None, str]:
    """What `auto` picks and why; none, and the reason, if it fails."""
    try:
        result = simulate(machine, motion, rtol=AUTO_RTOL)
    except RunError as error:
        return None, str(error)
    return result.method, result.reason


def _ladders(motion: Motion) -> list[list[Setting]]:
    """The settings of each method from coarse to fine."""
    ladders = [[Setting("exact")]]
    for method in ("implicit", "rk45"):
        ladders.append([Setting(method, "rtol", rtol) for rtol in RTOLS])
    intervals = np.diff(motion.time)
    intervals = intervals[intervals > 0.0]
    if intervals.size:
        interval = float(np.median(intervals))
        for method in ("implicit", "rk45"):
            ladders.append([Setting(method, "step", interval / parts) for parts in PARTS_OF_A_SAMPLE])
    return ladders


def _solved(
    machine: Machine, motion: Motion, setting: Setting, judged: ErrorMetric | None
) -> tuple[Solution, Array]:
    """One run, from the motion to the judged loads (time, loads) [N]; without loads if none are judged yet."""
    solution = machine.scene.solve(
        motion.time,
        motion.acceleration,
        motion.wrench,
        method=setting.method,
        rtol=setting.value if setting.kind == "rtol" and setting.value else AUTO_RTOL,
        step=setting.value if setting.kind == "step" else None,
    )
    return solution, np.empty((0, 0)) if judged is None else judged.of(solution)


def _reference(machine: Machine, motion: Motion) -> tuple[Reference, Array, ErrorMetric]:
    """The reference, its judged loads (time, loads) [N], and which these are."""
    problems: list[str] = []
    witnesses: list[tuple[Setting, Array]] = []
    judged: ErrorMetric | None = None
    for method, rtols in REFERENCE_METHODS.items():
        for rtol in rtols:
            setting = Setting(method) if rtol is None else Setting(method, "rtol", rtol)
            try:
                solution, _ = _solved(machine, motion, setting, None)
            except GuideloadError as error:
                problems.append(f"{setting.text}: {error}")
                continue
            judged = judged or ErrorMetric.chosen(machine, solution)
            witnesses.append((setting, judged.of(solution)))
            break
        if len(witnesses) == 2:
            break
    if judged is None:
        raise RunError(f"no method gives a reference for the chart. {'. '.join(problems)}")
    (setting, expected), *others = witnesses
    largest = float(np.abs(expected).max(initial=0.0))
    dynamic = difference(expected, judged.static)
    rounding = float(np.finfo(float).eps) * largest
    limits = [max(difference(loads, expected), rounding) for _, loads in others]
    reference = Reference(
        setting=setting,
        check=others[0][0] if others else None,
        largest_load=largest,
        largest_dynamic=dynamic if dynamic > STILL * largest else None,
        limit=limits[0] if limits else None,
        problems=tuple(problems),
    )
    return reference, expected, judged


@dataclass(eq=False)
class _Bench:
    """Runs settings until the budget ends, compares them with the reference, and keeps their times."""

    machine: Machine
    motion: Motion
    judged: ErrorMetric
    expected: Array
    reference: Reference
    budget: float
    ends: float  # perf_counter
    rows: dict[Setting, Row] = field(default_factory=dict)
    clocks: dict[Setting, list[float]] = field(default_factory=dict)  # s; settings of equal runs share one
    costs: dict[tuple[str, str | None], tuple[Setting, float]] = field(default_factory=dict)  # s, of the last

    def add(self, setting: Setting) -> None:
        """Run a setting once, or say why not: it fails, or would take longer than is left."""
        if setting.method == "exact" and self.machine.model_level == "smooth nonlinear":
            self.rows[setting] = Row(setting, failed=NO_EXACT)
            return
        predicted, left = self._predicted(setting), self.ends - perf_counter()
        if predicted >= left:
            self.rows[setting] = Row(setting, failed=_skipped(predicted, left, self.budget))
            self.costs[setting[:2]] = setting, predicted
            return
        began = perf_counter()
        try:
            solution, loads = _solved(self.machine, self.motion, setting, self.judged)
        except GuideloadError as error:
            self.rows[setting] = Row(setting, failed=str(error))
            self.costs[setting[:2]] = setting, perf_counter() - began
            return
        seconds = perf_counter() - began
        self.costs[setting[:2]] = setting, seconds
        row = _compared(setting, solution, difference(loads, self.expected), self.reference)
        self.clocks[setting] = self._clock_of_equal_run(row)
        self.clocks[setting].append(seconds)
        self.rows[setting] = row

    def repeat(self) -> int:
        """Run all that ran once more, in rounds, while time is left; returns how often each ran at least."""
        turns = {id(clock): (setting, clock) for setting, clock in self.clocks.items()}
        for repetitions in range(1, MOST_REPETITIONS):
            if perf_counter() + sum(max(clock) for _, clock in turns.values()) > self.ends:
                return repetitions
            for setting, clock in turns.values():
                began = perf_counter()
                _solved(self.machine, self.motion, setting, self.judged)
                clock.append(perf_counter() - began)
        return MOST_REPETITIONS

    def timed(self, setting: Setting) -> Row:
        """The row of a setting, with its time."""
        clock = self.clocks.get(setting)
        if clock is None:
            return self.rows[setting]
        low, middle, high = (float(part) for part in np.percentile(clock, (25, 50, 75)))
        return replace(self.rows[setting], seconds=middle, spread=high - low if len(clock) > 1 else None)

    def _predicted(self, setting: Setting) -> float:
        """Time of a run [s], from that of the setting before it; 0 for the first."""
        before, seconds = self.costs.get(setting[:2], (setting, 0.0))
        if setting.kind == "step" and setting.value and before.value:
            return seconds * before.value / setting.value
        return seconds

    def _clock_of_equal_run(self, row: Row) -> list[float]:
        """That of an earlier tolerance under which the same run was made, as where samples limit the step."""
        for setting, clock in self.clocks.items():
            if row.setting[:2] == setting[:2] and replace(row, setting=setting) == self.rows[setting]:
                return clock
        return []


def _compared(setting: Setting, solution: Solution, distance: float, reference: Reference) -> Row:
    """A row without its time. distance: largest difference from the reference [N]."""
    limit = reference.limit or 0.0
    error = max(distance, limit)
    return Row(
        setting,
        steps=solution.steps,
        rejected=solution.rejected,
        error=error,
        load_error=reference.of_load(error),
        dynamic_error=reference.of_dynamic(error),
        below_reference=distance <= limit,
    )


def _skipped(predicted: float, left: float, budget: float) -> str:
    if left <= 0.0:
        return f"skipped: the budget of {budget:g} s is used up"
    return f"skipped: it would take about {predicted:.2g} s, and {left:.2g} s of the {budget:g} s are left"
