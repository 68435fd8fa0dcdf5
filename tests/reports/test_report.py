"""The report's figures are those of the result, and every one of them is defined beside it."""

from pathlib import Path

import numpy as np
import pytest

from guideload import plots
from guideload.base.errors import ArgumentError
from guideload.base.numbers import load_in_table
from guideload.cli.inputs import EXAMPLES
from guideload.machine.machine import Machine
from guideload.machine.modes import Modes
from guideload.motion.motion import Motion
from guideload.reports import result as report
from guideload.reports.elements import WIDTH
from guideload.reports.machine import machine_report, modes_report
from guideload.simulation.result import Result
from guideload.simulation.simulation import simulate

TIME = np.linspace(0.0, 1.0, 1001)


@pytest.fixture(scope="module")
def machine() -> Machine:
    return Machine.from_toml(str(EXAMPLES / "manipulator.toml"))


def move(machine: Machine, shift: float = 0.0, **options: object) -> Result:
    pull = np.where((TIME > 0.2) & (TIME < 0.6), 2.2, 0.0)
    motion = Motion.along_x(TIME + shift, pull, source="a push", notes=("typed in", "by hand"))
    return simulate(machine, motion, **options)


@pytest.fixture(scope="module")
def result(machine: Machine) -> Result:
    return move(machine)


def with_changes(machine: Machine, **changes: object) -> Machine:
    values = {key: value for key, value in machine.model_dump().items() if value is not None}
    if values.get("drive"):
        values["drive"] = {key: value for key, value in values["drive"].items() if value is not None}
    return Machine(**{**values, **changes})


def row(text: str, first: str) -> list[str]:
    """Cells of the table row that starts with this cell."""
    return next(line.split() for line in text.splitlines() if line.split()[:1] == [first])


def one_line(text: str) -> str:
    return " ".join(text.split())


def test_peaks_are_those_of_the_result(result: Result) -> None:
    text = report.result_report(result)
    across = result.data["force"].sel(axis=["y", "z"])
    for name in result.data["carriage"].values:
        one = across.sel(carriage=name).values
        size = np.hypot(*one.T)
        static = result.data["static_force"].sel(carriage=name, axis=["y", "z"]).values
        dynamic = np.hypot(*(one - static).T).max()
        moment = result.data["moment"].sel(carriage=name)
        swing = np.linalg.norm(moment - result.data["static_moment"].sel(carriage=name), axis=1).max()
        expected = [size.max(), TIME[size.argmax()], *np.abs(one).max(axis=0), np.hypot(*static), dynamic]
        expected += [100 * dynamic / size.max(), *np.abs(moment).max("time").values, swing]
        found = [float(cell) for cell in row(text, str(name))[1:]]
        # As printed: whole numbers from 100 up, one decimal below, milliseconds for the time.
        np.testing.assert_allclose(found, expected, rtol=0.0051, atol=0.051)


def test_every_definition_is_said(result: Result) -> None:
    text = one_line(report.result_report(result))
    for said in (
        "Forces of the body on the carriage, global axes, static load included",
        "moments about the carriage's centre",
        "sqrt(Fy^2 + Fz^2)",
        "share: that of the force over the peak",
    ):
        assert said in text


def test_method_reason_load_scale_and_motion_are_told(machine: Machine, result: Result) -> None:
    text = one_line(report.result_report(result))
    attrs = result.data.attrs
    assert f"method exact: {attrs['method_reason']}" in text
    assert f"load scale {attrs['load_scale_N']:.0f} N" in text
    assert "a push" in text and "typed in by hand" in text
    assert "1 s, 1001 samples, every 1 ms" in text
    assert "acceleration 2.2 m/s2" in text
    adaptive = move(machine, method="rk45", rtol=1e-5)
    steps = adaptive.data.attrs["steps"]
    text = one_line(report.result_report(adaptive))
    assert "held to 1e-05 of the load scale" in text and f"{steps} steps" in text
    assert "fixed step 0.5 ms" in report.result_report(move(machine, method="implicit", step=5e-4))


def test_uneven_samples_are_said(machine: Machine) -> None:
    time = np.sort(np.concatenate([TIME, TIME[1:-1:3] + 3e-4]))
    text = report.motion_report(Motion.along_x(time, 0 * time))
    assert "median; not uniform" in text


