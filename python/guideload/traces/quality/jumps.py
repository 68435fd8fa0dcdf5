"""Steps of a trace that motion cannot make: wild samples, and speeds that drop out for one row.

What can be told: a speed far above all others; a change that leaves the speed before and after it alone and is far
beyond all other changes; and a 0 between rows of one speed, where the axis never else turns as quickly.
What cannot: in a log so slow that the axis gets to speed within a row (as at 10 Hz), a wild speed below the top
speed looks like a short move, and a drop-out like a short stop. A table that holds the position as well tells more
(see `checks.check_partner`), and so does a limit of the speed.

Speeds u are those of the steps of a position (n - 1,), or the samples of a speed (n,), in SI.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Array

Flags = NDArray[np.bool_]

# A jump stands out of its four neighbours by this factor (a speed that motion reaches is approached by its
# samples) ...
ISOLATION = 5.0
# ... by quanta, since slow motion is single quanta among zeros ...
QUANTA = 10.0
# ... and beyond what the axis does elsewhere in the trace: in speed, or in change of speed. One sample of a position
# makes two wild steps, that of a speed stands alone, and its changes are those of the drive.
SPEED_RATIO = 1.5
CHANGE_RATIO = {"position": 20.0, "speed": 3.0}
# Samples of a speed this far above all others are no motion, alone or up to so many together, and at most so many.
FAR_ABOVE, LONGEST_RUN, MOST_WILD = 20.0, 5, 0.25
# A drop-out is a 0 between four rows of one speed (within this part) ...
SAME_SPEED = 0.1
# ... where in the rest of the trace the speed goes and comes back by less than this part of it, within so many rows.
TURN, TURN_ROWS = 0.3, 3


def speed_jumps(
    time: Array, value: Array, is_position: bool, quantum: float, max_speed: float | None
) -> Flags:
    """Where motion cannot be so: flags of the steps (n - 1,) of a position, of the samples (n,) of a speed.

    With `max_speed` a row is bad when |u| is above it. Without, when u stands out of its two neighbours on either
    side: its distance to their median is over 5 times that of the farthest of them on the same side, and over 10
    quanta; and when it goes beyond the rest of the trace as well: a speed over 1.5 times, or a change of speed over
    20 times (of a speed: 3 times) the largest elsewhere. Of a speed, drop-outs are bad as well, and up to 5 samples
    together that are over 20 times all others.
    """
    steps = np.diff(time)
    speed = np.diff(value) / steps if is_position else value
    if max_speed is not None:
        above: Flags = np.abs(speed) > max_speed
        return above
    if is_position:
        return _jumps(speed, quantum / float(np.median(steps)), CHANGE_RATIO["position"], "reflect")
    found = _jumps(speed, quantum, CHANGE_RATIO["speed"], "edge") | _far_above(speed, quantum)
    zeros = drop_outs(speed, quantum)
    return found | zeros if _turns_slowly(speed, zeros, found) else found


def drop_outs(speed: Array, quantum: float) -> Flags:
    """Samples (n,) that are exactly 0 between two rows of one speed before and two after it: drop-outs, or stops of
    less than two rows. In creep, of speeds up to 10 quanta, a 0 is nothing unusual.
    """
    found = np.zeros(speed.size, bool)
    around = np.stack([speed[:-4], speed[1:-3], speed[3:-1], speed[4:]])
    low, high = np.abs(around).min(axis=0), np.abs(around).max(axis=0)
    one_way = np.abs(np.sign(around).sum(axis=0)) == len(around)
    found[2:-2] = (
        (speed[2:-2] == 0.0) & one_way & (high - low <= SAME_SPEED * high) & (low > QUANTA * quantum)
    )
    return found


def _turns_slowly(speed: Array, zeros: Flags, wild: Flags) -> bool:
    """Whether the speed, without these samples, nowhere turns as quickly as it would have to at the zeros."""
    if not zeros.any():
        return False
    lost = float(np.abs(speed[np.flatnonzero(zeros) - 1]).min())
    rest = speed[~(zeros | wild)]
    for rows in range(1, TURN_ROWS + 1):
        back, on = rest[rows:-rows] - rest[: -2 * rows], rest[2 * rows :] - rest[rows:-rows]
        turn = np.where(back * on < 0.0, np.minimum(np.abs(back), np.abs(on)), 0.0)
        if float(turn.max(initial=0.0)) > TURN * lost:
            return False
    return True


def _far_above(speed: Array, quantum: float) -> Flags:
    """Samples, up to LONGEST_RUN together, over FAR_ABOVE times all others: values of a broken line, as 65535."""
    size = np.abs(speed)
    most = int(MOST_WILD * size.size)
    top = np.sort(np.partition(size, size.size - most - 2)[size.size - most - 2 :])  # ascending
    low = np.maximum(top[:-1], QUANTA * quantum)
    gaps = np.flatnonzero(top[1:] > FAR_ABOVE * low)
    none: Flags = np.zeros(size.size, bool)
    if not gaps.size or top[gaps[0]] == 0.0:
        return none
    found: Flags = size > top[gaps[0]]
    edges = np.flatnonzero(np.diff(np.concatenate([[False], found, [False]]).astype(np.int8)))
    return found if int(np.diff(edges)[::2].max()) <= LONGEST_RUN else none


def _jumps(speed: Array, quantum: float, change_ratio: float, ends: Literal["reflect", "edge"]) -> Flags:
    """Speeds that stand out of their neighbours, and beyond all others.

    ends: "reflect" judges the first and last by the neighbours that they have, "edge" not at all: a speed may begin
    or end with a jump, as a log that stops when the drive does.
    """
    padded = np.pad(speed, 2, mode=ends)
    near = [padded[i : i + speed.size] for i in (0, 1, 3, 4)]  # two neighbours on either side
    low, high = (pick(pick(near[0], near[1]), pick(near[2], near[3])) for pick in (np.minimum, np.maximum))
    inner = np.maximum(np.minimum(near[0], near[1]), np.minimum(near[2], near[3]))
    middle = 0.5 * (inner + np.minimum(np.maximum(near[0], near[1]), np.maximum(near[2], near[3])))
    out = speed - middle
    farthest = np.where(out > 0.0, high - middle, middle - low)  # neighbour on the same side
    isolated: Flags = np.abs(out) > np.maximum(ISOLATION * farthest, QUANTA * quantum)
    if not isolated.any():
        return isolated
    change = np.abs(np.diff(speed))
    calm = ~(isolated[1:] | isolated[:-1])
    usual = float(change[calm].max(initial=0.0))
    far = np.abs(speed) > SPEED_RATIO * top_speed(speed, isolated)
    return isolated & (far | (np.abs(out) > change_ratio * max(usual, quantum)))


def top_speed(speed: Array, without: Flags) -> float:
    return float(np.abs(speed[~without]).max(initial=0.0))
