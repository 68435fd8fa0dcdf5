"""The report of a work-precision diagram."""

from __future__ import annotations

import re

from guideload.base.number_text import digits, scientific
from guideload.method_comparison.diagram import MODEL_ACCURACY, Row, WorkPrecision, setting_range
from guideload.reports.report import Column, Report, Table, definitions, free_dofs, section

DEFINITIONS = (
    "Time: from the motion to the loads at its samples. Error: largest difference of the loads from the reference, "
    "divided by the largest load, and by the largest dynamic load (load minus static load); if the static load is "
    "large, only the second error shows errors of the motion. <: below the error of the reference. Pareto: Pareto "
    "optimal, no other row is both faster and more accurate.",
    f"The model, which assumes small rotations, is accurate to about {scientific(MODEL_ACCURACY)} of the load; smaller "
    "errors are without meaning.",
)


def chart_report(chart: WorkPrecision) -> Report:
    """The report: method that `auto` picks, table of settings, reference and its error, failed settings."""
    times = "once" if chart.repetitions == 1 else f"{chart.repetitions} times: median and interquartile range"
    picks = f"picks {chart.auto_method}" if chart.auto_method else "fails"
    samples = f"{chart.samples} samples over {digits(chart.duration, 4)} s; every setting ran {times}"
    machine = chart.machine
    return Report(
        title=f"{machine.name}: work-precision diagram",
        answer=[f"{machine.name}: auto {picks}: {chart.auto_reason}."],
        about=free_dofs(machine),
        sections=[
            section("Work-precision diagram", [samples], _settings_table(chart), definitions(*DEFINITIONS)),
            section(
                "Reference",
                f"Error metric: {chart.error_metric}.",
                f"Reference: {chart.reference.text}.",
                *_failures(chart),
            ),
        ],
    )


def _settings_table(chart: WorkPrecision) -> Table:
    """A row per run: its settings, time, steps and errors."""
    runs = [(rows, rows[0], rows[0].seconds) for rows in chart.runs()]
    shown = [(rows, row, time) for rows, row, time in runs if time is not None]
    marks = [
        ", ".join(
            mark
            for mark, holds in (("Pareto", row.pareto_optimal), ("auto", chart.auto_row in rows))
            if holds
        )
        for rows, row, _ in shown
    ]
    spreads = [None if row.spread is None else 100.0 * row.spread / time for _, row, time in shown]
    return Table(
        Column("rtol or step", [f"{row.setting.method} {setting_range(rows)}" for rows, row, _ in shown]),
        Column("time", [time for *_, time in shown], "ms", "milliseconds"),
        Column("spread", spreads, "%", "count"),
        Column("error of load", [_relative_error(row.load_error, row) for _, row, _ in shown], kind="number"),
        Column(
            "of dyn. load", [_relative_error(row.dynamic_error, row) for _, row, _ in shown], kind="number"
        ),
        Column("", marks),
        Column("steps", [row.steps for _, row, _ in shown], kind="count"),
        Column("rejected", [row.rejected for _, row, _ in shown], kind="count"),
    )


def _relative_error(error: float | None, row: Row) -> str:
    if error is None:
        return "none"
    return f"< {scientific(error)}" if row.below_reference else scientific(error, 1)


def _failures(chart: WorkPrecision) -> list[str]:
    """Why settings failed: one sentence for settings of a curve whose messages differ only in numbers."""
    alike: dict[tuple[str, str | None, str], list[Row]] = {}
    for row in chart.rows:
        if row.failed is not None:
            words = re.sub(r"\d[-+.\de]*", "", row.failed)
            alike.setdefault((*row.setting.curve, words), []).append(row)
    sentences = []
    for first, *others in alike.values():
        also = f"; the same at {setting_range(others)}" if others else ""
        sentences.append(f"{first.setting.text}: {first.failed}{also}.")
    return sentences
