"""Repair of a trace: damaged samples are found and left out, if the user chooses it.

Nothing is filled in: the smoothing takes the time stamps as they are and needs no rows in place of damaged ones.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from guideload.base.arrays import Array, Indices, find_runs, median_step
from guideload.base.errors import TraceError
from guideload.base.number_text import counted
from guideload.traces.content.samples import TraceDraft, check_length
from guideload.traces.quality.holds import MOTION_QUANTA
from guideload.traces.quality.jumps import LONGEST_RUN, drop_outs, speed_jumps

Samples = Indices

REPAIRS = ("empty", "doubled", "clock", "outliers", "stuck")
MOST_LEFT_OUT = 0.1  # of the samples; a trace with more damage shows too little
# n stamps are wild if the step across them is n + 1 usual steps, within EVEN usual steps; at an end of the trace, if
# the step beside them is at most LONGEST_END usual steps.
EVEN, LONGEST_END = 0.75, 2.5
# The jump back from an outlier cancels the first jump, less the motion, to within this share of it.
COMES_BACK = 0.3
CAUGHT_UP = 0.5  # largest error of the step after a stuck value, over the travel at the speed around it


def parse_repairs(repair: str | Iterable[str] | None) -> frozenset[str]:
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


def repair(draft: TraceDraft, kinds: frozenset[str], max_speed: float | None) -> None:
    """Leave damaged samples out, with their rows in the notes.

    kinds: chosen ones of REPAIRS; `samples.read_samples` has left out empty cells already. Of stuck values and
    speeds of 0 that may be drop-outs there is a warning in any case. Raises TraceError if over MOST_LEFT_OUT of the
    samples are damaged.
    """
    total = int(draft.place[-1]) + 1
    if "doubled" in kinds:
        _leave_out(draft, doubled_samples(draft.time, draft.value), "doubled sample")
    if "clock" in kinds:
        wild, draft.time, moved = repaired_clock(draft.time)
        for sample, shift in moved.items():
            draft.notes.append(
                f"repair: the clock was set back before {draft.table.rows([sample])}; that row and all later "
                f"ones moved by {shift:.6g} s, so that the step there is the usual one"
            )
        _leave_out(draft, wild, "sample", " with a wild time stamp")
    check_length(draft.table, draft.time.size)
    if np.any(np.diff(draft.time) <= 0.0):
        return  # refused by `traces.quality.checks`
    if "outliers" in kinds:
        wild = outliers(draft.time, draft.value, draft.is_position, draft.quantum, max_speed)
        _leave_out(draft, wild, "outlier")
    if not draft.is_position and max_speed is None:
        _warn_of_stops(draft)
    stuck = stuck_samples(draft.time, draft.value, draft.quantum)
    if "stuck" in kinds:
        _leave_out(draft, stuck, "sample", " with a stuck value")
    elif stuck.size:
        draft.warn(
            "suspect samples",
            f"{stuck.size} samples repeat the value before while the axis moves, {draft.table.rows(stuck)}; leave "
            "them out with repair='stuck' (--repair stuck).",
        )
    if draft.time.size < (1.0 - MOST_LEFT_OUT) * total:
        raise draft.refusal(
            f"repair: {total - draft.time.size} of {total} samples would be left out, expected at most "
            f"{100.0 * MOST_LEFT_OUT:g} %: cut the trace to a sound part"
        )


def _leave_out(draft: TraceDraft, samples: Samples, noun: str, which: str = "") -> None:
    """Leave these samples out, and note their number and rows: "3 outliers left out, rows ..."."""
    if samples.size:
        count = counted(samples.size, noun)
        draft.notes.append(f"repair: {count}{which} left out, {draft.table.rows(samples)}")
        draft.keep(np.delete(np.arange(draft.time.size), samples))


def _warn_of_stops(draft: TraceDraft) -> None:
    """Warn of speeds of 0 that may be drop-outs."""
    jumps = speed_jumps(draft.time, draft.value, False, draft.quantum, None)
    stops = np.flatnonzero(drop_outs(draft.value, draft.quantum) & ~jumps)
    if stops.size:
        draft.warn(
            "suspect samples",
            f"{stops.size} samples are 0 between rows of one speed, {draft.table.rows(stops)}: stops of less than two "
            "rows, as the axis turns as quickly elsewhere; if they are drop-outs, empty their cells and use "
            "repair='empty' (--repair empty).",
        )


def doubled_samples(time: Array, value: Array) -> Samples:
    """Samples with the stamp and value of any earlier sample, or with the stamp of the sample before."""
    order = np.lexsort((np.arange(time.size), value, time))
    is_same = (np.diff(time[order]) == 0.0) & (np.diff(value[order]) == 0.0)
    return np.union1d(order[1:][is_same], np.flatnonzero(np.diff(time) == 0.0) + 1)


def repaired_clock(time: Array) -> tuple[Samples, Array, dict[int, float]]:
    """Repair time stamps (n,) s that go back.

    Wild stamps, after which the clock goes on as before, are left out with their samples. Otherwise the clock was set
    back: all later stamps are shifted so that the step there is the usual one. If more than MOST_LEFT_OUT of the stamps
    go back, none is changed.

    Returns the samples to leave out, the stamps (n,) s, and by sample the shift [s] of it and of all later stamps.
    """
    usual = median_step(time)
    backward = np.flatnonzero(np.diff(time) <= 0.0) + 1
    if backward.size > MOST_LEFT_OUT * time.size:
        backward = backward[:0]
    is_wild, shifted = np.zeros(time.size, bool), time.copy()
    moved: dict[int, float] = {}
    for sample in backward.tolist():
        if is_wild[sample]:
            continue
        if wild := _wild_stamps(time, sample, usual):
            is_wild[wild] = True
        else:
            before = int(np.flatnonzero(~is_wild[:sample]).max(initial=0))
            moved[sample] = float(time[before] - time[sample]) + usual * (sample - before)
            shifted[sample:] += moved[sample]
    return np.flatnonzero(is_wild), shifted, moved


def _wild_stamps(time: Array, back: int, usual: float) -> slice | None:
    """The samples around `back`, where time goes back, without which the clock runs evenly; None if there are none."""
    for count in range(1, LONGEST_RUN + 1):
        for low in (back, back - count):  # too early, from `back` on; or too late, before it
            high = low + count
            if low > 0 and high < time.size:
                if abs(float(time[high] - time[low - 1]) - (count + 1) * usual) < EVEN * usual:
                    return slice(low, high)
            elif low == 0 or high == time.size:
                beside = time[high : high + 2] if low == 0 else time[low - 2 : low]
                if beside.size == 2 and 0.0 < beside[1] - beside[0] < LONGEST_END * usual:
                    return slice(low, high)
    return None


def outliers(
    time: Array, value: Array, is_position: bool, quantum: float, max_speed: float | None
) -> Samples:
    """Runs of up to LONGEST_RUN samples that jump away from the motion and back to it.

    A position that does not jump back is no outlier; `traces.quality.checks` refuses it.
    """
    if not is_position:
        return np.flatnonzero(speed_jumps(time, value, False, quantum, max_speed))
    kept = np.arange(time.size)
    for _ in range(LONGEST_RUN):
        jumps = np.flatnonzero(speed_jumps(time[kept], value[kept], True, quantum, max_speed))
        excursions = _excursions(time[kept], value[kept], jumps)
        if not excursions.size:
            break
        kept = np.delete(kept, excursions)
    return np.setdiff1d(np.arange(time.size), kept)


def _excursions(time: Array, value: Array, jumps: Indices) -> Samples:
    """Samples between a jump and the jump back; jumps are indices of steps, step i ends at sample i + 1."""
    excursions: list[int] = []
    last = -1  # step of the last excursion
    steps = np.diff(time)
    speed = np.diff(value) / steps
    calm, ends = np.setdiff1d(np.arange(steps.size), jumps), {0: [0], time.size - 2: [time.size - 1]}
    for number, jump in enumerate(jumps.tolist()):
        if jump <= last:
            continue
        near = np.searchsorted(calm, jump)
        usual = float(np.median(speed[calm[max(near - 2, 0) : near + 2]])) if calm.size else 0.0
        away = (speed[jump] - usual) * steps[jump]
        later = jumps[number + 1 : number + 1 + LONGEST_RUN]
        for back in later[later <= jump + LONGEST_RUN].tolist():
            rest = value[back + 1] - value[jump] - usual * (time[back + 1] - time[jump])
            if abs(rest) < COMES_BACK * abs(away):
                excursions.extend(range(jump + 1, back + 1))
                last = back
                break
        else:
            excursions += ends.get(jump, [])  # an outlier at an end of the trace has one jump only
    return np.array(excursions, np.intp)


def stuck_samples(time: Array, value: Array, quantum: float) -> Samples:
    """Samples that repeat the value before while the axis moves on.

    There are at least two repeats, the steps before and after have one direction and over MOTION_QUANTA quanta, and the
    first step after the repeats is the travel since the stuck value at the speed around it.
    """
    change = np.diff(value)
    starts, ends = find_runs(change == 0.0)  # of steps without a change
    inside = (starts >= 1) & (ends + 1 < change.size) & (ends - starts >= 2)
    starts, ends = starts[inside], ends[inside]
    steps = np.diff(time)
    before, after, catching_up = change[starts - 1], change[ends + 1], change[ends]
    speed = 0.5 * (before / steps[starts - 1] + after / steps[ends + 1])
    expected = speed * (time[ends + 1] - time[starts])
    least = MOTION_QUANTA * quantum
    is_stuck = (before * after > 0.0) & (np.minimum(np.abs(before), np.abs(after)) > least)
    is_stuck &= (catching_up * before > 0.0) & (np.abs(catching_up - expected) < CAUGHT_UP * np.abs(expected))
    runs = map(np.arange, starts[is_stuck] + 1, ends[is_stuck] + 1)
    return np.concatenate([np.empty(0, np.intp), *runs])
