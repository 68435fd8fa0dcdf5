"""scipy.integrate.solve_ivp, and the right-hand side in plain NumPy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy

from peers import compiled as by_numba
from peers.compiled import loads_of
from peers.problem import Array, At, Problem

WITH_JACOBIAN = ("Radau", "BDF", "LSODA")


def rate(given: Problem) -> Callable[[float, Array], Array]:
    """x' of a linear problem at (t, x)."""
    a, b, time, u = given.a, given.b, given.time, given.u
    return lambda t, x: a @ x + b * np.interp(t, time, u)


def solve_ivp(given: Problem, *, method: str, limited: bool, compiled: bool) -> At:
    """solve_ivp on (t, x), loads from its dense output at the samples; the Jacobian is given to methods that
    take one.

    limited: with the sample interval as max_step. RK45 does without on smooth motions, because stability
    holds its steps to about 3 ms; the others take longer ones, whose dense output is poor and which pass over
    whole samples. compiled: a right-hand side compiled by Numba.
    """
    right = by_numba.rate(given) if compiled else rate(given)
    loads = loads_of(given)
    options: dict[str, Any] = {"method": method, "t_eval": given.time}
    if limited:
        options["max_step"] = given.step
    if method in WITH_JACOBIAN:
        constant = given.law is None and method != "LSODA"
        options["jac"] = given.a if constant else lambda t, x: given.jacobian(x)

    def at(rtol: float) -> Array:
        solution = scipy.integrate.solve_ivp(
            right,
            (given.time[0], given.time[-1]),
            np.zeros(given.b.size),
            rtol=rtol,
            atol=rtol * given.size,
            **options,
        )
        if not solution.success:
            raise RuntimeError(f"{method}: {solution.message}")
        return loads(np.ascontiguousarray(solution.y.T))

    return at
