"""Pictures as files."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.figure import SubFigure

from guideload.base.errors import PictureError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DOTS_PER_INCH = 130


def save(ax: Axes, path: str | Path) -> Path:
    """Save the figure of the axes, in the format of the path's ending; returns the path."""
    figure = ax.figure
    while isinstance(figure, SubFigure):
        figure = figure.figure
    with (
        warnings.catch_warnings()
    ):  # a character that the font lacks, as in a Chinese name, is drawn as a box
        warnings.filterwarnings("ignore", r"Glyph .* missing from font")
        figure.savefig(path, dpi=DOTS_PER_INCH)
    return Path(path)


def save_each(drawings: Mapping[str, Callable[[], Axes]], folder: Path) -> list[Path]:
    """Draw and save pictures by file name in `folder`; returns their paths.

    A picture that fails does not keep the others from being drawn: PictureError is raised at the end. What the disk
    refuses, an OSError, is raised at once.
    """
    paths, failed = [], {}
    for name, draw in drawings.items():
        try:
            paths.append(save(draw(), folder / name))
        except OSError:
            raise
        except Exception as error:  # of Matplotlib, which lists none
            (folder / name).unlink(missing_ok=True)
            failed[name] = error
    if failed:
        raise PictureError(failed)
    return paths
