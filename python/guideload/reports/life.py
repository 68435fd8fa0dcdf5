"""The report of life and static safety: answer, tables, causes, places, definitions with their sources."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from guideload.audit.figures import STATICS
from guideload.audit.motion_plausibility import life_warnings
from guideload.base.arguments import checked
from guideload.base.errors import LifeError
from guideload.base.number_text import (
    between,
    capitalised,
    digits,
    fixed,
    joined,
    kilometres,
    load_in_sentence,
    load_in_table,
    number,
    percent,
    rounded,
    seconds,
)
from guideload.catalogue.conditions import LifeConditions
from guideload.catalogue.life_target import CONTINUOUS, Repetition
from guideload.catalogue.product import Product
from guideload.life.bands import LifeBand
from guideload.life.criteria import Criteria
from guideload.life.equivalent_load import RULES
from guideload.life.life import Life, life_of
from guideload.life.limits import cycles_notes, unverified_notes
from guideload.life.load_parts import CAUSES
from guideload.life.rating_life import failure_probability
from guideload.reports.report import Column, Definitions, Report, Section, Table, known_or_empty
from guideload.simulation.result import Result

ENDLESS = 1e5  # h, eleven years day and night: seals, grease and dirt end a guide before
LEAST_RISK = 1e-4  # probability of a failure that is written as a number
LIFE_DEFINITION = (
    "P_m: mean equivalent load over distance. Life: rating life L (ISO 14728-1), fatigue of steel alone. S0: static "
    "safety C0/P0 at the worst instant (ISO 14728-2). f_W L, f_W S0: load factor that a catalogue calculation with "
    f"{STATICS}, without rail errors, would need to give this life, this safety."
)


@checked
def life_report(life: Life, band: bool = True) -> Report:
    """The whole report. band: whether to compute the credible bands, which takes longer than the run."""
    found, time = life.band if band else None, life.record.travel.time
    record = (
        f"One record is {digits(time[-1] - time[0], 4)} s and {digits(life.distance, 4)} m of travel; it repeats every "
        f"{digits(life.repetition.duration, 4)} s."
    )
    phases = ", ".join(f"{phase} {fixed(100 * share, 1)} %" for phase, share in life.phases.items())
    return Report.of(
        life.record.result.machine,
        "life and static safety",
        answer=[_answer(life, found)],
        warnings=[*life.record.result.audit.warnings, *_notes(life)],
        sections=[
            *_main_sections(life, found),
            _rows_section(life),
            Section("Share of the life by phase of the cycle", phases),
            _places_section(life),
            Section("Formulas", *rating_formulas(life.carriages), record),
        ],
        failed=not life.holds,
    )


def run_life(result: Result) -> Report:
    """What the report of a run says of life and static safety; empty if no carriage names a product."""
    if not any(result.machine.product_of_carriage):
        return Report("")
    try:
        life = life_of(result)
    except LifeError as error:
        return Report("", [f"Life and static safety are not computed: {error}."], failed=True)
    sections = _main_sections(life, None)
    return Report("", [_answer(life, None)], _notes(life), sections=sections, failed=not life.holds)


def _main_sections(life: Life, band: LifeBand | None) -> list[Section]:
    """Table and definitions, and the causes of the worst instants."""
    words = (
        ""
        if band is None
        else f"Band: 95 % credible band of the life, by the noise of the trace; {band.method}."
    )
    terms = Definitions(LIFE_DEFINITION, words)
    main = Section("Life and static safety", _life_table(life, band), _above_peak(life), terms)
    return [main, _causes_section(life)]


def _answer(life: Life, band: LifeBand | None) -> str:
    shortest, weakest, conditions = life.shortest, life.weakest, life.conditions
    required = f'least for application "{conditions.application}"' if conditions.safety is None else "wanted"
    ends = ""
    if band is not None and len(set(map(kilometres, band.machine))) > 1:
        ends = f" (noise of the trace alone: {between(*band.machine, 'life')} km, 95 %)"
    words = life_words(life.machine, life.repetition, conditions, duty_text(conditions), life.wanted, ends)
    risk = life_risk(life.machine, life.wanted, conditions)
    verdict = life_verdict(life.machine, life.wanted, weakest.static.safety, conditions)
    return (
        f"{verdict} With {words}. {risk}Carriage {shortest.name} alone: {rounded(life.hours(shortest.life))} "
        f"h. The smallest static safety is {fixed(weakest.static.safety, 2)} ({required}: "
        f"{number(conditions.least_safety)}), on carriage {weakest.name} at {seconds(weakest.worst.time)} s, "
        f"{weakest.worst.phase}."
    )


def _ends(low: float, high: float, life: float) -> str:
    """The ends [m] of the band of a life [m] in km, or how narrow it is where both are written alike."""
    if kilometres(low) != kilometres(high):
        return between(low, high, "life")
    within = max(high / life - 1.0, 1.0 - low / life)
    return f"within {percent(within)}" if np.isfinite(within) else kilometres(low)


def life_words(
    life: float,
    repetition: Repetition,
    conditions: LifeConditions,
    duty: str = "",
    wanted: float | None = None,
    ends: str = "",
) -> str:
    """`a probability of 90 % all carriages last 12 300 h, that is 45 600 km`.

    life: of the machine [m]. duty: under which it lasts in hours. wanted: life to be reached [m]. ends: of its band.
    """
    target, years = conditions.life, f" or {digits(repetition.years(life))} years of "
    hours = repetition.hours(life)
    text = f"{rounded(hours)} h"
    if conditions.hours_per_year is not None:
        text += f"{years}{number(conditions.hours_per_year)} h"
    elif target is not None and target.unit == "years":
        text += (
            f"{years}continuous operation ({number(CONTINUOUS)} h; hours_per_year of [life] states others)"
        )
    text = f"{text} {duty}".rstrip()
    if target is not None:
        is_time = target.unit == "s"
        as_hours = "" if is_time else f", {rounded(repetition.hours(repetition.travel(target)))} h"
        text += f" (wanted: {target.text}{as_hours})"
    endless = ": fatigue will not end it" if hours > ENDLESS and life >= (wanted or 0.0) else ""
    reliability = number(100 * conditions.reliability)
    return f"a probability of {reliability} % all carriages last {text}, that is {kilometres(life)} km{ends}{endless}"


def duty_text(conditions: LifeConditions) -> str:
    """How often the motion is run."""
    cycles = conditions.cycles_per_hour
    return "if the motion repeats at once" if cycles is None else f"at {number(cycles)} cycles per hour"


def life_risk(life: float, wanted: float | None, conditions: LifeConditions) -> str:
    """The probability that a carriage fails before the life wanted [m], as a sentence; empty if none is wanted."""
    if wanted is None or conditions.life is None:
        return ""
    failure = float(failure_probability(wanted, life, conditions.reliability))
    return f"The probability that one fails before {conditions.life.text} is {risk_text(failure)}. "


def risk_text(failure: float) -> str:
    """The probability of a failure: `3.1 %`, `below 0.01 %`."""
    return percent(failure) if failure >= LEAST_RISK else f"below {percent(LEAST_RISK)}"


def life_verdict(life: float, wanted: float | None, safety: float, conditions: LifeConditions) -> str:
    """Whether the life [m], if one is wanted, and the smallest static safety are reached."""
    reached = {} if wanted is None else {"life": life >= wanted}
    reached["static safety"] = safety >= conditions.least_safety
    if missed := [name for name, held in reached.items() if not held]:
        return f"NOT REACHED: {joined(missed)}."
    return "Life and static safety are reached." if len(reached) > 1 else "The static safety is reached."


def _notes(life: Life) -> list[str]:
    """Limits of formulas and products, values not compared, too many cycles, an implausible life."""
    notes = *life.notes, *cycles_notes(life.conditions, float(np.ptp(life.record.travel.time)))
    return [*(f"Warning: {note}." for note in notes), *life_warnings(life.hours(life.machine))]


def unverified_lines(products: Iterable[Product | None]) -> list[str]:
    """Warnings of values of the products, of carriages that name one, that were not compared with the maker's page."""
    return [f"Warning: {note}." for note in unverified_notes(one for one in products if one is not None)]


