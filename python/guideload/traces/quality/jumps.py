"""Jumps of a trace that the axis cannot make: outliers, and speeds that drop to 0 for one row.

Detected: a speed far above all others; an isolated speed whose change is far above all other changes; and a 0 between
rows of one speed, if the axis nowhere else turns as quickly.
Not detected: in a log so slow that the axis gets to speed within a row (as at 10 Hz), an outlier below the top speed
looks like a short move, and a drop-out like a short stop. A limit of the speed finds more, and so does a comparison of
position and velocity (`traces.quality.checks`).

The speed u is the change of a position over its step (n - 1,), or the sample of a speed (n,), in SI.
"""

from __future__ import annotations

import numpy as np

from guideload.base.arrays import Array, Flags, find_runs

# Distance of an isolated speed from the median of its four neighbours, over that of the farthest neighbour on the same
# side; in real motion, neighbours approach the speed. (Hampel's identifier, with the median deviation in place of the
# farthest neighbour, would refuse slow and held positions: at rest that deviation is 0.)
ISOLATION = 5.0
QUANTA = 10.0  # smallest jump; slow motion has single quanta between zeros
# A jump also exceeds the rest of the trace: its speed is this many times the top speed ...
SPEED_RATIO = 1.5
# ... or its change of speed is this many times the largest. (An outlier of a position makes two false speeds, that
# of a speed one.)
CHANGE_RATIO = {True: 20.0, False: 3.0}  # whether it is a position
# Outliers of a speed: runs of up to LONGEST_RUN samples over FAR_ABOVE times all others, at most MOST_OUTLIERS of all.
FAR_ABOVE, LONGEST_RUN, MOST_OUTLIERS = 20.0, 5, 0.25
SAME_SPEED = 0.1  # largest range, over the speed, of the four rows around a drop-out
# A 0 is a drop-out if, in the rest of the trace, the speed nowhere changes and changes back by TURN of the lost speed,
# within TURN_ROWS rows each.
TURN, TURN_ROWS = 0.3, 3


def speed_jumps(
    time: Array, value: Array, is_position: bool, quantum: float, max_speed: float | None
) -> Flags:
    """Flags of impossible speeds: of the steps (n - 1,) of a position, or of the samples (n,) of a speed.

    With `max_speed` [m/s or rad/s]: |u| is above it. Without: u is isolated and exceeds the rest of the trace in speed
    or in change of speed; for a speed also drop-outs, and short runs far above all other samples.
    """
    speed = np.diff(value) / np.diff(time) if is_position else value
    if max_speed is not None:
        return np.asarray(np.abs(speed) > max_speed)
    if is_position:
        quantum = quantum / float(np.median(np.diff(time)))
        return _isolated(speed, quantum, is_position)
    wild = _isolated(speed, quantum, is_position) | _far_above(speed, quantum)
    zeros = drop_outs(speed, quantum)
    return wild | zeros if _turns_slowly(speed, zeros, wild) else wild


def drop_outs(speed: Array, quantum: float) -> Flags:
    """Samples (n,) of 0 between two rows before and two rows after of one speed above QUANTA quanta.

    They are drop-outs, or stops of less than two rows.
    """
    around = np.stack([speed[:-4], speed[1:-3], speed[3:-1], speed[4:]])
    low, high = np.abs(around).min(axis=0), np.abs(around).max(axis=0)
    is_one_way = np.abs(np.sign(around).sum(axis=0)) == len(around)
    is_steady = (high - low <= SAME_SPEED * high) & (low > QUANTA * quantum)
    return np.pad((speed[2:-2] == 0.0) & is_one_way & is_steady, 2)


def _turns_slowly(speed: Array, zeros: Flags, wild: Flags) -> bool:
    """Whether the rest of the speed nowhere turns as quickly as at the zeros, so that these are drop-outs."""
    if not zeros.any():
        return False
    lost = float(np.abs(speed[np.flatnonzero(zeros) - 1]).min())
    rest = speed[~(zeros | wild)]
    for rows in range(1, TURN_ROWS + 1):
        before, after = rest[rows:-rows] - rest[: -2 * rows], rest[2 * rows :] - rest[rows:-rows]
        turn = np.where(before * after < 0.0, np.minimum(np.abs(before), np.abs(after)), 0.0)
        if float(turn.max(initial=0.0)) > TURN * lost:
            return False
    return True


def _far_above(speed: Array, quantum: float) -> Flags:
    """Samples, up to LONGEST_RUN together, over FAR_ABOVE times all others, such as 65535 of a broken line."""
    size = np.abs(speed)
    candidates = int(MOST_OUTLIERS * size.size) + 2
    top = np.sort(np.partition(size, size.size - candidates)[-candidates:])  # ascending
    leaps = np.flatnonzero(top[1:] > FAR_ABOVE * np.maximum(top[:-1], QUANTA * quantum))
    if leaps.size and top[leaps[0]] > 0.0:
        above: Flags = size > top[leaps[0]]
        starts, ends = find_runs(above)
        if (ends - starts).max() <= LONGEST_RUN:
            return above
    return np.zeros(size.size, bool)


def _isolated(speed: Array, quantum: float, is_position: bool) -> Flags:
    """Speeds that are isolated from their neighbours and exceed all others.

    The first and last speed by positions are compared with their neighbours on one side. Samples of a speed are not: it
    may begin or end with a jump if the log stops with the drive.
    """
    padded = np.pad(speed, 2, mode="reflect") if is_position else np.pad(speed, 2, mode="edge")
    low, second, third, high = np.sort([padded[i : i + speed.size] for i in (0, 1, 3, 4)], axis=0)
    median: Array = 0.5 * (second + third)
    distance = speed - median
    farthest = np.where(distance > 0.0, high - median, median - low)
    isolated: Flags = np.abs(distance) > np.maximum(ISOLATION * farthest, QUANTA * quantum)
    if not isolated.any():
        return isolated
    change = np.abs(np.diff(speed))
    calm = ~(isolated[1:] | isolated[:-1])
    largest_change = max(float(change[calm].max(initial=0.0)), quantum)
    is_fast = np.abs(speed) > SPEED_RATIO * top_speed(speed, isolated)
    return isolated & (is_fast | (np.abs(distance) > CHANGE_RATIO[is_position] * largest_change))


def top_speed(speed: Array, without: Flags) -> float:
    """The largest speed among the samples that are not flagged in `without`."""
    return float(np.abs(speed[~without]).max(initial=0.0))
