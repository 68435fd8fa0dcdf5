"""Process forces from columns of a table: Fx to Mz with their units, and their time stamps."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from guideload.base.arguments import checked
from guideload.base.arrays import errors_name
from guideload.base.errors import TraceError
from guideload.motion.motion import Forces
from guideload.traces.channels import FROM_FIRST, scaled_columns
from guideload.traces.format.headers import Header
from guideload.traces.format.sources import load_table
from guideload.traces.format.table import Table, listed
from guideload.traces.options import ReadingOptions

if TYPE_CHECKING:
    from guideload.traces.format.sources import TableLike

COMPONENTS = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
NAME = re.compile(r"(f|force|kraft|m|moment|t|torque)([xyz])")
SUFFIX = re.compile(r"(.*?)_(m?N|kN|Nm|N_m|kNm)")  # units at the end of a name without brackets: Fx_N, Mz_Nm


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
        columns = _columns(data)
        scales = {name: scale for name, (_, scale) in columns.items()}
        given = ReadingOptions(time=time, rate=rate, date_order=date_order)
        read = scaled_columns(data, scales, "the forces", given)
    load = np.zeros((read.time.size, 6))
    load[:, [component for component, _ in columns.values()]] = read.values
    notes = f"forces from the columns {', '.join(columns)}", read.note
    return Forces(read.time, load[:, :3], load[:, 3:], data.source, notes, FROM_FIRST in read.note)


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
        scale = table.factor(name, unit, header, COMPONENTS[component])
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
