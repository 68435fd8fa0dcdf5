"""Text files of samples: decoded, their dialect told, the values read by pyarrow."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from guideload.base.errors import TraceError, shortened
from guideload.traces.format.dialects import COMMENT, Dialect, dialect_of, rows_of
from guideload.traces.format.scope_csv import scope_layout
from guideload.traces.format.table import Table, listed_rows, unique

OPENING = 65536  # characters that show the dialect, and whether it is text at all
SHOWING = 300  # lines that are enough to show the dialect, unless more stand above the samples
FEWEST_LINES = 60  # of them, in a file of long lines
MANY_EMPTY = 0.3  # of the lines
CONTROL = re.compile(r"[\x00-\x08\x0e-\x19\x1b-\x1f]")  # in no text; a last Ctrl-Z (1a) is in some of DOS
NULLS = [
    *("", " ", "  ", "nan", "NaN", "NAN", "-nan", "-NaN", "NA", "<NA>", "n/a", "N/A", "#N/A"),
    *("null", "NULL", "None", "1.#QNAN", "-1.#IND"),
]
FILETIME_1970, FILETIME_MAX = 116_444_736_000_000_000, 200_000_000_000_000_000
BREAK = re.compile(r"\r\n|\r|\n")


def read_text(path: Path) -> Table:
    """A text file as a table, its rows counted as an editor does. Raises TraceError."""
    text = _decoded(path)
    size = OPENING
    while size < len(text) and text.count("\n", 0, size) + text.count("\r", 0, size) < FEWEST_LINES:
        size *= 4
    opening = text[:size]
    lines = BREAK.split(opening)
    if len(text) > size:
        lines.pop()  # cut in the middle
    if re.match(r"\s*Name[ :].*\s+File[ :]", text):
        raise TraceError(
            f"{path.name}: a TwinCAT Scope export with a blank or a colon between its cells, which stand in names "
            "as well; export it with tab or semicolon"
        )
    scope = scope_layout(lines)
    dialect = scope.dialect if scope else dialect_of(lines[:SHOWING])
    if not scope and len(lines) > SHOWING and not _fits(lines[-1], dialect):
        dialect = dialect_of(lines)  # much stands above the samples
    starts = [0, *(found.end() for found in BREAK.finditer(opening))]
    body = text[starts[dialect.first] if dialect.first < len(starts) else len(text) :]
    if (
        dialect.separator == ","
        and not dialect.names
        and _is_half_as_wide(lines[: dialect.first], dialect.width)
    ):
        raise TraceError(
            f"{path.name}: not a readable CSV table: {dialect.width} cells in a row under half as many names; "
            "where numbers have a decimal comma, the separator must be another sign (; or tab)"
        )
    decimal = dialect.decimal or ("," if _has_decimal_comma(body, dialect.separator) else ".")
    if decimal == dialect.separator and (doubtful := _doubtful(lines[dialect.first :], decimal)):
        raise TraceError(
            f'{path.name}: cells such as "{doubtful}" may have groups of digits or a decimal comma, and nothing tells '
            "which; write numbers with a decimal point and no groups, or separate the cells by ; or tab"
        )
    columns, numbers, notes = _columns(path.name, body, dialect, decimal)
    if dialect.names:
        names = unique([name or f"column {i + 1}" for i, name in enumerate(_padded(dialect.names, columns))])
    else:
        names = [str(i + 1) for i in range(len(columns))]
    units = {name: unit for name, unit in zip(names, dialect.units, strict=False) if unit}
    if dialect.separator not in (",", ";", "\t"):
        notes.insert(0, f"separator {'blank' if dialect.separator == ' ' else dialect.separator}")
    if decimal == ",":
        notes.insert(0, "decimal comma")
    return Table(
        path.name,
        dict(zip(names, columns, strict=True)),
        "row",
        numbers,
        notes=(*dialect.notes, *notes),
        units=units,
        clocks=scope.clocks if scope else {},
        rate=scope.rate if scope else None,
        decimal=decimal,
    )


def _decoded(path: Path) -> str:
    """The text of a file in UTF-8, UTF-16 or Windows' Western encoding. Raises TraceError for what is none."""
    content = path.read_bytes()
    if content.startswith(b"PK\x03\x04") or content.startswith(b"\xd0\xcf\x11\xe0"):
        raise TraceError(
            f"{path.name}: not a text table but an Excel workbook (or another archive); export the sheet as CSV"
        )
    wide = _wide_encoding(content)
    if not wide and not re.search(rb"[^\xef\xbb\xbf \t\r\n]", content):
        raise TraceError(
            f"{path.name}: the file is empty; expected a line of column names and a line for each sample, as in "
            '"time_s,position_mm"'
        )
    for encoding in (wide,) if wide else ("utf-8-sig", "cp1252"):
        try:
            text = content.decode(encoding)
        except UnicodeDecodeError:
            continue
        if not CONTROL.search(text[:OPENING]):
            return text.rstrip("\x1a\x00").removeprefix("\ufeff")
    raise TraceError(
        f"{path.name}: not a text table (it holds bytes that are no text); export it as CSV, or save it as UTF-8"
    )


