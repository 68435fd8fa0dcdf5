"""The chart of speed against accuracy as text."""

from __future__ import annotations

import re

from rich.box import SIMPLE_HEAD
from rich.table import Table

from guideload.base.numbers import milliseconds, scientific
from guideload.methods.diagram import MODEL_ACCURACY, Row, WorkPrecision, setting_range
from guideload.reports.elements import WIDTH, heading, remark, section, to_text

DEFINITIONS = (
    "Time: from the motion to the loads at its samples. Error: the largest difference from the reference over "
    "time and loads, as part of the largest load, and of the largest dynamic load (load less static load): a "
    "method can miss the whole motion and still show three digits of the load. <: below what the reference can "
    "tell. Front: no other row is both faster and more accurate.",
    f"The model's own accuracy, with its small rotations, ends near {scientific(MODEL_ACCURACY)} of the load: digits "
    "beyond are arithmetic, not physics.",
)


def chart_report(chart: WorkPrecision, width: int = WIDTH, encoding: str = "utf-8") -> str:
    """The table of all settings that ran, the reference and its trust, what `auto` picks, and what did not run."""
    times = "once" if chart.repetitions == 1 else f"{chart.repetitions} times: median and interquartile range"
    remarks = [
        *DEFINITIONS,
        f"Judged: {chart.judged}.",
        f"Reference: {chart.reference.text}.",
        f"auto picks {chart.auto_method}: {chart.auto_reason}."
        if chart.auto_method
        else f"auto fails: {chart.auto_reason}.",
        *not_run(chart),
    ]
    return to_text(
        [
            *heading(chart.machine),
            *section("Speed against accuracy"),
            f"{chart.samples} samples over {chart.duration:.4g} s; every setting ran {times}",
            settings_table(chart),
            *remark(*remarks),
        ],
        width,
        encoding,
    )


def settings_table(chart: WorkPrecision) -> Table:
    """A row per run: the settings that lead to it, its time, steps and errors."""
    table = Table(box=SIMPLE_HEAD, pad_edge=False, padding=0)
    for title in ("method", "rtol or step"):
        table.add_column(title, no_wrap=True)
    for title in ("time\nms", "spread\n%", "steps", "re-\njected", "error\nof load", "of dyn.\npart"):
        table.add_column(title, justify="right", no_wrap=True)
    table.add_column("")
    for rows in chart.runs():
        row = rows[0]
        if row.seconds is None:
            continue
        marks = [
            mark for mark, holds in (("front", row.pareto_optimal), ("auto", chart.auto_row in rows)) if holds
        ]
        table.add_row(
            row.setting.method,
            setting_range(rows),
            milliseconds(row.seconds),
            "" if row.spread is None else f"{100.0 * row.spread / row.seconds:.0f}",
            str(row.steps),
            str(row.rejected),
            share_text(row.load_error, row),
            share_text(row.dynamic_error, row),
            ", ".join(marks),
        )
    return table


def not_run(chart: WorkPrecision) -> list[str]:
    """Why settings have no figures: a sentence for those of a method that end in the same words."""
    alike: dict[tuple[str, str | None, str], list[Row]] = {}
    for row in chart.rows:
        if row.failed is not None:
            words = re.sub(r"\d[-+.\de]*", "", row.failed)
            alike.setdefault((row.setting.method, row.setting.kind, words), []).append(row)
    sentences = []
    for first, *others in alike.values():
        also = f"; the same at {setting_range(others)}" if others else ""
        sentences.append(f"{first.setting.text}: {first.failed}{also}.")
    return sentences


def share_text(share: float | None, row: Row) -> str:
    """An error as part of a load."""
    if share is None:
        return "none"
    return f"< {scientific(share)}" if row.below_reference else scientific(share, 1)
