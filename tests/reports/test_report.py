"""Reports of results: figures are those of the result, the answer comes first, only what matters is printed."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import reference as ref
from texts import one_line, row

from guideload import ArgumentError, Drive, Link, Machine, Motion, Result, plots, simulate
from guideload.base.number_text import load_in_table
from guideload.machine.modes import Modes
from guideload.reports import run as report
from guideload.reports.elements import WIDTH
from guideload.reports.machine import machine_report, modes_report

TIME = np.linspace(0.0, 1.0, 1001)
PUSH = Motion.along_x(
    TIME, np.where((TIME > 0.2) & (TIME < 0.6), 2.2, 0.0), source="a push", notes=("typed in", "by hand")
)
MACHINE = ref.cart().model_copy(update={"drive": Drive(gear_ratio=12.0, pinion_diameter=0.1273)})
PAPER = MACHINE.with_free(["rx", "ry", "rz"])
RACK = Link(name="rack", point=(0, 0, 0), direction=(1, 0, 0), stiffness=8e7, damping=2e4)


@pytest.fixture(scope="module")
def result() -> Result:
    return simulate(MACHINE, PUSH)


def with_carriages(*names: str, **values: Any) -> Machine:
    """The example with other values in all carriages, and other names."""
    renamed = zip(MACHINE.carriages, names or [carriage.name for carriage in MACHINE.carriages], strict=True)
    carriages = [carriage.model_copy(update={"name": name, **values}) for carriage, name in renamed]
    return MACHINE.model_copy(update={"carriages": carriages})


def said(result: Result) -> str:
    return one_line(report.result_report(result))


# ---- the answer


def test_the_report_begins_with_the_largest_load_and_its_warnings(result: Result) -> None:
    peaks = result.peaks().sort_values("peak_resultant_N").iloc[-1]
    peak, dynamic = peaks["peak_resultant_N"], peaks["dynamic_resultant_N"]
    factor = result.audit.simpler_models.dynamic_factor[result.peaks().index.get_loc(peaks.name)]
    assert said(result).startswith(
        f"{MACHINE.name}: the largest load is {peak:.0f} N, on carriage {peaks.name} at "
        f"{peaks['time_of_peak_s']:.3f} s. Its dynamic part is {dynamic:.0f} N, {100 * dynamic / peak:.1f} %; "
        f"the peak is {factor:.2f} times the quasi-static peak (statics with m a). No warnings. free y,"
    )
    early = simulate(MACHINE, Motion.along_x(TIME, np.where(TIME < 0.6, 2.0, 0.0)))
    for text in (said(early), one_line(report.comparison({"Run": early}))):
        assert "1 warning: Note: the motion begins at 2 m/s2" in text
        assert text.index("the motion begins at") < text.index("carriage N s")


def test_without_carriages_the_answer_is_of_a_link() -> None:
    machine = ref.translating(100.0, [("y", (0.0, 1.0, 0.0), 1e6, 1e3)])
    text = said(simulate(machine, PUSH))
    assert "the largest load is 981 N, on link y at 0.000 s. Its dynamic part is 0.0 N, 0.0 %" in text
    assert "Peak loads" not in text


def test_comparison_shows_both_runs_and_the_hidden_weight_once(result: Result) -> None:
    text = report.comparison({"Guides": result, "Paper": simulate(PAPER, PUSH)})
    assert "Guides: free y, z, rx, ry, rz" in text and "Paper: free rx, ry, rz" in text
    assert one_line(text).count("carries the weight") == 1
    assert text.count("the largest load is") == 2


# ---- tables


def test_peaks_are_those_of_the_result(result: Result) -> None:
    text = report.result_report(result)
    factors = result.audit.simpler_models.dynamic_factor
    for factor, (name, peaks) in zip(factors, result.peaks().iterrows(), strict=True):
        columns = ("peak_resultant_N", "time_of_peak_s", "peak_Fy_N", "peak_Fz_N", "static_resultant_N")
        dynamic = peaks["dynamic_resultant_N"]
        expected = [*peaks[[*columns]], factor, dynamic, 100 * dynamic / peaks["peak_resultant_N"]]
        forces, moments = (
            [float(cell) for cell in line.split()[1:]]
            for line in text.splitlines()
            if line.split()[:1] == [str(name)]
        )
        # As printed: whole numbers from 100 up, one decimal below, milliseconds for the time.
        np.testing.assert_allclose(forces, expected, rtol=0.0051, atol=0.051)
        expected = peaks[["peak_Mx_Nm", "peak_My_Nm", "peak_Mz_Nm", "dynamic_moment_Nm"]]
        np.testing.assert_allclose(moments, expected.to_numpy(), rtol=0.0051, atol=0.051)


def test_every_definition_is_said(result: Result) -> None:
    for definition in (
        "Forces of the body on the carriage, in its rail's axes, static load included",
        "moments about the carriage's centre",
        "sqrt(Fy^2 + Fz^2)",
        "f_W: dynamic factor, peak over quasi-static peak (statics with m a)",
        "share: dyn. force over peak",
    ):
        assert definition in said(result)


def test_reactions_are_those_of_the_result(result: Result) -> None:
    elastic = simulate(MACHINE.model_copy(update={"links": (RACK,), "free": ("x", *MACHINE.free)}), PUSH)
    loads = result.data["reaction"].sel(dof="x").values, elastic.data["link_load"].sel(link="rack").values
    for title, one, load in zip(("drive force", "link rack"), (result, elastic), loads, strict=True):
        line = next(line for line in report.result_report(one).splitlines() if line.strip().startswith(title))
        figure = line.strip().removeprefix(title).split()[0]
        assert float(figure) == pytest.approx(load[np.abs(load).argmax()], abs=0.5)


@pytest.mark.parametrize("shift", [0.0, 100.0])
def test_lines_fit_the_width_for_long_names_and_times(shift: float) -> None:
    machine = with_carriages("left rear", "left front", "right rear", "right front")
    text = report.result_report(simulate(machine, Motion.along_x(TIME + shift, PUSH.acceleration[:, 0])))
    assert max(map(len, text.splitlines())) <= WIDTH
    for carriage in machine.carriages:
        assert sum(line.strip().startswith(carriage.name) for line in text.splitlines()) == 2


@pytest.mark.parametrize(
    ("value", "text"),
    [(12258.31, "12258"), (-441.3, "-441"), (8.25, "8.2"), (-0.04, "0.0"), (1e-15, "0.0"), (-99.94, "-99.9")],
)
def test_numbers_of_the_tables(value: float, text: str) -> None:
    assert load_in_table(value) == text


# ---- motion, method, contact


def test_motion_and_method_are_described(result: Result) -> None:
    text = said(result)
    assert f"method exact: {result.data.attrs['method_reason']}" in text
    assert "a push 1 s, 1001 samples, every 1 ms largest acceleration 2.2 m/s2 typed in by hand" in text
    assert "load scale" not in text and "contact" not in text  # no step error, no contact changes
    adaptive = simulate(MACHINE, PUSH, "rk45", rtol=1e-5)
    attributes = adaptive.data.attrs
    scale = f"{attributes['load_scale_N']:.0f} N"
    assert (
        f"error tolerance of the link loads 1e-05 of the load scale, {1e-5 * attributes['load_scale_N']:.1g} N"
        in said(adaptive)
    )
    assert f"{attributes['steps']} steps" in said(adaptive) and f"load scale {scale}" in said(adaptive)
    assert "fixed step 0.5 ms" in said(simulate(MACHINE, PUSH, "implicit", step=5e-4))
    loose = simulate(with_carriages(clearance_z=5e-6), PUSH)
    assert f"{loose.audit.contact.changes} contact changes, located" in said(loose)
    light = simulate(with_carriages(preload_y=300.0, preload_z=300.0, rolling="ball"), PUSH)
    changes = light.audit.contact.changes
    assert f"{changes} contact changes, counted from step to step" in said(light) and changes
    assert "method exponential: preloaded contacts are not linear" in said(light)
    assert "error tolerance of the link loads 1e-06" in said(light)


def test_uneven_samples_are_said() -> None:
    time = np.sort(np.concatenate([TIME, TIME[1:-1:3] + 3e-4]))
    assert "median; not uniform" in report.motion_report(Motion.along_x(time, 0 * time))


def test_a_single_instant_is_reported_and_none_is_refused(result: Result, tmp_path: Path) -> None:
    one = simulate(MACHINE, PUSH, times=[0.25])
    assert "a single instant, 0.25 s largest acceleration 2.2 m/s2" in said(one)
    load = result.data["resultant"].sel(carriage="1b").values[np.flatnonzero(TIME == 0.25)[0]]
    assert row(report.result_report(one), "1b")[1] == load_in_table(float(load))
    assert len(plots.save_all(one, tmp_path)) == 6
    nothing = simulate(MACHINE, PUSH, times=[])
    for ask in (Result.peaks, lambda result: result.audit, report.result_report):
        with pytest.raises(ArgumentError, match="reports no instant"):
            ask(nothing)


def test_held_y_hides_the_weight_and_free_y_does_not(result: Result) -> None:
    for text in (said(simulate(PAPER, PUSH)), one_line(machine_report(PAPER))):
        weight = f"{MACHINE.body.mass * 9.80665:.0f} N"
        assert f"y of L is held, so the constraint at L carries the weight: {weight}" in text
        assert "along y add up to 0.0 N: they carry only its moment" in text
        assert "z of L is held, so" not in text  # gravity has no part along z
    assert "carries the weight" not in said(result)


def test_a_motion_under_way_spoils_the_peaks_until_the_slowest_mode_has_died_away() -> None:
    slowest = Modes.of(MACHINE)
    until = 3 / (2 * np.pi * slowest.frequency * slowest.damping_ratio).min()
    both = simulate(MACHINE, Motion.along_x(TIME, np.where(TIME < 0.6, 1, -4)))
    assert "Note: the motion begins at 1 m/s2, but the run starts at rest" in said(both)
    assert f"until {until:.3g} s the loads contain the response to a sudden start" in said(both)
    times = both.peaks()["time_of_peak_s"]  # the dynamic parts peak late everywhere
    early = ", ".join(times.index[times < until])
    assert (
        f"peaks of {early} are in this period" if early else "no peak of a carriage is in this period"
    ) in said(both)
    again = simulate(MACHINE, Motion.along_x(TIME, np.select([TIME < 0.4, TIME < 0.7], [1, -4], 4)))
    assert "no peak of a carriage is in this period" in said(again)
    sudden = simulate(MACHINE, Motion.along_x(TIME, np.where(TIME < 0.6, 2.0, 0.0)))
    assert "peaks of all carriages are in this period" in said(sudden)


@pytest.mark.parametrize(("cycles", "warned"), [(0.49, False), (0.51, True)])
def test_samples_coarser_than_half_a_period_of_the_highest_mode_are_warned_of(
    cycles: float, warned: bool
) -> None:
    time = np.arange(20) * cycles / Modes.of(MACHINE).frequency.max()
    coarse = simulate(MACHINE, Motion.along_x(time, np.where((time > 0.01) & (time < 0.03), 2.0, 0.0)))
    assert ("peaks between the samples are missed" in said(coarse)) is warned


# ---- machines


def test_modes_report_begins_with_their_range_and_has_a_row_for_each() -> None:
    modes = Modes.of(MACHINE)
    text = modes_report(MACHINE, modes)
    low, high = modes.frequency.min(), modes.frequency.max()
    assert one_line(text).startswith(f"{MACHINE.name}: 5 natural modes at {low:.3g} to {high:.3g} Hz")
    columns = (modes.frequency, 100 * modes.damping_ratio, modes.damped_frequency)
    for index, expected in enumerate(zip(*columns, strict=True)):
        cells = [float(cell) for cell in row(text, str(index + 1))[1:4]]
        assert cells == pytest.approx(expected, rel=1e-2)
    heavy = with_carriages(damping_y=1e8, damping_z=1e8)
    assert row(modes_report(heavy, Modes.of(heavy)), "1")[3] == "none"  # overdamped


def test_machine_report_has_masses_links_weight_and_static_loads() -> None:
    text = machine_report(MACHINE)
    for figure in (
        "mass 1250 kg, weight 12258 N",
        "(120, -650, 180) mm from L",
        "16 links",
        "33.33 mm per turn of the motor",
    ):
        assert figure in text
    static = text[text.index("Static loads") :]
    loads = [float(row(static, carriage.name)[1]) for carriage in MACHINE.carriages]
    assert sum(loads) == pytest.approx(-MACHINE.body.mass * 9.80665, abs=1)
    elastic = MACHINE.model_copy(update={"links": (RACK,)})
    assert "17 links, 1 of them extra: rack" in machine_report(elastic)


def test_names_are_text_and_not_markup() -> None:
    names = [f"[red]ä{i}" for i in range(4)]
    odd = with_carriages(*names).model_copy(update={"name": "[bold]Prüfstand"})
    text = machine_report(odd)
    assert "[bold]Prüfstand" in text and all(name in text for name in names)
    assert machine_report(odd, encoding="ascii").isascii()
