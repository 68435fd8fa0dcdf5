"""numbalsoda: LSODA and DOP853 called from compiled code."""

from __future__ import annotations

import numba
import numpy as np

from peers.compiled import fill, loads_of
from peers.problem import Array, At, Problem

STEPS = 1_000_000


def numbalsoda(given: Problem, *, solver: str) -> At:
    """numbalsoda.lsoda or .dop853; they have one absolute tolerance and no largest step to set."""
    import numbalsoda as package

    given = given.scaled
    n, inner, solve = given.b.size, fill(given), getattr(package, solver)

    @numba.cfunc(package.lsoda_sig)
    def right(t, x, out, data):
        inner(t, numba.carray(x, (n,)), numba.carray(out, (n,)))

    address, start, loads = right.address, np.zeros(n), loads_of(given)

    def at(rtol: float) -> Array:
        states, success = solve(address, start.copy(), given.time, rtol=rtol, atol=rtol, mxstep=STEPS)
        if not success:
            raise RuntimeError(f"numbalsoda {solver} failed")
        return loads(states)

    return at
