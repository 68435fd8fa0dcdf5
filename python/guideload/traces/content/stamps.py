"""Time stamps in seconds from a time column: numbers, counts of a clock, dates, times of day."""

from __future__ import annotations

import re
from bisect import bisect_left
from typing import Any

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Array
from guideload.base.errors import TraceError, ValueRefused
from guideload.base.units import factor
from guideload.traces.content.counters import unwrap
from guideload.traces.format.headers import known_unit
from guideload.traces.format.table import Table

DAY = 86_400_000_000_000  # ns
# Numbers that are dates: lower and upper end, seconds per count, name. Seconds, ms, us or ns since 1970 between 2001
# and 2100; Windows' FILETIME between 1990 and 2100.
EPOCHS = (
    (1.0e9, 4.1e9, 1.0, "seconds since 1970"),
    (1.0e12, 4.1e12, 1e-3, "milliseconds since 1970"),
    (1.0e15, 4.1e15, 1e-6, "microseconds since 1970"),
    (1.0e18, 4.1e18, 1e-9, "nanoseconds since 1970"),
    (1.227e17, 1.575e17, 1e-7, "FILETIME (100 ns since 1601)"),
)
DATE_ORDERS = ("dmy", "mdy")
TIME_OF_DAY = r"(\d{1,2}:\d{2}:\d{2})(?:[.,](\d{1,9})\d*)?"
# Day and month in the order of the country; `_date_order` finds which.
NUMERIC_DATE = rf"(\d{{1,2}})[/-](\d{{1,2}})[/-](\d{{4}})[T, ]+{TIME_OF_DAY}"
# Name of the notation, its pattern, and its groups in the order of ISO 8601.
NOTATIONS = (
    ("ISO 8601", rf"(\d{{4}})[-/](\d{{2}})[-/](\d{{2}})[T ]+{TIME_OF_DAY}", r"\1-\2-\3 \4.\5"),
    ("dd.mm.yyyy", rf"(\d{{1,2}})\.(\d{{1,2}})\.(\d{{4}})[T, ]+{TIME_OF_DAY}", r"\3-\2-\1 \4.\5"),
    ("dd/mm/yyyy", NUMERIC_DATE, r"\3-\2-\1 \4.\5"),
    ("mm/dd/yyyy", NUMERIC_DATE, r"\3-\1-\2 \4.\5"),
    ("time of day", TIME_OF_DAY, r"1970-01-01 \1.\2"),
)
AM_PM = r"\s*[AaPp]\.?[Mm]\.?$"
ZONE = r"\s*(Z|[+-]\d{2}:?\d{2})$"
# Patterns of incomplete ISO 8601 stamps, and what replaces them.
MISSING = (
    (r"\.(Z|[+-]|$)", r"\1"),
    (r"-(\d)([- ])", r"-0\1\2"),
    (r"-(\d) ", r"-0\1 "),
    (r" (\d):", r" 0\1:"),
)


def stamps_of(
    table: Table,
    name: str,
    rate: float | None,
    date_order: str | None = None,
    time_unit: str | None = None,
) -> tuple[Array, str]:
    """Seconds (n,) and a note. Cells without a time stamp become NaN.

    Plain seconds stay as they are; dates, counts and times since an epoch run from the first stamp, since
    doubles could not hold their digits. rate: counts per second (Hz) of a column that counts cycles; date_order:
    one of DATE_ORDERS for dates such as 03/04/2024, None to find it; time_unit: instead of that of the header.
    Raises TraceError for cells that are not time stamps, and for a unit beside dates or a rate.
    """
    if time_unit is not None and (rate is not None or table.is_stamped(name)):
        beside = "dates" if rate is None else "a rate"
        raise TraceError(
            f"{table.source}: column {name}: expected no time_unit (--time-unit) beside {beside}"
        )
    if table.is_stamped(name):
        return _dated(table, name, date_order)
    unit = table.header(name).unit if time_unit is None else known_unit(time_unit) or time_unit
    values = table.values(name)
    table.require_size(name, values)
    if rate is not None:
        counts, note = _continuous(values)
        return (counts - _first(counts)) / rate, f"time from column {name}, cycles of {rate:g} Hz{note}"
    if unit == "counts":
        raise TraceError(
            f"{table.source}: column {name}: a clock that counts needs its counts per second: rate=... (--rate)"
        )
    try:
        scale = factor(unit or "s", "s")
    except ValueRefused as error:
        raise TraceError(f"{table.source}: column {name}: {error}") from None
    start = abs(float(_first(values)))
    for low, high, step, epoch in EPOCHS:
        # TwinCAT Scope exports FILETIME with the unit "ms".
        fits = not unit or scale == step or (step == 1e-7 and unit == "ms")
        if low <= start <= high and fits:
            note = f"time from column {name}, {epoch}, from the first"
            return _scaled(values - _first(values), step), note
    no_unit = "" if unit or not table.named else " (the header gives no unit)"
    counts, note = _continuous(values)
    return _scaled(counts, scale), f"time from column {name} in {unit or 's'}{no_unit}{note}"


