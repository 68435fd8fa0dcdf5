"""The chart of speed against accuracy: its front, its reference, its budget, and the command that writes it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner, Result
from reference import cart, cart_stiff, cycle, noisy, paper, piece

import guideload
from guideload import Body, Link, Machine, Motion, WorkPrecision, plots
from guideload.base.errors import ArgumentError, RunError
from guideload.cli.inputs import EXAMPLES
from guideload.cli.main import main
from guideload.cli.outputs import CHART, MANIFEST
from guideload.methods import runner
from guideload.methods.diagram import Row, Setting, pareto_optimal
from guideload.methods.runner import RTOLS, STEPS_PER_SAMPLE, work_precision
from guideload.reports.work_precision import chart_report

MACHINE = str(EXAMPLES / "manipulator.toml")
SETTINGS = 1 + 2 * len(RTOLS) + 2 * len(STEPS_PER_SAMPLE)
START = piece(cycle(), 500, 1200)  # out of rest, up to speed, and on


@pytest.fixture(scope="module", autouse=True)
def few_repetitions() -> Iterator[None]:
    """No chart here needs good times, and none must run out of budget on a busy machine."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(runner, "MOST_REPETITIONS", 2)
        yield


def with_times_of_work(chart: WorkPrecision) -> WorkPrecision:
    """The same chart with times by the number of steps, so that its picture is the same on every machine."""
    cost = {"exact": 5e-8, "implicit": 1.5e-7, "rk45": 1.2e-7}
    rows = [
        row if row.failed else replace(row, seconds=cost[row.setting.method] * (row.steps + row.rejected))
        for row in chart.rows
    ]
    return replace(chart, rows=tuple(replace(row, pareto_optimal=pareto_optimal(row, rows)) for row in rows))


@pytest.fixture(scope="module")
def chart() -> WorkPrecision:
    return work_precision(cart(), START)


@pytest.fixture(scope="module")
def stiff() -> WorkPrecision:
    return work_precision(cart_stiff(), START)


def ladder(chart: WorkPrecision, method: str, kind: str) -> list[Row]:
    return [row for row in chart.rows if row.setting[:2] == (method, kind)]


@pytest.fixture
def solved(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[Setting], None]], list[Setting]]:
    """Call a function before every run of the chart; returns the settings that were run."""

    def watched(before: Callable[[Setting], None]) -> list[Setting]:
        runs: list[Setting] = []
        true_solved = runner._solved

        def solve(machine: Machine, motion: Motion, setting: Setting, judged: object) -> object:
            before(setting)
            runs.append(setting)
            return true_solved(machine, motion, setting, judged)

        monkeypatch.setattr(runner, "_solved", solve)
        return runs

    return watched


# ---- what the rows say


def test_front_is_not_beaten_and_beats_the_rest(chart: WorkPrecision, stiff: WorkPrecision) -> None:
    def beats(one: Row, other: Row) -> bool:
        first, second = (one.seconds, one.error), (other.seconds, other.error)
        return first != second and all(a <= b for a, b in zip(first, second, strict=True))

    for each in (chart, stiff):
        ran = [row for row in each.rows if row.failed is None]
        front = [row for row in ran if row.pareto_optimal]
        assert front
        for row in ran:
            assert row.pareto_optimal == (not any(beats(other, row) for other in ran))
            assert row.pareto_optimal or any(beats(one, row) for one in front)


def test_every_setting_has_a_row(chart: WorkPrecision) -> None:
    assert len(chart.rows) == SETTINGS == len({row.setting for row in chart.rows})
    assert all(row.failed is None and row.seconds is not None for row in chart.rows)
    assert [row.setting.value for row in ladder(chart, "rk45", "step")] == pytest.approx(
        [1e-3 / parts for parts in STEPS_PER_SAMPLE]
    )


@pytest.mark.parametrize("name", ["chart", "stiff"])
def test_errors_fall_with_the_tolerance(name: str, request: pytest.FixtureRequest) -> None:
    each: WorkPrecision = request.getfixturevalue(name)
    for method in ("implicit", "rk45"):
        errors = [row.error for row in ladder(each, method, "rtol")]
        for error, finer in zip(errors[:-1], errors[1:], strict=True):
            assert finer <= 1.2 * error  # equal where the samples limit the step; rounding at the end
        for row in ladder(each, method, "rtol"):
            assert row.load_error <= row.setting.value


