"""The tables of the report of a study, and the definitions of their terms."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd

from guideload.base.number_text import KINDS, capitalised, digits, kilometres, rounded
from guideload.reports.report import Column, Definitions, Part, Table, interval, known_or_empty
from guideload.study.metadata import StudyMetadata
from guideload.study.quantities import CONTACT, LIFE, QUANTITIES, SAFETY, Quantity, contact_words
from guideload.study.result import StudyResult, weaker_parameters
from guideload.study.statistics import TOO_FEW

# Sizes of tables.
MOST_PARAMETERS = 12  # in the table of sensitivities
MOST_CASES = 50  # in the table of cases
MOST_VALUES = 3  # parameters whose values are in the table of cases
MOST_CARRIAGES = 4  # in the table of cases; with more it has the worst only

MACHINE_LIFE = "life is that which all carriages reach with the stated probability"
DEFINITIONS = (
    "Peaks are the largest magnitudes of a run at any time, static load included; resultant: "
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
    "influence of the parameters with which the parameter is correlated. Acts to both sides: the correlation with the "
    "distance of the parameter from its median is the larger one, as for a centre of mass that loads another carriage "
    "on either side."
)
CASES_NOTE = "Given cases are not a random sample: they have no statistics, probabilities or sensitivities."
CONTACT_COUNTS = {
    "contact lost": "an end of the carriage carries no load",
    "a row open": "one row of rolling elements is unloaded and the other row carries the load",
    "contact lost or a row open": "an end of a carriage with clearance carries no load, or one row of a preloaded "
    "carriage is unloaded and the other row carries the load",
}


def limit_text(name: str, limit: float, metadata: StudyMetadata) -> str:
    """A limit in words: "peak resultant above 7000 N"; without a value "contact lost"."""
    quantity, title = QUANTITIES[name], metadata.title(name)
    sign = "below" if quantity.smallest_is_worst else "above"
    if np.isnan(limit):
        return title
    return f"{title} {sign} {travel_text(limit, metadata) if name == LIFE else value_text(limit, quantity)}"


def travel_text(kilometers: float, metadata: StudyMetadata) -> str:
    """`12 300 h (45 600 km)`; without hours for a study of an earlier version, which does not know its travel."""
    repetition, text = metadata.repetition, f"{kilometres(1e3 * kilometers)} km"
    return text if repetition is None else f"{rounded(repetition.hours(1e3 * kilometers))} h ({text})"


def cases_parts(result: StudyResult) -> list[Part]:
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
            Column(label, known_or_empty(shown[name]), "km" if label == "life" else "", _kind(name))
            for name, label in labels.items()
        ),
        Column("exceeded", shown["exceeded"]),
    )
    owner = "each carriage" if each and len(columns) > 1 else "the machine"
    unit = f" [{QUANTITIES[stem].unit}]" if QUANTITIES[stem].unit else ""
    life = f"; {MACHINE_LIFE}; S0: the smallest static safety" if LIFE in cases else ""
    terms = [f"{capitalised(metadata.title(stem))} of {owner}{unit}{life}."]
    if len(cases) > MOST_CASES:
        terms += [
            f"The first {MOST_CASES} of {len(cases)} cases; all are in summary.json, or in result.cases()."
        ]
    contact = [_contact_line(metadata)] if CONTACT in result.quantities else []
    return [table, Definitions(*terms, *contact, CASES_NOTE)]


def summary_table(rows: pd.DataFrame, quantity: Quantity) -> Table:
    """A row per carriage and one of the machine: mean, standard deviation, quantiles with their standard errors."""
    if len(rows) == 2 and "" in rows.index:  # the row of the machine equals that of its only carriage
        rows = rows.drop(index="")
    kind = _kind(quantity.name)
    levels = (1, 5, 50, 95) if quantity.smallest_is_worst else (5, 50, 95, 99)
    quantiles = (
        column
        for level in levels
        for column in (
            Column(f"{level} %", known_or_empty(rows[f"q{level:02d}"]), kind=kind),
            Column("+-", known_or_empty(rows[f"q{level:02d}_standard_error"]), kind="2 digits"),
        )
    )
    return Table(
        Column("carriage", [str(name) or "machine" for name in rows.index]),
        Column("mean", known_or_empty(rows["mean"]), kind=kind),
        Column("std. dev.", known_or_empty(rows["standard_deviation"]), kind=kind),
        *quantiles,
    )


def probabilities_table(probabilities: pd.DataFrame, metadata: StudyMetadata) -> Table | None:
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
    return Table(
        Column("limit", limits),
        Column("on", owners),
        Column("times", found["count"], kind="whole"),
        Column("of", found["samples"], kind="whole"),
        Column("probability", 100 * found["probability"], "%", "3 digits"),
        interval(100 * found["low"], 100 * found["high"], "%"),
    )


def driving_parts(result: StudyResult) -> list[Part]:
    """Sensitivities of the leading quantity, the most influential parameter first."""
    if result.too_few:
        return [TOO_FEW]
    rows = result.driving()
    names = ("total", "first_order") if result.metadata.sensitivity else ("rank_correlation",)
    first = rows.iloc[:MOST_PARAMETERS]
    columns = []
    for name in names:
        i = list(rows.columns).index(name)  # the ends of its interval are in the columns after it
        columns.append(Column(name.replace("_", " "), known_or_empty(first.iloc[:, i]), kind="factor"))
        columns.append(interval(first.iloc[:, i + 1], first.iloc[:, i + 2], kind="factor"))
    if "to_both_sides" in first:
        columns.append(
            Column("acts", ["to both sides" if both else "one way" for both in first["to_both_sides"]])
        )
    table = Table(Column("parameter", [str(name) for name in first.index]), *columns)
    return [table, *weaker_parameters(rows, MOST_PARAMETERS)]


def terms(result: StudyResult, summary: pd.DataFrame) -> Iterator[str]:
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
            f"The samples are divided among {metadata.replicates} independent sets (scrambles of the sequence); the "
            "scatter among these gives standard errors and intervals. Among the outermost few samples it tells "
            "nothing: there, and for rank correlations, the samples count as independent, which is conservative."
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


def ends_text(low: float, high: float, name: str) -> str:
    """An interval of a column: `6603 to ...`, with dots for an end that too few samples leave unknown."""
    ends = (KINDS[_kind(name)](end) if np.isfinite(end) else "..." for end in (low, high))
    return " to ".join(ends)


def value_text(value: float, quantity: Quantity) -> str:
    """A value of a quantity with its unit."""
    return f"{KINDS[_kind(quantity.name)](value)} {quantity.unit}".rstrip()
