"""The report of a study: result, warnings, tables, definitions."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd

from guideload.base.arguments import checked
from guideload.base.number_text import (
    capitalised,
    counted,
    digits,
    fixed,
    joined,
    number,
    percent,
    scientific,
)
from guideload.life.limits import LARGE_LOAD
from guideload.reports.life import duty_text, rating_formulas, unverified_lines
from guideload.reports.report import Column, Definitions, Part, Report, Section, Table, interval
from guideload.reports.study_tables import (
    cases_parts,
    driving_parts,
    ends_text,
    limit_text,
    probabilities_table,
    summary_table,
    terms,
    travel_text,
    value_text,
)
from guideload.study.metadata import StudyMetadata
from guideload.study.quantities import CONTACT, LIFE, PEAK, PEAK_LOAD, QUANTITIES, SAFETY, column_name
from guideload.study.rare import LEAST, RareProbability
from guideload.study.result import StudyResult
from guideload.study.statistics import fewest_samples, known

# Limits of warnings.
MANY_FAILURES = 0.01  # share of the runs; failed runs may be the worst ones
WIDE_QUANTILE = 0.1  # interval width of the 99 % quantile of the peak resultant, over the quantile
WIDE_INDEX = 0.2  # interval width of a Sobol index

FAILURE = (
    "A carriage fails by fatigue before this travel: in each sample its life has a Weibull distribution of "
    "slope 1.5; the probability is the mean over the samples: it combines the scatter of fatigue with that of the "
    "parameters. Life is shorter: share of the samples whose rating life is shorter than this travel."
)


@checked
def study_report(result: StudyResult) -> Report:
    """The report of a study: answer, warnings, parameters, statistics or cases, definitions."""
    metadata, summary = result.metadata, result.summary()
    answer: list[str] = []
    sections = [
        Section("Study", [*_study_lines(result)], _parameters_table(result)),
        Section("Failures", _failures_table(result)),
    ]
    if metadata.chosen and not summary.empty:
        answer = [*_cases_answer(result)]
        sections += [Section("Cases", *cases_parts(result)), _life_section(result)]
    elif not summary.empty:
        answer = [*_statistics_answer(result, summary)]
        sections += _statistics_sections(result, summary)
    return Report.of(
        metadata.machine,
        "study",
        answer=["\n".join([metadata.machine.name, *answer])],
        warnings=[
            *result.doubts,
            *metadata.warnings,
            *unverified_lines(one.product for one in result.rated.values()),
            *(f"Warning: {warning}" for warning in _study_warnings(result, summary)),
        ],
        sections=sections,
    )


def probability_report(found: RareProbability, metadata: StudyMetadata) -> Report:
    """The report of a small probability: coefficient of variation, interval, work and doubts."""
    stem, _, carriage = found.name.partition("[")
    owner = f"carriage {carriage.removesuffix(']')}" if carriage else "machine"
    text = f"Probability of {limit_text(stem, found.limit, metadata)}, {owner}: "
    if found.probability:
        ends = f"{digits(found.low, 2)} to {digits(found.high, 2)}"
        text += f"{digits(found.probability, 2)} ({ends} at 95 %), coefficient of variation "
        text += percent(found.coefficient_of_variation)
    elif found.high > LEAST:
        text += f"not found, at most {digits(found.high, 2)} at 95 %"
    else:
        text += f"below {scientific(found.high)}"
    work = f"{found.populations} populations of a subset simulation, {found.runs} runs, seed {found.seed}"
    rated = metadata.machine.product_of_carriage if stem in (LIFE, SAFETY) else ()
    notes = metadata.life_notes if stem in (LIFE, SAFETY) else ()
    warnings = [*found.doubts, *metadata.warnings, *unverified_lines(rated)]
    sections = [Section("Life and static safety", *notes)]
    answer = [f"{text}. {work}."]
    return Report.of(metadata.machine, "probability", answer=answer, warnings=warnings, sections=sections)


def _statistics_sections(result: StudyResult, summary: pd.DataFrame) -> list[Section]:
    """Statistics of each quantity, probabilities, and sensitivities of the leading quantity.

    Quantities without a worst side (times, loads at the start) appear only if there is no other quantity.
    """
    names = [name for name in summary.index.unique("quantity") if name != CONTACT]
    names = [name for name in names if QUANTITIES[name].worse is not None] or names
    metadata = result.metadata
    return [
        *(
            Section(
                capitalised(metadata.title_with_unit(name)),
                summary_table(summary.loc[name], QUANTITIES[name]),
            )
            for name in names
        ),
        Section("Probabilities", probabilities_table(result.probabilities(), metadata)),
        Section(f"What drives {metadata.title_with_owner(result.leading)}", *driving_parts(result)),
        _life_section(result),
        Section("Definitions", " ".join(terms(result, summary))),
    ]


# ---- result


def _statistics_answer(result: StudyResult, summary: pd.DataFrame) -> Iterator[str]:
    """Outermost quantile of the leading quantity, probability of each limit, most influential parameter."""
    metadata, stem = result.metadata, result.leading.partition("[")[0]
    if stem in summary.index.unique("quantity"):
        quantity, rows = QUANTITIES[stem], summary.loc[stem]
        level = "q01" if quantity.smallest_is_worst else "q99"
        values = rows[level]
        carriage = str(values.idxmin() if quantity.smallest_is_worst else values.idxmax())
        value, low, high = (float(rows[f"{level}{end}"][carriage]) for end in ("", "_low", "_high"))
        owner = f"carriage {carriage}" if carriage else "the worst carriage of each sample"
        between = ends_text(low, high, stem)
        title = f"{capitalised(metadata.title(stem))}, {int(level[1:])} % quantile"
        yield f"{title}: {value_text(value, quantity)} ({between} at 95 %), {owner}"
    yield from _life_answer(result, summary)
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
        sides = ", to both sides" if drivers.iloc[0].get("to_both_sides", False) else ""
        yield f"Driven by {drivers.index[0]} ({words} {fixed(drivers[measure].iloc[0], 2)}{sides})"


def _cases_answer(result: StudyResult) -> Iterator[str]:
    """The worst of the given cases, and the number of cases that exceed each limit."""
    stem = result.leading.partition("[")[0]
    values, quantity = result.table(result.of_carriages(stem)).drop(columns="reason"), QUANTITIES[stem]
    worst, words = ("idxmin", "Smallest") if quantity.smallest_is_worst else ("idxmax", "Largest")
    column, case = getattr(values.unstack(), worst)()
    value = value_text(float(values[column][case]), quantity)
    yield f"{words} of all cases: {result.metadata.title_with_owner(column)}, {value}, case {case}"
    for name, limit in result.limits.items():
        count = np.count_nonzero(QUANTITIES[name].exceeds(result.column(name), limit))
        yield f"{capitalised(limit_text(name, limit, result.metadata))}: {count} of {result.runs} cases"


# ---- life and static safety


def _life_answer(result: StudyResult, summary: pd.DataFrame) -> Iterator[str]:
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
        probability, low, high, shorter = (
            digits(100 * row[key]) for key in ("probability", "low", "high", "shorter")
        )
        ends = "" if low == high else f" ({low} to {high} %)"
        before = travel_text(row["travel_km"], result.metadata)
        yield (
            f"Probability of a failure by fatigue before {before}: {probability} %{ends}; the rating "
            f"life is shorter in {shorter} % of the samples"
        )


def _life_section(result: StudyResult) -> Section:
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
        loads = known(result.column(f"{stem}[{name}]"))
        found = int(np.count_nonzero(loads > LARGE_LOAD * criteria.rating.value))
        above += [name] if found else []
        count = max(count, found)
    if above:
        what = counted(count, "case" if result.metadata.chosen else "sample")
        yield (
            f"Warning: P0 exceeds {number(LARGE_LOAD)} C on carriage {joined(above)}, in up to {what}: the life "
            "formula holds for smaller loads."
        )


# ---- warnings


def _study_warnings(result: StudyResult, summary: pd.DataFrame) -> Iterator[str]:
    """Reasons why the statistics are incomplete or inaccurate, each with a way out; the worst first."""
    what = "cases" if result.metadata.chosen else "samples"
    if summary.empty:
        yield f"{result.finished} of {result.runs} samples have run, but no sample has a result."
        return
    if result.finished < result.runs:
        yield f"{result.finished} of {result.runs} {what} have run. Resume the study to run the others."
    drive = result.metadata.machine.drive
    if drive is not None and drive.push_direction is not None:
        yield (
            f"All {what} have the push of the rack of the machine as it is in the file, though it follows the force of "
            "the drive. Where masses, gravity, motion.scale or motion.force_scale vary, run single machines with their "
            "own push."
        )
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
    words, designs = "at random", {"sobol": "scrambled Sobol sequence", "latin hypercube": "Latin hypercube"}
    if design := designs.get(metadata.sampling):
        sets = metadata.replicates
        words = f"in {sets} independent sets ({design})" if sets > 1 else f"in a {design}"
    yield "given cases" if metadata.chosen else f"drawn {words}, seed {metadata.seed}"
    if not result.doubts:
        yield result.verification_text


def _parameters_table(result: StudyResult) -> Table:
    """A row per parameter: mean, standard deviation, range, unit; for given cases without mean and deviation."""
    parameters = result.metadata.parameters
    values = [np.empty(0) if one.is_draw else known(result.column(one.name)) for one in parameters]
    statistics = {"mean": "mean", "std. dev.": "std", "smallest": "min", "largest": "max"}
    labels = ["smallest", "largest"] if result.metadata.chosen else [*statistics]
    units = [
        "a draw" if one.is_draw else "of its value" if one.unit == "1" else one.unit for one in parameters
    ]
    return Table(
        Column("parameter", [one.name for one in parameters]),
        *(
            Column(
                label,
                [getattr(each, statistics[label])() if each.size else None for each in values],
                kind="4 digits",
            )
            for label in labels
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
        Column("runs", rows["count"], kind="whole"),
        Column("share", 100 * rows["share"], "%", "3 digits"),
        Column("first sample", rows["first_sample"], kind="whole"),
    )
