"""Origins of stamps: instants of a clock from which the stamps of files count, so that two files can share it."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from guideload.base.arrays import Array

# Of stamps that count from the first: its date, or its time of day, duration or count of a clock. NaT for rows of a
# rate, whose first has no known instant. None for stamps that are numbers as they stand in the file.
Origin: TypeAlias = np.datetime64 | np.timedelta64 | None


def stamps_from(time: Array, origin: Origin, other: Origin) -> Array | None:
    """Stamps (n,) [s] that count from `origin`, counted from `other` instead; None if the two share no clock.

    Numbers as they stand count from `other`, whatever that is. The result is rounded to nanoseconds, as dates are.
    """
    if origin is None:
        return time
    if other is None or origin.dtype.kind != other.dtype.kind or np.isnat(origin) or np.isnat(other):
        return None
    whole = f"{origin.dtype.kind}8[ns]"
    later = int(origin.astype(whole).astype(np.int64)) - int(other.astype(whole).astype(np.int64))
    return np.round(1e9 * time + later) / 1e9 if later else time


def shown_origin(origin: Origin) -> str:
    """An origin for a message."""
    if origin is None:
        return "zero"
    if np.isnat(origin):
        return "the first row"
    if isinstance(origin, np.datetime64):
        return f"the date {origin}"
    return f"{origin / np.timedelta64(1, 's'):.9g} s"
