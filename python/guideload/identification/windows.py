"""Windows of a record: measured and predicted values are compared as means over short windows.

A mean over a window is the same operation on both sides, so it does not bias what is identified; it leaves out
frequencies that say little and brings a record of 100 000 samples down to some thousand values.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Array
from guideload.base.errors import TraceError

FEWEST = 20  # windows: fewer say nothing about the errors of a record


@dataclass(frozen=True, eq=False)
class Windows:
    """Samples of a record in windows.

    samples  (n,) indices of the samples that are used, ascending
    first    (m,) index in `samples` of the first sample of each window
    """

    samples: NDArray[np.intp]
    first: NDArray[np.intp]

    @classmethod
    def of(cls, time: Array, usable: NDArray[np.bool_], length: float, source: str) -> Windows:
        """Windows of `length` seconds without any sample (n,) that is not usable. Raises TraceError if few are left."""
        number = np.floor((time - time[0]) / length) if length else np.arange(time.size)
        _, window = np.unique(number, return_inverse=True)
        whole = np.bincount(window, ~usable) == 0
        samples = np.flatnonzero(whole[window])
        first = np.flatnonzero(np.diff(window[samples], prepend=-1))
        if first.size < FEWEST:
            raise TraceError(
                f"{source}: expected at least {FEWEST} windows of {length:.3g} s to compare, got {first.size}: the "
                "record is too short, stands still, or does not overlap with the trace"
            )
        return cls(samples, first)

    @cached_property
    def counts(self) -> Array:
        """(m,) samples of each window."""
        return np.diff(self.first, append=self.samples.size).astype(np.float64)

    def mean(self, values: Array) -> Array:
        """Means (..., m) over the windows of values (..., n) at the used samples."""
        return np.asarray(np.add.reduceat(values, self.first, axis=-1) / self.counts)
