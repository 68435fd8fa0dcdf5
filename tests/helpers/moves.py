"""Jerk-limited moves there and back, known exactly at every instant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


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
        knots, height = self.corners()
        lengths = np.diff(knots)
        slope = np.diff(height) / lengths
        gain = height[:-1] * lengths + slope * lengths**2 / 2.0
        speed = np.concatenate([[0.0], np.cumsum(gain)])
        step = speed[:-1] * lengths + height[:-1] * lengths**2 / 2.0 + slope * lengths**3 / 6.0
        place = np.concatenate([[0.0], np.cumsum(step)])
        piece = np.clip(np.searchsorted(knots, time, side="right") - 1, 0, lengths.size - 1)
        since = np.minimum(time, knots[-1]) - knots[piece]
        acceleration = height[piece] + slope[piece] * since
        velocity = speed[piece] + height[piece] * since + slope[piece] * since**2 / 2.0
        position = (
            place[piece]
            + speed[piece] * since
            + height[piece] * since**2 / 2.0
            + slope[piece] * since**3 / 6.0
        )
        return position, velocity, acceleration

    def times(self, rate: float) -> Array:
        """Stamps [s] from 0 to the end at a rate [Hz]."""
        samples: Array = np.arange(int(self.corners()[0][-1] * rate) + 1) / rate
        return samples


GENTLE = Move(speed=1.6, acceleration=2.2, jerk=25.0)  # ramps of 88 ms: vibration stays small
BRISK = Move(
    speed=1.6, acceleration=4.0, jerk=500.0
)  # ramps of 8 ms: the modes of a machine ring; the packaged example
