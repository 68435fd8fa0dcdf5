"""More stamps for a motion: the same acceleration, at instants in between."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Array
from guideload.motion.motion import Motion
from guideload.motion.resolution import usable_bandwidth_of


def refined(motion: Motion, parts: NDArray[np.int64]) -> Motion:
    """The motion with each interval between stamps in so many equal parts, (n - 1,)."""
    first = np.repeat(np.arange(parts.size), parts)
    step = np.arange(first.size) - np.repeat(np.cumsum(parts) - parts, parts)
    return _at(motion, first, step / parts[first])


def with_instants(motion: Motion, times: Array) -> Motion:
    """The motion with stamps at these times [s] too, as far as it lasts then and has none there."""
    stamps = motion.time
    new = np.setdiff1d(times[(times > stamps[0]) & (times < stamps[-1])], stamps)
    before = np.searchsorted(stamps, new, side="right") - 1
    first = np.insert(np.arange(stamps.size - 1), before + 1, before)
    share = np.zeros(first.size)
    share[before + 1 + np.arange(new.size)] = (new - stamps[before]) / (stamps[before + 1] - stamps[before])
    return _at(motion, first, share) if new.size else motion


def _at(motion: Motion, first: NDArray[np.int64], shares: Array) -> Motion:
    """The motion at shares of the intervals that begin with these stamps, and at its end.

    Acceleration and process forces are linear between the stamps anyway. The position is the cubic through positions
    and velocities at the stamps, which is exact where these are the integrals of the acceleration; a velocity without
    position is linear.
    """
    share = shares[:, None]

    def with_last(values: Array, at_last: Array) -> Array:
        return np.append(values, at_last[-1:], axis=0)

    def linear(history: Array) -> Array:
        flat = history.reshape(history.shape[0], -1)
        values = flat[first] + share * (flat[first + 1] - flat[first])
        return with_last(values, flat).reshape(-1, *history.shape[1:])

    position = velocity = None
    if motion.velocity is not None:
        velocity = linear(motion.velocity)
    if motion.velocity is not None and motion.position is not None:
        h = np.diff(motion.time)[first, None]
        (x, v), (end, v_end) = ((motion.position[i], motion.velocity[i]) for i in (first, first + 1))
        # Hermite's cubic x + h v s + a s^2 + b s^3.
        a, b = 3.0 * (end - x) - h * (2.0 * v + v_end), 2.0 * (x - end) + h * (v + v_end)
        position = with_last(x + share * (h * v + share * (a + share * b)), motion.position)
        lasting = np.where(h > 0.0, h, 1.0)
        slope = np.where(h > 0.0, v + share * (2.0 * a + 3.0 * b * share) / lasting, v)
        velocity = with_last(slope, motion.velocity)
    elif motion.position is not None:
        position = linear(motion.position)
    uncertainty = motion.uncertainty
    if uncertainty is not None and uncertainty.time is None:
        uncertainty = replace(uncertainty, time=motion.time)
    return replace(
        motion,
        time=linear(motion.time),
        acceleration=linear(motion.acceleration),
        velocity=velocity,
        position=position,
        wrench=None if motion.wrench is None else linear(motion.wrench),
        motor_speed=None if motion.motor_speed is None else linear(motion.motor_speed),
        bandwidth=usable_bandwidth_of(motion),  # the new stamps show nothing more
        uncertainty=uncertainty,
    )
