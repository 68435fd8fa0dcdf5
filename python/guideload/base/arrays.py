"""Functions of arrays: check for finite numbers, median time step, runs of flags."""

import numpy as np
from numpy.typing import NDArray

from guideload.base.errors import TraceError

Array = NDArray[np.float64]


def check_finite(name: str, values: Array) -> None:
    """Raise TraceError if a number is nan or infinite; the message has the index of the first one."""
    bad = np.argwhere(~np.isfinite(values))
    if bad.size:
        place, value = ", ".join(map(str, bad[0])), values[tuple(bad[0])]
        raise TraceError(f"{name}[{place}]: expected a finite number, got {value} ({len(bad)} not finite)")


def median_step(time: Array) -> float:
    """Median [s] of the positive steps between times (n,) [s]; 0 if no step is positive."""
    steps = np.diff(time)
    steps = steps[steps > 0.0]
    return float(np.median(steps)) if steps.size else 0.0


def runs_of(flags: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Runs of consecutive true flags: indices of their first entries, and of the entries after their last."""
    edges = np.flatnonzero(np.diff(np.pad(flags, 1).astype(np.int8)))
    return edges[::2], edges[1::2]
