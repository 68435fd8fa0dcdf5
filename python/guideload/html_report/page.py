"""A text report as an HTML page, with charts and pictures."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from importlib.metadata import version
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import RenderableType
from rich.text import Text

from guideload.base.atomic import atomic_write
from guideload.html_report.document import document, html_of, picture, section

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def page_of(
    title: str,
    parts: Iterable[RenderableType],
    pictures: Iterable[tuple[Axes, str]] = (),
    charts: Iterable[str] = (),
) -> str:
    """An HTML page of the elements of a text report: what stands before its first title is its answer.

    pictures: axes with their captions. charts: from `document.chart`.
    """
    groups: list[tuple[str, list[RenderableType]]] = [("", [])]
    for part in parts:
        if isinstance(part, Text) and part.style == "bold":
            groups.append((part.plain, []))
        else:
            groups[-1][1].append(part)
    body = [f"<header><h1>{escape(title)}</h1></header>"]
    (_, answer), *rest = groups
    if found := html_of(answer):
        body.append(f'<div class="answer">{found}</div>')
    drawings = [*charts, *(picture(ax, caption) for ax, caption in pictures)]
    body += [section(name, html_of(group), long=True) for name, group in rest]
    if drawings:
        body.append(section("Pictures", *drawings, long=True))
    body.append(footer())
    return document(title, body)


def footer() -> str:
    """The last line of every page."""
    return f"<footer><p>Written by guideload {version('guideload')}.</p></footer>"


def save_page(text: str, path: str | PathLike[str]) -> Path:
    """Write a page, whole or not at all; returns its path. Raises OSError if it cannot be written."""
    with atomic_write(Path(path)) as draft:
        draft.write_text(text, encoding="utf-8")
    return Path(path)
