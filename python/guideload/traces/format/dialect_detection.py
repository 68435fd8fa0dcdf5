"""How a text table is written: separator, decimal sign, names, units and where its samples start.

Everything here looks at the first lines only and is pure; the values themselves are read by pyarrow.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

from guideload.traces.format.headers import TIME_WORDS, Header, known_unit

SEPARATORS = (";", "\t", ",", "|", " ")  # in order of preference where two explain the lines equally well
COMMENT = re.compile(r"\s*(?:#|%|//)")
TAIL = 40  # rows at the end of the opening, which hold samples
EMPTY = frozenset(("", "nan", "na", "n/a", "#n/a", "null", "none", "-nan", "inf", "-inf", "+inf", "<na>"))
EXPONENT = r"(?:[eE][+-]?\d+)?"
NUMBER = re.compile(rf"[+-]?(?:\d+[.,]?\d*|[.,]\d+){EXPONENT}|0x[0-9a-fA-F]+|true|false", re.IGNORECASE)
WITH_COMMA = re.compile(rf"[+-]?(?:\d+,\d*|,\d+){EXPONENT}")
WITH_POINT = re.compile(rf"[+-]?(?:\d+\.\d*|\.\d+){EXPONENT}")
# By decimal sign: numbers with digits in groups of three. A decimal sign or two groups show which sign is which.
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
    """One row of the opening: the index of its first line, and its cells."""

    line: int
    cells: tuple[str, ...]

    @property
    def width(self) -> int:
        """Cells up to the last that is not empty."""
        return max((i + 1 for i, cell in enumerate(self.cells) if cell), default=0)

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
    """How the samples are written, and what is written above them.

    width: cells in a row; names: one for each column, () for a table without a header; units: one for each column, ""
    where there is none, or (); first: index of the first line that holds a sample. Of a source with clocks of its own:
    the time column of each column, by its name, or else the rate in Hz.
    """

    separator: str
    decimal: str
    width: int
    names: tuple[str, ...]
    units: tuple[str, ...]
    first: int
    notes: tuple[str, ...] = ()
    clocks: Mapping[str, str] = field(default_factory=dict)
    rate: float | None = None


def is_value(cell: str) -> bool:
    """Whether a cell holds a number in either notation, or a date or time stamp."""
    return bool(NUMBER.fullmatch(cell) or (cell and STAMP.fullmatch(cell)) or grouped(cell))


def grouped(cell: str) -> str:
    """The decimal sign of a number, if its groups of digits show it; "" for any other cell."""
    return next((sign for sign, form in GROUPS.items() if form.fullmatch(cell)), "")


def rows_of(lines: Sequence[str], separator: str) -> list[Row]:
    """The lines split into rows of cells; a quoted name may run over several lines."""
    if separator == " ":
        return [Row(i, tuple(line.split())) for i, line in enumerate(lines)]
    reader = csv.reader([line + "\n" for line in lines], delimiter=separator)
    rows, start = [], 0
    with suppress(csv.Error):  # a quote that nothing closes: the rest is no table with this separator
        for cells in reader:
            rows.append(Row(start, tuple(" ".join(cell.split()) for cell in cells)))
            start = reader.line_num
    return rows


def dialect_of(lines: Sequence[str]) -> Dialect:
    """The dialect of a table from its first lines (complete lines, up to some hundred: the more, the surer).

    The separator is the one with which the last rows are most nearly all numbers and stamps, and the header
    as wide as they are. The decimal sign is a comma where more numbers have one than have a point.
    """
    plain = [i for i, line in enumerate(lines) if line.strip() and not COMMENT.match(line)]
    scored: list[tuple[tuple[float, ...], str, list[Row], int]] = []
    for order, separator in enumerate(SEPARATORS):
        rows = [row for row in rows_of([lines[i] for i in plain], separator) if row.cells]
        tail = rows[-TAIL:] if len(rows) > 1 else rows
        widths = Counter(row.width for row in tail if row.has_numbers)
        if not widths:
            continue
        width = max(widths, key=lambda size: (widths[size], size))
        top = next(i for i, row in enumerate(tail) if row.width == width)  # few rows include the header
        cells = [cell for row in tail[top:] for cell in row.cells if cell.lower() not in EMPTY]
        share = round(sum(map(is_value, cells)) / max(len(cells), 1), 1)
        above = [row.width for row in rows if not row.has_numbers]
        score = (not above or width in above, share, width > 1, widths[width] / len(tail), -order)
        scored.append((score, separator, rows, width))
    if not scored:  # nothing but text: the header alone, or no table at all
        separator = max(SEPARATORS[:3], key=lines[plain[0]].count) if plain else ","
        names = rows_of([lines[plain[0]]], separator)[0].cells if plain else ()
        return Dialect(separator, ".", len(names), names, (), len(lines))
    _, separator, rows, width = max(scored)
    return _with_header(lines, [replace(row, line=plain[row.line]) for row in rows], separator, width)


def decimal_of(rows: Sequence[Row]) -> str:
    """The decimal sign of the rows' numbers; "" if none of them shows one."""
    cells = [cell for row in rows for cell in row.cells]
    signs = {grouped(cell) for cell in cells} - {""}
    if len(signs) == 1:
        return signs.pop()
    commas, points = (sum(bool(form.fullmatch(cell)) for cell in cells) for form in (WITH_COMMA, WITH_POINT))
    return "" if commas == points == 0 else "," if commas > points else "."


