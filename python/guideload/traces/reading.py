"""From a measured trace to the motion that excites the scene: read, check, smooth.

A trace is one column of a table (position, counts, velocity of the cart, or speed of the motor) and its time
stamps. Samples that cannot be used are refused with their rows, or left out if the user chooses it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from guideload.base.arguments import checked, require_type
from guideload.base.arrays import Array, ReadOnlyArrays, errors_name
from guideload.base.errors import TraceError, shown
from guideload.motion.histories import checked_history
from guideload.motion.motion import Motion
from guideload.motion.origin import Origin
from guideload.smoothing.estimation import MotionEstimate, noise_warnings
from guideload.smoothing.kinematics import across_gaps
from guideload.smoothing.smoothing import Kind, Method, smooth
from guideload.traces.content.columns import find_columns, option_in_si
from guideload.traces.content.samples import FEWEST_SAMPLES, quantum_note, read_samples
from guideload.traces.content.stamps import DATE_ORDERS
from guideload.traces.format.headers import KINDS
from guideload.traces.format.sources import load_table
from guideload.traces.options import ReadingOptions, with_reading_options
from guideload.traces.quality.checks import check_gaps, check_jumps, check_order, check_partner
from guideload.traces.quality.clocks import CLOCKS, apply_clock, detect_clock
from guideload.traces.quality.holds import use_new_values
from guideload.traces.quality.repair import parse_repairs, repair

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from guideload.machine.drive import Drive
    from guideload.traces.format.sources import TableLike
    from guideload.traces.format.table import Table

# Allowed words of options.
KINDS_OF_TRACE = tuple(kind for kind in KINDS if kind != "counts")  # counts become positions
WORDS = {"kind": tuple(KINDS), "clock": CLOCKS, "date_order": DATE_ORDERS}


@dataclass(frozen=True, eq=False)
class Trace(ReadOnlyArrays):
    """A checked trace in SI units.

    time     (n,) s, strictly increasing, n >= 8
    value    (n,) m, m/s or rad/s according to kind
    kind     "position" or "velocity" of the cart, or "motor_speed"
    quantum  smallest change of the value in its unit, 0 if unknown
    source   name of the file or table; column: name of the measured column
    notes    what was detected, chosen and repaired
    warnings what speaks against the samples
    clock    kind of the time stamps: "uniform", "ticks", "jitter" or "on_change" (see `quality.clocks`)
    tick     resolution of the clock, s, 0 if unknown
    jitter   rms deviation of the steps of time from the median, s; missing rows do not count
    origin   the instant from which the stamps count: a date (datetime64), or a time of day, duration or count of a
             clock (timedelta64; NaT for rows of a rate); None for numbers as they stand in the file

    The arrays are read-only copies in float64. Raises TraceError with the field and the way out.
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
    warnings: tuple[str, ...] = ()
    origin: Origin = None

    def __post_init__(self) -> None:
        for name, known in (("kind", KINDS_OF_TRACE), ("clock", CLOCKS)):
            if (word := getattr(self, name)) not in known:
                raise TraceError(f"{name}: expected one of {', '.join(known)}, got {shown(word)}")
        require_type("origin", self.origin, Origin)
        for name in ("quantum", "tick", "jitter"):
            require_type(name, size := getattr(self, name), float)
            if not 0.0 <= size < np.inf:
                raise TraceError(f"{name}: expected a finite number >= 0, 0 if it is unknown, got {size:g}")
        for name in ("time", "value"):
            values = checked_history(name, getattr(self, name), (np.size(self.time),))
            object.__setattr__(self, name, values)
        if self.time.size < FEWEST_SAMPLES:
            raise TraceError(f"time: expected at least {FEWEST_SAMPLES} stamps, got {self.time.size}")
        if (back := np.flatnonzero(np.diff(self.time) <= 0.0) + 1).size:
            raise TraceError(
                f"time[{back[0]}]: expected more than the stamp before it, got {self.time[back[0]]:g}"
            )

    def samples(self, drive: Drive | None = None) -> tuple[Kind, Array, float]:
        """Kind, values (n,) and quantum for the smoothing; with a drive, a motor speed becomes the cart's."""
        kind: Kind = "position" if self.kind == "position" else "velocity"
        ratio = drive.speed_per_motor_speed if drive and self.kind == "motor_speed" else 1.0
        return kind, self.value * ratio, abs(ratio) * self.quantum

    def __repr__(self) -> str:
        return f"<Trace of {self.source}, column {self.column}: {self.kind}, {self.time.size} samples>"