def _wide_encoding(content: bytes) -> str:
    """UTF-16 by its mark, or without one because every other byte of Western text is then NUL; else ""."""
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    top = content[:4096]
    if len(top) >= 2 and top.count(0) < 0.6 * len(top):
        for start, encoding in ((1, "utf-16-le"), (0, "utf-16-be")):
            if top[start::2].count(0) > 0.4 * len(top[start::2]):
                return encoding
    return ""


def _columns(
    source: str, body: str, dialect: Dialect, decimal: str
) -> tuple[list[Any], range | NDArray[np.int64], list[str]]:
    """The columns, the row number of each sample, and notes on rows left out."""
    first = dialect.first + 1
    if not body.strip():
        return [np.empty(0)] * dialect.width, range(first, first), []
    count = body.count("\n") or body.count("\r")
    count += not body.endswith(("\n", "\r"))
    table, ragged = None, True
    if dialect.separator != " " and not body.endswith("EOF"):
        table, ragged = _parsed(source, body, dialect, decimal)
    if table is not None and not ragged and table.num_rows == count:
        numbers: range | NDArray[np.int64] = range(first, first + count)
        notes: list[str] = []
    else:
        body, numbers, notes = _cleaned(source, body, dialect, first)
        table, ragged = _parsed(source, body, dialect, decimal)
        if ragged or table.num_rows != len(numbers):
            raise TraceError(
                f"{source}: not a readable CSV table: a quote or a line break stands in a sample"
            )
    columns = [_array(column) for column in table.columns]
    filled = len(numbers)
    while filled and all(_is_empty(column[filled - 1]) for column in columns):
        filled -= 1
    if filled < len(numbers):
        notes.append(f"{len(numbers) - filled} empty lines at the end")
    return [column[:filled] for column in columns], numbers[:filled], notes


def _parsed(source: str, body: str, dialect: Dialect, decimal: str) -> tuple[Any, bool]:
    """The samples as a pyarrow table, and whether rows of another width were left out of it."""
    import pyarrow as pa
    from pyarrow import csv

    ragged: list[Any] = []

    def skip(row: Any) -> str:
        ragged.append(row)
        return "skip"

    names = [str(i) for i in range(dialect.width)]
    try:
        table = csv.read_csv(
            pa.BufferReader(body.encode()),
            read_options=csv.ReadOptions(use_threads=False, column_names=names, block_size=1 << 22),
            parse_options=csv.ParseOptions(delimiter=dialect.separator, invalid_row_handler=skip),
            convert_options=csv.ConvertOptions(
                decimal_point=decimal, null_values=NULLS, strings_can_be_null=True
            ),
        )
    except (pa.ArrowInvalid, ValueError) as error:
        raise TraceError(f"{source}: not a readable CSV table: {shortened(str(error))}") from None
    return table, bool(ragged)


