"""More instants in a run whose motion has too few stamps for the vibration of the machine.

From six instants per period of a vibration on, the core finds its extremes between them too.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from guideload.base.arrays import Array, Integers
from guideload.machine.machine import Machine
from guideload.machine.stretches import Stretches
from guideload.motion.motion import Motion, refined, with_instants

STEP = 1.05  # rad of the fastest vibration, from one instant to the next
# Parts of the shortest interval: a motion without jumps hardly excites a vibration that is faster still.
MOST_PARTS = 25
MOST_INSTANTS = 1_000_000
FREE_INSTANTS = 100_000  # so many never take long, however few stamps the motion has


def with_enough_instants(motion: Motion, fastest: float) -> Motion:
    """The motion with six stamps or more per period of the fastest vibration [rad/s].

    It is the same motion: acceleration and process forces are linear between the stamps anyway.
    """
    return with_parts(motion, None, enough_parts(motion, fastest))[0]


def excitation_with_enough_instants(
    machine: Machine, motion: Motion, stretches: Stretches | None
) -> tuple[Motion, Stretches | None]:
    """The same for a machine, without the histories that do not act on the body if instants are added.

    Also the stretches of its payloads.
    """
    parts = enough_parts(motion, fastest_vibration(machine))
    return with_parts(motion if parts.max() == 1 else motion.excitation, stretches, parts)


def enough_parts(motion: Motion, fastest: float) -> Integers:
    """Parts of each interval (n - 1,), so that there are six stamps or more per period of the fastest vibration.

    Of a motion without jumps, parts are not shorter than the shortest interval over `MOST_PARTS`.
    """
    intervals = np.diff(motion.time)
    if fastest * intervals.max(initial=0.0) <= STEP:
        return np.ones(intervals.size, np.int64)
    shortest = float(intervals.min(initial=np.inf, where=intervals > 0.0))
    step = max(STEP / fastest if fastest else np.inf, 0.0 if _jumps(motion) else shortest / MOST_PARTS)
    wanted = np.clip(np.ceil(intervals / step * (1.0 - 1e-9)), 1, MOST_INSTANTS).astype(np.int64)
    # An interval for which all instants would not do is one of rest, or of a vibration that nobody resolves.
    wanted[wanted > FREE_INSTANTS] = MOST_PARTS
    room = min(MOST_INSTANTS, max(FREE_INSTANTS, MOST_PARTS * wanted.size))
    return limited(wanted, room)


def fastest_vibration(machine: Machine) -> float:
    """Angular frequency of the fastest vibration [rad/s]; 0 if nothing vibrates."""
    return float(np.abs(machine.scene.modes()[3].imag).max(initial=0.0))


def slowest_vibration(machine: Machine) -> float:
    """Angular frequency of the slowest vibration [rad/s]; 0 if nothing vibrates."""
    values = np.abs(machine.scene.modes()[3].imag)
    return float(values[values > 0.0].min()) if values.any() else 0.0


def _jumps(motion: Motion) -> bool:
    """Whether the excitation may jump, at two equal stamps or the start, and so excite a vibration of any frequency."""
    starts = bool(motion.acceleration[0].any()) or (
        motion.wrench is not None and bool(motion.wrench[0].any())
    )
    return starts or bool((np.diff(motion.time) == 0.0).any())


def limited(parts: Integers, most: int) -> Integers:
    """The numbers of parts of intervals, the largest of them reduced to the same one so that all are at most `most`."""
    room = max(parts.size, most)
    if parts.sum() <= room:
        return parts
    ascending = np.sort(parts)
    before = np.cumsum(ascending) - ascending
    # If this interval and those after it have equally many.
    limits = (room - before) // np.arange(parts.size, 0, -1)
    most_each = int(limits[np.argmax(limits < ascending)])
    return np.asarray(np.minimum(parts, most_each))


def with_parts(
    motion: Motion, stretches: Stretches | None, parts: Integers
) -> tuple[Motion, Stretches | None]:
    """The motion with so many parts of each interval, and the stretches of its payloads."""
    if parts.max() == 1:
        return motion, stretches
    if stretches is not None:
        places = np.append(0, np.cumsum(parts))
        stretches = replace(stretches, first=tuple(places[list(stretches.first)].tolist()))
    return refined(motion, parts), stretches


def with_more_instants(
    motion: Motion, stretches: Stretches | None, times: Array
) -> tuple[Motion, Stretches | None]:
    """The motion with stamps at these times [s] too, within the motion, and the stretches of its payloads."""
    if stretches is not None:
        first = np.array(stretches.first)
        new = np.setdiff1d(times, motion.time)
        first += np.searchsorted(new, motion.time[first])
        stretches = replace(stretches, first=tuple(first.tolist()))
    return with_instants(motion, times), stretches
