"""The report of a work-precision diagram."""

from __future__ import annotations

import re

from guideload.audit.plausibility import machine_warnings
from guideload.base.number_text import digits, scientific
from guideload.method_comparison.diagram import MODEL_ACCURACY, SettingResult, WorkPrecision, setting_range
from guideload.reports.report import Column, Definitions, Report, Section, Table

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
    return Report.of(
        machine,
        "work-precision diagram",
        answer=[f"{machine.name}: auto {picks}: {chart.auto_reason}."],
        warnings=machine_warnings(machine),
        sections=[
            Section("Work-precision diagram", [samples], _settings_table(chart), Definitions(*DEFINITIONS)),
            Section(
                "Reference",
                f"Error metric: {chart.error_metric}.",
                f"Reference: {chart.reference.text}.",
                *_failures(chart),
            ),
        ],
    )


def _settings_table(chart: WorkPrecision) -> Table:
    """A row per run: its settings, time, steps and errors."""
    runs = [rows for rows in chart.runs() if rows[0].seconds is not None]
    first = [rows[0] for rows in runs]
    marks = [(("Pareto", rows[0].pareto_optimal), ("auto", chart.auto_row in rows)) for rows in runs]
    spreads = [one.spread and one.seconds and 100.0 * one.spread / one.seconds for one in first]
    return Table(
        Column("rtol or step", [f"{rows[0].setting.method} {setting_range(rows)}" for rows in runs]),
        Column("time", [one.seconds for one in first], "ms", "milliseconds"),
        Column("spread", spreads, "%", "whole"),
        Column("error of load", [_relative_error(one.load_error, one) for one in first], kind="number"),
        Column("of dyn. load", [_relative_error(one.dynamic_error, one) for one in first], kind="number"),
        Column("", [", ".join(name for name, holds in each if holds) for each in marks]),
        Column("steps", [one.steps for one in first], kind="whole"),
        Column("rejected", [one.rejected for one in first], kind="whole"),
    )


def _relative_error(error: float | None, row: SettingResult) -> str:
    if error is None:
        return "none"
    return f"< {scientific(error)}" if row.below_reference else scientific(error, 1)


def _failures(chart: WorkPrecision) -> list[str]:
    """Why settings failed: one sentence for settings of a curve whose messages differ only in numbers."""
    alike: dict[tuple[str, str | None, str], list[SettingResult]] = {}
    for row in chart.rows:
        if row.failed is not None:
            words = re.sub(r"\d[-+.\de]*", "", row.failed)
            alike.setdefault((*row.setting.curve, words), []).append(row)
    sentences = []
    for first, *others in alike.values():
        also = f"; the same at {setting_range(others)}" if others else ""
        sentences.append(f"{first.setting.text}: {first.failed}{also}.")
    return sentences
