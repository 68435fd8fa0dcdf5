"""Motion profiles: the acceleration of a move from rest to rest, as short as its limits and its profile allow.

A move accelerates, keeps its speed and decelerates. While it accelerates, the acceleration is symmetric about the
middle of that time, so the distance is half of the time times the speed reached; so too while it decelerates. A
trapezoid of the velocity is the jerk-limited profile with infinite jerk.
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass
from functools import lru_cache
from typing import Literal

import numpy as np

from guideload.base.arrays import Array

Profile = Literal["jerk limited", "trapezoid", "sine squared", "polynomial 5"]
# Straight lines in place of each curve of the smooth profiles.
LINES = 512
# Largest deviation of these lines from the curve, over its peak: lines of length h deviate by h^2/8 of the curvature.
DEVIATION: dict[Profile, float] = {
    "sine squared": (math.pi / LINES) ** 2 / 4.0,
    "polynomial 5": 360.0 / (8.0 * LINES**2) / (10.0 / math.sqrt(3.0)),
}
WIDEST = 1e12  # times the limits that follow from the time of a move: as good as none
IN_TIME = 1.0 + 1e-12  # rounding of a time


@dataclass(frozen=True)
class Limits:
    """What a move may reach, in m/s, m/s2, m/s2 and m/s3; inf: not limited."""

    profile: Profile
    speed: float
    acceleration: float
    deceleration: float
    jerk: float


@dataclass(frozen=True, eq=False)
class Pieces:
    """Acceleration of a move that is linear within each piece.

    length      (k,) s, all above 0
    start, end  (k,) m/s2, acceleration at the start and at the end of the piece
    """

    length: Array
    start: Array
    end: Array

    @property
    def time(self) -> float:
        """Duration [s]."""
        return float(self.length.sum())

    @property
    def jerk(self) -> float:
        """Largest jerk within a piece [m/s3]."""
        return float(np.abs((self.end - self.start) / self.length).max())

    def speeds(self) -> Array:
        """Speed [m/s] at the start of each piece, and at the end: (k + 1,)."""
        return np.append(0.0, np.cumsum(0.5 * self.length * (self.start + self.end)))

    def distances(self) -> Array:
        """Distance [m] travelled at the start of each piece, and at the end: (k + 1,)."""
        gains = self.length * (self.speeds()[:-1] + self.length * (2.0 * self.start + self.end) / 6.0)
        return np.append(0.0, np.cumsum(gains))


def limits_of_time(distance: float, time: float, profile: Profile, most: float) -> Limits:
    """Limits under which the fastest move takes `time` [s], where none but the speed is stated: `most` [m/s], or inf.

    Speeding up, constant speed and braking take a third of the time each; if that is too fast, the speed is `most`. A
    jerk-limited ramp changes its acceleration for a quarter of its time at both ends. The polynomial has no such
    choice: its limits are wide.
    """
    speed = min(1.5 * distance / time, most)
    ramp = time - distance / speed
    if not ramp > 0.0:  # too slow: the fastest move takes longer
        ramp = time / 3.0
    if profile == "polynomial 5":
        wide = 20.0 * distance / time**2
        return Limits(profile, min(2.0 * distance / time, most), wide, wide, math.inf)
    acceleration = {"jerk limited": 4.0 / 3.0, "trapezoid": 1.0, "sine squared": 2.0}[profile] * speed / ramp
    jerk = 4.0 * acceleration / ramp if profile == "jerk limited" else math.inf
    return Limits(profile, speed, acceleration, acceleration, jerk)


@lru_cache(maxsize=256)
def move_in_time(distance: float, time: float, stated: Limits) -> Pieces:
    """The move over `distance` [m] > 0 in `time` [s] under the stated limits; a longer one if these are too low.

    Limits that are inf follow from the time. If the fastest move takes longer, they are raised by one factor, the
    smallest with which it does not.
    """
    follow = limits_of_time(distance, time, stated.profile, stated.speed)

    def fastest(factor: float) -> Pieces:
        values = (
            own if own < math.inf else factor * derived
            for own, derived in zip(astuple(stated)[1:], astuple(follow)[1:], strict=True)
        )
        return fastest_move(distance, Limits(stated.profile, *values))

    def in_time(factor: float) -> bool:
        return fastest(factor).time <= time * IN_TIME

    factor = 1.0
    if not in_time(factor):
        low, factor = factor, WIDEST
        if not in_time(factor):
            return fastest(factor)
        while low < (middle := 0.5 * (low + factor)) < factor:  # bisection to the last bit
            low, factor = (low, middle) if in_time(middle) else (middle, factor)
    return slowed(fastest(factor), time)


def slowed(pieces: Pieces, time: float) -> Pieces:
    """The same move in another time [s], over the same distance."""
    factor = time / pieces.time
    return Pieces(factor * pieces.length, pieces.start / factor**2, pieces.end / factor**2)


@lru_cache(maxsize=256)
def fastest_move(distance: float, limits: Limits) -> Pieces:
    """The move from rest to rest over `distance` [m] > 0 in the shortest time that its limits and its profile allow."""
    if limits.profile == "polynomial 5":
        return _polynomial(distance, limits)

    def travel(speed: float) -> float:
        return 0.5 * speed * (up.duration(speed) + down.duration(speed))

    up, down = (Ramp(limits, most) for most in (limits.acceleration, limits.deceleration))
    speed = limits.speed
    cruise = distance - travel(speed)
    if cruise < 0.0:  # the limit of the speed is not reached: bisection to the last bit
        low, high, cruise = 0.0, speed, 0.0
        while low < (speed := 0.5 * (low + high)) < high:
            low, high = (speed, high) if travel(speed) < distance else (low, speed)
    constant = np.array([cruise / speed]), np.zeros(1), np.zeros(1)
    length, start, end = (
        np.concatenate(parts) for parts in zip(up.pieces(speed), constant, down.pieces(-speed), strict=True)
    )
    kept = length > 0.0
    return Pieces(length[kept], start[kept], end[kept])


@dataclass(frozen=True)
class Ramp:
    """The part of a move from rest to a speed, or back, under a largest acceleration `most` [m/s2]."""

    limits: Limits
    most: float

    def duration(self, speed: float) -> float:
        """Shortest time [s] to a speed [m/s]."""
        jerk = self.limits.jerk
        if self.limits.profile == "sine squared":
            # Mean acceleration most / 2, largest jerk pi most / duration.
            return max(2.0 * speed / self.most, math.sqrt(2.0 * math.pi * speed / jerk))
        if speed * jerk >= self.most**2:
            return speed / self.most + self.most / jerk
        return 2.0 * math.sqrt(speed / jerk)

    def pieces(self, change: float) -> tuple[Array, Array, Array]:
        """Lengths [s], accelerations [m/s2] at start and end of the pieces, for a change of the speed [m/s]."""
        speed, jerk = abs(change), self.limits.jerk
        duration, sign = self.duration(speed), math.copysign(1.0, change)
        if self.limits.profile == "sine squared":
            heights = 2.0 * change / duration * np.sin(np.pi * np.linspace(0.0, 1.0, LINES + 1)) ** 2
            heights[-1] = 0.0
            return np.full(LINES, duration / LINES), heights[:-1], heights[1:]
        peak = min(self.most, math.sqrt(speed * jerk))
        rise = peak / jerk
        lengths = np.array([rise, max(speed / peak - rise, 0.0), rise])
        return lengths, sign * peak * np.array([0.0, 1.0, 1.0]), sign * peak * np.array([1.0, 1.0, 0.0])


def _polynomial(distance: float, limits: Limits) -> Pieces:
    """x = d (10 s^3 - 15 s^4 + 6 s^5) over the whole move; the lines are scaled so that their distance is exact."""
    s = np.linspace(0.0, 1.0, LINES + 1)
    shape = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)
    unit = Pieces(np.full(LINES, 1.0 / LINES), shape[:-1], shape[1:])
    scale = distance / float(unit.distances()[-1])
    duration = max(  # by the largest speed, acceleration and jerk of the polynomial itself
        15.0 / 8.0 * scale / limits.speed,
        math.sqrt(10.0 / math.sqrt(3.0) * scale / min(limits.acceleration, limits.deceleration)),
        (60.0 * scale / limits.jerk) ** (1.0 / 3.0),
    )
    heights = scale / duration**2 * shape
    return Pieces(np.full(LINES, duration / LINES), heights[:-1], heights[1:])
