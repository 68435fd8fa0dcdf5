"""The work-precision diagram: Pareto optimality, errors, reference, budget, and the command that writes it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from command_line import MACHINE, guideload, names, refused, write_trace
from reference import cart, cart_stiff, cycle, noisy, paper, piece, preloaded

from guideload import Body, Link, Machine, Motion, WorkPrecision, plots, simulate
from guideload.base.errors import ArgumentError, RunError
from guideload.cli.outputs import CHART
from guideload.method_comparison import runner
from guideload.method_comparison.diagram import Setting, SettingResult
from guideload.method_comparison.runner import MOST_REPETITIONS, RTOLS, STEPS_PER_SAMPLE, work_precision
from guideload.plots.work_precision_diagram import NOTE
from guideload.reports.work_precision import chart_report

SETTINGS = 1 + 2 * len(RTOLS) + 2 * len(STEPS_PER_SAMPLE)
START = piece(cycle(), 500, 1200)  # from rest up to speed, and on
SHORT = piece(cycle(), 560, 760)
AT_REST = Motion.along_x(START.time, 0.0 * START.time)


@pytest.fixture(scope="module", autouse=True)
def few_repetitions() -> Iterator[None]:
    """No test here needs precise times."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(runner, "MOST_REPETITIONS", 2)
        yield


@pytest.fixture(scope="module")
def chart() -> WorkPrecision:
    return work_precision(cart(), START)


@pytest.fixture(scope="module")
def stiff() -> WorkPrecision:
    return work_precision(cart_stiff(), START)


def curve(chart: WorkPrecision, method: str, kind: str) -> list[SettingResult]:
    return [row for row in chart.rows if row.setting.curve == (method, kind)]


@pytest.fixture
def before_runs(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[Setting], None]], list[Setting]]:
    """Call a function before every run; returns the settings that were run."""

    def watch(before: Callable[[Setting], None]) -> list[Setting]:
        runs: list[Setting] = []
        solve = runner.solve

        def watched(machine: Machine, motion: Motion, setting: Setting) -> object:
            before(setting)
            runs.append(setting)
            return solve(machine, motion, setting)

        monkeypatch.setattr(runner, "solve", watched)
        return runs

    return watch


# ---- rows


def test_pareto_optimal_rows_are_not_beaten_and_beat_the_rest(
    chart: WorkPrecision, stiff: WorkPrecision
) -> None:
    for each in (chart, stiff):
        costs = np.array([row.cost for row in each.rows if row.cost])
        optimal = np.array([row.pareto_optimal for row in each.rows if row.cost])
        no_worse = (costs[:, None] <= costs[None]).all(axis=2)  # [i, j]: i is no worse than j
        beats = no_worse & ~no_worse.T
        np.testing.assert_array_equal(optimal, ~beats.any(axis=0))
        assert optimal.any() and beats[optimal].any(axis=0)[~optimal].all()


def test_every_setting_has_a_row_in_the_table(chart: WorkPrecision, stiff: WorkPrecision) -> None:
    assert len(chart.rows) == SETTINGS == len({row.setting for row in chart.rows})
    steps = [row.setting.value for row in curve(chart, "rk45", "step")]
    assert steps == pytest.approx([1e-3 / count for count in STEPS_PER_SAMPLE])
    table = chart.table()
    assert list(table["error_N"]) == [row.error for row in chart.rows]
    assert list(table["seconds"] > 0.0) == [True] * SETTINGS
    assert list(table["picked_by_auto"]) == [True] + [False] * (SETTINGS - 1)
    assert table["failed"].isna().all()
    assert stiff.table()["steps"].isna().sum() == sum(row.failed is not None for row in stiff.rows)


def test_errors_fall_with_the_tolerance(chart: WorkPrecision, stiff: WorkPrecision) -> None:
    for rows in (curve(each, method, "rtol") for each in (chart, stiff) for method in ("implicit", "rk45")):
        errors = np.array([row.error for row in rows])
        assert np.all(
            errors[1:] <= 1.2 * errors[:-1]
        )  # equal where samples limit the step; rounding at the end
        assert all(row.load_error <= row.setting.value for row in rows)


def test_fixed_steps_show_the_order_of_rk45(chart: WorkPrecision) -> None:
    errors = [row.error for row in curve(chart, "rk45", "step")][:4]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert orders[-1] == pytest.approx(5.0, abs=0.1)


