"""Figures of reports are those of the results, the answer comes first, only what matters is printed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import reference as ref
from command_line import MACHINE, TRACE, guideload, refused
from lives import PRODUCT
from machines import carriage, having, machine
from texts import one_line

from guideload import ArgumentError, Link, Machine, Motion, Payload, Product, Result, plots, simulate
from guideload.html_report import run_page
from guideload.machine.components import Carriage
from guideload.machine.modes import Modes
from guideload.machine.riders import Rider
from guideload.reports.compare import comparison_report, differences, product_differences
from guideload.reports.machine import machine_report, modes_report
from guideload.reports.report import Report, Table
from guideload.reports.run import motion_lines, result_report

TIME = np.linspace(0.0, 1.0, 1001)
PUSH = Motion.along_x(TIME, np.where((TIME > 0.2) & (TIME < 0.6), 2.2, 0.0), source="a push")


@pytest.fixture(scope="module")
def result() -> Result:
    return simulate(ref.cart(), PUSH)


def tables(report: Report, title: str) -> list[Table]:
    """The tables of a section."""
    parts = next(one for one in report.sections if one.title.startswith(title)).parts
    return [part for part in parts if isinstance(part, Table)]


def values(table: Table, label: str) -> Sequence[Any]:
    """The values of a column, before they are written."""
    return list(next(column for column in table.columns if column.label == label).values)


def said(machine: Machine, motion: Motion) -> str:
    return one_line(result_report(simulate(machine, motion)).text())


# ---- runs


def test_the_samples_of_the_cart_are_counted_without_the_stamps_of_riders_payloads_and_forces() -> None:
    inertia = ((3.0, 0.0, 0.0), (0.0, 3.0, 0.0), (0.0, 0.0, 3.0))
    block: dict[str, Any] = {"mass": 20.0, "center_of_mass": (0.0, 0.0, 0.0), "inertia": inertia}
    travels = {"slide": Motion.along_x(0.0003 + 0.1 * np.arange(5), [0.0, 0.002, 0.0, -0.002, 0.0])}
    sliding = having(ref.cart(), riders=(Rider(name="slide", direction=(0, 0, 1), **block),))
    loaded = having(ref.cart(), payloads=(Payload(name="part", times=((0.35005, 0.75),), **block),))
    forced = PUSH.with_force((0, 0, 0), [[0, 0, 0], [1, 0, 0], [0, 0, 0]], time=[0.1001, 0.2002, 0.3003])
    for result in (
        simulate(sliding, PUSH, riders=travels),
        simulate(loaded, PUSH),
        simulate(ref.cart(), forced),
    ):
        assert result.quantities["time"].size > 1001
        assert "1 s, 1001 samples, every 1 ms (median)" in one_line(result_report(result).text())
    assert "1 s, 1001 samples, every 1 ms" in motion_lines(forced)


def test_the_start_of_a_rider_is_zero_not_rounding() -> None:
    slide = Rider(
        name="slide", mass=20.0, center_of_mass=(0, 0, 0), inertia=np.eye(3).tolist(), direction=(0, 0, 1)
    )
    back = Motion.along_x([0.0, 1.0], [0.0, 0.0], position=[-4.647e-18, 0.6], velocity=[0.6, 0.6])
    text = one_line(
        result_report(simulate(having(ref.cart(), riders=(slide,)), PUSH, riders={"slide": back})).text()
    )
    assert "rider slide: from 0 to 0.6 m" in text


def test_peaks_are_those_of_the_result(result: Result) -> None:
    forces, moments = tables(result_report(result), "Peak loads")
    peaks = result.peaks()
    assert values(forces, "carriage") == values(moments, "carriage") == list(peaks.index)
    share = 100.0 * peaks["dynamic_resultant_N"] / peaks["peak_resultant_N"]
    expected = {"peak": "peak_resultant_N", "at": "time_of_peak_s", "|Fy|": "peak_Fy_N", "|Fz|": "peak_Fz_N"}
    expected |= {"static": "static_resultant_N", "dyn.": "dynamic_resultant_N"}
    for label, name in expected.items():
        np.testing.assert_array_equal(values(forces, label), peaks[name])
    np.testing.assert_array_equal(values(forces, "share"), share)
    np.testing.assert_array_equal(values(forces, "factor"), result.audit.simpler_models.dynamic_factor)
    assert set(values(moments, "|Mx|")) == {"-"}  # the carriages have no width
    for axis in "yz":
        np.testing.assert_array_equal(values(moments, f"|M{axis}|"), peaks[f"peak_M{axis}_Nm"])


def test_reactions_are_those_of_the_result() -> None:
    """Of the drive, and of a link in its place."""
    rack = Link(name="rack", point=(0, 0, 0), direction=(1, 0, 0), stiffness=8e7, damping=2e4)
    elastic = ref.cart().model_copy(update={"links": (rack,), "free": ("x", *ref.cart().free)})
    for given, name in ((ref.cart(), "drive force"), (elastic, "link rack")):
        found = simulate(given, PUSH)
        # The largest force of the drive is that at any time.
        dense = np.linspace(0.0, TIME[-1], 20_000) if name == "drive force" else None
        data = simulate(given, PUSH, times=dense).data
        load = (
            data["reaction"].sel(dof="x") if name == "drive force" else data["link_load"].sel(link="rack")
        ).values
        found_tables = filter(None, tables(result_report(found), "Drive"))
        table = next(one for one in found_tables if name in values(one, ""))
        row = values(table, "").index(name)
        peak = float(str(table.rows[row][1]).replace("\u202f", ""))
        assert peak == pytest.approx(load[np.abs(load).argmax()], abs=0.5)


def test_the_answer_comes_first_and_warnings_follow(result: Result) -> None:
    worst = result.peaks().sort_values("peak_resultant_N").iloc[-1]
    report = result_report(result)
    assert (
        f"the largest load is {worst['peak_resultant_N']:.0f} N, on carriage {worst.name}" in report.answer[0]
    )
    assert report.verdict == ("1 warning:" if report.warnings else "No warnings.") in report.text()
    early = simulate(ref.cart(), Motion.along_x(TIME, np.where(TIME < 0.6, 2.0, 0.0)))
    assert result_report(early).verdict == "2 warnings:"
    assert early.audit.warnings == (*result_report(early).warnings,)


def test_a_motion_under_way_spoils_the_peaks_until_the_slowest_mode_has_died_away() -> None:
    slowest = Modes.of(ref.cart())
    until = 3 / (2 * np.pi * slowest.frequency * slowest.damping_ratio).min()
    both = simulate(ref.cart(), Motion.along_x(TIME, np.where(TIME < 0.6, 1, -4)))
    text = one_line(result_report(both).text())
    assert f"until {until:.3g} s the loads contain the response to a sudden start" in text
    times = both.peaks()["time_of_peak_s"]  # the dynamic parts peak late everywhere
    early = ", ".join(times.index[times < until])
    assert (
        f"peaks of {early} are in this period" if early else "no peak of a carriage is in this period"
    ) in text
    again = Motion.along_x(TIME, np.select([TIME < 0.4, TIME < 0.7], [1, -4], 4))
    assert "no peak of a carriage is in this period" in said(ref.cart(), again)
    sudden = Motion.along_x(TIME, np.where(TIME < 0.6, 2.0, 0.0))
    assert "peaks of all carriages are in this period" in said(ref.cart(), sudden)


def test_only_what_a_method_has_is_told() -> None:
    assert "load scale" not in said(ref.cart(), PUSH) and "contact changes" not in said(ref.cart(), PUSH)
    fixed = result_report(simulate(ref.cart(), PUSH, "implicit", step=5e-4)).text()
    assert "fixed step 0.5 ms" in fixed and "tolerance" not in fixed
    light = simulate(ref.preloaded(300.0), PUSH)
    changes = light.audit.contact.changes
    assert changes and f"{changes} contact changes, counted" in one_line(result_report(light).text())
    uneven = np.sort(np.concatenate([TIME, TIME[1:-1:3] + 3e-4]))
    assert "median; not uniform" in said(ref.cart(), Motion.along_x(uneven, 0 * uneven))


def test_a_single_instant_is_reported_and_none_is_refused(result: Result, tmp_path: Path) -> None:
    one = simulate(ref.cart(), PUSH, times=[0.25])
    assert "a single instant, 0.25 s" in result_report(one).text()
    load = result.data["resultant"].sel(carriage="1b").sel(time=0.25).item()
    table = tables(result_report(one), "Peak loads")[0]
    peaks = dict(zip(values(table, "carriage"), values(table, "peak"), strict=True))
    assert peaks["1b"] == pytest.approx(load, rel=1e-12)
    assert len(plots.save_all(one, tmp_path)) == 6
    nothing = simulate(ref.cart(), PUSH, times=[])
    for ask in (Result.peaks, lambda result: result.audit, result_report):
        with pytest.raises(ArgumentError, match="reports no instant"):
            ask(nothing)


def test_without_carriages_the_answer_is_of_a_link() -> None:
    result = simulate(ref.translating(100.0, [("y", (0.0, 1.0, 0.0), 1e6, 1e3)]), PUSH)
    text = one_line(result_report(result).text())
    assert "the largest load is 981 N, on link y at 0.000 s. Its dynamic part is 0.0 N, 0.0 %" in text
    assert "Peak loads" not in text and "Load of the links" in run_page(result)


# ---- machines


def test_modes_are_those_of_the_machine() -> None:
    modes = Modes.of(ref.cart())
    (table,) = tables(modes_report(ref.cart(), modes), "Natural modes")
    np.testing.assert_array_equal(values(table, "natural"), modes.frequency)
    np.testing.assert_array_equal(values(table, "damping ratio"), 100.0 * modes.damping_ratio)
    np.testing.assert_array_equal(values(table, "damped"), modes.damped_frequency)
    heavy = ref.cart(damping=1e8)
    (overdamped,) = tables(modes_report(heavy, Modes.of(heavy)), "Natural modes")
    assert values(overdamped, "damped")[0] == "none"


def test_static_loads_carry_the_weight() -> None:
    (table,) = tables(machine_report(ref.cart()), "Static loads")
    assert sum(values(table, "Fy")) == pytest.approx(-ref.cart().body.mass * 9.80665, rel=1e-12)


@pytest.mark.parametrize(
    ("rolling", "opens"), [("ball", "3394 N, 30 um"), ("roller", "2592 N, 22.2 um")], ids=["ball", "roller"]
)
def test_a_row_opens_where_its_law_says(rolling: str, opens: str) -> None:
    """At 2^n F0 and d0 = 2 n F0 / k0, n = 1.5 for balls and 10/9 for rollers."""
    preloaded = ref.cart(preload_y="1.2 kN", rolling=rolling)
    assert f"one row opens at {opens}" in one_line(machine_report(preloaded).text())


def test_the_state_at_rest() -> None:
    """The carriage that carries most has 5366 N on two ends: 2^1.5 times half of the preload opens a row of it."""
    loose = machine_report(ref.cart(clearance_z="5 um"))
    assert "At rest the body is free within its clearance" in loose.answer[
        0
    ] and "within its clearance in z" in str(loose)
    for preload, opens in ((1800.0, True), (2000.0, False)):
        report = machine_report(ref.cart(preload_y=preload, rolling="ball"))
        assert ("have a row open at rest" in str(report.warnings)) is opens


def test_laws_are_told_of_nonlinear_carriages_alone() -> None:
    for linear in (ref.cart(clearance_y=0.0), ref.cart(stiffness_y={"positive": 1e8, "negative": 1e8})):
        assert "*" not in machine_report(linear).text()
        assert "nominal" not in modes_report(linear, Modes.of(linear)).text()
    sided = ref.cart(stiffness_y={"positive": 9e7, "negative": 1.4e8})
    assert "nominal stiffness" in modes_report(sided, Modes.of(sided)).text()
    stiffer = ref.cart(stiffness_y=1.4e8)
    np.testing.assert_allclose(Modes.of(sided).frequency, Modes.of(stiffer).frequency, rtol=1e-12)


@pytest.mark.parametrize(
    "changes",
    [
        {"stiffness_y": {"positive": "90 N/um", "negative": "140 N/um"}},
        {"clearance_z": "5 um", "damping_in_contact": True},
        {"curve_y": [["0 um", "0 N"], ["6 um", "400 N"], ["16 um", "2 kN"]], "stiffness_y": None},
        {"preload_y": "1.2 kN", "rolling": "ball"},
        {"preload_y": "1.2 kN", "rolling": "roller"},
    ],
    ids=["sides", "clearance", "curve", "balls", "rollers"],
)
def test_nominal_scene_is_that_of_the_linear_machine(changes: dict[str, Any]) -> None:
    given = ref.cart(**changes)
    none = dict.fromkeys(("curve_y", "curve_z", "preload_y", "preload_z", "rolling"))
    plain = none | {"damping_in_contact": False, "clearance_y": 0.0, "clearance_z": 0.0}
    carriages = []
    for part in given.carriages:
        y, z = (law.stiffness for law in part.laws)
        carriages.append(Carriage(**{**dict(part), **plain, "stiffness_y": y, "stiffness_z": z}))
    linear = given.model_copy(update={"carriages": carriages})
    assert given.nominal_scene.model_level == linear.model_level == "linear"
    for nominal, same in zip(given.nominal_scene.matrices()[0], linear.scene.matrices()[0], strict=True):
        np.testing.assert_array_equal(nominal, same)


def test_names_are_text_and_not_markup() -> None:
    names = [f"[red]ä{i}" for i in range(4)]
    renamed = zip(ref.cart().carriages, names, strict=True)
    carriages = [one.model_copy(update={"name": name}) for one, name in renamed]
    odd = ref.cart().model_copy(update={"name": "[bold]Prüfstand", "carriages": carriages})
    text = machine_report(odd).text()
    assert "[bold]Prüfstand" in text and all(name in text for name in names)


# ---- comparisons


def test_differences_are_matched_by_name() -> None:
    """Only what differs is listed; a carriage that moved in the list is the same carriage."""
    one, two = carriage("a", x=-0.5), carriage("b", x=0.5)
    left = machine(one, two)
    right = machine(two, one.model_copy(update={"length": 0.7}))
    assert list(differences(left, right)) == [("carriages[a].length", (0.6, 0.7))]
    assert list(differences(left, left)) == []
    assert ("carriages[b].x", (0.5, None)) in list(differences(left, machine(one)))


def test_a_product_has_one_row() -> None:
    """It gives the values that differ, or says that one machine does not have the product."""
    record = {key: PRODUCT[key] for key in ("name", "maker", "edition", "type", "static")}
    changed = record | {"static": 5e4, "mass": 0.5, "dynamic": {"value": "30 kN", "base": "50 km"}}
    machines = [
        machine(products=[Product(**one), *others])
        for one, others in ((record, []), (changed, [Product(**record | {"name": "25"})]))
    ]
    assert not list(differences(*machines))
    rows = dict(product_differences(*machines))
    assert list(rows) == ["products[20]", "products[25]"] and rows["products[25]"] == (None, "has it")
    before, after = rows["products[20]"]
    assert before is not None and "static 60000" in before and "dynamic.value none" in before
    assert after is not None and "dynamic.value 30000" in after and after.endswith("and 1 more")


def test_a_machine_without_carriages_is_refused(result: Result) -> None:
    bare = simulate(ref.translating(100.0, [("y", (0.0, 1.0, 0.0), 1e6, 1e3)]), PUSH)
    for refusing in (comparison_report, plots.comparison):
        with pytest.raises(ArgumentError, match="bare: expected a machine with carriages"):
            refusing({"given": result, "bare": bare})


def test_a_comparison_says_what_is_the_same() -> None:
    slow, fast = (Motion.along_x([0.0, 1.0], [rate, rate]) for rate in (1.0, 2.0))
    for other, words in ((slow, "the motions are, too"), (fast, "the motions differ")):
        report = comparison_report({"a": simulate(ref.cart(), slow), "b": simulate(ref.cart(), other)})
        assert f"The machines are the same; {words}." in report.answer[0]


def test_the_command_compare(tmp_path: Path) -> None:
    other, copy = tmp_path / "other.toml", tmp_path / Path(MACHINE).name
    other.write_text(Path(MACHINE).read_text(encoding="utf-8").replace("1250 kg", "1300 kg"), "utf-8")
    picture = tmp_path / "c.png"
    text = guideload("compare", MACHINE, other, TRACE, "-o", picture).stdout
    assert "body.mass" in text and "1300" in text and picture.stat().st_size > 10_000
    assert "at least two runs" in refused("compare", MACHINE, TRACE)
    copy.write_bytes(Path(MACHINE).read_bytes())
    assert '2 runs have the name "' in refused("compare", MACHINE, copy, TRACE)


@pytest.mark.parametrize("columns", [None, 60, 120])
def test_the_terminal_has_the_width_of_columns(columns: int | None, monkeypatch: pytest.MonkeyPatch) -> None:
    """80 characters if standard output is no terminal; sentences are at most 100 characters wide."""
    monkeypatch.delenv("COLUMNS", raising=False)
    if columns is not None:
        monkeypatch.setenv("COLUMNS", str(columns))
    widths = [len(line) for line in guideload("check", MACHINE).stdout.splitlines()]
    assert 50 < max(widths) <= (columns or 80) and (columns != 120 or max(widths) > 80)
