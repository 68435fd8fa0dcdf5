"""Choice of columns: the measured column, its time column, and the column that the measured one is compared with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from guideload.base.errors import TraceError, ValueRefused
from guideload.base.units import factor, quantity
from guideload.traces.format.headers import (
    COMMAND_WORDS,
    KINDS,
    MEASURED_WORDS,
    POSITION_WORDS,
    VELOCITY_WORDS,
    converts,
    kind_of_unit,
    known_unit,
)
from guideload.traces.format.table import Table, listed
from guideload.traces.options import ReadingOptions

UNITS = "where UNIT is mm, m, mm/s, m/s or rpm"  # in messages


@dataclass(frozen=True)
class Columns:
    """The columns of a trace.

    measured: name of the measured column; kind: one of `headers.KINDS`; scale: factor from its values to SI;
    time: name of the time column, None if the sampling rate gives the time; partner: name of the velocity column of the
    same axis if a position is measured, or the reverse, None if there is none; note: why this measured column, or "".
    """

    measured: str
    kind: str
    scale: float
    time: str | None
    partner: str | None
    note: str


def find_columns(table: Table, options: ReadingOptions) -> Columns:
    """Columns of the trace: named by the options, else recognised by their headers. Raises TraceError."""
    measured, rate = options.get("column"), options.get("rate")
    time, note = find_time_column(table, options), ""
    if measured is not None:
        table.require(measured)
    else:
        measured, note = _measured_column(table, time, options)
    kind, scale = _kind_and_scale(table, measured, options)
    if options.get("counter_bits") and kind != "counts":
        raise TraceError(
            f"column {measured}: counter_bits: expected none, for {kind} is no counter, got "
            f"{options.get('counter_bits')}; leave it out, or say kind='counts' (--kind counts)"
        )
    if rate is None and time is None:
        time = table.clocks.get(measured)
    compared = kind in ("position", "velocity") and options.get("cross_check") is not False
    return Columns(measured, kind, scale, time, _find_partner(table, measured) if compared else None, note)


def find_time_column(table: Table, options: ReadingOptions) -> str | None:
    """Name of the time column; None if the sampling rate is given, or if each channel has its own time.

    Raises TraceError if there is no time column, or more than one.
    """
    time, rate = options.get("time"), options.get("rate")
    if time is not None:
        table.require(time)
        if rate is not None and not _counts_cycles(table, time):
            raise TraceError(
                f"expected either time or rate, got time={time!r} and rate={rate!r}; together "
                "they are for a column that counts cycles, without a unit of time"
            )
        return time
    if rate is not None or table.clocks or table.rate is not None:
        return None
    if not table.named and len(table.names) > 1:
        return "0"
    others = [name for name in table.columns if name != options.get("column")]
    names = [name for name in table.time_names if name in others]
    odd = [name for name in others if name not in names and table.header(name).is_time_in_unknown_unit]
    if not names and options.get("time_unit") is not None:
        names = odd
    if len(names) > 1:  # with a time of day, a column of dates is ignored
        names = [name for name in names if not _is_date(table, name)] or names
    if len(names) == 1:
        return names[0]
    if names:
        raise TraceError(
            f"{len(names)} columns could be the time: {', '.join(names)}; choose with time=NAME (--time NAME)"
        )
    first = [name for name in table.names[:1] if table.is_row_number(name)]
    hint = f"; the first column ({first[0]}) holds row numbers, not time" if first else ""
    if odd:
        raise TraceError(
            f'column {odd[0]}: expected a unit of time, got "{table.header(odd[0]).unit}"; give the right one with '
            f"time_unit='ms' (--time-unit ms), or the counts per second with time={odd[0]!r}, rate=1000 "
            f'(--time "{odd[0]}" --rate 1000)'
        )
    raise TraceError(
        f"no time column among {listed(table.names)}{hint}; give the samples per second "
        "with rate=1000 (--rate 1000), or name the column with time=NAME (--time NAME)"
    )


def _counts_cycles(table: Table, name: str) -> bool:
    """Whether a column may count cycles of a clock: whole numbers without a unit of time."""
    if converts(table.header(name).unit, "s") or table.is_stamped(name):
        return False
    values = table.values(name)
    return bool(np.all((values == np.round(values)) | np.isnan(values)))


def _is_date(table: Table, name: str) -> bool:
    """Whether a column holds dates without a time of day."""
    column = np.asarray(table.columns[name])
    if column.dtype.kind == "M":
        return bool(np.all((column == column.astype("M8[D]")) | np.isnat(column)))
    text = table.first_text(name)
    return bool(text) and ":" not in text


def _measured_column(table: Table, time: str | None, options: ReadingOptions) -> tuple[str, str]:
    """Name of the measured column, and a note on its choice.

    It is the only column whose header has a unit of motion, of the given unit or kind if there is one; with these, also
    the only column whose name says that kind. Of several columns, it is the measured one if all others are commands.
    Raises TraceError with the columns and how to choose.
    """
    kind, unit = options.get("kind"), options.get("unit")
    clocks = {time, *table.clocks.values(), *table.time_names}
    headers = {name: table.header(name) for name in table.columns if name not in clocks}
    if kind is None and isinstance(unit, str):
        kind = kind_of_unit(known_unit(unit)) or None
    names = [name for name, header in headers.items() if header.kind and kind in (None, header.kind)]
    if not names and kind is not None:
        no_unit = {name: header.word_kind for name, header in headers.items() if not header.unit}
        names = [name for name, word_kind in no_unit.items() if word_kind == kind]
        if not names and kind == "motor_speed":  # a name such as "Speed" does not say of what
            names = [name for name, word_kind in no_unit.items() if word_kind == "velocity"]
        names = names or (list(headers) if len(headers) == 1 else [])
    if len(names) == 1:
        return names[0], f"column {names[0]}, the only one that fits"
    measured = [name for name in names if MEASURED_WORDS.intersection(headers[name].words)]
    others = [name for name in names if name not in measured]
    if len(measured) == 1 and all(COMMAND_WORDS.intersection(headers[name].words) for name in others):
        return measured[0], f"column {measured[0]}: measured, {', '.join(others)} not"
    if names:
        raise TraceError(
            f"{len(names)} columns could be meant: {listed(names)}; choose one, as in "
            f'column={names[0]!r} (--column "{names[0]}")'
        )
    choice = [name for name, header in headers.items() if header.word_kind] or list(headers)
    name, quoted = (repr(choice[0]), f'"{choice[0]}"') if len(choice) == 1 else ("NAME", "NAME")
    written = headers[choice[0]].unit if len(choice) == 1 else ""
    got = f', got "{written}"' if written else ""
    raise TraceError(
        f"no header gives a unit of motion: {listed(choice)}{got}; choose a column and give its unit: column={name}, "
        f"unit=UNIT (--column {quoted} --unit UNIT), {UNITS}; of a counter the travel per count: kind='counts', "
        "unit='5e-8 m' (--kind counts --unit '5e-8 m')"
    )


def _kind_and_scale(table: Table, name: str, options: ReadingOptions) -> tuple[str, float]:
    """Kind of the column, and the factor from its values to SI. Raises TraceError."""
    place, header = f"column {name}", table.header(name)
    kind, unit = options.get("kind"), options.get("unit")
    kind = "counts" if kind is None and header.unit == "counts" else kind
    if kind == "counts":
        if unit is None:
            raise TraceError(f"{place}: counts need the travel per count: unit='5e-8 m' (--unit '5e-8 m')")
        scale = option_in_si("unit", unit, "m")
        if scale == 0.0:
            raise TraceError(f"{place}: unit: expected metres per count, got 0")
        return kind, scale
    if unit is not None and not isinstance(unit, str):
        raise TraceError(f"{place}: unit: expected a string such as 'mm/s', got {unit!r}")
    written = (known_unit(unit) or unit) if unit else header.unit
    if not written:
        if kind is not None and not table.named:
            return kind, 1.0
        raise TraceError(
            f"{place}: the header gives no unit; give it: unit=UNIT (--unit UNIT), {UNITS}"
            + ("" if table.named else f", or the kind of these SI values: {', '.join(KINDS)}")
        )
    meant = kind or kind_of_unit(written)
    if unit and kind is None and {meant, header.word_kind} == {"position", "velocity"}:
        raise TraceError(
            f"{place}: unit: the name says {header.word_kind}, {written} is a unit of {meant}; give a unit of "
            f"{header.word_kind}, or the kind as well, if the name misleads: kind='{meant}' (--kind {meant})"
        )
    try:
        return meant, factor(written, KINDS.get(meant, "m/s"))  # raises if the unit is of no kind
    except ValueRefused as error:
        raise TraceError(f"{place}: unit: {error}") from None


def _find_partner(table: Table, name: str) -> str | None:
    """The velocity column of the same axis as the position column `name`, or the reverse; None if not exactly one.

    The headers have the same words, except that for position or velocity; the columns have the same time stamps.
    """

    def masked(column: str, words: set[str]) -> tuple[list[str], str | None]:
        """Words of the header with * for one of `words`, and the time column."""
        found = ["*" if word in words else word for word in table.header(column).words]
        return found, table.clocks.get(column)

    for words, partner_words in ((POSITION_WORDS, VELOCITY_WORDS), (VELOCITY_WORDS, POSITION_WORDS)):
        wanted = masked(name, words)
        partners = [partner for partner in table.columns if masked(partner, partner_words) == wanted]
        if "*" in wanted[0] and len(partners) == 1:
            return partners[0]
    return None


def option_in_si(name: str, value: float | str, unit: str, sign: str = "") -> float:
    """Value of a reading option in SI. Raises TraceError if it is not `sign` 0, where sign is ">" or ">="."""
    try:
        number = quantity(value, unit)
    except ValueRefused as error:
        raise TraceError(f"{name}: {error}") from None
    if sign and (number < 0.0 or (sign == ">" and number == 0.0)):
        option = f"--{name.replace('_', '-')}"
        raise TraceError(f"{name}: expected {sign} 0 {unit}, got {number:g} ({option})")
    return number
