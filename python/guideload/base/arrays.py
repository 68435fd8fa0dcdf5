"""Arrays of numbers: their type, the usual step of times, and runs of flags."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def median_step(time: Array) -> float:
    """Median of the positive steps of times (n,) s; 0 where there is none."""
    steps = np.diff(time)
    steps = steps[steps > 0.0]
    return float(np.median(steps)) if steps.size else 0.0


def runs_of(flags: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Starts and ends of the runs [start, end) of flags that are set."""
    edges = np.flatnonzero(np.diff(np.pad(flags, 1).astype(np.int8)))
    return edges[::2], edges[1::2]
