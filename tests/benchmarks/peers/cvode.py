"""scikit-sundae: CVODE of SUNDIALS."""

from __future__ import annotations

from typing import Any

import numpy as np

from peers.compiled import fill, loads_of
from peers.problem import Array, At, Problem


def cvode(given: Problem, *, method: str, limited: bool) -> At:
    """CVODE "Adams" or "BDF", right-hand side compiled by Numba, Jacobian given.

    limited: with the sample interval as max_step.
    """
    from sksundae.cvode import CVODE

    right, loads = fill(given), loads_of(given)

    def jacobian(t: float, x: Array, rate: Array, out: Any) -> None:
        out[:, :] = given.jacobian(x)

    def at(rtol: float) -> Array:
        solver = CVODE(
            right,
            method=method,
            rtol=rtol,
            atol=rtol * given.size,
            max_step=given.step if limited else 0.0,
            max_num_steps=10_000,
            jacfn=jacobian,
        )
        solution = solver.solve(given.time, np.zeros(given.b.size))
        if not solution.success:
            raise RuntimeError(f"CVODE {method}: {solution.message}")
        return loads(solution.y)

    return at
