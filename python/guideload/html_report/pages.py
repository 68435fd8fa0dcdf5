"""The HTML reports of results: their text with charts and pictures."""

from __future__ import annotations

import csv
import platform
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from guideload.base.arguments import checked
from guideload.base.arrays import Array
from guideload.base.finite import finite_json
from guideload.base.versions import version
from guideload.html_report.figures import Chart, Figure, Line, Listing, chart, picture
from guideload.html_report.page import package_file, report_page, save_page
from guideload.plots.long_records import is_long, worst_cycle
from guideload.plots.run import drawings
from guideload.plots.style import INK, carriage_look
from guideload.reports.key_figures import key_figures
from guideload.reports.machine import machine_sections
from guideload.reports.report import Column, Section, Table
from guideload.reports.run import result_report

if TYPE_CHECKING:
    from guideload.duty.duty_cycle import DutyCycle
    from guideload.machine.machine import Machine
    from guideload.plots.run import Pictures
    from guideload.simulation.result import Result
    from guideload.sizing.size import Sizing
    from guideload.study.result import StudyResult

AROUND_PEAK = 0.25  # s before and after the largest load; of a long record the worst cycle is shown instead
HISTORIES, INPUT, PICTURES = "Load histories", "Input, for repetition", "Pictures"  # titles of sections
PACKAGES = ("guideload", "numpy", "scipy")
HINT = "Drag to zoom, double click for the whole history, click on a name to hide it."
SCENE = "The machine, with the force of the body on each carriage at the instant of the largest resultant."


@checked
def save(
    result: Result, path: str | PathLike[str], *, replace: bool = True, pictures: Pictures | None = None
) -> Path:
    """Write the report of a run as one HTML file, whole or not at all; returns its path.

    replace: whether a file that exists is replaced; if not, that is an error. pictures: as for `run_page`. Raises
    OSError if the file cannot be written, and the errors of `run_page`.
    """
    return save_page(run_page(result, pictures), path, replace=replace)


@checked
def run_page(result: Result, pictures: Pictures | None = None) -> str:
    """The report of a run as HTML.

    Contents: those of the text report; histories that can be zoomed, machine, assumptions, and the input as far as it
    is needed to repeat the run. pictures: those of `plots.run.drawings`, if they have been drawn. Raises ArgumentError
    if the result reports no instant.
    """
    pictures = pictures or drawings(result)
    machine, report = result.machine, result_report(result)
    body, carriages = machine_sections(machine)
    rows = csv.reader(package_file("assumptions.csv").splitlines())
    assumptions = Table(*(Column(label, texts) for label, *texts in zip(*rows, strict=True)))
    versions = ", ".join(f"{name} {version(name)}" for name in PACKAGES)
    given = [
        f"Versions: {versions}, Python {platform.python_version()}.",
        f"Motion: {result.quantities.attrs['motion_source']}",
    ]
    peaks, *others = report.sections
    added = [body, carriages, Section("Assumptions and formulas", assumptions), Section(INPUT, given)]
    figures: dict[str, Iterable[Figure]] = {
        HISTORIES: _load_charts(result),
        "Motion of the points": _point_charts(result) if machine.points else [],
        "Motion of the cart": _motion_charts(result),
        body.title: [picture(pictures["scene.png"](), SCENE)],
        "Natural modes": [picture(pictures["modes.png"](), "The natural modes.")],
        INPUT: [Listing("The machine in SI units", _listed(machine))],
    }
    page = replace(report, sections=[peaks, Section(HISTORIES, HINT), *others, *added])
    return report_page(page, figures, key_figures(result))


@checked
def comparison_page(results: Mapping[str, Result]) -> str:
    """Several runs side by side, by title; their most loaded carriages as charts that can be zoomed."""
    from guideload.plots.compare import comparison
    from guideload.reports.compare import comparison_report

    caption = "The resultant of the most loaded carriage of each run, and the peaks of all carriages."
    figures: list[Figure] = [*_worst_charts(results), picture(comparison(results)[0], caption)]
    return report_page(comparison_report(results), {PICTURES: figures})


