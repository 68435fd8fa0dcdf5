"""Histories at other stamps than their own: linear in between, and with two stamps at a jump; what stamps can show."""

from __future__ import annotations

import numpy as np

from guideload.base.arrays import Array, Flags, Indices, median_step

CORNER_STEP = 0.5  # of the median step: a shorter step shows a profile given by its corners, not by samples


def is_late(time: Array) -> Flags:
    """Whether a stamp has the value after a jump there: the second of two, and a single one but the last."""
    second = np.append(False, np.diff(time) == 0.0)
    first = np.append(np.diff(time) == 0.0, False)
    single = ~(first | second)
    single[-1] = False
    return np.asarray(second | single)


def find_place(stamps: Array, time: Array, late: Flags) -> tuple[Indices, Array]:
    """The sample before each stamp, and the seconds since it; negative before the first sample."""
    after = np.where(late, np.searchsorted(time, stamps, "right"), np.searchsorted(time, stamps, "left"))
    lower = np.clip(after - 1, 0, time.size - 1)
    return lower, stamps - time[lower]


def sampled(time: Array, values: Array, stamps: Array, late: Flags) -> Array:
    """A history, linear between its samples and constant beyond them, at the stamps."""
    lower, since = find_place(stamps, time, late)
    upper = np.minimum(lower + 1, time.size - 1)
    width = time[upper] - time[lower]
    share = np.clip(np.divide(since, width, out=np.zeros(stamps.size), where=width > 0.0), 0.0, 1.0)
    share = share.reshape(-1, *[1] * (values.ndim - 1))
    return np.where(share == 1.0, values[upper], values[lower] + share * (values[upper] - values[lower]))


def usable_bandwidth(time: Array, bandwidth: float) -> float:
    """Frequency [Hz] up to which a motion shows accelerations; inf if it is known exactly.

    time: (n,) s. bandwidth: Hz, of the smoothing, inf if unknown; the result is at most half the sampling rate. It is
    inf if the bandwidth is unknown and the stamps are the corners of a profile.
    """
    step = median_step(time)
    if step == 0.0 or (np.isinf(bandwidth) and np.diff(time).min() < CORNER_STEP * step):
        return np.inf
    return float(min(bandwidth, 0.5 / step))
