"""The report of an identification: values with intervals, what the data cannot determine, measured against computed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from guideload.base.number_text import capitalised, counted, digits, joined, percent
from guideload.identification.modal_test import ModalTest
from guideload.identification.model_comparison import ComparedModel
from guideload.identification.motor_force import MotorForce
from guideload.identification.next_measurement import RankedMeasurement, TargetQuantity
from guideload.identification.record_checks import explained_share
from guideload.identification.records import Record
from guideload.identification.responses import Deflections
from guideload.identification.result import Identification, ResidualTest, UnknownEstimate
from guideload.identification.unknowns import grouped_names, short_name, usual_unit
from guideload.reports.report import Definitions, Part, Report, Section, Table, Value

DEFINITION = (
    "From, to: interval with a probability of 95 %. Narrowed: how many times smaller the uncertainty is after the "
    "measurement; below 2 the number counts as not identified (-). p: the interval is from the likelihood profile, "
    "because the fit is not linear enough there."
)
DIFFERENCES = (
    "Differences are measured minus computed values, in standard deviations of the noise; about 1 if model and noise "
    "are right. Noise: standard deviation of a value, as stated or, where it was not, as estimated from the "
    "differences; that of responses is relative to each value, and the floor to the largest one of a curve."
)
INTERVALS = (
    "These intervals, as those of the machine, contain the noise, the error of the acceleration of the trace, and what "
    "the model lacks as far as it changes within the record: the errors of neighbouring windows may be alike. They do "
    "not contain an error of the scale of a sensor, and what is wrong in the same way throughout."
)
MOST_CANDIDATES = 12
NEXT = "Interval: uncertainty of {figure} left after this measurement, in % of today's."
IDENTIFIES = "Identifies: unknowns that it would identify beyond those identified now."
LEVELS = (
    "Score: logarithm of the probability density of measured values that were left out of the fit, in turns; larger is "
    "better. Below best: difference from the best score, with its standard deviation. The recommended model is the "
    "simplest one that is not certainly worse."
)


def identification_report(
    found: Identification,
    levels: Sequence[ComparedModel] = (),
    candidates: Sequence[RankedMeasurement] = (),
    figure: TargetQuantity | None = None,
) -> Report:
    """The whole report.

    levels: of models compared with this one. candidates: for the next measurement, ranked by the figure.
    """
    doubts = [f"{test.name}: {doubt}." for test in found.residuals for doubt in test.doubts]
    starts = found.fit.minimum.starts
    searches = f"Of {found.fit.searches} searches from different starts {starts} led to these numbers."
    return Report.of(
        found.nominal,
        "identification",
        answer=[f"{found.nominal.name}: {_answer(found)}"],
        warnings=[*(f"{capitalised(message)}." for message in found.messages), *doubts],
        sections=[
            Section("Numbers of the machine", _estimates_table(found), Definitions(DEFINITION)),
            Section("What these data cannot determine", *(f"{one.words}." for one in found.undetermined)),
            *(_modal_section(each, found) for each in found.data if isinstance(each, ModalTest)),
            *(_displacements_section(each, found) for each in found.data if isinstance(each, Deflections)),
            *_record_sections(found),
            Section("Differences", _differences_table(found), Definitions(DIFFERENCES)),
            Section("Which model", _levels_table(levels), Definitions(LEVELS if levels else "")),
            Section(
                "What to measure next", _candidates_table(candidates), *_figure_lines(figure, candidates)
            ),
            Section("Search", searches),
        ],
    )


def _answer(found: Identification) -> str:
    identified = [one for one in found.estimates if one.is_identified]
    source = joined(each.name for each in found.data)
    total = counted(len(found.estimates), "number")
    words = f"{source}: {len(identified)} of {total} identified"
    if identified:
        worst = max(identified, key=_relative)
        words += f", the least certain one, {worst.name}, within {percent(_relative(worst))}"
    return f"{words}."


def _relative(one: UnknownEstimate) -> float:
    return abs(one.high - one.low) / 2.0 / abs(one.value) if one.value else float("inf")


def _estimates_table(found: Identification) -> Table:
    headings = [("number",), ("unit",), ("machine file", "", "4 digits"), ("value", "", "4 digits")]
    headings += [("from", "", "4 digits"), ("to", "", "4 digits"), ("+-", "%", "2 digits")]
    rows: list[list[Value]] = []
    for one, unknown in zip(found.estimates, found.unknowns, strict=True):
        unit, scale = usual_unit(one.unit)
        numbers: list[Value] = ["-", None, None, None]
        if one.is_identified:
            within = 100.0 * _relative(one) if unknown.start else None
            numbers = [scale * one.value, scale * one.low, scale * one.high, within]
        profile = "p" if one.profile and one.is_identified else ""
        rows.append(
            [short_name(one.name), unit, scale * unknown.start, *numbers, 1.0 / one.narrowed, profile]
        )
    return Table.by_rows([*headings, ("narrowed", "", "3 digits"), ("p",)], rows)


def _modal_section(test: ModalTest, found: Identification) -> Section:
    """Measured and computed modes; measured ones without a computed one have a reason below."""
    headings = [("mode",), ("measured", "Hz", "4 digits"), ("computed", "Hz", "4 digits")]
    headings += [
        ("differ", "%", "signed factor"),
        ("damping", "%", "3 digits"),
        ("computed", "%", "3 digits"),
    ]
    headings += [("MAC", "", "3 decimals"), ("computed mode", "", "whole")]
    rows: list[tuple[Value, ...]] = []
    lost: list[str] = []
    for pair in test.pairs(found.model):
        mode, name = test.modes[pair.measured], str(pair.measured + 1)
        differ = pair.frequency and 100.0 * (mode.frequency / pair.frequency - 1.0)
        dampings = (one and 100.0 * one for one in (mode.damping, pair.damping))
        computed = None if pair.computed is None else pair.computed + 1
        rows.append((name, mode.frequency, pair.frequency or "none", differ, *dampings, pair.mac, computed))
        if computed is None:
            lost.append(f"Mode {name} was left out: {pair.reason}.")
    return Section(f"Modes: {test.name}", Table.by_rows(headings, rows), *lost)


def _displacements_section(data: Deflections, found: Identification) -> Section:
    headings = [("displacement",), ("force", "N", "4 digits"), ("measured", "um", "4 digits")]
    headings += [("computed", "um", "4 digits"), ("differ", "um", "signed 2 digits"), ("force at",)]
    rows = (
        (one.at.name, one.force, 1e6 * one.moved, 1e6 * value, 1e6 * (one.moved - value), one.force_at.name)
        for one, value in zip(data.values, data.computed(found.model)[0].tolist(), strict=True)
    )
    return Section(f"Displacements: {data.name}", Table.by_rows(headings, rows))


def _record_sections(found: Identification) -> list[Section]:
    """A section for each record in time."""
    records = [each for each in found.data if isinstance(each, Record)]
    return [
        Section(
            f"{'Motor' if isinstance(each, MotorForce) else 'Sensors'}: {each.name}",
            _record_numbers(found, each),
            *_record_differences(found, each),
            Definitions(INTERVALS),
        )
        for each in records
    ]


def _record_numbers(found: Identification, data: Record) -> Table:
    rows: list[tuple[str, ...]] = []
    for one in found.nuisance_estimates(data):
        unit, scale = ("ms", 1e3) if one.parameter.unit == "s" else usual_unit(one.parameter.unit)
        count = 7 if unit == "ms" else 4  # a delay may be many seconds, known to a microsecond
        ends = (digits(scale * value, count) for value in (one.value, one.low, one.high))
        values = ends if one.is_identified else ("-", "", "")
        name = one.parameter.name.removesuffix(f" in {data.name}").removesuffix(f" of {data.name}")
        rows.append((name, *values, "" if unit == "1" else unit))
    return Table.by_rows(
        [("number",), *((end, "", "number") for end in ("now", "from", "to")), ("unit",)], rows
    )


def _record_differences(found: Identification, data: Record) -> list[str]:
    """How far prediction and measurement differ, in words."""
    length = float(np.median(np.diff(data.window_time)))
    words = []
    for name, unit, seen, computed in found.record_channels(data):
        rms = float(np.sqrt(np.mean((computed - seen) ** 2)))
        share = explained_share(seen, computed)
        shown = digits(rms) + ("" if unit == "1" else f" {unit}")
        words.append(
            f"{capitalised(name)}: computed and measured differ by {shown} rms, in {seen.size} "
            f"windows of {digits(1e3 * length)} ms; the model explains {digits(100.0 * share, 4)} % of the variance."
        )
    return words


def _differences_table(found: Identification) -> Table:
    headings = [("measured",), ("values", "", "whole"), ("rms", "", "factor"), ("noise", "", "2 digits")]
    rows: list[tuple[Value, ...]] = []
    in_time = [isinstance(each, Record) for each in found.data for _ in each.noise]
    for test, is_record in zip(found.residuals, in_time, strict=True):
        # That of a record is of means over windows, and raised by serial errors.
        noise = "estimated" if is_record and test.factor is not None else _noise(test)
        rows.append((test.name, test.count, test.rms if test.factor is None else None, noise))
    return Table.by_rows(headings, rows)


def _noise(test: ResidualTest) -> str:
    """The noise of a value in words."""
    noise, factor = test.noise, 1.0 if test.factor is None else test.factor
    unit, scale = {"1": ("%", 100.0), "m": ("um", 1e6)}.get(noise.unit, (noise.unit, 1.0))
    floor = f", floor {digits(100.0 * factor * noise.floor, 2)} %" if noise.floor else ""
    how = "stated" if test.factor is None else "estimated"
    return f"{digits(factor * noise.level * scale, 2)} {unit}{floor}, {how}"


def _levels_table(levels: Sequence[ComparedModel]) -> Table:
    headings = [("model",), ("unknowns", "", "whole"), ("score", "", "1 decimal")]
    headings += [("below best", "", "1 decimal"), ("+-", "", "1 decimal"), ("",)]
    rows = (
        (one.name, one.unknowns, one.score, one.behind, one.uncertainty, "recommended" if one.is_best else "")
        for one in levels
    )
    return Table.by_rows(headings, rows)


def _candidates_table(candidates: Sequence[RankedMeasurement]) -> Table:
    rows = (
        (one.name, 100.0 * one.deviation, grouped_names(one.identified) if one.identified else "")
        for one in candidates[:MOST_CANDIDATES]
    )
    return Table.by_rows([("measurement",), ("interval", "%", "3 digits"), ("identifies",)], rows)


def _figure_lines(figure: TargetQuantity | None, candidates: Sequence[RankedMeasurement]) -> list[Part]:
    """What the intervals of the candidates are of."""
    if not candidates:
        return []
    adds = IDENTIFIES if any(one.identified for one in candidates[:MOST_CANDIDATES]) else ""
    if figure is None:
        return [Definitions(NEXT.format(figure="all unknowns (geometric mean)"), adds)]
    unit, scale = usual_unit(figure.unit)
    value, low, high = (digits(scale * one, 4) for one in (figure.value, figure.low, figure.high))
    unit = "" if unit == "1" else f" {unit}"
    return [
        Definitions(NEXT.format(figure=figure.name), adds),
        f"Now the {figure.name} is {value}{unit}, and with a probability of 95 % from {low} to {high}{unit}, as far as "
        "the numbers above are uncertain.",
    ]