def test_errors_are_the_largest_difference_of_the_loads(chart: WorkPrecision) -> None:
    machine = cart()
    exact, rk45 = (simulate(machine, START, method) for method in ("exact", "rk45"))
    static = machine.static_carriage_loads[:, :3]
    force = exact.carriage_loads[:, :, :3]
    (row,) = [row for row in chart.rows if row.setting == Setting("rk45", "rtol", 1e-6)]
    error = np.abs(rk45.carriage_loads[:, :, :3] - force).max()
    assert row.error == error
    assert row.load_error == error / np.abs(force).max()
    assert row.dynamic_error == error / np.abs(force - static).max()
    assert row.dynamic_error > 3 * row.load_error  # the weight hides the motion


def test_the_reference_is_exact_and_bounds_the_errors_from_below(chart: WorkPrecision) -> None:
    reference = chart.reference
    assert reference.setting == Setting("exact") and reference.check == Setting("implicit", "rtol", 1e-13)
    assert reference.limit < 1e-13 * reference.largest_load
    assert chart.rows[0].below_reference
    assert all((row.error == reference.limit) == row.below_reference for row in chart.rows)
    assert all(row.error >= reference.limit for row in chart.rows)
    assert "cross-checked by implicit at rtol 1e-13: they agree within" in reference.text


def test_the_row_that_auto_picks_is_known(chart: WorkPrecision) -> None:
    assert chart.auto_method == "exact" and "matrix exponential" in chart.auto_reason
    assert chart.auto_row is chart.rows[0]
    assert replace(chart, auto_method="implicit").auto_row.setting == Setting("implicit", "rtol", 1e-6)
    assert replace(chart, auto_method=None).auto_row is None


def test_equal_runs_have_one_time() -> None:
    """Where every sample is a bend, these and not the tolerance set the steps."""
    chart = work_precision(cart(), piece(noisy(), 500, 1200))
    runs = chart.runs()
    assert [row for rows in runs for row in rows] == list(chart.rows)
    together = next(rows for rows in runs if rows[0].setting == Setting("rk45", "rtol", 1e-3))
    assert len(together) >= 3 and {row.steps for row in together} == {START.time.size - 1}
    assert len({row.seconds for row in together}) == 1


def test_everything_except_the_times_is_repeatable(chart: WorkPrecision) -> None:
    def timeless(each: WorkPrecision) -> list[SettingResult]:
        return [replace(row, seconds=None, spread=None, pareto_optimal=False) for row in each.rows]

    again = work_precision(cart(), START)
    assert timeless(again) == timeless(chart)
    assert again.reference == chart.reference


def test_a_method_that_fails_has_rows_and_one_sentence_that_say_why(stiff: WorkPrecision) -> None:
    steps = curve(stiff, "rk45", "step")
    failed = [row for row in steps if row.failed is not None]
    assert 0 < len(failed) < len(steps) and failed == steps[: len(failed)]  # the longest steps
    assert all(replace(row, failed=None) == SettingResult(row.setting) for row in failed)
    assert all("stability region" in row.failed for row in failed)
    text = " ".join(chart_report(stiff).text().split())
    assert text.count("the solution grew without bound") == 1
    assert "rk45 at step 1 ms: the solution grew" in text and "; the same at 0.5 ms to" in text


# ---- less to compare


@pytest.mark.parametrize(
    ("failing", "setting", "check"),
    [
        (("exact",), Setting("implicit", "rtol", 1e-13), Setting("rk45", "rtol", 1e-13)),
        (("exact", "rk45"), Setting("implicit", "rtol", 1e-13), None),
        (("exact", "implicit", "rk45"), None, None),
    ],
)
def test_the_reference_is_the_first_method_that_runs(
    failing: tuple[str, ...],
    setting: Setting | None,
    check: Setting | None,
    before_runs: Callable[..., object],
) -> None:
    def fail(setting: Setting) -> None:
        if setting.method in failing:
            raise RunError(f"{setting.method} cannot")

    before_runs(fail)
    if setting is None:
        with pytest.raises(
            RunError, match="no method gives a reference.*exact cannot.*implicit cannot.*rk45"
        ):
            work_precision(cart(), START)
        return
    chart = work_precision(cart(), START)
    assert chart.rows[0] == SettingResult(Setting("exact"), failed="exact cannot")
    assert {row.setting.method for row in chart.rows if row.failed} == set(failing)
    assert (chart.reference.setting, chart.reference.check) == (setting, check)
    if check is None:
        assert chart.reference.limit is None
        assert (
            "not cross-checked (exact: exact cannot; rk45 at rtol 1e-13: rk45 cannot" in chart.reference.text
        )
    else:
        assert chart.reference.limit < 1e-11 * chart.reference.largest_load


