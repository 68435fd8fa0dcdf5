"""Text files of samples: decoded, their dialect detected, the values read by pyarrow."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import numpy as np

from guideload.base.arrays import Integers
from guideload.base.cores import threads
from guideload.base.errors import UnreadableTrace, shortened
from guideload.traces.format.dialect_detection import (
    COMMENT,
    MOST_COLUMNS,
    Dialect,
    detect_dialect,
    split_rows,
)
from guideload.traces.format.own_clocks import paired_dialect, with_channels, with_repeated_times
from guideload.traces.format.table import Table, listed_rows, unique
from guideload.traces.format.twincat_scope import scope_dialect

OPENING = 65536  # characters from which the dialect is detected, and whether the file is text
DIALECT_LINES = 300  # lines from which the dialect is detected, unless the header is longer
FEWEST_LINES = 60  # to detect the dialect: of a file with long lines more than OPENING characters are used
MANY_EMPTY = 0.3  # share of empty lines from which on line ends are doubled
CONTROL = re.compile(r"[\x00-\x08\x0e-\x19\x1b-\x1f]")  # in no text; DOS files may end in Ctrl-Z (1a)
# UTF-16 without a byte order mark: largest share of NUL in all bytes, least share in the even or the odd ones.
MOST_NULS, NULS_OF_UTF16 = 0.6, 0.4
NULLS = [
    *("", " ", "  ", "nan", "NaN", "NAN", "-nan", "-NaN", "NA", "<NA>", "n/a", "N/A", "#N/A"),
    *("null", "NULL", "None", "1.#QNAN", "-1.#IND"),
]
FILETIME_1970, FILETIME_MAX = 116_444_736_000_000_000, 200_000_000_000_000_000
BREAK = re.compile(r"\r\n|\r|\n")
SEPARATOR_HINT = "where numbers have a decimal comma, the separator must be another sign (; or tab)"


def read_text(path: Path) -> Table:
    """A text file as a table, its rows counted as an editor does. Raises UnreadableTrace; callers name the file."""
    text = _decoded(path)
    if re.match(r"\s*Name[ :].*\s+File[ :]", text):
        raise UnreadableTrace(
            "a TwinCAT Scope export with a blank or a colon between its cells, which names contain "
            "as well; export it with tab or semicolon"
        )
    size = OPENING
    while size < len(text) and text.count("\n", 0, size) + text.count("\r", 0, size) < FEWEST_LINES:
        size *= 4
    lines = BREAK.split(text[:size])
    if len(text) > size:
        lines.pop()  # cut in the middle
    dialect = scope_dialect(lines) or paired_dialect(lines) or _dialect(lines)
    if dialect.width > MOST_COLUMNS:
        raise UnreadableTrace(
            f"not a readable CSV table: expected at most {MOST_COLUMNS} cells in a row, got {dialect.width}"
        )
    body = "".join(BREAK.split(text, dialect.first)[dialect.first :]) if dialect.first else text
    decimal = _decimal(lines, body, dialect)
    columns, numbers, notes = _columns(body, dialect, decimal)
    padded = [*dialect.names, *[""] * (len(columns) - len(dialect.names))]
    prefix = "column " if dialect.names else ""
    names = unique([name or f"{prefix}{i}" for i, name in enumerate(padded, start=1)])
    if dialect.separator not in (",", ";", "\t"):
        notes.insert(0, f"separator {'blank' if dialect.separator == ' ' else dialect.separator}")
    if decimal == ",":
        notes.insert(0, "decimal comma")
    table = Table(
        path.name,
        dict(zip(names, columns, strict=True)),
        "row",
        numbers,
        notes=(*dialect.notes, *notes),
        units={name: unit for name, unit in zip(names, dialect.units, strict=False) if unit},
        clocks=dialect.clocks,
        rate=dialect.rate,
        decimal=decimal,
    )
    return with_channels(with_repeated_times(table, dialect.names))


def _dialect(lines: list[str]) -> Dialect:
    """The dialect, from the first DIALECT_LINES lines, or from all if the header is longer."""
    dialect = detect_dialect(lines[:DIALECT_LINES])
    if len(lines) > DIALECT_LINES:
        width = len(split_rows(lines[-1:], dialect.separator)[0].cells)
        if width != dialect.width or dialect.first >= DIALECT_LINES:
            dialect = detect_dialect(lines)
    return dialect


def _decimal(lines: list[str], body: str, dialect: Dialect) -> str:
    """The decimal sign. Raises UnreadableTrace if a comma may be a separator or part of digit groups as well."""
    separator, above, samples = dialect.separator, lines[: dialect.first], lines[dialect.first :]
    if separator != ",":
        # The first lines may hold whole numbers only.
        sign = re.escape(separator)
        with_comma = rf"(?:^|{sign})\s*[+-]?\d*,\d+(?:[eE][+-]?\d+)?\s*(?:{sign}|$)"
        has_comma = not dialect.decimal and "," in body and re.search(with_comma, body, re.MULTILINE)
        return dialect.decimal or ("," if has_comma else ".")
    # Decimal commas have split each number into two cells.
    if not dialect.names and any(
        row.is_text and 2 * len(row.cells) == dialect.width for row in split_rows(above, ",")
    ):
        raise UnreadableTrace(
            f"not a readable CSV table: {dialect.width} cells in a row under half as many names: the comma "
            "is both separator and decimal sign; save the table with ; or tab between the columns"
        )
    if dialect.decimal != ",":
        return "."
    cells = [cell for row in split_rows(samples, ",") for cell in row.cells if "," in cell]
    if cells and all(re.fullmatch(r"[+-]?[1-9]\d{0,2},\d{3}", cell) for cell in cells):
        raise UnreadableTrace(
            f'cells such as "{cells[0]}" may have groups of digits or a decimal comma, which is '
            "ambiguous; write numbers with a decimal point and no groups, or separate the cells by ; or tab"
        )
    return ","


def _decoded(path: Path) -> str:
    """The text of a file in UTF-8, UTF-16 or Windows' Western encoding. Raises UnreadableTrace if it is no text."""
    content = path.read_bytes()
    if content.startswith((b"PK\x03\x04", b"\xd0\xcf\x11\xe0")):
        raise UnreadableTrace(
            "not a text table but an Excel workbook (or another archive); export the sheet as CSV"
        )
    if content.startswith((b"\x1f\x8b", b"\xfd7zXZ", b"BZh", b"\x28\xb5\x2f\xfd")):
        raise UnreadableTrace("the file is compressed; unpack it, then give the file that was in it")
    wide = _wide_encoding(content)
    if not wide and not content.strip(b"\xef\xbb\xbf \t\r\n"):
        raise UnreadableTrace(
            "the file is empty; expected a line of column names and a line for each sample, as in "
            '"time_s,position_mm"'
        )
    for encoding in (wide,) if wide else ("utf-8-sig", "cp1252"):
        try:
            text = content.decode(encoding)
        except UnicodeDecodeError:
            continue
        if not CONTROL.search(text[:OPENING]):
            return text.rstrip("\x1a\x00").removeprefix("\ufeff")
    raise UnreadableTrace(
        "not a text table (it holds bytes that are no text); export it as CSV, or save it as UTF-8"
    )


