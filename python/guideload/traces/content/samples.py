"""The samples of the measured column and their time stamps in SI, from a table as it was read."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Array
from guideload.base.errors import TraceError
from guideload.smoothing.smoothing import quantum_of
from guideload.traces.content.columns import argument, positive
from guideload.traces.content.counters import unwrap
from guideload.traces.content.stamps import stamps_of
from guideload.traces.format.headers import KINDS
from guideload.traces.format.table import Table
from guideload.traces.quality import checks
from guideload.traces.quality.holds import fresh_rows, held_ratio

DECIMALS = 9  # values with more are doubles at full length, whose last digits tell nothing
FEWEST_CHANGES = 8
MORE_CHANGES = 1.2  # than a hold allows, from which on it cannot be: some are damage


@dataclass(frozen=True, eq=False)
class Samples:
    """What is used of a table.

    rows: names the samples' rows; time (n,) s, as stamped; value (n,) SI; step: of the value, 0 if none is
    seen; place (n,): which sample of the trace it is, counting those that were left out; partner (n,): the other
    column as it stands in the table, None if it has cells without a number.
    """

    rows: Table
    time: Array
    value: Array
    step: float
    place: NDArray[np.intp]
    partner: NDArray[Any] | None
    notes: tuple[str, ...]


def read_samples(
    data: Table,
    column: str,
    stamped: str | None,
    partner: str | None,
    meaning: tuple[str, float],
    rate: float | str | None,
    counter_bits: int | None,
    leave_out: bool,
    date_order: str | None,
) -> Samples:
    """Values and stamps; raises TraceError for cells without a number, unless they are to be left out.

    meaning: kind of the column and its factor to SI. Where each channel has its own time, the rows that only
    fill up the table are no samples.
    """
    kind, scale = meaning
    value = data.values(column)
    time, note = _stamps(data, stamped, rate, value.size, date_order)
    beside = None if partner is None else data.values(partner)
    notes = [note]
    empty, unstamped = ~np.isfinite(value), ~np.isfinite(time)
    used = np.arange(value.size)
    if data.clocks:
        repeated = np.concatenate([[False], (np.diff(value) == 0.0) & (np.diff(time) == 0.0)])
        used = np.flatnonzero(~((empty & unstamped) | repeated))
    checks.check_length(data, used.size)
    place = np.arange(used.size)
    bad = used[(empty | unstamped)[used]]
    if bad.size and not leave_out:
        column_at_fault, at_fault = (column, empty) if empty[used].any() else (str(stamped), unstamped)
        hint = "cut the trace there, or leave the rows out with repair='empty' (--repair empty)"
        raise data.no_number(column_at_fault, used[at_fault[used]], hint)
    if bad.size:
        noun = "sample" if bad.size == 1 else "samples"
        notes.append(f"repair: {bad.size} {noun} without a number left out, {data.rows(bad)}")
        place = place[~(empty | unstamped)[used]]
        used = np.setdiff1d(used, bad)
    value, time = value[used], time[used]
    rows = data.part(used)
    checks.check_length(rows, used.size)
    whole = kind == "counts" and bool(np.all(value == np.round(value)))
    if whole:
        found = unwrap(value.astype(np.int64), counter_bits)
        value = found.counts
        if found.bits:
            notes.append(f"column {column}: {found.note}, {rows.rows(found.edges)}")
    if kind == "counts":
        value = value - value[0]  # absolute counters are too large to keep their last digits as metres
    if beside is not None:
        beside = beside[used]
        if not np.all(np.isfinite(beside)):  # nobody asked for that column: it takes no part
            notes.append(f"column {partner} not compared with {column}: it has cells without a number")
            beside = None
    si = np.asarray(value * scale, np.float64)
    written = abs(scale) * decimal_quantum(value)
    step = abs(scale) if whole else quantum_of(si, written) or written
    return Samples(rows, time, si, step, place, beside, tuple(notes))


def fresh_samples(read: Samples, hold: float | None, quantum: float) -> Samples:
    """The samples in which a held value is new (see `holds`); all, where each row has a value of its own.

    hold: rows per value as told by the reader, 1 to take all rows; None to find it; quantum: step of the value.
    Raises TraceError.
    """
    if hold is not None and not 1.0 <= hold <= read.value.size / checks.FEWEST_SAMPLES:
        raise TraceError(
            f"{read.rows.source}: hold: expected the number of rows in which each value stands, 1 to "
            f"{read.value.size / checks.FEWEST_SAMPLES:g} for {read.value.size} samples, got {hold:g} (--hold)"
        )
    changes = np.count_nonzero(np.diff(read.value))
    if hold is not None and changes > MORE_CHANGES * read.value.size / hold:
        raise TraceError(
            f"{read.rows.source}: hold: values that stand in {hold:g} rows each change at most "
            f"{read.value.size / hold:.0f} times in {read.value.size} samples; these change {changes} times: "
            "leave hold out to have it detected, or give 1 to take all rows (--hold 1)"
        )
    ratio = held_ratio(read.value, read.place, quantum) if hold is None else hold
    if ratio <= 1.0:
        return read
    fresh, place = fresh_rows(read.value, read.place, ratio)
    note = (
        f"sample-and-hold: each value stands in {ratio:.4g} rows{'' if hold is None else ', as given'}; the "
        f"{fresh.size} rows in which it is new are used (hold=1, --hold 1 takes all)"
    )
    notes = [note]
    back = np.flatnonzero(np.diff(read.time) <= 0.0) + 1
    unseen = back[~(np.isin(back, fresh) & np.isin(back - 1, fresh))]
    if unseen.size:
        notes.append(f"time does not grow in {read.rows.rows(unseen)}, among rows that repeat a value")
    return replace(
        read,
        rows=read.rows.part(fresh),
        time=read.time[fresh],
        value=read.value[fresh],
        place=place,
        partner=None if read.partner is None else read.partner[fresh],
        notes=(*read.notes, *notes),
    )


def decimal_quantum(values: NDArray[Any]) -> float:
    """The step of values (n,) that are written with few decimals: the greatest that divides all changes.

    0 if they have more than DECIMALS decimals, hardly change, or are rounded to digits, more coarsely where they
    are large. Where motion is so fast that no single step
    is seen, this still tells the step, while `smoothing.quantum_of` needs small changes.
    """
    for decimals in range(DECIMALS + 1):
        scaled = values * 10.0**decimals
        whole = np.round(scaled)
        if np.abs(whole).max() > 2.0**50:
            return 0.0
        # Doubles next to decimals are off by their own rounding, times the scale.
        if np.all(np.abs(scaled - whole) <= 4.0 * np.spacing(np.abs(scaled))):
            return _common_step(whole.astype(np.int64)) / 10.0**decimals
    return 0.0


def _common_step(whole: NDArray[np.int64]) -> float:
    """The greatest number that divides all changes of whole numbers, the same among the small and the large."""
    size = np.abs(whole)
    middle = np.median(size)
    steps = []
    for half in (whole[size <= middle], whole[size >= middle]):
        changes = np.diff(half)
        changes = changes[changes != 0]
        if changes.size < FEWEST_CHANGES:
            return 0.0
        steps.append(float(np.gcd.reduce(changes)))
    return steps[0] if steps[0] == steps[1] else 0.0


def quantum_given(data: Table, kind: str, quantum: float | str) -> float:
    """The quantum that a reader states, in the kind's SI unit, 0 or more. Raises TraceError."""
    step = argument(data, "quantum", quantum, KINDS[kind])
    if step < 0.0:
        raise TraceError(f"{data.source}: quantum: expected >= 0 {KINDS[kind]}, got {step:g} (--quantum)")
    return step


def _stamps(
    data: Table, stamped: str | None, rate: float | str | None, count: int, date_order: str | None
) -> tuple[Array, str]:
    """Time stamps in s, NaN where there is none, and a note."""
    given = None if rate is None else positive(data, "rate", rate, "Hz")
    if stamped is not None:
        return stamps_of(data, stamped, given, date_order)
    per_second = given or data.rate
    assert per_second is not None
    unused = [name for name in data.names if data.header(name).is_time]
    note = f"time from the rate {per_second:g} Hz" + (f"; column {unused[0]} not used" if unused else "")
    return np.arange(count) / per_second, note
