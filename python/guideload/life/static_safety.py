"""Static safety at the worst instant (ISO 14728-2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from guideload._core import largest_equivalent_load
from guideload.base.arrays import Array
from guideload.catalogue.product import Product
from guideload.life.equivalent_load import AXES, EquivalentLoad

FORCES = ("lift or press", "side")


@dataclass(frozen=True)
class StaticSafety:
    """Static safety of a carriage.

    safety   C0/P0 at the worst instant, P0 with the moments that the rule counts
    peak     N, P0 at this instant
    instant  its index
    alone    smallest safety under each load alone, without preload: C0 over the force, M0 over the moment; only of
             rated moments
    """

    safety: float
    peak: float
    instant: int
    alone: dict[str, float]


def static_safety(
    loads: Array, product: Product, rule: EquivalentLoad, contact_factor: float
) -> StaticSafety:
    """The static safety under loads (n, 6): force [N] and moment [N m]. P0 is largest at an instant: it is convex, and
    the preload raises all loads in their order.

    contact_factor: f_C, that reduces C0 of carriages side by side.
    """
    assert product.static is not None
    rating = contact_factor * product.static
    instant, peak, largest = largest_equivalent_load(np.ascontiguousarray(loads), rule.of_core)
    rated = {name: (rating, largest[i]) for i, name in enumerate(FORCES, start=1)}
    for i, axis in enumerate(AXES, start=3):
        if (moment := getattr(product.static_moments, axis)) is not None:
            rated[axis] = (contact_factor * moment, largest[i])
    alone = {name: float(safety(limit, load)) for name, (limit, load) in rated.items()}
    return StaticSafety(float(safety(rating, peak)), peak, instant, alone)


def safety(rating: float, load: ArrayLike) -> Array:
    """Rating over largest load; infinite without load."""
    with np.errstate(divide="ignore"):
        return np.asarray(rating / np.asarray(load))
