"""Placement of names and small figures beside the points of a picture, so that none covers another."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import SubFigure
from matplotlib.patheffects import withStroke
from matplotlib.transforms import Bbox

from guideload.plots.style import INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Annotation
    from matplotlib.transforms import BboxBase
    from numpy.typing import NDArray

Point = tuple[float, float]
# Offsets of a text from its point [points]; the first place that is free is taken.
BESIDE: tuple[Point, ...] = ((0, 6), (0, -6), (6, 3), (6, -3), (-6, 3), (-6, -3))
AT_THE_END: tuple[Point, ...] = (
    *((x, y) for x in (9, -9) for y in (0, 9, -9)),
    *((0, 8), (0, -8)),
    *((x, y) for x in (9, -9) for y in (17, -17, 25, -25)),
)
FROM_AFAR: tuple[Point, ...] = ((-34, -20), (-34, 20), (0, -26), (0, 26), (34, 20), (34, -20))
TO_THE_SIDE = 9  # offset along x from which on the middle of the text's height is at the offset
OVER_TEXT, OUTSIDE = (
    100,
    10_000,
)  # cost of covering a text and of leaving the axes; that of a square of a line is 1
MARKER = 4.0  # half the side of the square around a marker, in points


class Labels:
    """Places texts beside points of `ax`, whose lines must be drawn and limits set: the texts avoid lines and texts."""

    def __init__(self, ax: Axes) -> None:
        figure = ax.figure
        while isinstance(figure, SubFigure):
            figure = figure.figure
        figure.draw_without_rendering()  # lays out the axes
        self._ax = ax
        self._side = MARKER * figure.dpi / 72.0  # pixels
        self._texts: list[BboxBase] = [text.get_window_extent() for text in ax.texts]
        if (legend := ax.get_legend()) is not None:
            self._texts.append(legend.get_window_extent())
        self._lines: list[Bbox] = []
        for line in ax.lines:
            self._add_line(line.get_transform().transform(np.column_stack(line.get_data())))

    def _add_line(self, points: NDArray[np.float64]) -> None:
        """Cover a line through points [pixels] by squares of the size of a marker."""
        side = self._side
        for x, y in _along(points, side):
            self._lines.append(Bbox.from_extents(x - side, y - side, x + side, y + side))

    def add(
        self,
        text: str,
        points: Sequence[Point],
        places: Sequence[Point],
        *,
        optional: bool = False,
        arrow: bool = False,
        **style: Any,
    ) -> None:
        """Add a text in the first free place beside `points`; else in the best one, or nowhere if it is optional."""
        best: tuple[int, Point, Point] | None = None
        for point, place in product(points, places):
            label, box = self._write(text, point, place, style)
            label.remove()
            cost = self._cost(box)
            if best is None or cost < best[0]:
                best = cost, point, place
            if cost == 0:
                break
        if best is None or (best[0] > 0 and optional):
            return
        _, point, place = best
        _, box = self._write(text, point, place, style)
        self._texts.append(box)
        if arrow:
            tip, tail = self._ax.transData.transform(point), box.get_points().mean(axis=0)
            self._add_line(np.array([tip, tail]))
            line = {"arrowstyle": "-|>", "color": INK, "linewidth": 0.8, "shrinkB": 6, "shrinkA": 3}
            self._ax.annotate("", point, place, textcoords="offset points", arrowprops=line)

    def _write(self, text: str, point: Point, place: Point, style: Any) -> tuple[Annotation, BboxBase]:
        """A text in a place, and its box in pixels."""
        x, y = place
        across = "left" if x > 0 else "right" if x < 0 else "center"
        up = "center" if abs(x) >= TO_THE_SIDE else "bottom" if y > 0 else "top"
        halo = [withStroke(linewidth=2.0, foreground="white")]
        options = {"textcoords": "offset points", "color": INK, "path_effects": halo, **style}
        label = self._ax.annotate(text, point, place, ha=across, va=up, **options)
        label.set_in_layout(False)
        return label, label.get_window_extent()

    def _cost(self, box: BboxBase) -> int:
        """How bad it is to write there; 0 where it is free."""
        frame = self._ax.bbox.padded(1.0)
        inside = frame.contains(box.x0, box.y0) and frame.contains(box.x1, box.y1)
        covered = box.count_overlaps(self._lines) + OVER_TEXT * box.count_overlaps(self._texts)
        return int(covered if inside else OUTSIDE + covered)


def _along(points: NDArray[np.float64], spacing: float) -> NDArray[np.float64]:
    """Points on the line through `points`, at most `spacing` apart."""
    pieces = [points[:1]]
    for start, end in zip(points[:-1], points[1:], strict=True):
        count = max(int(np.ceil(np.hypot(*(end - start)) / spacing)), 1)
        pieces.append(start + (end - start) * np.linspace(0.0, 1.0, count + 1)[1:, None])
    return np.concatenate(pieces)
