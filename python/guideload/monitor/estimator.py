"""The fixed-lag smoother of a monitor: weights of second differences of the counts.

The model is that of `guideload.smoothing`: a derivative of the position is white process noise, and the counts have
white noise. For samples at equal distances its smoothed acceleration is a fixed weighted sum of the samples near the
instant. The core's smoother gives the weights as its response to unit samples. They leave out uniform motion, so they
are weights of second differences, which are small whole numbers on the controller.
"""

from __future__ import annotations

import math

import numpy as np

from guideload._core import smooth_motion
from guideload.base.arrays import Array

# Variance of the state before the first sample, over that of the noise: almost no knowledge of it.
PRIOR = 1e6
MEMORY = 5.0  # time constants of the past that are kept: the weights before are below 1e-3 of the largest


def filter_taps(order: int, time_constant: float, lag: int) -> Array:
    """Weights (n, 2) of the n second differences before the instant `lag` samples ago and after it, the oldest first.

    order: of the white derivative of the position. time_constant: in samples, (noise/density)^(1/(2 order - 1)).
    The columns give the acceleration in counts per period squared, and the velocity in counts per period in addition
    to the last step.
    """
    count = lag + 2 + max(2, order, math.ceil(MEMORY * time_constant))
    weights = _weights(order, time_constant, lag, count)
    acceleration, velocity = weights[:, 2], weights[:, 1].copy()
    velocity[-1] -= 1.0
    velocity[-2] += 1.0
    taps = np.cumsum(np.cumsum(np.stack([acceleration, velocity], axis=1), axis=0), axis=0)[:-2]
    # The weights are exact for polynomials to within the prior; here they are so for a constant acceleration.
    taps[:, 0] /= taps[:, 0].sum()
    return np.ascontiguousarray(taps)


def _weights(order: int, time_constant: float, lag: int, count: int) -> Array:
    """Response (count, 3) of position, velocity and acceleration `lag` samples before the end to each sample."""
    scale = float(count) ** -np.arange(order)
    model_noise = np.array([time_constant ** (1 - 2 * order)])
    rows = []
    for sample in range(count):
        values = np.zeros(count)
        values[sample] = 1.0
        model = (
            np.ones(count - 1),
            values,
            np.ones(count),
            np.zeros(order),
            np.diag(PRIOR * count * scale**2),
            np.zeros(count - 1, dtype=np.uint32),
            model_noise,
            None,
        )
        rows.append(smooth_motion(model)[0][count - 1 - lag])
    return np.array(rows)
