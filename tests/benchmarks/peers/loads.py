"""Loads from states, the last lines of most peers."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from peers.problem import Array, Problem


def loads_of(given: Problem) -> Callable[[Array], Array]:
    """(time, carriage, 2) from states (time, 2n); compiled where a law asks for it."""
    if given.law is None:
        return lambda states: given.loads_yz(states.T)
    from peers.compiled import link_loads

    n, m = given.b.size // 2, len(given.onto)
    rows, onto = np.ascontiguousarray(given.rows[:, :n].T), np.ascontiguousarray(given.onto.T)
    c = np.ascontiguousarray(given.c_yz[:, n:].T)
    kernel = link_loads(n, given.at_rest.size, m, given.law)

    def loads(states: Array) -> Array:
        out = np.empty((len(states), m))
        kernel(rows, given.at_rest, c, onto, np.ascontiguousarray(states), out)
        return out.reshape(len(states), -1, 2)

    return loads