def test_fixed_steps_show_the_order_of_rk45(chart: WorkPrecision) -> None:
    errors = [row.error for row in ladder(chart, "rk45", "step")][:4]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert orders[-1] == pytest.approx(5.0, abs=0.1)


def test_errors_are_the_largest_difference_of_the_loads(chart: WorkPrecision) -> None:
    machine = cart()
    exact, rk45 = (guideload.simulate(machine, START, method) for method in ("exact", "rk45"))
    static = machine.scene.static_group_loads(machine.links_of_carriages, machine.carriage_centers)[:, :3]
    force = exact.carriage_loads[:, :, :3]
    (row,) = [row for row in chart.rows if row.setting == Setting("rk45", "rtol", 1e-6)]
    error = np.abs(rk45.carriage_loads[:, :, :3] - force).max()
    assert row.error == error
    assert row.load_error == error / np.abs(force).max()
    assert row.dynamic_error == error / np.abs(force - static).max()
    assert row.dynamic_error > 3 * row.load_error  # the weight hides the motion


def test_the_reference_is_exact_and_says_how_far_it_can_be_trusted(chart: WorkPrecision) -> None:
    reference = chart.reference
    assert reference.setting == Setting("exact") and reference.check == Setting("implicit", "rtol", 1e-13)
    assert reference.limit < 1e-13 * reference.largest_load
    exact = chart.rows[0]
    assert exact.below_reference and exact.error == reference.limit
    assert all(row.error >= reference.limit for row in chart.rows)
    assert all(row.error > reference.limit for row in chart.rows if not row.below_reference)
    assert "cross-checked by implicit at rtol 1e-13: they agree within" in reference.text


def test_auto_is_marked(chart: WorkPrecision) -> None:
    assert chart.auto_method == "exact" and "matrix exponential" in chart.auto_reason
    assert chart.auto_row is chart.rows[0]
    other = replace(chart, auto_method="implicit")
    assert other.auto_row.setting == Setting("implicit", "rtol", 1e-6)
    assert replace(chart, auto_method=None).auto_row is None


def test_equal_runs_have_one_time() -> None:
    """Where every sample is a bend, these and not the tolerance set the steps."""
    chart = work_precision(cart(), piece(noisy(), 500, 1200))
    runs = chart.runs()
    assert [row for rows in runs for row in rows] == list(chart.rows)
    together = next(rows for rows in runs if rows[0].setting == Setting("rk45", "rtol", 1e-3))
    assert len(together) >= 3 and {row.steps for row in together} == {START.time.size - 1}
    assert len({row.seconds for row in together}) == 1


def test_all_but_the_times_is_repeatable(chart: WorkPrecision) -> None:
    def timeless(each: WorkPrecision) -> list[Row]:
        return [replace(row, seconds=None, spread=None, pareto_optimal=False) for row in each.rows]

    again = work_precision(cart(), START)
    assert timeless(again) == timeless(chart)
    assert again.reference == chart.reference


def test_a_failing_method_is_told(stiff: WorkPrecision) -> None:
    steps = ladder(stiff, "rk45", "step")
    failed = [row for row in steps if row.failed is not None]
    assert [row.setting.value for row in failed] == [row.setting.value for row in steps[: len(failed)]]
    assert 0 < len(failed) < len(steps)
    for row in failed:
        assert "stability region" in row.failed
        assert (row.seconds, row.error, row.dynamic_error, row.pareto_optimal) == (None, None, None, False)
    text = " ".join(chart_report(stiff).split())
    assert text.count("the solution grew without bound") == 1
    assert "rk45 at step 1 ms: the solution grew" in text and "; the same at 0.5 ms to" in text


# ---- where there is less to compare


def refuse(*methods: str) -> Callable[[Setting], None]:
    def before(setting: Setting) -> None:
        if setting.method in methods:
            raise RunError(f"{setting.method} cannot")

    return before


def test_where_exact_cannot_implicit_is_the_reference(solved: Callable[..., list[Setting]]) -> None:
    solved(refuse("exact"))
    chart = work_precision(cart(), START)
    assert chart.rows[0] == Row(Setting("exact"), failed="exact cannot")
    assert chart.reference.setting == Setting("implicit", "rtol", 1e-13)
    assert chart.reference.check == Setting("rk45", "rtol", 1e-13)
    assert chart.reference.limit < 1e-11 * chart.reference.largest_load


