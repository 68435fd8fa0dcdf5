"""Moves and standstills of a motion, found from its speed and acceleration."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from guideload.base.arrays import Array, Flags, find_runs

ROUNDING = 1e-12  # of the largest speed: what is slower stands
RESTING = 0.01  # of the largest speed: slower may be a standstill
PARTS = 5  # of a slow stretch; the quietest is in its standstill
STEADY = 0.01  # of the largest acceleration: its noise at rest; at a reversal without a pause it is larger
NORMAL = 1.4826  # standard deviation of normal noise over the median of its magnitude
LOUD = 5.0  # times the noise: more belongs to a move
FEWEST = 10  # instants of a standstill
ROLLING = 5e-6  # m: balls and rollers give way by some micrometres before they roll


class MoveSpan(NamedTuple):
    """When a move begins and ends, and when the standstill after it ends [s]."""

    start: float
    end: float
    until: float


def move_spans(time: Array, acceleration: Array, velocity: Array | None = None) -> list[MoveSpan]:
    """The moves between the standstills of a motion; one that ends without a standstill ends with the record.

    time: (n,) s. acceleration: (n, 3) m/s2. velocity: (n, 3) m/s; by default integrated from rest.
    A move ends with its last acceleration: the last one above the noise of the standstill that follows. Planned
    motions have no noise, so their moves end exactly.
    """
    if velocity is None:
        steps = 0.5 * np.diff(time)[:, None] * (acceleration[1:] + acceleration[:-1])
        velocity = np.vstack([np.zeros((1, acceleration.shape[1])), np.cumsum(steps, axis=0)])
    speed, rate = (np.linalg.norm(vectors, axis=1) for vectors in (velocity, acceleration))
    if not rate.any():
        return []
    slow = speed <= RESTING * speed.max()
    rests = [
        rest for ends in zip(*find_runs(slow), strict=True) if (rest := _standstill(rate, *map(int, ends)))
    ]
    last = time.size - 1
    ends = [(0, 0), *rests] if not rests or rests[0][0] > 0 else rests
    if not rests or rests[-1][1] < last:
        ends = [*ends, (last, last)]
    return [
        MoveSpan(float(time[here[1]]), float(time[there[0]]), float(time[there[1]]))
        for here, there in zip(ends, ends[1:], strict=False)
    ]


def is_moving(time: Array, acceleration: Array, velocity: Array) -> Flags:
    """Whether the cart moves along x at each instant (n,), not what the noise of an estimated speed looks like at rest.

    time: (n,) s. acceleration, velocity: (n, 3) m/s2, m/s.
    """
    speed, rate = velocity[:, 0], np.abs(acceleration[:, 0])
    size = np.abs(speed)
    moving: Flags = size > ROUNDING * size.max()
    place = np.append(0.0, np.cumsum(0.5 * np.diff(time) * (speed[1:] + speed[:-1])))
    stretches = [*zip(*find_runs(size <= RESTING * size.max()), strict=True)]
    while stretches:
        first, after = stretches.pop()
        quiet = _quietest_part(size, first, after)
        while quiet is not None and np.ptp(place[quiet]) > ROLLING:
            quiet = _quietest_part(size, quiet.start, quiet.stop)
        if quiet is None or not _is_steady(rate, quiet):
            continue
        near = np.abs(place[first:after] - place[quiet].mean()) <= ROLLING
        near |= size[first:after] <= LOUD * _rms(speed[quiet])  # the place of a measured speed drifts
        starts, ends = find_runs(near)
        here = np.searchsorted(starts, quiet.start - first, side="right") - 1
        rest = slice(first + starts[here], first + ends[here])
        # Noise has both signs again and again, and goes nowhere. What creeps has one for long, as have starts and stops
        # of planned motions.
        turns = np.count_nonzero(np.diff(np.sign(speed[rest][moving[rest]])))
        if turns > 1 and np.ptp(place[rest]) <= 2.0 * ROLLING * turns:
            moving[rest] = False
            stretches += [(first, rest.start), (rest.stop, after)]
    return moving


def _quietest_part(size: Array, first: int, after: int) -> slice | None:
    """The part of a slow stretch in which a magnitude (n,) is least; None if the stretch is too short for a standstill.

    first, after: ends of the stretch, as in a slice.
    """
    if after - first < FEWEST:
        return None
    edges = np.linspace(first, after, PARTS + 1).astype(np.intp)
    return min(
        (slice(*ends) for ends in zip(edges, edges[1:], strict=False)), key=lambda part: _rms(size[part])
    )


def _is_steady(rate: Array, part: slice) -> bool:
    """Whether the acceleration, of magnitude (n,), is small enough there for a standstill."""
    return _rms(rate[part]) <= STEADY * float(rate.max())


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _standstill(rate: Array, first: int, after: int) -> tuple[int, int] | None:
    """First and last instant of the standstill in a slow stretch, around its quietest part; None if there is none."""
    quietest = _quietest_part(rate, first, after)
    if quietest is None or not _is_steady(rate, quietest):
        return None
    noise = NORMAL * float(np.median(rate[first:after])) if rate[quietest].any() else 0.0
    loud = first + np.flatnonzero(rate[first:after] > LOUD * noise)
    middle = (quietest.start + quietest.stop) // 2
    before, behind = loud[loud < middle], loud[loud > middle]
    # Nothing moves before the first or after the last move of a record: what is loud there is an end of its smoothing.
    begin = int(before[-1]) + 1 if before.size and first > 0 else first
    end = int(behind[0]) - 1 if behind.size and after < rate.size else after - 1
    return begin, end
