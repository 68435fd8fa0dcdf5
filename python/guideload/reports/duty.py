"""The report of a duty cycle: answer, tables of cases and carriages, definitions."""

from __future__ import annotations

from guideload.audit.motion_plausibility import life_warnings
from guideload.base.arguments import checked
from guideload.base.number_text import fixed, number, seconds
from guideload.duty.duty_cycle import DutyCycle
from guideload.reports.life import life_risk, life_verdict, life_words, rating_formulas
from guideload.reports.report import Definitions, Report, Section, Table, Value, warnings_by_title

DEFINITION = (
    "P_m: mean equivalent load over the distance of all cases. Life: the travel, in all cases by their shares, after "
    "which the damage of the cases adds up to 1. Life alone: if the case were the only one. Uses of life: share of the "
    "case in the damage of all carriages. S0: static safety C0/P0 at the worst instant (ISO 14728-2)."
)


@checked
def duty_report(duty: DutyCycle) -> Report:
    """The whole report."""
    cases = zip(duty.cases, duty.lives, strict=True)
    found = {
        f"case {case.name}": [
            *life.record.result.audit.warnings,
            *(f"Warning: {note}." for note in life.notes),
        ]
        for case, life in cases
    }
    machine = duty.cases[0].machine
    return Report.of(
        machine,
        "duty cycle",
        answer=[f"{machine.name}: {_answer(duty)}"],
        warnings=[*warnings_by_title(found), *life_warnings(duty.hours(duty.machine_life))],
        sections=[
            Section("Cases", _cases_table(duty)),
            Section("Carriages", _carriages_table(duty), Definitions(DEFINITION)),
            Section("Formulas", *rating_formulas(duty.carriages)),
        ],
        failed=not duty.holds,
    )


def _answer(duty: DutyCycle) -> str:
    conditions, (name, weakest) = duty.conditions, duty.worst
    verdict = life_verdict(duty.machine_life, duty.wanted, weakest.static.safety, conditions)
    risk = life_risk(duty.machine_life, duty.wanted, conditions)
    costliest = int(duty.shares.argmax())
    return (
        f"{verdict} With {life_words(duty.machine_life, duty.repetition, conditions, wanted=duty.wanted)}. "
        f"{risk}Case {duty.cases[costliest].name} uses "
        f"{fixed(100 * duty.shares[costliest], 1)} % of the life. The smallest static safety is "
        f"{fixed(weakest.static.safety, 2)} (least: {number(conditions.least_safety)}), on carriage {weakest.name} in "
        f"case {name}, at {seconds(weakest.worst.time)} s."
    )


def _cases_table(duty: DutyCycle) -> Table:
    headings = [("case",), ("cycles in period", "", "number"), ("travel", "km", "4 digits")]
    headings += [
        ("life alone", "km", "life"),
        ("uses of life", "%", "1 decimal"),
        ("S0", "", "factor"),
        ("on",),
    ]
    rows: list[tuple[Value, ...]] = []
    for case, life, distance, share in zip(duty.cases, duty.lives, duty.distances, duty.shares, strict=True):
        weakest = life.weakest
        worst = weakest.static.safety, weakest.name
        rows.append((case.name, case.cycles, 1e-3 * distance, life.machine, 100.0 * share, *worst))
    return Table.by_rows(headings, rows)


def _carriages_table(duty: DutyCycle) -> Table:
    headings = [("carriage",), ("P_m", "N", "load"), ("life", "h", "hours"), ("life", "km", "life")]
    rows: list[tuple[Value, ...]] = []
    for k, one in enumerate(duty.carriages):
        life = float(duty.carriage_lives[k])
        safety, case = min((found.carriages[k].static.safety, i) for i, found in enumerate(duty.lives))
        worst = safety, duty.cases[case].name, one.product.name
        rows.append((one.name, float(duty.mean_loads[k]), duty.hours(life), life, *worst))
    life, (case_name, weakest) = duty.machine_life, duty.worst
    rows.append(("machine", None, duty.hours(life), life, weakest.static.safety, case_name, None))
    return Table.by_rows([*headings, ("S0", "", "factor"), ("in case",), ("product",)], rows)
