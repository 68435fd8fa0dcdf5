"""The layout of a TwinCAT Scope text export: a block of rows for the project, one for the channels, samples.

    Name <sep> project                                            once, may be missing
    File <sep> path
    Starttime of export <sep> FILETIME <sep> date <sep> time
    (empty line)
    Name           <sep> channel <sep> channel <sep> Name           <sep> channel
    Data-Type      <sep> REAL64  <sep> INT32   <sep> Data-Type      <sep> REAL64
    SampleTime[ms] <sep> 1       <sep> 1       <sep> SampleTime[ms] <sep> 5
    Unit           <sep> mm (Length) <sep> ...
    (empty line)
    0              <sep> 12,5    <sep> 7       <sep> 0              <sep> 3,25

The key of each row is repeated wherever channels with another sample time begin: there the samples have
their time, in ms from the start, or as FILETIME (100 ns since 1601). Written from Beckhoff's description
(TE13xx, "Export to csv") and exports of versions 2 and 3.
"""

from __future__ import annotations

from collections.abc import Sequence

from guideload.traces.format.dialect_detection import (
    SEPARATORS,
    Dialect,
    Row,
    detect_decimal,
    is_value,
    split_rows,
)
from guideload.traces.format.headers import known_unit

PROJECT_KEYS = ("File", "StartRecord", "Starttime of export")
CHANNEL_KEYS = "SymbolComment Data-Type SampleTime[ms] SymbolName NetID NetId Port Unit".split()


def scope_dialect(lines: Sequence[str]) -> Dialect | None:
    """The dialect of a Scope export from its first lines; None for any other table."""
    first = next((line for line in lines if line.strip()), "")
    separator = next((sign for sign in SEPARATORS if sign != " " and first.startswith(f"Name{sign}")), "")
    if not separator:
        return None
    rows = [Row(i, split_rows([line], separator)[0].cells) for i, line in enumerate(lines) if line.strip()]
    data = next((i for i, row in enumerate(rows) if is_value(row.cells[0])), len(rows))
    keyed = [row for row in rows[:data] if row.cells[0] == "Name"]
    keys = {row.cells[0] for row in rows[:data]}
    if not keyed or not keys & {*PROJECT_KEYS, *CHANNEL_KEYS} or (len(keyed) == 1 and "File" in keys):
        return None
    head = {row.cells[0]: row.cells for row in rows[:data] if row.line > keyed[-1].line}
    cells, samples = keyed[-1].cells[: keyed[-1].width], rows[data:]

    def value(key: str, column: int) -> str:
        return next(iter(head.get(key, ())[column : column + 1]), "")

    columns: list[tuple[str, str]] = []  # names and units
    clocks: dict[str, str] = {}
    clock = ""
    periods: set[str] = set()
    has_clocks = not samples or len(samples[0].cells) > len(cells) - cells.count("Name")
    notes = ["TwinCAT Scope export"]
    for column, cell in enumerate(cells):
        if cell == "Name":
            clock = f"time of {cells[column + 1] if column + 1 < len(cells) else 'nothing'}"
            if has_clocks:
                columns.append((clock, "ms"))
            continue
        columns.append((cell, known_unit(value("Unit", column))))
        if has_clocks:
            clocks[cell] = clock
        else:
            periods.add(value("SampleTime[ms]", column).replace(",", "."))
        scale, offset = value("ScaleFactor", column), value("Offset", column)
        if scale not in ("", "1") or offset not in ("", "0"):
            notes.append(f"channel {cell}: ScaleFactor {scale}, Offset {offset}, values as exported")
    # Without time columns, rows of channels with different sample times have no common clock.
    period = periods.pop() if len(periods) == 1 else ""
    rate = 1e3 / float(period) if is_value(period) and float(period) > 0.0 else None
    start = samples[0].line if samples else len(lines)
    names, units = zip(*columns, strict=True) if columns else ((), ())
    return Dialect(
        separator, detect_decimal(samples), len(names), names, units, start, tuple(notes), clocks, rate
    )
