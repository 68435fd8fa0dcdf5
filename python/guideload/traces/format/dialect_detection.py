"""Dialect of a text table: separator, decimal sign, names, units and first row of samples.

The functions here look at the first lines only; pyarrow reads the values.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property

from guideload.base.number_text import counted
from guideload.traces.format.headers import OTHER_UNITS, TIME_WORDS, Header, known_unit

SEPARATORS = (";", "\t", ",", "|", " ")  # in order of preference for equal scores
COMMENT = re.compile(r"\s*(?:#|%|//)")
LONGEST_VALUE = 400  # characters of a number or stamp: a double has at most 325 digits in decimal notation
MOST_COLUMNS = 10_000  # far above any log; more are separators in a damaged line
TAIL = 40  # rows at the end of the inspected lines, taken as samples
EMPTY = frozenset(("", "nan", "na", "n/a", "#n/a", "null", "none", "-nan", "inf", "-inf", "+inf", "<na>"))
EXPONENT = r"(?:[eE][+-]?\d+)?"
NUMBER = re.compile(rf"[+-]?(?:\d+[.,]?\d*|[.,]\d+){EXPONENT}|0x[0-9a-fA-F]+|true|false", re.IGNORECASE)
WITH_COMMA = re.compile(rf"[+-]?(?:\d+,\d*|,\d+){EXPONENT}")
WITH_POINT = re.compile(rf"[+-]?(?:\d+\.\d*|\.\d+){EXPONENT}")
# Numbers with digits in groups of three, by decimal sign; a decimal sign or a second group makes them unambiguous.
GROUPS = {
    ".": re.compile(r"[+-]?\d{1,3}(?:(?:,\d{3})+\.\d*|(?:,\d{3}){2,}|(?:'\d{3})+(?:\.\d*)?)"),
    ",": re.compile(r"[+-]?\d{1,3}(?:(?:\.\d{3})+,\d*|(?:\.\d{3}){2,}|(?:'\d{3})+,\d*)"),
}
STAMP = re.compile(
    r"(?:\d{1,4}[-./]\d{1,2}[-./]\d{2,4}\.?)?(?:[T ]*\d{1,2}:\d{2}(?::\d{2}(?:[.,:]\d+)?)?)?\s*"
    r"(?:Z|UTC|[AaPp][Mm]|[+-]\d\d:?\d\d)?"
)
VALUE = re.compile(
    "|".join([f"(?i:{NUMBER.pattern})", *(form.pattern for form in (STAMP, *GROUPS.values()))])
)


@dataclass(frozen=True)
class Row:
    """One row of the inspected lines: index of its first line, and its cells."""

    line: int
    cells: tuple[str, ...]

    @property
    def width(self) -> int:
        """Number of cells up to the last one that is not empty."""
        return max((i + 1 for i, cell in enumerate(self.cells) if cell), default=0)

    @cached_property
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
    """Format of the samples, and the contents of the header.

    width: cells in a row; names: one for each column, () for a table without a header; units: one for each column, ""
    where there is none, or (); first: index of the first line that holds a sample; clocks: name of the time column by
    column name, if channels have their own time; rate: Hz, if the source gives it in place of time columns.
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
    return 0 < len(cell) <= LONGEST_VALUE and VALUE.fullmatch(cell) is not None


def decimal_by_groups(cell: str) -> str:
    """The decimal sign of a number, if its groups of digits show it; "" for any other cell."""
    if len(cell) > LONGEST_VALUE:
        return ""
    return next((sign for sign, form in GROUPS.items() if form.fullmatch(cell)), "")


def split_rows(lines: Sequence[str], separator: str) -> list[Row]:
    """The lines split into rows of cells; a quoted name may run over several lines."""
    if separator == " ":
        return [Row(i, tuple(line.split())) for i, line in enumerate(lines)]
    reader = csv.reader([line + "\n" for line in lines], delimiter=separator)
    rows, start = [], 0
    with suppress(csv.Error):  # an unclosed quote: the rest is no table with this separator
        for cells in reader:
            rows.append(Row(start, tuple(" ".join(cell.split()) for cell in cells)))
            start = reader.line_num
    if lines and not rows:  # a cell longer than the csv module reads
        rows.append(Row(0, tuple(lines[0].split(separator))))
    return rows


