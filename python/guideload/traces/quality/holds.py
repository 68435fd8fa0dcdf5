"""Sample-and-hold: logs that are faster than their signal, so that each value stands in several rows.

The repeats are no samples: taken for some, they would be steps in place of motion, and spoil any estimate of the
noise. Only the rows in which a value is new are used, with their own stamps. A value may be older than its first
row by up to one row of the log; nothing in the log tells by how much.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Array

Rows = NDArray[np.intp]

# A change that stands for motion: in creep, values repeat as well, between changes of single quanta.
LEAST_QUANTA = 4.0
FEWEST = 12  # distances between such changes that tell a hold
LEAST_RATIO = 1.8  # rows per value, from which on it is one; below, rows that are used would look like gaps
MOST_TRAVEL = 0.5  # of the sum of all changes: in those
REGULAR = 0.9  # of the distances, in line with one ratio
# Changes of any size, as of slow motion with coarse quanta, all fall on rows of the hold: this part of them ...
IN_STEP = 0.97
# ... and so many odd multiples of it are among their distances; at a few steady speeds, creep has a few.
KINDS = 4
SLACK = 0.15  # of the ratio, where it is long: the writer of the log is no clock


def held_ratio(value: Array, place: Rows, quantum: float) -> float:
    """Rows per value of a held signal; 1 for one that is not held, or where nothing tells it.

    value (n,); place (n,): the row of the log that it stood in; quantum: step of the value, 0 if unknown.
    Told by quick motion or, where the ratio is whole, by changes in slow motion that are all in step.
    """
    rows = np.flatnonzero(np.diff(value)) + 1
    if rows.size <= FEWEST:
        return 1.0
    return max(_in_quick_motion(value, place, rows, quantum), _in_step(np.diff(place[rows])))


def _in_quick_motion(value: Array, place: Rows, rows: Rows, quantum: float) -> float:
    """The ratio by how far changes of over 4 quanta that follow each other are apart; 1 for none.

    While the axis moves, that is the same number of rows at any speed, or one of two neighbours where the rates have
    no whole ratio. In creep, with coarse quanta, changes are single quanta; and at standstill there are none. Such
    changes have to make up most of the travel.
    """
    change = np.abs(value[rows] - value[rows - 1])
    large = change > LEAST_QUANTA * (quantum or float(change.min()))
    both = large[1:] & large[:-1]
    apart = np.diff(place[rows])[both]
    if apart.size < FEWEST or float(change[1:][both].sum()) < MOST_TRAVEL * float(change.sum()):
        return 1.0
    usual = float(np.median(apart))
    near = apart[apart < 1.6 * usual + 0.5]  # others go across rests
    whole = np.mean(near == usual) >= REGULAR
    ratio = usual if whole else float(near.mean())
    regular = np.mean(np.abs(near - ratio) < max(1.0, SLACK * ratio)) >= REGULAR
    if near.size < FEWEST or not regular or ratio < LEAST_RATIO:
        return 1.0
    if not whole:  # closer from longer and longer distances, in which the number of values is then known
        every = np.diff(place[rows])
        for longest in (4.0, 32.0, 256.0):
            part = every[every < longest * ratio]
            ratio = float(part.sum() / np.maximum(1.0, np.round(part / ratio)).sum())
    return ratio


def _in_step(apart: Rows) -> float:
    """The ratio by the distances of changes of any size, whole multiples of it, of several kinds; 1 for none.

    Creep at a steady speed has distances of one kind, and at any other speed they are in no step.
    """
    found, counts = np.unique(apart, return_counts=True)
    usual = found[counts >= FEWEST]
    ratio = int(np.gcd.reduce(usual)) if usual.size else 1
    if ratio < 2:
        return 1.0
    kinds = usual // ratio
    in_step = float(np.mean(apart % ratio == 0))
    return float(ratio) if in_step >= IN_STEP and np.count_nonzero(kinds % 2) >= KINDS else 1.0


def fresh_rows(value: Array, place: Rows, ratio: float) -> tuple[Rows, Rows]:
    """The samples in which a held value is new, and the number of each among the values of the signal.

    value, place (n,) as above. Where values of the signal are the same, as at standstill, their rows are spread
    evenly between the changes before and after. Rows that differ from those around them, which are the same, for
    less than half of the ratio, are damage: the first of them is kept, to be found as such.
    """
    rows = np.flatnonzero(np.diff(value)) + 1
    short = np.diff(place[rows]) < 0.5 * ratio
    back = np.flatnonzero(short & (value[rows[1:]] == value[rows[:-1] - 1])) + 1
    wild = place[rows[back - 1]]
    anchors = place[np.delete(rows, np.union1d(back, back - 1))]
    if not anchors.size:
        anchors = place[:1]
    apart = np.diff(anchors)
    counts = np.maximum(1, np.round(apart / ratio)).astype(np.intp)
    part = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    inner = np.repeat(anchors[:-1], counts) + np.round(part * np.repeat(apart / counts, counts))
    before = np.arange(int((anchors[0] - place[0]) / ratio), 0, -1)
    after = np.arange(int((place[-1] - anchors[-1]) / ratio) + 1)
    outer = (anchors[0] - np.round(ratio * before), anchors[-1] + np.round(ratio * after))
    grid = np.concatenate([outer[0], inner, outer[1]]).astype(np.intp)
    return _there(place, np.union1d(grid, wild))


def _there(place: Rows, wanted: Rows) -> tuple[Rows, Rows]:
    """The samples at the wanted places, and which of these they are; some may be left out of the log."""
    found = np.minimum(np.searchsorted(place, wanted), place.size - 1)
    numbers = np.flatnonzero(place[found] == wanted)
    return found[numbers], numbers
