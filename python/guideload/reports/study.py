"""A study as text: what was studied, what it gives, how far it can be trusted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from guideload.base.numbers import load_in_table
from guideload.reports.elements import WIDTH, heading, new_table, remark, section, to_text
from guideload.study.quantities import (
    CONTACT,
    LIFE,
    PEAK,
    contact_words,
    described,
    known_quantity,
    title_of,
    titled,
    unit_of,
)
from guideload.study.statistics import TOO_FEW, fewest_samples

if TYPE_CHECKING:
    import pandas as pd

    from guideload.study.metadata import StudyMetadata
    from guideload.study.result import StudyResult

# From here on something is warned of.
MANY_FAILURES = 0.01  # of the runs: those that are left out may be the ones that matter
WIDE_QUANTILE = 0.1  # of the 99 % quantile of the peak, the width of its interval
WIDE_INDEX = 0.2  # width of the interval of a Sobol index
DRIVERS = 12  # parameters told of

DEFINITIONS = (
    "Peaks are the largest magnitudes of a run, at the samples of the motion, static load included; resultant: "
    "sqrt(Fy^2 + Fz^2). Machine: the worst of its carriages in each sample. The interval of the outermost "
    "quantile is one of 95 %, between two samples, whatever the distribution."
)
MEAN_LOAD = "Mean load: of |Fy| + |Fz|, weighted by distance, with the exponent {exponent:.4g}."
LIFE_OF = "Life: {base:g} km (rating {rating} / mean load)^{exponent:.4g}."
PROBABILITIES = (
    "Intervals of 95 % by Clopper and Pearson. All intervals hold for independent samples; those of a Sobol or "
    "Latin hypercube design scatter less, and the intervals are conservative."
)
INDICES = (
    "Sobol indices: shares of the variance, alone (first order) and with all that a parameter makes together "
    "with others (total). They take the parameters to be independent."
)
RANKS = (
    "Spearman's rank correlation: 1 or -1 where it only grows or falls with the parameter. That of a "
    "correlated parameter holds what its partners do."
)


CHOSEN = (
    "The cases were chosen and are no random sample: statistics of a distribution, probabilities and what drives "
    "them are not given."
)
CONTACT_COUNTS = {
    "contact lost": "an end of the carriage carries nothing",
    "a row open": "one row of rolling elements is unloaded and the other one carries all, contact is kept",
    "contact lost or a row open": "an end of a carriage with play carries nothing, or one row of a preloaded "
    "carriage is unloaded and the other one carries all",
}
CASES = 50  # rows of chosen cases in the report
FEW_VALUES = 3  # parameters up to which the cases tell their values
MANY_CARRIAGES = 4  # carriages beyond which the cases tell the worst only


def study_report(result: StudyResult, width: int = WIDTH, encoding: str = "utf-8") -> str:
    """The report of a study: what varied, failures, summary of each quantity, limits, what drives the peak."""
    chosen = result.studied.chosen
    summary = result.summary()
    parts: list[RenderableType] = [
        *heading(result.studied.machine),
        *section("Study"),
        *study_lines(result),
        parameters_table(result),
    ]
    if result.failed:
        parts += [*section("Failures"), failures_table(result)]
    if warnings := list(study_warnings(result, summary)):
        parts += [*section("Warnings"), *remark(*warnings)]
    if chosen and not summary.empty:
        parts += [*section("Cases"), *cases_lines(result)]
    elif not summary.empty:
        for name in summary.index.unique("quantity"):
            if name != CONTACT:
                levels = (1, 5, 50, 95) if known_quantity(name).smallest_is_worst else (5, 50, 95, 99)
                parts += section(f"{titled(name, result.studied)} [{unit_of(name)}]")
                parts.append(summary_table(summary.loc[name], levels))
        parts += [*remark(*definitions(result, summary))]
        probabilities = result.probabilities()
        if not probabilities.empty:
            parts += [*section("Probabilities"), probabilities_table(probabilities, result.studied)]
            parts += remark(PROBABILITIES)
            if CONTACT in probabilities.index.unique("quantity"):
                parts += contact_lines(result.studied)
        parts += [
            *section(f"What drives {described(result.leading, result.studied)}"),
            *driving_lines(result),
        ]
    return to_text(parts, width, encoding)


def cases_lines(result: StudyResult) -> list[RenderableType]:
    """A row per case, the first ones; values varied and carriages where there is room for them."""
    cases = result.cases()
    varied = [one.name for one in result.studied.varied]
    varied = varied if len(varied) <= FEW_VALUES else []
    figures = [name for name in cases.columns[len(result.studied.varied) : -1] if name != LIFE]
    stem = result.leading.partition("[")[0]
    each = len(figures) <= MANY_CARRIAGES or not known_quantity(stem).has_worst
    table = new_table("case", *(name.replace(".", ".\n").replace("].", "].\n") for name in varied))
    for name in figures if each else ():
        table.add_column(Text(name.partition("[")[2].removesuffix("]") or "machine"), justify="right")
    worst = None if each else result.column(stem)
    if worst is not None:
        table.add_column("machine", justify="right")
    if LIFE in cases:
        table.add_column("life\nkm", justify="right", no_wrap=True)
    table.add_column("passed", overflow="fold")
    for i, (_, row) in enumerate(cases.iloc[:CASES].iterrows()):
        cells = [str(i), *(f"{row[name]:.4g}" for name in varied)]
        cells += [_cell(float(row[name])) for name in figures] if worst is None else [_cell(float(worst[i]))]
        cells += [_cell(float(row[LIFE]))] if LIFE in cases else []
        table.add_row(*cells, Text(row["passed"]))
    owner = "each carriage" if each and len(figures) > 1 else "the machine"
    told = f"{titled(stem, result.studied)} of {owner}"
    told += f" [{unit_of(stem)}]" if unit_of(stem) else ""
    lines = [f"{told}; life: the shortest of the carriages." if LIFE in cases else f"{told}."]
    if len(cases) > CASES:
        lines.append(
            f"The first {CASES} of {len(cases)} cases; all are in summary.json, or in cases() of the result."
        )
    contact = contact_lines(result.studied) if CONTACT in result.quantities else []
    return [table, *remark(*lines), *contact, *remark(CHOSEN)]


def contact_lines(studied: StudyMetadata) -> list[RenderableType]:
    """What counts as lost contact on the machine."""
    words = contact_words(studied.machine)
    return remark(f"{words[0].upper()}{words[1:]}: at some instant of a run {CONTACT_COUNTS[words]}.")


def study_lines(result: StudyResult) -> list[str]:
    """Motion, samples, how they were drawn and the seed."""
    studied = result.studied
    motion = f"motion {studied.motion}: " if studied.motion else "motion: "
    lines = [f"{motion}{studied.duration:.4g} s, {studied.instants} samples"]
    if studied.motion:
        lines.append("taken as known: what its trace leaves open does not scatter here; `run` tells its band")
    if studied.sensitivity:
        rows = studied.runs // (len(studied.varied) + 2)
        lines.append(
            f"{rows} rows of a Saltelli design, {studied.runs} runs; the samples are its matrices A and B"
        )
    else:
        lines.append("1 sample" if studied.runs == 1 else f"{studied.runs} samples")
    lines.append("the cases given" if studied.chosen else f"drawn {_how(studied.sampling, studied.seed)}")
    return lines


def _how(sampling: str, seed: int | None) -> str:
    words = {"sobol": "by a scrambled Sobol sequence", "latin hypercube": "in a Latin hypercube"}
    return f"{words.get(sampling, 'at random')}, seed {seed}"


def parameters_table(result: StudyResult) -> Table:
    """A row per parameter: unit, mean, standard deviation and range of what was drawn; the range of chosen values."""
    moments = () if result.studied.chosen else ("mean", "std. dev.")
    table = new_table("parameter", *moments, "smallest", "largest")
    table.add_column("unit", no_wrap=True)
    for one in result.studied.varied:
        values = result.column(one.name)
        values = values[~np.isnan(values)]
        figures = (values.mean(), values.std(), values.min(), values.max()) if values.size else ()
        cells = ([f"{figure:.4g}" for figure in figures] or [""] * 4)[2 - len(moments) :]
        table.add_row(Text(one.name), *cells, "of its value" if one.unit == "1" else one.unit)
    return table


def failures_table(result: StudyResult) -> Table:
    """A row per kind of failure."""
    table = new_table("runs", "share\n%", "first\nsample")
    table.add_column("reason", overflow="fold")
    for row in result.failures().to_dict("records"):
        cells = str(row["count"]), f"{100 * row['share']:.3g}", str(row["first_sample"])
        table.add_row(*cells, Text(row["reason"]))
    return table


def study_warnings(result: StudyResult, summary: pd.DataFrame) -> Iterator[str]:
    """What spoils the statistics, and what to change; first what spoils more."""
    if summary.empty:
        yield f"{result.finished} of {result.runs} samples have run, and no sample has a result."
        return
    if result.studied.chosen:
        if result.finished < result.runs:
            yield f"{result.finished} of {result.runs} cases have run. Resume the study to run the others."
        return
    if result.finished < result.runs:
        yield (
            f"{result.finished} of {result.runs} samples have run; the statistics are of those. Resume the study to "
            "run the others."
        )
    if result.failed > MANY_FAILURES * result.finished:
        yield (
            f"{result.failed} of {result.finished} runs failed, {100 * result.failed / result.finished:.2g} %. The "
            "statistics leave them out: if they are the worst machines, it looks better than it is."
        )
    samples, least = int(summary["samples"].max()), fewest_samples(0.99)
    if samples < least:
        are = "1 sample is too" if samples == 1 else f"{samples} samples are"
        yield f"{are} few: the 99 % quantile needs {least} samples for an interval with two ends."
    elif PEAK in summary.index.unique("quantity"):
        peaks = summary.loc[PEAK]
        width = float(((peaks["q99_high"] - peaks["q99_low"]) / peaks["q99"]).max())
        if width > WIDE_QUANTILE:
            more = (width / WIDE_QUANTILE) ** 2
            yield (
                f"The interval of the 99 % quantile of a peak is wide, {100 * width:.2g} % of it; about {more:.2g} "
                f"times as many samples make it {100 * WIDE_QUANTILE:g} %."
            )
    if result.studied.sensitivity and not result.too_few:
        indices = result.sensitivity()
        width = max(
            float((indices[f"{of}_high"] - indices[f"{of}_low"]).max()) for of in ("total", "first_order")
        )
        if width > WIDE_INDEX:
            more = (width / WIDE_INDEX) ** 2
            yield (
                f"The intervals of the Sobol indices are wide, up to {width:.2g}; about {more:.2g} times as many "
                f"samples make them {WIDE_INDEX:g}."
            )


def summary_table(rows: pd.DataFrame, levels: Sequence[int] = (5, 50, 95, 99)) -> Table:
    """A row per carriage, and below them the machine: mean, deviation, quantiles in percent.

    At the end the interval of the outermost quantile: of the last one, or of the first if that is 1 %.
    """
    outer = 1 if levels[0] == 1 else levels[-1]
    quantiles = [f"q{level:02d}" for level in levels]
    table = new_table(
        "carriage", "mean", "std. dev.", *(f"{level} %" for level in levels), f"{outer} % lies in"
    )
    for carriage, row in rows.iterrows():
        if carriage or len(rows) != 2:  # the machine's is that of its only carriage
            values = (float(row[name]) for name in ("mean", "standard_deviation", *quantiles))
            ends = float(row[f"q{outer:02d}_low"]), float(row[f"q{outer:02d}_high"])
            table.add_row(Text(str(carriage) or "machine"), *map(_cell, values), _interval(*ends))
    return table


def definitions(result: StudyResult, summary: pd.DataFrame) -> list[str]:
    """What the figures of the summary mean."""
    studied, names = result.studied, summary.index.unique("quantity")
    lines = [DEFINITIONS]
    if "mean_load_N" in names:
        lines.append(MEAN_LOAD.format(exponent=studied.exponent))
    if LIFE in names and studied.rating is not None and studied.life_base is not None:
        rating = f"{load_in_table(studied.rating)} N"
        base = 1e-3 * studied.life_base
        lines.append(LIFE_OF.format(base=base, rating=rating, exponent=studied.exponent))
    return [" ".join(lines)]


def probabilities_table(probabilities: pd.DataFrame, studied: StudyMetadata) -> Table:
    """A row per limit and carriage: how often it was passed, the probability and its interval."""
    table = new_table("", "")
    table.columns[1].justify = "left"
    for title in ("times", "of", "%", "% lies in"):
        table.add_column(title, justify="right", no_wrap=True)
    for name in probabilities.index.unique("quantity"):
        rows = probabilities.loc[name]
        sign = "below" if known_quantity(name).smallest_is_worst else "above"
        limit = rows["limit"].iloc[0]
        what = title_of(name, studied)
        what += "" if np.isnan(limit) else f" {sign} {_cell(limit)} {unit_of(name)}"
        for carriage, row in rows.iterrows():
            if carriage or len(rows) != 2:
                table.add_row(
                    what,
                    Text(str(carriage) or ("" if len(rows) == 1 else "any")),
                    f"{row['count']:.0f}",
                    f"{row['samples']:.0f}",
                    f"{100 * row['probability']:.3g}",
                    f"{100 * row['low']:.3g} to {100 * row['high']:.3g}",
                )
                what = ""
    return table


def driving_lines(result: StudyResult) -> list[RenderableType]:
    """The parameters that drive the peak, strongest first, and what the figures are."""
    if result.too_few:
        return remark(TOO_FEW)
    rows = result.driving()
    shown, rest = rows.iloc[:DRIVERS], rows.iloc[DRIVERS:]
    if result.studied.sensitivity:
        table = new_table("parameter", "total", "lies in", "first order", "lies in")
        for name, row in shown.iterrows():
            total = _share(row["total"]), _shares(row["total_low"], row["total_high"])
            alone = _share(row["first_order"]), _shares(row["first_order_low"], row["first_order_high"])
            table.add_row(Text(str(name)), *total, *alone)
    else:
        table = new_table("parameter", "rank correlation", "lies in")
        for name, row in shown.iterrows():
            table.add_row(Text(str(name)), _share(row["rank_correlation"]), _shares(row["low"], row["high"]))
    lines: list[RenderableType] = [table]
    if len(rest):
        largest = rest["total" if result.studied.sensitivity else "rank_correlation"].abs().max()
        beyond = "which do not vary" if np.isnan(largest) else f"none beyond {_share(largest)}"
        lines += remark(f"and {len(rest)} more, {beyond}")
    return [*lines, *remark(INDICES if result.studied.sensitivity else RANKS)]


def _cell(value: float) -> str:
    return load_in_table(value) if np.isfinite(value) else ""


def _interval(low: float, high: float) -> str:
    return f"{_cell(low) or '...'} to {_cell(high) or '...'}"


def _share(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.2f}".replace("-0.00", "0.00")


def _shares(low: float, high: float) -> str:
    return f"{_share(low)} to {_share(high)}" if np.isfinite(low) else ""
