"""The HTML document: elements of reports as HTML, charts of histories, pictures."""

from __future__ import annotations

import base64
import io
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from itertools import zip_longest
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from guideload.base.arrays import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Longer histories are drawn as an envelope: on paper and on a screen there are at most some thousand pixels.
MOST_POINTS = 12_000
LARGEST_SVG = 200_000  # characters; a picture as PNG takes up to about as much


@dataclass(frozen=True)
class Line:
    """A line of a chart: its name, its values at the instants of the chart, its colour, and whether it is dashed."""

    name: str
    values: Array
    color: str
    dashed: bool = False


def document(title: str, body: Iterable[str]) -> str:
    """A whole HTML file. Its style and script are in it; its policy forbids every request to a network."""
    here = files(__package__)
    style, script = ((here / name).read_text(encoding="utf-8") for name in ("page.css", "page.js"))
    policy = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:"
    return "\n".join(
        [
            '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f'<meta http-equiv="Content-Security-Policy" content="{policy}">',
            f"<title>{escape(title)}</title>\n<style>\n{style}</style>\n</head>\n<body>",
            *body,
            "<noscript><p>The charts need JavaScript.</p></noscript>",
            f"<script>\n{script}</script>\n</body>\n</html>\n",
        ]
    )


def section(title: str, *content: str, long: bool = False) -> str:
    """A section with a heading. long: whether it may be divided between two printed pages."""
    kind = ' class="long"' if long else ""
    return "\n".join([f"<section{kind}>\n<h2>{escape(title)}</h2>", *content, "</section>"])


def folded(title: str, *content: str) -> str:
    """Content that is shown at a click, and printed."""
    return "\n".join([f"<details>\n<summary>{escape(title)}</summary>", *content, "</details>"])


def html_of(parts: Iterable[RenderableType]) -> str:
    """The elements of a text report as HTML: paragraphs, tables, and bold text as headings."""
    return "\n".join(filter(None, map(_element, parts)))


def _element(part: RenderableType) -> str:
    if isinstance(part, Padding):
        return _element(part.renderable)
    if isinstance(part, Table):
        return _table(part)
    if isinstance(part, Text) and part.style == "bold":
        return f"<h3>{escape(part.plain)}</h3>"
    text = part.plain if isinstance(part, Text) else str(part)
    return f"<p>{escape(text)}</p>" if text.strip() else ""


def _table(table: Table) -> str:
    def row(kind: str, cells: Iterable[Any]) -> str:
        filled = (
            f'<{kind} class="{"number" if column.justify == "right" else "text"}">{escape(str(cell).strip())}</{kind}>'
            for column, cell in zip(table.columns, cells, strict=True)
        )
        return f"<tr>{''.join(filled)}</tr>"

    if not table.row_count:
        return ""
    head = row("th", (column.header for column in table.columns))
    rows = (
        row("td", cells) for cells in zip_longest(*(column.cells for column in table.columns), fillvalue="")
    )
    return f'<div class="wide"><table>\n<thead>{head}</thead>\n<tbody>{"".join(rows)}</tbody>\n</table></div>'


def chart(title: str, unit: str, time: Array, lines: Sequence[Line], group: str = "") -> str:
    """A chart of histories over time [s], which the script of the page draws. Charts of one group zoom together."""
    if time.size > MOST_POINTS:
        time, lines = _envelope(time, lines)
    data = {
        "title": title,
        "unit": unit,
        "time": _packed(time, "<f8"),
        "lines": [
            {
                "name": line.name,
                "values": _packed(line.values, "<f4"),
                "color": line.color,
                "dashed": line.dashed,
            }
            for line in lines
        ],
    }
    text = json.dumps(data).replace("<", "\\u003c")  # nothing in a name may end the script element
    return (
        f'<figure><h3>{escape(title)}</h3>\n<div class="chart" data-group="{escape(group)}">'
        f'<script type="application/json">{text}</script></div></figure>'
    )


def _packed(values: Array, kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")


def _envelope(time: Array, lines: Sequence[Line]) -> tuple[Array, list[Line]]:
    """Smallest and largest value of every line in groups of neighbouring samples, at the first and last instant."""
    starts = np.linspace(0, time.size, MOST_POINTS // 2, endpoint=False).astype(np.intp)
    ends = np.append(starts[1:], time.size) - 1
    instants = np.column_stack([time[starts], time[ends]]).ravel()
    thinned = []
    for line in lines:
        low, high = np.minimum.reduceat(line.values, starts), np.maximum.reduceat(line.values, starts)
        rising = (line.values[ends] >= line.values[starts])[:, None]
        pair = np.where(rising, np.column_stack([low, high]), np.column_stack([high, low]))
        thinned.append(Line(line.name, pair.ravel(), line.color, line.dashed))
    return instants, thinned


def picture(ax: Axes, caption: str) -> str:
    """A picture in the document, with its caption: SVG, or PNG where it has so many elements that this is smaller."""
    from matplotlib import rc_context

    from guideload.plots.saving import DOTS_PER_INCH, figure_of, quiet_glyphs

    buffer, figure = io.StringIO(), figure_of(ax)
    # Letters as outlines: the reader's computer may lack the font. A fixed salt gives the same file for the same input.
    with rc_context({"svg.fonttype": "path", "svg.hashsalt": caption}), quiet_glyphs():
        figure.savefig(buffer, format="svg", metadata={"Date": None})
        drawing = buffer.getvalue()
        drawing = drawing[drawing.index("<svg") :]
        if len(drawing) > LARGEST_SVG:
            pixels = io.BytesIO()
            figure.savefig(pixels, format="png", dpi=DOTS_PER_INCH)
            data = base64.b64encode(pixels.getvalue()).decode("ascii")
            drawing = f'<img alt="{escape(caption)}" src="data:image/png;base64,{data}">'
    return f"<figure>\n{drawing}<figcaption>{escape(caption)}</figcaption>\n</figure>"
