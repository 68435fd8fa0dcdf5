"""Travel along x at any instants, exact for an acceleration that is linear between stamps."""

from __future__ import annotations

import numpy as np

from guideload.base.arrays import Array
from guideload.motion.motion import Motion
from guideload.motion.stamps import find_place, is_late


def travel_of(motion: Motion) -> Array:
    """Place [m], speed and acceleration (n, 3) along x at the samples; what a motion lacks is integrated from 0."""
    acceleration, steps = motion.acceleration[:, 0], np.diff(motion.time)
    gains = 0.5 * steps * (acceleration[1:] + acceleration[:-1])
    speed = np.append(0.0, np.cumsum(gains)) if motion.velocity is None else motion.velocity[:, 0]
    gains = steps * (speed[:-1] + steps * (2.0 * acceleration[:-1] + acceleration[1:]) / 6.0)
    place = np.append(0.0, np.cumsum(gains)) if motion.position is None else motion.position[:, 0]
    return np.column_stack([place, speed, acceleration])


def travel_at(time: Array, samples: Array, stamps: Array) -> Array:
    """Place, speed and acceleration (m, 3) at stamps, from those (n, 3) at samples; at rest before and after them.

    In each interval they are the integrals of a linear acceleration from place and speed at its start.
    """
    lower, since = find_place(stamps, time, is_late(stamps))
    inside = (since >= 0.0) & ((lower < time.size - 1) | (since == 0.0))
    upper = np.minimum(lower + 1, time.size - 1)
    (place, speed, at), width = samples[lower].T, time[upper] - time[lower]
    jerk = np.divide(samples[upper, 2] - at, width, out=np.zeros(stamps.size), where=width > 0.0)
    since = np.where(inside, since, 0.0)
    travel = [
        place + since * (speed + since * (at / 2.0 + since * jerk / 6.0)),
        np.where(inside, speed + since * (at + since * jerk / 2.0), 0.0),
        np.where(inside, at + since * jerk, 0.0),
    ]
    return np.ascontiguousarray(np.stack(travel, axis=1))