def _scaled(values: NDArray[Any], scale: float) -> Array:
    """values * scale; below 1 as a division, which rounds less: 7 ms and 7000 us are both 0.007 s."""
    return np.asarray(values / round(1.0 / scale) if scale < 1.0 else values * scale)


def _first(values: NDArray[Any]) -> Any:
    """The first finite value, 0 if there is none."""
    finite = values[np.isfinite(values)]
    return finite[0] if finite.size else 0


def _continuous(values: NDArray[Any]) -> tuple[NDArray[Any], str]:
    """Values of a clock, unwrapped if they are whole numbers, and a note."""
    is_whole = (values == np.round(values)) & (np.abs(values) <= 2**53)
    if values.dtype.kind == "f" and not np.all(is_whole):
        return values, ""
    if values.dtype.kind == "u" and values.size and int(values.max()) >= 1 << 62:
        return values - values.min(), ""
    counter = unwrap(values.astype(np.int64))
    if not counter.bits:
        return values, ""
    return counter.counts - counter.counts[0], f"; {counter.note}, from the first"


def _dated(table: Table, name: str, date_order: str | None) -> tuple[Array, str]:
    """Seconds (n,) from the first date, duration or time of day, and a note."""
    column = np.asarray(table.columns[name])
    days = 0
    if column.dtype.kind in "mM":
        nanoseconds, empty = column.astype(f"{column.dtype.kind}8[ns]").astype(np.int64), np.isnat(column)
        notation = "durations" if column.dtype.kind == "m" else "date stamps"
    else:
        nanoseconds, empty, notation = _read_dates(table, name, column, date_order)
        if notation == "time of day":
            filled = np.flatnonzero(~empty)
            midnights = np.diff(nanoseconds[filled], prepend=nanoseconds[filled[:1]]) < -DAY // 2
            nanoseconds[filled] += DAY * np.cumsum(midnights)
            days = int(midnights.sum())
        else:
            notation = f"date stamps ({notation})"
    first = nanoseconds[np.argmin(empty)] if empty.size else 0
    seconds = np.where(empty, np.nan, (nanoseconds - first) / 1e9)
    past = f"; it passes midnight {days} times" if days else ""
    return seconds, f"time from column {name}, {notation}, from the first{past}"