def _life_table(life: Life, band: LifeBand | None) -> Table:
    """A row per carriage, and one for each rail and the machine."""
    carriages, rails = life.carriages, life.rails
    lives = [*(one.life for one in carriages), *rails.values(), life.machine]
    blank = [None] * (len(rails) + 1)
    bands: list[Column] = []
    if band is not None:
        lower = [*band.lower, *([None] * len(rails)), band.machine[0]]
        upper = [*band.upper, *([None] * len(rails)), band.machine[1]]
        texts = [low and _ends(low, high, one) for low, high, one in zip(lower, upper, lives, strict=True)]
        bands = [Column("band", texts, "km", "life")]
    return Table(
        Column("", [*(one.name for one in carriages), *(f"rail {rail}" for rail in rails), "machine"]),
        Column("P_m", [*(one.mean_load for one in carriages), *blank], "N", "load"),
        Column("life", [life.hours(one) for one in lives], "h", "hours"),
        Column("life", lives, "km", "life"),
        *bands,
        Column("S0", [*(one.static.safety for one in carriages), *blank], "", "factor"),
        Column("f_W", [*(one.factor_life for one in carriages), *blank], "L", "factor"),
        Column("f_W", [*(one.factor_safety for one in carriages), *blank], "S0", "factor"),
        Column("product", [*(one.product.name for one in carriages), *blank]),
    )


def _above_peak(life: Life) -> str:
    """Why a mean load may exceed the largest resultant, if one does."""
    loads = life.record.result.carriage_loads[:, :, 1:3]
    peaks = np.linalg.norm(loads, axis=2).max(axis=0)
    above = [one.name for one in life.carriages if one.mean_load > peaks[one.index]]
    if not above:
        return ""
    return (
        f"P_m exceeds the peak load of carriage {joined(above)}: the peak is the resultant of Fy and Fz, and the "
        f"equivalent load by rule {life.conditions.rule} has more in it: {RULES[life.conditions.rule].note}. "
        + " ".join(_preload_formula([one for one in life.carriages if one.name in above]))
    ).rstrip()


