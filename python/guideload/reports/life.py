"""The report of life and static safety: answer, tables, causes, places, definitions with their sources."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from guideload.base.errors import LifeError
from guideload.base.number_text import joined, load_in_table, percent
from guideload.life.criteria import Criteria
from guideload.life.equivalent_load import RULES
from guideload.life.life import Life, life_of
from guideload.life.limits import unverified_notes
from guideload.life.load_parts import CAUSES
from guideload.reports.elements import new_table, remark, section, to_text

if TYPE_CHECKING:
    from guideload.catalogue.product import Product
    from guideload.life.bands import LifeBand
    from guideload.simulation.result import Result

LIFE_DEFINITION = (
    "P_m: mean equivalent load over distance. Life: rating life L (ISO 14728-1), fatigue of steel alone. S0: static "
    "safety C0/P0 at the worst instant (ISO 14728-2). f_W: the load factor with which the "
    "catalogue's formula, under the loads of statics with m a, gives the life (L) or the safety (S0) of the simulated "
    "loads."
)


def life_report(life: Life, band: bool = True, encoding: str = "utf-8") -> str:
    """The whole report. band: whether to compute the credible bands, which takes longer than the run."""
    found = life.band if band else None
    return to_text(
        [
            *remark(_answer(life, found), *_notes(life)),
            life_table(life, found),
            *remark(
                LIFE_DEFINITION,
                *([f"Band: 95 % credible band of the life; {found.method}."] if found else []),
            ),
            *causes_section(life),
            *_rows_lines(life),
            *section("Share of the life by phase of the cycle"),
            _phases_line(life),
            *_places_section(life),
            *section("Formulas"),
            *remark(*_formulas(life)),
        ],
        encoding=encoding,
    )


def life_of_run(result: Result) -> Life | LifeError | None:
    """Life and static safety of a run, or why they cannot be computed; None if no carriage names a product."""
    if not any(result.machine.product_of_carriage):
        return None
    try:
        return life_of(result)
    except LifeError as error:
        return error


def life_answer(life: Life | LifeError | None) -> list[RenderableType]:
    """The answer of `life_of_run` for the head of the report of a run."""
    if life is None:
        return []
    if isinstance(life, LifeError):
        return remark(f"Life and static safety are not computed: {life}.")
    return remark(_answer(life, None), *unverified_lines(one.product for one in life.carriages))


def life_section(life: Life | LifeError | None) -> list[RenderableType]:
    """The section of the report of a run: notes, table and definitions; empty without a life."""
    if not isinstance(life, Life):
        return []
    unverified = unverified_lines(one.product for one in life.carriages)  # in the answer
    return [
        *section("Life and static safety"),
        *remark(*(note for note in _notes(life) if note not in unverified)),
        life_table(life, None),
        *remark(LIFE_DEFINITION),
    ]


def _answer(life: Life, band: LifeBand | None) -> str:
    shortest, weakest, conditions = life.shortest, life.weakest, life.conditions
    hours, years = life.hours(life.machine), life.years(life.machine)
    ends = (
        ""
        if band is None
        else f", 95 % credible band {' to '.join(kilometres(end) for end in band.machine)} km"
    )
    time = f"{hours:.0f} h" + ("" if conditions.hours_per_year is None else f" or {years:.3g} years")
    required = (
        "wanted" if conditions.safety is not None else f'least for application "{conditions.application}"'
    )
    asked = risk = ""
    if conditions.life is not None:
        asked = f" (wanted: {kilometres(conditions.life)} km)"
        risk = f"The probability that one fails before {kilometres(conditions.life)} km is "
        risk += f"{percent(life.failure_probability(conditions.life))}. "
    return (
        f"{_verdict(life)} With a probability of {100 * conditions.reliability:g} % all carriages last "
        f"{kilometres(life.machine)} km{asked}, that is {time}{ends}. {risk}Carriage {shortest.name} alone: "
        f"{kilometres(shortest.life)} km. The smallest static safety is {weakest.static.safety:.2f} ({required}: "
        f"{conditions.least_safety:g}), on carriage {weakest.name} at {weakest.worst.time:.3f} s, "
        f"{weakest.worst.phase}."
    )


def _verdict(life: Life) -> str:
    """Whether the life, if one is wanted, and the static safety are reached."""
    conditions = life.conditions
    reached = {} if conditions.life is None else {"life": life.machine >= conditions.life}
    reached["static safety"] = life.weakest.static.safety >= conditions.least_safety
    if missed := [name for name, held in reached.items() if not held]:
        return f"NOT REACHED: {joined(missed)}."
    return "Life and static safety are reached." if len(reached) > 1 else "The static safety is reached."


def _notes(life: Life) -> list[str]:
    return [f"Note: {note}." for note in life.notes]


def unverified_lines(products: Iterable[Product]) -> list[str]:
    """For the answer: which values of the products were not compared with the maker's page."""
    return [f"Note: {note}." for note in unverified_notes(products)]


def kilometres(metres: float) -> str:
    """A life in km without its unit, three digits or all before the decimal point: `12805`, `43.7`."""
    value = 1e-3 * metres
    return f"{value:.3g}" if value < 100 else f"{value:.0f}"