def test_a_reference_alone_is_said_to_be_alone(solved: Callable[..., list[Setting]]) -> None:
    solved(refuse("exact", "rk45"))
    chart = work_precision(cart(), START)
    assert (chart.reference.check, chart.reference.limit) == (None, None)
    assert "not cross-checked (exact: exact cannot; rk45 at rtol 1e-13: rk45 cannot" in chart.reference.text
    assert {row.setting.method for row in chart.rows if row.failed} == {"exact", "rk45"}


def test_without_any_reference_there_is_no_chart(solved: Callable[..., list[Setting]]) -> None:
    solved(refuse("exact", "implicit", "rk45"))
    with pytest.raises(RunError, match="no method gives a reference.*exact cannot.*implicit cannot.*rk45"):
        work_precision(cart(), START)


def test_auto_that_fails_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object, **__: object) -> None:
        raise RunError("no way")

    monkeypatch.setattr(runner, "simulate", fails)
    chart = work_precision(cart(), START)
    assert (chart.auto_method, chart.auto_reason, chart.auto_row) == (None, "no way", None)
    assert "auto fails: no way." in chart_report(chart)


def test_carriages_that_hide_the_motion_are_judged_by_their_links() -> None:
    chart = work_precision(paper(), START)
    assert "loads of the carriages' links" in chart.judged and "hide the motion" in chart.judged
    assert chart.reference.largest_dynamic > 1000.0
    assert "forces of the carriages" in work_precision(cart(), START).judged


def test_a_machine_without_carriages_is_judged_by_its_links() -> None:
    links = [Link(name="a", point=(0.0, 0.0, 0.0), direction=(1.0, 0.0, 0.0), stiffness=1e7, damping=1e3)]
    body = Body(mass=100.0, center_of_mass=(0.0, 0.0, 0.0), inertia=np.eye(3))
    chart = work_precision(Machine(body=body, links=links, free=("x",)), START)
    assert chart.judged == "the loads of the links: the machine has no carriages"
    assert chart.reference.largest_dynamic == pytest.approx(100.0 * 2.2, rel=0.1)


def test_where_nothing_moves_there_is_no_dynamic_error() -> None:
    chart = work_precision(cart(), Motion.along_x(START.time, 0.0 * START.time))
    assert all(row.dynamic_error is None and row.load_error < 1e-12 for row in chart.rows if not row.failed)
    assert "nan" not in chart_report(chart).lower()
    assert "(nothing moves)" in plots.work_precision(chart).get_xlabel()


def test_without_any_load_there_is_no_error() -> None:
    weightless = cart().model_copy(update={"gravity": (0.0, 0.0, 0.0)})
    chart = work_precision(weightless, Motion.along_x(START.time, 0.0 * START.time))
    assert all(row.load_error is None and row.dynamic_error is None for row in chart.rows)
    assert "nan" not in chart_report(chart).lower()
    assert "no load" in plots.work_precision(chart).texts[0].get_text()


def test_a_motion_of_one_instant() -> None:
    chart = work_precision(cart(), Motion.along_x([0.7, 0.7], [0.0, 2.2]))
    assert len(chart.rows) == 1 + 2 * len(RTOLS)  # no interval to take parts of
    assert all(row.failed is None for row in chart.rows)
    chart_report(chart)
    plots.work_precision(chart)


# ---- the budget


def test_the_budget_is_kept(monkeypatch: pytest.MonkeyPatch, solved: Callable[..., list[Setting]]) -> None:
    now = 0.0

    def takes_a_second(_: Setting) -> None:
        nonlocal now
        now += 1.0

    monkeypatch.setattr(runner, "perf_counter", lambda: now)
    runs = solved(takes_a_second)
    chart = work_precision(cart(), START, budget=10.0)
    assert len(runs) <= 10 and now <= 10.0
    ran = [row for row in chart.rows if row.failed is None]
    assert ran[0].setting == Setting("exact") and ran[0].seconds == 1.0 and ran[0].spread is None
    assert chart.repetitions == 1 and len(chart.rows) == SETTINGS
    skipped = [row.failed for row in chart.rows if row.failed is not None]
    assert len(ran) + len(skipped) == SETTINGS and all(text.startswith("skipped: ") for text in skipped)
    assert "skipped: it would take about 2 s, and 1 s of the 10 s are left" in skipped
    del runs[:]
    once = 2 + SETTINGS
    chart = work_precision(cart(), START, budget=1000.0)
    assert chart.repetitions == runner.MOST_REPETITIONS and once < len(runs) <= once + SETTINGS
    assert all(row.spread == 0.0 for row in chart.rows)


