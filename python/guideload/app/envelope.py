"""Histories for charts: few points, and no peak lost."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import guideload

Array = NDArray[np.float64]
BUCKETS = 300  # of a history on the screen; each has two points


def envelope(
    time: Array, values: Array, low: float, high: float, buckets: int = BUCKETS
) -> list[list[float]]:
    """Points [time, value] of a history: between `low` and `high` [s] in fine steps, beside it in coarse ones.

    In each step stand the smallest and the largest value, at their instants; so the extremes of every step, and the
    first and the last value, are those of the history. A history with fewer samples is returned as it is. Values have
    five significant digits, which are shorter to send.
    """
    first, last = np.searchsorted(time, [low, high])
    parts = ((0, first, buckets // 4), (first, last, buckets), (last, time.size, buckets // 4))
    edges = [np.linspace(a, b, min(count, b - a), endpoint=False) for a, b, count in parts]
    starts = np.unique(np.concatenate(edges).astype(np.intp))
    chosen = np.arange(time.size)
    if time.size > 2 * starts.size:
        found = guideload.plots.extremes(values, starts)
        chosen = np.unique(np.concatenate([chosen[[0, -1]], *found]))
    pairs = zip(time[chosen].tolist(), values[chosen].tolist(), strict=True)
    return [[round(instant, 6), float(f"{value:.5g}")] for instant, value in pairs]