def _causes_section(life: Life) -> Section:
    """The causes of the worst instant of each carriage, and their definitions."""
    worst = [one.worst for one in life.carriages]
    causes = [cause for cause in CAUSES if any(cause in one.shares for one in worst)]
    table = Table(
        Column("", [one.name for one in life.carriages]),
        Column("P0", [one.load for one in worst], "N", "load"),
        Column("at", [one.time for one in worst], "s", "3 decimals"),
        *(Column(cause, [one.shares.get(cause, 0.0) for one in worst], "N", "load") for cause in causes),
        Column("noise", known_or_empty(one.noise for one in worst), "N", "load"),
        Column("while", [one.phase for one in worst]),
    )
    terms = " ".join(f"{capitalised(cause)}: {CAUSES[cause]}." for cause in causes)
    return Section(
        "Causes of the worst instant",
        table,
        Definitions(
            f"P0 is largest at the time in the table, and there the sum of its causes. {terms} Noise: 1.96 "
            "standard deviations of the resultant at this time, from the uncertainty of the trace."
        ),
    )


def _rows_section(life: Life) -> Section:
    """The row loads of preloaded carriages; empty without any."""
    lines = [
        f"carriage {one.name}: loaded row up to {load_in_table(one.rows[0])} N, the other at least "
        f"{load_in_table(one.rows[1])} N{'' if one.rows[1] else ': it opens'}"
        for one in life.carriages
        if one.rows is not None
    ]
    return Section("Loads of the two rows along y, preload included", lines)


def _places_section(life: Life) -> Section:
    lines = []
    for place in life.places or ():
        start, end, share = place.worst_window()
        passed = (end - start) / (place.edges[-1] - place.edges[0])
        lines.append(
            f"rail {place.rail}: the most damaged {digits(end - start)} m is x = {fixed(start, 2)} to {fixed(end, 2)} "
            f"m: {fixed(100 * share)} % of the damage on {fixed(100 * passed)} % of the length that its carriages pass"
        )
    note = (
        "x is counted from L at the start of the record. Damage at a place: from all carriages that pass it."
    )
    return Section("Life by place", lines, Definitions(note if lines else ""))


def _preload_formula(carriages: Sequence[Criteria]) -> Iterator[str]:
    """How the preload raises the equivalent load; nothing where none counts."""
    words = {
        "ball": "its loaded row carries F0 (1 + e)^1.5 where P = F0 ((1 + e)^1.5 - (1 - e)^1.5) is below 2.83 F0",
        "roller": "its loaded row carries F0 (1 + e)^(10/9) where P = F0 ((1 + e)^(10/9) - (1 - e)^(10/9)) is below "
        "2.16 F0",
        "power": "F0 (P/(2.8 F0) + 1)^1.5 where P is below 2.8 F0",
        "linear": "F0 + 2/3 P where P is below 3 F0",
    }
    for effect, text in words.items():
        counted: dict[str, list[str]] = {}
        for one in carriages:
            if one.rule.preload and one.rule.effect == effect:
                force = f"{load_in_sentence(one.rule.preload)} = {digits(one.rule.preload / one.rating.value, 2)} C"
                counted.setdefault(force, []).append(one.name)
        if counted:
            forces = (f"{force} (carriage {joined(of)})" for force, of in counted.items())
            yield f"A preload F0 raises it: {text}. F0 = {joined(forces)}."


def _factors_of_products(carriages: Sequence[Criteria]) -> Iterator[str]:
    for key, force in (("lift_factor", "Lifting Fy"), ("side_factor", "Fz")):
        factors = dict.fromkeys(getattr(one.product, key) for one in carriages)
        if factors.keys() != {1.0}:
            yield f"{force} counts times the {key} of the product, {joined(map(number, factors))}."


def rating_formulas(carriages: Sequence[Criteria]) -> list[str]:
    """Formulas of equivalent load, mean load and life, with their numbers."""
    one = carriages[0]
    conditions = one.conditions
    rule = RULES[conditions.rule]
    factors = joined(f"{number(value)}" for value in dict.fromkeys(c.contact_factor for c in carriages))
    return [
        f"Equivalent load, rule {conditions.rule} ({rule.source}): {rule.note}.",
        *_factors_of_products(carriages),
        *_preload_formula(carriages),
        "P_m = (int P^p |v| dt / int |v| dt)^(1/p), exact for loads that are linear between the samples. "
        f"L = a1 base (f_H f_T f_C C / (f_W P_m))^p with p = {digits(one.rating.exponent, 4)}, f_H = "
        f"{number(conditions.hardness_factor)}, f_T = {number(conditions.temperature_factor)}, f_C = {factors}, f_W = "
        f"{number(conditions.load_factor)}; {one.product.name}: C = {number(1e-3 * one.rating.value)} kN for "
        f"{kilometres(one.rating.base)} km ({one.product.source}).",
        "a1 = (ln R / ln 0.9)^(1/1.5). Rails and machine: L = (sum L_i^-1.5)^(-1/1.5), Weibull distributions of "
        "the slope 1.5 that a1 has.",
    ]