def test_a_finer_step_is_foreseen(
    monkeypatch: pytest.MonkeyPatch, solved: Callable[..., list[Setting]]
) -> None:
    now = 0.0

    def takes_by_step(setting: Setting) -> None:
        nonlocal now
        now += 1e-3 / setting.value if setting.kind == "step" else 0.01

    monkeypatch.setattr(runner, "perf_counter", lambda: now)
    solved(takes_by_step)
    chart = work_precision(cart(), START, budget=12.0)
    parts = {
        method: [1e-3 / row.setting.value for row in ladder(chart, method, "step") if row.failed is None]
        for method in ("implicit", "rk45")
    }
    assert parts["implicit"] == pytest.approx([1, 2, 4])
    assert parts["rk45"] == pytest.approx([1, 2])  # 4 s more would exceed the 12
    assert now <= 12.0


@pytest.mark.parametrize("budget", [0.0, -1.0, np.nan, np.inf, "20", True])
def test_bad_budgets_are_refused(budget: object) -> None:
    with pytest.raises(ArgumentError, match="budget: expected a number > 0"):
        work_precision(cart(), START, budget=budget)


def test_bad_arguments_are_refused() -> None:
    with pytest.raises(TypeError, match="machine: expected a Machine"):
        work_precision("machine.toml", START)
    with pytest.raises(TypeError, match="motion: expected a Motion"):
        work_precision(cart(), "trace.csv")


# ---- table, text and picture


def test_table_has_a_row_per_setting(chart: WorkPrecision, stiff: WorkPrecision) -> None:
    table = chart.table()
    assert list(table["error_N"]) == [row.error for row in chart.rows]
    assert list(table["picked_by_auto"]) == [True] + [False] * (SETTINGS - 1)
    assert table["failed"].isna().all()
    assert stiff.table()["steps"].isna().sum() == sum(row.failed is not None for row in stiff.rows)


def test_report_fits_and_says_every_definition(chart: WorkPrecision) -> None:
    text = chart_report(chart)
    assert max(len(line) for line in text.splitlines()) <= 80 and "…" not in text
    flat = " ".join(text.split())
    for said in (
        "load less static load",
        "no other row is both faster and more accurate",
        "cross-checked by implicit",
        "auto picks exact: ",
        "1e-4 of the load",
        "front, auto",
    ):
        assert said in flat


def test_picture_shows_the_rows(chart: WorkPrecision, stiff: WorkPrecision) -> None:
    for each in (chart, stiff):
        ax = plots.work_precision(each)
        drawn = [tuple(point) for line in ax.lines for point in line.get_xydata()]
        for row in each.rows:
            if row.failed is None:
                assert any(
                    point == pytest.approx((row.dynamic_error, row.seconds), rel=1e-9) for point in drawn
                )
        left, right = ax.get_xlim()
        assert left > right  # the error falls to the right
        texts = [text.get_text() for text in ax.texts]
        for name in ("exact", "implicit, tolerance", "rk45, fixed step", "auto picks this"):
            assert name in texts
    assert "without a result: rk45 at step 1 ms to" in ax.get_xlabel()


def test_texts_of_the_picture_do_not_cover_each_other(chart: WorkPrecision, stiff: WorkPrecision) -> None:
    for each in (chart, stiff):
        ax = plots.work_precision(with_times_of_work(each))
        ax.figure.draw_without_rendering()
        texts = [text for text in ax.texts if text.get_text()]
        boxes = [text.get_window_extent() for text in texts]
        for i, box in enumerate(boxes):
            assert box.count_overlaps(boxes[i + 1 :]) == 0, texts[i].get_text()
            assert box.x1 <= ax.figure.bbox.x1 and box.y1 <= ax.figure.bbox.y1


# ---- the command


