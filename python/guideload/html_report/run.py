"""The HTML report of a run."""

from __future__ import annotations

import json
import platform
from collections.abc import Iterator
from html import escape
from importlib.metadata import version
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.console import RenderableType
from rich.text import Text

from guideload.audit.audit import LABEL
from guideload.base.arrays import Array
from guideload.html_report.document import Line, chart, document, folded, html_of, picture, section
from guideload.html_report.page import footer, save_page
from guideload.life.life import Life
from guideload.plots.long_records import is_long, worst_cycle
from guideload.plots.machine import modes as modes_picture
from guideload.plots.machine import scene
from guideload.plots.style import INK, carriage_look
from guideload.reports.elements import dofs_line, new_table
from guideload.reports.elements import section as heading
from guideload.reports.life import life_answer, life_of_run, life_section
from guideload.reports.machine import body_lines, carriage_tables, links_table, modes_table, nominal_lines
from guideload.reports.points import points_section
from guideload.reports.run import (
    DEFINITIONS,
    answer,
    band_lines,
    motion_lines_of,
    peaks_tables,
    reactions_section,
    solution_lines,
)

if TYPE_CHECKING:
    from guideload.machine.machine import Machine
    from guideload.simulation.result import Result

AROUND_PEAK = 0.25  # s before and after the largest load; of a long record the worst cycle is shown instead
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


def save(result: Result, path: str | PathLike[str]) -> Path:
    """Write the report of a run as one HTML file, whole or not at all; returns its path.

    Raises OSError if the file cannot be written, and the errors of `run_page`.
    """
    return save_page(run_page(result), path)


def run_page(result: Result) -> str:
    """The report of a run as HTML.

    Contents: the answer, the warnings, and life and static safety if carriages name products; peaks, histories that can
    be zoomed, machine, modes, motion, method, audit, assumptions, and the input as far as it is needed to repeat the
    run. Raises ArgumentError if the result reports no instant.
    """
    machine = result.machine
    return document(f"{machine.name}: load of the guides", _body(result))


def _body(result: Result) -> Iterator[str]:
    machine, data = result.machine, result.quantities
    yield f'<header><h1>{escape(machine.name)}</h1><p class="subtitle">{escape(dofs_line(machine))}</p></header>'
    life = life_of_run(result)
    well = not result.audit.warnings and (life is None or (isinstance(life, Life) and life.holds))
    text = html_of([*answer(result), *life_answer(life)])
    yield f'<div class="answer{"" if well else " warned"}">{text}</div>'
    if machine.carriages:
        definitions = folded("Definitions", html_of([DEFINITIONS, *band_lines(result)]))
        yield section("Peak loads of the carriages", html_of(peaks_tables(result)), definitions)
    if parts := life_section(life):
        yield section("Life and static safety", html_of(parts[len(heading("")) :]))
    if parts := points_section(result):
        text = html_of(parts[len(heading("")) :])
        yield section("Motion of the points", text, *_point_charts(result), long=True)
    yield section("Load histories", *_load_charts(result), long=True)
    yield section("Motion of the cart", html_of(motion_lines_of(data)), *_motion_charts(result), long=True)
    yield section("Drive and held dofs", html_of(reactions_section(result)[len(heading("")) :]))
    yield section("Machine", *_machine(result), long=True)
    yield section("Natural modes", *_modes(result), long=True)
    yield section("Method and audit", html_of(solution_lines(data)), html_of([_audit_table(result)]))
    yield section("Assumptions and formulas", html_of([_assumptions_table()]))
    yield section("Input, for repetition", *_input(result), long=True)
    yield footer()


def _load_charts(result: Result) -> Iterator[str]:
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

    def lines_of(values: Array) -> list[Line]:
        return [_line(i, carriage.name, values[:, i]) for i, carriage in enumerate(machine.carriages)]

    yield "<p>Drag to zoom, double click for the whole history, click on a name to hide it.</p>"
    yield chart("Resultant of Fy and Fz", "N", time, lines_of(data["resultant"]), group="run")
    if near.sum() < time.size:
        title = f"Resultant around the largest load, at {largest:.3f} s"
        yield chart(title, "N", time[near], lines_of(data["resultant"][near]))
    for index, axis in ((1, "y"), (2, "z")):
        yield chart(f"F{axis}", "N", time, lines_of(data["force"][:, :, index]), group="run")


def _line(index: int, name: str, values: Array) -> Line:
    style = carriage_look(index)
    return Line(name, values, style.color, dashed=style.dash != "-")


def _motion_charts(result: Result) -> Iterator[str]:
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


def _point_charts(result: Result) -> Iterator[str]:
    data = result.quantities
    moving = 1e6 * (data["point_displacement"] - data["static_point_displacement"])
    for i, point in enumerate(result.machine.points):
        lines = [_line(axis, "xyz"[axis], moving[:, i, axis]) for axis in range(3)]
        yield chart(f"{point.name}: displacement from rest", "um", data["time"], lines, group="run")


def _machine(result: Result) -> Iterator[str]:
    machine = result.machine
    caption = (
        "The machine, with the force of the body on each carriage at the instant of the largest resultant."
    )
    yield picture(scene(machine, result), caption)
    yield html_of(body_lines(machine))
    if machine.carriages:
        yield html_of(carriage_tables(machine))
    if machine.links:
        yield html_of([links_table(machine)])


def _modes(result: Result) -> Iterator[str]:
    machine = result.machine
    yield html_of([modes_table(machine, result.modes), *nominal_lines(machine, "frequencies")])
    yield picture(modes_picture(machine, result.modes)[0], "The natural modes.")


def _audit_table(result: Result) -> RenderableType:
    table = new_table("figure", texts=("finding",))
    for line in result.audit.lines:
        table.add_row(Text(line[:LABEL].strip()), Text(line[LABEL:]))
    return table


def _assumptions_table() -> RenderableType:
    table = new_table("statement", texts=("source",))
    for statement, source in ASSUMPTIONS:
        table.add_row(Text(statement), source)
    return table


def _input(result: Result) -> Iterator[str]:
    attributes = result.quantities.attrs
    versions = ", ".join(f"{name} {version(name)}" for name in PACKAGES)
    yield html_of([f"Versions: {versions}, Python {platform.python_version()}."])
    yield html_of([Text(f"Motion: {attributes['motion_source']}")])
    yield folded("The machine in SI units", f"<pre>{escape(_listed(result.machine))}</pre>")


def _listed(machine: Machine) -> str:
    """The values of a machine in SI units as JSON, with a row for each component."""
    rows = []
    for key, value in machine.model_dump(mode="json", exclude_defaults=True).items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            rows += [f"{key}:", *(f"  {json.dumps(entry, ensure_ascii=False)}" for entry in value)]
        else:
            rows.append(f"{key}: {json.dumps(value, ensure_ascii=False)}")
    return "\n".join(rows)
