"""Reports of sizing: the ranked candidates, and the largest pace, payload, overhang or limit."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from guideload.audit.motion_plausibility import input_warnings
from guideload.audit.plausibility import machine_warnings
from guideload.base.number_text import (
    beside,
    between,
    counted,
    digits,
    first_names,
    fixed,
    joined,
    number,
    vector,
)
from guideload.catalogue.conditions import LifeConditions
from guideload.catalogue.life_target import HOUR
from guideload.catalogue.product import PRINTED
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.reports.life import unverified_lines
from guideload.reports.report import Column, Definitions, Report, Section, Table, known_or_empty
from guideload.sizing.limits import Limit
from guideload.sizing.requirements import Margins
from guideload.sizing.size import Candidate, Sizing

DEFINITIONS = (
    "Ranked by the dynamic load rating for 100 km. C: as printed by the maker, for 50 or 100 km. Life: "
    "of all carriages together; S0: static safety of the weakest "
    "carriage; margin: smallest ratio of figure to requirement; the criterion that has it fails first. The product "
    "gives ratings, length, width and stiffness, as far as its record has or implies them; damping is scaled so that "
    "damping ratios stay, and the mass stays. Drive: largest force of the drive; mode 1: lowest natural frequency; "
    "carriages: their mass together."
)
# The value of a quantity in the answer, and its unit.
WORDS = {
    "pace": ("{} times the given pace, pauses included", "times the given pace"),
    "payload": ("{} kg more{}", "kg more"),
    "overhang": ("a shift of the centre of mass by {} m{}", "m"),
    "speed": ("a speed limit of {} m/s", "m/s"),
    "acceleration": ("an acceleration limit of {} m/s2", "m/s2"),
    "deceleration": ("a deceleration limit of {} m/s2", "m/s2"),
    "jerk": ("a jerk limit of {} m/s3", "m/s3"),
}
MOST_FAILING = 4  # smaller values at which a requirement fails, in the answer
OF_MOVES = ("speed", "acceleration", "deceleration", "jerk")
FAR = "is a limit of product or drive missing (max_speed, max_acceleration, torque_curve, max_force, critical_speed)?"


def sizing_report(machine: Machine, sizing: Sizing, most: int | None = None) -> Report:
    """The answer, a row per candidate, and the reasons of those that could not be run.

    most: candidates in the table, those next to the best; default: all.
    """
    products = [one.product for one in sizing.candidates if one.machine is not None]
    failed: dict[str, list[str]] = {}  # names of candidates by their reason
    for one in sizing.candidates:
        if one.reason:
            failed.setdefault(one.reason, []).append(one.name)
    reasons = [f"{first_names(names)}: {reason}." for reason, names in failed.items()]
    count = sum(map(len, failed.values()))
    not_run = [f"{counted(count, 'candidate')} could not be run, see below."] if failed else []
    ran = [one for one in sizing.candidates if one.machine is not None]
    middle = 0 if sizing.best is None else ran.index(sizing.best)
    first = 0 if most is None else max(0, min(middle - most // 2, len(ran) - most))
    shown = ran[first:][:most]
    table = _candidates_table(sizing, shown)
    marks = "* the smallest that holds; - does not hold." if table else ""
    others = []
    if left := len(ran) - len(shown):
        others.append(f"left out: {counted(left, 'candidate')}, smaller or larger")
    if sizing.untried:
        others.append(f"not tried: {counted(sizing.untried, 'larger candidate')}")
    if others:
        way_out = "" if most is None else " --report tries all, and writes them into a page."
        text = "; ".join(others)
        marks += f" {text[0].upper()}{text[1:]}.{way_out}"
    return Report.of(
        machine,
        "which carriage",
        answer=[" ".join([_answer(machine, sizing), *not_run])],
        warnings=[*_warnings_of_the_run(sizing), *unverified_lines(products), *_estimate_lines(sizing)],
        sections=[
            Section("Candidates", table, marks, Definitions(DEFINITIONS)),
            Section("Not run", *reasons),
        ],
        failed=sizing.smallest is None,
    )


def _estimate_lines(sizing: Sizing) -> list[str]:
    """How many candidates were run with a stiffness that their catalogue does not print."""
    counts = Counter(one.stiffness_from for one in sizing.candidates if one.machine is not None)
    others = [
        f"{counted(count, 'candidate')} {source}" for source, count in counts.items() if source != PRINTED
    ]
    return [f"Warning: stiffness: {'; '.join(others)}."] if others else []


def _warnings_of_the_run(sizing: Sizing) -> list[str]:
    """Of motion, machine and run, with the best product."""
    if sizing.best is None or sizing.result is None:
        return []
    return [f"{sizing.best.name}: {text}" for text in sizing.result.audit.warnings]


def _candidates_table(sizing: Sizing, shown: Sequence[Candidate]) -> Table:
    products = [one.product for one in shown]
    ratings = [one.dynamic for one in products if one.dynamic is not None]
    margins = [one.margins for one in shown if one.margins is not None]
    marks = ("* " if one is sizing.smallest else "  " if one.holds else "- " for one in shown)
    return Table(
        Column("product", [mark + one.name for mark, one in zip(marks, shown, strict=True)]),
        Column("C", [1e-3 * one.value for one in ratings], "kN", "3 digits"),
        Column("C0", [one.static and 1e-3 * one.static for one in products], "kN", "3 digits"),
        Column("life", [one.life_hours for one in shown], "h", "hours"),
        Column("life", [one.life for one in shown], "km", "life"),
        Column("S0", [one.static_safety for one in shown], "", "factor"),
        Column("margin", [one.smallest for one in margins], "", "factor"),
        Column("fails first", [one.first_to_fail for one in margins]),
        Column("drive", known_or_empty(one.drive_force for one in shown), "N", "load"),
        Column("mode 1", [one.first_mode for one in shown], "Hz", "3 digits"),
        Column("carriages", known_or_empty(one.carriage_mass for one in shown), "kg", "3 digits"),
        Column("stiffness", [one.stiffness_from for one in shown]),
    )


def _answer(machine: Machine, sizing: Sizing) -> str:
    conditions, found, best = sizing.conditions, sizing.smallest, sizing.best
    wanted = requirements(conditions, *(one.margins for one in sizing.candidates if one.margins is not None))
    if found is None:
        text = f"{machine.name}: none of {counted(len(sizing.candidates), 'candidate')} reaches {wanted}."
        if best is None or best.margins is None:
            return text
        return f"{text} The nearest is {best.name}: {_words(best.margins, conditions)}."
    assert found.margins is not None
    words = _words(found.margins, conditions)
    held = f"{machine.name}: the smallest product that reaches {wanted} is {found.name}: {words}."
    ran = [(one.size, one.margins, one.name) for one in sizing.candidates if one.margins is not None]
    size = max((size for size, *_ in ran if size < found.size), default=None)
    next_smaller = [(margins, name) for one, margins, name in ran if one == size]
    if next_smaller:
        margins, name = max(next_smaller, key=lambda one: one[0].smallest)
        among = ", the best of its preload classes" if len(next_smaller) > 1 else ""
        held += f" The next smaller one does not: {name}{among}: {_words(margins, conditions)}."
    return (
        f"{held} No stiffness was required: a smaller product or a lighter preload is softer. See column mode 1 "
        f"({digits(found.first_mode)} Hz here), and run the machine with this product to see how its points move."
    )


def _words(margins: Margins, conditions: LifeConditions) -> str:
    """The criterion that fails first, against what it must reach or must not exceed."""
    return _margin(margins.first_to_fail, margins.smallest, conditions)


def _margin(name: str, ratio: float, conditions: LifeConditions) -> str:
    if name == "life":
        return f"life is {beside(ratio, 1.0)} times what is wanted"
    if name == "static safety":
        least = conditions.least_safety
        times = f"{beside(ratio, 1.0)} times the least of {number(least)}"
        return f"static safety is {times} (S0 {fixed(ratio * least, 2)})"
    return f"{name} is {beside(100.0 / ratio, 100.0)} % of its limit"


def requirements(conditions: LifeConditions, *judged: Margins) -> str:
    """The requirements in words: `20 000 km with 90 % reliability and a static safety of 3`, and judged limits."""
    limited = any(one.ratios.keys() - {"life", "static safety"} for one in judged)
    limits = " within the limits of drive and product" if limited else ""
    safety = f"a static safety of {number(conditions.least_safety)}"
    if conditions.life is None:
        return f"{safety} (no life is required){limits}"
    reliability = number(100 * conditions.reliability)
    return f"{conditions.life.text} with {reliability} % reliability and {safety}{limits}"


def limit_report(machine: Machine, limit: Limit, conditions: LifeConditions) -> Report:
    """The largest value of a quantity, and what would fail beyond it."""
    wanted, (value, unit) = requirements(conditions, limit.margins), WORDS[limit.quantity]
    largest = value.format(digits(min(limit.value, limit.tried[1]), 4), _place(limit))
    text = f"{machine.name}: the requirement, {wanted}, is met "
    if limit.value == float("inf"):
        every = f"at every {limit.quantity}{_place(limit)} that was tried"
        text += f"at {largest}, the largest that was tried" if limit.failing else every
    else:
        text += f"{'at' if limit.failing else 'up to'} {largest}"
    if limit.failing:
        failing = ", ".join(digits(one) for one in limit.failing[:MOST_FAILING])
        more = len(limit.failing) - MOST_FAILING
        others = f" and {counted(more, 'other value')}" if more > 0 else ""
        text += f", but not at every smaller value: it fails at {failing} {unit}{others}"
    if limit.value != float("inf"):
        text += f". Beyond it {limit.margins.first_to_fail} fails first"
    text += "."
    if limit.quantity in OF_MOVES:
        text += f" The {limit.quantity} is the largest of the moves, whose limits are scaled alike."
        if limit.quantity in ("speed", "acceleration"):
            history = limit.motion.velocity if limit.quantity == "speed" else limit.motion.acceleration
            most = min(limit.value, limit.tried[1])
            if history is not None and (reached := float(np.abs(history).max())) < 0.99 * most:
                text += f" The moves reach only {digits(reached)} {unit}: stroke and other limits end it."
        if limit.beyond:
            end = digits(limit.tried[1], 4)
            text += f" The search ended at {end} {unit}, as moves with more are refused: {limit.beyond}."
    figures = joined(_margin(name, ratio, conditions) for name, ratio in limit.margins.ratios.items())
    return Report.of(
        machine,
        f"largest {limit.quantity}",
        answer=[
            text,
            f"At this limit {figures}.",
            f"The motion there: {_reached(limit.motion)}. Tried: {between(*limit.tried)} {unit}.",
            *_pace_lines(limit, conditions),
        ],
        warnings=[
            *_limit_warnings(machine, limit, conditions),
            *unverified_lines(machine.product_of_carriage),
        ],
    )


def _place(limit: Limit) -> str:
    """Where the payload is, or along what the overhang grows."""
    if limit.at is not None:
        return f" at {vector(1e3 * part for part in limit.at)} mm from L" if any(limit.at) else " at L"
    return "" if limit.direction is None else f" along {vector(limit.direction)}"


def _limit_warnings(machine: Machine, limit: Limit, conditions: LifeConditions) -> list[str]:
    """Of the machine as given, and others of machine and motion at the answer."""
    given = machine_warnings(machine)
    reported_keys = {one.key for one in given}

    def without_repeats(found: list[str]) -> list[str]:
        return [*given, *(one for one in found if getattr(one, "key", "") not in reported_keys)]

    if limit.quantity in ("payload", "overhang"):
        return without_repeats(input_warnings(limit.machine, limit.motion))
    motion = replace(limit.motion, source=f"at this {limit.quantity}")
    notes: list[str] = []
    lasts = float(np.ptp(motion.time))
    if conditions.repetition(1.0, lasts).duration < lasts * (1.0 - 1e-9):
        notes.append(
            f"Warning: cycles_per_hour = {number(conditions.cycles_per_hour or 0.0)} leaves less time than the motion "
            f"lasts at this {limit.quantity}, {digits(lasts, 4)} s: take fewer cycles."
        )
    return without_repeats([*input_warnings(limit.machine, motion, FAR), *notes])


def _pace_lines(limit: Limit, conditions: LifeConditions) -> Iterator[str]:
    """What a stated number of cycles per hour means for the life at another pace."""
    cycles = conditions.cycles_per_hour
    if cycles is not None and limit.quantity not in ("payload", "overhang"):
        yield (
            f"cycles_per_hour = {number(cycles)} is kept at every {limit.quantity}: hours and years of life are those "
            f"of a motion every {digits(HOUR / cycles, 4)} s, and it lasts {digits(np.ptp(limit.motion.time), 4)} s "
            "there. A faster motion that is repeated more often wears out sooner; without cycles_per_hour the motion "
            "repeats at once."
        )


def _reached(motion: Motion) -> str:
    """Largest speed, acceleration and jerk of a motion, and its stroke, as far as they are known."""
    step, change = np.diff(motion.time), np.diff(motion.acceleration[:, 0])
    jumps = bool(change[step == 0.0].any())
    slopes = np.divide(np.abs(change), step, out=np.zeros_like(step), where=step > 0.0)
    parts = [f"acceleration {digits(np.abs(motion.acceleration[:, 0]).max())} m/s2"]
    parts.append("its acceleration jumps" if jumps else f"jerk {digits(slopes.max())} m/s3")
    if motion.velocity is not None:
        parts.insert(0, f"speed up to {digits(np.abs(motion.velocity[:, 0]).max())} m/s")
    if motion.position is not None:
        parts.append(f"stroke {digits(np.ptp(motion.position[:, 0]), 4)} m")
    return ", ".join(parts)
