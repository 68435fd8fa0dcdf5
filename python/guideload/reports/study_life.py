"""Life and static safety in the report of a study: answer, probability of failure, notes, formulas."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd

from guideload.base.number_text import counted, digits, fixed, joined, number
from guideload.life.limits import LARGE_LOAD
from guideload.reports.life import duty_text, rating_formulas
from guideload.reports.report import Column, Definitions, Part, Section, Table, interval
from guideload.reports.study_tables import travel_text
from guideload.study.quantities import LIFE, PEAK_LOAD, SAFETY, column_name
from guideload.study.result import StudyResult
from guideload.study.statistics import known

FAILURE = (
    "A carriage fails by fatigue before this travel: in each sample its life has a Weibull distribution of "
    "slope 1.5; the probability is the mean over the samples: it combines the scatter of fatigue with that of the "
    "parameters. "
    "Life is shorter: share of the samples whose rating life is shorter than this travel."
)


def life_answer(result: StudyResult, summary: pd.DataFrame) -> Iterator[str]:
    """Life and static safety of the machine, and the probability of a failure before the limit on the life."""
    if LIFE not in summary.index.unique("quantity"):
        return
    life, safety = (summary.xs("", level="carriage").loc[name].to_dict() for name in (LIFE, SAFETY))
    conditions = result.metadata.machine.life
    yield (
        f"Life that all carriages reach with {number(100 * conditions.reliability)} % {duty_text(conditions)}: median "
        f"{travel_text(life['q50'], result.metadata)}, 5 % quantile {travel_text(life['q05'], result.metadata)}; "
        f"smallest static safety: median {fixed(safety['q50'], 2)}, 1 % quantile "
        f"{fixed(safety['q01'], 2)}"
    )
    if LIFE in result.limits:
        row = result.failure_probability().loc[""].to_dict()
        probability, low, high, shorter = (digits(100 * row[key]) for key in ROW)
        interval = "" if low == high else f" ({low} to {high} %)"
        before = travel_text(row["travel_km"], result.metadata)
        yield (
            f"Probability of a failure by fatigue before {before}: {probability} %{interval}; the rating "
            f"life is shorter in {shorter} % of the samples"
        )


ROW = ("probability", "low", "high", "shorter")


def life_section(result: StudyResult) -> Section:
    """Notes, probability of failure and formulas; empty for a machine without products."""
    parts: list[Part] = [*result.metadata.life_notes, *_load_notes(result)]
    if LIFE in result.limits and not result.metadata.chosen and (parts or result.rated):
        parts += [_failure_table(result), Definitions(FAILURE)]
    formulas = rating_formulas(list(result.rated.values())) if result.rated else []
    return Section("Life and static safety", *parts, *formulas)


def _failure_table(result: StudyResult) -> Table:
    """A row per carriage, and one for any of them: probability of a failure before the limit on the life."""
    rows = result.failure_probability()
    if len(rows) == 2:  # the row of all carriages equals that of the only one
        rows = rows.iloc[:1]
    return Table(
        Column("carriage", [str(name) or "any" for name in rows.index]),
        Column(
            f"fails before {travel_text(rows['travel_km'].iloc[0], result.metadata)}",
            100 * rows["probability"],
            "%",
            "3 digits",
        ),
        interval(100 * rows["low"], 100 * rows["high"], "%"),
        Column("life is shorter", 100 * rows["shorter"], "%", "3 digits"),
    )


def _load_notes(result: StudyResult) -> Iterator[str]:
    """A sentence on loads beyond those for which the life formula holds."""
    stem, above, count = column_name(*PEAK_LOAD), [], 0
    for name, criteria in result.rated.items():
        found = int(
            np.count_nonzero(known(result.column(f"{stem}[{name}]")) > LARGE_LOAD * criteria.rating.value)
        )
        above += [name] if found else []
        count = max(count, found)
    if above:
        what = counted(count, "case" if result.metadata.chosen else "sample")
        yield (
            f"Note: P0 exceeds {number(LARGE_LOAD)} C on carriage {joined(above)}, in up to {what}: the life formula "
            "holds for smaller loads."
        )
