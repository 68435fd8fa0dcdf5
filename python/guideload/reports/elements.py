"""Elements of reports (headings, tables, remarks), and their conversion to text."""

from __future__ import annotations

import io
import re
from collections.abc import Iterable
from typing import TYPE_CHECKING

from rich.box import SIMPLE_HEAD
from rich.console import Console, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from guideload.base.visible_text import visible
from guideload.machine.machine import DOFS

if TYPE_CHECKING:
    from guideload.machine.machine import Machine

WIDTH = 80


def heading(machine: Machine) -> list[RenderableType]:
    """Name, free dofs and held dofs of a machine."""
    return [machine.name, dofs_line(machine)]


def dofs_line(machine: Machine) -> str:
    """The free and the held dofs of a machine."""
    held = [dof for dof in DOFS if dof not in machine.free]
    return f"free {', '.join(machine.free)}; held {', '.join(held) or 'none'}"


def section(title: str) -> list[RenderableType]:
    """A title below an empty line."""
    return ["", Text(title, style="bold")]


def new_table(first: str, *numbers: str, texts: tuple[str, ...] = ()) -> Table:
    """An empty table with headings: a column of names, columns of numbers, columns of text."""
    table = Table(box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column(first, overflow="fold")
    for title in numbers:
        table.add_column(title, justify="right", no_wrap=True)
    for title in texts:
        table.add_column(title, overflow="fold")
    return table


def remark(*lines: str) -> list[RenderableType]:
    """Paragraphs, each followed by an empty line."""
    return [Padding(line, (0, 0, 1, 0)) for line in lines]


def to_text(parts: Iterable[RenderableType], width: int = WIDTH, encoding: str = "utf-8") -> str:
    """Text of the parts as printed by rich, without colours; characters outside the encoding are replaced.

    Control characters, as in the names of a trace's columns, are shown as escapes.
    """
    buffer = io.BytesIO()
    file = io.TextIOWrapper(buffer, encoding=encoding, errors="replace", newline="\n")
    console = Console(file=file, width=width, highlight=False, markup=False, emoji=False, color_system=None)
    for part in parts:
        console.print(part)
    file.flush()
    lines = [line.rstrip() for line in visible(buffer.getvalue().decode(encoding)).splitlines()]
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines).strip("\n")) + "\n"