def _read_dates(
    table: Table, name: str, column: NDArray[Any], date_order: str | None
) -> tuple[NDArray[np.int64], NDArray[np.bool_], str]:
    """Nanoseconds (n,) since 1970 in UTC, or in local time if no zone is given; which cells are empty; the notation."""
    import pyarrow as pa
    import pyarrow.compute as pc

    text = pc.utf8_trim_whitespace(pa.array(column, pa.string(), from_pandas=True))
    empty = pc.is_null(text).to_numpy(zero_copy_only=False)
    sample = text[int(np.argmin(empty))].as_py() or ""
    offset = np.zeros(len(text), np.int64)
    if re.search(AM_PM, sample):
        text, offset = _twenty_four_hours(text)
    sample = re.sub(AM_PM, "", sample)
    numeric = bool(re.match(f"^{NUMERIC_DATE}$", sample))
    if numeric and date_order is None:
        date_order = _date_order(table, name, text)
    skipped = "dd/mm/yyyy" if date_order == "mdy" else "mm/dd/yyyy"
    for notation, pattern, groups in NOTATIONS:
        has_zone = notation == "ISO 8601" and bool(re.search(ZONE, sample))
        pattern = f"^{pattern}{ZONE if has_zone else '$'}"
        if notation == skipped or not re.match(pattern, sample):
            continue
        iso = pc.replace_substring_regex(text, pattern, groups + (r"\6" if has_zone else ""))
        kind = pa.timestamp("ns", "UTC") if has_zone else pa.timestamp("ns")
        if not _casts(iso, kind):
            for missing, filled in MISSING:
                iso = pc.replace_substring_regex(iso, missing, filled)
        if _casts(iso, kind):
            nanoseconds = iso.cast(kind).cast(pa.int64()).fill_null(0).to_numpy(zero_copy_only=False)
            if numeric and not date_order:
                notation = "all of one day"
            return nanoseconds + offset, empty, f"{notation} with zone" if has_zone else notation
        wrong = bisect_left(range(len(iso)), True, key=lambda i: not _casts(iso[: i + 1], kind))
        break
    else:
        wrong = int(np.argmin(empty))
    raise TraceError(
        f'{table.source}: column {name}: expected a time stamp, got "{column[wrong]}" in {table.rows([wrong])}; '
        "write ISO 8601 (2024-01-31 14:05:06.789, with or without zone), 31.01.2024 14:05:06,789, "
        "01/31/2024 2:05:06.789 PM or 14:05:06.789, all rows alike"
    )


def _twenty_four_hours(text: Any) -> tuple[Any, NDArray[np.int64]]:
    """Stamps without their AM or PM, hours from 0 to 11; and the offset (n,) ns of PM.

    Stamps without AM or PM, or with an hour outside 1 to 12, are not changed; the caller refuses them.
    """
    import pyarrow.compute as pc

    hour = r"(^|[ T,])(0?[1-9]|1[0-2])(:\d{2}:\d{2}(?:[.,]\d+)?)"
    valid = pc.match_substring_regex(text, hour + AM_PM)
    is_pm = pc.and_(valid, pc.match_substring_regex(text, r"[Pp]\.?[Mm]\.?$"))
    plain = pc.replace_substring_regex(text, AM_PM, "")
    plain = pc.replace_substring_regex(plain, r"(^|[ T,])12(:\d{2}:\d{2}(?:[.,]\d+)?)$", r"\1" + r"00\2")
    afternoon = is_pm.fill_null(False).to_numpy(zero_copy_only=False)
    return pc.if_else(valid, plain, text), np.where(afternoon, DAY // 2, 0)


def _date_order(table: Table, name: str, text: Any) -> str:
    """ "dmy" or "mdy", by days above 12; "" if all rows are of one day, where the order has no effect.

    Raises TraceError if the dates are ambiguous.
    """
    import pyarrow.compute as pc

    days = pc.replace_substring_regex(text, r"^(\d{1,2}[/-]\d{1,2}[/-]\d{4}).*$", r"\1")
    dates = [date for date in pc.unique(days).to_pylist() if date]
    pairs = [pair for date in dates if (pair := re.match(r"(\d+)\D(\d+)", date))]
    for group, order in ((1, "dmy"), (2, "mdy")):
        if any(int(pair[group]) > 12 for pair in pairs):
            return order
    if len(dates) == 1:
        return ""
    raise TraceError(
        f"{table.source}: column {name}: dates such as {dates[0]} are ambiguous: no number is above 12, so "
        "either may be the day; give the order with date_order='mdy' or 'dmy' (--date-order mdy)"
    )


def _casts(text: Any, kind: Any) -> bool:
    import pyarrow as pa

    try:
        text.cast(kind)
    except pa.ArrowInvalid:
        return False
    return True
