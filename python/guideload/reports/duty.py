"""The report of a duty cycle: answer, tables of cases and carriages, definitions."""

from __future__ import annotations

import numpy as np

from guideload.base.number_text import fixed, joined, kilometres, number, percent, seconds
from guideload.duty.duty_cycle import DutyCycle
from guideload.reports.life import rating_formulas, unverified_lines
from guideload.reports.report import Column, Report, Table, definitions, free_dofs, section

DEFINITION = (
    "P_m: mean equivalent load over the distance of all cases. Life: the travel, in all cases by their shares, after "
    "which the damage of the cases adds up to 1. Life alone: if the case were the only one. Uses of life: share of the "
    "case in the damage of all carriages. S0: static safety C0/P0 at the worst instant (ISO 14728-2)."
)


def duty_report(duty: DutyCycle) -> Report:
    """The whole report."""
    notes: dict[str, list[str]] = {}
    for case, life in zip(duty.cases, duty.lives, strict=True):
        for note in life.notes:
            notes.setdefault(note, []).append(case.name)
    unverified = unverified_lines(one.product for one in duty.carriages)
    machine = duty.cases[0].machine
    return Report(
        title=f"{machine.name}: duty cycle",
        answer=[f"{machine.name}: {_answer(duty)}", *unverified],
        warnings=[
            f"Note, case {joined(names)}: {note}."
            for note, names in notes.items()
            if f"Note: {note}." not in unverified
        ],
        about=free_dofs(machine),
        sections=[
            section("Cases", _cases_table(duty)),
            section("Carriages", _carriages_table(duty), definitions(DEFINITION)),
            section("Formulas", *rating_formulas(duty.carriages)),
        ],
        failed=not duty.holds,
    )


def _answer(duty: DutyCycle) -> str:
    conditions, (name, weakest) = duty.conditions, duty.worst
    life = duty.machine_life
    verdict = "Life and static safety are reached." if duty.holds else "NOT REACHED."
    asked = risk = ""
    if conditions.life is not None:
        asked = f" (wanted: {kilometres(conditions.life)} km)"
        risk = (
            f"The probability that one fails before is {percent(duty.failure_probability(conditions.life))}. "
        )
    costliest = int(duty.shares.argmax())
    return (
        f"{verdict} With a probability of {number(100 * conditions.reliability)} % all carriages last "
        f"{kilometres(life)} km{asked}, that is {fixed(duty.hours(life))} h. {risk}Case {duty.cases[costliest].name} "
        f"uses {fixed(100 * duty.shares[costliest], 1)} % of the life. The smallest static safety is "
        f"{fixed(weakest.static.safety, 2)} (least: {number(conditions.least_safety)}), on carriage {weakest.name} in "
        f"case {name}, at {seconds(weakest.worst.time)} s."
    )


def _cases_table(duty: DutyCycle) -> Table:
    weakest = [life.weakest for life in duty.lives]
    return Table(
        Column("case", [case.name for case in duty.cases]),
        Column("cycles in period", [case.cycles for case in duty.cases], kind="number"),
        Column("travel", 1e-3 * np.asarray(duty.distances), "km", "4 digits"),
        Column("life alone", [life.machine for life in duty.lives], "km", "life"),
        Column("uses of life", 100 * np.asarray(duty.shares), "%", "1 decimal"),
        Column("S0", [one.static.safety for one in weakest], kind="factor"),
        Column("on", [one.name for one in weakest]),
    )


def _carriages_table(duty: DutyCycle) -> Table:
    carriages, lives = duty.carriages, [*map(float, duty.carriage_lives), duty.machine_life]
    worst = [
        min((life.carriages[k].static.safety, i) for i, life in enumerate(duty.lives))
        for k in range(len(carriages))
    ]
    return Table(
        Column("carriage", [*(one.name for one in carriages), "machine"]),
        Column("P_m", [*map(float, duty.mean_loads), None], "N", "load"),
        Column("life", lives, "km", "life"),
        Column("life", [duty.hours(life) for life in lives], "h", "count"),
        Column("S0", [*(safety for safety, _ in worst), duty.worst[1].static.safety], kind="factor"),
        Column("in case", [*(duty.cases[i].name for _, i in worst), duty.worst[0]]),
        Column("product", [*(one.product.name for one in carriages), None]),
    )
