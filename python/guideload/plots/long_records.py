"""Long records: an overview as an envelope, and the worst cycle, found by itself, to be drawn enlarged."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from guideload.base.arguments import checked
from guideload.base.arrays import Indices, check_finite
from guideload.motion.standstill import move_spans

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from guideload.base.arrays import Array
    from guideload.simulation.result import Result


COLUMNS = 1500  # of a picture: of more samples, the range within each column is drawn
MOST_PERIODS = 400.0  # of the lowest mode in a picture: of more, a line would be a solid band
CYCLE = 120.0  # periods of the lowest mode in the longest cycle that is enlarged as a whole
AROUND = 15.0  # periods before and after the largest load, where no cycle is found
MARGIN = 0.03  # before and after the cycle, over its length
ENVELOPE_ALPHA = 0.55


@checked
def extremes(values: Array, starts: Indices) -> tuple[Indices, Indices]:
    """Indices of the first smallest and the first largest value in each group of neighbouring samples.

    A history that is drawn through them has few points, and no peak is lost.

    Parameters
    ----------
    values : ndarray, shape (n,); finite
    starts : ndarray of int, shape (group,); indices of the first sample of each group, the first one 0

    Returns
    -------
    smallest, largest : ndarray of int, shape (group,)

    Raises TraceError for a value that is not finite.
    """
    check_finite("values", values)
    sizes = np.diff(starts, append=values.size)
    found = []
    for extreme in (np.minimum, np.maximum):
        places = np.flatnonzero(values == np.repeat(extreme.reduceat(values, starts), sizes))
        found.append(places[np.searchsorted(places, starts)])
    return found[0], found[1]


def columns(count: int) -> Indices:
    """The first sample of each column of a picture; up to COLUMNS samples, each is a column."""
    return np.arange(0, count, -(-count // COLUMNS))


def is_long(result: Result) -> bool:
    """Whether the vibration of a result is too dense for a line in a picture of the whole record."""
    time = result.quantities["time"]
    lowest = result.modes.frequency.min(initial=np.inf)
    return time.size > 2 * COLUMNS and float(np.ptp(time)) * lowest > MOST_PERIODS


def draw_history(
    ax: Axes, time: Array, values: Array, envelope: bool, *, color: str, label: str = "", **line: Any
) -> None:
    """A line with the style `line`, or as an envelope the range of a history in each column of the picture."""
    if not envelope:
        ax.plot(time, values, color=color, label=label, **line)
        return
    starts = columns(time.size)
    stamps = np.append(time[starts], time[-1])
    low, high = (values[np.append(found, found[-1])] for found in extremes(values, starts))
    # An area has no height where the history rests: its edge is a line there.
    ax.fill_between(stamps, low, high, color=color, alpha=ENVELOPE_ALPHA, linewidth=0.8, label=label)


def worst_cycle(result: Result, at: float | None = None) -> slice:
    """The instants of the cycle with the largest load: its move and the standstill after it.

    Where the motion has no standstill, or its cycles are long against the vibration, the periods of the lowest mode
    around the largest load. at: s, of another load whose cycle is wanted.
    """
    data = result.quantities
    time, lowest = data["time"], float(result.modes.frequency.min(initial=np.inf))
    at = result.largest_load().time if at is None else at
    start, end = at - AROUND / lowest, at + AROUND / lowest
    for span in move_spans(time, data["cart_acceleration"], result.history("cart_velocity")):
        margin = MARGIN * (span.until - span.start)
        if span.start <= at <= span.until and (span.until - span.start) * lowest <= CYCLE:
            start, end = span.start - margin, span.until + margin
    first, last = np.searchsorted(time, [start, end])
    return slice(int(first), int(min(last + 1, time.size)))
