"""The loads of the two rows of a preloaded carriage, which the elastic law knows beside the load of the whole."""

from __future__ import annotations

import numpy as np

from guideload.base.arrays import Array

ROUNDS = 60  # of bisection: to rounding


def row_loads(force: Array, preload: float, exponent: float) -> tuple[Array, Array]:
    """Loads [N] of the loaded and the other row under a load [N] of the carriage in one direction.

    F = F0 ((1 + e)+^n - (1 - e)+^n), e deflection over that at which a row opens. Both rows carry the preload F0 at no
    load; beyond 2^n F0 the other row is open. exponent: n, 3/2 for balls, 10/9 for rollers.
    """
    ratio = np.abs(force) / preload
    closed = ratio < 2.0**exponent
    low, high = np.zeros_like(ratio), np.ones_like(ratio)
    for _ in range(ROUNDS):
        middle = 0.5 * (low + high)
        below = (1.0 + middle) ** exponent - (1.0 - middle) ** exponent < ratio
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    deflection = 0.5 * (low + high)
    loaded = np.where(closed, preload * (1.0 + deflection) ** exponent, np.abs(force))
    return loaded, np.where(closed, preload * (1.0 - deflection) ** exponent, 0.0)