def test_auto_that_fails_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object, **__: object) -> None:
        raise RunError("no way")

    monkeypatch.setattr(runner, "simulate", fails)
    chart = work_precision(cart(), START)
    assert (chart.auto_method, chart.auto_reason, chart.auto_row) == (None, "no way", None)
    assert "auto fails: no way." in chart_report(chart).text()


def test_the_error_metric_is_of_links_where_carriages_hide_the_motion_or_are_missing(
    chart: WorkPrecision,
) -> None:
    assert "forces of the carriages" in chart.error_metric
    hidden = work_precision(paper(), START)
    assert "loads of the carriages' links" in hidden.error_metric and "hide the motion" in hidden.error_metric
    assert hidden.reference.largest_dynamic > 1000.0
    links = [Link(name="a", point=(0.0, 0.0, 0.0), direction=(1.0, 0.0, 0.0), stiffness=1e7, damping=1e3)]
    body = Body(mass=100.0, center_of_mass=(0.0, 0.0, 0.0), inertia=np.eye(3))
    bare = work_precision(Machine(body=body, links=links, free=("x",)), START)
    assert bare.error_metric == "the loads of the links: the machine has no carriages"
    assert bare.reference.largest_dynamic == pytest.approx(100.0 * 2.2, rel=0.1)


def test_where_nothing_moves_there_is_no_dynamic_error() -> None:
    chart = work_precision(cart(), AT_REST)
    assert all(row.dynamic_error is None and row.load_error < 1e-12 for row in chart.rows if not row.failed)
    assert "nan" not in chart_report(chart).text().lower()
    assert "(nothing moves)" in plots.work_precision(chart).get_xlabel()


def test_without_any_load_there_is_no_error() -> None:
    chart = work_precision(cart().model_copy(update={"gravity": (0.0, 0.0, 0.0)}), AT_REST)
    assert all(row.load_error is None and row.dynamic_error is None for row in chart.rows)
    assert "nan" not in chart_report(chart).text().lower()
    assert "no load" in plots.work_precision(chart).texts[0].get_text()


def test_a_motion_of_one_instant_has_no_fixed_steps() -> None:
    chart = work_precision(cart(), Motion.along_x([0.7, 0.7], [0.0, 2.2]))
    assert [row.setting.kind for row in chart.rows] == [None] + 2 * len(RTOLS) * ["rtol"]
    assert all(row.failed is None and row.steps == 0 for row in chart.rows)
    assert (
        "0 samples" not in chart_report(chart).text() and "2 samples over 0 s" in chart_report(chart).text()
    )


# ---- the budget


def test_the_budget_is_kept(
    monkeypatch: pytest.MonkeyPatch, before_runs: Callable[..., list[Setting]]
) -> None:
    now = 0.0

    def takes_a_second(_: Setting) -> None:
        nonlocal now
        now += 1.0

    monkeypatch.setattr(runner, "perf_counter", lambda: now)
    runs = before_runs(takes_a_second)
    chart = work_precision(cart(), START, budget=10.0)
    assert len(runs) <= 10 and now <= 10.0
    ran = [row for row in chart.rows if row.failed is None]
    assert ran[0].setting == Setting("exact") and ran[0].seconds == 1.0 and ran[0].spread is None
    assert chart.repetitions == 1 and len(chart.rows) == SETTINGS
    skipped = [row.failed for row in chart.rows if row.failed is not None]
    assert all(text.startswith("skipped: ") for text in skipped)
    assert "skipped: it would take about 2 s, and 1 s of the 10 s are left" in skipped
    del runs[:]
    once = 2 + SETTINGS
    chart = work_precision(cart(), START, budget=1000.0)
    assert chart.repetitions == runner.MOST_REPETITIONS < MOST_REPETITIONS
    assert once < len(runs) <= once + SETTINGS and all(row.spread == 0.0 for row in chart.rows)


