"""The report of a duty cycle: answer, tables of cases and carriages, definitions."""

from __future__ import annotations

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from guideload.base.number_text import joined, load_in_table, percent
from guideload.duty.duty_cycle import DutyCycle
from guideload.reports.elements import heading, new_table, remark, section, to_text
from guideload.reports.life import kilometres, rating_formulas, unverified_lines

DEFINITION = (
    "P_m: mean equivalent load over the distance of all cases. Life: the travel, in all cases by their shares, after "
    "which the damage of the cases adds up to 1. Life alone: if the case were the only one. Uses of life: share of the "
    "case in the damage of all carriages. S0: static safety C0/P0 at the worst instant (ISO 14728-2)."
)


def duty_report(duty: DutyCycle, encoding: str = "utf-8") -> str:
    """The whole report."""
    return to_text(duty_parts(duty), encoding=encoding)


def duty_parts(duty: DutyCycle) -> list[RenderableType]:
    """The elements of the report."""
    notes: dict[str, list[str]] = {}
    for case, life in zip(duty.cases, duty.lives, strict=True):
        for note in life.notes:
            notes.setdefault(note, []).append(case.name)
    unverified = unverified_lines(one.product for one in duty.carriages)
    lines = [
        f"Note, case {joined(names)}: {note}."
        for note, names in notes.items()
        if f"Note: {note}." not in unverified
    ]
    return [
        *heading(duty.cases[0].machine),
        *remark(_answer(duty), *unverified),
        *section("Cases"),
        _cases_table(duty),
        *section("Carriages"),
        _carriages_table(duty),
        *remark(DEFINITION, *lines),
        *section("Formulas"),
        *remark(*rating_formulas(duty.carriages)),
    ]


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
        f"{verdict} With a probability of {100 * conditions.reliability:g} % all carriages last {kilometres(life)} "
        f"km{asked}, that is {duty.hours(life):.0f} h. {risk}Case {duty.cases[costliest].name} uses "
        f"{100 * duty.shares[costliest]:.1f} % of the life. The smallest static safety is {weakest.static.safety:.2f} "
        f"(least: {conditions.least_safety:g}), on carriage {weakest.name} in case {name}, at "
        f"{weakest.worst.time:.3f} s."
    )


def _cases_table(duty: DutyCycle) -> Table:
    table = new_table(
        "case",
        "cycles\nin period",
        "travel\nkm",
        "life\nalone, km",
        "uses of\nlife, %",
        "S0\n",
        texts=("on",),
    )
    for case, life, distance, share in zip(duty.cases, duty.lives, duty.distances, duty.shares, strict=True):
        weakest = life.weakest
        table.add_row(
            Text(case.name),
            f"{case.cycles:g}",
            f"{1e-3 * distance:.4g}",
            kilometres(life.machine),
            f"{100 * share:.1f}",
            f"{weakest.static.safety:.2f}",
            Text(weakest.name),
        )
    return table


def _carriages_table(duty: DutyCycle) -> Table:
    table = new_table("carriage", "P_m\nN", "life\nkm", "h\n", "S0\n", texts=("in case", "product"))
    for k, one in enumerate(duty.carriages):
        life = float(duty.carriage_lives[k])
        safety, case = min((found.carriages[k].static.safety, i) for i, found in enumerate(duty.lives))
        table.add_row(
            Text(one.name),
            load_in_table(float(duty.mean_loads[k])),
            kilometres(life),
            f"{duty.hours(life):.0f}",
            f"{safety:.2f}",
            Text(duty.cases[case].name),
            Text(one.product.name),
        )
    life = duty.machine_life
    table.add_row(
        "machine", "", kilometres(life), f"{duty.hours(life):.0f}", f"{duty.worst[1].static.safety:.2f}"
    )
    return table
