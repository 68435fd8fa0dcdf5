"""The samples of the measured column and their time stamps in SI, and the quantum of the values."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Array, Flags, Indices, Integers
from guideload.base.errors import TraceError
from guideload.base.number_text import counted
from guideload.base.units import factor
from guideload.base.warnings import LIMITS, WarningText
from guideload.motion.origin import Origin
from guideload.smoothing.smoothing import find_quantum
from guideload.traces.content.columns import Columns, option_in_si
from guideload.traces.content.counters import unwrap
from guideload.traces.content.stamps import Stamps, read_stamps
from guideload.traces.format.headers import KINDS
from guideload.traces.format.table import Table
from guideload.traces.options import ReadingOptions

FEWEST_SAMPLES = 8  # the smoothing takes fourth differences: with fewer, noise and motion look alike
# Largest time, position and speed in SI units, far above those of any log or axis, and shortest step of time. Between
# them, differences and their squares fit into a double.
LARGEST, SHORTEST_STEP = 1e12, 1e-15
DECIMALS = 9  # values with more decimals are doubles at full length, with random last digits
FEWEST_CHANGES = 8  # changes of value that are needed to find a quantum


@dataclass(eq=False)
class TraceDraft:
    """A trace while it is read: each step of the reading changes it or adds notes and warnings.

    table: for the row numbers of the samples; columns: the chosen ones; kind: position, velocity or motor_speed;
    time (n,) s; value (n,) SI; quantum: of the value, 0 if unknown; place (n,): index of the sample before any samples
    were left out; partner (n,) m or m/s: the column to compare with, or None; origin: of the time.
    """

    table: Table
    columns: Columns
    kind: str
    time: Array
    value: Array
    quantum: float
    place: Indices
    partner: Array | None
    origin: Origin
    notes: list[str]
    warnings: list[WarningText] = field(default_factory=list)

    @property
    def is_position(self) -> bool:
        return self.kind == "position"

    @property
    def unit(self) -> str:
        """SI unit of the value."""
        return KINDS[self.kind]

    def keep(self, samples: Indices) -> None:
        """Keep these samples and leave out all others."""
        self.table = self.table.part(samples)
        self.time, self.value, self.place = self.time[samples], self.value[samples], self.place[samples]
        self.partner = None if self.partner is None else self.partner[samples]

    def warn(self, key: str, text: str) -> None:
        """Add a warning with the key of its limit, see `base.warnings`."""
        self.warnings.append(WarningText(key, f"Warning: {text}"))

    def refusal(self, reason: str, column: str = "") -> TraceError:
        """The error that refuses the trace, or a column of it."""
        return TraceError(f"{f'column {column}: ' if column else ''}{reason}")


def read_samples(
    table: Table, columns: Columns, options: ReadingOptions, leave_out_empty: bool
) -> TraceDraft:
    """Values and time stamps of the samples. Raises TraceError for empty cells unless `leave_out_empty`.

    If each channel has its own time, rows that only pad the table are skipped.
    """
    value = table.values(columns.measured)
    table.require_size(columns.measured, value)
    time, note, origin = time_stamps(table, columns.time, options, value.size)
    notes = [*table.notes, columns.note, note]
    empty, no_stamp = ~np.isfinite(value), ~np.isfinite(time)
    used = np.arange(value.size)
    if table.clocks:
        repeated = np.concatenate([[False], (np.diff(value) == 0.0) & (np.diff(time) == 0.0)])
        used = np.flatnonzero(~((empty & no_stamp) | repeated))
    elif (step := rows_per_value(empty)) > 1:
        used = np.flatnonzero(~empty)
        notes.append(f"a value in every {step}. row, as of a log at a lower rate than the table's")
    check_length(table, used.size)
    bad = (empty | no_stamp)[used]
    if bad.any() and not leave_out_empty:
        column, at_fault = (columns.measured, empty) if empty[used].any() else (str(columns.time), no_stamp)
        hint = "cut the trace there, or leave the rows out with repair='empty' (--repair empty)"
        raise table.no_number(column, used[at_fault[used]], hint)
    if bad.any():
        samples = counted(bad.sum(), "sample")
        notes.append(f"repair: {samples} without a number left out, {table.rows(used[bad])}")
    place, used = np.flatnonzero(~bad), used[~bad]
    rows, value, time = table.part(used), value[used], time[used]
    check_length(rows, used.size)
    rows.require_size(columns.time or "time", time, LARGEST, "s")
    steps = np.abs(np.diff(time))
    if (short := np.flatnonzero((steps > 0.0) & (steps < SHORTEST_STEP)) + 1).size:
        raise TraceError(
            f"column {columns.time}: expected steps of time of {SHORTEST_STEP:g} s or more, got "
            f"{steps[short[0] - 1]:.3g} s before {rows.rows(short)}; check the unit"
        )
    is_whole = columns.kind == "counts" and bool(np.all(value == np.round(value)))
    if is_whole:
        rows.require_size(columns.measured, value, 2**62)
        counter = unwrap(value.astype(np.int64), options.get("counter_bits"))
        value = counter.counts
        if counter.bits:
            notes.append(f"column {columns.measured}: {counter.note}, {rows.rows(counter.wraps)}")
    if columns.kind == "counts":
        value = value - value[0]  # absolute counters are too large to keep their last digits as metres
    partner = None if columns.partner is None else _partner(table, columns)[used]
    if partner is not None and not np.all(np.isfinite(partner)):
        compared = f"column {columns.partner} not compared with {columns.measured}"
        notes.append(f"{compared}: it has cells without a number")
        partner = None
    with np.errstate(over="ignore"):
        si = np.asarray(value * columns.scale, np.float64)
    rows.require_size(columns.measured, si, LARGEST, KINDS[columns.kind])
    kind = "position" if columns.kind == "counts" else columns.kind
    given = options.get("quantum")
    if given is not None:
        quantum = option_in_si("quantum", given, KINDS[kind], ">=")
    else:
        decimal = abs(columns.scale) * decimal_quantum(value)
        quantum = abs(columns.scale) if is_whole else find_quantum(si, decimal) or decimal
    draft = TraceDraft(rows, columns, kind, time, si, quantum, place, partner, origin, notes)
    if columns.time is None:
        _compare_rate(draft, table, options)
    return draft


def _compare_rate(draft: TraceDraft, table: Table, options: ReadingOptions) -> None:
    """Warn of a given rate that a column of the time contradicts."""
    for column in table.time_names[:1]:
        try:
            stamps = read_stamps(table, column, options).time
        except TraceError:
            return
        given, own = (float(np.median(np.diff(each[np.isfinite(each)]))) for each in (draft.time, stamps))
        if own > 0.0 and not LIMITS["other rate"].holds(own / given):
            text = f"column {column} has samples every {1e3 * own:.4g} ms, the given rate every {1e3 * given:.4g} ms"
            draft.warn("other rate", f"{text}: leave the rate out if the column is right.")


def rows_per_value(empty: Flags) -> int:
    """Rows of the table per value of a column that is filled in every second or later row; 1 for any other."""
    filled = np.flatnonzero(~empty)
    steps = np.diff(filled)
    if filled.size < FEWEST_SAMPLES or np.any(steps != steps[0]):
        return 1
    step = int(steps[0])
    return step if filled[0] < step and empty.size - filled[-1] <= step else 1


def quantum_note(draft: TraceDraft, is_given: bool) -> str:
    """Note on kind, column and quantum; the quantum of a motor speed is in rpm."""
    quantum, unit = draft.quantum, draft.unit
    if draft.kind == "motor_speed":
        quantum, unit = quantum / factor("rpm", "rad/s"), "rpm"
    found = f"quantum {quantum:.3g} {unit}{', as given' if is_given else ''}"
    return f"{draft.kind} from column {draft.columns.measured}, {found if quantum else 'no quantum found'}"


def decimal_quantum(values: NDArray[Any]) -> float:
    """The quantum of values (n,) that are written with few decimals: the greatest common divisor of changes.

    0 if the values have more than DECIMALS decimals, hardly change, or are rounded to significant digits. It also works
    for motion of many quanta per sample, unlike `smoothing.find_quantum`, which needs small changes.
    """
    for decimals in range(DECIMALS + 1):
        scaled = values * 10.0**decimals
        integers = np.round(scaled)
        if np.abs(integers).max() > 2.0**50:
            return 0.0
        # A double differs from the decimal number by its rounding, here times the scale.
        if np.all(np.abs(scaled - integers) <= 4.0 * np.spacing(np.abs(scaled))):
            return _common_step(integers.astype(np.int64)) / 10.0**decimals
    return 0.0


def _common_step(integers: Integers) -> float:
    """Greatest common divisor of the changes; 0 unless small and large integers have the same one."""
    size = np.abs(integers)
    middle = np.median(size)
    changes = [np.diff(half) for half in (integers[size <= middle], integers[size >= middle])]
    if min(map(np.count_nonzero, changes)) < FEWEST_CHANGES:
        return 0.0
    small, large = map(np.gcd.reduce, changes)
    return float(small) if small == large else 0.0


def check_length(table: Table, count: int) -> None:
    """Raise TraceError for fewer than FEWEST_SAMPLES."""
    if count < FEWEST_SAMPLES:
        where = f": {table.rows(range(count))}" if count else ""
        raise TraceError(f"expected at least {FEWEST_SAMPLES} samples, got {count}{where}")


def _partner(table: Table, columns: Columns) -> Array:
    """Values (n,) of the partner in SI; without a unit in its header it has that of the measured column."""
    name = str(columns.partner)
    header = table.header(name)
    known = header.kind in ("position", "velocity")
    values: Array = table.values(name) * (factor(header.unit, KINDS[header.kind]) if known else columns.scale)
    return values


def time_stamps(table: Table, column: str | None, options: ReadingOptions, count: int) -> Stamps:
    """The time stamps, NaN where there is none."""
    given = options.get("rate")
    rate = table.rate if given is None else option_in_si("rate", given, "Hz", ">")
    if column is not None:
        return read_stamps(table, column, options, None if given is None else rate)
    if options.get("time_unit") is not None:
        raise TraceError("expected no time_unit (--time-unit) without a time column")
    assert rate is not None
    unused = table.time_names[:1]
    note = f"time from the rate {rate:g} Hz" + (f"; column {unused[0]} not used" if unused else "")
    return Stamps(np.arange(count) / rate, note, np.timedelta64("NaT", "ns"))
