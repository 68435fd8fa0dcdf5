"""From a measured trace to the motion that excites the scene: read, check, smooth.

A trace is one column of a table (position, counts, velocity of the cart, or speed of the motor) and its time
stamps. Nothing in it is repaired silently: what cannot be used is refused with its rows named.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from guideload import trace_checks as checks
from guideload.errors import TraceError, ValueRefused
from guideload.motion import Motion
from guideload.smoothing import Kind, Method, quantum_of, smooth
from guideload.trace_table import (
    KINDS,
    Header,
    Table,
    choose_column,
    kind_of_unit,
    listed,
    load_table,
    partner_of,
)
from guideload.units import factor, quantity

if TYPE_CHECKING:
    from guideload.parts import Drive
    from guideload.trace_table import TableLike

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Trace:
    """A checked trace in SI units.

    time   (n,) s, strictly increasing, n >= 8
    value  (n,) m, m/s or rad/s according to kind; read-only like time
    kind   "position" or "velocity" of the cart, or "motor_speed"
    quantum  step of the value in its unit, 0 if none was found
    source, column  where it comes from; notes: what was detected and chosen
    """

    time: Array
    value: Array
    kind: str
    quantum: float
    source: str
    column: str
    notes: tuple[str, ...] = ()


def read_trace(
    table: TableLike,
    *,
    column: str | None = None,
    time: str | None = None,
    kind: str | None = None,
    unit: str | float | None = None,
    rate: float | str | None = None,
    max_speed: float | str | None = None,
    allow_gaps: bool = False,
    cross_check: bool = True,
) -> Trace:
    """Read and check a trace.

    table: path of a CSV (.csv, .txt, any text), .parquet, .npy or .npz file; or a mapping of columns, a data
        frame, a structured array, or a bare array: (n,) values, or (n, k) with the time in column "0", all
        SI.
    column: name of the column; without it the one whose header tells a unit of a kind below. Of several, the
        only measured one (words meas, act, actual, ...) if all others are wanted values (ref, cmd, command,
        ...).
    time: name of the time column; without it the one called t, time, timestamp, ...
    kind: "position" (m), "counts", "velocity" of the cart (m/s) or "motor_speed" (rad/s); without it from the
        unit.
    unit: of the column, such as "mm/s" or "rpm"; without it from the header ("n [rpm]", "speed (mm/s)",
        "q_m"). For counts: metres of cart travel per count, a number or a string such as "5e-8 m".
    rate: samples per second (Hz), in place of a time column.
    max_speed: greatest speed that the axis can have, in the kind's SI unit or as a string; replaces the
        automatic test for jumps (`trace_checks.check_jumps`).
    allow_gaps: accept steps in time much longer than the usual one, as logs that record on change have them.
    cross_check: compare position with velocity where the table has both of the same axis.

    Raises TraceError, naming file, column and rows.
    """
    data = load_table(table)
    notes = list(data.notes)
    if kind is not None and kind not in KINDS:
        raise TraceError(f'{data.source}: kind: expected one of {", ".join(KINDS)}, got "{kind}"')
    for name in (column, time):
        if name is not None and name not in data.columns:
            raise TraceError(f"{data.source}: no column {name!r}; there are {listed(data.names)}")
    clock = _time_column(data, column, time, rate)
    if column is None:
        column, note = choose_column(data, _candidates(data, clock, kind, unit))
        notes.append(note)
    kind, scale = _meaning(data, column, kind, unit)
    count = len(data.columns[column])
    checks.check_length(data, count)
    value = data.numbers(column)
    whole = kind == "counts" and bool(np.all(value == np.round(value)))
    if kind == "counts":
        value = value - value[0]  # absolute counters are too large to keep their last digits as metres
    value = value * scale
    stamps, clock_name, note = _stamps(data, clock, rate, count)
    notes.append(note)
    checks.check_order(data, clock_name, stamps)
    notes.append(checks.check_gaps(data, clock_name, stamps, value, allow_gaps))
    partner = partner_of(column, data.names) if cross_check and kind in ("position", "velocity") else None
    if partner is not None:
        try:
            other = data.numbers(partner) * _partner_scale(data, partner, scale)
        except TraceError:  # nobody asked for that column: it takes no part, and the note says so
            notes.append(f"column {partner} not compared with {column}: it has cells without a number")
        else:
            both = (value, other) if kind == "position" else (other, value)
            notes.append(checks.check_partner(data, column, partner, stamps, *both))
    limit = None if max_speed is None else _positive(data, "max_speed", max_speed, _speed_unit(kind))
    checks.check_jumps(data, column, stamps, value, kind, limit)
    if np.ptp(value) == 0.0:
        moves = value[0] != 0.0 and kind in ("velocity", "motor_speed")
        notes.append("the value never changes: " + ("constant speed" if moves else "no motion"))
    kind = "position" if kind == "counts" else kind
    step = abs(scale) if whole else quantum_of(value)
    told = f"quantum {step:.3g} {KINDS[kind]}" if step else "no quantum found"
    notes.append(f"{kind} from column {column}, {told}")
    for array in (stamps, value):
        array.setflags(write=False)
    return Trace(stamps, value, kind, step, data.source, column, tuple(note for note in notes if note))


def motion_from_trace(
    trace: Trace, drive: Drive | None = None, *, smoothing: Method = "auto", window: float | None = None
) -> Motion:
    """The motion of the cart along x at the trace's time stamps.

    Position is differentiated twice, velocity once, by the one smoothing; velocity is integrated to a
    position that starts at 0. Motor speed needs `drive`, the machine's [drive]. smoothing and window: see
    `smoothing.smooth`. Raises TraceError.
    """
    kind: Kind = "position" if trace.kind == "position" else "velocity"
    ratio = 1.0
    if trace.kind == "motor_speed":
        if drive is None:
            raise TraceError(
                f"{trace.source}: column {trace.column} is a motor speed: the machine needs a [drive] with "
                "gear_ratio and pinion_diameter or screw_lead to tell the cart's speed from it"
            )
        ratio = drive.speed_per_motor_speed
    found = smooth(
        trace.time, trace.value * ratio, kind, smoothing, quantum=abs(ratio) * trace.quantum, window=window
    )
    return Motion.along_x(
        trace.time,
        found.acceleration,
        velocity=found.velocity,
        position=found.position,
        motor_speed=trace.value if trace.kind == "motor_speed" else None,
        source=f"{trace.source}, column {trace.column}",
        notes=(*trace.notes, found.note),
    )


def _time_column(data: Table, column: str | None, time: str | None, rate: float | str | None) -> str | None:
    """The name of the time column, None if a rate is given. Raises TraceError where neither is to be had."""
    if rate is not None:
        if time is not None:
            raise TraceError(
                f"{data.source}: expected either time or rate, got time={time!r} and rate={rate!r}"
            )
        return None
    if time is not None:
        return time
    if not data.named and len(data.names) > 1:
        return "0"
    found = [name for name in data.names if Header.of(name).is_time and name != column]
    if len(found) == 1:
        return found[0]
    if found:
        raise TraceError(
            f"{data.source}: {len(found)} columns could be the time: {', '.join(found)}; "
            "choose with time=NAME (--time NAME)"
        )
    first = data.names[0] if data.names else ""
    count = ""
    if first and data.is_row_number(first):
        count = f"; the first column ({first}) is a mere row number, which tells no time"
    raise TraceError(
        f"{data.source}: no time column among {listed(data.names)}{count}; give the samples per second "
        "with rate=1000 (--rate 1000), or name the column with time=NAME (--time NAME)"
    )


def _candidates(data: Table, clock: str | None, kind: str | None, unit: str | float | None) -> list[str]:
    """Columns that may be meant: by the header's unit; if a unit or kind is given, by the header's words as
    well."""
    others = [name for name in data.names if name != clock and not Header.of(name).is_time]
    wanted = kind
    if wanted is None and isinstance(unit, str):
        wanted = kind_of_unit(unit) or None
    by_unit = [name for name in others if Header.of(name).kind and wanted in (None, Header.of(name).kind)]
    if by_unit or wanted is None:
        return by_unit
    by_word = [name for name in others if not Header.of(name).unit and Header.of(name).word_kind == wanted]
    return by_word or (others if len(others) == 1 else [])


def _meaning(data: Table, column: str, kind: str | None, unit: str | float | None) -> tuple[str, float]:
    """Kind and factor to SI of the column."""
    place = f"{data.source}: column {column}"
    header = Header.of(column)
    if kind is None and header.unit == "counts":
        kind = "counts"
    if kind == "counts":
        if unit is None:
            raise TraceError(
                f"{place}: counts need the cart's travel per count: unit='5e-8 m' (--unit '5e-8 m')"
            )
        scale = _argument(data, "unit", unit, "m")
        if scale == 0.0:
            raise TraceError(f"{place}: unit: expected metres per count, got 0")
        return kind, scale
    if unit is not None and not isinstance(unit, str):
        raise TraceError(f"{place}: unit: expected a string such as 'mm/s', got {unit!r}")
    written = unit or header.unit
    if not written:
        if kind is not None and not data.named:
            return kind, 1.0
        raise TraceError(
            f"{place}: the header tells no unit; give it, as in unit='mm/s' (--unit mm/s)"
            + ("" if data.named else f", or the kind of these SI values: {', '.join(KINDS)}")
        )
    meant = kind or kind_of_unit(written)
    try:
        return meant, factor(written, KINDS.get(meant, "m/s"))  # no kind: no speed either, so this raises
    except ValueRefused as error:
        raise TraceError(f"{place}: unit: {error}") from None


def _stamps(data: Table, clock: str | None, rate: float | str | None, count: int) -> tuple[Array, str, str]:
    """Time stamps in s, the name they have in errors, and a note."""
    if clock is None:
        assert rate is not None
        per_second = _positive(data, "rate", rate, "Hz")
        unused = [name for name in data.names if Header.of(name).is_time]
        note = f"time from the rate {per_second:g} Hz" + (f"; column {unused[0]} not used" if unused else "")
        return np.arange(count) / per_second, "time", note
    unit = Header.of(clock).unit
    stamps = data.numbers(clock)
    try:
        scale = factor(unit, "s") if unit else 1.0
    except ValueRefused as error:
        raise TraceError(f"{data.source}: column {clock}: {error}") from None
    told = "" if unit or not data.named else " (the header tells no unit)"
    return stamps * scale, clock, f"time from column {clock} in {unit or 's'}{told}"


def _partner_scale(data: Table, partner: str, scale: float) -> float:
    """Factor to SI of the partner: its header's unit, else the column's own with or without "per second"."""
    header = Header.of(partner)
    return factor(header.unit, KINDS[header.kind]) if header.kind in ("position", "velocity") else scale


def _speed_unit(kind: str) -> str:
    return "rad/s" if kind == "motor_speed" else "m/s"


def _argument(data: Table, name: str, value: float | str, unit: str) -> float:
    try:
        return quantity(value, unit)
    except ValueRefused as error:
        raise TraceError(f"{data.source}: {name}: {error}") from None


def _positive(data: Table, name: str, value: float | str, unit: str) -> float:
    number = _argument(data, name, value, unit)
    if number <= 0.0:
        option = f"--{name.replace('_', '-')}"
        raise TraceError(f"{data.source}: {name}: expected > 0 {unit}, got {number:g} ({option})")
    return number
