"""Static safety at the worst instant (ISO 14728-2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from guideload.base.arrays import Array
from guideload.catalogue.product import Product


class LargestLoads(NamedTuple):
    """The largest loads of a carriage at any time."""

    equivalent: float  # N, P0 with the moments that the rule counts
    bare: float  # N, P0 without the effect of a preload
    time: float  # s, of both
    sizes: Array  # (6,) largest magnitude of each force [N] and moment [N m]


@dataclass(frozen=True)
class StaticSafety:
    """Static safety of a carriage."""

    safety: float  # C0/P0 at the worst instant, P0 with the moments that the rule counts
    largest: LargestLoads  # its largest loads

    @property
    def peak(self) -> float:
        """P0 at the worst instant [N]."""
        return self.largest.equivalent


def static_safety(largest: LargestLoads, product: Product, contact_factor: float) -> StaticSafety:
    """The static safety under the largest loads. contact_factor: f_C, which reduces C0 of carriages side by side."""
    assert product.static is not None
    rating = contact_factor * product.static
    return StaticSafety(float(safety(rating, largest.equivalent)), largest)


def safety(rating: float, load: ArrayLike) -> Array:
    """Rating over largest load; infinite without load."""
    with np.errstate(divide="ignore"):
        return np.asarray(rating / np.asarray(load))
