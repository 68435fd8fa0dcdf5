"""More instants in a run whose motion has too few stamps for the vibration of the machine.

From six instants per period of a vibration on, the core finds its extremes between them too.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from guideload.machine.machine import Machine
from guideload.machine.stretches import Stretches
from guideload.motion.motion import Motion
from guideload.motion.refinement import refined

STEP = 1.05  # rad of the fastest vibration, from one instant to the next
# Of the shortest interval: a vibration that is faster still is hardly excited by a motion with such stamps.
MOST_PARTS = 25
MOST_INSTANTS = 1_000_000
FREE_INSTANTS = 100_000  # so many never take long, however few stamps the motion has


def with_enough_instants(
    machine: Machine, motion: Motion, stretches: Stretches | None = None
) -> tuple[Motion, Stretches | None]:
    """The motion with six stamps or more per period of the fastest vibration, and the stretches of its payloads.

    It is the same motion: acceleration and process forces are linear between the stamps anyway. Parts are not shorter
    than the shortest interval over `MOST_PARTS`, and all together are not more than `parts_of` allows.
    """
    fastest = fastest_vibration(machine)
    return with_parts(motion, stretches, parts_of(motion, STEP / fastest if fastest else np.inf))


def fastest_vibration(machine: Machine) -> float:
    """Angular frequency of the fastest vibration [rad/s]; 0 if nothing vibrates."""
    return float(np.abs(machine.scene.modes()[3].imag).max(initial=0.0))


def parts_of(motion: Motion, step: float, most: int = MOST_INSTANTS) -> NDArray[np.int64]:
    """Number of parts of each interval between stamps, (n - 1,), so that parts are not longer than a step [s].

    Of more than `most` parts, or than `FREE_INSTANTS` and `MOST_PARTS` per interval, the longest intervals have fewer.
    """
    intervals = np.diff(motion.time)
    shortest = float(intervals.min(initial=np.inf, where=intervals > 0.0))
    wanted = np.ceil(intervals / max(step, shortest / MOST_PARTS) * (1.0 - 1e-9))
    parts = np.clip(wanted, 1, most).astype(np.int64)
    room = max(parts.size, min(most, max(FREE_INSTANTS, MOST_PARTS * parts.size)))
    if parts.sum() <= room:
        return parts
    ascending = np.sort(parts)
    before = np.cumsum(ascending) - ascending
    limits = (room - before) // np.arange(
        parts.size, 0, -1
    )  # if this interval and those after it have equally many
    most_each = int(limits[np.argmax(limits < ascending)])
    return np.asarray(np.minimum(parts, most_each))


def with_parts(
    motion: Motion, stretches: Stretches | None, parts: NDArray[np.int64]
) -> tuple[Motion, Stretches | None]:
    """The motion with so many parts of each interval, and the stretches of its payloads."""
    if parts.max() == 1:
        return motion, stretches
    if stretches is not None:
        places = np.append(0, np.cumsum(parts))
        stretches = replace(stretches, first=tuple(places[list(stretches.first)].tolist()))
    return refined(motion, parts), stretches
