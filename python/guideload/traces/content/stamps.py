"""Time stamps in seconds from what stands in a time column: numbers, counts of a clock, dates, times of day."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Array
from guideload.base.errors import TraceError, ValueRefused
from guideload.base.units import factor
from guideload.traces.content.counters import unwrap
from guideload.traces.format.table import Table

DAY = 86_400_000_000_000  # ns
# Numbers without a unit that can only be a date: seconds, ms, us or ns since 1970 between 2001 and 2100, and
# Windows' FILETIME (100 ns since 1601) between 1990 and 2100.
EPOCHS = (
    (1.0e9, 4.1e9, 1.0, "seconds since 1970"),
    (1.0e12, 4.1e12, 1e-3, "milliseconds since 1970"),
    (1.0e15, 4.1e15, 1e-6, "microseconds since 1970"),
    (1.0e18, 4.1e18, 1e-9, "nanoseconds since 1970"),
    (1.227e17, 1.575e17, 1e-7, "FILETIME (100 ns since 1601)"),
)
DATE_ORDERS = ("dmy", "mdy")
CLOCK = r"(\d{1,2}:\d{2}:\d{2})(?:[.,](\d{1,9})\d*)?"
# Day and month in the order of the country; which of the two stands first is told apart by `_date_order`.
NUMBERS = rf"(\d{{1,2}})[/-](\d{{1,2}})[/-](\d{{4}})[T, ]+{CLOCK}"
# Each form with the pattern that it has, and its parts in the order of ISO 8601.
FORMS = (
    ("ISO 8601", rf"(\d{{4}})[-/](\d{{2}})[-/](\d{{2}})[T ]+{CLOCK}", r"\1-\2-\3 \4.\5"),
    ("dd.mm.yyyy", rf"(\d{{1,2}})\.(\d{{1,2}})\.(\d{{4}})[T, ]+{CLOCK}", r"\3-\2-\1 \4.\5"),
    ("dd/mm/yyyy", NUMBERS, r"\3-\2-\1 \4.\5"),
    ("mm/dd/yyyy", NUMBERS, r"\3-\1-\2 \4.\5"),
    ("time of day", CLOCK, r"1970-01-01 \1.\2"),
)
HALF = r"\s*([AaPp])\.?[Mm]\.?$"
ZONE = r"\s*(Z|[+-]\d{2}:?\d{2})$"


def stamps_of(
    table: Table, name: str, rate: float | None, date_order: str | None = None
) -> tuple[Array, str]:
    """Seconds (n,) and a note. Cells without a time stamp become NaN.

    Plain seconds stay as they are; dates, counts and times since an epoch run from the first stamp, since
    doubles could not hold their digits. rate: counts per second (Hz) of a column that counts cycles; date_order:
    one of DATE_ORDERS for dates such as 03/04/2024, None to find it.
    Raises TraceError for what is no time stamp.
    """
    if table.is_stamped(name):
        return _dated(table, name, date_order)
    header = table.header(name)
    values = table.values(name)
    if rate is not None:
        counts, note = _continuous(values)
        return (counts - _first(counts)) / rate, f"time from column {name}, cycles of {rate:g} Hz{note}"
    if header.unit == "counts":
        raise TraceError(
            f"{table.source}: column {name}: a clock that counts needs its counts per second: rate=... (--rate)"
        )
    start = abs(float(_first(values)))
    for low, high, scale, told in EPOCHS:
        own = header.unit and {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}.get(header.unit) == scale
        if low <= start <= high and (not header.unit or own or (scale == 1e-7 and header.unit == "ms")):
            note = f"time from column {name}, {told}, from the first"
            return _scaled(values - _first(values), scale), note
    try:
        scale = factor(header.unit, "s") if header.unit else 1.0
    except ValueRefused as error:
        raise TraceError(f"{table.source}: column {name}: {error}") from None
    told = "" if header.unit or not table.named else " (the header tells no unit)"
    counts, note = _continuous(values)
    return _scaled(counts, scale), f"time from column {name} in {header.unit or 's'}{told}{note}"


def _scaled(values: NDArray[Any], scale: float) -> Array:
    """values times scale, as a division where that rounds less: 7 ms is 0.007 s, and so as 7000 us."""
    found: Array = values / round(1.0 / scale) if scale < 1.0 else values * scale
    return found


def _first(values: NDArray[Any]) -> Any:
    """The first value that is a number, 0 if there is none."""
    filled = np.flatnonzero(np.isfinite(values))
    return values[filled[0]] if filled.size else 0


def _continuous(values: NDArray[Any]) -> tuple[NDArray[Any], str]:
    """Whole numbers of a clock without the wrap-around of its counter, and a note."""
    if values.dtype.kind == "f" and (
        not np.all(values == np.round(values)) or np.any(np.abs(values) > 2**53)
    ):
        return values, ""
    if values.dtype.kind == "u" and values.size and int(values.max()) >= 1 << 62:
        return values - values.min(), ""
    found = unwrap(values.astype(np.int64))
    if not found.bits:
        return values, ""
    return found.counts - found.counts[0], f"; {found.note}, from the first"


def _dated(table: Table, name: str, date_order: str | None) -> tuple[Array, str]:
    column = np.asarray(table.columns[name])
    if column.dtype.kind == "m":
        return _from_first(column.astype("m8[ns]").astype(np.int64), np.isnat(column)), (
            f"time from column {name}, durations, from the first"
        )
    if column.dtype.kind == "M":
        empty = np.isnat(column)
        note = f"time from column {name}, date stamps, from the first"
        return _from_first(column.astype("M8[ns]").astype(np.int64), empty), note
    nanoseconds, empty, form = _read_dates(table, name, column, date_order)
    note = f"time from column {name}, date stamps ({form}), from the first"
    if form == "time of day":
        filled = np.flatnonzero(~empty)
        days = np.cumsum(np.diff(nanoseconds[filled], prepend=nanoseconds[filled[:1]]) < -DAY // 2)
        nanoseconds[filled] += DAY * days
        note = f"time from column {name}, time of day, from the first"
        if days.size and days[-1]:
            note += f"; it passes midnight {days[-1]} times"
    return _from_first(nanoseconds, empty), note


def _from_first(nanoseconds: NDArray[np.int64], empty: NDArray[np.bool_]) -> Array:
    """Seconds from the first stamp that is there, NaN where there is none."""
    first = np.flatnonzero(~empty)
    if not first.size:
        return np.full(nanoseconds.size, np.nan)
    return np.where(empty, np.nan, (nanoseconds - nanoseconds[first[0]]) / 1e9)


def _read_dates(
    table: Table, name: str, column: NDArray[Any], date_order: str | None
) -> tuple[NDArray[np.int64], NDArray[np.bool_], str]:
    """Nanoseconds (n,) since 1970 in UTC or in the log's own zone, where there is none, and the form found."""
    import pyarrow as pa
    import pyarrow.compute as pc

    text = pc.utf8_trim_whitespace(pa.array(column, pa.string(), from_pandas=True))
    empty = pc.is_null(text).to_numpy(zero_copy_only=False)
    sample = text[int(np.argmin(empty))].as_py() or ""
    half = bool(re.search(HALF, sample))
    added = np.zeros(len(text), np.int64)
    if half:
        text, added = _whole_days(text)
    bare = re.sub(HALF, "", sample)
    in_numbers = bool(re.match(f"^{NUMBERS}$", bare))
    if in_numbers and date_order is None:
        date_order = _date_order(table, name, text)
    skipped = "dd/mm/yyyy" if date_order == "mdy" else "mm/dd/yyyy"
    for form, pattern, parts in FORMS:
        zone = form == "ISO 8601" and bool(re.search(ZONE, bare))
        whole = f"^{pattern}{ZONE if zone else '$'}"
        if form == skipped or not re.match(whole, bare):
            continue
        iso = pc.replace_substring_regex(text, whole, parts + (r"\6" if zone else ""))
        kind = pa.timestamp("ns", "UTC") if zone else pa.timestamp("ns")
        if not _casts(iso, kind):  # digits may be missing that ISO 8601 asks for
            for missing, filled in (
                (r"\.(Z|[+-]|$)", r"\1"),
                (r"-(\d)([- ])", r"-0\1\2"),
                (r"-(\d) ", r"-0\1 "),
                (r" (\d):", r" 0\1:"),
            ):
                iso = pc.replace_substring_regex(iso, missing, filled)
        if _casts(iso, kind):
            found = iso.cast(kind).cast(pa.int64()).fill_null(0).to_numpy(zero_copy_only=False)
            if zone or (in_numbers and not date_order):
                form = f"{form} with zone" if zone else "all of one day"
            return found + added, empty, form
        wrong = _first_refused(iso, kind)
        break
    else:
        wrong = int(np.argmin(empty))
    raise TraceError(
        f'{table.source}: column {name}: expected a time stamp, got "{column[wrong]}" in {table.rows([wrong])}; '
        "write ISO 8601 (2024-01-31 14:05:06.789, with or without zone), 31.01.2024 14:05:06,789, "
        "01/31/2024 2:05:06.789 PM or 14:05:06.789, all rows alike"
    )