def life_table(life: Life, band: LifeBand | None) -> Table:
    """A row per carriage, and one for each rail and the machine."""
    bands = () if band is None else ("band\nfrom km", "band\nto km")
    table = new_table("", "P_m\nN", "life\nkm", *bands, "h", "S0\n", "f_W\nL", "f_W\nS0", texts=("product",))
    for i, one in enumerate(life.carriages):
        ends = () if band is None else (kilometres(band.lower[i]), kilometres(band.upper[i]))
        factors = (f"{factor:.2f}" for factor in (one.static.safety, one.factor_life, one.factor_safety))
        table.add_row(
            Text(one.name),
            load_in_table(one.mean_load),
            kilometres(one.life),
            *ends,
            f"{life.hours(one.life):.0f}",
            *factors,
            Text(one.product.name),
        )
    empty = [""] * len(bands)
    for rail, value in life.rails.items():
        table.add_row(Text(f"rail {rail}"), "", kilometres(value), *empty, f"{life.hours(value):.0f}")
    ends_of_machine = empty if band is None else [kilometres(end) for end in band.machine]
    table.add_row(
        "machine", "", kilometres(life.machine), *ends_of_machine, f"{life.hours(life.machine):.0f}"
    )
    return table


def causes_section(life: Life) -> list[RenderableType]:
    """The causes of the worst instant of each carriage, and their definitions."""
    causes = list(life.carriages[0].worst.shares)
    headings = (f"{cause}\nN" if " " not in cause else cause.replace(" ", "\n") + "\nN" for cause in causes)
    table = new_table("", "P0\nN", "at\ns", *headings, "noise\nN", texts=("while",))
    for one in life.carriages:
        worst = one.worst
        noise = "" if worst.noise != worst.noise else load_in_table(worst.noise)
        shares = (load_in_table(share) for share in worst.shares.values())
        table.add_row(
            Text(one.name), load_in_table(worst.load), f"{worst.time:.3f}", *shares, noise, worst.phase
        )
    definitions = ". ".join(f"{cause[0].upper()}{cause[1:]}: {CAUSES[cause]}" for cause in causes)
    return [
        *section("Causes of the worst instant"),
        table,
        *remark(
            f"P0 is largest at the time in the table, and there the sum of its causes. {definitions}. Noise: 1.96 "
            "standard deviations of the resultant at this time, from the uncertainty of the trace."
        ),
    ]


def _rows_lines(life: Life) -> list[RenderableType]:
    """The row loads of preloaded carriages; empty without any."""
    lines = [
        f"carriage {one.name}: loaded row up to {load_in_table(one.rows[0])} N, the other at least "
        f"{load_in_table(one.rows[1])} N{'' if one.rows[1] else ': it opens'}"
        for one in life.carriages
        if one.rows is not None
    ]
    return [*section("Loads of the two rows along y, preload included"), *lines] if lines else []


def _phases_line(life: Life) -> str:
    return ", ".join(f"{phase} {100 * share:.1f} %" for phase, share in life.phases.items())


def _places_section(life: Life) -> list[RenderableType]:
    if not life.places:
        return []
    lines = []
    for place in life.places:
        start, end, share = place.worst_window()
        lines.append(
            f"rail {place.rail}: most of the damage from x = {start:.2f} to {end:.2f} m, {100 * share:.0f} % of it on "
            f"{100 * (end - start) / (place.edges[-1] - place.edges[0]):.0f} % of the length that its carriages pass"
        )
    note = (
        "x is counted from L at the start of the record. Damage at a place: from all carriages that pass it."
    )
    return [*section("Life by place"), *lines, *remark(note)]


def _formulas(life: Life) -> list[str]:
    return [
        *rating_formulas(life.carriages),
        f"One record is {life.record.travel.time[-1] - life.record.travel.time[0]:.4g} s and {life.distance:.4g} m of "
        f"travel; it repeats every {life.duration:.4g} s.",
    ]


def rating_formulas(carriages: Sequence[Criteria]) -> list[str]:
    """Formulas of equivalent load, mean load and life, with their numbers."""
    one = carriages[0]
    conditions = one.conditions
    rule = RULES[conditions.rule]
    factors = joined(f"{value:g}" for value in dict.fromkeys(c.contact_factor for c in carriages))
    return [
        f"Equivalent load, rule {conditions.rule} ({rule.source}): {rule.note}.",
        "P_m = (int P^p |v| dt / int |v| dt)^(1/p), exact for loads that are linear between the samples. "
        f"L = a1 base (f_H f_T f_C C / (f_W P_m))^p with p = {one.rating.exponent:.4g}, f_H = "
        f"{conditions.hardness_factor:g}, f_T = {conditions.temperature_factor:g}, f_C = {factors}, f_W = "
        f"{conditions.load_factor:g}; {one.product.name}: C = {1e-3 * one.rating.value:g} kN for "
        f"{kilometres(one.rating.base)} km ({one.product.source}).",
        "a1 = (ln R / ln 0.9)^(1/1.5). Rails and machine: L = (sum L_i^-1.5)^(-1/1.5), Weibull distributions of "
        "the slope 1.5 that a1 has.",
    ]
