"""Scenes one after another: what packages offer that know one scene at a time."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from guideload import Machine
from peers import ivp, linear, multibody
from peers.diffsol import listed
from peers.laws import Sided, force
from peers.loads import loads_of
from peers.lsoda import STEPS
from peers.problem import Array, Problem
from peers.scatter import Geometry, Peaks, Run, Scatter, systems


def each(loads: Callable[[Problem], Array]) -> Run:
    """Set up all scenes at once, then the loads (time, carriage, 2) of one after another."""

    def run(of: Scatter) -> Peaks:
        given = systems(of)
        return np.array([np.abs(loads(given.problem(scene))).max(axis=0).ravel() for scene in range(len(of))])

    return run


lsim = each(lambda given: linear.lsim(given)())


def solve_ivp(method: str, rtol: float) -> Run:
    """solve_ivp with its right-hand side in plain NumPy."""
    return each(lambda given: ivp.solve_ivp(method, limited=False, compiled=False)(given)(rtol)())


def diffsol(solver: str, rtol: float) -> Run:
    """A solver of pydiffsol: equations compiled once for all linear scenes, whose matrices are their parameters."""

    def run(of: Scatter) -> Peaks:
        import pydiffsol

        ode, given, time = _equations(of.nominal), systems(of), of.nominal.time
        ode.ode_solver = getattr(pydiffsol, solver)
        ode.rtol = ode.atol = rtol

        def peaks(one: Problem) -> Array:
            scaled = one.scaled
            n = one.b.size // 2
            values = np.concatenate([scaled.a[n:].ravel(), scaled.b[n:]])
            return np.abs(one.rest_yz[:, None] + scaled.c_yz @ ode.solve_dense(values, time).ys).max(axis=1)

        return np.array([peaks(given.problem(scene)) for scene in range(len(of))])

    return run


@cache
def _equations(nominal: Problem) -> Any:
    """The lower halves of a and b are inputs, entry by entry; states are in units of their size."""
    import pydiffsol

    n, size = nominal.b.size // 2, nominal.size
    names = [f"a{i}" for i in range(2 * n * n)] + [f"b{i}" for i in range(n)]
    upper = [f"({i}, {n + i}): {float(size[n + i] / size[i])!r}" for i in range(n)]
    lower = [f"({n + i}, {j}): a{2 * n * i + j}" for i in range(n) for j in range(2 * n)]
    lines = [
        f"in_i {{ {', '.join(f'{name} = 0.0' for name in names)} }}",
        f"time_k {{ {listed(nominal.time)} }}",
        f"given_k {{ {listed(nominal.u)} }}",
        f"A_ij {{ {', '.join(upper + lower)} }}",
        f"b_i {{ (0:{n}): 0.0, {', '.join(f'({n + i}): b{i}' for i in range(n))} }}",
        f"u_i {{ (0:{2 * n}): 0.0 }}",
        "input { interp1d(time_k, given_k, t) }",
        "Au_i { A_ij * u_j }",
        "F_i { Au_i + b_i * input }",
    ]
    return pydiffsol.Ode("\n".join(lines), matrix_type=pydiffsol.nalgebra_dense)


def lsoda(rtol: float) -> Run:
    """numbalsoda.lsoda: right-hand side compiled once, what differs between scenes is given to it as data."""

    def run(of: Scatter) -> Peaks:
        import numbalsoda

        address, given, time = _right(of.nominal, of.geometry, of.law).address, systems(of), of.nominal.time
        n = of.nominal.b.size // 2

        def peaks(one: Problem) -> Array:
            data = np.concatenate([part.ravel() for part in _data(one.scaled)])
            start = np.zeros(2 * n)
            states, success = numbalsoda.lsoda(
                address, start, time, data=data, rtol=rtol, atol=rtol, mxstep=STEPS
            )
            if not success:
                raise RuntimeError("numbalsoda lsoda failed")
            return np.abs(loads_of(one)(states * one.size)).max(axis=0).ravel()

        return np.array([peaks(given.problem(scene)) for scene in range(len(of))])

    return run


def _data(scaled: Problem) -> tuple[Array, ...]:
    """Damping, drive, position at rest and forces of the links, for `_right`."""
    n = scaled.b.size // 2
    hold = np.column_stack([scaled.constant, scaled.b])[n:]
    return np.ascontiguousarray(scaled.a[n:, n:].T), hold, scaled.at_rest, scaled.by[n:]


@cache
def _right(nominal: Problem, geometry: Geometry, law: Sided) -> Any:
    """The right-hand side for states in units of their size, with the motion compiled in."""
    import numba
    import numbalsoda

    n, links, last = nominal.b.size // 2, len(geometry.rows), nominal.u.size - 2
    rows = np.ascontiguousarray((geometry.rows * nominal.size[:n]).T)
    rise = nominal.size[n:] / nominal.size[:n]
    start, per_second, u = float(nominal.time[0]), 1.0 / nominal.step, nominal.u
    pull = numba.njit(fastmath=True, inline="always")(force(law))

    @numba.cfunc(numbalsoda.lsoda_sig, fastmath=True)
    def right(t, x_at, out_at, data_at):  # type: ignore[no-untyped-def]
        x, out = numba.carray(x_at, (2 * n,)), numba.carray(out_at, (2 * n,))
        data = numba.carray(data_at, (n * n + 2 * n + links + n * links,))
        damping, hold = data[: n * n], data[n * n : n * n + 2 * n]
        at_rest, by = data[n * n + 2 * n : n * n + 2 * n + links], data[n * n + 2 * n + links :]
        at = (t - start) * per_second
        k = min(max(int(at), 0), last)
        now = u[k] + (u[k + 1] - u[k]) * (at - k)
        d = np.empty(links)
        for i in range(links):
            d[i] = at_rest[i]
        for j in range(n):
            for i in range(links):
                d[i] += rows[j, i] * x[j]
        for i in range(links):
            d[i] = pull(d[i])
        for i in range(n):
            out[i] = rise[i] * x[n + i]
            total = hold[2 * i] + hold[2 * i + 1] * now
            for j in range(n):
                total += damping[j * n + i] * x[n + j]
            for link in range(links):
                total -= by[i * links + link] * d[link]
            out[n + i] = total

    return right


def exudyn(solver: str, step: float) -> Run:
    """Exudyn with a fixed step in ms; its model is built anew for each scene."""

    def run(of: Scatter) -> Peaks:
        peaks = []
        for scene, machine in enumerate(_machines(of)):
            loads = multibody.exudyn(solver, machine)(_problems(of)[scene])(step)()
            peaks.append(np.abs(loads).max(axis=0).ravel())
        return np.array(peaks)

    return run


@cache
def _machines(of: Scatter) -> list[Machine]:
    """Their descriptions, which are not part of the work."""
    return [of.machine_of(scene) for scene in range(len(of))]


@cache
def _problems(of: Scatter) -> list[Problem]:
    given = systems(of)
    return [given.problem(scene) for scene in range(len(of))]
