"""Time stamps in seconds from a time column: numbers, counts of a clock, dates, times of day."""

from __future__ import annotations

import re
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Array, Flags, Integers
from guideload.base.errors import TraceError
from guideload.motion.origin import Origin
from guideload.traces.content.counters import unwrap
from guideload.traces.format.headers import Header, known_unit
from guideload.traces.format.table import Table
from guideload.traces.options import ReadingOptions

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
YEAR_1601 = -11_644_473_600  # s since 1970
DATE_ORDERS = ("dmy", "mdy")
# Notations of dates, and the time of day after each. With a slash, day and month are in the order of the country;
# `_date_order` finds which.
DATES = {
    "ISO 8601": r"(?P<year>\d{4})[-/](?P<month>\d{2})[-/](?P<day>\d{2})[T ]+",
    "dd.mm.yyyy": r"(?P<day>\d{1,2})\.(?P<month>\d{1,2})\.(?P<year>\d{4})[T, ]+",
    "dd/mm/yyyy": r"(?P<day>\d{1,2})[/-](?P<month>\d{1,2})[/-](?P<year>\d{4})[T, ]+",
    "time of day": r"(?P<year>)(?P<month>)(?P<day>)",
}
TIME_OF_DAY = (
    r"(?P<hour>\d{1,2}):(?P<minute>\d{2}):(?P<second>\d{2})(?:[.,](?P<fraction>\d{1,9})\d*)?"
    r"(?:\s*(?P<half>[AaPp])\.?[Mm]\.?)?"
    r"(?:\s*(?P<zone>Z|(?P<sign>[+-])(?P<zone_hour>\d{2}):?(?P<zone_minute>\d{2})))?"
)
YEARS = (1678, 2261)  # whose nanoseconds since 1970 have 64 bits


class Stamps(NamedTuple):
    """Time stamps (n,) [s], a note on them, and the instant from which they count."""

    time: Array
    note: str
    origin: Origin


def read_stamps(table: Table, name: str, options: ReadingOptions, rate: float | None = None) -> Stamps:
    """The stamps of a column. Cells without a time stamp become NaN.

    Plain seconds stay as they are; dates, counts and times since an epoch run from the first stamp, since
    doubles could not hold their digits. options: of them date_order and time_unit; rate: counts per second (Hz) of a
    column that counts cycles. Raises TraceError for cells that are not time stamps, and for a unit beside dates or a
    rate.
    """
    time_unit = options.get("time_unit")
    if time_unit is not None and (rate is not None or table.is_stamped(name)):
        beside = "dates" if rate is None else "a rate"
        raise TraceError(f"column {name}: expected no time_unit (--time-unit) beside {beside}")
    if table.is_stamped(name):
        return _dated(table, name, options.get("date_order"))
    unit = table.header(name).unit if time_unit is None else known_unit(time_unit) or time_unit
    values = table.values(name)
    table.require_size(name, values)
    if rate is not None:
        counts, begin, note = _continuous(values)
        first = _first(counts)
        origin = _duration(first if begin is None else begin, 1.0 / rate)
        return Stamps(
            (counts - first) / rate, f"time from column {name}, cycles of {rate:g} Hz{note}", origin
        )
    if unit == "counts":
        raise TraceError(f"column {name}: a clock that counts needs its counts per second: rate=... (--rate)")
    scale = table.factor(name, "s", Header((), unit or "s"))
    first = _first(values)
    start = abs(float(first))
    for low, high, step, epoch in EPOCHS:
        # TwinCAT Scope exports FILETIME with the unit "ms".
        fits = not unit or scale == step or (step == 1e-7 and unit == "ms")
        if low <= start <= high and fits:
            note = f"time from column {name}, {epoch}, from the first"
            since_1970 = _duration(first, step, YEAR_1601 if "1601" in epoch else 0)
            return Stamps(_scaled(values - first, step), note, np.datetime64(0, "ns") + since_1970)
    no_unit = "" if unit or not table.named else " (the header gives no unit)"
    counts, begin, note = _continuous(values)
    note = f"time from column {name} in {unit or 's'}{no_unit}{note}"
    return Stamps(_scaled(counts, scale), note, None if begin is None else _duration(begin, scale))


def _scaled(values: NDArray[Any], scale: float) -> Array:
    """values * scale; below 1 as a division, which rounds less: 7 ms and 7000 us are both 0.007 s."""
    return np.asarray(values / round(1.0 / scale) if scale < 1.0 else values * scale)


def _first(values: NDArray[Any]) -> Any:
    """The first finite value, 0 if there is none."""
    finite = values[np.isfinite(values)]
    return finite[0] if finite.size else 0


def _duration(count: Any, step: float, seconds: int = 0) -> np.timedelta64:
    """So many steps [s] and seconds, to the nanosecond; NaT if they are too long."""
    nanoseconds = round(10**9 * (Fraction(np.asarray(count).item()) * Fraction(f"{step:.15g}") + seconds))
    return np.timedelta64(nanoseconds if abs(nanoseconds) < 1 << 63 else "NaT", "ns")


