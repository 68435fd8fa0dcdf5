"""The report of a study: result, warnings, tables, definitions."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from guideload.base.number_text import load_in_table
from guideload.reports.elements import WIDTH, heading, new_table, remark, section, to_text
from guideload.reports.study_life import life_answer, life_section
from guideload.study.description.measures import CONTACT, LIFE, PEAK, QUANTITIES, SAFETY, Quantity
from guideload.study.description.metadata import StudyMetadata
from guideload.study.results.result import StudyResult, weaker_parameters
from guideload.study.results.statistics import TOO_FEW, fewest_samples, known
from guideload.study.results.titles import capitalised, contact_words, title_of, with_owner, with_unit

# Limits of warnings.
MANY_FAILURES = 0.01  # share of the runs; failed runs may be the worst ones
WIDE_QUANTILE = 0.1  # interval width of the 99 % quantile of the peak resultant, over the quantile
WIDE_INDEX = 0.2  # interval width of a Sobol index
# Sizes of tables.
MOST_PARAMETERS = 12  # in the table of sensitivities
MOST_CASES = 50  # in the table of cases
MOST_VALUES = 3  # parameters whose values are in the table of cases
MOST_CARRIAGES = 4  # in the table of cases; with more it has the worst only

MACHINE_LIFE = "life is that which all carriages reach with the stated probability"
DEFINITIONS = (
    "Peaks are the largest magnitudes of a run, at the samples of the motion, static load included; resultant: "
    'sqrt(Fy^2 + Fz^2). Machine: the worst carriage of each sample. "+-": standard error of the quantile before it, '
    "for any distribution; empty for too few samples. Intervals have a confidence of 95 %, those of probabilities by "
    "Clopper and Pearson."
)
INDICES = (
    "Sobol index: share of the variance that a parameter causes alone (first order), or including its interactions "
    "(total); for independent parameters."
)
RANKS = (
    "Spearman's rank correlation: 1 or -1 for an increasing or decreasing function of the parameter. It includes the "
    "influence of the parameters with which the parameter is correlated."
)
CASES_NOTE = "Given cases are not a random sample: they have no statistics, probabilities or sensitivities."
CONTACT_COUNTS = {
    "contact lost": "an end of the carriage carries no load",
    "a row open": "one row of rolling elements is unloaded and the other row carries the load",
    "contact lost or a row open": "an end of a carriage with clearance carries no load, or one row of a preloaded "
    "carriage is unloaded and the other row carries the load",
}


def study_report(result: StudyResult, width: int = WIDTH, encoding: str = "utf-8") -> str:
    """The report of a study; lines have at most `width` characters."""
    return to_text(study_parts(result), width, encoding)


def study_parts(result: StudyResult) -> list[RenderableType]:
    """The elements of the report of a study."""
    metadata, summary = result.metadata, result.summary()
    parts: list[RenderableType] = [*heading(metadata.machine)]
    if not summary.empty:
        answer = cases_answer(result) if metadata.chosen else answer_lines(result, summary)
        parts += [*section("Result"), *remark(*result.doubts, "\n".join(answer))]
    if warnings := list(study_warnings(result, summary)):
        parts += [*section("Warnings"), *remark(*warnings)]
    parts += [*section("Study"), *study_lines(result), parameters_table(result)]
    if result.failed:
        parts += [*section("Failures"), failures_table(result)]
    if metadata.chosen and not summary.empty:
        parts += [*section("Cases"), *cases_table(result), *life_section(result)]
    elif not summary.empty:
        parts += [*statistics_tables(result, summary), *life_section(result), *section("Definitions")]
        parts += remark(" ".join(definitions(result, summary)))
    return parts


# ---- result


def answer_lines(result: StudyResult, summary: pd.DataFrame) -> Iterator[str]:
    """Outermost quantile of the leading quantity, probability of each limit, most influential parameter."""
    metadata, stem = result.metadata, result.leading.partition("[")[0]
    if stem in summary.index.unique("quantity"):
        quantity, rows = QUANTITIES[stem], summary.loc[stem]
        level = "q01" if quantity.smallest_is_worst else "q99"
        owners = [name for name in rows.index if name] or [""]
        worst = min if quantity.smallest_is_worst else max
        carriage = str(worst(owners, key=rows[level].to_dict().__getitem__))
        value, low, high = (float(rows[f"{level}{end}"][carriage]) for end in ("", "_low", "_high"))
        interval, owner = _interval(low, high, stem), f"carriage {carriage}" if carriage else "machine"
        title = f"{capitalised(title_of(stem, metadata))}, {int(level[1:])} % quantile"
        yield f"{title}: {_with_unit(value, quantity)} ({interval} at 95 %), {owner}"
    yield from life_answer(result, summary)
    probabilities = result.probabilities()
    for name in probabilities.index.unique("quantity"):
        rows = probabilities.loc[name]
        row = rows.iloc[-1]  # of the machine
        probability, *ends = (f"{100 * row[key]:.3g}" for key in ("probability", "low", "high"))
        yield f"Probability of {limit_text(name, row['limit'], metadata)}: {probability} % ({' to '.join(ends)} %)"
    if result.too_few:
        return
    drivers, measure = result.driving(), "total" if metadata.sensitivity else "rank_correlation"
    if np.isfinite(drivers[measure].iloc[0]):
        words = "total Sobol index" if metadata.sensitivity else "rank correlation"
        yield f"Driven by {drivers.index[0]} ({words} {_share(drivers[measure].iloc[0])})"


def cases_answer(result: StudyResult) -> Iterator[str]:
    """The worst of the given cases, and the number of cases that exceed each limit."""
    stem = result.leading.partition("[")[0]
    values, quantity = result.table(result.of_carriages(stem)).drop(columns="reason"), QUANTITIES[stem]
    worst, words = ("idxmin", "Smallest") if quantity.smallest_is_worst else ("idxmax", "Largest")
    column, case = getattr(values.unstack(), worst)()
    value = _with_unit(float(values[column][case]), quantity)
    yield f"{words} of all cases: {with_owner(column, result.metadata)}, {value}, case {case}"
    for name, limit in result.limits.items():
        count = np.count_nonzero(QUANTITIES[name].exceeds(result.column(name), limit))
        yield f"{capitalised(limit_text(name, limit, result.metadata))}: {count} of {result.runs} cases"


def limit_text(name: str, limit: float, metadata: StudyMetadata) -> str:
    """A limit in words: "peak resultant above 7000 N"; without a value "contact lost"."""
    quantity, title = QUANTITIES[name], title_of(name, metadata)
    sign = "below" if quantity.smallest_is_worst else "above"
    return title if np.isnan(limit) else f"{title} {sign} {_with_unit(limit, quantity)}"


# ---- warnings


def study_warnings(result: StudyResult, summary: pd.DataFrame) -> Iterator[str]:
    """Reasons why the statistics are incomplete or inaccurate, each with a way out; the worst first."""
    what = "cases" if result.metadata.chosen else "samples"
    if summary.empty:
        yield f"{result.finished} of {result.runs} samples have run, but no sample has a result."
        return
    if result.finished < result.runs:
        yield f"{result.finished} of {result.runs} {what} have run. Resume the study to run the others."
    if result.metadata.chosen:
        return
    if result.failed > MANY_FAILURES * result.finished:
        share = f"{100 * result.failed / result.finished:.2g} %"
        hint = "The statistics exclude them: if they are the worst machines, the true loads are higher."
        yield f"{result.failed} of {result.finished} runs failed, {share}. {hint}"
    samples, least = int(summary["samples"].max()), fewest_samples(0.99)
    if samples < least:
        are = "1 sample is too" if samples == 1 else f"{samples} samples are"
        yield f"{are} few: the 99 % quantile needs {least} samples for an interval with both ends."
    elif PEAK in summary.index.unique("quantity"):
        peaks = summary.loc[PEAK]
        width = float(((peaks["q99_high"] - peaks["q99_low"]) / peaks["q99"]).max())
        if width > WIDE_QUANTILE:
            more = f"{(width / WIDE_QUANTILE) ** 2:.2g} times as many samples"
            wide = f"The interval of the 99 % quantile of a peak is wide, {100 * width:.2g} % of it"
            yield f"{wide}; about {more} make it {100 * WIDE_QUANTILE:g} %."
    if result.metadata.sensitivity and not result.too_few:
        indices = result.sensitivity()
        widths = (indices[f"{order}_high"] - indices[f"{order}_low"] for order in ("total", "first_order"))
        if (width := max(float(one.max()) for one in widths)) > WIDE_INDEX:
            more = f"{(width / WIDE_INDEX) ** 2:.2g} times as many samples make them {WIDE_INDEX:g}"
            yield f"The intervals of the Sobol indices are wide, up to {width:.2g}; about {more}."


# ---- study


def study_lines(result: StudyResult) -> Iterator[str]:
    """Motion, number of samples, sampling method and seed."""
    metadata = result.metadata
    motion = f"motion {metadata.motion}: " if metadata.motion else "motion: "
    yield f"{motion}{metadata.duration:.4g} s, {metadata.instants} samples"
    if metadata.draws_motion:
        yield "each sample has a motion of its own, drawn from the posterior of the trace"
    elif metadata.motion and not metadata.motion_exact:
        yield "the study neglects the uncertainty of the motion; `guideload run` gives its credible bands"
    if metadata.sensitivity:
        rows = metadata.runs // (len(metadata.parameters) + 2)
        yield f"{rows} rows of a Saltelli design, {metadata.runs} runs; the samples are its matrices A and B"
    else:
        yield "1 sample" if metadata.runs == 1 else f"{metadata.runs} samples"
    scrambles = "a scrambled Sobol sequence", "a Latin hypercube"
    if (count := metadata.replicates) > 1:
        scrambles = (
            f"{count} independent scrambles of Sobol's sequence",
            f"{count} independent Latin hypercubes",
        )
    words = {"sobol": f"by {scrambles[0]}", "latin hypercube": f"in {scrambles[1]}"}
    drawn = f"drawn {words.get(metadata.sampling, 'at random')}, seed {metadata.seed}"
    yield "given cases" if metadata.chosen else drawn
    if not result.doubts:
        yield result.second_look_text


def parameters_table(result: StudyResult) -> Table:
    """A row per parameter: mean, standard deviation, range, unit; for given cases without mean and deviation."""
    moments = () if result.metadata.chosen else ("mean", "std. dev.")
    table = new_table("parameter", *moments, "smallest", "largest", texts=("unit",))
    for one in result.metadata.parameters:
        if one.is_draw:
            table.add_row(Text(one.name), *[""] * (2 + len(moments)), "a draw")
            continue
        values = known(result.column(one.name))
        statistics = (values.mean(), values.std(), values.min(), values.max()) if values.size else ()
        cells = ([f"{number:.4g}" for number in statistics] or [""] * 4)[2 - len(moments) :]
        table.add_row(Text(one.name), *cells, "of its value" if one.unit == "1" else one.unit)
    return table


def failures_table(result: StudyResult) -> Table:
    """A row per kind of failure."""
    table = new_table("runs", "share\n%", "first\nsample", texts=("reason",))
    for row in result.failures().to_dict("records"):
        cells = str(row["count"]), f"{100 * row['share']:.3g}", str(row["first_sample"])
        table.add_row(*cells, Text(row["reason"]))
    return table


# ---- statistics and cases


def cases_table(result: StudyResult) -> list[RenderableType]:
    """A row for each of the first cases, with parameters and carriages if there are few of them."""
    cases, metadata, stem = result.cases(), result.metadata, result.leading.partition("[")[0]
    varied = [one.name for one in metadata.parameters] if len(metadata.parameters) <= MOST_VALUES else []
    columns = [
        name
        for name in cases.columns[len(metadata.parameters) : -1]
        if name not in (LIFE, SAFETY) or name == stem
    ]
    each = len(columns) <= MOST_CARRIAGES or QUANTITIES[stem].worse is None
    if not each:
        cases, columns = cases.assign(**{stem: result.column(stem)}), [stem]
    titles = [name.replace(".", ".\n").replace("].", "].\n") for name in varied]
    titles += [name.partition("[")[2].removesuffix("]").replace(" ", "\n") or "machine" for name in columns]
    owner = "each carriage" if each and len(columns) > 1 else "the machine"
    for name, title in ((LIFE, "life\nkm"), (SAFETY, "S0\n")):
        if name in cases and name not in columns:
            titles, columns = [*titles, title], [*columns, name]
    table = new_table("case", *titles, texts=("exceeded",))
    for i, (_, row) in enumerate(cases.iloc[:MOST_CASES].iterrows()):
        cells = [
            *(f"{row[name]:.4g}" for name in varied),
            *(_cell(float(row[name]), name) for name in columns),
        ]
        table.add_row(str(i), *cells, Text(row["exceeded"]))
    unit = f" [{QUANTITIES[stem].unit}]" if QUANTITIES[stem].unit else ""
    life = f"; {MACHINE_LIFE}; S0: the smallest static safety" if LIFE in cases else ""
    lines = [f"{capitalised(title_of(stem, metadata))} of {owner}{unit}{life}."]
    if len(cases) > MOST_CASES:
        lines += [
            f"The first {MOST_CASES} of {len(cases)} cases; all are in summary.json, or in result.cases()."
        ]
    contact = [contact_line(metadata)] if CONTACT in result.quantities else []
    return [table, *remark(*lines, *contact, CASES_NOTE)]


def statistics_tables(result: StudyResult, summary: pd.DataFrame) -> Iterator[RenderableType]:
    """Statistics of each quantity, probabilities, and sensitivities of the leading quantity.

    Quantities without a worst side (times, loads at the start) appear only if there is no other quantity.
    """
    names = [name for name in summary.index.unique("quantity") if name != CONTACT]
    for name in [name for name in names if QUANTITIES[name].worse is not None] or names:
        yield from section(capitalised(with_unit(name, result.metadata)))
        yield summary_table(summary.loc[name], QUANTITIES[name])
    probabilities = result.probabilities()
    if not probabilities.empty:
        yield from section("Probabilities")
        yield probabilities_table(probabilities, result.metadata)
    yield from section(f"What drives {with_owner(result.leading, result.metadata)}")
    yield from driving_table(result)


def summary_table(rows: pd.DataFrame, quantity: Quantity) -> Table:
    """A row per carriage and one of the machine: mean, standard deviation, quantiles with their standard errors."""
    levels = (1, 5, 50, 95) if quantity.smallest_is_worst else (5, 50, 95, 99)
    table = new_table(
        "carriage", "mean", "std. dev.", *(title for level in levels for title in (f"{level} %", "+-"))
    )
    for carriage, row in rows.iterrows():
        if carriage or len(rows) != 2:  # the row of the machine equals that of its only carriage
            cells = [_cell(float(row[key]), quantity.name) for key in ("mean", "standard_deviation")]
            for level in levels:
                cells.append(_cell(float(row[f"q{level:02d}"]), quantity.name))
                cells.append(_error(float(row[f"q{level:02d}_standard_error"])))
            table.add_row(Text(str(carriage) or "machine"), *cells)
    return table


def probabilities_table(probabilities: pd.DataFrame, metadata: StudyMetadata) -> Table:
    """A row per limit and carriage: number of samples beyond the limit, probability and its interval."""
    table = new_table("", "", "times", "of", "%", "% lies in")
    table.columns[1].justify = "left"
    for name in probabilities.index.unique("quantity"):
        rows = probabilities.loc[name]
        title = limit_text(name, rows["limit"].iloc[0], metadata)
        for carriage, row in rows.iterrows():
            if carriage or len(rows) != 2:
                of_all = "machine" if name == LIFE else "any"
                owner = Text(str(carriage) or ("" if len(rows) == 1 else of_all))
                counts = (f"{row[key]:.0f}" for key in ("count", "samples"))
                probability, *ends = (f"{100 * row[key]:.3g}" for key in ("probability", "low", "high"))
                table.add_row(title, owner, *counts, probability, " to ".join(ends))
                title = ""
    return table


def driving_table(result: StudyResult) -> list[RenderableType]:
    """Sensitivities of the leading quantity, the most influential parameter first."""
    if result.too_few:
        return remark(TOO_FEW)
    rows = result.driving()
    names = ("total", "first_order") if result.metadata.sensitivity else ("rank_correlation",)
    titles = (title for name in names for title in (name.replace("_", " "), "lies in"))
    table = new_table("parameter", *titles)
    places = [
        list(rows.columns).index(name) for name in names
    ]  # the two columns after each are the ends of its interval
    for parameter, *values in rows.iloc[:MOST_PARAMETERS].itertuples():
        cells: list[str] = []
        for i in places:
            value, low, high = map(_share, values[i : i + 3])
            cells += [value, f"{low} to {high}" if low else ""]
        table.add_row(Text(str(parameter)), *cells)
    return [table, *remark(*weaker_parameters(rows, MOST_PARAMETERS))]


# ---- definitions


def definitions(result: StudyResult, summary: pd.DataFrame) -> Iterator[str]:
    """Definitions of the terms in the tables."""
    metadata, names = result.metadata, summary.index.unique("quantity")
    yield DEFINITIONS
    if "mean_load_N" in names:
        load = (
            f"the equivalent load by the rule {metadata.machine.life.rule}" if result.rated else "|Fy| + |Fz|"
        )
        yield f"Mean load: power mean of {load} over distance, exponent {metadata.exponent:.4g}."
    if LIFE in names:
        yield (
            f"Of the machine, {MACHINE_LIFE}. Static safety: C0/P0 at the worst instant of each sample (ISO 14728-2)."
        )
    yield accuracy_line(metadata)
    if CONTACT in result.limits:
        yield contact_line(metadata)
    if not result.too_few:
        yield INDICES if metadata.sensitivity else RANKS


def accuracy_line(metadata: StudyMetadata) -> str:
    """How standard errors and intervals follow from the samples."""
    if metadata.replicates > 1:
        return (
            f"The samples are divided among {metadata.replicates} independent scrambles of the sequence; the scatter "
            "among these gives standard errors and intervals. Among the outermost few samples it tells nothing: there, "
            "and for rank correlations, the samples count as independent, which is conservative."
        )
    if metadata.sampling == "random":
        return "Standard errors and intervals are those of independent samples."
    return (
        "Standard errors and intervals are those of independent samples; samples of one scramble scatter less, so they "
        "are conservative. With replicates they are estimated."
    )


def contact_line(metadata: StudyMetadata) -> str:
    """Definition of lost contact for the machine."""
    words = contact_words(metadata.machine)
    return f"{capitalised(words)}: at some instant of a run {CONTACT_COUNTS[words]}."


def _cell(value: float, name: str) -> str:
    """A value of a column as text, empty if it is unknown or infinite; a static safety has two decimals."""
    if not np.isfinite(value):
        return ""
    return f"{value:.2f}" if name.partition("[")[0] == SAFETY else load_in_table(value)


def _interval(low: float, high: float, name: str) -> str:
    return f"{_cell(low, name) or '...'} to {_cell(high, name) or '...'}"


def _error(value: float) -> str:
    """A standard error with two digits, empty if it is unknown."""
    return "" if not np.isfinite(value) else f"{value:.0f}" if value >= 9.95 else f"{value:.2g}"


def _with_unit(value: float, quantity: Quantity) -> str:
    return f"{_cell(value, quantity.name)} {quantity.unit}".rstrip()


def _share(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.2f}".replace("-0.00", "0.00")