# Longer than 60 lines because its docstring describes every option.
@checked
@with_reading_options
def read_trace(table: TableLike, **options: Unpack[ReadingOptions]) -> Trace:
    """Read and check a trace.

    table: path of a CSV (.csv, .txt, any text; TwinCAT Scope exports too), .parquet, .npy, .npz or .mat file; or a
        mapping of columns, a data frame, a structured array, or a bare array: (n,) values, or (n, k) with the
        time in column "0", all SI. Separator, decimal sign, names, units and encoding of text are detected.
    column: name of the measured column; by default the only one whose header gives a unit of a kind below, or of
        several the only measured one (words meas, act, actual, ...) if all others are commands (ref, cmd, ...).
    time: name of the time column; by default the one called t, time, timestamp, Zeit, ... It holds seconds or the
        unit in its header, dates (ISO 8601, dd.mm.yyyy hh:mm:ss,fff, mm/dd/yyyy hh:mm:ss.fff AM), times of day, or
        with `rate` a count of cycles.
    kind: "position" (m), "counts", "velocity" of the cart (m/s) or "motor_speed" (rad/s); by default the
        kind of the unit.
    unit: of the column, such as "mm/s" or "rpm"; by default from the header ("n [rpm]", "speed (mm/s)", "q_m") or a
        row of units below it. For counts: travel of the cart per count, in metres or as a string such as "5e-8 m".
    time_unit: unit of the time column, such as "ms"; by default from its header, else s.
    rate: samples per second (Hz), in place of a time column; with `time`, counts of that column per second.
    quantum: smallest change of the value, in the kind's SI unit or as a string; by default detected.
    clock: kind of the time stamps, by default detected. "uniform": the stamps are put on the uniform grid that fits
        them best. "ticks" and "jitter": the stamps are used as they are. "on_change": rows are missing at
        standstill; they are inserted with the last value.
    counter_bits: width of a counter that wraps around, 0 for one that does not; by default 16, 24 or 32 bits are
        recognised by jumps of nearly the full range.
    hold: oversampling ratio, rows per new value in a log that is faster than its signal: only rows with a new value
        are used; 1 uses all rows. By default detected, unless the motion is too slow (see `quality.holds`).
    date_order: "dmy" or "mdy", of dates such as 03/04/2024; by default from days above 12.
    max_speed: greatest speed that the axis can have, in the SI unit of a speed or as a string; replaces the automatic
        test for jumps (see `quality.jumps`).
    allow_gaps: accept steps in time much longer than the usual one, where samples are missing.
    cross_check: compare position with velocity where the table has both of the same axis (the default).
    repair: damage to leave out, with its rows in the notes: "all", or some of empty (cells without a number),
        doubled (samples), clock (stamps that go back), outliers and stuck (values that repeat while the axis moves).
        "all" accepts gaps as well.

    Raises TraceError, naming file, column and rows; ReadError, which is one, for a file that is missing or damaged;
    ArgumentTypeError for an unknown option.
    """
    data = load_table(table)
    with errors_name(data.source):
        return _read(data, options)


def _read(data: Table, options: ReadingOptions) -> Trace:
    """The trace of a table; see `read_trace`."""
    _check_options(options)
    kinds_of_damage = parse_repairs(options.get("repair"))
    draft = read_samples(data, find_columns(data, options), options, "empty" in kinds_of_damage)
    use_new_values(draft, options.get("hold"))
    max_speed = options.get("max_speed")
    if max_speed is not None:
        unit = "m/s" if draft.is_position else draft.unit
        max_speed = option_in_si("max_speed", max_speed, unit, ">")
    repair(draft, kinds_of_damage, max_speed)
    check_order(draft)
    is_left_out = np.diff(draft.place) > 1
    clock = detect_clock(draft.time, draft.value, draft.is_position, draft.quantum, is_left_out)
    if draft.columns.time is not None:
        draft.notes.append(clock.note)
    clock_kind = options.get("clock") or clock.kind
    check_gaps(draft, clock, clock_kind, bool(options.get("allow_gaps")) or options.get("repair") == "all")
    check_partner(draft)
    check_jumps(draft, max_speed)
    if np.ptp(draft.value) == 0.0:
        moves = draft.value[0] != 0.0 and not draft.is_position
        draft.notes.append("the value never changes: " + ("constant speed" if moves else "no motion"))
    apply_clock(draft, clock, clock_kind, options.get("clock"))
    draft.notes.append(quantum_note(draft, is_given=options.get("quantum") is not None))
    return Trace(
        time=draft.time,
        value=draft.value,
        kind=draft.kind,
        quantum=draft.quantum,
        source=data.source,
        column=draft.columns.measured,
        notes=tuple(note for note in draft.notes if note),
        clock=clock_kind,
        tick=clock.tick,
        jitter=clock.jitter * clock.step,
        warnings=tuple(draft.warnings),
        origin=draft.origin,
    )


def _check_options(options: ReadingOptions) -> None:
    """Raise TraceError for an unknown word as the value of an option."""
    for name, value in options.items():
        if value is not None and value not in WORDS.get(name, (value,)):
            raise TraceError(f'{name}: expected one of {", ".join(WORDS[name])}, got "{value}"')


@checked
def motion_from_trace(
    trace: Trace, drive: Drive | None = None, *, smoothing: Method = "auto", window: float | None = None
) -> Motion:
    """The motion of the cart along x at the trace's time stamps.

    Position is differentiated twice, velocity once, by one smoothing; velocity is integrated to a
    position that starts at 0. Motor speed needs `drive`, the machine's [drive]. smoothing and window: see
    `smoothing.smooth`. Across a gap of more than 100 steps the cart moves at constant speed from position to position;
    between speeds it stands still. Raises TraceError.
    """
    is_motor_speed = trace.kind == "motor_speed"
    if is_motor_speed and drive is None:
        raise TraceError(
            f"{trace.source}: column {trace.column} is a motor speed: the machine needs a [drive] with "
            "gear_ratio and pinion_diameter, pulley_diameter or screw_lead to convert it to the cart's speed"
        )
    kind, value, quantum = trace.samples(drive)
    with errors_name(trace.source):
        smoothed = smooth(trace.time, value, kind, smoothing, quantum=quantum, window=window)
        smoothed = across_gaps(smoothed, trace.time, value, kind, quantum)
        return Motion.along_x(
            trace.time,
            smoothed.acceleration,
            velocity=smoothed.velocity,
            position=smoothed.position,
            motor_speed=trace.value if is_motor_speed else None,
            source=f"{trace.source}, column {trace.column}",
            notes=(*trace.notes, smoothed.note),
            bandwidth=smoothed.bandwidth,
            uncertainty=smoothed.uncertainty if isinstance(smoothed, MotionEstimate) else None,
            recorded=True,
            warnings=(*trace.warnings, *noise_warnings(smoothed)),
            origin=trace.origin,
        )
