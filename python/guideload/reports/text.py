"""Reports as text, for terminals and files."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from textwrap import wrap
from typing import Protocol

from rich.box import SIMPLE_HEAD
from rich.cells import cell_len
from rich.console import Console, JustifyMethod
from rich.table import Table as Grid
from rich.text import Text

from guideload.base.number_text import NARROW_SPACE
from guideload.base.visible_text import visible

WIDTH = 80
MOST_PROSE = 100  # characters: longer lines are hard to read
NARROWEST_LABEL = 9  # a label this short stays on one line
NARROWEST_NAMES = 16  # shorter names are not divided to spare a block
NARROWEST_TEXT = 24  # a text column this wide may stand beside others
GAP = 2  # characters between two columns
STAND_INS = {NARROW_SPACE: " ", "─": "-"}  # in encodings that lack the character


class Heading(Protocol):
    """What stands above a column of a table, and whether the column is one of numbers."""

    @property
    def label(self) -> str: ...
    @property
    def unit(self) -> str: ...
    @property
    def is_number(self) -> bool: ...


def prose(text: str, width: int) -> str:
    """A text in lines of at most `width` characters, and at most `MOST_PROSE`."""
    return "\n".join(_wrapped(text, min(width, MOST_PROSE)))


def table_blocks(headings: Sequence[Heading], rows: Sequence[Sequence[str]], width: int) -> Iterator[str]:
    """A table; if it is wider than `width`, in blocks that repeat the first column, with the names of the rows."""
    cells = list(zip(*rows, strict=True))
    others = [
        _Fitted(heading, texts, NARROWEST_TEXT)
        for heading, texts in zip(headings[1:], cells[1:], strict=True)
    ]
    beside = sum(fitted.width + GAP for fitted in others) + GAP
    fits = beside + NARROWEST_NAMES <= width  # in one block, with the names in several lines if need be
    names = _Fitted(headings[0], cells[0], width - beside if fits else width // 2)
    block, used = [names], names.width + GAP
    for fitted in others:
        if used + GAP + fitted.width > width and len(block) > 1:
            yield _drawn(block, width - used)
            block, used = [names], names.width + GAP
        block.append(fitted)
        used += fitted.width + GAP
    yield _drawn(block, width - used)


def encodable(text: str, encoding: str) -> str:
    """The text with control characters as escapes, and without characters that the encoding lacks."""
    text = visible(text)
    for character, plain in STAND_INS.items():
        if character.encode(encoding, errors="replace") == b"?":
            text = text.replace(character, plain)
    return text.encode(encoding, errors="replace").decode(encoding)


def _wrapped(text: str, width: int) -> list[str]:
    """Lines of a text; unlike rich it keeps numbers with narrow spaces in one line."""
    return [part for line in text.split("\n") for part in wrap(line, width, break_on_hyphens=False)] or [""]


class _Fitted:
    """A column with its heading and cells as lines, and its width."""

    def __init__(self, column: Heading, cells: Sequence[str], most: int) -> None:
        self.column = column
        natural = max((cell_len(line) for cell in cells for line in cell.split("\n")), default=0)
        words = [cell_len(word) for word in (*column.label.split(), column.unit)]
        label = cell_len(column.label)
        self.natural = max(natural, *words, min(label, NARROWEST_LABEL) if column.is_number else label)
        self.width = self.natural if column.is_number else max(min(self.natural, most), *words)
        self.cells = cells

    def heading(self, with_unit: bool) -> str:
        """The label and below it the unit; names and texts have none, and stand on the lowest line."""
        label = _wrapped(self.column.label, self.width)
        return "\n".join([*label, self.column.unit or " "] if with_unit and self.column.is_number else label)

    @property
    def lines(self) -> list[str]:
        return ["\n".join(_wrapped(cell, self.width)) for cell in self.cells]


def _drawn(block: list[_Fitted], left: int) -> str:
    """A block of a table, drawn by rich; columns of texts get the width that is left."""
    for fitted in block[1:]:
        more = max(min(fitted.natural - fitted.width, left), 0)
        fitted.width, left = fitted.width + more, left - more
    grid = Grid(box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    has_units = any(fitted.column.unit for fitted in block)
    for fitted in block:
        justify: JustifyMethod = "right" if fitted.column.is_number else "left"
        grid.add_column(Text(fitted.heading(has_units)), justify=justify, no_wrap=True)
    for row in zip(*(fitted.lines for fitted in block), strict=True):
        grid.add_row(*map(Text, row))
    drawn = io.StringIO()
    Console(file=drawn, width=sum(one.width + GAP for one in block) + GAP, color_system=None).print(grid)
    return "\n".join(line.rstrip() for line in drawn.getvalue().splitlines()).strip("\n")
