"""Derivatives in 50 digits: central differences of the precise reference, with steps of 1e-20 of a value.

With 70 digits the difference loses 20 of them, and its error is 1e-40 of the third derivative.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Any

import mpmath
import numpy as np
import reference
from numpy.typing import NDArray
from reference import DIGITS, precise

from guideload import Machine, Motion
from guideload.sensitivity import RunDerivatives, VariedMachine

Compute = Callable[[Machine, Motion], dict[str, Any]]
STEP = mpmath.mpf(10) ** -20
SIZE_OF_ZERO = 0.1  # of a value that is 0, in its SI unit
PART = re.compile(r'(rails|carriages|links)\["?([^"]+?)"?\]\.(.+)')


def with_value(machine: Machine, path: str, value: Any) -> Machine:
    """The machine with a number of any precision at a path, unchecked."""
    match = PART.fullmatch(path)
    if match is None:
        table, _, key = path.partition(".")
        if table == "gravity":
            return _unchecked(machine, "gravity", _with(machine.gravity, "xyz".index(key), value))
        return _unchecked(machine, "body", _with_key(machine.body, key, value))
    kind, name, key = match.groups()
    parts = [_with_key(one, key, value) if one.name == name else one for one in getattr(machine, kind)]
    return _unchecked(machine, kind, tuple(parts))


def histories_of(run: RunDerivatives) -> dict[str, NDArray[np.float64]]:
    """The derivatives (p, ...) of a run, by the names of the histories of `differences`."""
    return {
        "link_load": run.history("link_loads"),
        "link_load_damping": run.history("link_loads", "damping"),
        "carriage": run.history("carriage_loads"),
        "reaction": run.history("reaction"),
        "displacement": run.history("displacement"),
        "velocity": run.history("velocity"),
        "acceleration": run.history("acceleration"),
    }


def central_differences(
    varied: VariedMachine, compute: Callable[[NDArray[np.float64]], Sequence[Any]], relative: float
) -> list[NDArray[np.float64]]:
    """Derivatives (p, ...) of arrays that `compute` gives at values of the columns, by steps relative to each."""
    found = []
    for k, value in enumerate(varied.values):
        step = relative * (abs(value) or 1.0)
        change = step * np.eye(varied.values.size)[k]
        high, low = (compute(varied.values + side * change) for side in (1.0, -1.0))
        found.append([(a - b) / (2.0 * step) for a, b in zip(high, low, strict=True)])
    return [np.array(of) for of in zip(*found, strict=True)]


def assert_near(
    mine: NDArray[np.float64], wanted: NDArray[np.float64], rtol: float, atol: float = 0.0
) -> None:
    """Whether derivatives (p, ...) agree to a share of the largest one by each column."""
    for one, other in zip(mine, wanted, strict=True):
        assert np.abs(one - other).max() <= rtol * max(np.abs(other).max(), atol)


def _unchecked(part: Any, key: str, value: Any) -> Any:
    """A copy with another value, which the model would round to a float."""
    fields = {name: getattr(part, name) for name in type(part).model_fields} | {key: value}
    return type(part).model_construct(**fields)


def _with_key(part: Any, key: str, value: Any) -> Any:
    key, _, axes = key.partition(".")
    old = getattr(part, key)
    if key == "inertia":
        i, j = map("xyz".index, axes)
        rows = [list(row) for row in old]
        rows[i][j] = rows[j][i] = value
        return _unchecked(part, key, rows)
    if hasattr(old, axes):
        value = _unchecked(old, axes, value)
    elif axes:
        value = _with(old, ("yz" if len(old) == 2 else "xyz").index(axes), value)
    return _unchecked(part, key, value)


def _with(values: Any, index: int, value: Any) -> list[Any]:
    return [value if i == index else old for i, old in enumerate(values)]


def differences(
    machine: Machine, motion: Motion, path: str, value: float, compute: Compute = precise
) -> dict[str, NDArray[np.float64]]:
    """The derivative of every field that `compute` gives by the value at a path, rounded once to float64."""
    with mpmath.workdps(DIGITS):
        step = STEP * (abs(mpmath.mpf(value)) or SIZE_OF_ZERO)
        ends = [mpmath.mpf(value) + sign * step for sign in (1, -1)]
        high, low = (compute(with_value(machine, path, end), motion) for end in ends)
        found = {name: (_flat(high[name]) - _flat(low[name])) / (2 * step) for name in high if name != "time"}
        shapes = {name: np.array(values, dtype=object).shape for name, values in low.items()}
        return {name: np.array(of.astype(float)).reshape(shapes[name]) for name, of in found.items()}


def _flat(values: Any) -> Any:
    return np.array([mpmath.mpf(x) for x in np.array(values, dtype=object).ravel()], dtype=object)


def at_rest() -> Motion:
    """A motion of two samples with next to no acceleration: for static quantities."""
    return Motion.along_x([0.0, 1e-3], [0.0, 1e-9])


def matrices_of(machine: Machine, all_dofs: bool = False) -> tuple[Any, Any, Any]:
    """M, C, K of the free dofs, or of all, as matrices of mpmath in its present precision."""
    _, *matrices, _ = reference.assembled(mpmath.mp, machine)
    dofs = [i for i, dof in enumerate(reference.DOFS) if all_dofs or dof in machine.free]
    m, c, k = (mpmath.matrix([[of[i][j] for j in dofs] for i in dofs]) for of in matrices)
    return m, c, k
