"""How a text table is written: separator, decimal sign, names, units and where its samples start.

Everything here looks at the first lines only and is pure; the values themselves are read by pyarrow.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from guideload.traces.format.headers import TIME_WORDS, Header, known_unit

SEPARATORS = (";", "\t", ",", "|", " ")  # in order of preference where two explain the lines equally well
COMMENT = re.compile(r"\s*(?:#|%|//)")
TAIL = 40  # rows at the end of the opening that show what a sample looks like
EMPTY = frozenset(("", "nan", "na", "n/a", "#n/a", "null", "none", "-nan", "inf", "-inf", "+inf", "<na>"))
EXPONENT = r"(?:[eE][+-]?\d+)?"
NUMBER = re.compile(rf"[+-]?(?:\d+[.,]?\d*|[.,]\d+){EXPONENT}|0x[0-9a-fA-F]+|true|false", re.IGNORECASE)
WITH_COMMA = re.compile(rf"[+-]?(?:\d+,\d*|,\d+){EXPONENT}")
WITH_POINT = re.compile(rf"[+-]?(?:\d+\.\d*|\.\d+){EXPONENT}")
# Numbers whose digits stand in groups of three; with a decimal sign or two groups, it is plain which sign is which.
GROUPS = {
    ".": re.compile(r"[+-]?\d{1,3}(?:(?:,\d{3})+\.\d*|(?:,\d{3}){2,}|(?:'\d{3})+(?:\.\d*)?)"),
    ",": re.compile(r"[+-]?\d{1,3}(?:(?:\.\d{3})+,\d*|(?:\.\d{3}){2,}|(?:'\d{3})+,\d*)"),
}
STAMP = re.compile(
    r"(?:\d{1,4}[-./]\d{1,2}[-./]\d{2,4}\.?)?(?:[T ]*\d{1,2}:\d{2}(?::\d{2}(?:[.,:]\d+)?)?)?\s*"
    r"(?:Z|UTC|[AaPp][Mm]|[+-]\d\d:?\d\d)?"
)


@dataclass(frozen=True)
class Row:
    """One row of the opening: the index of its first line, that of the next row's, and its cells."""

    line: int
    after: int
    cells: tuple[str, ...]

    @property
    def has_numbers(self) -> bool:
        return any(is_value(cell) for cell in self.cells)

    @property
    def has_text(self) -> bool:
        return any(cell.lower() not in EMPTY and not is_value(cell) for cell in self.cells)

    @property
    def is_text(self) -> bool:
        return self.has_text and not self.has_numbers


@dataclass(frozen=True)
class Dialect:
    """How the samples are written, and what stands above them.

    names: one for each column, () for a table without a header; units: as many, "" where none is told;
    first: index of the first line that holds a sample.
    """

    separator: str
    decimal: str
    width: int
    names: tuple[str, ...]
    units: tuple[str, ...]
    first: int
    notes: tuple[str, ...] = ()


def is_value(cell: str) -> bool:
    """Whether a cell holds a number in either notation, or a date or time stamp."""
    return bool(NUMBER.fullmatch(cell) or (cell and STAMP.fullmatch(cell)) or grouped(cell))


def grouped(cell: str) -> str:
    """The decimal sign of a number whose groups of digits tell it; "" for any other cell."""
    return next((sign for sign, form in GROUPS.items() if form.fullmatch(cell)), "")


def rows_of(lines: Sequence[str], separator: str) -> list[Row]:
    """The lines split into rows of cells; a quoted name may run over several lines."""
    if separator == " ":
        return [Row(i, i + 1, tuple(line.split())) for i, line in enumerate(lines)]
    reader = csv.reader([line + "\n" for line in lines], delimiter=separator)
    rows = []
    start = 0
    try:
        for cells in reader:
            rows.append(Row(start, reader.line_num, tuple(" ".join(cell.split()) for cell in cells)))
            start = reader.line_num
    except csv.Error:  # a quote that nothing closes: the rest is no table with this separator
        pass
    return rows


def dialect_of(lines: Sequence[str]) -> Dialect:
    """The dialect of a table from its first lines (whole lines; the more, the surer, up to some hundred).

    The separator is the one with which the last rows are most nearly all numbers and stamps, and the header
    as wide as they are. The decimal sign is a comma where more numbers have one than have a point.
    """
    plain = [i for i, line in enumerate(lines) if line.strip() and not COMMENT.match(line)]
    best: tuple[tuple[float, ...], str, list[Row], int] | None = None
    for order, separator in enumerate(SEPARATORS):
        rows = [row for row in rows_of([lines[i] for i in plain], separator) if row.cells]
        tail = rows[-TAIL:] if len(rows) > 1 else rows
        widths = Counter(_width(row) for row in tail if row.has_numbers)
        if not widths:
            continue
        width = max(widths, key=lambda size: (widths[size], size))
        top = next(
            i for i, row in enumerate(tail) if _width(row) == width
        )  # of few rows, some are above the samples
        cells = [cell for row in tail[top:] for cell in row.cells if cell.lower() not in EMPTY]
        share = round(sum(map(is_value, cells)) / max(len(cells), 1), 1)
        above = [row for row in rows if not row.has_numbers]
        fits = not above or any(_width(row) == width for row in above)
        score = (fits, share, width > 1, widths[width] / len(tail), -order)
        if best is None or score > best[0]:
            best = (score, separator, rows, width)
    if best is None:  # nothing but text: the header alone, or no table at all
        separator = max(SEPARATORS[:3], key=lines[plain[0]].count) if plain else ","
        names = rows_of([lines[plain[0]]], separator)[0].cells if plain else ()
        return Dialect(separator, ".", len(names), names, (), len(lines))
    _, separator, rows, width = best
    rows = [Row(plain[row.line], plain[row.after - 1] + 1, row.cells) for row in rows]
    return _with_header(lines, rows, separator, width)


