"""The report of an identification: values with intervals, what the data cannot determine, measured against computed."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from guideload.base.number_text import counted, joined, percent
from guideload.identification.cross_validation import Level
from guideload.identification.deflections import Deflections
from guideload.identification.figure import Figure
from guideload.identification.modal_test import ModalTest
from guideload.identification.names import short, together, usual_unit
from guideload.identification.next_measurement import Candidate
from guideload.identification.result import Estimate, Identification
from guideload.reports.elements import heading, new_table, remark, section, to_text
from guideload.reports.identification_records import records

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
    encoding: str = "utf-8",
) -> str:
    """The whole report.

    levels: of models compared with this one. candidates: for the next measurement, ranked by the figure.
    """
    parts: list[RenderableType] = [
        *heading(found.nominal),
        *remark(_answer(found)),
        *section("Numbers of the machine"),
        _estimates(found),
        *remark(DEFINITION),
    ]
    if found.undetermined:
        parts += [
            *section("What these data cannot determine"),
            *remark(*(f"{one.words}." for one in found.undetermined)),
        ]
    for each in found.data:
        if isinstance(each, ModalTest):
            parts += [*section(f"Modes: {each.name}"), _modes(each, found), *remark(*_without(each, found))]
        if isinstance(each, Deflections):
            parts += [*section(f"Displacements: {each.name}"), _displacements(each, found)]
    parts += records(found)
    parts += [*section("Differences"), _differences(found), *remark(DIFFERENCES)]
    if levels:
        parts += [*section("Which model"), _levels(levels), *remark(LEVELS)]
    if candidates:
        parts += [
            *section("What to measure next"),
            _candidates(candidates),
            *remark(*_figure(figure)),
        ]
    doubts = [f"{test.name}: {doubt}." for test in found.residuals for doubt in test.doubts]
    return to_text([*parts, *remark(*doubts, _search(found))], encoding=encoding)


def _answer(found: Identification) -> str:
    identified = [one for one in found.estimates if one.is_identified]
    source = joined(each.name for each in found.data)
    doubts = sum(len(test.doubts) for test in found.residuals) + len(found.messages)
    total = counted(len(found.estimates), "number")
    words = f"{source[:1].upper()}{source[1:]}: {len(identified)} of {total} identified"
    if identified:
        worst = max(identified, key=_relative)
        words += f", the least certain one, {worst.name}, within {percent(_relative(worst))}"
    unsure = f"{counted(doubts, 'doubt')}, see below." if doubts else "No doubts."
    return f"{words}. {unsure}"


def _relative(one: Estimate) -> float:
    return abs(one.high - one.low) / 2.0 / abs(one.value) if one.value else float("inf")


def _estimates(found: Identification) -> Table:
    table = new_table(
        "number",
        "machine\nfile",
        "value\n",
        "from\n",
        "to\n",
        "+-\n%",
        "narrowed\n",
        "",
        texts=("unit",),
    )
    for one, unknown in zip(found.estimates, found.unknowns, strict=True):
        unit, scale = usual_unit(one.unit)
        before = f"{scale * unknown.start:.4g}"
        if one.is_identified:
            numbers = [f"{scale * value:.4g}" for value in (one.value, one.low, one.high)]
            numbers.append(f"{100.0 * _relative(one):.2g}" if unknown.start else "")
        else:
            numbers = ["none", "", "", ""]
        narrowed = f"{1.0 / one.narrowed:.3g}"
        table.add_row(
            Text(short(one.name)),
            before,
            *numbers,
            narrowed,
            "p" if one.profile and one.is_identified else "",
            unit,
        )
    return table


def _modes(test: ModalTest, found: Identification) -> Table:
    table = new_table(
        "mode",
        "measured\nHz",
        "computed\nHz",
        "differ\n%",
        "damping\n%",
        "computed\n%",
        "MAC\n",
        "computed\nmode",
    )
    for pair in test.pairs(found.model):
        mode = test.modes[pair.measured]
        damping = "" if mode.damping is None else f"{100.0 * mode.damping:.3g}"
        row = [f"{pair.measured + 1}", f"{mode.frequency:.4g}"]
        if pair.frequency is None or pair.damping is None or pair.computed is None:
            table.add_row(*row, "none", "", damping, "", "", "")
            continue
        difference = f"{100.0 * (mode.frequency / pair.frequency - 1.0):+.2f}"
        mac = "" if pair.mac is None else f"{pair.mac:.3f}"
        shown = f"{pair.frequency:.4g}", difference, damping, f"{100.0 * pair.damping:.3g}", mac
        table.add_row(*row, *shown, f"{pair.computed + 1}")
    return table


def _without(test: ModalTest, found: Identification) -> list[str]:
    """Measured modes without a computed one."""
    return [
        f"Mode {pair.measured + 1} was left out: {pair.reason}."
        for pair in test.pairs(found.model)
        if pair.computed is None
    ]


def _displacements(data: Deflections, found: Identification) -> Table:
    table = new_table(
        "displacement", "force\nN", "measured\num", "computed\num", "differ\num", texts=("force at",)
    )
    computed = data.computed(found.model)[0]
    for one, value in zip(data.values, computed.tolist(), strict=True):
        moved = f"{1e6 * one.moved:.4g}", f"{1e6 * value:.4g}", f"{1e6 * (one.moved - value):+.2g}"
        table.add_row(Text(one.at.name), f"{one.force:.4g}", *moved, Text(one.force_at.name))
    return table


def _differences(found: Identification) -> Table:
    table = new_table("measured", "values", "rms", "noise")
    in_time = [each.instants is not None for each in found.data for _ in each.noise]
    for test, is_record in zip(found.residuals, in_time, strict=True):
        noise = "known" if test.factor is None else "estimated" if is_record else f"x {test.factor:.2g}"
        rms = "" if noise == "estimated" else f"{test.rms:.2f}"
        table.add_row(Text(test.name), f"{test.count}", rms, noise)
    return table


def _levels(levels: Sequence[Level]) -> Table:
    table = new_table("model", "unknowns", "score", "below best", "+-", texts=("",))
    for one in levels:
        behind = f"{one.behind:.1f}", f"{one.uncertainty:.1f}"
        table.add_row(
            Text(one.name),
            f"{one.unknowns}",
            f"{one.score:.1f}",
            *behind,
            "recommended" if one.is_best else "",
        )
    return table


def _candidates(candidates: Sequence[Candidate]) -> Table:
    table = new_table("measurement", "interval\n%", texts=("identifies",))
    for one in candidates[:MOST_CANDIDATES]:
        table.add_row(
            Text(one.name),
            f"{100.0 * one.deviation:.3g}",
            Text(together(one.identified)) if one.identified else "",
        )
    return table


def _figure(figure: Figure | None) -> list[str]:
    """What the intervals of the candidates are of."""
    if figure is None:
        return [NEXT.format(figure="all unknowns (geometric mean)")]
    unit, scale = usual_unit(figure.unit)
    value, low, high = (f"{scale * one:.4g}" for one in (figure.value, figure.low, figure.high))
    unit = "" if unit == "1" else f" {unit}"
    return [
        NEXT.format(figure=figure.name),
        f"Now the {figure.name} is {value}{unit}, and with a probability of 95 % from {low} to {high}{unit}, as far as "
        "the numbers above are uncertain.",
    ]


def _search(found: Identification) -> str:
    best = found.fit.minimum
    words = [f"Of {found.fit.searches} searches from different starts {best.starts} led to these numbers."]
    return " ".join([*words, *(f"{one[:1].upper()}{one[1:]}." for one in found.messages)])
