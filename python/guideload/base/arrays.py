"""Arrays of numbers: their type, and the usual step of times."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def median_step(time: Array) -> float:
    """Median of the positive steps of times (n,) s; 0 where there is none."""
    steps = np.diff(time)
    steps = steps[steps > 0.0]
    return float(np.median(steps)) if steps.size else 0.0
