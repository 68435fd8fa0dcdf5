"""Checks of a trace: increasing time, gaps, jumps, agreement of position and velocity.

A check that fails raises TraceError with the rows; nothing is repaired here (see `repair`).
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from guideload.base.arrays import Array
from guideload.base.number_text import counted, digits
from guideload.base.warnings import LIMITS
from guideload.smoothing.smoothing import find_quantum
from guideload.traces.content.samples import TraceDraft
from guideload.traces.quality.clocks import LONGEST_STEP, Clock
from guideload.traces.quality.jumps import speed_jumps, top_speed
from guideload.traces.quality.repair import MOST_LEFT_OUT

# Position against velocity of the same axis: a drive's filtered velocity lags some 10 ms behind, at most a
# fifth of the top speed at usual accelerations; 8 times the median deviation covers rounding of both columns.
LAG_SHARE, DEVIATIONS = 0.2, 8.0
ROUNDING = 1.5  # quanta, of the difference of two positions
NORMAL = 1.4826  # standard deviation over median deviation, of normal noise
MOVING = 0.1  # of the top speed: slower rows do not count in the ratio of both speeds
# Ratios of two speeds in one unit; speeds in different units differ by more.
SAME_UNIT = (0.4, 2.5)
TOGETHER = 0.9  # square of the correlation of two speeds from which on they are of one motion
REVERSED = 0.9  # of the steps: so many that go back are no jumps of a clock


def check_order(draft: TraceDraft) -> None:
    """Time stamps must grow."""
    time, steps = draft.time, np.diff(draft.time)
    back = np.flatnonzero(steps <= 0.0) + 1
    if not back.size:
        return
    at, most = int(back[0]), MOST_LEFT_OUT * time.size
    if np.count_nonzero(steps < 0.0) > REVERSED * steps.size:
        first, last = (draft.table.rows([row]) for row in (at - 1, back[-1]))
        text = f"time runs backwards from {first} to {last}: reverse the order of the rows"
    elif np.count_nonzero(steps == 0.0) > most and np.any(steps > 0.0):
        text = (
            f"the stamps have a resolution of {digits(np.median(steps[steps > 0.0]))} s, with about "
            f"{digits(time.size / np.unique(time).size, 2)} rows each: record finer stamps, or give the samples per "
            "second in their place with rate (--rate)"
        )
    else:
        repaired = "have it repaired with repair='doubled,clock' (--repair doubled,clock)"
        text = (
            f"time does not grow in {draft.table.rows(back)}: {float(time[at])!r} s after {float(time[at - 1])!r} s; "
            "sort the rows, cut the trace where the clock jumps, or "
            f"{repaired if back.size <= most else 'record it anew'}"
        )
    raise draft.refusal(text, draft.columns.time or "time")


def check_gaps(draft: TraceDraft, clock: Clock, kind: str, accept: bool) -> None:
    """Refuse gaps in time, unless at rest in a log on change; accepted gaps become a warning."""
    gaps = clock.gaps if kind != "on_change" else clock.gaps[~clock.still]
    if not gaps.size:
        return
    steps = np.diff(draft.time)
    worst = int(gaps[np.argmax(steps[gaps - 1])])
    is_still = bool(np.all(clock.still[np.isin(clock.gaps, gaps)]))
    still = "; the axis stands still across all of them" if is_still else ""
    on_change = "; for a log that records on change clock='on_change' (--clock on_change)" if is_still else ""
    text = (
        f"{counted(gaps.size, 'gap')} in time (steps over {LONGEST_STEP:g} times the usual {np.median(steps):.4g} s), "
        f"before {draft.table.rows(gaps)}; the longest is {steps[worst - 1]:.4g} s, before "
        f"{draft.table.rows([worst])}{still}"
    )
    if not accept:
        raise draft.refusal(
            f"{text}; rows may be missing, or the clock has jumped: cut the trace, or accept them with allow_gaps=True "
            f"(--allow-gaps){on_change}",
            draft.columns.time or "time",
        )
    way_out = "cut the trace, or log again without lost rows"
    draft.warn("gap", f"{text}; bridged by the smoothing: {way_out}.")


def check_jumps(draft: TraceDraft, max_speed: float | None) -> None:
    """Refuse jumps that the axis cannot make (see `jumps`)."""
    time, value, is_position = draft.time, draft.value, draft.is_position
    unit = "m/s" if is_position else draft.unit
    jumps = speed_jumps(time, value, is_position, draft.quantum, max_speed)
    samples = np.flatnonzero(jumps) + (1 if is_position else 0)
    if samples.size == 0:
        return
    if max_speed is not None:
        reason = f"the speed goes above max_speed = {max_speed:g} {unit}"
    else:
        top = top_speed(np.diff(value) / np.diff(time) if is_position else value, jumps)
        reason = f"jumps that motion cannot make (the rest of the trace stays below {top:.4g} {unit})"
    at = int(samples[0])
    before, after = value[max(at - 1, 0)], value[min(at + 1, value.size - 1)]
    first = f"{value[at]:.6g} {unit} between {before:.6g} and {after:.6g}"
    if is_position:
        first = f"from {before:.6g} to {value[at]:.6g} m in {time[at] - time[at - 1]:.4g} s"
    if draft.columns.kind == "counts":
        first += "; give the bits of a counter that wraps around with counter_bits=... (--counter-bits)"
    raise draft.refusal(
        f"{reason} in {draft.table.rows(samples)}: the first is {first}; cut the "
        "trace to a part without them, give the greatest speed of the axis with max_speed=... (--max-speed), or leave "
        "outliers out with repair='outliers' (--repair outliers)",
        draft.columns.measured,
    )


def _times_the_speed(by_position: Array, velocity: Array) -> float:
    """Velocity over the speed by the position; NaN if they do not go together.

    Noise of the one lowers what least squares find, noise of the other raises it: of all between, the nearest to 1.
    """
    product = float(by_position @ velocity)
    squares = float(by_position @ by_position), float(velocity @ velocity)
    if not product * product > TOGETHER * squares[0] * squares[1] > 0.0:
        return float("nan")
    low, high = sorted((product / squares[0], squares[1] / product))
    return min(max(1.0, low), high)


def check_partner(draft: TraceDraft) -> None:
    """Refuse position and velocity that contradict each other; a note says whether they were compared.

    In each row the mean speed of the position must lie within the velocities of the four samples around it, widened by
    the range of these velocities, LAG_SHARE of the top speed, ROUNDING quanta of the position and DEVIATIONS median
    deviations.
    """
    if draft.partner is None:
        return
    column, partner = draft.columns.measured, draft.columns.partner
    position, velocity = draft.value, draft.partner
    if not draft.is_position:
        position, velocity = velocity, position
    steps = np.diff(draft.time)
    mean = np.diff(position) / steps
    around = sliding_window_view(np.pad(velocity, 1, mode="edge"), 4)
    low, high = around.min(axis=1), around.max(axis=1)
    middle = 0.5 * (velocity[1:] + velocity[:-1])
    top = float(np.abs(velocity).max())
    moving = np.abs(middle) > MOVING * top
    # A partner without a unit is read in that of the column; a ratio other than 1 shows another unit.
    with np.errstate(over="ignore"):
        ratio = float(np.median(mean[moving] / middle[moving])) if np.any(moving) else 0.0
    same_unit = SAME_UNIT[0] < ratio < SAME_UNIT[1]
    if same_unit or draft.table.header(str(partner)).unit:
        speed = _times_the_speed(mean, middle)
        if not (np.isnan(speed) or LIMITS["other speed"].holds(speed)):
            names = (partner, column) if draft.is_position else (column, partner)
            text = f"column {names[0]} has {speed:.3g} times the speed by column {names[1]}"
            draft.warn("other speed", f"{text}: check unit, scale and sign of both.")
            return
    if not same_unit:
        reason = f"their speeds have the ratio {ratio:.3g}"
        draft.notes.append(f"column {partner} not compared with {column}: {reason}")
        return
    deviation = NORMAL * float(np.median(np.abs(mean - middle)))
    slack = (
        (high - low) + LAG_SHARE * top + ROUNDING * find_quantum(position) / steps + DEVIATIONS * deviation
    )
    samples = np.flatnonzero((mean > high + slack) | (mean < low - slack)) + 1
    if samples.size == 0:
        draft.notes.append(f"column {partner} shows the same motion as {column}")
        return
    at = int(samples[0])
    move, speeds = 1e3 * (position[at] - position[at - 1]), 1e3 * velocity[at - 1 : at + 1]
    raise draft.refusal(
        f"position and velocity ({partner}) contradict each other in "
        f"{draft.table.rows(samples)}: the first is a jump of {move:.4g} mm in {steps[at - 1]:.4g} s at "
        f"{speeds[0]:.4g} to {speeds[1]:.4g} mm/s; rows seem to be missing there: cut the trace to a part "
        "without such jumps, or leave the comparison out with cross_check=False (--no-cross-check)",
        column,
    )
