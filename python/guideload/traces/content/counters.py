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
        if not self.bits:
            return ""
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
    if bits is not None:
        if not 2 <= bits <= 62:
            raise TraceError(f"counter_bits: expected 0 or 2 to 62, got {bits}")
        if not _fits(values, bits):
            raise TraceError(
                f"counter_bits: the counts from {values.min()} to {values.max()} do not fit into {bits} bits"
            )
        return _unwrapped(values, bits)
    width = next((width for width in BITS if _fits(values, width)), 0)
    if not width:
        return none
    unwrapped = _unwrapped(values, width)
    if not unwrapped.bits:
        return none
    steps = np.abs(np.diff(unwrapped.counts))
    across = np.zeros(steps.size, bool)
    across[unwrapped.wraps - 1] = True
    share = float(steps[~across].max(initial=0)) / 2.0**width
    limit = min(max(LIKE_OTHERS * share, LIKE_NONE), NEVER)
    return unwrapped if float(steps[across].max()) <= limit * 2.0**width else none


def _fits(values: Counts, bits: int) -> bool:
    low, high = int(values.min()), int(values.max())
    return (low >= 0 and high < 1 << bits) or (low >= -(1 << (bits - 1)) and high < 1 << (bits - 1))


def _unwrapped(values: Counts, bits: int) -> Unwrapped:
    counter_range = np.int64(1) << np.int64(bits)
    steps = np.diff(values)
    turns = np.where(np.abs(steps) > counter_range // 2, -np.sign(steps), 0)
    wraps = np.flatnonzero(turns) + 1
    counts = values.copy()
    counts[1:] += counter_range * np.cumsum(turns)
    return Unwrapped(counts, bits if wraps.size else 0, wraps)