def decimal_of(rows: Sequence[Row]) -> str:
    """The decimal sign of the rows' numbers; "" if none of them shows one."""
    cells = [cell for row in rows for cell in row.cells]
    told = {sign for sign in map(grouped, cells) if sign}
    if len(told) == 1:
        return told.pop()
    commas = sum(bool(WITH_COMMA.fullmatch(cell)) for cell in cells)
    points = sum(bool(WITH_POINT.fullmatch(cell)) for cell in cells)
    return "" if commas == points == 0 else "," if commas > points else "."


def _width(row: Row) -> int:
    """Cells of a row, up to the last that is not empty."""
    return max((i + 1 for i, cell in enumerate(row.cells) if cell), default=0)


def _with_header(lines: Sequence[str], rows: list[Row], separator: str, width: int) -> Dialect:
    """Names and units from what stands above the first sample."""
    start = _first_sample(rows, width)
    top = _top_of_header(rows, start, width)
    head = rows[top:start]
    first = rows[start].line if start < len(rows) else len(lines)
    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    notes: list[str] = []
    if head:
        named = max(range(len(head)), key=lambda i: (_telling(head[i]), -i))
        names = head[named].cells
        for row in head[named + 1 :]:
            found = tuple(known_unit(cell) for cell in row.cells)
            told = [cell for cell in row.cells if _bare(cell)]
            meant = sum(
                bool(unit) or _bare(cell) in TIME_WORDS for unit, cell in zip(found, row.cells, strict=True)
            )
            if not units and any(found) and 2 * meant >= len(told) > 0:
                units = found
                notes.append(f"units from row {row.line + 1}")
            else:
                notes.append(f"row {row.line + 1} above the samples not used")
    else:  # names may stand in a comment
        for line in reversed([line for line in lines[:first] if COMMENT.match(line)]):
            cells = rows_of([COMMENT.sub("", line, count=1).strip()], separator)[0].cells
            if len(cells) == width and not any(map(is_value, cells)):
                names = cells
                break
    if top:
        notes.append(f"{top} rows above the names not used")
    width = max(width, _width(Row(0, 0, names)))
    return Dialect(
        separator, decimal_of(rows[start:]), width, names[:width], units[:width], first, tuple(notes)
    )


def _bare(cell: str) -> str:
    """What a cell of a row of units says, without brackets; "" for none, as in "[-]" and "1"."""
    return cell.strip("[]()-1 ").lower()


def _first_sample(rows: list[Row], width: int) -> int:
    """Where the samples start: at the first row with numbers, and no text where the columns below hold numbers.

    Or above it, at a row that has some numbers, or nothing, while a row of names is still above that: such a
    row is a sample that cannot be read, and is refused later with its number.
    """
    tail = [row for row in rows[-TAIL:] if row.has_numbers]
    numeric = [
        i
        for i in range(width)
        if 2 * sum(i < len(row.cells) and is_value(row.cells[i]) for row in tail) > len(tail)
    ]

    def is_sample(row: Row) -> bool:
        cells = [row.cells[i] for i in numeric if i < len(row.cells)]
        filled = [cell for cell in cells if cell.lower() not in EMPTY]
        return bool(filled) and all(map(is_value, filled))

    start = next(
        # A row above the names may hold numbers as well: text follows it.
        (
            i
            for i, row in enumerate(rows)
            if is_sample(row) and not any(r.is_text for r in rows[i + 1 : i + 3])
        ),
        len(rows),
    )
    named = next((i for i in range(start) if _width(rows[i]) >= width and rows[i].is_text), start)
    while start - 1 > named and not rows[start - 1].is_text and _width(rows[start - 1]):
        start -= 1
    return start


def _top_of_header(rows: list[Row], start: int, width: int) -> int:
    """The first of the rows right above the samples that are as wide as they are; `start` if there are none."""
    top = start
    if width == 1:  # any line is as wide: the names, and the units if there are two
        units = start > 1 and bool(known_unit(rows[start - 1].cells[0]))
        return max(start - 1 - units, 0)
    while top and rows[top - 1].has_text and _width(rows[top - 1]) >= max(2, width - 1):
        if top < start and _width(rows[top - 1]) > width:
            break
        top -= 1
    return top


def _telling(row: Row) -> int:
    """How much a row looks like names: its columns of time, and those with a unit or a word of motion."""
    headers = [Header.of(cell) for cell in row.cells]
    return sum(
        2 * header.is_time + bool(header.kind or header.word_kind) for header in headers if header.words
    )