def _continuous(values: NDArray[Any]) -> tuple[NDArray[Any], Any, str]:
    """Values of a clock, unwrapped if they are whole numbers; what was subtracted from them, or None; a note."""
    is_whole = (values == np.round(values)) & (np.abs(values) <= 2**53)
    if values.dtype.kind == "f" and not np.all(is_whole):
        return values, None, ""
    if values.dtype.kind == "u" and values.size and int(values.max()) >= 1 << 62:
        return values - values.min(), values.min(), ""
    counter = unwrap(values.astype(np.int64))
    if not counter.bits:
        return values, None, ""
    return counter.counts - counter.counts[0], counter.counts[0], f"; {counter.note}, from the first"


def _dated(table: Table, name: str, date_order: str | None) -> Stamps:
    """Seconds (n,) from the first date, duration or time of day."""
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
    since = np.timedelta64(int(first), "ns")
    origin = np.datetime64(0, "ns") + since if notation.startswith("date") else since
    return Stamps(seconds, f"time from column {name}, {notation}, from the first{past}", origin)


def _read_dates(
    table: Table, name: str, column: NDArray[Any], date_order: str | None
) -> tuple[Integers, Flags, str]:
    """Nanoseconds (n,) since 1970 in UTC, or in local time if no zone is given; which cells are empty; the notation.

    All cells are like the first one, which shows the notation, and whether they have a zone, or AM and PM.
    """
    import pyarrow as pa
    import pyarrow.compute as pc

    text = pc.utf8_trim_whitespace(pa.array(column, pa.string(), from_pandas=True))
    empty = pc.is_null(text).to_numpy(zero_copy_only=False)
    first = int(np.argmin(empty))
    sample = text[first].as_py() or ""
    notation = next((one for one in DATES if re.fullmatch(DATES[one] + TIME_OF_DAY, sample)), "ISO 8601")
    parts = pc.extract_regex(text, f"^{DATES[notation]}{TIME_OF_DAY}$")
    wrong = pc.is_null(parts).to_numpy(zero_copy_only=False)

    def is_spelled(part: str, *values: str) -> Flags:
        return np.isin(np.asarray(pc.struct_field(parts, part).fill_null("")), values)

    def number(part: str, default: str = "0") -> Integers:
        cells = pc.struct_field(parts, part).fill_null(default)
        return np.asarray(pc.if_else(pc.equal(cells, ""), default, cells).cast(pa.int64()))

    year, month, day = number("year", "1970"), number("month", "1"), number("day", "1")
    if notation == "dd/mm/yyyy" and date_order is None:
        date_order = _date_order(name, sample, np.stack([day, month, year])[:, ~wrong])
        notation = notation if date_order else "all of one day"
    if notation == "dd/mm/yyyy" and date_order == "mdy":
        notation, day, month = "mm/dd/yyyy", month, day
    months = (12 * (year - 1970) + month - 1).astype("M8[M]")
    days = months.astype("M8[D]") + (day - 1)
    hour, minute, second = number("hour"), number("minute"), number("second")
    has_half, has_zone = ~is_spelled("half", ""), ~is_spelled("zone", "")
    wrong |= (has_half != has_half[first]) | (has_zone != has_zone[first])
    wrong |= (month < 1) | (month > 12) | (day < 1) | (days.astype("M8[M]") != months)
    wrong |= (year < YEARS[0]) | (year > YEARS[1]) | (hour > 23) | (minute > 59) | (second > 59)
    wrong |= has_half & ((hour < 1) | (hour > 12))
    zone_hour, zone_minute = number("zone_hour"), number("zone_minute")
    wrong |= (zone_hour > 23) | (zone_minute > 59)
    if (bad := np.flatnonzero(wrong & ~empty)).size:
        raise TraceError(
            f'column {name}: expected a time stamp, got "{column[bad[0]]}" in {table.rows(bad[:1])}; '
            "write ISO 8601 (2024-01-31 14:05:06.789, with or without zone), 31.01.2024 14:05:06,789, "
            "01/31/2024 2:05:06.789 PM or 14:05:06.789, all rows alike"
        )
    hour = np.where(has_half, hour % 12 + 12 * is_spelled("half", "p", "P"), hour)
    east = np.where(is_spelled("sign", "-"), -1, 1) * (60 * zone_hour + zone_minute)
    seconds = 60 * (60 * hour + minute - east) + second
    fraction = pc.utf8_rpad(pc.struct_field(parts, "fraction").fill_null(""), 9, "0").cast(pa.int64())
    nanoseconds = DAY * days.astype(np.int64) + 10**9 * seconds + np.asarray(fraction)
    return nanoseconds, empty, f"{notation} with zone" if has_zone[first] else notation


def _date_order(name: str, sample: str, dates: Integers) -> str:
    """ "dmy" or "mdy", by days above 12; "" if all rows are of one day, where the order has no effect.

    dates: (3, n), the first and the second number and the year. Raises TraceError if the dates are ambiguous.
    """
    for numbers, order in zip(dates, DATE_ORDERS, strict=False):
        if np.any(numbers > 12):
            return order
    if np.all(dates == dates[:, :1]):
        return ""
    raise TraceError(
        f"column {name}: dates such as {re.split('[T, ]', sample)[0]} are ambiguous: no number is "
        "above 12, so either may be the day; give the order with date_order='mdy' or 'dmy' (--date-order mdy)"
    )
