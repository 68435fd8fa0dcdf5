"""Columns of a table as they were measured, with their time stamps: sensors, currents, process forces."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from guideload.base.arguments import checked
from guideload.base.arrays import Array, errors_name
from guideload.base.errors import TraceError
from guideload.motion.forces import Forces
from guideload.traces.content.columns import find_time_column
from guideload.traces.content.samples import time_stamps
from guideload.traces.format.headers import Header
from guideload.traces.format.sources import load_table
from guideload.traces.format.table import Table, listed
from guideload.traces.options import ReadingOptions

if TYPE_CHECKING:
    from guideload.traces.format.sources import TableLike

COMPONENTS = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
NAME = re.compile(r"(f|force|kraft|m|moment|t|torque)([xyz])")
SUFFIX = re.compile(r"(.*?)_(m?N|kN|Nm|N_m|kNm)")  # units at the end of a name without brackets: Fx_N, Mz_Nm
FILL = "fill the cells, or cut the rows"
FROM_FIRST = "from the first"  # in the note on stamps that count from the first one


@dataclass(frozen=True, eq=False)
class Channels:
    """Columns of a table."""

    time: Array  # (n,) s, not decreasing
    values: Array  # (n, k) in the order in which they were asked for
    source: str  # of the table
    note: str  # on the time stamps


def read_channels(
    table: TableLike,
    columns: Mapping[str, str | None],
    *,
    time: str | None = None,
    rate: float | str | None = None,
) -> Channels:
    """Read columns by name, each converted to a unit, or left as it is (None).

    table, time, rate: as for `read_trace`. Stamps are taken as they are; dates, counts of a clock and times since an
    epoch run from the first.

    Raises TraceError, naming file, column and rows, for a column that is missing or whose header gives no such unit,
    for cells without a number, and for stamps that go back.
    """
    data = load_table(table)
    with errors_name(data.source):
        for name in columns:
            data.require(name)
        scales = {name: 1.0 if unit is None else data.factor(name, unit) for name, unit in columns.items()}
        return scaled_columns(data, scales, "the log", ReadingOptions(time=time, rate=rate))


def scaled_columns(
    table: Table, scales: Mapping[str, float], subject: str, given: ReadingOptions
) -> Channels:
    """Columns times their scales, with one clock; `subject` names them in messages."""
    column = find_time_column(table, given)
    if column is None and given.get("rate") is None and table.clocks:
        column, *others = sorted({table.clocks[name] for name in scales})
        stamps = table.values(column)
        if not all(np.array_equal(stamps, table.values(other), equal_nan=True) for other in others):
            raise TraceError(f"expected {subject} on one clock, got {listed([column, *others])}")
    stamps, note = time_stamps(table, column, given, len(table.numbers))
    note = f"time of {subject}{note.removeprefix('time')}"
    if FROM_FIRST not in note and (column is None or given.get("rate") is not None):
        clock, *others = note.split("; ")
        note = "; ".join((f"{clock}, {FROM_FIRST}", *others))
    if column is not None:
        table.require_numbers(column, stamps, FILL)
    if (back := np.flatnonzero(np.diff(stamps) < 0.0) + 1).size:
        raise TraceError(f"the time of {subject} goes back in {table.rows(back)}; sort or cut them")
    values = []
    for name, scale in scales.items():
        numbers = table.values(name)
        table.require_size(name, numbers)
        table.require_numbers(name, numbers, FILL)
        values.append(scale * numbers)
    return Channels(stamps, np.column_stack(values), table.source, note)


@checked
def read_forces(
    table: TableLike,
    *,
    time: str | None = None,
    rate: float | str | None = None,
    date_order: str | None = None,
) -> Forces:
    """Read process forces from the columns Fx, Fy, Fz [N] and Mx, My, Mz [N m] of a table; missing ones are zero.

    table: as for `read_trace`; the headers give the units, as in "Fx [kN]" or "Mz_Nm", and other columns are ignored.
    They are forces on the body, the opposite of what a dynamometer below the workpiece shows.
    time, rate, date_order: as for `read_trace`. Stamps are taken as they are; dates, counts of a clock and times since
    an epoch run from the first.

    Raises TraceError, naming file, column and rows, for a table without such columns, a column without a unit, cells
    without a number, and stamps that go back.
    """
    data = load_table(table)
    with errors_name(data.source):
        columns = _force_columns(data)
        scales = {name: scale for name, (_, scale) in columns.items()}
        given = ReadingOptions(time=time, rate=rate, date_order=date_order)
        read = scaled_columns(data, scales, "the forces", given)
        load = np.zeros((read.time.size, 6))
        load[:, [component for component, _ in columns.values()]] = read.values
        notes = f"forces from the columns {', '.join(columns)}", read.note
        return Forces(read.time, load[:, :3], load[:, 3:], data.source, notes, FROM_FIRST in read.note)


def _force_columns(table: Table) -> dict[str, tuple[int, float]]:
    """Index of the component and factor to SI for each column of forces."""
    found: dict[str, tuple[int, float]] = {}
    for name in table.columns:
        header = _force_header(table, name)
        match = NAME.fullmatch("".join(header.words))
        if match is None:
            continue
        is_force = match[1] in ("f", "force", "kraft")
        component = "xyz".index(match[2]) + (0 if is_force else 3)
        unit = "N" if is_force else "N m"
        scale = table.factor(name, unit, header, COMPONENTS[component])
        twin = next((other for other, (same, _) in found.items() if same == component), None)
        if twin is not None:
            raise TraceError(f"expected one column of {COMPONENTS[component]}, got {twin} and {name}")
        found[name] = component, scale
    if not found:
        raise TraceError(f"expected columns of forces such as Fx [N] or Mz [N m], got {listed(table.names)}")
    return found


def _force_header(table: Table, name: str) -> Header:
    suffix = SUFFIX.fullmatch(name.strip())
    if suffix and name not in table.units:
        return Header.of(suffix[1], suffix[2].replace("_", " "))
    return table.header(name)
