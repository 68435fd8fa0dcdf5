"""The look of the pictures: colours, sizes, how numbers are written. No process-wide setting is touched."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any, NamedTuple

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure

if TYPE_CHECKING:
    from matplotlib.typing import RcKeyType

INK = "#222222"
GREY = "#8a8f98"
PALE = "#d5d8dd"

# Okabe and Ito (2008): told apart with every common colour blindness. Their yellow is too faint on white.
CARRIAGE_COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
CARRIAGE_DASHES: tuple[Any, ...] = ("-", (0, (6, 1.5)), (0, (2, 1.2)), (0, (6, 1.5, 1, 1.5)))

LOOK: dict[RcKeyType, Any] = {
    "axes.axisbelow": True,
    "axes.edgecolor": GREY,
    "axes.formatter.useoffset": False,
    "axes.grid": True,
    "axes.labelcolor": INK,
    "axes.labelsize": 9.5,
    "axes.linewidth": 0.8,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 10.5,
    "axes.titleweight": "bold",
    "axes.xmargin": 0.0,
    "axes.ymargin": 0.12,
    "figure.titlesize": 12,
    "figure.titleweight": "bold",
    "font.size": 9.5,
    "grid.color": "#e6e8eb",
    "grid.linewidth": 0.7,
    "legend.fontsize": 8.5,
    "legend.frameon": False,
    "lines.linewidth": 1.2,
    "text.color": INK,
    "xtick.color": GREY,
    "xtick.labelcolor": INK,
    "xtick.labelsize": 8.5,
    "ytick.color": GREY,
    "ytick.labelcolor": INK,
    "ytick.labelsize": 8.5,
}


class CarriageLook(NamedTuple):
    """How one carriage is drawn, the same in every picture."""

    color: str
    dash: Any


def look() -> AbstractContextManager[None]:
    """The settings of our own figures, restored on leaving."""
    return matplotlib.rc_context(LOOK)


def carriage_look(index: int) -> CarriageLook:
    """Colour and dash of the carriage with this index; 24 of them differ."""
    return CarriageLook(
        CARRIAGE_COLORS[index % len(CARRIAGE_COLORS)],
        CARRIAGE_DASHES[index // len(CARRIAGE_COLORS) % len(CARRIAGE_DASHES)],
    )


def new_figure(width: float, height: float) -> Figure:
    """A figure of this size in inches. It belongs to no window, so it needs no display and no closing."""
    return Figure(figsize=(width, height), layout="constrained")


def axes_or_new(ax: Axes | None, width: float, height: float) -> Axes:
    """The axes given, or those of a new figure of this size in inches."""
    return new_figure(width, height).add_subplot() if ax is None else ax
