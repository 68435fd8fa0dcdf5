"""What to order: rails as long as the stroke needs, carriages and their mass."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from guideload.base.number_text import counted, digits, number
from guideload.reports.report import Section
from guideload.simulation.result import Result

STEP = 0.001  # m, to which lengths of rails are rounded up
MORE = "add reserve of stroke, end stops and hole pitch before ordering"


class RailLength(NamedTuple):
    """Least length of a rail [m]: stroke, distance of its outer carriages, and half of each of them, nan if unknown."""

    rail: str
    stroke: float
    span: float
    halves: float


def rail_lengths(result: Result) -> Iterator[RailLength]:
    """The least length of each rail with carriages; none where the position of the cart is unknown."""
    machine, position = result.machine, result.history("cart_position")
    if position is None:
        return
    known = [None if one is None else one.carriage_length for one in machine.product_of_carriage]
    lengths = np.array([length or np.nan for length in known])
    for index, rail in enumerate(machine.rails):
        on_it = np.flatnonzero(machine.rail_of_carriage == index)
        if on_it.size:
            x = machine.carriage_centers[on_it, 0]
            halves = 0.5 * (lengths[on_it[x.argmin()]] + lengths[on_it[x.argmax()]])
            yield RailLength(rail.name, float(np.ptp(position[:, 0])), float(np.ptp(x)), float(halves))


def shortest_rail(length: float) -> float:
    """A rail length [m] rounded up to the next whole `STEP`; what rounding of doubles adds does not count."""
    return STEP * math.ceil(length / STEP - 1e-6)


def guides_section(result: Result) -> Section:
    """Carriages by product with their mass, and the least length of each rail."""
    lines = []
    carriages = zip(result.machine.carriages, result.machine.product_of_carriage, strict=True)
    named = ((product, one.preload_class) for one, product in carriages if product is not None)
    for (product, preload), count in Counter(named).items():
        each, mass = product.mass, ""
        if each is not None:
            mass = f", {number(each)} kg each, {digits(count * each)} kg together"
        name = f"{product.name} {preload}" if preload else product.name
        lines.append(f"{counted(count, 'carriage')} {name}{mass}")
    for rail, stroke, span, halves in rail_lengths(result):
        known = not np.isnan(halves)
        needed = stroke + span + (halves if known else 0.0)
        rest = "" if known else " and the length of a carriage"
        shortest = f"{number(1e3 * shortest_rail(needed))} mm{rest}"
        last = f", {digits(1e3 * halves)} mm of their outer halves" if known else ""
        lines.append(
            f"rail {rail}: shortest possible {shortest} ({digits(1e3 * stroke, 4)} mm of stroke, "
            f"{digits(1e3 * span, 4)} mm from the first to the last carriage{last}); {MORE}"
        )
    return Section("Rails and carriages", lines)
