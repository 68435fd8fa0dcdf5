"""Sample-and-hold: logs that are faster than their signal, so that each value stands in several rows.

The repeats are no samples: taken for some, they would be steps in place of motion, and spoil any estimate of the
noise. Only the rows in which a value is new are used, with their own stamps. A value may be older than its first
row by up to one row of the log; nothing in the log shows by how much.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Array
from guideload.traces.content.samples import FEWEST_SAMPLES, TraceDraft

Rows = NDArray[np.intp]

MOTION_QUANTA = 4.0  # larger changes are motion; smaller ones come and go in creep
FEWEST = 12  # distances between changes, from which on a hold is found
LEAST_RATIO = 1.8  # rows per value of a hold; with fewer, the rows that are used would look like gaps
# By quick motion: changes of over MOTION_QUANTA that follow each other make up this share of all changes ...
LEAST_TRAVEL = 0.5
# ... and this share of their distances fits one ratio, within SLACK of it if it is long: logging programs jitter.
REGULAR, SLACK = 0.9, 0.15
# Distances up to LONGEST times the usual one, and half a row, lie within motion; longer ones contain rest.
LONGEST = 1.6
# By slow motion: this share of all changes falls on rows of the hold ...
IN_STEP = 0.97
# ... with this many odd multiples of the ratio among their distances; creep at a few steady speeds has fewer.
ODD_MULTIPLES = 4
# Changes of a hold that was given, over those that it allows: more cannot be damage.
MORE_CHANGES = 1.2
SHORT = 0.5  # of the ratio: a value that differs from equal ones around it for less is damage


def use_new_values(draft: TraceDraft, hold: float | None) -> None:
    """Leave out the rows that repeat a held value; none where each row has a value of its own.

    hold: rows per value if given, 1 to use all rows; None to detect it. Raises TraceError for a hold that cannot be.
    """
    value, count = draft.value, draft.value.size
    if hold is not None:
        if not 1.0 <= hold <= count / FEWEST_SAMPLES:
            raise draft.refusal(
                f"hold: expected the number of rows in which each value stands, 1 to "
                f"{count / FEWEST_SAMPLES:g} for {count} samples, got {hold:g} (--hold)"
            )
        changes = np.count_nonzero(np.diff(value))
        if changes > MORE_CHANGES * count / hold:
            raise draft.refusal(
                f"hold: values that stand in {hold:g} rows each change at most {count / hold:.0f} times in "
                f"{count} samples; these change {changes} times: leave hold out to have it detected, or give 1 "
                "to use all rows (--hold 1)"
            )
    ratio = oversampling_ratio(value, draft.place, draft.quantum) if hold is None else hold
    if ratio <= 1.0:
        return
    new, numbers = rows_of_new_values(value, draft.place, ratio)
    draft.notes.append(
        f"sample-and-hold: each value stands in {ratio:.4g} rows{'' if hold is None else ', as given'}; the "
        f"{new.size} rows in which it is new are used (hold=1, --hold 1 uses all)"
    )
    back = np.flatnonzero(np.diff(draft.time) <= 0.0) + 1
    unseen = back[~(np.isin(back, new) & np.isin(back - 1, new))]
    if unseen.size:
        draft.notes.append(
            f"time does not grow in {draft.table.rows(unseen)}, among rows that repeat a value"
        )
    draft.keep(new)
    draft.place = numbers


def oversampling_ratio(value: Array, place: Rows, quantum: float) -> float:
    """Rows per value of a held signal; 1 for one that is not held, or where nothing shows it.

    value (n,); place (n,): its row in the log; quantum: of the value, 0 if unknown. A hold shows in quick motion or,
    where the ratio is a whole number, in slow motion with all changes in step.
    """
    rows = np.flatnonzero(np.diff(value)) + 1
    if rows.size <= FEWEST:
        return 1.0
    return max(_ratio_of_quick_motion(value, place, rows, quantum), _ratio_in_step(np.diff(place[rows])))


def _ratio_of_quick_motion(value: Array, place: Rows, rows: Rows, quantum: float) -> float:
    """The ratio by the distances of changes of over MOTION_QUANTA that follow each other; 1 if there is none.

    While the axis moves, the distance is the same number of rows at any speed, or one of two neighbouring numbers where
    the rates have no whole ratio. In creep with coarse quanta, changes are single quanta; at standstill there are none.
    """
    change = np.abs(value[rows] - value[rows - 1])
    is_motion = change > MOTION_QUANTA * (quantum or float(change.min()))
    both = is_motion[1:] & is_motion[:-1]
    distances = np.diff(place[rows])
    apart = distances[both]
    if apart.size < FEWEST or float(change[1:][both].sum()) < LEAST_TRAVEL * float(change.sum()):
        return 1.0
    usual = float(np.median(apart))
    near = apart[apart < LONGEST * usual + 0.5]
    is_whole = np.mean(near == usual) >= REGULAR
    ratio = usual if is_whole else float(near.mean())
    is_regular = np.mean(np.abs(near - ratio) < max(1.0, SLACK * ratio)) >= REGULAR
    if near.size < FEWEST or not is_regular or ratio < LEAST_RATIO:
        return 1.0
    if not is_whole:  # closer from longer and longer distances, in which the number of values is then known
        for longest in (4.0, 32.0, 256.0):
            part = distances[distances < longest * ratio]
            ratio = float(part.sum() / np.maximum(1.0, np.round(part / ratio)).sum())
    return ratio


def _ratio_in_step(distances: Rows) -> float:
    """The ratio by the distances of changes of any size, whole multiples of it; 1 if there is none.

    Creep at a steady speed has one distance, and at any other speed the distances have no common divisor.
    """
    lengths, counts = np.unique(distances, return_counts=True)
    usual = lengths[counts >= FEWEST]
    ratio = int(np.gcd.reduce(usual)) if usual.size else 1
    if ratio < 2 or np.mean(distances % ratio == 0) < IN_STEP:
        return 1.0
    return float(ratio) if np.count_nonzero(usual // ratio % 2) >= ODD_MULTIPLES else 1.0


def rows_of_new_values(value: Array, place: Rows, ratio: float) -> tuple[Rows, Rows]:
    """The samples in which a held value is new, and the number of each among the values of the signal.

    value, place (n,) as above. Where values of the signal are the same, as at standstill, their rows are spread
    evenly between the changes before and after. Rows that differ from equal ones around them for less than half of the
    ratio are damage: the first of them is kept, to be found as such.
    """
    rows = np.flatnonzero(np.diff(value)) + 1
    is_short = np.diff(place[rows]) < SHORT * ratio
    back = np.flatnonzero(is_short & (value[rows[1:]] == value[rows[:-1] - 1])) + 1
    damaged = place[rows[back - 1]]
    anchors = place[np.delete(rows, np.union1d(back, back - 1))]
    if not anchors.size:
        anchors = place[:1]
    apart = np.diff(anchors)
    counts = np.maximum(1, np.round(apart / ratio)).astype(np.intp)
    step = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    between = np.repeat(anchors[:-1], counts) + np.round(step * np.repeat(apart / counts, counts))
    before = np.arange(int((anchors[0] - place[0]) / ratio), 0, -1)
    after = np.arange(int((place[-1] - anchors[-1]) / ratio) + 1)
    outer = (anchors[0] - np.round(ratio * before), anchors[-1] + np.round(ratio * after))
    grid = np.concatenate([outer[0], between, outer[1]]).astype(np.intp)
    wanted = np.union1d(grid, damaged)
    found = np.minimum(np.searchsorted(place, wanted), place.size - 1)
    numbers = np.flatnonzero(place[found] == wanted)  # some rows may be missing from the log
    return found[numbers], numbers
