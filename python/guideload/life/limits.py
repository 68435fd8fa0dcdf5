"""Limits of the formulas and of the products that a record passes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from guideload.base.arrays import Array
from guideload.base.number_text import digits, first_names, joined, load_in_sentence, number
from guideload.catalogue.conditions import LifeConditions
from guideload.catalogue.life_target import HOUR
from guideload.catalogue.product import Product
from guideload.life.carriage_life import CarriageLife
from guideload.life.criteria import Criteria
from guideload.life.mean_load import Travel
from guideload.life.record import Record
from guideload.machine.machine import Machine

SHORT_STROKE = 2.0  # carriage lengths: the life formula may not hold for shorter strokes (THK)
LARGE_LOAD = 0.5  # of C: the life formula holds below (ISO 14728-1)

MOST_KEYS = 4  # that a note lists; `guideload catalogue show` has all


def left_out(machine: Machine, rated: Sequence[Criteria]) -> tuple[str, ...]:
    """Names of the carriages without ratings."""
    names = {one.name for one in rated}
    return tuple(carriage.name for carriage in machine.carriages if carriage.name not in names)


def limit_notes(
    machine: Machine, rated: Sequence[Criteria], travel: Travel, position: Array | None
) -> Iterator[str]:
    """Sentences on what was left out and on limits that the motion passes; each names carriages and figures.

    position: (n, 3) m, of the cart; None if it is unknown.
    """
    if names := left_out(machine, rated):
        yield f"without ratings, and left out: carriage {joined(names)}"
    if unknown := [one.name for one in rated if one.preload is None]:
        yield (
            f"no preload is known of carriage {joined(unknown)}, so none counts for life and static safety; a preload "
            "class with a preload, or preload_y, gives it"
        )
    if not rated[0].conditions.preload_in_life and any(one.preload for one in rated):
        yield "preload_in_life is false: the preload counts only as far as the maker's rule says so"
    without_length = {one.product.name for one in rated if not one.product.carriage_length}
    shared = {
        rail for rail in machine.rail_of_carriage.tolist() if (machine.rail_of_carriage == rail).sum() > 1
    }
    if without_length and shared and rated[0].conditions.contact_factor is None:
        yield (
            f"carriage_length of {first_names(sorted(without_length))} is not known: carriages of one rail count as "
            "apart, with f_C = 1, even if they stand side by side; add it to the product, or give contact_factor"
        )
    yield from _strokes(position, rated)
    for what, key, unit, history in (
        ("speed", "max_speed", "m/s", travel.velocity),
        ("acceleration", "max_acceleration", "m/s2", travel.acceleration),
    ):
        largest = float(np.abs(history).max())
        for name, limit in dict.fromkeys((one.product.name, getattr(one.product, key)) for one in rated):
            if limit is not None and largest > limit:
                yield f"the {what} reaches {digits(largest)} {unit}, but {name} allows {digits(limit)} {unit}"
    load_factor = rated[0].conditions.load_factor
    if load_factor != 1.0:
        yield (
            f"load_factor is {load_factor:g}: the simulated loads contain the dynamics already, so 1 is right; the "
            f"life is that of {load_factor:g} times these loads"
        )
    yield from unverified_notes(one.product for one in rated)


def cycles_notes(conditions: LifeConditions, lasts: float) -> Iterator[str]:
    """A sentence if the motion lasts [s] longer than `cycles_per_hour` allows; else none."""
    cycles = conditions.cycles_per_hour
    if cycles is not None and lasts * cycles > (1.0 + 1e-9) * HOUR:
        yield (
            f"cycles_per_hour = {number(cycles)} leaves {number(HOUR / cycles)} s for the motion, which lasts "
            f"{number(lasts)} s: hours and years of life are not those of this motion; check cycles_per_hour and that "
            "its time is in s and its speed in m/s"
        )


def unverified_notes(products: Iterable[Product]) -> Iterator[str]:
    """A sentence on the products with values that were not compared with the maker's page; none without any."""
    unverified = {one.name: one for one in products if one.unverified}
    if unverified:
        keys = dict.fromkeys(key for one in unverified.values() for key in one.unverified)
        most = max(len(one.unverified) for one in unverified.values())
        many = f"{most} values" if len(unverified) == 1 else f"up to {most} values of each"
        some = joined(keys) if len(keys) <= MOST_KEYS else many
        pages = {one.page for one in unverified.values()}
        page = f" ({pages.pop()})" if len(pages) == 1 and "" not in pages else ""
        checked = f"not checked by a person: {some}; compare at least C and C0 with the catalogue{page}"
        yield f"{first_names([*unverified])}: {checked}"


def _strokes(position: Array | None, rated: Sequence[Criteria]) -> Iterator[str]:
    if position is None:
        yield "the position of the cart is unknown: neither short strokes nor the damage by place are known"
        return
    stroke = float(np.ptp(position[:, 0]))
    short = [one.name for one in rated if stroke < SHORT_STROKE * (one.product.carriage_length or 0.0)]
    if short:
        yield (
            f"the stroke of {digits(1e3 * stroke)} mm is shorter than {SHORT_STROKE:g} carriage lengths (carriage "
            f"{joined(short)}): the formula may not hold, and lubrication decides"
        )


def load_notes(record: Record, carriages: Sequence[CarriageLife]) -> Iterator[str]:
    """A sentence on loads beyond those for which the life formula holds."""
    peaks = {one.name: float(one.rule(record.result.carriage_loads[:, one.index]).max()) for one in carriages}
    above = [one.name for one in carriages if peaks[one.name] > LARGE_LOAD * one.rating.value]
    if above:
        name = max(above, key=peaks.__getitem__)
        yield (
            f"P exceeds {LARGE_LOAD:g} C on carriage {joined(above)} (up to {load_in_sentence(peaks[name])} on "
            f"{name}): the life formula holds for smaller loads"
        )
