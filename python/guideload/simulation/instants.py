"""More instants in a run whose motion has too few stamps for the vibration of the machine.

From six instants per period of a vibration on, the core finds its extremes between them too.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from guideload._core import enough_parts
from guideload.base.arrays import Array, Integers
from guideload.machine.machine import Machine
from guideload.machine.stretches import Stretches
from guideload.motion.motion import Motion, refined, with_instants

STEP = 1.05  # rad of the fastest vibration, from one instant to the next
MOST_INSTANTS = 1_000_000


def with_enough_instants(motion: Motion, fastest: float) -> Motion:
    """The motion with six stamps or more per period of the fastest vibration [rad/s].

    It is the same motion: acceleration and process forces are linear between the stamps anyway.
    """
    return with_parts(motion, None, _parts(motion, fastest))[0]


def excitation_with_enough_instants(
    machine: Machine, motion: Motion, stretches: Stretches | None
) -> tuple[Motion, Stretches | None]:
    """The same for a machine, without the histories that do not act on the body if instants are added.

    Also the stretches of its payloads.
    """
    parts = _parts(motion, fastest_vibration(machine))
    return with_parts(motion if parts.max() == 1 else motion.excitation, stretches, parts)


def _parts(motion: Motion, fastest: float) -> Integers:
    """Parts of each interval (n - 1,), so that there are six stamps or more per period of the fastest vibration."""
    starts = motion.acceleration[0].any() or (motion.wrench is not None and motion.wrench[0].any())
    return enough_parts(np.diff(motion.time), bool(starts), fastest)


def fastest_vibration(machine: Machine) -> float:
    """Angular frequency of the fastest vibration [rad/s]; 0 if nothing vibrates."""
    return float(np.abs(machine.scene.modes()[3].imag).max(initial=0.0))


def slowest_vibration(machine: Machine) -> float:
    """Angular frequency of the slowest vibration [rad/s]; 0 if nothing vibrates."""
    values = np.abs(machine.scene.modes()[3].imag)
    return float(values[values > 0.0].min()) if values.any() else 0.0


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
