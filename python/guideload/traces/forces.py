"""Process forces from columns of a table: Fx to Mz with their units, and their time stamps."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from guideload.base.arrays import Array, errors_name
from guideload.base.errors import TraceError, ValueRefused
from guideload.base.units import factor
from guideload.motion.forces import Forces
from guideload.traces.content.columns import option_in_si, time_column_of
from guideload.traces.content.stamps import stamps_of
from guideload.traces.format.headers import Header
from guideload.traces.format.sources import load_table
from guideload.traces.format.table import Table, listed
from guideload.traces.options import ReadingOptions

if TYPE_CHECKING:
    from guideload.traces.format.sources import TableLike

COMPONENTS = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
NAME = re.compile(r"(f|force|kraft|m|moment|t|torque)([xyz])")
SUFFIX = re.compile(r"(.*?)_(m?N|kN|Nm|N_m|kNm)")  # units at the end of a name without brackets: Fx_N, Mz_Nm
FROM_FIRST = "from the first"  # in the note on stamps that count from the first one


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
        columns = _columns(data)
        stamps, note = _stamps(data, columns, time, rate, date_order)
        load = np.zeros((stamps.size, 6))
        for name, (component, scale) in columns.items():
            values = data.values(name)
            data.require_size(name, values)
            if (bad := np.flatnonzero(~np.isfinite(values))).size:
                raise data.no_number(name, bad, "fill the cells, or cut the rows")
            load[:, component] = values * scale
    named = ", ".join(columns)
    notes = f"forces from the columns {named}", note
    return Forces(stamps, load[:, :3], load[:, 3:], data.source, notes, FROM_FIRST in note)


def _columns(table: Table) -> dict[str, tuple[int, float]]:
    """Index of the component and factor to SI for each column of forces."""
    found: dict[str, tuple[int, float]] = {}
    for name in table.columns:
        header = _header(table, name)
        match = NAME.fullmatch("".join(header.words))
        if match is None:
            continue
        is_force = match[1] in ("f", "force", "kraft")
        component = "xyz".index(match[2]) + (0 if is_force else 3)
        unit = "N" if is_force else "N m"
        if not header.unit:
            hint = f'write it into the header, as in "{COMPONENTS[component]} [{unit}]"'
            raise TraceError(f"{table.source}: column {name}: the header gives no unit; {hint}")
        try:
            scale = factor(header.unit, unit)
        except ValueRefused as error:
            raise TraceError(f"{table.source}: column {name}: {error}") from None
        twin = next((other for other, (same, _) in found.items() if same == component), None)
        if twin is not None:
            raise TraceError(
                f"{table.source}: expected one column of {COMPONENTS[component]}, got {twin} and {name}"
            )
        found[name] = component, scale
    if not found:
        raise TraceError(
            f"{table.source}: expected columns of forces such as Fx [N] or Mz [N m], got {listed(table.names)}"
        )
    return found


def _header(table: Table, name: str) -> Header:
    suffix = SUFFIX.fullmatch(name.strip())
    if suffix and name not in table.units:
        return Header.of(suffix[1], suffix[2].replace("_", " "))
    return table.header(name)


def _stamps(
    table: Table,
    columns: dict[str, tuple[int, float]],
    time: str | None,
    rate: float | str | None,
    date_order: str | None,
) -> tuple[Array, str]:
    """Stamps [s] of the forces, and a note on them."""
    given = ReadingOptions(time=time, rate=rate, date_order=date_order)
    column = time_column_of(table, given)
    if column is None and rate is None and table.clocks:
        clocks = {table.clocks[name] for name in columns}
        if len(clocks) > 1:
            raise TraceError(
                f"{table.source}: expected the forces on one clock, got {listed(sorted(clocks))}"
            )
        column = clocks.pop()
    size = len(table.numbers)
    if column is None:
        hertz = table.rate if rate is None else option_in_si(table, "rate", rate, "Hz", ">")
        assert hertz is not None
        stamps, note = np.arange(size) / hertz, f"time of the forces from the rate {hertz:g} Hz, {FROM_FIRST}"
    else:
        hertz = None if rate is None else option_in_si(table, "rate", rate, "Hz", ">")
        stamps, note = stamps_of(table, column, hertz, date_order)
        note = note.replace("time from", "time of the forces from", 1)
        note += f", {FROM_FIRST}" if hertz is not None and FROM_FIRST not in note else ""
        if (bad := np.flatnonzero(~np.isfinite(stamps))).size:
            raise table.no_number(column, bad, "fill the cells, or cut the rows")
    if (back := np.flatnonzero(np.diff(stamps) < 0.0) + 1).size:
        raise TraceError(
            f"{table.source}: the time of the forces goes back in {table.rows(back)}; sort or cut them"
        )
    return stamps, note
