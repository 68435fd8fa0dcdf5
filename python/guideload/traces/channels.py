"""Columns of a table as they were measured, with their time stamps: sensors, currents, process forces."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from guideload.base.arguments import checked
from guideload.base.arrays import Array, errors_name
from guideload.base.errors import TraceError
from guideload.motion.forces import Forces
from guideload.motion.origin import Origin
from guideload.traces.content.columns import find_time_column
from guideload.traces.content.samples import time_stamps
from guideload.traces.format.sources import load_table
from guideload.traces.format.table import Table, listed
from guideload.traces.options import ReadingOptions

if TYPE_CHECKING:
    from guideload.traces.format.sources import TableLike

COMPONENTS = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
NAME = re.compile(r"(f|force|kraft|m|moment|t|torque)([xyz])")
STAMP_OPTIONS = ("time", "time_unit", "rate", "date_order")  # of the options of reading
FROM_FIRST = "from the first"  # in the note on stamps that count from the first one


@dataclass(frozen=True, eq=False)
class Channels:
    """Columns of a table."""

    time: Array  # (n,) s, not decreasing
    values: Array  # (n, k) in the order in which they were asked for
    source: str  # of the table
    note: str  # on the time stamps
    origin: Origin  # of the time


def read_channels(
    table: TableLike,
    columns: Mapping[str, str | None],
    *,
    time: str | None = None,
    time_unit: str | None = None,
    rate: float | str | None = None,
    date_order: str | None = None,
) -> Channels:
    """Read columns by name, each converted to a unit, or left as it is (None).

    table, time, time_unit, rate, date_order: as for `read_trace`. Stamps are taken as they are; dates, counts of a
    clock and times since an epoch run from the first, whose instant is the `origin` of the result.

    Raises TraceError, naming file, column and rows, for a column that is missing or whose header gives no such unit,
    for cells without a number, and for stamps that go back.
    """
    data = load_table(table)
    with errors_name(data.source):
        for name in columns:
            data.require(name)
        given = ReadingOptions(time=time, time_unit=time_unit, rate=rate, date_order=date_order)
        scales = {name: 1.0 if unit is None else data.factor(name, unit) for name, unit in columns.items()}
        return scaled_columns(data, scales, "the log", given)


def scaled_columns(
    table: Table, scales: Mapping[str, float], subject: str, given: ReadingOptions
) -> Channels:
    """Columns times their scales, with one clock; `subject` names them in messages."""
    column, count = find_time_column(table, given), len(table.numbers)
    clocks: list[str | None] = [column]
    if column is None and given.get("rate") is None and table.clocks:
        clocks = [*sorted({table.clocks[name] for name in scales})]
    (time, note, origin), *others = (time_stamps(table, clock, given, count) for clock in clocks)
    if not all(np.array_equal(time, one.time, equal_nan=True) and origin == one.origin for one in others):
        raise TraceError(f"expected {subject} on one clock, got {listed([str(clock) for clock in clocks])}")
    note = f"time of {subject}{note.removeprefix('time')}"
    if origin is not None and FROM_FIRST not in note:
        clock_note, *rest = note.split("; ")
        note = "; ".join((f"{clock_note}, {FROM_FIRST}", *rest))
    values = {name: table.values(name) for name in scales}
    # Where each channel has its own time, those with fewer samples end before the table.
    is_used = (
        [np.isfinite(time), *map(np.isfinite, values.values())] if table.clocks else [np.ones(count, bool)]
    )
    used = np.flatnonzero(np.any(is_used, axis=0))
    for name, numbers in ((clocks[0], time), *values.items()):
        if name is not None and (bad := used[~np.isfinite(numbers[used])]).size:
            raise table.no_number(name, bad, "fill the cells, or cut the rows")
    if (back := used[1:][np.diff(time[used]) < 0.0]).size:
        raise TraceError(f"the time of {subject} goes back in {table.rows(back)}; sort or cut them")
    for name, numbers in values.items():
        table.require_size(name, numbers)
    scaled = [scale * values[name][used] for name, scale in scales.items()]
    return Channels(time[used], np.column_stack(scaled), table.source, note, origin)


@checked
def read_forces(
    table: TableLike,
    *,
    time: str | None = None,
    time_unit: str | None = None,
    rate: float | str | None = None,
    date_order: str | None = None,
) -> Forces:
    """Read process forces from the columns Fx, Fy, Fz [N] and Mx, My, Mz [N m] of a table; missing ones are zero.

    table: as for `read_trace`; the headers give the units, as in "Fx [kN]" or "Mz_Nm", and other columns are ignored.
    They are forces on the body, the opposite of what a dynamometer below the workpiece shows.
    time, time_unit, rate, date_order: as for `read_trace`. Stamps are taken as they are; dates, counts of a clock and
    times since an epoch run from the first, whose instant is the `origin` of the result.

    Raises TraceError, naming file, column and rows, for a table without such columns, a column without a unit, cells
    without a number, and stamps that go back.
    """
    data = load_table(table)
    with errors_name(data.source):
        columns = _force_columns(data)
        scales = {name: scale for name, (_, scale) in columns.items()}
        given = ReadingOptions(time=time, time_unit=time_unit, rate=rate, date_order=date_order)
        read = scaled_columns(data, scales, "the forces", given)
        load = np.zeros((read.time.size, 6))
        load[:, [component for component, _ in columns.values()]] = read.values
        notes = f"forces from the columns {', '.join(columns)}", read.note
        return Forces(read.time, load[:, :3], load[:, 3:], data.source, notes, read.origin)


def forces_beside(trace: Path, options: Mapping[str, Any], file: Path | None) -> Forces:
    """The forces of a file, or in the columns of the trace if it is the same file or None.

    options: those with which the trace was read; its columns have its time stamps, and rows of a rate begin together.
    Raises TraceError.
    """
    if file is not None and not (file.exists() and file.samefile(trace)):
        return read_forces(file)
    if options.get("clock") == "uniform":
        raise TraceError(
            f"{trace.name}: clock='uniform' (--clock uniform) moves the time stamps of the trace, but not those of the "
            "forces in its columns; give the forces in a file of their own, or leave it out"
        )
    forces = read_forces(trace, **{name: options.get(name) for name in STAMP_OPTIONS})
    by_rate = forces.origin is not None and np.isnat(forces.origin)
    return replace(forces, origin=None) if by_rate else forces


def _force_columns(table: Table) -> dict[str, tuple[int, float]]:
    """Index of the component and factor to SI for each column of forces."""
    found: dict[str, tuple[int, float]] = {}
    for name in table.columns:
        header = table.header(name)
        repeated = re.search(r"(?<=\.)\d+$", name)  # as `Table` calls a second column of the same name
        match = NAME.fullmatch("".join(header.words).removesuffix(repeated[0] if repeated else ""))
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