@checked
def sizing_page(machine: Machine, sizing: Sizing) -> str:
    """The ranked candidates, and the history of the smallest that holds."""
    from guideload.reports.sizing import sizing_report

    best = sizing.smallest
    charts = [] if best is None or sizing.result is None else _worst_charts({best.name: sizing.result})
    return report_page(sizing_report(machine, sizing), {PICTURES: charts})


@checked
def duty_page(duty: DutyCycle) -> str:
    """The report of a duty cycle, and the history of the most loaded carriage in each case."""
    from guideload.reports.duty import duty_report

    results = {case.name: life.record.result for case, life in zip(duty.cases, duty.lives, strict=True)}
    return report_page(duty_report(duty), {PICTURES: _worst_charts(results)})


@checked
def study_page(result: StudyResult, pictures: Pictures | None = None) -> str:
    """The report of a study with its pictures: those of `plots.study.study_drawings`, if they have been drawn."""
    from guideload.plots.study import study_drawings  # other pages do not need pandas
    from guideload.reports.study import study_report

    pictures = pictures or study_drawings(result)
    drawn = (picture(draw(), name.removesuffix(".png")) for name, draw in pictures.items())
    return report_page(study_report(result), {PICTURES: drawn})


def _worst_charts(results: Mapping[str, Result]) -> Iterator[Chart]:
    """The resultant of the most loaded carriage of each run."""
    for i, (title, result) in enumerate(results.items()):
        data = result.quantities
        at = result.largest_load().index
        line = Line(result.machine.carriages[at].name, data["resultant"][:, at], carriage_look(i).color)
        words = f"{title}: resultant of the most loaded carriage"
        yield chart(words, "N", data["time"], [line], group="runs")


def _load_charts(result: Result) -> Iterator[Chart]:
    data, names = result.quantities, [carriage.name for carriage in result.machine.carriages]
    time = data["time"]
    if not names:
        yield _chart("Load of the links", "N", time, data["link_load"], map(str, data["link"]))
        return
    resultant = data["resultant"]
    yield _chart("Resultant of Fy and Fz", "N", time, resultant, names)
    largest = result.largest_load().time
    near = np.flatnonzero(np.abs(time - largest) <= AROUND_PEAK)
    part = worst_cycle(result) if is_long(result) else slice(near[0], near[-1] + 1)
    if time[part].size < time.size:
        title = f"Resultant around the largest load, at {largest:.3f} s"
        yield _chart(title, "N", time[part], resultant[part], names, group="")
    for index, axis in ((1, "y"), (2, "z")):
        yield _chart(f"F{axis}", "N", time, data["force"][:, :, index], names)


def _chart(
    title: str, unit: str, time: Array, values: Array, names: Iterable[str], group: str = "run"
) -> Chart:
    """Histories (time, name) in the colours and dashes of carriages."""
    lines = []
    for i, (name, line) in enumerate(zip(names, values.T, strict=True)):
        color, dash = carriage_look(i)
        lines.append(Line(name, line, color, dashed=dash != "-"))
    return chart(title, unit, time, lines, group)


def _motion_charts(result: Result) -> Iterator[Chart]:
    data = result.quantities
    for quantity, title, unit in (
        ("cart_acceleration", "Acceleration", "m/s2"),
        ("cart_velocity", "Velocity", "m/s"),
    ):
        if quantity in data:
            lines = [
                Line(axis, values, INK if axis == "x" else carriage_look(i).color)
                for i, (axis, values) in enumerate(zip("xyz", data[quantity].T, strict=True))
                if axis == "x" or values.any()
            ]
            yield chart(title, unit, data["time"], lines, group="run")


def _point_charts(result: Result) -> Iterator[Chart]:
    data = result.quantities
    moving = 1e6 * (data["point_displacement"] - data["static_point_displacement"])
    for i, point in enumerate(result.machine.points):
        yield _chart(f"{point.name}: displacement from rest", "um", data["time"], moving[:, i], "xyz")


def _listed(machine: Machine) -> str:
    """The values of a machine in SI units as JSON, with a row for each component."""
    rows = []
    for key, value in machine.model_dump(mode="json", exclude_defaults=True).items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            rows += [f"{key}:", *(f"  {finite_json(entry, ascii_only=False)}" for entry in value)]
        else:
            rows.append(f"{key}: {finite_json(value, ascii_only=False)}")
    return "\n".join(rows)
