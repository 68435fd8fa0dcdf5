"""Layouts in which each channel has its own time stamps, beside that of TwinCAT Scope.

Header of pairs of key and value, as of NI loggers; below it, a time and a value for each channel:

    Interval      <sep> 0.0005  <sep> Interval      <sep> 0.0005
    Channel name  <sep> Force   <sep> Channel name  <sep> Position
    Unit          <sep> V       <sep> Unit          <sep> mm
    0             <sep> -0.129  <sep> 0             <sep> 12.5

A time column of the same name before each group of channels: t, set, t, actual.

A row for each value, without header, as of EPICS' camonitor: name, date, time of day, value.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from guideload.traces.format.dialect_detection import (
    SEPARATORS,
    Dialect,
    Row,
    detect_decimal,
    is_value,
    split_rows,
)
from guideload.traces.format.headers import Header, known_unit
from guideload.traces.format.table import Table, unique

NAME_KEYS = ("channel name", "channel", "name")
UNIT_KEYS = ("unit", "units")
LONGEST_HEADER = 40  # lines
MOST_CHANNELS = 200  # of a log with a row for each value; a text that differs more often is no name
OWN_TIME = "each channel has its own time stamps"


def paired_dialect(lines: Sequence[str]) -> Dialect | None:
    """The dialect of a table under a header of pairs of key and value; None for any other table."""
    top = [(i, line) for i, line in enumerate(lines[:LONGEST_HEADER]) if line.strip()]
    for separator in SEPARATORS[:-1]:
        rows = [Row(i, split_rows([line], separator)[0].cells) for i, line in top]
        data = next((i for i, row in enumerate(rows) if is_value(row.cells[0])), len(rows))
        keyed = {row.cells[0].lower(): row for row in rows[:data]}
        named = next((keyed[key] for key in NAME_KEYS if key in keyed), None)
        if len(keyed) < 2 or named is None or data == len(rows) or len(rows[data].cells) != len(named.cells):
            continue
        if all(len(row.cells) % 2 == 0 and len(set(row.cells[::2])) == 1 for row in rows[:data]):
            units = next((keyed[key].cells[1::2] for key in UNIT_KEYS if key in keyed), ())
            channels = unique(named.cells[1::2])
            names = [cell for name in channels for cell in (f"time of {name}", name)]
            pairs = [cell for unit in units for cell in ("", known_unit(unit))]
            clocks = {name: f"time of {name}" for name in channels}
            first, decimal = rows[data].line, detect_decimal(rows[data:])
            notes = (f"header of keys and values; {OWN_TIME}",)
            return Dialect(separator, decimal, len(names), tuple(names), tuple(pairs), first, notes, clocks)
    return None


def with_repeated_times(table: Table, written: Sequence[str]) -> Table:
    """The table with the clock of each channel, if its first column and others have the same name of a time.

    written: the names as they stand in the file; those of the table differ where they are repeated.
    """
    first, names = next(iter(written), ""), table.names
    times = [i for i, name in enumerate(written) if name == first]
    if table.clocks or len(times) < 2:
        return table
    unit = table.header(names[0]).unit
    if not Header.of(first, unit).is_time:
        return table
    clocks = {
        name: names[max(time for time in times if time < i)] for i, name in enumerate(names) if i not in times
    }
    units = {**table.units, **{names[i]: unit for i in times}}
    return replace(table, clocks=clocks, units=units, notes=(*table.notes, f"{OWN_TIME}, to the left of it"))


def with_channels(table: Table) -> Table:
    """The table with a column for each channel, if it has a row for each value: name, date, time of day, value.

    The columns are as long as before, with empty cells in the rows of other channels.
    """
    if table.names != ["1", "2", "3", "4"]:  # as columns without a header are called
        return table
    label, date, time, _ = (np.asarray(column) for column in table.columns.values())
    if label.dtype.kind != "O" or date.dtype.kind != "M" or time.dtype.kind != "O":
        return table
    names = list(dict.fromkeys(label.tolist()))
    if len(names) > MOST_CHANNELS or not all(isinstance(name, str) for name in names):
        return table
    stamps = np.char.add(np.char.add(date.astype("M8[D]").astype(str), " "), time.astype(str)).astype(object)
    columns, numbers = {}, table.values("4")
    for name in names:
        columns[f"time of {name}"] = at = stamps.copy()
        at[label != name] = None
        columns[name] = np.where(label == name, numbers, np.nan)
    notes = (*table.notes, f"a row for each value; {OWN_TIME}")
    return replace(table, columns=columns, clocks={name: f"time of {name}" for name in names}, notes=notes)
