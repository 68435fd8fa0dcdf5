"""Histories for charts: few points, and no peak lost."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
BUCKETS = 300  # of a history on the screen; each has two points


def envelope(
    time: Array, values: Array, low: float, high: float, buckets: int = BUCKETS
) -> list[list[float]]:
    """Points [time, value] of a history: between `low` and `high` [s] in fine steps, beside it in coarse ones.

    In each step stand the smallest and the largest value, at their instants; so the extremes of every step, and the
    first and the last value, are those of the history. A history with fewer samples is returned as it is.
    """
    first, last = np.searchsorted(time, [low, high])
    edges = [
        _edges(0, int(first), buckets // 4),
        _edges(int(first), int(last), buckets),
        _edges(int(last), time.size, buckets // 4),
    ]
    starts = np.unique(np.concatenate(edges))
    if time.size <= 2 * starts.size:
        chosen = np.arange(time.size)
    else:
        sizes = np.diff(np.append(starts, time.size))
        found = [np.array([0, time.size - 1])]
        for extreme in (np.minimum, np.maximum):
            places = np.flatnonzero(values == np.repeat(extreme.reduceat(values, starts), sizes))
            _, one_each = np.unique(np.searchsorted(starts, places, "right"), return_index=True)
            found.append(places[one_each])
        chosen = np.unique(np.concatenate(found))
    points: list[list[float]] = np.column_stack([np.round(time[chosen], 6), _digits(values[chosen])]).tolist()
    return points


def _digits(values: Array) -> Array:
    """Values with five significant digits, which are shorter to send."""
    sizes = np.abs(values)
    decimals = 4 - np.floor(np.log10(np.where(sizes > 0.0, sizes, 1.0)))
    scale = 10.0 ** np.abs(decimals)
    rounded: Array = np.where(
        decimals >= 0.0, np.rint(values * scale) / scale, np.rint(values / scale) * scale
    )
    return rounded


def _edges(first: int, last: int, count: int) -> NDArray[np.intp]:
    """Starts of at most `count` steps that cover the samples from `first` to before `last`."""
    return np.linspace(first, last, min(count, last - first), endpoint=False).astype(np.intp)
