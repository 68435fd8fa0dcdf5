"""Jerk-limited moves there and back, known exactly at every instant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

Array = NDArray[np.float64]


def integrals(time: Array, acceleration: Array) -> tuple[PPoly, PPoly, PPoly]:
    """Position, velocity and acceleration at any time, from rest at 0, of an acceleration that is linear in between."""
    line = PPoly([np.diff(acceleration) / np.diff(time), acceleration[:-1]], time)
    return line.antiderivative(2), line.antiderivative(), line


@dataclass(frozen=True)
class Move:
    """Speed up, cruise and slow down, wait, and the same backwards; at rest before and after."""

    speed: float  # m/s
    acceleration: float  # m/s2
    jerk: float  # m/s3
    dwell: float = 0.6  # s
    cruise: float = 1.0  # s

    def corners(self) -> tuple[Array, Array]:
        """Times [s] and accelerations [m/s2] of the corners of the acceleration, which is linear between them."""
        ramp = self.acceleration / self.jerk
        hold = self.speed / self.acceleration - ramp
        up = [(ramp, 1.0), (hold, 1.0), (ramp, 0.0)]
        down = [(ramp, -1.0), (hold, -1.0), (ramp, 0.0)]
        there = [*up, (self.cruise, 0.0), *down]
        back = [(length, -sign) for length, sign in there]
        rest = (self.dwell, 0.0)
        lengths, signs = np.array([(0.0, 0.0), rest, *there, rest, *back, rest]).T
        return np.cumsum(lengths), self.acceleration * signs

    def motion(self, time: Array) -> tuple[Array, Array, Array]:
        """Position [m], velocity [m/s] and acceleration [m/s2] at the times [s], exactly."""
        knots, heights = self.corners()
        until_end = np.minimum(time, knots[-1])
        position, velocity, acceleration = (of(until_end) for of in integrals(knots, heights))
        return position, velocity, acceleration

    def times(self, rate: float) -> Array:
        """Stamps [s] from 0 to the end at a rate [Hz]."""
        samples: Array = np.arange(int(self.corners()[0][-1] * rate) + 1) / rate
        return samples


GENTLE = Move(speed=1.6, acceleration=2.2, jerk=25.0)  # ramps of 88 ms: vibration stays small
BRISK = Move(
    speed=1.6, acceleration=4.0, jerk=500.0
)  # ramps of 8 ms: the modes of a machine ring; the packaged example
