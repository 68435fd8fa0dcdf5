"""Report of what drives a figure of a run: the change by a small change of each number, strongest first."""

from __future__ import annotations

import numpy as np

from guideload.audit.motion_plausibility import input_warnings
from guideload.base.number_text import digits, kilometres
from guideload.identification.unknowns import usual_unit
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.reports.life import unverified_lines
from guideload.reports.report import Column, Definitions, Report, Section, Table
from guideload.sensitivity.influence import Influence

ROWS = 24
FIGURES = {"peak_resultant": "largest load", "mean_load": "mean load", "life": "life"}
FIRST_ORDER = 0.3  # of the figure: a larger change is not proportional to that of the number
BEYOND = "An effect of more than 30 % is not proportional any more: run the machine with the change."
NOTE = (
    "Derivatives from one run, times a change of 1 % of each number, 1 mm of a place, 10 um of a mounting error: "
    "the effect to first order, of each number alone."
)


def sensitivities_report(machine: Machine, motion: Motion, found: Influence) -> Report:
    """The report: a row per number. motion: of the run that is differentiated."""
    shown, changes = found.columns[:ROWS], np.asarray(found.changes)[:ROWS]
    values = [_in_usual_unit(one.value, one.unit) for one in shown]
    shares = 100.0 * changes / found.value if found.value else [None] * len(shown)
    table = Table(
        Column("number", [column.name for column in shown]),
        Column("value", values, kind="4 digits"),
        Column("change", found.steps[:ROWS], kind="4 digits"),
        Column(
            "effect", changes, *(("km", "signed life") if found.unit == "m" else ("N", "signed 3 digits"))
        ),
        Column("effect", shares, "%", "signed 3 decimals"),
    )
    most = float(np.abs(changes).max(initial=0.0))
    beyond = [BEYOND] if found.value and most > FIRST_ORDER * abs(found.value) else []
    left = len(found.columns) - len(shown)
    products = machine.product_of_carriage if found.figure == "life" else ()
    return Report.of(
        machine,
        f"what drives the {FIGURES[found.figure]}",
        answer=[f"{machine.name}: what drives the {figure_text(found)}."],
        warnings=[*input_warnings(machine, motion), *unverified_lines(products)],
        sections=[
            Section(
                "Effect of a change of each number",
                table,
                f"{left} numbers with less effect are left out." if left else "",
                Definitions(NOTE, *beyond),
            )
        ],
    )


def figure_text(found: Influence) -> str:
    """`life of carriage 2b, 72 000 km`."""
    value = f"{kilometres(found.value)} km" if found.unit == "m" else f"{digits(found.value, 4)} {found.unit}"
    return f"{FIGURES[found.figure]} of carriage {found.carriage}, {value}"


def _in_usual_unit(value: float, unit: str) -> str:
    """A number of a machine [SI unit] as machine files state it: `55 N/um`."""
    usual, factor = ("", 1.0) if unit == "1" else usual_unit(unit)
    return f"{digits(factor * value, 4)} {usual}".rstrip()
