"""The state in which a run starts: at rest, or in the quasi-static state of a motion that is already under way."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from guideload._core import load_spread
from guideload.base.arrays import Array, Integers
from guideload.base.errors import ArgumentError
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.motion.uncertainty import COVER

Start = Literal["auto", "rest", "quasi-static"]
StartState = Literal["rest", "quasi-static"]
# First acceleration or load, over the largest one, that is no motion under way. Started at rest, its vibration adds at
# most twice as much to the dynamic loads, which is less than the stiffness of a guide is known to.
NEGLIGIBLE = 0.01


def start_of(machine: Machine, motion: Motion, start: str) -> StartState:
    """The start of a run: as asked for; for auto rest if the motion begins at standstill, else quasi-static.

    Only a record may begin under way: planned moves, and motions given by arrays, begin at standstill, with a step if
    their first acceleration is not zero. A record begins at standstill if its first acceleration and its first external
    load are zero, negligible beside the largest ones, or, for an acceleration with an uncertainty, zero within its 95 %
    credible band. Raises ArgumentError.
    """
    if start not in get_args(Start):
        raise ArgumentError(f"start: expected one of {', '.join(get_args(Start))}, got {start!r}")
    if start == "auto":
        return "rest" if _begins_at_standstill(machine, motion) else "quasi-static"
    return "rest" if start == "rest" else "quasi-static"


def _begins_at_standstill(machine: Machine, motion: Motion) -> bool:
    if not motion.recorded:
        return True
    if motion.wrench is not None:
        for part in (motion.wrench[:, :3], motion.wrench[:, 3:]):
            if not _is_negligible(part):
                return False
    if _is_negligible(motion.acceleration):
        return True
    if motion.uncertainty is None or motion.acceleration[0, 1:].any():
        return False
    return bool(abs(motion.acceleration[0, 0]) <= COVER * _first_deviation(machine, motion))


def _is_negligible(vectors: Array) -> bool:
    """Whether the first of vectors (n, 3) is negligible beside the largest."""
    size = np.linalg.norm(vectors[0])
    # Not `np.linalg.norm`, which takes a third of the time of a run.
    return bool(size == 0.0 or size <= NEGLIGIBLE * np.sqrt(np.einsum("ij,ij->i", vectors, vectors).max()))


def _first_deviation(machine: Machine, motion: Motion) -> float:
    """Standard deviation [m/s2] of the first acceleration along x."""
    assert motion.uncertainty is not None
    deviation = motion.uncertainty.for_core(motion.time)
    no_groups: tuple[Array, list[Integers], Array] = np.zeros((1, 0, 6)), [], np.zeros((0, 3))
    return float(load_spread(machine.nominal_scene, *deviation, motion.time[:1], *no_groups)[0][0])
