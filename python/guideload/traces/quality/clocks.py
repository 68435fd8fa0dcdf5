"""Kinds of time stamps: uniform, ticks of a clock, jitter of a PC, or a log that records on change."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from guideload.base.arrays import Array, Flags, Indices
from guideload.base.number_text import milliseconds
from guideload.smoothing.kinematics import SPAN, STILL_QUANTA
from guideload.smoothing.smoothing import find_quantum
from guideload.traces.content.samples import TraceDraft

CLOCKS = ("uniform", "ticks", "jitter", "on_change")
# Limit of a step over the usual one. A missing row doubles the step; the jitter of a PC has reached 1.54 (20 ms in
# place of 13 ms).
LONGEST_STEP = 1.75
UNIFORM = 1e-3  # of a step: smaller errors of the stamps do not matter beside those of the positions
TICK_RANGE = 1.5  # ticks: steps of uniform samples differ by one tick, and by rounding
MOST_REPEATED = 0.2  # share of rows in a log on change that repeat the value before
FIRST_STEP = 1.5  # largest first step of a move, over the next one; a lost row makes it 2
# Least ratio of the second step of a move from rest to the first: 3 at constant acceleration, less with jitter.
FROM_REST = 2.0


@dataclass(frozen=True)
class Clock:
    """The time stamps of a trace.

    kind: one of CLOCKS; step: median, s; tick: resolution of the clock, s, 0 if unknown; jitter: rms deviation of the
    steps from the median, over the median; gaps: samples before which rows are missing; still: for each gap,
    whether the axis stands still across it.
    """

    kind: str
    step: float
    tick: float
    jitter: float
    gaps: Indices
    still: Flags

    @property
    def note(self) -> str:
        ticks = f"in ticks of {self.tick:.3g} s"
        jitter = f"jittering by {100.0 * self.jitter:.2g} % rms of a step" + f", {ticks}" * bool(self.tick)
        texts = ("evenly spaced", f"a clock that counts {ticks}", jitter, "a log on change")
        text = dict(zip(CLOCKS, texts, strict=True))[self.kind]
        every = "every" if self.kind == "uniform" else "usual step"
        return f"time stamps: {text}, {every} {milliseconds(self.step, 6)} ms"


def detect_clock(
    time: Array, value: Array, is_position: bool, quantum: float, left_out: Flags | None = None
) -> Clock:
    """Classify time stamps by their steps, and by the changes of value across long steps.

    time (n,) s, increasing, n >= 2; value (n,), a position or a speed; quantum: of the value, 0 if unknown;
    left_out (n - 1,): steps across which damaged samples were left out: they are ignored. A log on change has long
    steps only at standstill; in addition, the axis was already at rest one row before each of them, or at most
    MOST_REPEATED of the rows repeat the value before. An axis that moves in one direction before and after a long step,
    and neither slows down to rest nor starts from rest there, has not stood still: the clock has jumped.
    """
    steps = np.diff(time)
    counted = np.ones(steps.size, bool) if left_out is None else ~left_out
    usual = float(np.median(steps[counted]))
    is_long = steps > LONGEST_STEP * usual
    gaps = np.flatnonzero(is_long & counted) + 1
    normal = steps[~is_long & counted]
    jitter = float(np.sqrt(np.mean((normal - usual) ** 2))) / usual
    farthest = float(np.abs(normal - usual).max())
    # Steps of stamps that were decimals differ by the rounding of doubles.
    rounding = 4.0 * float(np.spacing(np.abs(time[[0, -1]]).max()))
    tick = 0.0 if farthest <= rounding else find_quantum(np.round(normal / rounding) * rounding, rounding)
    # The sample after a gap may be the first of a move: its change is at most FIRST_STEP times the next one.
    signed, quiet = np.diff(value, prepend=value[0], append=value[-1]), STILL_QUANTA * quantum
    change = np.abs(signed)
    limit = np.maximum(quiet, FIRST_STEP * change[gaps + 1])
    if is_position:
        goes_on = signed[gaps - 1] * signed[gaps] > 0.0
        for near, beyond in ((gaps - 1, gaps - 2), (gaps, gaps + 1)):
            goes_on &= change[near] > np.maximum(quiet, change[beyond] / FROM_REST)
        still = (change[gaps] <= limit) & ~goes_on
    else:
        still = (np.abs(value[gaps - 1]) <= quiet) & (np.abs(value[gaps]) <= limit)
    kind = "jitter"
    if farthest <= max(rounding, UNIFORM * usual):
        kind = "uniform"
    elif tick and float(np.ptp(normal)) <= TICK_RANGE * tick:
        kind = "ticks"
    if gaps.size and np.all(still):
        is_at_rest = change[gaps - 1] <= quiet
        if np.all(is_at_rest) or np.mean(change[1:-1][~is_long] == 0.0) <= MOST_REPEATED:
            kind = "on_change"
    return Clock(kind, usual, 0.0 if kind == "uniform" else tick, jitter, gaps, still)


def apply_clock(draft: TraceDraft, clock: Clock, kind: str, given: str | None) -> None:
    """Insert the rows that a log on change omits; or put the stamps on a uniform grid, if that is `given`."""
    if kind == "on_change":
        gaps = clock.gaps[clock.still]
        draft.time, draft.value, count = fill_standstills(draft.time, draft.value, gaps, clock.step)
        draft.notes.append(
            f"log on change: {count} rows inserted at standstill, before {draft.table.rows(gaps)}"
        )
    elif given == "uniform":
        gaps = np.union1d(clock.gaps, np.flatnonzero(np.diff(draft.place) > 1) + 1)
        draft.time, distance = on_grid(draft.time, gaps)
        draft.notes.append(f"stamps put on an even grid, moved by {distance:.3g} s rms")


def on_grid(time: Array, gaps: Indices) -> tuple[Array, float]:
    """Uniform stamps by least squares, and the rms distance [s] of the given stamps from them.

    The number of missing rows in a gap is its length over the usual step, rounded.
    """
    steps = np.diff(time)
    usual = float(np.median(steps))
    counts = np.ones(steps.size)
    counts[gaps - 1] = np.maximum(1.0, np.round(steps[gaps - 1] / usual))
    place = np.concatenate([[0.0], np.cumsum(counts)])
    centred = place - place.mean()
    slope = float(centred @ (time - time.mean())) / float(centred @ centred)
    even = time.mean() + slope * centred
    return even, float(np.sqrt(np.mean((time - even) ** 2)))


def fill_standstills(time: Array, value: Array, gaps: Indices, step: float) -> tuple[Array, Array, int]:
    """Time and value with the rows that a log on change omits, and the number of these rows.

    Before each of `gaps` the last value is repeated at the usual step: forwards from the row before the gap and
    backwards from the row after it, at most `SPAN` rows on either side.
    """
    added: list[Array] = [np.empty(0)]
    for gap in gaps:
        start, end = float(time[gap - 1]), float(time[gap])
        missing = int(np.ceil((end - start) / step - 0.5)) - 1
        before, after = (0, missing) if missing <= 2 * SPAN else (SPAN, SPAN)
        near, far = start + step * np.arange(1.0, before + 1), end - step * np.arange(after, 0, -1.0)
        added.append(np.concatenate([near, far]))
    stamps, places = np.concatenate(added), np.repeat(gaps, [part.size for part in added[1:]])
    return np.insert(time, places, stamps), np.insert(value, places, value[places - 1]), stamps.size
