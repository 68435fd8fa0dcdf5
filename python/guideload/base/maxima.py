"""Local maxima of histories between their instants."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from guideload.base.arrays import Array, Indices

MOST = 50  # maxima searched of each history, the highest by their parabolas
ROUNDING = 1e-12  # of the threshold: a smaller gain is none
PASSES = 6  # the most; a maximum is found to rounding in four or five
MARGIN = 0.1  # of an interval at an end of a smooth stretch, which the first parabola leaves out


def maxima_between(time: Array, values: Array, threshold: Array, evaluate: Callable[[Array], Array]) -> Array:
    """Instants [s] of the local maxima of histories that may reach a threshold, ascending.

    By parabolas through three instants: each new instant replaces the one of the three that is farthest from it.

    time: (n,) s, two equal instants are a jump. values: (n, k) of k histories. threshold: (k,), such as the largest
    values. evaluate: the k histories at other instants (m,), ascending, as (m, k).
    """
    at, column = _candidates(time, values, threshold)
    if not at.size:
        return np.empty(0)
    places, found = time[at[:, None] + np.arange(3)], values[at[:, None] + np.arange(3), column[:, None]]
    # First not at an outer one of the three: the maximum may be beside the beginning or the end of a smooth stretch.
    first, last = ((1.0 - MARGIN) * time[at + end] + MARGIN * time[at + 1] for end in (0, 2))
    without_gain = 0
    for _ in range(PASSES):
        best = found.max(axis=1)
        new = np.clip(places[:, 1] + _parabolas(places, found)[0], first, last)
        first, last = time[at], time[at + 2]
        times, of_each = np.unique(new, return_inverse=True)
        index = np.arange(at.size), np.abs(places - new[:, None]).argmax(axis=1)
        places[index], found[index] = new, evaluate(times)[of_each, column]
        order = np.argsort(places, axis=1)
        places, found = np.take_along_axis(places, order, axis=1), np.take_along_axis(found, order, axis=1)
        # A kink at an instant can mislead one parabola.
        without_gain = 0 if np.any(found.max(axis=1) > best + ROUNDING * np.abs(best)) else without_gain + 1
        if without_gain == 2:
            break
    return np.unique(places[np.arange(at.size), found.argmax(axis=1)])


def _candidates(time: Array, values: Array, threshold: Array) -> tuple[Indices, Indices]:
    """First of three instants, and history, of the maxima that may reach the threshold; at most `MOST` per history.

    The middle one of the three is the highest. Where a smooth stretch begins or ends, as at a jump, the outer one may
    be the highest, with the maximum beside it.
    """
    before, middle, after = values[:-2], values[1:-1], values[2:]
    lasts = np.diff(time) > 0.0
    begins, ends = np.append(True, ~lasts[:-1])[:-1, None], np.append(~lasts[1:], True)[1:, None]
    rises, falls = middle >= before, middle >= after
    is_maximum = (rises | (begins & falls)) & (falls | (ends & rises))
    is_maximum &= (middle != before) | (middle != after)  # nothing is to be found within a rest
    is_maximum &= lasts[1:, None] & lasts[:-1, None]
    at, column = np.nonzero(is_maximum)
    steps = at[:, None] + np.arange(3)
    found = values[steps, column[:, None]]
    shift, bend = _parabolas(time[steps], found)
    size, least = found.max(axis=1), threshold[column]
    # A parabola rises by at most a quarter of this above its middle point, the history perhaps by more.
    rise = bend * np.maximum(time[at + 1] - time[at], time[at + 2] - time[at + 1]) ** 2
    chosen = np.flatnonzero((size + rise >= least) & (rise > ROUNDING * np.abs(least)))
    height = found[:, 1] + bend * shift**2
    chosen = chosen[np.lexsort((-height[chosen], column[chosen]))]
    first = np.searchsorted(column[chosen], column[chosen])
    chosen = chosen[np.arange(chosen.size) - first < MOST]
    return at[chosen], column[chosen]


def _parabolas(places: Array, values: Array) -> tuple[Array, Array]:
    """From the middle of three points to the vertex of the parabola through them, and its bend f'' / 2; points: (m, 3).

    0 where they lie on a line.
    """
    (a, b, c), (fa, fb, fc) = places.T, values.T
    left, right = (b - a) * (fb - fc), (b - c) * (fb - fa)
    bend = left - right
    some = bend != 0.0
    shift = np.divide(0.5 * ((b - c) * right - (b - a) * left), bend, out=np.zeros_like(b), where=some)
    widths = (b - a) * (b - c) * (a - c)
    curvature = np.divide(bend, widths, out=np.zeros_like(b), where=widths != 0.0)
    return shift, np.abs(curvature)
