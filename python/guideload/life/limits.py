"""Limits of the formulas and of the products that a record passes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from guideload.base.arrays import Array
from guideload.base.number_text import joined, load_in_sentence
from guideload.catalogue.conditions import LifeConditions
from guideload.life.carriage_life import CarriageLife
from guideload.life.record import Record
from guideload.simulation.result import Result

SHORT_STROKE = 2.0  # carriage lengths: the life formula may not hold for shorter strokes (THK)
LARGE_LOAD = 0.5  # of C: the life formula holds below (ISO 14728-1)


def limit_notes(
    record: Record, carriages: Sequence[CarriageLife], conditions: LifeConditions
) -> Iterator[str]:
    """Sentences on limits that are passed; each names the carriages and the figure."""
    yield from _strokes(record.result, carriages)
    yield from _loads(record.result.carriage_loads, carriages)
    for what, key, unit, history in (
        ("speed", "max_speed", "m/s", record.travel.velocity),
        ("acceleration", "max_acceleration", "m/s2", record.travel.acceleration),
    ):
        largest = float(np.abs(history).max())
        for name, limit in dict.fromkeys((one.product.name, getattr(one.product, key)) for one in carriages):
            if limit is not None and largest > limit:
                yield f"the {what} reaches {largest:.3g} {unit}, but {name} allows {limit:.3g} {unit}"
    if conditions.load_factor != 1.0:
        yield (
            f"load_factor is {conditions.load_factor:g}: the simulated loads contain the dynamics already, which are "
            "now counted twice"
        )
    for name, keys in dict.fromkeys((one.product.name, one.product.unverified) for one in carriages):
        if keys:
            yield f"{name}: not compared with the maker's page: {joined(keys)}"


def _strokes(result: Result, carriages: Sequence[CarriageLife]) -> Iterator[str]:
    position = result.history("cart_position")
    if position is None:
        yield "the position of the cart is unknown: neither short strokes nor the damage by place are known"
        return
    stroke = float(np.ptp(position[:, 0]))
    short = [one.name for one in carriages if stroke < SHORT_STROKE * (one.product.carriage_length or 0.0)]
    if short:
        yield (
            f"the stroke of {1e3 * stroke:.3g} mm is shorter than {SHORT_STROKE:g} carriage lengths (carriage "
            f"{joined(short)}): the formula may not hold, and lubrication decides"
        )


def _loads(loads: Array, carriages: Sequence[CarriageLife]) -> Iterator[str]:
    above = [
        (one.name, float(one.rule(loads[:, one.index]).max()))
        for one in carriages
        if one.rule(loads[:, one.index]).max() > LARGE_LOAD * one.rating.value
    ]
    if above:
        name, peak = max(above, key=lambda item: item[1])
        yield (
            f"P exceeds {LARGE_LOAD:g} C on carriage {joined(other for other, _ in above)} (up to "
            f"{load_in_sentence(peak)} on {name}): the life formula holds for smaller loads"
        )
