"""The report of a work-precision diagram."""

from __future__ import annotations

import re

from rich.box import SIMPLE_HEAD
from rich.table import Table

from guideload.base.number_text import milliseconds, scientific
from guideload.method_comparison.diagram import MODEL_ACCURACY, Row, WorkPrecision, setting_range
from guideload.reports.elements import WIDTH, heading, remark, section, to_text

DEFINITIONS = (
    "Time: from the motion to the loads at its samples. Error: largest difference of the loads from the reference, "
    "divided by the largest load, and by the largest dynamic load (load minus static load); if the static load is "
    "large, only the second error shows errors of the motion. <: below the error of the reference. Pareto: Pareto "
    "optimal, no other row is both faster and more accurate.",
    f"The model, which assumes small rotations, is accurate to about {scientific(MODEL_ACCURACY)} of the load; smaller "
    "errors are without meaning.",
)


def chart_report(chart: WorkPrecision, width: int = WIDTH, encoding: str = "utf-8") -> str:
    """The report: method that `auto` picks, table of settings, reference and its error, failed settings."""
    times = "once" if chart.repetitions == 1 else f"{chart.repetitions} times: median and interquartile range"
    picks = f"picks {chart.auto_method}" if chart.auto_method else "fails"
    return to_text(
        [
            *heading(chart.machine),
            *section("Work-precision diagram"),
            f"auto {picks}: {chart.auto_reason}.",
            f"{chart.samples} samples over {chart.duration:.4g} s; every setting ran {times}",
            settings_table(chart),
            *remark(
                *DEFINITIONS,
                f"Error metric: {chart.error_metric}.",
                f"Reference: {chart.reference.text}.",
                *failures(chart),
            ),
        ],
        width,
        encoding,
    )


def settings_table(chart: WorkPrecision) -> Table:
    """A row per run: its settings, time, steps and errors."""
    table = Table(box=SIMPLE_HEAD, pad_edge=False, padding=0)
    for title in ("method", "rtol or step"):
        table.add_column(title, no_wrap=True)
    for title in ("time\nms", "spread\n%", "steps", "re-\njected", "error\nof load", "of dyn.\nload"):
        table.add_column(title, justify="right", no_wrap=True)
    table.add_column("")
    for rows in chart.runs():
        row = rows[0]
        if row.seconds is None:
            continue
        marks = (("Pareto", row.pareto_optimal), ("auto", chart.auto_row in rows))
        table.add_row(
            row.setting.method,
            setting_range(rows),
            milliseconds(row.seconds),
            "" if row.spread is None else f"{100.0 * row.spread / row.seconds:.0f}",
            str(row.steps),
            str(row.rejected),
            *(_relative_error(error, row) for error in (row.load_error, row.dynamic_error)),
            ", ".join(mark for mark, holds in marks if holds),
        )
    return table


def _relative_error(error: float | None, row: Row) -> str:
    if error is None:
        return "none"
    return f"< {scientific(error)}" if row.below_reference else scientific(error, 1)


def failures(chart: WorkPrecision) -> list[str]:
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
