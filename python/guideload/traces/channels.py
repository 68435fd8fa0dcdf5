"""Columns of a table as they were measured, with their time stamps: sensors, forces, currents."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from guideload.base.arrays import Array, errors_name
from guideload.base.errors import TraceError, ValueRefused
from guideload.base.units import factor
from guideload.traces.content.columns import option_in_si, time_column_of
from guideload.traces.content.stamps import stamps_of
from guideload.traces.format.sources import load_table
from guideload.traces.format.table import Table, listed
from guideload.traces.options import ReadingOptions

if TYPE_CHECKING:
    from collections.abc import Iterable

    from guideload.traces.format.sources import TableLike

FROM_FIRST = "from the first"  # in the note on stamps that count from the first one


@dataclass(frozen=True, eq=False)
class Channels:
    """Columns of a table.

    time    (n,) s, not decreasing
    values  (n, k) in the order in which they were asked for
    source  of the table
    """

    time: Array
    values: Array
    source: str


def read_channels(
    table: TableLike,
    columns: Mapping[str, str | None],
    *,
    time: str | None = None,
    rate: float | str | None = None,
    date_order: str | None = None,
) -> Channels:
    """Read columns by name, each converted to a unit, or left as it is (None).

    table, time, rate, date_order: as for `read_trace`. Stamps are taken as they are; dates, counts of a clock and times
    since an epoch run from the first.

    Raises TraceError, naming file, column and rows, for a column that is missing or whose header gives no such unit,
    for cells without a number, and for stamps that go back.
    """
    data = load_table(table)
    with errors_name(data.source):
        scales = {name: _scale(data, name, unit) for name, unit in columns.items()}
        stamps, _ = stamps_of_columns(data, columns, "the log", time, rate, date_order)
        return Channels(
            stamps, np.column_stack([s * numbers_of(data, n) for n, s in scales.items()]), data.source
        )


def numbers_of(table: Table, name: str) -> Array:
    """The finite numbers of a column. Raises TraceError for cells without one."""
    values = table.values(name)
    table.require_size(name, values)
    if (bad := np.flatnonzero(~np.isfinite(values))).size:
        raise table.no_number(name, bad, "fill the cells, or cut the rows")
    return np.asarray(values, dtype=float)


def stamps_of_columns(
    table: Table,
    columns: Iterable[str],
    of: str,
    time: str | None,
    rate: float | str | None,
    date_order: str | None,
) -> tuple[Array, str]:
    """Stamps [s] of columns with one clock, and a note on them; `of` says in messages what they are of."""
    given = ReadingOptions(time=time, rate=rate, date_order=date_order)
    column = time_column_of(table, given)
    if column is not None and column not in table.columns:
        raise TraceError(f"{table.source}: no column {column!r}; there are {listed(table.names)}")
    if column is None and rate is None and table.clocks:
        column, *others = sorted({table.clocks[name] for name in columns})
        stamps = table.values(column)
        if not all(np.array_equal(stamps, table.values(other), equal_nan=True) for other in others):
            raise TraceError(f"{table.source}: expected {of} on one clock, got {listed([column, *others])}")
    size = len(table.numbers)
    if column is None:
        hertz = table.rate if rate is None else option_in_si(table, "rate", rate, "Hz", ">")
        assert hertz is not None
        stamps, note = np.arange(size) / hertz, f"time of {of} from the rate {hertz:g} Hz, {FROM_FIRST}"
    else:
        hertz = None if rate is None else option_in_si(table, "rate", rate, "Hz", ">")
        stamps, note = stamps_of(table, column, hertz, date_order)
        note = note.replace("time from", f"time of {of} from", 1)
        note += f", {FROM_FIRST}" if hertz is not None and FROM_FIRST not in note else ""
        if (bad := np.flatnonzero(~np.isfinite(stamps))).size:
            raise table.no_number(column, bad, "fill the cells, or cut the rows")
    if (back := np.flatnonzero(np.diff(stamps) < 0.0) + 1).size:
        raise TraceError(
            f"{table.source}: the time of {of} goes back in {table.rows(back)}; sort or cut them"
        )
    return stamps, note


def _scale(table: Table, name: str, unit: str | None) -> float:
    """Factor from the numbers of a column to `unit`; 1 for None."""
    if name not in table.columns:
        raise TraceError(f"{table.source}: no column {name!r}; there are {listed(table.names)}")
    if unit is None:
        return 1.0
    written = table.header(name).unit
    if not written:
        hint = f'write it into the header, as in "{name} [{unit}]"'
        raise TraceError(f"{table.source}: column {name}: the header gives no unit; {hint}")
    try:
        return factor(written, unit)
    except ValueRefused as error:
        raise TraceError(f"{table.source}: column {name}: {error}") from None
