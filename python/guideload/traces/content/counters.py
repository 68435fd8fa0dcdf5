"""Counters that wrap around: 16-, 24- and 32-bit counts of encoders and clocks, made continuous again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Indices, Integers
from guideload.base.errors import TraceError

Counts = Integers

BITS = (16, 24, 32)  # widths that are detected
# Limit of the step across a wrap: STEP_RATIO times the largest step elsewhere, within these shares of the counter's
# range. Above a quarter of the range the direction is ambiguous.
STEP_RATIO, LEAST_LIMIT, MOST_LIMIT = 4, 1.0 / 64.0, 0.25


@dataclass(frozen=True)
class Unwrapped:
    """Counts without wrap-around.

    counts (n,): equal to the given ones modulo 2**bits, the first unchanged; bits: width of the counter, 0 if it did
    not wrap; wraps: first sample after each wrap.
    """

    counts: Counts
    bits: int
    wraps: Indices

    @property
    def note(self) -> str:
        return f"{self.bits}-bit counter wrapped around {self.wraps.size} times, made continuous"


def unwrap(counts: NDArray[np.integer], bits: int | None = None) -> Unwrapped:
    """Undo the wrap-around of a counter, signed or unsigned.

    bits: width of the counter, 0 if it does not wrap; None: the narrowest of `BITS` that holds all values, if each jump
        over half the range is the whole range within a usual step.
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
    limit = min(max(STEP_RATIO * share, LEAST_LIMIT), MOST_LIMIT)
    if not bits and float(steps[across].max()) > limit * 2.0**width:
        return none
    return Unwrapped(counts, width, np.flatnonzero(across) + 1)
