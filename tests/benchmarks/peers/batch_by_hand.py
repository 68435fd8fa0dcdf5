"""The exact propagator by hand, in NumPy with all scenes in step and in Numba scene by scene."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numba
import numpy as np

from peers.problem import Array
from peers.scatter import Peaks, Scatter, systems


def by_numpy(of: Scatter) -> Peaks:
    """All scenes take each step together; the axis over scenes is the last one, along which NumPy's loops run."""
    given, u = systems(of), of.nominal.u
    p, g0, g1 = given.propagators()
    n, count = p.shape[1], len(of)
    # x and u at both ends of the step make one vector, so that a step is one contraction.
    step = np.ascontiguousarray(
        np.concatenate([p, g0[:, :, None], g1[:, :, None]], axis=2).transpose(1, 2, 0)
    )
    c, rest = np.ascontiguousarray(given.c.transpose(1, 2, 0)), np.ascontiguousarray(given.rest.T)
    x, load = np.zeros((n + 2, count)), rest.copy()
    low, high = rest.copy(), rest.copy()
    for k in range(u.size - 1):
        x[n], x[n + 1] = u[k], u[k + 1]
        x[:n] = np.einsum("ijs,js->is", step, x)
        np.einsum("ijs,js->is", c, x[:n], out=load)
        load += rest
        np.minimum(low, load, out=low)
        np.maximum(high, load, out=high)
    return np.maximum(-low, high).T


@cache
def _propagate(n: int, m: int) -> Callable[..., None]:
    """The loop over scenes and samples; matrices by columns, so that it vectorises."""

    @numba.njit(fastmath=True)
    def kernel(p: Array, g0: Array, g1: Array, c: Array, rest: Array, u: Array, peaks: Array) -> None:
        x, new, load, low, high = np.empty(n), np.empty(n), np.empty(m), np.empty(m), np.empty(m)
        for scene in range(len(p)):
            for i in range(n):
                x[i] = 0.0
            for i in range(m):
                low[i] = high[i] = rest[scene, i]
            for k in range(u.size - 1):
                for i in range(n):
                    new[i] = g0[scene, i] * u[k] + g1[scene, i] * u[k + 1]
                for j in range(n):
                    for i in range(n):
                        new[i] += p[scene, j, i] * x[j]
                for i in range(n):
                    x[i] = new[i]
                for i in range(m):
                    load[i] = rest[scene, i]
                for j in range(n):
                    for i in range(m):
                        load[i] += c[scene, j, i] * x[j]
                for i in range(m):
                    low[i] = min(low[i], load[i])
                    high[i] = max(high[i], load[i])
            for i in range(m):
                peaks[scene, i] = max(-low[i], high[i])

    return kernel


def by_numba(of: Scatter) -> Peaks:
    """One scene after another, extremes on the fly."""
    given = systems(of)
    p, g0, g1 = given.propagators()
    peaks = np.empty_like(given.rest)
    by_columns, c = (np.ascontiguousarray(part.transpose(0, 2, 1)) for part in (p, given.c))
    kernel = _propagate(p.shape[1], peaks.shape[1])
    kernel(by_columns, g0, g1, c, given.rest, of.nominal.u, peaks)
    return peaks
