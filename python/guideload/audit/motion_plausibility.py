"""Plausibility of a motion and of a life: figures that no machine on guides has suggest a mistaken unit."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from guideload.audit.plausibility import machine_warnings
from guideload.base.arrays import Array
from guideload.base.number_text import digits, number
from guideload.base.warnings import LIMITS, WarningText
from guideload.machine.machine import Machine
from guideload.motion.consistency import motion_texts
from guideload.motion.motion import Motion
from guideload.motion.resolution import TraceResolution

STANDSTILL = 0.01  # of the top speed: the cart stops or turns below it
STILL = 1e-3  # m: of a shorter travel, as of a cart that is held, accelerations may be as small as they like


def input_warnings(machine: Machine, motion: Motion | None, question: str = "") -> list[str]:
    """The warnings of what a computation starts from: of motion and machine, and of both together.

    The audit of a run has them too. Commands that show no audit begin their report with these. question: see
    `plausible_motion`.
    """
    found = [] if motion is None else motion_warnings(motion, machine, question)
    return [*found, *machine_warnings(machine)]


def motion_warnings(
    motion: Motion, machine: Machine | None = None, question: str = ""
) -> list[WarningText | str]:
    """The warnings of a motion by itself, from its figures and its reading, and of what it may hide from a machine."""
    figures = plausible_motion(
        motion.time, motion.acceleration, motion.velocity, motion.position, motion.source, question
    )
    resolution = None if machine is None else TraceResolution.of_motion(machine, motion)
    return [*figures, *motion_texts(motion, machine), *resolution_warnings(resolution)]


def plausible_motion(
    time: Array,
    acceleration: Array,
    velocity: Array | None,
    position: Array | None,
    source: str,
    question: str = "",
) -> Iterator[WarningText]:
    """On speed, acceleration, travel and duration of moves.

    time: (n,) s. acceleration, velocity, position: (n, 3) m/s2, m/s, m, of the cart. source: where they come from.
    question: at the end of each sentence, in place of those about the units of what was read.
    """
    speed = 0.0 if velocity is None else float(np.abs(velocity).max())
    travel = 0.0 if position is None else float(np.ptp(position, axis=0).max())
    largest = float(np.abs(acceleration).max())
    longest = 0.0 if velocity is None else longest_move(time, velocity[:, 0])
    where = f"{source}: " if source else ""
    is_trace = ", column " in source
    length = "the column" if is_trace else "a length or a speed"
    unit, time_unit = (" (--unit mm or mm/s)", " (--time-unit ms)") if is_trace else ("", "")
    in_reach = is_trace and position is not None and LIMITS["travel"].holds(travel)
    quick = "is the time in s, but read in ms (--time-unit s)?" if in_reach else f"is {length} in mm{unit}?"
    slow = f"is the time in ms{time_unit}, or a speed in m/min?"
    for key, value, words in (
        ("travel", travel, f"the cart moves over {digits(travel)} m"),
        ("speed", speed, f"the cart reaches {digits(speed)} m/s"),
        ("acceleration", largest, f"the acceleration reaches {digits(largest)} m/s2"),
        ("time of a move", longest, f"a move lasts {digits(longest)} s without a stop or a turn"),
    ):
        limit = LIMITS[key]
        below = value < limit.least
        if value and not limit.holds(value) and not (below and travel < STILL):
            beyond = f"below {number(limit.least)}" if below else f"beyond {number(limit.most)}"
            asked = question or (slow if below or key == "time of a move" else quick)
            yield WarningText(key, f"Warning: {where}{words}, {beyond} {limit.unit}: {asked}")


def longest_move(time: Array, velocity: Array) -> float:
    """Longest time [s] in one direction above `STANDSTILL`. time: (n,) s; velocity: (n,) m/s."""
    direction = np.sign(velocity) * (np.abs(velocity) > STANDSTILL * np.abs(velocity).max())
    edges = np.flatnonzero(np.diff(direction, prepend=2.0, append=2.0))
    runs = zip(edges[:-1], edges[1:], strict=True)
    return max((float(time[end - 1] - time[start]) for start, end in runs if direction[start]), default=0.0)


def resolution_warnings(resolution: TraceResolution | None) -> list[WarningText]:
    """The load that a trace may hide from a machine; see `TraceResolution.warnings`."""
    return [] if resolution is None else [*resolution.warnings()]


def life_warnings(hours: float) -> Iterator[WarningText]:
    """On a life [h] at the stated duty."""
    limit = LIMITS["life"]
    if not limit.holds(hours):
        least, most = f"below {number(limit.least)} h", f"beyond {number(limit.most)} h, a century of work"
        yield WarningText(
            "life",
            f"Warning: the life is {digits(hours)} h, {least if hours < limit.least else most}: are the load ratings "
            'in N, as in "26.5 kN", the mass in kg, and the motion in m and s?',
        )
