"""SciPy's ways for linear systems; no tolerance, no step to choose."""

from __future__ import annotations

import numpy as np
import scipy

from peers.problem import Array, At, Problem


def lsim(given: Problem) -> At:
    """scipy.signal.lsim, first-order hold."""
    through = np.zeros((len(given.c_yz), 1))
    system = scipy.signal.StateSpace(given.a, given.b[:, None], given.c_yz, through)

    def at(_: float) -> Array:
        _, loads, _ = scipy.signal.lsim(system, given.u, given.time)
        return (given.rest_yz + loads).reshape(given.time.size, -1, 2)

    return at


def lfilter(given: Problem) -> At:
    """A complex first-order scipy.signal.lfilter for each mode; for u[0] = 0 and a that is diagonalisable."""

    def at(_: float) -> Array:
        h = given.step
        values, vectors = np.linalg.eig(given.a)
        once = values.imag >= 0.0  # of a conjugate pair, one
        shares = np.linalg.solve(vectors, given.b)[once] * np.where(values.imag > 0.0, 2.0, 1.0)[once]
        z, weights = values[once] * h, (given.c_yz @ vectors[:, once]) * shares
        decay = np.exp(z)
        late = h * (decay - 1.0 - z) / z**2
        early = h * (decay - 1.0) / z - late
        modes = np.array(
            [
                scipy.signal.lfilter([g1, g0], [1.0, -e], given.u)
                for g1, g0, e in zip(late, early, decay, strict=True)
            ]
        )
        loads = modes.real.T @ weights.real.T - modes.imag.T @ weights.imag.T
        return (given.rest_yz + loads).reshape(given.time.size, -1, 2)

    return at
