"""The kind of time stamps a trace has: uniform, ticks of a clock, jitter of a PC, or a log that records on change."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Array
from guideload.smoothing.smoothing import quantum_of

CLOCKS = ("uniform", "ticks", "jitter", "on_change")
# A missing row doubles the step, and stamps made by a PC jitter: 20 ms after a nominal 13 ms (1.54) has been
# measured.
LONGEST_STEP = 1.75
UNIFORM = 1e-3  # of a step: at any speed, stamps this good are better than the positions
# In a log that records on change, hardly any row repeats the value of the one before: this part at most.
MOST_REPEATED = 0.2
FIRST_STEP = 1.5  # the first step of a move is not above this many times the next one; a lost row makes it 2
FEW_QUANTA = 2.5  # two, with their rounding: what rest and the start of a slow move cannot be told apart by
HELD = 100  # rows put back at each end of a standstill: more than the smoothing looks across


@dataclass(frozen=True)
class Clock:
    """How the samples are stamped.

    kind: one of CLOCKS; step: the usual one, s; tick: the clock's own step, s, 0 if none is seen; jitter: rms
    of the steps about the usual one, relative to it; gaps: samples before which rows are missing.
    """

    kind: str
    step: float
    tick: float
    jitter: float
    gaps: NDArray[np.intp]

    @property
    def note(self) -> str:
        told = {
            "uniform": "uniform",
            "ticks": f"a clock that counts in ticks of {self.tick:.3g} s",
            "jitter": f"jittering by {100.0 * self.jitter:.2g} % rms of a step"
            + (f", in ticks of {self.tick:.3g} s" if self.tick else ""),
            "on_change": "a log on change",
        }[self.kind]
        return f"time stamps: {told}, usual step {self.step:.6g} s"


def clock_of(
    time: Array,
    value: Array,
    is_position: bool,
    quantum: float,
    left_out: NDArray[np.bool_] | None = None,
) -> Clock:
    """The kind of time stamps from their steps, and from the values across long ones.

    time (n,) s, increasing, n >= 2; value (n,), a position or a speed; quantum: step of the value, 0 if
    unknown; left_out (n - 1,): steps across which samples were left out on purpose: those count for nothing. A
    log on change has long steps only where the axis stands still; and it stood already in the row
    before, or hardly any row repeats the value of the one before it.
    """
    steps = np.diff(time)
    whole = np.ones(steps.size, bool) if left_out is None else ~left_out
    usual = float(np.median(steps[whole]))
    long = steps > LONGEST_STEP * usual
    gaps = np.flatnonzero(long & whole) + 1
    normal = steps[~long & whole]
    jitter = float(np.sqrt(np.mean((normal - usual) ** 2))) / usual
    farthest = float(np.abs(normal - usual).max())
    # Steps of stamps that were decimals differ by the rounding of doubles.
    digits = 4.0 * float(np.spacing(np.abs(time[[0, -1]]).max()))
    tick = 0.0 if farthest <= digits else quantum_of(np.round(normal / digits) * digits, digits)
    if gaps.size and np.all(still_across(value, gaps, is_position, quantum)):
        change = np.abs(np.diff(value, prepend=value[0]))
        rests = change[gaps - 1] <= FEW_QUANTA * quantum  # so does the row before the gap
        if np.all(rests) or np.mean(change[1:][~long] == 0.0) <= MOST_REPEATED:
            return Clock("on_change", usual, tick, jitter, gaps)
    if farthest <= max(digits, UNIFORM * usual):
        return Clock("uniform", usual, 0.0, jitter, gaps)
    # Stamps of even samples, rounded to ticks, have steps of two neighbouring numbers of ticks.
    if tick and float(np.ptp(normal)) <= 1.5 * tick:
        return Clock("ticks", usual, tick, jitter, gaps)
    return Clock("jitter", usual, tick, jitter, gaps)


def still_across(
    value: Array, gaps: NDArray[np.intp], is_position: bool, quantum: float
) -> NDArray[np.bool_]:
    """Whether the axis stands still from the sample before each gap up to the one after it.

    That one may be the first of the next move: it is then no farther than a usual step of it.
    """
    change = np.abs(np.append(np.diff(value), 0.0))
    limit = np.maximum(FEW_QUANTA * quantum, FIRST_STEP * change[gaps])
    if is_position:
        found: NDArray[np.bool_] = change[gaps - 1] <= limit
    else:
        found = (np.abs(value[gaps - 1]) <= FEW_QUANTA * quantum) & (np.abs(value[gaps]) <= limit)
    return found


def on_grid(time: Array, gaps: NDArray[np.intp]) -> tuple[Array, float]:
    """Even stamps in place of these, by least squares, and the rms distance of the given ones, s.

    Across a gap the number of missing rows is that which fits best.
    """
    steps = np.diff(time)
    usual = float(np.median(steps))
    counts = np.ones(steps.size)
    counts[gaps - 1] = np.maximum(1.0, np.round(steps[gaps - 1] / usual))
    place = np.concatenate([[0.0], np.cumsum(counts)])
    middle = place.mean()
    centred = place - middle
    slope = float(centred @ (time - time.mean())) / float(centred @ centred)
    even = time.mean() + slope * centred
    return even, float(np.sqrt(np.mean((time - even) ** 2)))


def held(time: Array, value: Array, gaps: NDArray[np.intp], step: float) -> tuple[Array, Array, int]:
    """Time and value with rows put back that a log on change left out, and their number.

    Before each of `gaps` the value of the last row is held, at the usual step from the row before the gap and
    back from the row after it, at most HELD on either side.
    """
    times: list[Array] = []
    values: list[Array] = []
    for gap in gaps:
        start, end = float(time[gap - 1]), float(time[gap])
        missing = int(np.ceil((end - start) / step - 0.5)) - 1
        if missing <= 2 * HELD:
            back: Array = end - step * np.arange(missing, 0, -1.0)
        else:
            near = step * np.arange(1.0, HELD + 1)
            back = np.concatenate([start + near, end - near[::-1]])
        times.append(back)
        values.append(np.full(back.size, value[gap - 1]))
    if not times:
        return time, value, 0
    places = np.repeat(gaps, [part.size for part in times])
    added = np.concatenate(times)
    return (
        np.insert(time, places, added),
        np.insert(value, places, np.concatenate(values)),
        added.size,
    )
