"""Pictures as files."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from guideload.base.arguments import checked
from guideload.base.atomic import require_no_null
from guideload.base.errors import ArgumentError, PictureError, WriteError, shown

DOTS_PER_INCH = 130
QUICK = {"compress_level": 1}  # of PNG: two thirds of the time for a sixth more bytes


@checked
def save(ax: Axes, path: str | Path) -> Path:
    """Save the figure of the axes, in the format of the path's ending; returns the path.

    Raises ArgumentError for another ending, WriteError if the file cannot be written.
    """
    known = figure_of(ax).canvas.get_supported_filetypes()
    if Path(path).suffix.removeprefix(".").lower() not in known:
        raise ArgumentError(
            f"path: expected a name that ends in .{', .'.join(known)}, got {shown(Path(path).name)}"
        )
    require_no_null(Path(path))
    with quiet_glyphs(), laid_out(figure_of(ax), DOTS_PER_INCH) as figure:
        quick: dict[str, Any] = {"pil_kwargs": QUICK} if Path(path).suffix == ".png" else {}
        try:
            figure.savefig(path, dpi=DOTS_PER_INCH, **quick)
        except OSError as error:
            raise WriteError(error.errno, error.strerror, str(path)) from error
    return Path(path)


@contextmanager
def laid_out(figure: Figure, dpi: float) -> Iterator[Figure]:
    """The figure with its parts in place: saving it then draws it once, not a first time to find their places."""
    engine, before = figure.get_layout_engine(), figure.dpi
    figure.dpi = dpi
    if engine is not None:
        engine.execute(figure)
    figure.set_layout_engine(None)
    try:
        yield figure
    finally:
        figure.dpi = before
        figure.set_layout_engine(engine)


@contextmanager
def quiet_glyphs() -> Iterator[None]:
    """No warning of a character that the font lacks, as in a Chinese name; it is drawn as a box."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", r"Glyph .* missing from font")
        yield


def figure_of(ax: Axes) -> Figure:
    """The whole figure of the axes, also of axes in a part of a figure."""
    figure = ax.figure
    while isinstance(figure, SubFigure):
        figure = figure.figure
    return figure


def save_each(drawings: Mapping[str, Callable[[], Axes]], folder: str | Path) -> list[Path]:
    """Draw and save pictures by file name in `folder`, which is made if missing; returns their paths.

    A picture that fails does not keep the others from being drawn: PictureError is raised at the end. What the disk
    refuses, an OSError, is raised at once.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
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
