"""Tops of histories between their instants, by parabolas."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from guideload.base.arrays import Array

MOST_TOPS = 200  # those that promise most: of a steady vibration, some of its tops are enough
ROUNDING = 1e-12  # of the largest value: a smaller bow is none
PASSES = 5  # in which a top is found to rounding


def tops_between(time: Array, values: Array, least: Array, evaluate: Callable[[Array], Array]) -> Array:
    """Instants [s] of the tops of histories that may reach `least`, at most `MOST_TOPS`.

    By parabolas through three instants, of which the new top takes the place of the farthest.

    time: (n,) s. values: (n, k) of k histories. least: (k,). evaluate: the k histories at other instants (m,),
    ascending, as (m, k).
    """
    bow = 2.0 * values[1:-1] - values[:-2] - values[2:]
    is_top = (values[1:-1] >= values[:-2]) & (values[1:-1] >= values[2:]) & (bow > ROUNDING * np.abs(least))
    is_top &= (np.diff(time)[1:] > 0.0)[:, None] & (np.diff(time)[:-1] > 0.0)[:, None]
    promise = values[1:-1] + 0.5 * bow - least
    at, column = np.nonzero(is_top & (promise >= 0.0))
    if at.size > MOST_TOPS:
        most = np.argsort(-promise[at, column], kind="stable")[:MOST_TOPS]
        at, column = at[most], column[most]
    if not at.size:
        return np.empty(0)
    places = time[at[:, None] + np.arange(3)]
    found = values[at[:, None] + np.arange(3), column[:, None]]
    for _ in range(PASSES):
        tops = np.clip(_tops_of_parabolas(places, found), time[at], time[at + 2])
        times, of_each = np.unique(tops, return_inverse=True)
        there = evaluate(times)[of_each, column]
        index = np.arange(at.size), np.abs(places - tops[:, None]).argmax(axis=1)
        places[index], found[index] = tops, there
    return np.asarray(places[np.arange(at.size), found.argmax(axis=1)])


def _tops_of_parabolas(places: Array, values: Array) -> Array:
    """Where parabolas through three points each, (m, 3), are largest; the middle point where they are straight."""
    (a, b, c), (fa, fb, fc) = places.T, values.T
    left, right = (b - a) * (fb - fc), (b - c) * (fb - fa)
    bend = left - right
    shift = 0.5 * ((b - a) * left - (b - c) * right)
    return np.asarray(b - np.divide(shift, bend, out=np.zeros_like(b), where=bend != 0.0))