def test_a_single_instant_is_reported_and_none_is_refused(
    machine: Machine, result: Result, tmp_path: Path
) -> None:
    pull = Motion.along_x(TIME, np.where((TIME > 0.2) & (TIME < 0.6), 2.2, 0.0))
    one = simulate(machine, pull, times=[0.25])
    text = one_line(report.result_report(one))
    assert "a single instant, 0.25 s largest acceleration 2.2 m/s2" in text
    at = int(np.flatnonzero(TIME == 0.25)[0])
    assert row(text.replace(" 1b ", "\n1b "), "1b")[1] == load_in_table(
        float(result.data["resultant"].values[at, 1])
    )
    assert len(plots.save_all(one, tmp_path)) == 6
    for ask in (Result.peaks, lambda of: of.audit, report.result_report):
        with pytest.raises(ArgumentError, match="reports no instant"):
            ask(simulate(machine, pull, times=[]))


def test_contact_changes_are_told_where_there_are_any(machine: Machine, result: Result) -> None:
    carriages = [part.model_copy(update={"clearance_z": 5e-6}) for part in machine.carriages]
    clear = move(machine.model_copy(update={"carriages": carriages}))
    assert f"{clear.audit.contact.changes} contact changes, each located" in report.result_report(clear)
    assert "contact changes" not in report.result_report(result)


def test_drive_force_is_the_reaction_of_held_x(result: Result) -> None:
    reaction = result.data["reaction"].sel(dof="x").values
    line = next(line for line in report.result_report(result).splitlines() if "drive force, held x" in line)
    assert float(line.split()[4]) == pytest.approx(reaction[np.abs(reaction).argmax()], abs=0.5)


def test_held_y_is_told_to_hide_the_weight_and_free_y_is_not(machine: Machine, result: Result) -> None:
    paper = machine.with_free(["rx", "ry", "rz"])
    weight = f"{machine.body.mass * 9.80665:.0f} N"
    for text in (report.result_report(move(paper)), machine_report(paper)):
        said = one_line(text)
        assert f"y of L is held, so the constraint at L carries the weight: {weight}" in said
        assert "along y add up to 0.0 N: they carry only its moment" in said
        assert "z of L is held, so" not in said  # gravity has no part along z
    assert "carries the weight" not in one_line(report.result_report(result))


def test_comparison_shows_both_runs_and_the_hidden_weight_once(machine: Machine, result: Result) -> None:
    paper = move(machine.with_free(["rx", "ry", "rz"]))
    text = report.comparison({"Guides": result, "Paper": paper})
    assert "Guides: free y, z, rx, ry, rz" in text and "Paper: free rx, ry, rz" in text
    assert one_line(text).count("carries the weight") == 1


def test_modes_table_is_that_of_the_modes(machine: Machine) -> None:
    modes = Modes.of(machine)
    text = modes_report(machine, modes)
    for index in range(len(modes.frequency)):
        cells = row(text, str(index + 1))
        assert float(cells[1]) == pytest.approx(modes.frequency[index], rel=1e-3)
        assert float(cells[2]) == pytest.approx(100 * modes.damping_ratio[index], rel=1e-2)
        assert float(cells[3]) == pytest.approx(modes.damped_frequency[index], rel=1e-3)


def test_an_overdamped_mode_has_no_damped_frequency(machine: Machine) -> None:
    stiff = [{**carriage.model_dump(), "damping_y": 1e8, "damping_z": 1e8} for carriage in machine.carriages]
    heavy = with_changes(machine, **{"carriages": stiff})
    assert row(modes_report(heavy, Modes.of(heavy)), "1")[3] == "none"


def test_machine_report_tells_masses_links_weight_and_static_loads(machine: Machine) -> None:
    text = machine_report(machine)
    assert "mass 1250 kg, weight 12258 N" in text
    assert "(120, -650, 180) mm from L" in text
    assert "16 links" in text
    assert "33.33 mm per turn of the motor" in text
    static = text[text.index("At rest") :]
    loads = [float(row(static, carriage.name)[1]) for carriage in machine.carriages]
    assert sum(loads) == pytest.approx(-machine.body.mass * 9.80665, abs=1)


def test_extra_links_are_reported(machine: Machine) -> None:
    rack = {"name": "rack", "point": (0, 0, 0), "direction": (1, 0, 0), "stiffness": 8e7, "damping": 2e4}
    elastic = with_changes(machine, **{"links": [rack], "free": ("x", *machine.free)})
    assert "17 links, 1 of them extra: rack" in machine_report(elastic)
    result = move(elastic)
    load = result.data["link_load"].sel(link="rack").values
    line = next(line for line in report.result_report(result).splitlines() if "link rack" in line)
    assert float(line.split()[2]) == pytest.approx(load[np.abs(load).argmax()], abs=0.5)


def test_names_are_text_and_not_markup(machine: Machine) -> None:
    renamed = [
        {**carriage.model_dump(), "name": f"[red]ä{i}"} for i, carriage in enumerate(machine.carriages)
    ]
    odd = with_changes(machine, **{"name": "[bold]Prüfstand", "carriages": renamed})
    text = machine_report(odd)
    assert "[bold]Prüfstand" in text and "[red]ä0" in text
    assert machine_report(odd, encoding="ascii").isascii()


