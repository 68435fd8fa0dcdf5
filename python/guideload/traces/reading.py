"""From a measured trace to the motion that excites the scene: read, check, smooth.

A trace is one column of a table (position, counts, velocity of the cart, or speed of the motor) and its time
stamps. Nothing in it is repaired silently: what cannot be used is refused with its rows named, or left out
where that was asked for.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from guideload.base.arrays import Array
from guideload.base.errors import TraceError
from guideload.base.units import factor
from guideload.motion.motion import Motion
from guideload.smoothing.estimation import Estimate
from guideload.smoothing.smoothing import Kind, Method, smooth
from guideload.traces.content import columns
from guideload.traces.content.samples import fresh_samples, quantum_given, read_samples
from guideload.traces.content.stamps import DATE_ORDERS
from guideload.traces.format.files import load_table
from guideload.traces.format.headers import KINDS
from guideload.traces.format.table import listed
from guideload.traces.quality import checks
from guideload.traces.quality.clocks import CLOCKS, clock_of, held, on_grid, still_across
from guideload.traces.quality.repair import repaired, wanted

if TYPE_CHECKING:
    from guideload.machine.components import Drive
    from guideload.traces.format.files import TableLike


@dataclass(frozen=True, eq=False)
class Trace:
    """A checked trace in SI units.

    time   (n,) s, strictly increasing, n >= 8
    value  (n,) m, m/s or rad/s according to kind; read-only like time
    kind   "position" or "velocity" of the cart, or "motor_speed"
    quantum  step of the value in its unit, 0 if none was found
    source, column  where it comes from; notes: what was detected, chosen and repaired
    clock  kind of the time stamps: "uniform", "ticks", "jitter" or "on_change" (see `trace.clocks`)
    tick   step of the clock that made them, s, 0 if none is seen
    jitter rms of their steps about the usual one, s; rows that are missing do not count
    """

    time: Array
    value: Array
    kind: str
    quantum: float
    source: str
    column: str
    notes: tuple[str, ...] = ()
    clock: str = "uniform"
    tick: float = 0.0
    jitter: float = 0.0

    def samples(self, ratio: float = 1.0) -> tuple[Kind, Array, float]:
        """What the smoothing takes: position or velocity, (n,) values and quantum, times `ratio`."""
        return (
            "position" if self.kind == "position" else "velocity",
            self.value * ratio,
            abs(ratio) * self.quantum,
        )

    def __repr__(self) -> str:
        return f"<Trace of {self.source}, column {self.column}: {self.kind}, {self.time.size} samples>"


def read_trace(
    table: TableLike,
    *,
    column: str | None = None,
    time: str | None = None,
    kind: str | None = None,
    unit: str | float | None = None,
    rate: float | str | None = None,
    quantum: float | str | None = None,
    clock: str | None = None,
    counter_bits: int | None = None,
    hold: float | None = None,
    date_order: str | None = None,
    max_speed: float | str | None = None,
    allow_gaps: bool = False,
    cross_check: bool = True,
    repair: str | Iterable[str] | None = None,
) -> Trace:
    """Read and check a trace.

    table: path of a CSV (.csv, .txt, any text; TwinCAT Scope exports too), .parquet, .npy or .npz file; or a
        mapping of columns, a data frame, a structured array, or a bare array: (n,) values, or (n, k) with the
        time in column "0", all SI. Separator, decimal sign, names, units and encoding of text are detected.
    column: name of the column; without it the one whose header tells a unit of a kind below. Of several, the
        only measured one (words meas, act, actual, ...) if all others are wanted values (ref, cmd, command,
        ...).
    time: name of the time column; without it the one called t, time, timestamp, Zeit, ... It holds seconds or
        what its header says, dates (ISO 8601, dd.mm.yyyy hh:mm:ss,fff, mm/dd/yyyy hh:mm:ss.fff AM), times of
        day, or with `rate` the cycles of a counter.
    kind: "position" (m), "counts", "velocity" of the cart (m/s) or "motor_speed" (rad/s); without it from the
        unit.
    unit: of the column, such as "mm/s" or "rpm"; without it from the header ("n [rpm]", "speed (mm/s)",
        "q_m") or a row of units below it. For counts: metres of cart travel per count, a number or a string
        such as "5e-8 m".
    rate: samples per second (Hz), in place of a time column; with `time`, cycles per second of that column.
    quantum: step of the value, in the kind's SI unit or as a string; without it detected.
    clock: kind of the time stamps, without it detected. "uniform": even samples, the stamps are put on the
        even grid that fits them best. "ticks" and "jitter": the stamps are taken as they are. "on_change": rows
        are missing where the axis stands still; they are put back with the value held.
    counter_bits: width of a counter of counts that runs over, 0 for one that does not; without it 16, 24 or
        32 bits are recognised by jumps of nearly the whole range.
    hold: rows in which each value stands, of a log that is faster than its signal: only those in which it is new
        are used; 1 takes all rows. Without it detected, unless the motion is too slow (see `trace.holds`).
    date_order: "dmy" or "mdy", of dates such as 03/04/2024; without it from days above 12.
    max_speed: greatest speed that the axis can have, in the kind's SI unit or as a string; replaces the
        automatic test for jumps (see `trace.jumps`).
    allow_gaps: accept steps in time much longer than the usual one, where samples were dropped.
    cross_check: compare position with velocity where the table has both of the same axis.
    repair: damage to leave out, told in the notes with its rows: "all", or some of empty (cells without a
        number), doubled (samples), clock (stamps that go back), outliers and stuck (values held while the
        axis moves). "all" accepts gaps as well.

    Raises TraceError, naming file, column and rows.
    """
    data = load_table(table)
    choices = (
        ("kind", kind, tuple(KINDS)),
        ("clock", clock, CLOCKS),
        ("date_order", date_order, DATE_ORDERS),
    )
    for name, given, known in choices:
        if given is not None and given not in known:
            raise TraceError(f'{data.source}: {name}: expected one of {", ".join(known)}, got "{given}"')
    for asked in (column, time):
        if asked is not None and asked not in data.columns:
            raise TraceError(f"{data.source}: no column {asked!r}; there are {listed(data.names)}")
    damage = wanted(repair)
    stamped = columns.time_column(data, column, time, rate)
    notes = list(data.notes)
    if column is None:
        column, note = columns.choose_column(data, columns.candidates(data, stamped, kind, unit))
        notes.append(note)
    kind, scale = columns.meaning(data, column, kind, unit)
    if rate is None and stamped is None:
        stamped = data.clocks.get(column)
    if counter_bits and kind != "counts":
        raise TraceError(
            f"{data.source}: column {column}: counter_bits: expected none, for {kind} is no counter, got "
            f"{counter_bits}; leave it out, or say kind='counts' (--kind counts)"
        )
    partner = columns.partner_of(data, column) if cross_check and kind in ("position", "velocity") else None
    read = read_samples(
        data, column, stamped, partner, (kind, scale), rate, counter_bits, "empty" in damage, date_order
    )
    is_position = kind in ("position", "counts")
    kind = "position" if is_position else kind
    step = read.step if quantum is None else quantum_given(data, kind, quantum)
    read = fresh_samples(read, hold, step)
    notes += read.notes
    limit = None
    if max_speed is not None:
        limit = columns.positive(data, "max_speed", max_speed, "rad/s" if kind == "motor_speed" else "m/s")
    stamps, kept, done = repaired(
        read.rows, read.time, read.value, damage, is_position, step, limit, int(read.place[-1]) + 1
    )
    notes += done
    rows, values = read.rows.part(kept), read.value[kept]
    checks.check_length(rows, values.size)
    checks.check_order(rows, stamped or "time", stamps)
    left_out = np.diff(read.place[kept]) > 1
    found = clock_of(stamps, values, is_position, step, left_out)
    if stamped is not None:
        notes.append(found.note)
    chosen = clock or found.kind
    open_gaps = found.gaps
    if chosen == "on_change":
        open_gaps = open_gaps[~still_across(values, open_gaps, is_position, step)]
    if open_gaps.size:
        told = checks.told_gaps(rows, stamps, values, open_gaps, is_position, step)
        if not (allow_gaps or repair == "all"):
            raise checks.gaps_refused(rows, stamped or "time", told)
        notes.append(f"{told}; bridged by the smoothing")
    if partner is not None and read.partner is not None:
        other = read.partner[kept] * columns.partner_scale(data, partner, scale)
        both = (values, other) if is_position else (other, values)
        notes.append(checks.check_partner(rows, column, partner, stamps, *both))
    checks.check_jumps(rows, column, stamps, values, kind, limit, step)
    if np.ptp(values) == 0.0:
        moves = values[0] != 0.0 and not is_position
        notes.append("the value never changes: " + ("constant speed" if moves else "no motion"))
    if chosen == "on_change":
        gaps = found.gaps[still_across(values, found.gaps, is_position, step)]
        stamps, values, count = held(stamps, values, gaps, found.step)
        notes.append(
            f"log on change: {count} rows put back where the axis stands still, before {rows.rows(gaps)}"
        )
    elif clock == "uniform":
        stamps, distance = on_grid(stamps, np.union1d(found.gaps, np.flatnonzero(left_out) + 1))
        notes.append(f"stamps put on an even grid, {distance:.3g} s rms from where they were")
    how = "" if quantum is None else ", as given"
    of_motor = kind == "motor_speed"
    shown = f"{step / factor('rpm', 'rad/s'):.3g} rpm" if of_motor else f"{step:.3g} {KINDS[kind]}"
    notes.append(f"{kind} from column {column}, " + (f"quantum {shown}{how}" if step else "no quantum found"))
    for array in (stamps, values):
        array.setflags(write=False)
    return Trace(
        stamps,
        values,
        kind,
        step,
        data.source,
        column,
        tuple(note for note in notes if note),
        chosen,
        found.tick,
        found.jitter * found.step,
    )


def motion_from_trace(
    trace: Trace, drive: Drive | None = None, *, smoothing: Method = "auto", window: float | None = None
) -> Motion:
    """The motion of the cart along x at the trace's time stamps.

    Position is differentiated twice, velocity once, by the one smoothing; velocity is integrated to a
    position that starts at 0. Motor speed needs `drive`, the machine's [drive]. smoothing and window: see
    `smoothing.smooth`. Raises TraceError.
    """
    ratio = 1.0
    if trace.kind == "motor_speed":
        if drive is None:
            raise TraceError(
                f"{trace.source}: column {trace.column} is a motor speed: the machine needs a [drive] with "
                "gear_ratio and pinion_diameter or screw_lead to tell the cart's speed from it"
            )
        ratio = drive.speed_per_motor_speed
    kind, value, quantum = trace.samples(ratio)
    found = smooth(trace.time, value, kind, smoothing, quantum=quantum, window=window)
    return Motion.along_x(
        trace.time,
        found.acceleration,
        velocity=found.velocity,
        position=found.position,
        motor_speed=trace.value if trace.kind == "motor_speed" else None,
        source=f"{trace.source}, column {trace.column}",
        notes=(*trace.notes, found.note),
        bandwidth=found.bandwidth,
        uncertainty=found.uncertainty if isinstance(found, Estimate) else None,
    )