def detect_dialect(lines: Sequence[str]) -> Dialect:
    """The dialect of a table from its first lines, all of them complete.

    The separator is the one with the largest share of numbers and stamps in the last rows, and with a header as wide as
    these rows. The decimal sign is a comma if more numbers have a comma than a point.
    """
    plain = [i for i, line in enumerate(lines) if line.strip() and not COMMENT.match(line)]
    scored: list[tuple[tuple[float, ...], str, list[Row], int]] = []
    for order, separator in enumerate(SEPARATORS):
        if any(lines[i].count(separator) > MOST_COLUMNS for i in plain):
            continue
        rows = [row for row in split_rows([lines[i] for i in plain], separator) if row.cells]
        tail = rows[-TAIL:] if len(rows) > 1 else rows
        widths = Counter(row.width for row in tail if row.has_numbers)
        if not widths:
            continue
        width = max(widths, key=lambda size: (widths[size], size))
        # The tail of a short table includes the header.
        top = next(i for i, row in enumerate(tail) if row.width == width)
        cells = [cell for row in tail[top:] for cell in row.cells if cell.lower() not in EMPTY]
        share = round(sum(map(is_value, cells)) / max(len(cells), 1), 1)
        above = [row.width for row in rows if not row.has_numbers]
        score = (not above or width in above, share, width > 1, widths[width] / len(tail), -order)
        scored.append((score, separator, rows, width))
    if not scored:  # only text: a header without samples, or no table
        separator = max(SEPARATORS[:3], key=lines[plain[0]].count) if plain else ","
        names = split_rows([lines[plain[0]]], separator)[0].cells if plain else ()
        return Dialect(separator, ".", len(names), names, (), len(lines))
    _, separator, rows, width = max(scored)
    return _with_header(lines, [replace(row, line=plain[row.line]) for row in rows], separator, width)


def detect_decimal(rows: Sequence[Row]) -> str:
    """The decimal sign of the rows' numbers; "" if none of them shows one."""
    cells = [cell for row in rows for cell in row.cells]
    signs = {decimal_by_groups(cell) for cell in cells} - {""}
    if len(signs) == 1:
        return signs.pop()
    commas, points = (sum(bool(form.fullmatch(cell)) for cell in cells) for form in (WITH_COMMA, WITH_POINT))
    return "" if commas == points == 0 else "," if commas > points else "."


def _with_header(lines: Sequence[str], rows: list[Row], separator: str, width: int) -> Dialect:
    """The dialect with names and units from the lines above the first sample."""
    start = _first_sample(rows, width)
    top = _top_of_header(rows, start, width)
    head = rows[top:start]
    first = rows[start].line if start < len(rows) else len(lines)
    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    spare: tuple[str, ...] = ()  # units in a row of names
    notes: list[str] = []
    if head:
        named = max(range(len(head)), key=lambda i: (sum(map(_likeness_to_name, head[i].cells)), -i))
        names = head[named].cells
        known = [0 if i == named else _units_in(row.cells, names, i > named) for i, row in enumerate(head)]
        # Symbols such as t, s and M stand above their units.
        unit_row = max(range(len(head)), key=lambda i: (known[i], i))
        for i, row in enumerate(head):
            if i == named:
                continue
            place, merged = f"row {row.line + 1}", _merged_names(names, row.cells)
            if known[i] and i == unit_row:
                units = tuple(map(_written_unit, row.cells))
                notes.append(f"units from {place}")
            elif merged != names:
                # The lower row has units too, where its cell is not the name.
                lower = zip(names if i < named else row.cells, merged, strict=False)
                spare = tuple(known_unit(cell) if cell != name else "" for cell, name in lower)
                names = merged
                notes.append(f"names of quantities from {place}")
            elif i > named:
                notes.append(f"{place} above the samples is not used")
    else:  # the names may be in a comment
        comments = [COMMENT.sub("", line, count=1).strip() for line in lines[:first] if COMMENT.match(line)]
        for comment in reversed(comments):
            cells = split_rows([comment], separator)[0].cells
            if len(cells) == width and not any(map(is_value, cells)):
                names = cells
                break
    if top:
        notes.append(f"{counted(top, 'row')} above the names {'is' if top == 1 else 'are'} not used")
    width, decimal = max(width, Row(0, names).width), detect_decimal(rows[start:])
    return Dialect(separator, decimal, width, names[:width], (units or spare)[:width], first, tuple(notes))