def test_the_time_of_a_finer_step_is_predicted(
    monkeypatch: pytest.MonkeyPatch, before_runs: Callable[..., object]
) -> None:
    now = 0.0

    def takes_by_step(setting: Setting) -> None:
        nonlocal now
        now += 1e-3 / setting.value if setting.kind == "step" else 0.01

    monkeypatch.setattr(runner, "perf_counter", lambda: now)
    before_runs(takes_by_step)
    chart = work_precision(cart(), START, budget=12.0)
    for method, counts in (("implicit", [1, 2, 4]), ("rk45", [1, 2])):  # 4 s more would exceed the 12
        steps = [row.setting.value for row in curve(chart, method, "step") if row.failed is None]
        assert 1e-3 / np.array(steps) == pytest.approx(counts)
    assert now <= 12.0


@pytest.mark.parametrize("budget", [0.0, -1.0, np.nan, np.inf, "20", True])
def test_bad_budgets_are_refused(budget: object) -> None:
    with pytest.raises(ArgumentError, match="budget: expected a number"):
        work_precision(cart(), START, budget=budget)


# ---- preload


def test_preload_has_curves_of_the_exponential_method_and_other_machines_have_none(
    chart: WorkPrecision,
) -> None:
    assert not curve(chart, "exponential", "rtol")
    assert not curve(work_precision(mixed(), SHORT, budget=0.5), "exponential", "rtol")
    found = work_precision(preloaded(5000.0), SHORT)
    rows, steps = (curve(found, "exponential", kind) for kind in ("rtol", "step"))
    assert len(rows) == len(RTOLS) and len(steps) == len(STEPS_PER_SAMPLE)
    assert found.auto_row in rows and found.auto_row.setting.value == 1e-6
    assert all(row.load_error <= 10.0 * row.setting.value for row in rows if row.setting.value >= 1e-11)
    errors = [row.error for row in steps[:4]]  # no row opens
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx(4.0, abs=0.2)
    text = chart_report(found).text()
    assert "auto picks exponential" in " ".join(text.split())
    assert max(len(line) for line in text.splitlines()) <= 80 and "…" not in text
    legend = plots.work_precision(found).get_legend().get_texts()
    assert {"exponential, tolerance", "exponential, fixed step"} <= {label.get_text() for label in legend}


def mixed() -> Machine:
    """Preload across, clearance along z."""
    return cart(preload_y=1200.0, rolling="ball", clearance_z=3e-6)


# ---- text and picture


def test_the_picture_shows_the_rows(chart: WorkPrecision, stiff: WorkPrecision) -> None:
    for each in (chart, stiff):
        ax = plots.work_precision(each)
        drawn = np.concatenate([line.get_xydata() for line in ax.lines])
        expected = [(row.dynamic_error, row.seconds) for row in each.rows if row.failed is None]
        apart = np.abs(drawn[None] / np.array(expected)[:, None] - 1.0).max(axis=2)
        assert apart.min(axis=1).max() <= 1e-9
        left, right = ax.get_xlim()
        assert left > right  # the error falls to the right
        texts = {text.get_text() for text in (*ax.texts, *ax.get_legend().get_texts())}
        assert {"exact", "implicit, tolerance", "rk45, fixed step", "auto picks this"} <= texts
    assert "without a result: rk45 at step 1 ms to" in ax.get_xlabel()
    rows = tuple(replace(row, failed="x") if i % 2 else row for i, row in enumerate(chart.rows))
    label = plots.work_precision(replace(chart, rows=rows)).get_xlabel()
    assert max(map(len, label.splitlines())) <= NOTE < len(label.partition("without")[2])


# ---- the command


@pytest.fixture
def trace(tmp_path: Path) -> str:
    return write_trace(tmp_path / "trace.csv", 400, 0.1)


def test_the_command_writes_its_files_and_replaces_only_these(tmp_path: Path, trace: str) -> None:
    out = tmp_path / "new" / "out"
    command = ("chart", MACHINE, trace, "-o", out, "--budget", "5")
    printed = guideload(*command).stdout
    assert names(out) == {*CHART, "report.txt"} and names(out.parent) == {"out"}
    assert (out / "report.txt").read_text(encoding="utf-8").strip() in printed
    assert printed.endswith(f"Wrote {out}.\n")
    table = pd.read_csv(out / "chart.csv")
    assert len(table) == SETTINGS and table["picked_by_auto"].sum() == 1
    assert (out / "chart.png").read_bytes().startswith(b"\x89PNG")
    assert "is not empty" in refused(*command)
    options = ("--free", "rx,ry,rz", "--kind", "velocity", "--rate", "500")
    assert "free rx, ry, rz" in guideload(*command, "--overwrite", "--no-pictures", *options).stdout
    assert names(out) == {"chart.csv", "report.txt"}
