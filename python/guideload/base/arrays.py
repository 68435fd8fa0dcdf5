"""Arrays of numbers: their type, a check, the usual step of times, and runs of flags."""

import numpy as np
from numpy.typing import NDArray

from guideload.base.errors import TraceError

Array = NDArray[np.float64]


def check_finite(name: str, values: Array) -> None:
    """Raise TraceError with the index of the first number that is not finite."""
    bad = np.argwhere(~np.isfinite(values))
    if bad.size:
        place, value = ", ".join(map(str, bad[0])), values[tuple(bad[0])]
        raise TraceError(f"{name}[{place}]: expected a finite number, got {value} ({len(bad)} such)")


def median_step(time: Array) -> float:
    """Median of the positive steps of times (n,) s; 0 where there is none."""
    steps = np.diff(time)
    steps = steps[steps > 0.0]
    return float(np.median(steps)) if steps.size else 0.0


def runs_of(flags: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Starts and ends of the runs [start, end) of flags that are set."""
    edges = np.flatnonzero(np.diff(np.pad(flags, 1).astype(np.int8)))
    return edges[::2], edges[1::2]
