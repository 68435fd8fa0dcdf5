"""The report of a study: result, warnings, tables, definitions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

import numpy as np
import pandas as pd

from guideload.base.arrays import Array
from guideload.base.number_text import KINDS, between, capitalised, digits, fixed, number, percent
from guideload.reports.report import Column, Part, Report, Section, Table, definitions, free_dofs, section
from guideload.reports.study_life import life_answer, life_section
from guideload.study.description.measures import CONTACT, LIFE, PEAK, QUANTITIES, SAFETY, Quantity
from guideload.study.description.metadata import StudyMetadata
from guideload.study.results.result import StudyResult, weaker_parameters
from guideload.study.results.statistics import TOO_FEW, fewest_samples, known
from guideload.study.results.titles import contact_words, title_of, with_owner, with_unit

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


def study_report(result: StudyResult) -> Report:
    """The report of a study: answer, warnings, parameters, statistics or cases, definitions."""
    metadata, summary = result.metadata, result.summary()
    answer: list[str] = []
    sections = [
        section("Study", [*_study_lines(result)], _parameters_table(result)),
        section("Failures", _failures_table(result)),
    ]
    if not summary.empty:
        lines = _cases_answer(result) if metadata.chosen else _statistics_answer(result, summary)
        answer = [*lines]
        sections += _case_sections(result) if metadata.chosen else _statistics_sections(result, summary)
    return Report(
        title=f"{metadata.machine.name}: study",
        answer=["\n".join([metadata.machine.name, *answer])],
        warnings=[*result.doubts, *(f"Note: {warning}" for warning in _study_warnings(result, summary))],
        about=free_dofs(metadata.machine),
        sections=sections,
    )


def _case_sections(result: StudyResult) -> list[Section]:
    return [section("Cases", *_cases_parts(result)), life_section(result)]


def _statistics_sections(result: StudyResult, summary: pd.DataFrame) -> list[Section]:
    """Statistics of each quantity, probabilities, and sensitivities of the leading quantity.

    Quantities without a worst side (times, loads at the start) appear only if there is no other quantity.
    """
    names = [name for name in summary.index.unique("quantity") if name != CONTACT]
    names = [name for name in names if QUANTITIES[name].worse is not None] or names
    metadata = result.metadata
    return [
        *(
            section(
                capitalised(with_unit(name, metadata)), _summary_table(summary.loc[name], QUANTITIES[name])
            )
            for name in names
        ),
        section("Probabilities", _probabilities_table(result.probabilities(), metadata)),
        section(f"What drives {with_owner(result.leading, metadata)}", *_driving_parts(result)),
        life_section(result),
        section("Definitions", " ".join(_terms(result, summary))),
    ]


# ---- result


def _statistics_answer(result: StudyResult, summary: pd.DataFrame) -> Iterator[str]:
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
        probability, *ends = (digits(100 * row[key]) for key in ("probability", "low", "high"))
        yield f"Probability of {limit_text(name, row['limit'], metadata)}: {probability} % ({' to '.join(ends)} %)"
    if result.too_few:
        return
    drivers, measure = result.driving(), "total" if metadata.sensitivity else "rank_correlation"
    if np.isfinite(drivers[measure].iloc[0]):
        words = "total Sobol index" if metadata.sensitivity else "rank correlation"
        yield f"Driven by {drivers.index[0]} ({words} {fixed(drivers[measure].iloc[0], 2)})"


def _cases_answer(result: StudyResult) -> Iterator[str]:
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


def _study_warnings(result: StudyResult, summary: pd.DataFrame) -> Iterator[str]:
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
        share = percent(result.failed / result.finished)
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
            more = f"{digits((width / WIDE_QUANTILE) ** 2, 2)} times as many samples"
            wide = f"The interval of the 99 % quantile of a peak is wide, {percent(width)} of it"
            yield f"{wide}; about {more} make it {percent(WIDE_QUANTILE)}."
    if result.metadata.sensitivity and not result.too_few:
        indices = result.sensitivity()
        widths = (indices[f"{order}_high"] - indices[f"{order}_low"] for order in ("total", "first_order"))
        if (width := max(float(one.max()) for one in widths)) > WIDE_INDEX:
            more = (
                f"{digits((width / WIDE_INDEX) ** 2, 2)} times as many samples make them {number(WIDE_INDEX)}"
            )
            yield f"The intervals of the Sobol indices are wide, up to {digits(width, 2)}; about {more}."


# ---- study


def _study_lines(result: StudyResult) -> Iterator[str]:
    """Motion, number of samples, sampling method and seed."""
    metadata = result.metadata
    motion = f"motion {metadata.motion}: " if metadata.motion else "motion: "
    yield f"{motion}{digits(metadata.duration, 4)} s, {metadata.instants} samples"
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


def _parameters_table(result: StudyResult) -> Table:
    """A row per parameter: mean, standard deviation, range, unit; for given cases without mean and deviation."""
    parameters = result.metadata.parameters
    values = [np.empty(0) if one.is_draw else known(result.column(one.name)) for one in parameters]
    statistics: dict[str, Callable[[Array], float]] = {
        "mean": np.mean,
        "std. dev.": np.std,
        "smallest": np.min,
        "largest": np.max,
    }
    if result.metadata.chosen:
        statistics = {label: statistics[label] for label in ("smallest", "largest")}
    units = [
        "a draw" if one.is_draw else "of its value" if one.unit == "1" else one.unit for one in parameters
    ]
    return Table(
        Column("parameter", [one.name for one in parameters]),
        *(
            Column(label, [float(find(each)) if each.size else None for each in values], kind="4 digits")
            for label, find in statistics.items()
        ),
        Column("unit", units),
    )


def _failures_table(result: StudyResult) -> Table | None:
    """A row per kind of failure."""
    if not result.failed:
        return None
    rows = result.failures()
    return Table(
        Column("reason", rows["reason"]),
        Column("runs", rows["count"], kind="count"),
        Column("share", 100 * rows["share"], "%", "3 digits"),
        Column("first sample", rows["first_sample"], kind="count"),
    )


# ---- statistics and cases


def _cases_parts(result: StudyResult) -> list[Part]:
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
    labels = {name: name.partition("[")[2].removesuffix("]") or "machine" for name in columns}
    labels |= {
        name: label
        for name, label in ((LIFE, "life"), (SAFETY, "S0"))
        if name in cases and name not in labels
    }
    shown = cases.iloc[:MOST_CASES]
    table = Table(
        Column("case", [str(i) for i in range(len(shown))]),
        *(
            Column(name.replace(".", ". ").replace("[", " ["), shown[name], kind="4 digits")
            for name in varied
        ),
        *(
            Column(label, _known(shown[name]), "km" if label == "life" else "", _kind(name))
            for name, label in labels.items()
        ),
        Column("exceeded", shown["exceeded"]),
    )
    owner = "each carriage" if each and len(columns) > 1 else "the machine"
    unit = f" [{QUANTITIES[stem].unit}]" if QUANTITIES[stem].unit else ""
    life = f"; {MACHINE_LIFE}; S0: the smallest static safety" if LIFE in cases else ""
    terms = [f"{capitalised(title_of(stem, metadata))} of {owner}{unit}{life}."]
    if len(cases) > MOST_CASES:
        terms += [
            f"The first {MOST_CASES} of {len(cases)} cases; all are in summary.json, or in result.cases()."
        ]
    contact = [_contact_line(metadata)] if CONTACT in result.quantities else []
    return [table, definitions(*terms, *contact, CASES_NOTE)]


def _summary_table(rows: pd.DataFrame, quantity: Quantity) -> Table:
    """A row per carriage and one of the machine: mean, standard deviation, quantiles with their standard errors."""
    if len(rows) == 2 and "" in rows.index:  # the row of the machine equals that of its only carriage
        rows = rows.drop(index="")
    kind = _kind(quantity.name)
    levels = (1, 5, 50, 95) if quantity.smallest_is_worst else (5, 50, 95, 99)
    quantiles = (
        column
        for level in levels
        for column in (
            Column(f"{level} %", _known(rows[f"q{level:02d}"]), kind=kind),
            Column("+-", _known(rows[f"q{level:02d}_standard_error"]), kind="2 digits"),
        )
    )
    return Table(
        Column("carriage", [str(name) or "machine" for name in rows.index]),
        Column("mean", _known(rows["mean"]), kind=kind),
        Column("std. dev.", _known(rows["standard_deviation"]), kind=kind),
        *quantiles,
    )


def _probabilities_table(probabilities: pd.DataFrame, metadata: StudyMetadata) -> Table | None:
    """A row per limit and carriage: number of samples beyond the limit, probability and its interval."""
    if probabilities.empty:
        return None
    limits: list[str] = []
    owners: list[str] = []
    kept = []
    for name in probabilities.index.unique("quantity"):
        rows = probabilities.loc[name]
        any_of_them = "" if len(rows) == 1 else "machine" if name == LIFE else "any"
        named = [str(carriage) for carriage in rows.index if carriage or len(rows) != 2]
        kept.append(rows.loc[named])
        limits += [limit_text(name, rows["limit"].iloc[0], metadata)] + [""] * (len(named) - 1)
        owners += [carriage or any_of_them for carriage in named]
    found = pd.concat(kept)
    intervals = [
        between(100 * low, 100 * high) for low, high in zip(found["low"], found["high"], strict=True)
    ]
    return Table(
        Column("limit", limits),
        Column("on", owners),
        Column("times", found["count"], kind="count"),
        Column("of", found["samples"], kind="count"),
        Column("probability", 100 * found["probability"], "%", "3 digits"),
        Column("lies in", intervals, "%", "3 digits"),
    )


def _driving_parts(result: StudyResult) -> list[Part]:
    """Sensitivities of the leading quantity, the most influential parameter first."""
    if result.too_few:
        return [TOO_FEW]
    rows = result.driving()
    names = ("total", "first_order") if result.metadata.sensitivity else ("rank_correlation",)
    places = [
        list(rows.columns).index(name) for name in names
    ]  # the ends of its interval are in the columns after it
    first = rows.iloc[:MOST_PARAMETERS]
    columns = []
    for name, i in zip(names, places, strict=True):
        low, high = (first.iloc[:, i + k] for k in (1, 2))
        ends = [
            between(*pair, "factor") if np.isfinite(pair).all() else None
            for pair in zip(low, high, strict=True)
        ]
        columns += [Column(name.replace("_", " "), _known(first.iloc[:, i]), kind="factor")]
        columns += [Column("lies in", ends, kind="factor")]
    table = Table(Column("parameter", [str(name) for name in first.index]), *columns)
    return [table, *weaker_parameters(rows, MOST_PARAMETERS)]


# ---- definitions


def _terms(result: StudyResult, summary: pd.DataFrame) -> Iterator[str]:
    """Definitions of the terms in the tables."""
    metadata, names = result.metadata, summary.index.unique("quantity")
    yield DEFINITIONS
    if "mean_load_N" in names:
        load = (
            f"the equivalent load by the rule {metadata.machine.life.rule}" if result.rated else "|Fy| + |Fz|"
        )
        yield f"Mean load: power mean of {load} over distance, exponent {digits(metadata.exponent, 4)}."
    if LIFE in names:
        yield (
            f"Of the machine, {MACHINE_LIFE}. Static safety: C0/P0 at the worst instant of each sample (ISO 14728-2)."
        )
    yield _accuracy_line(metadata)
    if CONTACT in result.limits:
        yield _contact_line(metadata)
    if not result.too_few:
        yield INDICES if metadata.sensitivity else RANKS


def _accuracy_line(metadata: StudyMetadata) -> str:
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


def _contact_line(metadata: StudyMetadata) -> str:
    """Definition of lost contact for the machine."""
    words = contact_words(metadata.machine)
    return f"{capitalised(words)}: at some instant of a run {CONTACT_COUNTS[words]}."


def _kind(name: str) -> str:
    """The kind of quantity of a column, which says how its numbers are written."""
    return "factor" if name.partition("[")[0] == SAFETY else "load"


def _known(values: Iterable[float]) -> list[float | None]:
    """The values; None for those that are unknown or infinite, as an error or quantile of too few samples."""
    return [float(value) if np.isfinite(value) else None for value in values]


def _interval(low: float, high: float, name: str) -> str:
    ends = (KINDS[_kind(name)](end) if np.isfinite(end) else "..." for end in (low, high))
    return " to ".join(ends)


def _with_unit(value: float, quantity: Quantity) -> str:
    return f"{KINDS[_kind(quantity.name)](value)} {quantity.unit}".rstrip()
