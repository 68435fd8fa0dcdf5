"""Numba: a scene after another, each by a kernel written by hand."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numba
import numpy as np

from peers.compiled import rk4 as rk4_of_one
from peers.problem import Array
from peers.scatter import Peaks, Run, Scatter, systems


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


def propagator(of: Scatter) -> Peaks:
    """The exact propagator of linear scenes, extremes on the fly."""
    given = systems(of)
    p, g0, g1 = given.propagators()
    peaks = np.empty_like(given.rest)
    by_columns, c = (np.ascontiguousarray(part.transpose(0, 2, 1)) for part in (p, given.c))
    kernel = _propagate(p.shape[1], peaks.shape[1])
    kernel(by_columns, g0, g1, c, given.rest, of.nominal.u, peaks)
    return peaks


def rk4(step: float) -> Run:
    """Classical RK4 with a fixed step in ms, the law of the links written in."""

    def run(of: Scatter) -> Peaks:
        given = systems(of)
        loads = (rk4_of_one(given.problem(scene))(step)() for scene in range(len(of)))
        return np.array([np.abs(load).max(axis=0).ravel() for load in loads])

    return run