def _with_header(lines: Sequence[str], rows: list[Row], separator: str, width: int) -> Dialect:
    """Names and units from what is written above the first sample."""
    start = _first_sample(rows, width)
    top = _top_of_header(rows, start, width)
    head = rows[top:start]
    first = rows[start].line if start < len(rows) else len(lines)
    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    notes: list[str] = []
    if head:
        named = max(range(len(head)), key=lambda i: (_likeness_to_names(head[i]), -i))
        names = head[named].cells
        for row in head[named + 1 :]:
            known = tuple(known_unit(cell) for cell in row.cells)
            # Without brackets; "[-]" and "1" are no units.
            texts = [cell.strip("[]()-1 ").lower() for cell in row.cells]
            count = sum(bool(unit) or text in TIME_WORDS for unit, text in zip(known, texts, strict=True))
            if not units and any(known) and 2 * count >= sum(map(bool, texts)) > 0:
                units = known
                notes.append(f"units from row {row.line + 1}")
            else:
                notes.append(f"row {row.line + 1} above the samples not used")
    else:  # names may stand in a comment
        comments = [COMMENT.sub("", line, count=1).strip() for line in lines[:first] if COMMENT.match(line)]
        for comment in reversed(comments):
            cells = rows_of([comment], separator)[0].cells
            if len(cells) == width and not any(map(is_value, cells)):
                names = cells
                break
    if top:
        notes.append(f"{top} rows above the names not used")
    width = max(width, Row(0, names).width)
    return Dialect(
        separator, decimal_of(rows[start:]), width, names[:width], units[:width], first, tuple(notes)
    )


def _first_sample(rows: list[Row], width: int) -> int:
    """Where the samples start: at the first row with numbers, and no text where the columns below hold numbers.

    Or above it, at a row that has some numbers, or nothing, while a row of names is still above that: such a
    row is a sample that cannot be read, and is refused later with its number.
    """
    tail = [row.cells for row in rows[-TAIL:] if row.has_numbers]
    numeric = [
        i for i in range(width) if 2 * sum(any(map(is_value, cells[i : i + 1])) for cells in tail) > len(tail)
    ]

    def is_sample(row: Row) -> bool:
        cells = [row.cells[i] for i in numeric if i < len(row.cells)]
        filled = [cell for cell in cells if cell.lower() not in EMPTY]
        return bool(filled) and all(map(is_value, filled))

    # A row above the names may hold numbers as well: text follows it.
    samples = (
        i
        for i, row in enumerate(rows)
        if is_sample(row) and not any(below.is_text for below in rows[i + 1 : i + 3])
    )
    start = next(samples, len(rows))
    named = next((i for i in range(start) if rows[i].width >= width and rows[i].is_text), start)
    while start - 1 > named and not rows[start - 1].is_text and rows[start - 1].width:
        start -= 1
    return start


def _top_of_header(rows: list[Row], start: int, width: int) -> int:
    """The first of the rows right above the samples that are as wide as they are; `start` if there are none."""
    if width == 1:  # any line is as wide: the names, and the units if there are two
        has_units = start > 1 and bool(known_unit(rows[start - 1].cells[0]))
        return max(start - 1 - has_units, 0)
    top = start
    while top and rows[top - 1].has_text and rows[top - 1].width >= max(2, width - 1):
        if top < start and rows[top - 1].width > width:
            break
        top -= 1
    return top


def _likeness_to_names(row: Row) -> int:
    """How much a row looks like names: its columns of time, and those with a unit or a word of motion."""
    headers = [Header.of(cell) for cell in row.cells]
    return sum(
        2 * header.is_time + bool(header.kind or header.word_kind) for header in headers if header.words
    )