@pytest.mark.parametrize(
    ("value", "text"),
    [(12258.31, "12258"), (-441.3, "-441"), (8.25, "8.2"), (-0.04, "0.0"), (1e-15, "0.0"), (-99.94, "-99.9")],
)
def test_numbers_of_the_tables(value: float, text: str) -> None:
    assert load_in_table(value) == text


def test_lines_fit_the_width(result: Result) -> None:
    assert max(len(line) for line in report.result_report(result).splitlines()) <= WIDTH


def test_long_names_and_times_keep_their_lines(machine: Machine) -> None:
    """Where the table of peaks does not fit, the moments stand in a second one, with the same figures."""
    names = ("left rear", "left front", "right rear", "right front")
    parts = zip(machine.carriages, names, strict=True)
    renamed = with_changes(
        machine, carriages=[{**carriage.model_dump(), "name": name} for carriage, name in parts]
    )
    for of_machine, shift in ((renamed, 0.0), (machine, 100.0)):
        result = move(of_machine, shift=shift)
        narrow, wide = report.result_report(result), report.result_report(result, width=120)
        assert max(len(line) for line in narrow.splitlines()) <= WIDTH
        narrow_lines, wide_lines = narrow.splitlines(), wide.splitlines()
        for carriage in of_machine.carriages:
            forces, moments = (line for line in narrow_lines if line.strip().startswith(carriage.name))
            (whole,) = (line for line in wide_lines if line.strip().startswith(carriage.name))
            count = len(carriage.name.split())
            assert forces.split() + moments.split()[count:] == whole.split()


def test_a_motion_under_way_is_said_under_the_peaks(machine: Machine) -> None:
    """The artefact dies with the slowest mode; carriages whose largest loads come later are not named."""
    slowest = Modes.of(machine)
    until = 3 / (2 * np.pi * slowest.frequency * slowest.damping_ratio).min()
    both = simulate(machine, Motion.along_x(TIME, np.where(TIME < 0.6, 1, -4)))
    late = one_line(report.result_report(both))
    assert "Note: the motion begins at 1 m/s2, but a run starts at rest" in late
    assert f"until {until:.3g} s the loads are those of a sudden start" in late
    times = both.peaks()["time_of_peak_s"]  # the dynamic parts peak late everywhere
    assert f"peaks of {', '.join(times.index[times < until])} fall into it" in late
    assert 0 < (times < until).sum() < times.size
    again = simulate(machine, Motion.along_x(TIME, np.select([TIME < 0.4, TIME < 0.7], [1, -4], 4)))
    assert "no carriage's peak falls into it" in one_line(report.result_report(again))
    early = simulate(machine, Motion.along_x(TIME, np.where(TIME < 0.6, 2.0, 0.0)))
    said = one_line(report.result_report(early))
    assert "peaks of all carriages fall into it" in said
    assert said.index("the motion begins at") < said.index("Forces of the body on the carriage")
    assert "the motion begins at" in one_line(report.comparison({"Run": early}))


def test_a_motion_from_rest_or_seen_later_has_no_such_note(machine: Machine, result: Result) -> None:
    assert "the motion begins at" not in one_line(report.result_report(result))
    later = simulate(machine, Motion.along_x(TIME, np.ones_like(TIME)), times=TIME[500:])
    assert "the motion begins at" not in one_line(report.result_report(later))


def test_samples_coarser_than_the_highest_mode_are_said(machine: Machine, result: Result) -> None:
    highest = Modes.of(machine).frequency.max()
    for cycles, said in ((0.49, False), (0.51, True)):
        time = np.arange(20) * cycles / highest
        coarse = simulate(machine, Motion.along_x(time, np.where((time > 0.01) & (time < 0.03), 2.0, 0.0)))
        assert ("peaks between the samples are missed" in one_line(report.result_report(coarse))) is said


def test_modes_of_no_machine_are_taken_for_a_slip_of_units(machine: Machine) -> None:
    question = "are stiffness and damping in N/m and N s/m?"
    assert question not in one_line(machine_report(machine))
    for factors, found in (
        (("stiffness", 1e-6), "the lowest mode is at"),
        (("damping", 1e3), "a damping ratio is"),
    ):
        part, factor = factors
        changed = [
            {
                **carriage.model_dump(),
                **{f"{part}_{axis}": getattr(carriage, f"{part}_{axis}") * factor for axis in "yz"},
            }
            for carriage in machine.carriages
        ]
        slipped = with_changes(machine, carriages=changed)
        said = one_line(machine_report(slipped))
        assert found in said and question in said
