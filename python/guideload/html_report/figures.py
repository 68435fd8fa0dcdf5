"""Figures of HTML reports: charts of histories that can be zoomed, pictures, listings."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from markupsafe import Markup, escape
from matplotlib.axes import Axes

from guideload.base.arrays import Array
from guideload.base.finite import finite_json
from guideload.plots.long_records import extremes

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


@dataclass(frozen=True)
class Chart:
    """A chart that the script of the page draws; data: its lines as JSON. Charts of one group zoom together."""

    title: str
    data: Markup
    group: str


@dataclass(frozen=True)
class Picture:
    """A picture with its caption."""

    drawing: Markup
    caption: str


@dataclass(frozen=True)
class Listing:
    """Text that is shown as it is, at a click."""

    title: str
    text: str


Figure = Chart | Picture | Listing
SVG_DPI = 72.0  # of Matplotlib's SVG, in which a unit is a point


def chart(title: str, unit: str, time: Array, lines: Sequence[Line], group: str = "") -> Chart:
    """A chart of histories over time [s]. Charts of one group zoom together."""
    if time.size > MOST_POINTS:
        time, lines = _thinned(time, lines)
    drawn = [
        {"name": line.name, "values": _packed(line.values, "<f4"), "color": line.color, "dashed": line.dashed}
        for line in lines
    ]
    data = {"title": title, "unit": unit, "time": _packed(time, "<f8"), "lines": drawn}
    text = finite_json(data).replace("<", "\\u003c")  # nothing in a name may end the script element
    return Chart(title, Markup(text), group)


def _packed(values: Array, kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")


def _thinned(time: Array, lines: Sequence[Line]) -> tuple[Array, list[Line]]:
    """Smallest and largest value of every line in groups of samples, at the first and last instant of the group."""
    starts = np.linspace(0, time.size, MOST_POINTS // 2, endpoint=False).astype(np.intp)
    ends = np.append(starts[1:], time.size) - 1
    pairs = (np.sort(np.column_stack(extremes(line.values, starts))).ravel() for line in lines)
    thinned = [replace(line, values=line.values[pair]) for line, pair in zip(lines, pairs, strict=True)]
    return time[np.column_stack([starts, ends]).ravel()], thinned


def picture(ax: Axes, caption: str) -> Picture:
    """A picture in the document, with its caption: SVG, or PNG where it has so many elements that this is smaller."""
    from matplotlib import rc_context

    from guideload.plots.saving import DOTS_PER_INCH, figure_of, laid_out, quiet_glyphs

    buffer = io.StringIO()
    # Letters as outlines: the reader's computer may lack the font. A fixed salt gives the same file for the same input.
    with (
        rc_context({"svg.fonttype": "path", "svg.hashsalt": caption}),
        quiet_glyphs(),
        laid_out(figure_of(ax), SVG_DPI) as figure,
    ):
        figure.savefig(buffer, format="svg", metadata={"Date": None})
        drawing = buffer.getvalue()
        drawing = drawing[drawing.index("<svg") :]
        if len(drawing) > LARGEST_SVG:
            pixels = io.BytesIO()
            figure.savefig(pixels, format="png", dpi=DOTS_PER_INCH)
            data = base64.b64encode(pixels.getvalue()).decode("ascii")
            drawing = f'<img alt="{escape(caption)}" src="data:image/png;base64,{data}">'
    return Picture(Markup(drawing), caption)
