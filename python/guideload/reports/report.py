"""What a report says, its sentences, sections, tables and definitions as data, and their text."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import zip_longest
from math import isfinite, isnan
from textwrap import wrap
from typing import Any

from rich.cells import cell_len

from guideload.base.errors import NotFinite
from guideload.base.number_text import KINDS, NARROW_SPACE, between, joined
from guideload.base.visible_text import visible
from guideload.base.warnings import verdict
from guideload.machine.machine import DOFS, Machine

WIDTH = 80
MOST_PROSE = 100  # characters: longer lines are hard to read
NARROWEST_LABEL = 9  # a label this short stays on one line
NARROWEST_NAMES = 16  # shorter names are not divided to spare a block
NARROWEST_TEXT = 24  # a text column this wide may stand beside others
GAP = 2  # characters between two columns
STAND_INS = {NARROW_SPACE: " ", "─": "-"}  # in encodings that lack the character

Value = float | str | None


@dataclass(frozen=True)
class Column:
    """A column of a table: its heading, its values, and how they are written.

    label: heading. values: a number, a text or None (an empty cell) for each row. unit: below the label.
    kind: of quantity, one of `number_text.KINDS`, which says how its numbers are written; "" for names and texts.
    """

    label: str
    values: Iterable[Value]
    unit: str = ""
    kind: str = ""

    @property
    def is_number(self) -> bool:
        """Whether the column is aligned to the right."""
        return bool(self.kind)

    @property
    def cells(self) -> list[str]:
        """The text of each row: the one place where values of tables become text."""
        return [self._cell(value) for value in self.values]

    def _cell(self, value: Value) -> str:
        if value is None or isinstance(value, str):
            return visible(value or "")
        if isnan(value):
            raise NotFinite(self.label, value)
        return KINDS[self.kind](float(value))


class Table:
    """Columns of the same length, the first with the names of the rows.

    A column without a value is left out; a table without rows is not shown.
    """

    def __init__(self, *columns: Column) -> None:
        cells = [column.cells for column in columns]
        shown = [i for i, texts in enumerate(cells) if i == 0 or any(texts)]
        self.columns = [columns[i] for i in shown]
        self.rows = list(zip(*(cells[i] for i in shown), strict=True))

    @classmethod
    def by_rows(cls, headings: Sequence[tuple[str, ...]], rows: Iterable[Sequence[Value]]) -> Table:
        """A table from its rows. headings: label, unit and kind of each column; see `Column`."""
        columns = list(zip(*rows, strict=True)) or [()] * len(headings)
        return cls(*(Column(one[0], each, *one[1:]) for one, each in zip(headings, columns, strict=True)))

    def __bool__(self) -> bool:
        return bool(self.rows)


class Definitions:
    """What the terms of a section mean, in one or several sentences each; in HTML they are shown at a click."""

    def __init__(self, *texts: str) -> None:
        self.texts = list(filter(None, texts))

    def __bool__(self) -> bool:
        return bool(self.texts)


# A paragraph, lines that belong together, a table, or definitions. What is empty is not shown.
Part = str | list[str] | Table | Definitions | None


class Section:
    """A part of a report with a title. It is not shown if it has no content."""

    def __init__(self, title: str, *parts: Part) -> None:
        self.title = title
        self.parts = [part for part in parts if part]


@dataclass(frozen=True)
class Report:
    """A whole report.

    title: of the page. head: project, customer and the like, a line each. answer: the result in a few sentences.
    warnings: what speaks against it, the worst first; the page counts them. about: what it is about, such as the free
    dofs of the machine. failed: whether what was asked for is not reached.
    """

    title: str
    answer: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    about: str = ""
    sections: list[Section] = field(default_factory=list)
    failed: bool = False
    head: list[str] = field(default_factory=list)

    @classmethod
    def of(cls, machine: Machine, title: str, **parts: Any) -> Report:
        """A report about a machine, with its name in the title, the head of its table [report] and its free dofs.

        parts: the other fields.
        """
        held = ", ".join(dof for dof in DOFS if dof not in machine.free) or "none"
        about = f"free {', '.join(machine.free)}; held {held}"
        return cls(title=f"{machine.name}: {title}", head=machine.report.lines, about=about, **parts)

    @property
    def verdict(self) -> str:
        """The number of warnings, in words."""
        return verdict(self.warnings)

    def text(self, width: int = WIDTH, encoding: str = "utf-8") -> str:
        """The report as text in lines of at most `width` characters, where words and numbers allow it."""
        top: list[Part] = [self.head, *self.answer, self.verdict, *self.warnings, self.about]
        blocks = [_text(part, width) for part in top if part]
        for one in self.sections:
            if shown := one.parts:
                space = "\n\n" if isinstance(shown[0], Table) else "\n"
                first, *others = (_text(part, width) for part in shown)
                blocks += [f"{one.title}{space}{first}", *others]
        return _encodable("\n\n".join(blocks), encoding) + "\n"


def known_or_empty(values: Iterable[float]) -> list[float | None]:
    """The values; None, an empty cell, for those that are unknown or infinite."""
    return [float(value) if isfinite(value) else None for value in values]


def interval(low: Iterable[float], high: Iterable[float], unit: str = "", kind: str = "3 digits") -> Column:
    """A column of intervals; one without ends, as of too few samples, has an empty cell."""
    ends = zip(low, high, strict=True)
    texts = [between(*pair, kind) if all(map(isfinite, pair)) else None for pair in ends]
    return Column("lies in", texts, unit, kind)


def warnings_by_title(found: Mapping[str, Iterable[str]]) -> list[str]:
    """The warnings of several runs or cases, each once with the titles that have it."""
    titles: dict[str, list[str]] = {}
    for title, warnings in found.items():
        for text in warnings:
            titles.setdefault(text, []).append(title)
    return [text if len(by) == len(found) > 1 else f"{joined(by)}: {text}" for text, by in titles.items()]


# ---- text


def _text(part: Part, width: int) -> str:
    if isinstance(part, Table):
        return "\n\n".join(_table_blocks(part, width))
    if isinstance(part, Definitions):
        return _prose(" ".join(part.texts), width)
    lines = part if isinstance(part, list) else [part or ""]
    return "\n".join(_prose(line, width) for line in lines if line)


def _prose(text: str, width: int) -> str:
    """A text in lines of at most `width` characters, and at most `MOST_PROSE`."""
    return "\n".join(_wrapped(text, min(width, MOST_PROSE)))


def _table_blocks(table: Table, width: int) -> Iterator[str]:
    """A table; if it is wider than `width`, in blocks that repeat the first column, with the names of the rows."""
    first, *cells = zip(*table.rows, strict=True)
    others = [_Fitted(*each, NARROWEST_TEXT) for each in zip(table.columns[1:], cells, strict=True)]
    beside = sum(fitted.width + GAP for fitted in others) + GAP
    fits = beside + NARROWEST_NAMES <= width  # in one block, with the names in several lines if need be
    names = _Fitted(table.columns[0], first, width - beside if fits else width // 2)
    block, used = [names], names.width + GAP
    for fitted in others:
        if used + GAP + fitted.width > width and len(block) > 1:
            yield _drawn(block, width - used)
            block, used = [names], names.width + GAP
        block.append(fitted)
        used += fitted.width + GAP
    yield _drawn(block, width - used)


def _encodable(text: str, encoding: str) -> str:
    """The text with control characters as escapes, and without characters that the encoding lacks."""
    text = visible(text)
    for character, plain in STAND_INS.items():
        if character.encode(encoding, errors="replace") == b"?":
            text = text.replace(character, plain)
    return text.encode(encoding, errors="replace").decode(encoding)


def _wrapped(text: str, width: int) -> list[str]:
    """Lines of a text; numbers with narrow spaces stay in one line."""
    return [part for line in text.split("\n") for part in wrap(line, width, break_on_hyphens=False)] or [""]


class _Fitted:
    """A column with its heading and cells as lines, and its width."""

    def __init__(self, column: Column, cells: Sequence[str], most: int) -> None:
        self.column = column
        natural = max((cell_len(line) for cell in cells for line in cell.split("\n")), default=0)
        words = [cell_len(word) for word in (*column.label.split(), column.unit)]
        label = cell_len(column.label)
        self.natural = max(natural, *words, min(label, NARROWEST_LABEL) if column.is_number else label)
        self.width = self.natural if column.is_number else max(min(self.natural, most), *words)
        self.cells = cells

    def heading(self, with_unit: bool) -> list[str]:
        """Lines of the label and below it the unit; names and texts have none, and stand on the lowest line."""
        label = _wrapped(self.column.label, self.width)
        return [*label, self.column.unit or " "] if with_unit and self.column.is_number else label

    @property
    def lines(self) -> list[list[str]]:
        """Lines of each cell."""
        return [_wrapped(cell, self.width) for cell in self.cells]


def _drawn(block: list[_Fitted], left: int) -> str:
    """A block of a table; columns of texts get the width that is left."""
    for fitted in block[1:]:
        more = max(min(fitted.natural - fitted.width, left), 0)
        fitted.width, left = fitted.width + more, left - more
    has_units = any(fitted.column.unit for fitted in block)
    headings = [fitted.heading(has_units) for fitted in block]
    rows = list(zip_longest(*(reversed(heading) for heading in headings), fillvalue=""))[::-1]
    height = len(rows)
    for cells in zip(*(fitted.lines for fitted in block), strict=True):
        rows += zip_longest(*cells, fillvalue="")
    columns = [_aligned(*each) for each in zip(zip(*rows, strict=True), block, strict=True)]
    lines = [(" " * GAP).join(row) for row in zip(*columns, strict=True)]
    lines.insert(height, "─" * cell_len(lines[0]))
    return "\n".join(f" {line}".rstrip() for line in lines).strip("\n")


def _aligned(texts: Sequence[str], fitted: _Fitted) -> list[str]:
    """The lines of a column in the width of the widest, numbers on the right."""
    width = max(map(cell_len, texts))
    justify = str.rjust if fitted.column.is_number else str.ljust
    return [justify(text, width - cell_len(text) + len(text)) for text in texts]
