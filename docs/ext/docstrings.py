"""Docstrings in plain text, with tables of arguments, as reStructuredText for autodoc and sphinx-click."""

from __future__ import annotations

import re
from typing import Any

NAMES = r"[\w.]+(?:, [\w.]+)*"
ARGUMENT = re.compile(rf"({NAMES})(?:: |\s{{2,}})(\S.*)")  # "rtol    error of ..." or "rtol: error of ..."


def rst(text: str) -> str:
    """Plain text with `names` in backquotes as reStructuredText; arguments become a definition list."""
    blocks = [paragraph(block) for block in re.split(r"\n\s*\n", text.strip("\n")) if block.strip()]
    return "\n\n".join(blocks)


def paragraph(block: str) -> str:
    lines = block.split("\n")
    if all(line.startswith("    ") for line in lines):  # a block of code
        return "::\n\n" + "\n".join(lines)
    entries: list[tuple[str, str]] = []  # name or "", text
    column = next((found.start(2) for line in lines if (found := ARGUMENT.fullmatch(line))), 0)
    for line in lines:
        argument = ARGUMENT.fullmatch(line) or in_column(line, column)
        if argument:
            entries.append((argument[1], argument[2]))
        elif entries and (line.startswith(" ") or not entries[-1][1].endswith(".") or not entries[-1][0]):
            name, before = entries.pop()
            entries.append((name, f"{before} {line.strip()}"))
        else:
            entries.append(("", line.strip()))
    shown = [f"``{name}``\n    {escaped(text)}" if name else escaped(text) for name, text in entries]
    return "\n\n".join(shown)


def in_column(line: str, column: int) -> re.Match[str] | None:
    """A name that fills its column up to one blank, where others have more."""
    found = re.fullmatch(rf"({NAMES}) (\S.*)", line)
    return found if found and found.start(2) == column else None


def escaped(text: str) -> str:
    """Literal text, but for what stands in backquotes."""
    parts = re.split(r"`+([^`]+)`+", text)
    parts[::2] = [re.sub(r"([*_|\\])", r"\\\1", part) for part in parts[::2]]
    parts[1::2] = [f"``{part}``" for part in parts[1::2]]
    return "".join(_apart(parts))


def _apart(parts: list[str]) -> list[str]:
    """A literal must not touch a letter that follows it."""
    for i in range(2, len(parts), 2):
        if re.match(r"\w", parts[i]):
            parts[i] = "\\ " + parts[i]
    for i in range(0, len(parts) - 1, 2):
        if re.search(r"[\w/]$", parts[i]):
            parts[i] += "\\ "
    return parts


def autodoc(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    lines[:] = rst("\n".join(lines)).split("\n")


def click(app: Any, ctx: Any, lines: list[str]) -> None:
    lines[:] = [escaped(line) for line in lines]


def defaults(app: Any, ctx: Any, lines: list[str]) -> None:
    lines[:] = [re.sub(r"\w*Path\('(.*?)'\)", r"\1", line) for line in lines]


def setup(app: Any) -> dict[str, bool]:
    app.connect("autodoc-process-docstring", autodoc)
    app.connect("sphinx-click-process-description", click)
    app.connect("sphinx-click-process-options", defaults)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
