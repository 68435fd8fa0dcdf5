"""Numba: kernels written by hand, with sizes and the links' law known to the compiler."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numba
import numpy as np

from peers.laws import Law, force
from peers.problem import Array, At, Problem

Matrices = tuple[Array, ...]


@cache
def _propagate(n: int, m: int) -> Callable[..., None]:
    """The loop over the samples of the exact propagator; matrices by columns, so that it vectorises."""

    @numba.njit(fastmath=True)
    def kernel(p: Array, g0: Array, g1: Array, c: Array, rest: Array, u: Array, loads: Array) -> None:
        x, new = np.zeros(n), np.empty(n)
        for i in range(m):
            loads[0, i] = rest[i]
        for k in range(u.size - 1):
            for i in range(n):
                new[i] = g0[i] * u[k] + g1[i] * u[k + 1]
            for j in range(n):
                for i in range(n):
                    new[i] += p[j, i] * x[j]
            for i in range(n):
                x[i] = new[i]
            for i in range(m):
                load = rest[i]
                for j in range(n):
                    load += c[j, i] * x[j]
                loads[k + 1, i] = load

    return kernel


def propagator(given: Problem) -> At:
    """The exact propagator of a linear scene: all six components of each carriage, as guideload gives them."""
    n = given.b.size
    by_columns, rest = np.ascontiguousarray(given.c.reshape(-1, n).T), given.rest.ravel()
    kernel = _propagate(n, rest.size)

    def at(_: float) -> Array:
        p, g0, g1 = given.exponential()
        loads = np.empty((given.time.size, rest.size))
        kernel(np.ascontiguousarray(p.T), g0, g1, by_columns, rest, given.u, loads)
        return loads.reshape(given.time.size, -1, 6)

    return at


@cache
def _rate(n: int, links: int, law: Law | None) -> Callable[..., None]:
    """Accelerations of the free dofs, with the links' law written in; no branch, all links in step with each other."""
    is_linear = law is None  # known to the compiler
    pull = numba.njit(fastmath=True, inline="always")(force(law) if law else lambda d: d)

    @numba.njit(fastmath=True)
    def rate(matrices: Matrices, q: Array, v: Array, u: float, d: Array, out: Array) -> None:
        rows, at_rest, by, stiffness, damping, drive = matrices
        for i in range(links):
            d[i] = at_rest[i]
        for j in range(n):
            for i in range(links):
                d[i] += rows[j, i] * q[j]
        for i in range(links):
            d[i] = pull(d[i])
        for i in range(n):
            out[i] = drive[i, 0] + drive[i, 1] * u
        for j in range(n):
            for i in range(n):
                out[i] += damping[j, i] * v[j]
                if is_linear:
                    out[i] += stiffness[j, i] * q[j]
        for i in range(n):
            total = 0.0
            for link in range(links):
                total += by[i, link] * d[link]
            out[i] -= total

    return rate


def _matrices(given: Problem) -> Matrices:
    """Those of `_rate`, by columns where it runs along them."""
    n = given.b.size // 2
    drive = np.column_stack([given.constant[n:], given.b[n:]])
    a, rows = given.a[n:], given.rows[:, :n]
    return tuple(
        np.ascontiguousarray(part)
        for part in (rows.T, given.at_rest, given.by[n:], a[:, :n].T, a[:, n:].T, drive)
    )


@cache
def _rk4(n: int, links: int, law: Law | None) -> Callable[..., None]:
    """Classical RK4, `parts` steps per sample; states at the samples."""
    rate = _rate(n, links, law)

    @numba.njit(fastmath=True)
    def kernel(matrices: Matrices, u: Array, h: float, parts: int, states: Array) -> None:
        q, v, q2, v2, v3, v4 = np.zeros(n), np.zeros(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n)
        a1, a2, a3, a4, d = np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(links)
        states[0] = 0.0
        for k in range(u.size - 1):
            rise = (u[k + 1] - u[k]) / parts
            for part in range(parts):
                begin = u[k] + part * rise
                rate(matrices, q, v, begin, d, a1)
                for i in range(n):
                    q2[i] = q[i] + 0.5 * h * v[i]
                    v2[i] = v[i] + 0.5 * h * a1[i]
                rate(matrices, q2, v2, begin + 0.5 * rise, d, a2)
                for i in range(n):
                    q2[i] = q[i] + 0.5 * h * v2[i]
                    v3[i] = v[i] + 0.5 * h * a2[i]
                rate(matrices, q2, v3, begin + 0.5 * rise, d, a3)
                for i in range(n):
                    q2[i] = q[i] + h * v3[i]
                    v4[i] = v[i] + h * a3[i]
                rate(matrices, q2, v4, begin + rise, d, a4)
                for i in range(n):
                    q[i] += h / 6.0 * (v[i] + 2.0 * (v2[i] + v3[i]) + v4[i])
                    v[i] += h / 6.0 * (a1[i] + 2.0 * (a2[i] + a3[i]) + a4[i])
            for i in range(n):
                states[k + 1, i] = q[i]
                states[k + 1, n + i] = v[i]

    return kernel


