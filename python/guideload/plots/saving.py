"""Pictures as files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.figure import SubFigure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DOTS_PER_INCH = 130


def save(ax: Axes, path: str | Path) -> Path:
    """Save the figure of the axes, in the format of the path's ending; returns the path."""
    figure = ax.figure
    while isinstance(figure, SubFigure):
        figure = figure.figure
    figure.savefig(path, dpi=DOTS_PER_INCH)
    return Path(path)
