"""Checks of the histories of a motion, of forces and of a trace: stamps, shapes, finite numbers, ranges."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from guideload.base.arguments import real_array
from guideload.base.arrays import Array, check_finite
from guideload.base.errors import TraceError
from guideload.base.ranges import ACCELERATION, ANGULAR_SPEED, FORCE, MOMENT, POSITION, SPEED, TIME, TRAVEL

RANGES = {
    "time": TIME,
    "acceleration": ACCELERATION,
    "velocity": SPEED,
    "position": TRAVEL,
    "wrench": MOMENT,
    "motor_speed": ANGULAR_SPEED,
    "force": FORCE,
    "moment": MOMENT,
    "point": POSITION,
}


def checked_stamps(values: ArrayLike) -> Array:
    """Time stamps (n,) [s], n >= 2, not decreasing, at most two equal ones; a read-only copy. Raises TraceError."""
    time = checked_history("time", values, (np.size(values),))
    if time.size < 2:
        raise TraceError(f"time: expected at least 2 stamps, got {time.size}")
    steps = np.diff(time)
    back = np.flatnonzero(steps < 0.0)
    if back.size:
        at = int(back[0]) + 1
        raise TraceError(
            f"time[{at}]: expected at least {float(time[at - 1])!r} s, the stamp before it, "
            f"got {float(time[at])!r} ({back.size} such places)"
        )
    triple = np.flatnonzero((steps[1:] == 0.0) & (steps[:-1] == 0.0))
    if triple.size:
        at = int(triple[0])
        raise TraceError(f"time[{at}] to time[{at + 2}]: at most two equal stamps (a jump), got three")
    return time


def checked_history(name: str, values: ArrayLike, shape: tuple[int, ...]) -> Array:
    """A read-only float64 copy. Raises TraceError for another shape or numbers that are not finite or out of range."""
    array = real_array(name, values)
    if array.shape != shape:
        raise TraceError(f"{name}: expected shape {shape}, got {array.shape}")
    check_finite(name, array)
    _require_in_range(name, array)
    array.setflags(write=False)
    return array


def _require_in_range(name: str, array: Array) -> None:
    """Raise TraceError if a history that has a range has a value outside it."""
    within = RANGES.get(name)
    if within is None or not np.any(outside := np.abs(array) > within.most):
        return
    at = np.argwhere(outside)[0].tolist()
    hint = "no machine has this value: is the unit right?"
    found = f"expected {within.words} {within.unit}, got {array[outside][0]:g}"
    raise TraceError(f"{name}[{', '.join(map(str, at))}]: {found}; {hint}")