def _first_sample(rows: list[Row], width: int) -> int:
    """Index of the first sample: the first row with numbers and without text in the numeric columns.

    Rows between the names and that row, if they are not only text, are samples that cannot be read: they are included
    here and refused later with their row numbers.
    """
    tail = [row.cells for row in rows[-TAIL:] if row.has_numbers]
    numeric = [
        i for i in range(width) if 2 * sum(any(map(is_value, cells[i : i + 1])) for cells in tail) > len(tail)
    ]

    def is_sample(at: int) -> bool:
        cells = [rows[at].cells[i] for i in numeric if i < len(rows[at].cells)]
        filled = [cell for cell in cells if cell.lower() not in EMPTY]
        # A row of numbers above the names is followed by text.
        in_header = any(below.is_text for below in rows[at + 1 : at + 3])
        return bool(filled) and all(map(is_value, filled)) and not in_header

    start = next(filter(is_sample, range(len(rows))), len(rows))
    named = next((i for i in range(start) if rows[i].width >= width and rows[i].is_text), start)
    while start - 1 > named and not rows[start - 1].is_text and rows[start - 1].width:
        start -= 1
    return start


def _top_of_header(rows: list[Row], start: int, width: int) -> int:
    """Index of the first header row, directly above the samples and as wide as these; `start` if there is none."""
    if width == 1:  # any line is as wide: the header is the name, and the unit if the last line is one
        has_units = start > 1 and bool(known_unit(rows[start - 1].cells[0]))
        return max(start - 1 - has_units, 0)
    top = start
    while top and rows[top - 1].has_text and rows[top - 1].width >= max(2, width - 1):
        if top < start and rows[top - 1].width > width:
            break
        top -= 1
    return top


def _likeness_to_name(cell: str) -> int:
    """Score of a cell as the name of a column: 2 for a time, 1 for a unit or word of motion."""
    header = Header.of(cell)
    return 2 * header.is_time + bool(header.kind or header.word_kind) if header.words else 0


def _units_in(cells: tuple[str, ...], names: tuple[str, ...], below: bool) -> int:
    """Number of units in a row below the names, or above them; 0 if it is no row of units."""
    known = [bool(known_unit(cell)) for cell in cells]
    others = [_bare(cell) in OTHER_UNITS for cell in cells]
    # Without brackets; "[-]" and "1" are no units.
    filled = [cell.strip("[]()-1 ").lower() for cell in cells]
    count = sum(unit or other for unit, other in zip(known, others, strict=True))
    alike = count + sum(text in TIME_WORDS and not unit for text, unit in zip(filled, known, strict=True))
    enough = sum(map(bool, filled)) / (2 if below else 1)
    return count if any(known) and alike >= enough and _merged_names(names, cells) == names else 0


def _bare(cell: str) -> str:
    return cell.strip("[](){}<> ")


def _written_unit(cell: str) -> str:
    """The unit in a row of units; one that is not known as it is written, so that it is refused where it counts."""
    bare = _bare(cell)
    is_text = any(map(str.isalpha, bare)) and bare.lower() not in EMPTY
    return known_unit(cell) or (bare if is_text else "")


def _merged_names(names: tuple[str, ...], cells: tuple[str, ...]) -> tuple[str, ...]:
    """The names with those of a second row, where it names quantities that they do not, as below "Analog 1"."""
    own, other = (list(map(_likeness_to_name, row)) for row in (names, cells))
    pairs = list(zip(names, cells, own, other, strict=False))
    if not any(there > here for _, _, here, there in pairs):
        return names
    merged = (cell if cell and there >= here else name for name, cell, here, there in pairs)
    return (*merged, *names[len(pairs) :])
