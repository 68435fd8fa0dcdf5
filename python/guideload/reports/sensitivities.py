"""Report of what drives a figure of a run: the change by a small change of each number, strongest first."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.text import Text

from guideload.reports.elements import new_table, remark, to_text

if TYPE_CHECKING:
    from rich.console import RenderableType

    from guideload.machine.machine import Machine
    from guideload.sensitivity.influence import Influence

ROWS = 24
FIGURES = {"peak_resultant": "largest load", "mean_load": "mean load", "life": "life"}
NOTE = (
    "Derivatives from one run, times a change of 1 % of each number, 1 mm of a place, 10 um of a mounting error: "
    "the effect to first order, of each number alone."
)


def sensitivities_report(machine: Machine, found: Influence, encoding: str = "utf-8") -> str:
    """The report: a row per number."""
    table = new_table("number", "value\n", "change\n", f"effect\n{found.unit}", "effect\n%")
    shown = list(zip(found.columns, found.steps, found.changes.tolist(), strict=True))[:ROWS]
    for column, step, change in shown:
        unit = "" if column.unit == "1" else f" {column.unit}"
        row = f"{column.value:.4g}{unit}", step, f"{change:+.3g}", f"{100.0 * change / found.value:+.3f}"
        table.add_row(Text(column.name), *row)
    left = len(found.columns) - len(shown)
    figure = f"{FIGURES[found.figure]} of carriage {found.carriage}, {found.value:.4g} {found.unit}"
    parts: list[RenderableType] = [*remark(f"{machine.name}: what drives the {figure}."), table]
    parts += remark(f"{left} numbers with less effect are left out.") if left else []
    return to_text([*parts, *remark(*(f"Note: {note}." for note in found.notes), NOTE)], encoding=encoding)