def _whole_days(text: Any) -> tuple[Any, NDArray[np.int64]]:
    """Stamps of a clock of twelve hours with AM or PM, as those of a clock of 24: the text with hours from 0 to 11,
    and what PM adds, ns (n,). What has neither, or an hour that such a clock does not show, stays to be refused.
    """
    import pyarrow.compute as pc

    hour = r"(^|[ T,])(0?[1-9]|1[0-2])(:\d{2}:\d{2}(?:[.,]\d+)?)"
    known = pc.match_substring_regex(text, rf"{hour}\s*[AaPp]\.?[Mm]\.?$")
    later = pc.and_(known, pc.match_substring_regex(text, r"[Pp]\.?[Mm]\.?$"))
    plain = pc.replace_substring_regex(text, r"\s*[AaPp]\.?[Mm]\.?$", "")
    plain = pc.replace_substring_regex(plain, r"(^|[ T,])12(:\d{2}:\d{2}(?:[.,]\d+)?)$", r"\1" + r"00\2")
    return pc.if_else(known, plain, text), np.where(
        later.fill_null(False).to_numpy(zero_copy_only=False), DAY // 2, 0
    )


def _date_order(table: Table, name: str, text: Any) -> str:
    """Whether the day or the month stands first in these dates, by days above 12; "" where all rows are of one day,
    as the order changes nothing then. Raises TraceError where it cannot be told.
    """
    import pyarrow.compute as pc

    days = pc.replace_substring_regex(text, r"^(\d{1,2}[/-]\d{1,2}[/-]\d{4}).*$", r"\1")
    dates = [date for date in pc.unique(days).to_pylist() if date]
    pairs = [(int(found[1]), int(found[2])) for date in dates if (found := re.match(r"(\d+)\D(\d+)", date))]
    day_first, month_first = any(first > 12 for first, _ in pairs), any(second > 12 for _, second in pairs)
    if day_first or month_first:
        return "dmy" if day_first else "mdy"
    if len(dates) == 1:
        return ""
    raise TraceError(
        f"{table.source}: column {name}: dates such as {dates[0]} leave open which number is the day, and no "
        "number is above 12; tell the order with date_order='mdy' or 'dmy' (--date-order mdy)"
    )


def _casts(text: Any, kind: Any) -> bool:
    import pyarrow as pa

    try:
        text.cast(kind)
    except pa.ArrowInvalid:
        return False
    return True


def _first_refused(text: Any, kind: Any) -> int:
    """The first text that is no stamp, among texts that are not all stamps: by halves."""
    low, high = 0, len(text)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if _casts(text[low:middle], kind) else (low, middle)
    return low