def _wide_encoding(content: bytes) -> str:
    """UTF-16, by its byte order mark or because every other byte of Western text is NUL; else ""."""
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    top = content[:4096]
    if len(top) >= 2 and top.count(0) < MOST_NULS * len(top):
        for start, encoding in ((1, "utf-16-le"), (0, "utf-16-be")):
            if top[start::2].count(0) > NULS_OF_UTF16 * len(top[start::2]):
                return encoding
    return ""


def _columns(body: str, dialect: Dialect, decimal: str) -> tuple[list[Any], range | Integers, list[str]]:
    """The columns, the row number of each sample, and notes on rows left out."""
    first = dialect.first + 1
    if not body.strip():
        return [np.empty(0)] * dialect.width, range(first, first), []
    count = (body.count("\n") or body.count("\r")) + (not body.endswith(("\n", "\r")))
    numbers: range | Integers = range(first, first + count)
    notes: list[str] = []
    is_clean = dialect.separator != " " and not body.endswith("EOF")
    table = _parsed(body, dialect, decimal, count) if is_clean else None
    if table is None:
        body, numbers, notes = _cleaned(body, dialect, first)
        table = _parsed(body, dialect, decimal, len(numbers))
    if table is None:
        raise UnreadableTrace("not a readable CSV table: a quote or a line break is inside a sample")
    columns = [_array(column) for column in table.columns]
    filled = len(numbers)
    if filled and all(_is_empty(column[-1]) for column in columns):
        lines = BREAK.split(body)
        while filled and not lines[filled - 1].strip(f'{dialect.separator} \t"'):
            filled -= 1
    if filled < len(numbers):
        notes.append(f"{len(numbers) - filled} empty lines at the end")
    return [column[:filled] for column in columns], numbers[:filled], notes


class _Content(io.BytesIO):
    """Bytes that pyarrow reads on a thread, block by block; an error in the `with` block ends the reading."""

    ended = False

    def read(self, size: int | None = -1) -> bytes:
        if self.ended:
            raise InterruptedError("the reading was ended")
        return super().read(size)

    def __exit__(self, *error: object) -> None:
        self.ended = True


