"""Which columns of a table are meant: the measured one, its time, and the partner it can be compared with."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from guideload.base.errors import TraceError, ValueRefused
from guideload.base.units import factor, quantity
from guideload.traces.format.headers import (
    KINDS,
    MEASURED_WORDS,
    POSITION_WORDS,
    VELOCITY_WORDS,
    WANTED_WORDS,
    kind_of_unit,
    known_unit,
)
from guideload.traces.format.table import Table, listed


def time_column(data: Table, column: str | None, time: str | None, rate: float | str | None) -> str | None:
    """The name of the time column; None where the rate is given, or each channel has its own time.

    Raises TraceError where no time is to be had, or two.
    """
    if time is not None:
        if rate is not None and not counts_cycles(data, time):
            raise TraceError(
                f"{data.source}: expected either time or rate, got time={time!r} and rate={rate!r}; together "
                "they are for a column that counts cycles, without a unit of time"
            )
        return time
    if rate is not None or data.clocks or data.rate is not None:
        return None
    if not data.named and len(data.names) > 1:
        return "0"
    found = [name for name in data.names if data.header(name).is_time and name != column]
    if len(found) > 1:  # a day beside a time of day tells nothing more
        found = [name for name in found if not _is_day(data, name)] or found
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


def counts_cycles(data: Table, name: str) -> bool:
    """Whether a column may count cycles of a clock: whole numbers without a unit of time."""
    if data.header(name).unit not in ("", "counts") or data.is_stamped(name):
        return False
    values = data.values(name)
    return bool(np.all((values == np.round(values)) | np.isnan(values)))


def _is_day(data: Table, name: str) -> bool:
    """Whether a column holds days without a time of day."""
    column = np.asarray(data.columns[name])
    if column.dtype.kind == "M":
        return bool(np.all((column == column.astype("M8[D]")) | np.isnat(column)))
    cell = next((cell for cell in column if isinstance(cell, str)), "") if column.dtype.kind in "OUT" else ""
    return bool(cell) and ":" not in cell


def candidates(data: Table, clock: str | None, kind: str | None, unit: str | float | None) -> list[str]:
    """Columns that may be meant: by the header's unit; if a unit or kind is given, by the header's words as
    well."""
    clocks = {clock, *data.clocks.values()}
    others = [name for name in data.names if name not in clocks and not data.header(name).is_time]
    wanted = kind
    if wanted is None and isinstance(unit, str):
        wanted = kind_of_unit(known_unit(unit)) or None
    headers = {name: data.header(name) for name in others}
    by_unit = [name for name in others if headers[name].kind and wanted in (None, headers[name].kind)]
    if by_unit or wanted is None:
        return by_unit
    by_word = [name for name in others if not headers[name].unit and headers[name].word_kind == wanted]
    return by_word or (others if len(others) == 1 else [])


def choose_column(data: Table, found: Sequence[str]) -> tuple[str, str]:
    """The one column of several that is measured while all others are wanted values, and a note that says so.

    Raises TraceError with the columns and how to choose where that does not tell.
    """
    if len(found) == 1:
        return found[0], f"column {found[0]}, the only one that fits"
    words = {name: set(data.header(name).words) for name in found}
    measured = [name for name in found if words[name] & MEASURED_WORDS]
    rest = [name for name in found if name not in measured]
    if len(measured) == 1 and all(words[name] & WANTED_WORDS for name in rest):
        return measured[0], f"column {measured[0]}: measured, {', '.join(rest)} not"
    count = f"{len(found)} columns could be meant" if found else "no column tells what it is"
    others = [
        name for name in data.names if not data.header(name).is_time and name not in data.clocks.values()
    ]
    telling = [name for name in others if data.header(name).word_kind]
    raise TraceError(
        f"{data.source}: {count}: {listed(found or telling or others)}; "
        "choose one, as in column=NAME, unit='mm/s', kind='velocity' "
        "(--column NAME --unit mm/s --kind velocity)"
    )


def meaning(data: Table, column: str, kind: str | None, unit: str | float | None) -> tuple[str, float]:
    """Kind and factor to SI of the column. Raises TraceError."""
    place = f"{data.source}: column {column}"
    header = data.header(column)
    if kind is None and header.unit == "counts":
        kind = "counts"
    if kind == "counts":
        if unit is None:
            raise TraceError(
                f"{place}: counts need the cart's travel per count: unit='5e-8 m' (--unit '5e-8 m')"
            )
        scale = argument(data, "unit", unit, "m")
        if scale == 0.0:
            raise TraceError(f"{place}: unit: expected metres per count, got 0")
        return kind, scale
    if unit is not None and not isinstance(unit, str):
        raise TraceError(f"{place}: unit: expected a string such as 'mm/s', got {unit!r}")
    written = (known_unit(unit) or unit) if unit else header.unit
    if not written:
        if kind is not None and not data.named:
            return kind, 1.0
        raise TraceError(
            f"{place}: the header tells no unit; give it, as in unit='mm/s' (--unit mm/s)"
            + ("" if data.named else f", or the kind of these SI values: {', '.join(KINDS)}")
        )
    meant = kind or kind_of_unit(written)
    if unit and kind is None and {meant, header.word_kind} == {"position", "velocity"}:
        raise TraceError(
            f"{place}: unit: the name says {header.word_kind}, {written} is a unit of {meant}; give a unit of "
            f"{header.word_kind}, or the kind as well, if the name misleads: kind='{meant}' (--kind {meant})"
        )
    try:
        return meant, factor(written, KINDS.get(meant, "m/s"))  # no kind: no speed either, so this raises
    except ValueRefused as error:
        raise TraceError(f"{place}: unit: {error}") from None


def partner_of(data: Table, name: str) -> str | None:
    """The column that holds the velocity of the position `name`, or the reverse: the same header but for that
    word, and on the same clock."""

    def swapped(text: str, old: Sequence[str], new: str) -> str:
        return " ".join(new if word in old else word for word in data.header(text).words)

    words = data.header(name).words
    for own, other in ((POSITION_WORDS, VELOCITY_WORDS), (VELOCITY_WORDS, POSITION_WORDS)):
        if any(word in own for word in words):
            goal = swapped(name, own, "*")
            found = [
                other_name
                for other_name in data.names
                if any(word in other for word in data.header(other_name).words)
                and swapped(other_name, other, "*") == goal
                and data.clocks.get(other_name) == data.clocks.get(name)
            ]
            if len(found) == 1:
                return found[0]
    return None


def partner_scale(data: Table, partner: str, scale: float) -> float:
    """Factor to SI of the partner: its header's unit, else the column's own with or without "per second"."""
    header = data.header(partner)
    return factor(header.unit, KINDS[header.kind]) if header.kind in ("position", "velocity") else scale


def argument(data: Table, name: str, value: float | str, unit: str) -> float:
    """An argument of the reading in SI. Raises TraceError."""
    try:
        return quantity(value, unit)
    except ValueRefused as error:
        raise TraceError(f"{data.source}: {name}: {error}") from None


def positive(data: Table, name: str, value: float | str, unit: str) -> float:
    """An argument of the reading in SI, above 0. Raises TraceError."""
    number = argument(data, name, value, unit)
    if number <= 0.0:
        option = f"--{name.replace('_', '-')}"
        raise TraceError(f"{data.source}: {name}: expected > 0 {unit}, got {number:g} ({option})")
    return number
