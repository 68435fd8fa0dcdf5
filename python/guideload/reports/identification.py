"""The report of an identification: values with intervals, what the data cannot determine, measured against computed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from guideload.base.number_text import capitalised, counted, digits, joined, percent
from guideload.identification.cross_validation import Level
from guideload.identification.deflections import Deflections
from guideload.identification.figure import Figure
from guideload.identification.modal_test import ModalTest
from guideload.identification.names import short, together, usual_unit
from guideload.identification.next_measurement import Candidate
from guideload.identification.result import Estimate, Identification
from guideload.reports.identification_records import record_sections
from guideload.reports.report import Column, Part, Report, Section, Table, definitions, free_dofs, section

DEFINITION = (
    "From, to: interval with a probability of 95 %. Narrowed: spread of the number before the data over that after "
    "them; below 2 the number is not identified. p: the interval is from the likelihood profile, because the fit is "
    "not linear enough there."
)
DIFFERENCES = (
    "Differences are measured minus computed values, in standard deviations of the noise as stated; about 1 if model "
    "and noise are right. Noise: its estimated level over the stated or typical one."
)


MOST_CANDIDATES = 12
NEXT = (
    "Interval: that of {figure} after the measurement, over the one now. Identifies: unknowns that it would "
    "identify and that are not identified now."
)
LEVELS = (
    "Score: logarithm of the probability of measured values that were left out of the fit, in turns; larger is better. "
    "Below best: difference from the best score, with its standard deviation. The recommended model is the simplest "
    "one that is not certainly worse."
)


def identification_report(
    found: Identification,
    levels: Sequence[Level] = (),
    candidates: Sequence[Candidate] = (),
    figure: Figure | None = None,
) -> Report:
    """The whole report.

    levels: of models compared with this one. candidates: for the next measurement, ranked by the figure.
    """
    doubts = [f"{test.name}: {doubt}." for test in found.residuals for doubt in test.doubts]
    return Report(
        title=f"{found.nominal.name}: identification",
        answer=[f"{found.nominal.name}: {_answer(found)}"],
        warnings=[*doubts, *(f"{capitalised(message)}." for message in found.messages)],
        about=free_dofs(found.nominal),
        sections=[
            section("Numbers of the machine", _estimates_table(found), definitions(DEFINITION)),
            section("What these data cannot determine", *(f"{one.words}." for one in found.undetermined)),
            *(_modal_section(each, found) for each in found.data if isinstance(each, ModalTest)),
            *(_displacements_section(each, found) for each in found.data if isinstance(each, Deflections)),
            *record_sections(found),
            section("Differences", _differences_table(found), definitions(DIFFERENCES)),
            section("Which model", _levels_table(levels), definitions(LEVELS if levels else "")),
            section(
                "What to measure next", _candidates_table(candidates), *_figure_lines(figure, candidates)
            ),
            section("Search", _searches(found)),
        ],
    )


def _answer(found: Identification) -> str:
    identified = [one for one in found.estimates if one.is_identified]
    source = joined(each.name for each in found.data)
    doubts = sum(len(test.doubts) for test in found.residuals) + len(found.messages)
    total = counted(len(found.estimates), "number")
    words = f"{source}: {len(identified)} of {total} identified"
    if identified:
        worst = max(identified, key=_relative)
        words += f", the least certain one, {worst.name}, within {percent(_relative(worst))}"
    unsure = f"{counted(doubts, 'doubt')}:" if doubts else "No doubts."
    return f"{words}. {unsure}"


def _relative(one: Estimate) -> float:
    return abs(one.high - one.low) / 2.0 / abs(one.value) if one.value else float("inf")


def _estimates_table(found: Identification) -> Table:
    units = [usual_unit(one.unit) for one in found.estimates]
    pairs = list(zip(found.estimates, (scale for _, scale in units), strict=True))
    starts = [unknown.start for unknown in found.unknowns]
    return Table(
        Column("number", [short(one.name) for one in found.estimates]),
        Column("unit", [unit for unit, _ in units]),
        Column(
            "machine file",
            [scale * start for (_, scale), start in zip(units, starts, strict=True)],
            kind="4 digits",
        ),
        Column(
            "value",
            [scale * one.value if one.is_identified else "none" for one, scale in pairs],
            kind="4 digits",
        ),
        Column(
            "from", [scale * one.low if one.is_identified else None for one, scale in pairs], kind="4 digits"
        ),
        Column(
            "to", [scale * one.high if one.is_identified else None for one, scale in pairs], kind="4 digits"
        ),
        Column(
            "+-",
            [
                100.0 * _relative(one) if one.is_identified and start else None
                for one, start in zip(found.estimates, starts, strict=True)
            ],
            "%",
            "2 digits",
        ),
        Column("narrowed", [1.0 / one.narrowed for one in found.estimates], kind="3 digits"),
        Column("p", ["p" if one.profile and one.is_identified else "" for one in found.estimates]),
    )


def _modal_section(test: ModalTest, found: Identification) -> Section:
    """Measured and computed modes; measured ones without a computed one have a reason below."""
    pairs = test.pairs(found.model)
    modes = [(test.modes[pair.measured], pair) for pair in pairs]
    return section(
        f"Modes: {test.name}",
        Table(
            Column("mode", [str(pair.measured + 1) for pair in pairs]),
            Column("measured", [mode.frequency for mode, _ in modes], "Hz", "4 digits"),
            Column(
                "computed",
                ["none" if pair.frequency is None else pair.frequency for pair in pairs],
                "Hz",
                "4 digits",
            ),
            Column(
                "differ",
                [pair.frequency and 100.0 * (mode.frequency / pair.frequency - 1.0) for mode, pair in modes],
                "%",
                "signed factor",
            ),
            Column("damping", [mode.damping and 100.0 * mode.damping for mode, _ in modes], "%", "3 digits"),
            Column("computed", [pair.damping and 100.0 * pair.damping for pair in pairs], "%", "3 digits"),
            Column("MAC", [pair.mac for pair in pairs], kind="time"),
            Column(
                "computed mode",
                [None if pair.computed is None else pair.computed + 1 for pair in pairs],
                kind="count",
            ),
        ),
        *(
            f"Mode {pair.measured + 1} was left out: {pair.reason}."
            for pair in pairs
            if pair.computed is None
        ),
    )


def _displacements_section(data: Deflections, found: Identification) -> Section:
    values = data.values
    moved = np.asarray([one.moved for one in values])
    computed = data.computed(found.model)[0]
    return section(
        f"Displacements: {data.name}",
        Table(
            Column("displacement", [one.at.name for one in values]),
            Column("force", [one.force for one in values], "N", "4 digits"),
            Column("measured", 1e6 * moved, "um", "4 digits"),
            Column("computed", 1e6 * computed, "um", "4 digits"),
            Column("differ", 1e6 * (moved - computed), "um", "signed 2 digits"),
            Column("force at", [one.force_at.name for one in values]),
        ),
    )


def _differences_table(found: Identification) -> Table:
    in_time = [each.instants is not None for each in found.data for _ in each.noise]
    noises = [
        "known" if test.factor is None else "estimated" if is_record else f"x {digits(test.factor, 2)}"
        for test, is_record in zip(found.residuals, in_time, strict=True)
    ]
    rms = [
        None if noise == "estimated" else test.rms
        for test, noise in zip(found.residuals, noises, strict=True)
    ]
    return Table(
        Column("measured", [test.name for test in found.residuals]),
        Column("values", [test.count for test in found.residuals], kind="count"),
        Column("rms", rms, kind="factor"),
        Column("noise", noises, kind="2 digits"),
    )


def _levels_table(levels: Sequence[Level]) -> Table:
    return Table(
        Column("model", [one.name for one in levels]),
        Column("unknowns", [one.unknowns for one in levels], kind="count"),
        Column("score", [one.score for one in levels], kind="1 decimal"),
        Column("below best", [one.behind for one in levels], kind="1 decimal"),
        Column("+-", [one.uncertainty for one in levels], kind="1 decimal"),
        Column("", ["recommended" if one.is_best else "" for one in levels]),
    )


def _candidates_table(candidates: Sequence[Candidate]) -> Table:
    shown = candidates[:MOST_CANDIDATES]
    return Table(
        Column("measurement", [one.name for one in shown]),
        Column("interval", [100.0 * one.deviation for one in shown], "%", "3 digits"),
        Column("identifies", [together(one.identified) if one.identified else "" for one in shown]),
    )


def _figure_lines(figure: Figure | None, candidates: Sequence[Candidate]) -> list[Part]:
    """What the intervals of the candidates are of."""
    if not candidates:
        return []
    if figure is None:
        return [definitions(NEXT.format(figure="all unknowns (geometric mean)"))]
    unit, scale = usual_unit(figure.unit)
    value, low, high = (digits(scale * one, 4) for one in (figure.value, figure.low, figure.high))
    unit = "" if unit == "1" else f" {unit}"
    return [
        definitions(NEXT.format(figure=figure.name)),
        f"Now the {figure.name} is {value}{unit}, and with a probability of 95 % from {low} to {high}{unit}, as far as "
        "the numbers above are uncertain.",
    ]


def _searches(found: Identification) -> str:
    best = found.fit.minimum
    return f"Of {found.fit.searches} searches from different starts {best.starts} led to these numbers."