def _parsed(body: str, dialect: Dialect, decimal: str, count: int) -> Any:
    """The samples as a pyarrow table; None unless it has `count` rows of equal width."""
    import pyarrow as pa
    from pyarrow import csv

    ragged: list[Any] = []

    def skip(row: Any) -> str:
        ragged.append(row)
        return "skip"

    def read(content: _Content) -> Any:
        names = [str(i) for i in range(dialect.width)]
        return csv.read_csv(
            content,
            read_options=csv.ReadOptions(use_threads=False, column_names=names, block_size=1 << 22),
            parse_options=csv.ParseOptions(delimiter=dialect.separator, invalid_row_handler=skip),
            convert_options=csv.ConvertOptions(
                decimal_point=decimal, null_values=NULLS, strings_can_be_null=True
            ),
        )

    try:
        # On the main thread pyarrow would handle Ctrl-C itself, and lose one that comes as the reading ends.
        with threads(1) as submit, _Content(body.encode()) as content:
            table = submit(read, content).result()
    except (pa.ArrowInvalid, ValueError) as error:
        raise UnreadableTrace(f"not a readable CSV table: {shortened(str(error))}") from None
    return None if ragged or table.num_rows != count else table


def _cleaned(body: str, dialect: Dialect, first: int) -> tuple[str, Integers, list[str]]:
    """The samples with short rows filled up, without empty lines and comments; their row numbers; notes.

    In a table of one column an empty line is an empty cell, unless MANY_EMPTY of the lines are empty.
    """
    separator, width = dialect.separator, dialect.width
    samples: dict[int, str] = {}  # by row number
    left_out: dict[str, list[int]] = {"empty lines": [], "comments": []}
    long: list[int] = []
    lines = BREAK.split(body)
    while lines and lines[-1].strip() in ("", "EOF"):
        lines.pop()
    is_cell = width == 1 and sum(not line.strip(" ") for line in lines) < MANY_EMPTY * len(lines)
    for number, line in enumerate(lines, start=first):
        is_empty = not line.strip(" ")
        if is_empty and is_cell:
            samples[number] = "nan"
        elif is_empty or COMMENT.match(line):
            left_out["empty lines" if is_empty else "comments"].append(number)
        else:
            if separator == " ":
                line = " ".join(line.split())
            cells = line.count(separator) + 1
            if cells > width or '"' in line:
                row = split_rows([line], separator)[0]
                cells = len(row.cells)
                if cells > width:
                    line, cells = line.rstrip(separator + " "), max(row.width, 1)
                    if cells > width:
                        long.append(number)
            samples[number] = line + separator * (width - cells)
    if long:
        hint = f"; {SEPARATOR_HINT}" if separator == "," else ""
        raise UnreadableTrace(
            f"not a readable CSV table: expected {width} cells in a row, got more in line "
            f"{listed_rows(long)}{hint}"
        )
    notes = [f"{len(at)} {word} left out, row {listed_rows(at)}" for word, at in left_out.items() if at]
    return "\n".join(samples.values()) + "\n", np.asarray(list(samples), np.int64), notes


def _is_empty(cell: Any) -> bool:
    return cell is None or cell != cell or str(cell).strip() in ("", "NaT")


def _array(column: Any) -> Any:
    """A pyarrow column as a NumPy array: integers stay integers where all are, stamps become datetime64, else text."""
    import pyarrow as pa

    kind = column.type
    if pa.types.is_null(kind):
        return np.full(len(column), np.nan)
    if pa.types.is_integer(kind) and column.null_count:
        integers = column.fill_null(0).to_numpy()
        missing = column.is_null().to_numpy()
        if int(integers.max()) < 1 << 53:
            return np.where(missing, np.nan, integers)
        # Only stamps are as large: FILETIME (100 ns since 1601), or ns since 1970.
        since_1970 = integers if int(integers.max()) > FILETIME_MAX else (integers - FILETIME_1970) * 100
        return np.where(missing, np.datetime64("NaT"), since_1970.astype("M8[ns]"))
    if pa.types.is_time(kind):
        column = column.cast(pa.string())
    if pa.types.is_date(kind) or pa.types.is_timestamp(kind):
        try:
            return column.cast(pa.timestamp("ns")).to_numpy()
        except pa.ArrowInvalid:  # before 1677 or after 2262: refused as text with its row
            return column.cast(pa.string()).to_numpy()
    if (pa.types.is_floating(kind) or pa.types.is_integer(kind)) and not column.null_count:
        return np.from_dlpack(column.combine_chunks())  # `to_numpy` would import pandas, in 0.2 s
    return column.to_numpy()
