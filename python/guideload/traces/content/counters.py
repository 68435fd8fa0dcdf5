"""Counters that run over: 16-, 24- and 32-bit counts of encoders and clocks, made continuous again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from guideload.base.errors import TraceError

Counts = NDArray[np.int64]

BITS = (16, 24, 32)  # widths that are looked for, the narrowest that holds all values first
# After unwrapping, a step over the edge is like the steps elsewhere: at most this many times the largest of
# them, or this part of the whole range where there is hardly any motion elsewhere; and never over a quarter of
# the range, where the direction could not be told.
LIKE_OTHERS, LIKE_NONE, NEVER = 4, 1.0 / 64.0, 0.25


@dataclass(frozen=True)
class Unwrapped:
    """counts (n,), continuous and equal to the given ones modulo 2**bits; the first is as given.

    bits: 0 if nothing ran over; edges: samples right after the counter ran over.
    """

    counts: Counts
    bits: int
    edges: NDArray[np.intp]

    @property
    def note(self) -> str:
        if not self.bits:
            return ""
        return f"{self.bits}-bit counter ran over {self.edges.size} times, made continuous"


def unwrap(counts: NDArray[np.integer], bits: int | None = None) -> Unwrapped:
    """Undo the wrap-around of a counter, signed or unsigned.

    bits: width of the counter, 0 for one that does not run over; without it the narrowest width whose range
    holds all values, if each jump over half of it comes within a usual step of the whole range.
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
        return _undone(values, bits)
    width = next((width for width in BITS if _fits(values, width)), 0)
    if not width:
        return none
    found = _undone(values, width)
    if not found.edges.size:
        return none
    steps = np.abs(np.diff(found.counts))
    over = np.zeros(steps.size, bool)
    over[found.edges - 1] = True
    share = float(steps[~over].max(initial=0)) / 2.0**width
    limit = min(max(LIKE_OTHERS * share, LIKE_NONE), NEVER)
    return found if float(steps[over].max()) <= limit * 2.0**width else none


def _fits(values: Counts, bits: int) -> bool:
    low, high = int(values.min()), int(values.max())
    return (low >= 0 and high < 1 << bits) or (low >= -(1 << (bits - 1)) and high < 1 << (bits - 1))


def _undone(values: Counts, bits: int) -> Unwrapped:
    whole = np.int64(1) << np.int64(bits)
    steps = np.diff(values)
    turns = np.zeros(steps.size, np.int64)
    turns[steps > whole // 2] = -1
    turns[steps < -(whole // 2)] = 1
    edges = np.flatnonzero(turns) + 1
    counts = values.copy()
    counts[1:] += whole * np.cumsum(turns)
    return Unwrapped(counts, bits if edges.size else 0, edges)
