"""Long records: an overview as an envelope, and the worst cycle, found by itself, to be drawn enlarged."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from guideload.motion.standstill import move_spans

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from guideload.base.arrays import Array
    from guideload.simulation.result import Result

COLUMNS = 1500  # of a picture: of more samples, the range within each column is drawn
MOST_PERIODS = 400.0  # of the lowest mode in a picture: of more, a line would fill the picture like a carpet
CYCLE = 120.0  # periods of the lowest mode in the longest cycle that is enlarged as a whole
AROUND = 15.0  # periods before and after the largest load, where no cycle is found
MARGIN = 0.03  # before and after the cycle, over its length
ENVELOPE_ALPHA = 0.55


def thinned(time: Array, *histories: Array) -> tuple[Array, list[tuple[Array, Array]]]:
    """Histories (n,) reduced to the columns of a picture: their range in each column.

    Returns time (column,) and a pair of smallest and largest values (column,) for each history. Up to COLUMNS samples,
    each is a column.
    """
    starts = np.arange(0, time.size, -(-time.size // COLUMNS))
    ranges = [(np.minimum.reduceat(each, starts), np.maximum.reduceat(each, starts)) for each in histories]
    return time[starts], ranges


def is_long(result: Result) -> bool:
    """Whether the vibration of a result is too dense for a line in a picture of the whole record."""
    time = result.quantities["time"]
    lowest = result.modes.frequency.min(initial=np.inf)
    return time.size > 2 * COLUMNS and float(np.ptp(time)) * lowest > MOST_PERIODS


def draw_envelope(ax: Axes, time: Array, values: Array, color: str, label: str = "") -> None:
    """The range of a history in each column of the picture, as an area."""
    columns, [(low, high)] = thinned(time, values)
    stamps = np.append(columns, time[-1])
    low, high = np.append(low, low[-1]), np.append(high, high[-1])
    # An area has no height where the history rests: its edge is a line there.
    ax.fill_between(stamps, low, high, color=color, alpha=ENVELOPE_ALPHA, linewidth=0.8, label=label)


def worst_cycle(result: Result, loads: Array | None = None) -> slice:
    """The instants of the cycle with the largest load: its move and the standstill after it.

    Where the motion has no standstill, or its cycles are long against the vibration, the periods of the lowest mode
    around the largest load. loads: (time, ...) whose largest value counts; by default the resultants of the carriages,
    or the loads of the links.
    """
    data = result.quantities
    if loads is None:
        loads = data["resultant"] if result.machine.carriages else np.abs(data["link_load"])
    time, load = data["time"], loads.reshape(len(loads), -1).max(axis=1)
    lowest = float(result.modes.frequency.min(initial=np.inf))
    at = float(time[int(load.argmax())])
    start, end = at - AROUND / lowest, at + AROUND / lowest
    velocity = data["cart_velocity"] if "cart_velocity" in data else None
    for span in move_spans(time, data["cart_acceleration"], velocity):
        margin = MARGIN * (span.until - span.start)
        if span.start <= at <= span.until and (span.until - span.start) * lowest <= CYCLE:
            start, end = span.start - margin, span.until + margin
    first, last = np.searchsorted(time, [start, end])
    return slice(int(first), int(min(last + 1, time.size)))
