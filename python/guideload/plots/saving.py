"""Pictures as files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.figure import Figure, SubFigure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DOTS_PER_INCH = 130


def save(ax: Axes, path: str | Path) -> Path:
    """Save the figure of the axes, in the format of the path's ending; returns the path."""
    figure_of(ax).savefig(path, dpi=DOTS_PER_INCH)
    return Path(path)


def figure_of(ax: Axes) -> Figure:
    """The whole figure of the axes, also of axes in a part of a figure."""
    figure = ax.figure
    while isinstance(figure, SubFigure):
        figure = figure.figure
    return figure
