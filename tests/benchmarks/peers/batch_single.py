"""Scenes one after another: what packages offer that know one scene at a time."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from guideload import Machine
from peers import compiled, ivp, linear, multibody
from peers.diffsol import listed
from peers.problem import Array, Problem
from peers.scatter import Peaks, Run, Scatter, systems


def each(loads: Callable[[Problem], Array]) -> Run:
    """Set up all scenes at once, then the loads (time, carriage, 2) of one after another."""

    def run(of: Scatter) -> Peaks:
        given = systems(of)
        return np.array([np.abs(loads(given.problem(scene))).max(axis=0).ravel() for scene in range(len(of))])

    return run


lsim = each(lambda given: linear.lsim(given)(0.0))


def rk4(step: float) -> Run:
    """Classical RK4 in Numba with a fixed step in ms; the set-up is not counted: compiled, it would take no time."""

    def run(of: Scatter) -> Peaks:
        loads = (compiled.rk4(given)(step) for given in _problems(of))
        return np.array([np.abs(of_scene).max(axis=0).ravel() for of_scene in loads])

    return run


def solve_ivp(method: str, rtol: float) -> Run:
    """solve_ivp with its right-hand side in plain NumPy."""
    return each(lambda given: ivp.solve_ivp(given, method=method, limited=False, compiled=False)(rtol))


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


def exudyn(solver: str, step: float) -> Run:
    """Exudyn with a fixed step in ms; its model is built anew for each scene."""

    def run(of: Scatter) -> Peaks:
        peaks = []
        for scene, machine in enumerate(_machines(of)):
            loads = multibody.exudyn(_problems(of)[scene], solver=solver, machine=machine)(step)
            peaks.append(np.abs(loads).max(axis=0).ravel())
        return np.array(peaks)

    return run


@cache
def _machines(of: Scatter) -> list[Machine]:
    """Their descriptions, which are not part of the work."""
    return [of.machine_of(scene) for scene in range(len(of))]


@cache
def _problems(of: Scatter) -> list[Problem]:
    return [of.problem_of(scene) for scene in range(len(of))]