def rk4(given: Problem) -> At:
    """Classical RK4 with a fixed step in ms, a whole part of the sample interval."""
    n, loads, matrices = given.b.size // 2, loads_of(given), _matrices(given)
    kernel = _rk4(n, given.at_rest.size, given.law)

    def at(step: float) -> Array:
        parts = round(given.step / (step * 1e-3))
        states = np.empty((given.time.size, 2 * n))
        kernel(matrices, given.u, given.step / parts, parts, states)
        return loads(states)

    return at


@cache
def link_loads(n: int, links: int, m: int, law: Law) -> Callable[..., None]:
    """The loop over the samples of loads from states, law written in."""
    pull = numba.njit(fastmath=True, inline="always")(force(law))

    @numba.njit(fastmath=True)
    def kernel(rows: Array, at_rest: Array, c: Array, onto: Array, states: Array, loads: Array) -> None:
        d = np.empty(links)
        for k in range(len(states)):
            for i in range(links):
                d[i] = at_rest[i]
            for j in range(n):
                for i in range(links):
                    d[i] += rows[j, i] * states[k, j]
            for i in range(links):
                d[i] = pull(d[i])
            for i in range(m):
                loads[k, i] = 0.0
            for j in range(n):
                for i in range(m):
                    loads[k, i] += c[j, i] * states[k, n + j]
            for link in range(links):
                for i in range(m):
                    loads[k, i] += onto[link, i] * d[link]

    return kernel


def loads_of(given: Problem) -> Callable[[Array], Array]:
    """(time, carriage, 2) from states (time, 2n); compiled where a law asks for it."""
    if given.law is None:
        return lambda states: given.loads_yz(states.T)
    n, m = given.b.size // 2, len(given.onto)
    rows, onto = np.ascontiguousarray(given.rows[:, :n].T), np.ascontiguousarray(given.onto.T)
    c = np.ascontiguousarray(given.c_yz[:, n:].T)
    kernel = link_loads(n, given.at_rest.size, m, given.law)

    def loads(states: Array) -> Array:
        out = np.empty((len(states), m))
        kernel(rows, given.at_rest, c, onto, np.ascontiguousarray(states), out)
        return out.reshape(len(states), -1, 2)

    return loads


@cache
def fill(given: Problem) -> Callable[[float, Array, Array], None]:
    """Writes x' at (t, x): the right-hand side for solvers that call back, matrices and motion compiled in."""
    n, links, last = given.b.size // 2, given.at_rest.size, given.u.size - 2
    accelerations, matrices = _rate(n, links, given.law), _matrices(given)
    start, per_second, u = float(given.time[0]), 1.0 / given.step, given.u
    speeds = np.ascontiguousarray(np.diag(given.a[:n, n:]))  # 1, or in the units of scaled states

    @numba.njit(fastmath=True)
    def right(t: float, x: Any, out: Any) -> None:
        at = (t - start) * per_second
        k = min(max(int(at), 0), last)
        now = u[k] + (u[k + 1] - u[k]) * (at - k)
        for i in range(n):
            out[i] = speeds[i] * x[n + i]
        accelerations(matrices, x[:n], x[n:], now, np.empty(links), out[n:])

    return right


@cache
def rate(given: Problem) -> Callable[[float, Array], Array]:
    """x' at (t, x) as a new array."""
    inner, n = fill(given), given.b.size

    @numba.njit
    def outer(t: float, x: Array) -> Array:
        out = np.empty(n)
        inner(t, x, out)
        return out

    return outer
