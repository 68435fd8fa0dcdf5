"""What a measured trace must hold before anything is computed from it. Each limit has its reason; nothing is
repaired here (see `repair`).

All functions take SI arrays and the Table that names the rows, and raise TraceError.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from guideload.base.arrays import Array
from guideload.base.errors import TraceError
from guideload.smoothing.smoothing import quantum_of
from guideload.traces.format.table import Table
from guideload.traces.quality.clocks import LONGEST_STEP, still_across
from guideload.traces.quality.jumps import speed_jumps, top_speed

FEWEST_SAMPLES = 8  # the smoothing takes fourth differences: fewer do not tell noise from motion
# Position against velocity of the same axis: a drive's filtered velocity lags some 10 ms behind, at most a
# fifth of the top speed at usual accelerations; 8 times the median deviation covers rounding of both columns.
LAG_SHARE, DEVIATIONS = 0.2, 8.0


def check_length(table: Table, count: int) -> None:
    if count < FEWEST_SAMPLES:
        where = f": {table.rows(range(count))}" if count else ""
        raise TraceError(f"{table.source}: expected at least {FEWEST_SAMPLES} samples, got {count}{where}")


def check_order(table: Table, column: str, time: Array) -> None:
    """Time stamps must grow."""
    back = np.flatnonzero(np.diff(time) <= 0.0) + 1
    if back.size:
        at = int(back[0])
        raise TraceError(
            f"{table.source}: column {column}: time does not grow in {table.rows(back)}: "
            f"{float(time[at])!r} s after {float(time[at - 1])!r} s; sort the rows, cut the trace where the "
            "clock jumps, or have it mended with repair='doubled,clock' (--repair doubled,clock)"
        )


def gaps_refused(table: Table, column: str, told: str) -> TraceError:
    """What is wrong with a trace that has gaps, and the ways out; told: see `told_gaps`."""
    return TraceError(
        f"{table.source}: column {column}: {told}; rows may be missing: cut the trace, or accept them with "
        "allow_gaps=True (--allow-gaps); for a log that records on change clock='on_change' (--clock on_change)"
    )


def told_gaps(
    table: Table, time: Array, value: Array, gaps: NDArray[np.intp], is_position: bool, quantum: float
) -> str:
    """What stands at the gaps: how many, the longest, their rows, and whether the axis stands still there."""
    steps = np.diff(time)
    worst = int(gaps[np.argmax(steps[gaps - 1])])
    still = bool(np.all(still_across(value, gaps, is_position, quantum)))
    return (
        f"{gaps.size} gaps in time (steps over {LONGEST_STEP:g} times the usual {np.median(steps):.4g} s), before "
        f"{table.rows(gaps)}; the longest is {steps[worst - 1]:.4g} s, before {table.rows([worst])}"
        + ("; the axis stands still across all of them" if still else "")
    )


def check_jumps(
    table: Table,
    column: str,
    time: Array,
    value: Array,
    kind: str,
    max_speed: float | None,
    quantum: float,
) -> None:
    """No step that motion cannot make (see `jumps`)."""
    steps = np.diff(time)
    is_position = kind == "position"
    unit = "m/s" if kind != "motor_speed" else "rad/s"
    bad = speed_jumps(time, value, is_position, quantum, max_speed)
    rows = np.flatnonzero(bad) + (1 if is_position else 0)
    if rows.size == 0:
        return
    if max_speed is not None:
        reason = f"the speed goes above max_speed = {max_speed:g} {unit}"
    else:
        speed = np.diff(value) / steps if is_position else value
        reason = f"jumps that motion cannot make (the rest of the trace stays below {top_speed(speed, bad):.4g} {unit})"
    at = int(rows[0])
    before, after = value[max(at - 1, 0)], value[min(at + 1, value.size - 1)]
    what = (
        f"from {before:.6g} to {value[at]:.6g} m in {steps[at - 1]:.4g} s"
        if is_position
        else f"{value[at]:.6g} {unit} between {before:.6g} and {after:.6g}"
    )
    raise TraceError(
        f"{table.source}: column {column}: {reason} in {table.rows(rows)}: the first is {what}; cut the "
        "trace to a part without them, say what the axis can do with max_speed=... (--max-speed), or leave "
        "wild samples out with repair='outliers' (--repair outliers)"
    )


def check_partner(
    table: Table, column: str, partner: str, time: Array, position: Array, velocity: Array
) -> str:
    """Position and velocity of the same axis must tell the same motion. Returns a note on what was done.

    In each row the mean speed of the position has to lie within the velocities of the four samples around it,
    widened by their own range, a fifth of the top speed, 1.5 quanta of the position and 8 median deviations.
    """
    steps = np.diff(time)
    mean = np.diff(position) / steps
    around = sliding_window_view(np.pad(velocity, 1, mode="edge"), 4)
    low, high = around.min(axis=1), around.max(axis=1)
    middle = 0.5 * (velocity[1:] + velocity[:-1])
    top = float(np.abs(velocity).max())
    moving = np.abs(middle) > 0.1 * top
    # The partner's unit is taken from the column's own; where the two differ by a factor, it is another unit.
    scale = float(np.median(mean[moving] / middle[moving])) if np.any(moving) else 0.0
    if not 0.4 < scale < 2.5:  # units differ by more; rounded positions at slow speed by less
        return f"column {partner} not compared with {column}: their speeds have the ratio {scale:.3g}"
    spread = 1.4826 * float(np.median(np.abs(mean - middle)))
    slack = (high - low) + LAG_SHARE * top + 1.5 * quantum_of(position) / steps + DEVIATIONS * spread
    rows = np.flatnonzero((mean > high + slack) | (mean < low - slack)) + 1
    if rows.size == 0:
        return f"column {partner} tells the same motion as {column}"
    at = int(rows[0])
    move, speeds = 1e3 * (position[at] - position[at - 1]), 1e3 * velocity[at - 1 : at + 1]
    raise TraceError(
        f"{table.source}: column {column}: position and velocity ({partner}) contradict each other in "
        f"{table.rows(rows)}: the first is a jump of {move:.4g} mm in {steps[at - 1]:.4g} s at "
        f"{speeds[0]:.4g} to {speeds[1]:.4g} mm/s; rows seem to be missing there: cut the trace to a part "
        "without such jumps, or leave the comparison out with cross_check=False (--no-cross-check)"
    )