def _cleaned(
    source: str, body: str, dialect: Dialect, first: int
) -> tuple[str, NDArray[np.int64], list[str]]:
    """The samples with short rows filled up and empty lines and comments left out; their row numbers.

    In a table of one column an empty line is an empty cell, unless there are many: line ends that were doubled.
    """
    separator, width = dialect.separator, dialect.width
    kept: list[str] = []
    numbers: list[int] = []
    empty: list[int] = []
    comments: list[int] = []
    long: list[int] = []
    lines = BREAK.split(body)
    while lines and (not lines[-1].strip() or lines[-1].strip() == "EOF"):
        lines.pop()
    blank = sum(not line.strip(" \r\n") for line in lines)
    is_cell = width == 1 and blank < MANY_EMPTY * len(lines)
    for number, line in enumerate(lines, start=first):
        if not line.strip(" \r\n"):
            if is_cell:
                kept.append("nan")
                numbers.append(number)
            else:
                empty.append(number)
            continue
        if COMMENT.match(line):
            comments.append(number)
            continue
        if separator == " ":
            line = " ".join(line.split())
        cells = line.count(separator) + 1
        if '"' in line:
            cells = len(rows_of([line], separator)[0].cells)
        if cells > width:
            parts = rows_of([line], separator)[0].cells
            if any(parts[width:]):
                long.append(number)
                continue
            line = line.rstrip(separator + " ") + separator * max(0, width - 1 - _last(parts))
            cells = line.count(separator) + 1
        kept.append(line + separator * (width - cells))
        numbers.append(number)
    if long:
        hint = ""
        if separator == ",":
            hint = "; where numbers have a decimal comma, the separator must be another sign (; or tab)"
        raise TraceError(
            f"{source}: not a readable CSV table: expected {width} cells in a row, got more in line "
            f"{listed_rows(long)}{hint}"
        )
    notes = []
    for word, found in (("empty lines", empty), ("comments", comments)):
        if found:
            notes.append(f"{len(found)} {word} left out, row {listed_rows(found)}")
    return "\n".join(kept) + "\n", np.asarray(numbers, np.int64), notes


def _is_empty(cell: Any) -> bool:
    return cell is None or cell != cell or str(cell).strip() in ("", "NaT")


def _fits(line: str, dialect: Dialect) -> bool:
    return len(rows_of([line], dialect.separator)[0].cells) == dialect.width and dialect.first < SHOWING


def _has_decimal_comma(body: str, separator: str) -> bool:
    """Whether any cell is a number with a comma: the first lines may hold whole numbers only."""
    if separator == "," or "," not in body:
        return False
    sign = re.escape(separator)
    return bool(
        re.search(rf"(?:^|{sign})\s*[+-]?\d*,\d+(?:[eE][+-]?\d+)?\s*(?:{sign}|$)", body, re.MULTILINE)
    )


def _doubtful(lines: list[str], separator: str) -> str:
    """The first cell with a comma, if all of those may be whole numbers in groups of digits; "" otherwise."""
    cells = [cell for row in rows_of(lines, separator) for cell in row.cells if "," in cell]
    return cells[0] if cells and all(re.fullmatch(r"[+-]?[1-9]\d{0,2},\d{3}", cell) for cell in cells) else ""


def _is_half_as_wide(lines: list[str], width: int) -> bool:
    """Whether a row of names has half as many cells: each number was cut in two at its decimal comma."""
    return any(row.is_text and 2 * len(row.cells) == width for row in rows_of(lines, ","))


def _last(parts: tuple[str, ...]) -> int:
    return max((i for i, part in enumerate(parts) if part), default=0)


def _array(column: Any) -> Any:
    """A pyarrow column as a NumPy array: numbers stay whole where all are, stamps become datetime64, else text."""
    import pyarrow as pa

    kind = column.type
    if pa.types.is_null(kind):
        return np.full(len(column), np.nan)
    if pa.types.is_integer(kind) and column.null_count:
        whole = column.fill_null(0).to_numpy()
        missing = column.is_null().to_numpy()
        if int(whole.max()) < 1 << 53:
            return np.where(missing, np.nan, whole)
        # Only stamps are as large: FILETIME (100 ns since 1601), or ns since 1970.
        since_1970 = whole if int(whole.max()) > FILETIME_MAX else (whole - FILETIME_1970) * 100
        return np.where(missing, np.datetime64("NaT"), since_1970.astype("M8[ns]"))
    if pa.types.is_time(kind):
        column = column.cast(pa.string())
    if pa.types.is_date(kind):
        column = column.cast(pa.timestamp("ns"))
    if pa.types.is_timestamp(kind):
        return column.cast(pa.timestamp("ns")).to_numpy()
    if (pa.types.is_floating(kind) or pa.types.is_integer(kind)) and not column.null_count:
        return np.from_dlpack(column.combine_chunks())  # `to_numpy` would import pandas, in 0.2 s
    return column.to_numpy()


def _padded(names: tuple[str, ...], columns: list[Any]) -> list[str]:
    return [*names, *[""] * (len(columns) - len(names))]
