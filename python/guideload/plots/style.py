"""Style of the pictures: colours, sizes, titles and legends. Matplotlib's global settings are not changed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from guideload.base.number_text import counted

if TYPE_CHECKING:
    from guideload.base.arrays import Array
    from guideload.simulation.result import Result

LOOK = matplotlib.rc_params_from_file(Path(__file__).with_name("look.mplstyle"), use_default_template=False)
INK: str = LOOK["text.color"]
GREY: str = LOOK["axes.edgecolor"]
PALE = "#d5d8dd"

# Okabe and Ito (2008): distinct with every common colour blindness. Their yellow is too faint on white.
CARRIAGE_COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
DASHED: Any = (0, (5, 4))
CARRIAGE_DASHES: tuple[Any, ...] = ("-", (0, (6, 1.5)), (0, (2, 1.2)), (0, (6, 1.5, 1, 1.5)))


class CarriageLook(NamedTuple):
    """Colour and dashes of the lines of a carriage, the same in every picture."""

    color: str
    dash: Any


def look() -> AbstractContextManager[None]:
    """Context with the settings of these pictures; at its end Matplotlib's settings are restored."""
    return matplotlib.rc_context(LOOK)


def carriage_look(index: int) -> CarriageLook:
    """Colour and dash of the carriage with this index; the first 24 are different."""
    return CarriageLook(
        CARRIAGE_COLORS[index % len(CARRIAGE_COLORS)],
        CARRIAGE_DASHES[index // len(CARRIAGE_COLORS) % len(CARRIAGE_DASHES)],
    )


def new_figure(width: float, height: float) -> Figure:
    """A figure of this size in inches, without a window: it needs no display and need not be closed."""
    return Figure(figsize=(width, height), layout="constrained")


@contextmanager
def drawing(ax: Axes | None, width: float, height: float) -> Iterator[Axes]:
    """Context with the settings of these pictures: `ax`, or the axes of a new figure of this size in inches."""
    with look():
        yield new_figure(width, height).add_subplot() if ax is None else ax


def plain(name: str) -> str:
    """A name for a text or label that may hold mathematics: its dollar signs are no mathematics.

    A space of no width before an underscore, because legends leave out labels that begin with one.
    """
    text = name.replace("$", r"\$")
    return f"\u200b{text}" if text.startswith("_") else text


def run_title(result: Result) -> str:
    """Machine, free degrees of freedom, and the number of warnings of the audit."""
    warnings = len(result.audit.warnings)
    audit = f"; audit: {counted(warnings, 'warning')}, see the report" if warnings else ""
    return f"{result.machine.name}: free {', '.join(result.machine.free)}{audit}"


def set_run_title(ax: Axes, result: Result, title: str) -> None:
    """Set the title, with `run_title` as its second line."""
    ax.set_title(f"{title}\n{run_title(result)}", parse_math=False)  # a name may hold dollar signs


def legend_beside(ax: Axes, title: str | None = None) -> None:
    """Draw the legend to the right of the axes."""
    ax.legend(title=title, loc="center left", bbox_to_anchor=(1.0, 0.5), alignment="left")


def legend_above(ax: Axes, columns: int, **spacing: Any) -> None:
    """Draw the legend in `columns` columns above the axes, on the right."""
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.2, ncols=columns, **spacing)


def name_rows(ax: Axes, names: Iterable[str]) -> None:
    """Names beside the rows of a picture, the first on top."""
    texts = [plain(name) for name in names]
    ax.set_yticks(range(len(texts)), texts)
    ax.set_ylim(len(texts) - 0.4, -0.6)
    ax.yaxis.grid(False)
    ax.tick_params(axis="y", length=0)


def draw_effects(ax: Axes, effects: Array) -> None:
    """Bars to either side of zero, a row for each effect."""
    colors = np.where(effects >= 0, *CARRIAGE_COLORS[:2])
    ax.barh(range(effects.size), effects, 0.68, color=colors.tolist())
    ax.axvline(0, color=GREY, linewidth=0.8)


def write_instead(ax: Axes, reason: str) -> Axes:
    """Write into axes why they are empty."""
    ax.text(0.5, 0.5, reason, transform=ax.transAxes, ha="center", color=GREY)
    return ax
