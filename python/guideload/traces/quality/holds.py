"""Sample-and-hold: logs that are faster than their signal, so that several rows repeat each value.

Repeated rows would turn motion into steps and spoil the estimate of the noise. Only the rows in which a value is new
are used, with their stamps. A value may be up to one row of the log older than its stamp; the log does not show it.
"""

from __future__ import annotations

import numpy as np

from guideload.base.arrays import Array, Indices
from guideload.traces.content.samples import FEWEST_SAMPLES, TraceDraft

Rows = Indices

MOTION_QUANTA = 4.0  # larger changes are motion; smaller ones also occur in creep
FEWEST = 12  # distances between changes that are needed to find a hold
LEAST_RATIO = 1.8  # oversampling ratio of a hold; below it the used rows would look like gaps
# Quick motion: consecutive changes of over MOTION_QUANTA make up at least this share of the travel ...
LEAST_TRAVEL = 0.5
# ... and this share of their distances fits one ratio, within SLACK of a long ratio, as logging programs jitter.
REGULAR, SLACK = 0.9, 0.15
# Distances up to LONGEST times the usual one, and half a row, lie within motion; longer ones contain rest.
LONGEST = 1.6
# Slow motion: at least this share of the distances are multiples of the ratio ...
IN_STEP = 0.97
# ... with at least this many different odd multiples; creep at a few steady speeds has fewer.
ODD_MULTIPLES = 4
# Changes of value over those that a given hold allows; damage does not explain more.
MORE_CHANGES = 1.2
SHORT = 0.5  # of the ratio: a value between equal ones that lasts for fewer rows is damage


def use_new_values(draft: TraceDraft, hold: float | None) -> None:
    """Leave out the rows that repeat a held value.

    hold: oversampling ratio, 1 to use all rows; None to detect it. Raises TraceError if the values contradict it.
    """
    value, count = draft.value, draft.value.size
    if hold is not None:
        if not 1.0 <= hold <= count / FEWEST_SAMPLES:
            raise draft.refusal(
                f"hold: expected the number of rows that repeat each value, 1 to "
                f"{count / FEWEST_SAMPLES:g} for {count} samples, got {hold:g} (--hold)"
            )
        changes = np.count_nonzero(np.diff(value))
        if changes > MORE_CHANGES * count / hold:
            raise draft.refusal(
                f"hold: values that are held for {hold:g} rows change at most {count / hold:.0f} times in "
                f"{count} samples; these change {changes} times: leave hold out to have it detected, or give 1 "
                "to use all rows (--hold 1)"
            )
    ratio = oversampling_ratio(value, draft.place, draft.quantum) if hold is None else hold
    if ratio <= 1.0:
        return
    new, numbers = rows_of_new_values(value, draft.place, ratio)
    draft.notes.append(
        f"sample-and-hold: each value is held for {ratio:.4g} rows{'' if hold is None else ', as given'}; the "
        f"{new.size} rows in which it is new are used (hold=1, --hold 1 uses all)"
    )
    back = np.flatnonzero(np.diff(draft.time) <= 0.0) + 1
    unseen = back[~(np.isin(back, new) & np.isin(back - 1, new))]
    if unseen.size:
        draft.notes.append(f"time does not grow in {draft.table.rows(unseen)}, where rows repeat a value")
    draft.keep(new)
    draft.place = numbers


def oversampling_ratio(value: Array, place: Rows, quantum: float) -> float:
    """Oversampling ratio of a held signal, in rows per new value; 1 if no hold is found.

    value (n,); place (n,): its row in the log; quantum: of the value, 0 if unknown. It is found from quick motion
    or, if it is a whole number, from slow motion.
    """
    rows = np.flatnonzero(np.diff(value)) + 1
    if rows.size <= FEWEST:
        return 1.0
    return max(_ratio_of_quick_motion(value, place, rows, quantum), _ratio_in_step(np.diff(place[rows])))


def _ratio_of_quick_motion(value: Array, place: Rows, rows: Rows, quantum: float) -> float:
    """Ratio from the distances between consecutive changes of over MOTION_QUANTA; 1 if they have none in common.

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
    if not is_whole:  # refined on longer and longer distances, whose number of values is known by then
        for longest in (4.0, 32.0, 256.0):
            part = distances[distances < longest * ratio]
            ratio = float(part.sum() / np.maximum(1.0, np.round(part / ratio)).sum())
    return ratio


def _ratio_in_step(distances: Rows) -> float:
    """Greatest common divisor of the distances between changes of any size; 1 if they show no hold.

    Creep at a steady speed has one distance, and at any other speed the distances have no common divisor.
    """
    lengths, counts = np.unique(distances, return_counts=True)
    usual = lengths[counts >= FEWEST]
    ratio = int(np.gcd.reduce(usual)) if usual.size else 1
    if ratio < 2 or np.mean(distances % ratio == 0) < IN_STEP:
        return 1.0
    return float(ratio) if np.count_nonzero(usual // ratio % 2) >= ODD_MULTIPLES else 1.0


def rows_of_new_values(value: Array, place: Rows, ratio: float) -> tuple[Rows, Rows]:
    """Samples in which a held value is new, and the index of each among the values of the signal.

    value, place (n,) as in `oversampling_ratio`. Equal values of the signal, as at standstill, get evenly spaced rows
    between the changes before and after. A value between equal ones that lasts for less than SHORT of the ratio is
    damage: its first row is kept, so that the checks find it.
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
