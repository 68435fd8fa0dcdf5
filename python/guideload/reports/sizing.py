"""Reports of sizing: the ranked candidates, and the largest pace, payload, overhang or limit."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from guideload.audit.plausibility import input_warnings
from guideload.base.number_text import between, counted, digits, fixed, number
from guideload.catalogue.product import PRINTED
from guideload.reports.life import unverified_lines
from guideload.reports.report import Definitions, Report, Section, Table, Value

if TYPE_CHECKING:
    from guideload.catalogue.conditions import LifeConditions
    from guideload.machine.machine import Machine
    from guideload.motion.motion import Motion
    from guideload.sizing.limits import Limit
    from guideload.sizing.requirements import Margins
    from guideload.sizing.size import Candidate, Sizing

DEFINITIONS = (
    "Ranked by the dynamic load rating for 100 km. C: as printed by the maker, for 50 or 100 km. Life: "
    "of all carriages together; S0: static safety of the weakest "
    "carriage; margin: smallest ratio of figure to requirement; the criterion that has it fails first. The product "
    "gives ratings, length, width and stiffness, as far as its record has or implies them; damping is scaled so that "
    "damping ratios stay, and the mass stays. Carriages: their mass together."
)
UNITS = {
    "pace": "times the given pace",
    "payload": "kg more",
    "overhang": "m more",
    "speed": "m/s as the limit of the speed",
    "acceleration": "m/s2 as the limit of the acceleration",
    "deceleration": "m/s2 as the limit of the deceleration",
    "jerk": "m/s3 as the limit of the jerk",
}


def sizing_report(machine: Machine, sizing: Sizing, most: int | None = None) -> Report:
    """The answer, a row per candidate, and the reasons of those that could not be run.

    most: candidates in the table, those next to the smallest that holds; default: all.
    """
    products = [one.product for one in sizing.candidates if one.life is not None]
    failed = [f"{one.name}: {one.reason}." for one in sizing.candidates if one.reason]
    not_run = [f"{counted(len(failed), 'candidate')} could not be run, see below."] if failed else []
    ran = [one for one in sizing.candidates if one.life is not None]
    middle = len(ran) - 1 if sizing.smallest is None else ran.index(sizing.smallest)
    first = 0 if most is None else max(0, min(middle - most // 2, len(ran) - most))
    shown = ran[first:][:most]
    table = _candidates_table(sizing, shown)
    marks = "* the smallest that holds; - does not hold." if table else ""
    if left := len(ran) - len(shown):
        marks += f" {counted(left, 'candidate')}, smaller or larger, are left out: --report writes all into a page."
    return Report.of(
        machine,
        "which carriage",
        answer=[" ".join([_answer(machine, sizing), *not_run])],
        warnings=[*_warnings_of_the_run(sizing), *unverified_lines(products), *_estimate_lines(sizing)],
        sections=[Section("Candidates", table, marks, Definitions(DEFINITIONS)), Section("Not run", *failed)],
        failed=sizing.smallest is None,
    )


def _estimate_lines(sizing: Sizing) -> list[str]:
    """How many candidates were run with a stiffness that their catalogue does not print."""
    counts = Counter(one.stiffness_from for one in sizing.candidates if one.life is not None)
    others = [
        f"{counted(count, 'candidate')} {source}" for source, count in counts.items() if source != PRINTED
    ]
    return [f"Note: stiffness: {'; '.join(others)}."] if others else []


def _warnings_of_the_run(sizing: Sizing) -> list[str]:
    """Of motion, machine and run, with the smallest product that holds, or else the largest that could be run."""
    ran = [one for one in sizing.candidates if one.result is not None]
    shown = sizing.smallest or (ran[-1] if ran else None)
    if shown is None or shown.result is None:
        return []
    return [f"{shown.name}: {text}" for text in shown.result.audit.warnings]


def _candidates_table(sizing: Sizing, shown: Sequence[Candidate]) -> Table:
    headings = [("product",), ("C", "kN", "3 digits"), ("C0", "kN", "3 digits"), ("life", "h", "hours")]
    headings += [("S0", "", "factor"), ("margin", "", "factor"), ("fails first",), ("drive", "N", "load")]
    headings += [("mode 1", "Hz", "3 digits"), ("carriages", "kg", "3 digits"), ("stiffness",)]
    rows: list[tuple[Value, ...]] = []
    for one in shown:
        if (
            one.life is None
            or one.margins is None
            or one.product.dynamic is None
            or one.product.static is None
        ):
            continue
        mark = "* " if one is sizing.smallest else "  " if one.holds else "- "
        ratings = 1e-3 * one.product.dynamic.value, 1e-3 * one.product.static
        figures = one.life.hours(one.life.machine), one.life.weakest.static.safety, one.margins.smallest
        force, mass = (None if value != value else value for value in (one.drive_force, one.carriage_mass))
        others = one.margins.first_to_fail, force, one.first_mode, mass, one.stiffness_from
        rows.append((mark + one.name, *ratings, *figures, *others))
    return Table.by_rows(headings, rows)


def _answer(machine: Machine, sizing: Sizing) -> str:
    wanted = requirements(sizing.conditions)
    found = sizing.smallest
    if found is None:
        return f"{machine.name}: none of {counted(len(sizing.candidates), 'candidate')} reaches {wanted}."
    assert found.margins is not None
    held = f"{machine.name}: the smallest product that reaches {wanted} is {found.name}: {_words(found.margins)}."
    smaller = [one for one in sizing.candidates if one.size < found.size and one.margins is not None]
    return held if not smaller else f"{held} The next smaller one does not: {_next(smaller[-1])}."


def _next(one: Candidate) -> str:
    assert one.margins is not None
    return f"{one.name}: {_words(one.margins)}"


def _words(margins: Margins) -> str:
    return f"{margins.first_to_fail} is {fixed(margins.smallest, 2)} times what is wanted"


def requirements(conditions: LifeConditions) -> str:
    """The requirements in words: `20 000 km with 90 % reliability and a static safety of 3`."""
    safety = f"a static safety of {number(conditions.least_safety)}"
    if conditions.life is None:
        return safety
    return f"{conditions.life.text} with {number(100 * conditions.reliability)} % reliability and {safety}"


def limit_report(machine: Machine, limit: Limit, conditions: LifeConditions) -> Report:
    """The largest value of a quantity, and what would fail beyond it."""
    wanted = requirements(conditions)
    low, high = limit.tried
    unit = UNITS[limit.quantity]
    if limit.value == float("inf"):
        text = f"{machine.name}: the requirement ({wanted}) is met at every {limit.quantity} that was tried."
    else:
        text = (
            f"{machine.name}: the requirement ({wanted}) is met up to {digits(limit.value, 4)} "
            f"{unit}. Beyond it {limit.margins.first_to_fail} fails first."
        )
    figures = ", ".join(f"{name} {digits(ratio)}" for name, ratio in limit.margins.ratios.items())
    return Report.of(
        machine,
        f"largest {limit.quantity}",
        answer=[
            text,
            f"Figures over requirements there: {figures}.",
            f"The motion there: {_reached(limit.motion)}. Tried: {between(low, high)} {unit.partition(' as ')[0]}.",
        ],
        warnings=input_warnings(machine, limit.motion),
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
