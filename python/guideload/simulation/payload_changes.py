"""When payloads come and go: the stretches of a motion between their changes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError
from guideload.machine.machine import Machine
from guideload.machine.payloads import Payload, Place
from guideload.machine.stretches import Stretches
from guideload.motion.motion import Motion, with_stamps

NEAR_A_STAMP = 1e-9  # share of the time between two stamps
SIGNS = {"+x": 1.0, "-x": -1.0, "any": 0.0}


def with_changes(machine: Machine, motion: Motion) -> tuple[Motion, Stretches | None]:
    """The motion with two stamps at every change of payload, and the stretches between; None without payloads.

    Values at an added stamp are those of the motion there, which is linear between its stamps. Raises ArgumentError for
    a payload whose times are outside the motion, or whose places need the position of the cart, which it lacks.
    """
    if not machine.payloads:
        return motion, None
    start, end = float(motion.time[0]), float(motion.time[-1])
    stays = {payload.name: list(_stays(payload, motion)) for payload in machine.payloads}
    changes = {time for spans in stays.values() for span in spans for time in span if start < time < end}
    times = np.array(sorted(changes))
    motion = with_stamps(motion, times, times)
    first = (0, *(np.searchsorted(motion.time, times) + 1).tolist())
    began = [start, *times.tolist()]
    payloads = tuple(
        tuple(name for name, spans in stays.items() if any(a <= time < b for a, b in spans)) for time in began
    )
    return motion, Stretches(machine, payloads, first)


def _stays(payload: Payload, motion: Motion) -> Iterator[tuple[float, float]]:
    """From when to when a payload is on the machine [s]."""
    start, end = float(motion.time[0]), float(motion.time[-1])
    if payload.times is not None:
        for stay in payload.times:
            if stay[1] <= start or stay[0] >= end:
                raise ArgumentError(
                    f"payloads.{payload.name}.times: expected times within the motion, {start:g} to {end:g} s, "
                    f"got {stay[0]:g} to {stay[1]:g} s"
                )
            yield stay
        return
    assert payload.picked_at is not None
    if motion.position is None:
        raise ArgumentError(
            f"payloads.{payload.name}.picked_at: this motion has no position of the cart; give times instead"
        )
    place, began, found = motion.position[:, 0], start, False
    gripped = False
    goals = {False: payload.picked_at, True: payload.released_at}
    at = -np.inf
    while (goal := goals[gripped]) is not None:
        reached = _reached(motion.time, place, goal, at)
        if reached is None:
            break
        at = reached
        if gripped:
            yield began, at
        else:
            began, found = at, True
        gripped = not gripped
    if not found:
        goal = payload.picked_at
        raise ArgumentError(
            f"payloads.{payload.name}.picked_at: the cart never reaches x = {goal.x:g} m going {goal.travel}; "
            f"it travels from {place.min():g} to {place.max():g} m"
        )
    if gripped:
        yield began, np.inf


def _reached(time: Array, place: Array, goal: Place, after: float) -> float | None:
    """The first time after `after` [s] at which the cart reaches a place, linear between the stamps; None if never.

    At a place where the motion starts the cart is from the start, unless it leaves it against the direction of travel.
    """
    before, now = place[:-1] - goal.x, place[1:] - goal.x
    leaves = np.sign(now[now != 0.0][:1])
    if place[0] == goal.x and after < time[0] and not np.any(leaves * SIGNS[goal.travel] < 0.0):
        return float(time[0])
    up, down = (before < 0.0) & (now >= 0.0), (before > 0.0) & (now <= 0.0)
    crosses = {"+x": up, "-x": down, "any": up | down}[goal.travel]
    for k in np.flatnonzero(crosses).tolist():
        share = before[k] / (before[k] - now[k])
        whole = round(share)
        # A stamp that was added at the place itself is found again: its position is rounded.
        near = abs(share - whole) < NEAR_A_STAMP
        when = float(time[k + whole] if near else time[k] + share * (time[k + 1] - time[k]))
        if when > after:
            return when
    return None
