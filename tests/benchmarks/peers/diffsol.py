"""pydiffsol: diffsol's solvers in Rust, equations compiled by LLVM."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import Any

import numpy as np

from peers.compiled import loads_of
from peers.laws import diffsl
from peers.problem import Array, At, Problem


def diffsol(given: Problem, *, solver: str) -> At:
    """A solver of pydiffsol: tsit45, bdf, tr_bdf2 or esdirk34. It has no largest step to set.

    Compiled once per motion because its table is part of the equations. Its one absolute tolerance needs
    states in units of their size. A sum over j takes in all terms of its line, hence `Au` and the others on
    lines of their own.
    """
    import pydiffsol

    given = given.scaled
    ode, loads, nothing = _equations(given), loads_of(given), np.empty(0)

    def at(rtol: float) -> Array:
        ode.ode_solver = getattr(pydiffsol, solver)
        ode.rtol = ode.atol = rtol
        return loads(ode.solve_dense(nothing, given.time).ys.T)

    return at


@cache
def _equations(given: Problem) -> Any:
    """The compiled equations, once for all solvers."""
    import pydiffsol

    n = given.b.size
    lines = [
        f"time_k {{ {listed(given.time)} }}",
        f"given_k {{ {listed(given.u)} }}",
        f"A_ij {{ {_entries(given.a)} }}",
        f"b_i {{ {listed(given.b)} }}",
    ]
    if given.law is not None:
        lines += [
            f"R_lj {{ {_entries(given.rows)} }}",
            f"rest_l {{ {listed(given.at_rest)} }}",
            f"B_il {{ {_entries(given.by)} }}",
            f"hold_i {{ {listed(given.constant)} }}",
        ]
    lines += [
        f"u_i {{ (0:{n}): 0.0 }}",
        "input { interp1d(time_k, given_k, t) }",
        "Au_i { A_ij * u_j }",
    ]
    if given.law is None:
        lines.append("F_i { Au_i + b_i * input }")
    else:
        lines += [
            "moved_l { R_lj * u_j }",
            "d_l { rest_l + moved_l }",
            f"force_l {{ {diffsl(given.law, 'd_l')} }}",
            "pull_i { B_il * force_l }",
            "F_i { Au_i + b_i * input + hold_i - pull_i }",
        ]
    return pydiffsol.Ode("\n".join(lines), matrix_type=pydiffsol.nalgebra_dense)


def listed(values: Iterable[float]) -> str:
    return ", ".join(repr(float(value)) for value in values)


def _entries(matrix: Array) -> str:
    """The nonzero entries of a matrix that has one in its last row and column, so that its size is told."""
    kept = [(i, j) for i, j in np.argwhere(matrix)]
    corner = (len(matrix) - 1, len(matrix[0]) - 1)
    if not matrix[corner]:
        kept.append(corner)
    return ", ".join(f"({i}, {j}): {float(matrix[i, j])!r}" for i, j in kept)
