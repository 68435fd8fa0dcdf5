"""Counters that wrap around: 16-, 24- and 32-bit counts of encoders and clocks, made continuous again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from guideload.base.errors import TraceError

Counts = NDArray[np.int64]

BITS = (16, 24, 32)  # widths that are looked for, the narrowest that holds all values first
# Largest step across a wrap, of the counter's range: like the steps elsewhere, at most LIKE_OTHERS times the largest of
# them, or LIKE_NONE where there is hardly any motion elsewhere; never over a quarter, where the direction is unclear.
LIKE_OTHERS, LIKE_NONE, NEVER = 4, 1.0 / 64.0, 0.25


@dataclass(frozen=True)
class Unwrapped:
    """counts (n,), continuous and equal to the given ones modulo 2**bits; the first is as given.

    bits: 0 if the counter did not wrap; wraps: samples right after it wrapped.
    """

    counts: Counts
    bits: int
    wraps: NDArray[np.intp]

    @property
    def note(self) -> str:
        return f"{self.bits}-bit counter wrapped around {self.wraps.size} times, made continuous"


def unwrap(counts: NDArray[np.integer], bits: int | None = None) -> Unwrapped:
    """Undo the wrap-around of a counter, signed or unsigned.

    bits: width of the counter, 0 for one that does not wrap; None for the narrowest width whose range holds all
        values, if each jump over half of it differs from the whole range by no more than a usual step.
    Raises TraceError if the values do not fit into the given width.
    """
    values = np.asarray(counts, np.int64)
    none = Unwrapped(values, 0, np.empty(0, np.intp))
    if bits == 0 or values.size < 2:
        return none
    if bits is not None and not 2 <= bits <= 62:
        raise TraceError(f"counter_bits: expected 0 or 2 to 62, got {bits}")
    low, high = int(values.min()), int(values.max())
    least = max(high, -low - 1).bit_length() + (low < 0)  # bits that hold all values
    width = next((width for width in ([bits] if bits else BITS) if width >= least), 0)
    if bits and not width:
        raise TraceError(f"counter_bits: the counts from {low} to {high} do not fit into {bits} bits")
    steps = np.diff(values)
    turns = np.where(np.abs(steps) > (1 << width) // 2, -np.sign(steps), 0)
    across = turns != 0
    if not (width and across.any()):
        return none
    counts = values.copy()
    counts[1:] += (1 << width) * np.cumsum(turns)
    steps = np.abs(np.diff(counts))
    share = float(steps[~across].max(initial=0)) / 2.0**width
    limit = min(max(LIKE_OTHERS * share, LIKE_NONE), NEVER)
    if not bits and float(steps[across].max()) > limit * 2.0**width:
        return none
    return Unwrapped(counts, width, np.flatnonzero(across) + 1)
