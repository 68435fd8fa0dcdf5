"""Damage in traces: where it is, and the trace without it. Nothing here is done unless it is asked for.

What is found is left out; nothing is filled in. The smoothing works on the true time stamps and needs no rows
in their place.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Array
from guideload.base.errors import TraceError
from guideload.traces.format.table import Table
from guideload.traces.quality.jumps import LONGEST_RUN, drop_outs, speed_jumps

Samples = NDArray[np.intp]

REPAIRS = ("empty", "doubled", "clock", "outliers", "stuck")
MOST_LEFT_OUT = 0.1  # of the samples; a trace that is damaged more tells too little
LEAST_QUANTA = 4.0  # a step that stands for motion: smaller ones come and go in slow motion


@dataclass(frozen=True)
class ClockRepair:
    """Stamps that grow: samples left out, and the stamps with the later ones moved on where a clock was set back.

    back: the samples from which on a clock was set back; moved: by how much they were moved, s.
    """

    left_out: Samples
    time: Array
    back: Samples
    moved: Array


def wanted(repair: str | Iterable[str] | None) -> frozenset[str]:
    """The kinds of damage named by `repair`: "all", or some of REPAIRS with commas or as a collection."""
    if repair is None:
        return frozenset()
    names = [name.strip() for name in repair.split(",")] if isinstance(repair, str) else list(repair)
    if names == ["all"]:
        return frozenset(REPAIRS)
    for name in names:
        if name not in REPAIRS:
            raise TraceError(f'repair: expected all or some of {", ".join(REPAIRS)}, got "{name}" (--repair)')
    return frozenset(names)


def repaired(
    rows: Table,
    time: Array,
    value: Array,
    kinds: frozenset[str],
    is_position: bool,
    quantum: float,
    max_speed: float | None,
    total: int,
) -> tuple[Array, Samples, list[str]]:
    """The stamps that remain, s, the samples that remain, and what was done, with the rows.

    kinds: those of REPAIRS that are wanted; empty cells are left out before (see `samples.read_samples`);
    total: samples with those. Values that are stuck, and speeds of 0 that may be drop-outs, are told in any case.
    Raises TraceError where too much is damaged.
    """
    kept = np.arange(time.size)
    notes = []

    def leave_out(found: Samples, one: str, more: str) -> None:
        nonlocal kept, time
        if found.size:
            what = one if found.size == 1 else more
            notes.append(f"repair: {found.size} {what} left out, {rows.rows(kept[found])}")
            kept, time = np.delete(kept, found), np.delete(time, found)

    if "doubled" in kinds:
        leave_out(doubled_samples(time, value), "doubled sample", "doubled samples")
    if "clock" in kinds:
        mended = repaired_clock(time)
        for sample, shift in zip(mended.back, mended.moved, strict=True):
            notes.append(
                f"repair: the clock was set back before {rows.rows(kept[[sample]])}; that row and all later "
                f"ones moved by {shift:.6g} s, so that the step there is the usual one"
            )
        time = mended.time
        leave_out(mended.left_out, "sample with a wild time stamp", "samples with a wild time stamp")
    if np.any(np.diff(time) <= 0.0):
        return time, kept, notes  # refused by the checks
    if "outliers" in kinds:
        leave_out(outliers(time, value[kept], is_position, quantum, max_speed), "outlier", "outliers")
    if not is_position and max_speed is None:
        found = value[kept]
        stops = np.flatnonzero(drop_outs(found, quantum) & ~speed_jumps(time, found, False, quantum, None))
        if stops.size:
            notes.append(
                f"{stops.size} samples are 0 between rows of one speed, {rows.rows(kept[stops])}: stops of less than "
                "two rows, as the axis turns as quickly elsewhere; if they are drop-outs, empty their cells and use "
                "repair='empty' (--repair empty)"
            )
    stuck = stuck_samples(time, value[kept], quantum)
    if "stuck" in kinds:
        leave_out(stuck, "sample with a stuck value", "samples with a stuck value")
    elif stuck.size:
        notes.append(
            f"{stuck.size} samples repeat the value before while the axis moves, {rows.rows(kept[stuck])}; "
            "leave them out with repair='stuck' (--repair stuck)"
        )
    if time.size < (1.0 - MOST_LEFT_OUT) * total:
        raise TraceError(
            f"{rows.source}: repair: {total - time.size} of {total} samples would be left out, expected at most "
            f"{100.0 * MOST_LEFT_OUT:g} %: cut the trace to a sound part"
        )
    return time, kept, notes


def doubled_samples(time: Array, value: Array) -> Samples:
    """Samples that repeat an earlier one: stamp and value the same, anywhere before, or the stamp right before."""
    order = np.lexsort((np.arange(time.size), value, time))
    same = (np.diff(time[order]) == 0.0) & (np.diff(value[order]) == 0.0)
    found = np.zeros(time.size, bool)
    found[order[1:][same]] = True
    found[1:] |= np.diff(time) == 0.0
    return np.flatnonzero(found)


def repaired_clock(time: Array) -> ClockRepair:
    """Stamps that go back, by their cause.

    A few wild stamps, after which the clock goes on as if nothing had been, are left out with their samples.
    Otherwise the clock was set back: all later stamps move on so that the step there is the usual one.
    Where they are more than a tenth, they are left as they are.
    """
    steps = np.diff(time)
    usual = float(np.median(steps[steps > 0.0])) if np.any(steps > 0.0) else 0.0
    backward = np.flatnonzero(steps <= 0.0) + 1
    if backward.size > MOST_LEFT_OUT * time.size:
        backward = backward[:0]
    out = np.zeros(time.size, bool)
    back: list[int] = []
    moved: list[float] = []
    for b in (int(sample) for sample in backward):
        if out[b]:
            continue
        wild = _wild_stamps(time, b, usual)
        if wild is not None:
            out[wild] = True
        else:
            before = b - 1
            while before > 0 and out[before]:
                before -= 1
            back.append(b)
            moved.append(float(time[before] - time[b]) + usual * (b - before))
    shifted = time.copy()
    for b, shift in zip(back, moved, strict=True):
        shifted[b:] += shift
    return ClockRepair(np.flatnonzero(out), shifted, np.array(back, np.intp), np.array(moved))


def _wild_stamps(time: Array, b: int, usual: float) -> slice | None:
    """The samples around b, where time goes back, without which the clock runs evenly; None if there are none."""
    for count in range(1, LONGEST_RUN + 1):
        for low in (b, b - count):  # too early, from b on; or too late, before b
            high = low + count
            if low < 0 or high > time.size:
                continue
            if low == 0 or high == time.size:
                inside = high < time.size if low == 0 else True
                whole = time[high : high + 2] if low == 0 else time[low - 2 : low]
                if inside and whole.size == 2 and 0.0 < whole[1] - whole[0] < 2.5 * usual:
                    return slice(low, high)
                continue
            span = float(time[high] - time[low - 1])
            if abs(span - (count + 1) * usual) < 0.75 * usual:
                return slice(low, high)
    return None


def outliers(
    time: Array, value: Array, is_position: bool, quantum: float, max_speed: float | None
) -> Samples:
    """Samples, alone or up to LONGEST_RUN together, that jump away from the motion and back to it.

    A jump that does not come back is none: see `checks.check_jumps`.
    """
    if not is_position:
        return np.flatnonzero(speed_jumps(time, value, False, quantum, max_speed))
    kept = np.arange(time.size)
    for _ in range(LONGEST_RUN):
        jumps = np.flatnonzero(speed_jumps(time[kept], value[kept], True, quantum, max_speed))
        if not jumps.size:
            break
        out = _excursions(time[kept], value[kept], jumps)
        if not out.size:
            break
        kept = np.delete(kept, out)
    return np.setdiff1d(np.arange(time.size), kept)


def _excursions(time: Array, value: Array, jumps: NDArray[np.intp]) -> Samples:
    """Samples between a jump and the one that takes it back; jumps are steps, step i ends at sample i + 1."""
    found: list[int] = []
    used = -1
    steps = np.diff(time)
    speed = np.diff(value) / steps
    calm = np.setdiff1d(np.arange(steps.size), jumps)
    for place, jump in enumerate(int(step) for step in jumps):
        if jump <= used:
            continue
        near = np.searchsorted(calm, jump)
        usual = float(np.median(speed[calm[max(near - 2, 0) : near + 2]])) if calm.size else 0.0
        away = (speed[jump] - usual) * steps[jump]
        for other in (int(step) for step in jumps[place + 1 : place + 1 + LONGEST_RUN]):
            if other - jump > LONGEST_RUN:
                break
            home = value[other + 1] - value[jump] - usual * (time[other + 1] - time[jump])
            if abs(home) < 0.3 * abs(away):
                found.extend(range(jump + 1, other + 1))
                used = other
                break
        else:
            if jump == 0:
                found.append(0)
            elif jump == time.size - 2:
                found.append(time.size - 1)
    return np.array(found, np.intp)


def stuck_samples(time: Array, value: Array, quantum: float) -> Samples:
    """Samples that repeat the one before while the axis moves on: a step right after them catches up.

    At least two repeats, between steps of the same direction over 4 quanta, and a step after them that
    stands for the whole time at the speed around it, within half of it.
    """
    change = np.diff(value)
    zero = np.concatenate([[False], change == 0.0, [False]])
    edges = np.flatnonzero(np.diff(zero.astype(np.int8)))
    starts, ends = edges[::2], edges[1::2]  # runs of steps [start, end) without a change
    inside = (starts >= 1) & (ends + 1 < change.size) & (ends - starts >= 2)
    starts, ends = starts[inside], ends[inside]
    steps = np.diff(time)
    before, after, caught = change[starts - 1], change[ends + 1], change[ends]
    speed = 0.5 * (before / steps[starts - 1] + after / steps[ends + 1])
    expected = speed * (time[ends + 1] - time[starts])
    least = LEAST_QUANTA * quantum
    found = (before * after > 0.0) & (np.minimum(np.abs(before), np.abs(after)) > least)
    found &= (caught * before > 0.0) & (np.abs(caught - expected) < 0.5 * np.abs(expected))
    runs = [np.arange(start + 1, end + 1) for start, end in zip(starts[found], ends[found], strict=True)]
    return np.concatenate(runs) if runs else np.empty(0, np.intp)
