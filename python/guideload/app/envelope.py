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
    ]
    edges.append(_edges(int(last), time.size, buckets // 4))
    starts = np.unique(np.concatenate(edges))
    ends = np.append(starts[1:], time.size)
    if time.size <= 2 * starts.size:
        chosen = np.arange(time.size)
    else:
        least = [int(a + values[a:b].argmin()) for a, b in zip(starts, ends, strict=True)]
        most = [int(a + values[a:b].argmax()) for a, b in zip(starts, ends, strict=True)]
        chosen = np.unique([0, time.size - 1, *least, *most])
    rounded = np.char.mod("%.5g", values[chosen]).astype(np.float64)
    points: list[list[float]] = np.column_stack([np.round(time[chosen], 6), rounded]).tolist()
    return points


def _edges(first: int, last: int, count: int) -> NDArray[np.intp]:
    """Starts of at most `count` steps that cover the samples from `first` to before `last`."""
    return np.linspace(first, last, min(count, last - first), endpoint=False).astype(np.intp)