@pytest.fixture
def trace(tmp_path: Path) -> Path:
    path = tmp_path / "trace.csv"
    time = np.arange(400) * 1e-3
    velocity = 0.25 * (1 - np.cos(2 * np.pi * np.clip((time - 0.1) / 0.2, 0, 1)))
    rows = (f"{t:.3f},{v:.5f}\n" for t, v in zip(time, velocity, strict=True))
    path.write_text("time_s,velocity_m_s\n" + "".join(rows), encoding="utf-8")
    return path


def call(*arguments: object) -> Result:
    return CliRunner().invoke(main, [str(argument) for argument in arguments], catch_exceptions=False)


def refused(*arguments: object, code: int = 2) -> str:
    ended = call(*arguments)
    assert ended.exit_code == code, ended.output
    assert ended.stdout == "" and "Traceback" not in ended.stderr
    return ended.stderr


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()} - {MANIFEST}


def test_chart_writes_what_it_says(tmp_path: Path, trace: Path) -> None:
    out = tmp_path / "new" / "out"
    ended = call("chart", MACHINE, trace, "-o", out, "--budget", "5")
    assert ended.exit_code == 0, ended.output
    assert names(out) == {*CHART, "report.txt"} and names(out.parent) == {"out"}
    assert (out / "report.txt").read_text(encoding="utf-8").strip() in ended.stdout
    assert ended.stdout.endswith(f"Wrote {out}.\n")
    table = pd.read_csv(out / "chart.csv")
    assert len(table) == SETTINGS and table["picked_by_auto"].sum() == 1
    assert (out / "chart.png").read_bytes().startswith(b"\x89PNG")


def test_chart_replaces_only_what_it_wrote(tmp_path: Path, trace: Path) -> None:
    out = tmp_path / "out"
    chart = ("chart", MACHINE, trace, "-o", out, "--budget", "5")
    assert call(*chart).exit_code == 0
    (out / "notes.txt").write_text("mine")
    assert "is not empty" in refused(*chart)
    assert call(*chart, "--overwrite", "--no-pictures").exit_code == 0
    assert names(out) == {"chart.csv", "report.txt", "notes.txt"}
    (out / "chart.png").write_text("mine")
    assert f"{out / 'chart.png'} was not written" in refused(*chart, "--overwrite")
    assert (out / "chart.png").read_text() == "mine"


def test_chart_never_takes_its_input(tmp_path: Path, trace: Path) -> None:
    out = tmp_path / "out"
    run = ("run", MACHINE, trace, "-o", out, "--no-pictures", "--format", "csv")
    assert call(*run).exit_code == 0
    message = refused("chart", MACHINE, out / "loads.csv", "-o", out, "--overwrite")
    assert f"{out / 'loads.csv'} is read by this run" in message


def test_options_reach_the_chart(tmp_path: Path, trace: Path) -> None:
    chart = ("chart", MACHINE, trace, "-o", tmp_path / "out", "--no-pictures", "--budget", "5")
    ended = call(*chart, "--free", "rx,ry,rz")
    assert "free rx, ry, rz; held x, y, z" in ended.stdout
    assert call(*chart, "--overwrite", "--kind", "velocity", "--rate", "500").exit_code == 0


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--budget", "0"), "--budget"),
        (("--budget", "nan"), "--budget"),
        (("--free", "y,roll"), "--free: expected"),
        (("--kind", "torque"), "torque"),
    ],
)
def test_bad_options_are_refused(tmp_path: Path, trace: Path, options: tuple[str, str], said: str) -> None:
    assert said in refused("chart", MACHINE, trace, "-o", tmp_path / "out", *options)
    assert not (tmp_path / "out").exists()


def test_bad_input_is_refused_and_failure_leaves_nothing(
    tmp_path: Path, trace: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    assert "missing.csv" in refused("chart", MACHINE, tmp_path / "missing.csv", "-o", out)
    assert "missing.toml" in refused("chart", tmp_path / "missing.toml", trace, "-o", out)
    assert "not supported" in refused("chart", MACHINE, trace, "-o", out, "--free", "x,y")

    def fails(*_: object, **__: object) -> None:
        raise RunError("no method gives a reference")

    monkeypatch.setattr(runner, "work_precision", fails)
    assert refused("chart", MACHINE, trace, "-o", out, code=1) == "Error: no method gives a reference\n"
    assert not out.exists()
