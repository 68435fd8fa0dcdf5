"""Life and static safety in the report of a study: answer, probability of failure, notes, formulas."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd
from rich.console import RenderableType
from rich.text import Text

from guideload.base.number_text import counted, joined
from guideload.life.limits import LARGE_LOAD
from guideload.reports.elements import new_table, remark, section
from guideload.reports.life import kilometres, rating_formulas
from guideload.study.description.measures import LIFE, PEAK_LOAD, SAFETY, column_of
from guideload.study.results.result import StudyResult
from guideload.study.results.statistics import known

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
    reliability = 100 * result.metadata.machine.life.reliability
    yield (
        f"Life that all carriages reach with {reliability:g} %: median {_km(life['q50'])} km, 5 % quantile "
        f"{_km(life['q05'])} km; smallest static safety: median {safety['q50']:.2f}, 1 % quantile {safety['q01']:.2f}"
    )
    if LIFE in result.limits:
        row = result.failure_probability().loc[""].to_dict()
        probability, low, high, shorter = (_percent(row[key]) for key in ROW)
        yield (
            f"Probability of a failure by fatigue before {_km(row['travel_km'])} km: {probability} % ({low} to "
            f"{high} %); the rating life is shorter in {shorter} % of the samples"
        )


ROW = ("probability", "low", "high", "shorter")


def life_section(result: StudyResult) -> Iterator[RenderableType]:
    """Notes, probability of failure and formulas; nothing for a machine without products."""
    notes = [*result.metadata.life_notes, *_load_notes(result)]
    if not notes and not result.rated:
        return
    yield from section("Life and static safety")
    yield from remark(*notes)
    if LIFE in result.limits and not result.metadata.chosen:
        rows = result.failure_probability()
        travel = f"{_km(rows['travel_km'].iloc[0])} km"
        table = new_table("carriage", f"fails before\n{travel}, %", "% lies in", "life is\nshorter, %")
        for carriage, row in rows.iterrows():
            if carriage or len(rows) != 2:
                probability, low, high, shorter = (_percent(row[key]) for key in ROW)
                table.add_row(Text(str(carriage) or "any"), probability, f"{low} to {high}", shorter)
        yield table
        yield from remark(FAILURE)
    if result.rated:
        yield from remark(*rating_formulas(list(result.rated.values())))


def _load_notes(result: StudyResult) -> Iterator[str]:
    """A sentence on loads beyond those for which the life formula holds."""
    stem, above, count = column_of(*PEAK_LOAD), [], 0
    for name, criteria in result.rated.items():
        found = int(
            np.count_nonzero(known(result.column(f"{stem}[{name}]")) > LARGE_LOAD * criteria.rating.value)
        )
        above += [name] if found else []
        count = max(count, found)
    if above:
        what = counted(count, "case" if result.metadata.chosen else "sample")
        yield (
            f"Note: P0 exceeds {LARGE_LOAD:g} C on carriage {joined(above)}, in up to {what}: the life formula holds "
            "for smaller loads."
        )


def _km(value: float) -> str:
    return kilometres(1e3 * value)


def _percent(share: float) -> str:
    return f"{100 * share:.3g}"
