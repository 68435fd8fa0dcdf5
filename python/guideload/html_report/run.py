"""The HTML report of a run."""

from __future__ import annotations

import platform
from collections.abc import Iterable, Iterator
from dataclasses import replace
from importlib.metadata import version
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from guideload.base.arrays import Array
from guideload.base.finite import finite_json
from guideload.html_report.figures import Chart, Figure, Line, Listing, chart, picture
from guideload.html_report.page import report_page, save_page
from guideload.plots.long_records import is_long, worst_cycle
from guideload.plots.run import drawings
from guideload.plots.style import INK, carriage_look
from guideload.reports.machine import machine_sections
from guideload.reports.report import Column, Section, Table
from guideload.reports.run import result_report

if TYPE_CHECKING:
    from guideload.machine.machine import Machine
    from guideload.plots.run import Pictures
    from guideload.simulation.result import Result

AROUND_PEAK = 0.25  # s before and after the largest load; of a long record the worst cycle is shown instead
HISTORIES, INPUT = "Load histories", "Input, for repetition"  # titles of sections
PACKAGES = ("guideload", "numpy", "scipy")
# What the figures rest on: statement and source.
ASSUMPTIONS = (
    (
        "One rigid body on the elastic and damping links of its carriages; rails and base are rigid.",
        "paper, 3",
    ),
    (
        "M q'' + B q' + K q = Q - M_u a(t), from Lagrange's equations in vector form, without constraints.",
        "paper, 3.4",
    ),
    ("Rotations are small; the audit estimates what this neglects.", "paper, 3.1"),
    (
        "Load of a link: k delta + b delta', or its nonlinear law; load of a carriage: sum over its links.",
        "paper, 3.6",
    ),
    (
        "The run starts in static equilibrium: under the weight, or, of a record that begins under way, with m a.",
        "guideload, theory",
    ),
    ("Between two samples the acceleration of the cart is linear in time.", "guideload, theory"),
)


def save(
    result: Result, path: str | PathLike[str], *, replace: bool = True, pictures: Pictures | None = None
) -> Path:
    """Write the report of a run as one HTML file, whole or not at all; returns its path.

    replace: whether a file that exists is replaced; if not, that is an error. pictures: as for `run_page`. Raises
    OSError if the file cannot be written, and the errors of `run_page`.
    """
    return save_page(run_page(result, pictures), path, replace=replace)


def run_page(result: Result, pictures: Pictures | None = None) -> str:
    """The report of a run as HTML.

    Contents: those of the text report; histories that can be zoomed, machine, assumptions, and the input as far as it
    is needed to repeat the run. pictures: those of `plots.run.drawings`, if they have been drawn. Raises ArgumentError
    if the result reports no instant.
    """
    pictures = pictures or drawings(result)
    machine, data = result.machine, result.quantities
    report = result_report(result)
    body, carriages = machine_sections(machine)
    versions = ", ".join(f"{name} {version(name)}" for name in PACKAGES)
    added = [
        body,
        carriages,
        Section(
            "Assumptions and formulas",
            Table(*map(Column, ("statement", "source"), zip(*ASSUMPTIONS, strict=True))),
        ),
        Section(
            INPUT,
            [
                f"Versions: {versions}, Python {platform.python_version()}.",
                f"Motion: {data.attrs['motion_source']}",
            ],
        ),
    ]
    peaks, *others = report.sections
    hint = "Drag to zoom, double click for the whole history, click on a name to hide it."
    page = replace(report, sections=[peaks, Section(HISTORIES, hint), *others, *added])
    scene_caption = (
        "The machine, with the force of the body on each carriage at the instant of the largest resultant."
    )
    figures: dict[str, Iterable[Figure]] = {
        HISTORIES: _load_charts(result),
        **({"Motion of the points": _point_charts(result)} if machine.points else {}),
        "Motion of the cart": _motion_charts(result),
        body.title: [picture(pictures["scene.png"](), scene_caption)],
        "Natural modes": [picture(pictures["modes.png"](), "The natural modes.")],
        INPUT: [Listing("The machine in SI units", _listed(machine))],
    }
    return report_page(page, figures)


def _load_charts(result: Result) -> Iterator[Chart]:
    machine, data = result.machine, result.quantities
    time = data["time"]
    if not machine.carriages:
        names = data["link"]
        lines = [Line(str(n), data["link_load"][:, i], carriage_look(i).color) for i, n in enumerate(names)]
        yield chart("Load of the links", "N", time, lines, group="run")
        return
    largest = time[int(data["resultant"].max(axis=1).argmax())]
    near = np.abs(time - largest) <= AROUND_PEAK
    if is_long(result):
        near = np.zeros(time.size, np.bool_)
        near[worst_cycle(result)] = True

    def carriage_lines(values: Array) -> list[Line]:
        return [_line(i, carriage.name, values[:, i]) for i, carriage in enumerate(machine.carriages)]

    yield chart("Resultant of Fy and Fz", "N", time, carriage_lines(data["resultant"]), group="run")
    if near.sum() < time.size:
        title = f"Resultant around the largest load, at {largest:.3f} s"
        yield chart(title, "N", time[near], carriage_lines(data["resultant"][near]))
    for index, axis in ((1, "y"), (2, "z")):
        yield chart(f"F{axis}", "N", time, carriage_lines(data["force"][:, :, index]), group="run")


def _line(index: int, name: str, values: Array) -> Line:
    style = carriage_look(index)
    return Line(name, values, style.color, dashed=style.dash != "-")


def _motion_charts(result: Result) -> Iterator[Chart]:
    data = result.quantities
    for quantity, title, unit in (
        ("cart_acceleration", "Acceleration", "m/s2"),
        ("cart_velocity", "Velocity", "m/s"),
    ):
        if quantity in data:
            values = data[quantity]
            lines = [
                Line(axis, values[:, i], INK if axis == "x" else carriage_look(i).color)
                for i, axis in enumerate("xyz")
                if axis == "x" or values[:, i].any()
            ]
            yield chart(title, unit, data["time"], lines, group="run")


def _point_charts(result: Result) -> Iterator[Chart]:
    data = result.quantities
    moving = 1e6 * (data["point_displacement"] - data["static_point_displacement"])
    for i, point in enumerate(result.machine.points):
        lines = [_line(axis, "xyz"[axis], moving[:, i, axis]) for axis in range(3)]
        yield chart(f"{point.name}: displacement from rest", "um", data["time"], lines, group="run")


def _listed(machine: Machine) -> str:
    """The values of a machine in SI units as JSON, with a row for each component."""
    rows = []
    for key, value in machine.model_dump(mode="json", exclude_defaults=True).items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            rows += [f"{key}:", *(f"  {finite_json(entry, ascii_only=False)}" for entry in value)]
        else:
            rows.append(f"{key}: {finite_json(value, ascii_only=False)}")
    return "\n".join(rows)
