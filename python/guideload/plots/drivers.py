"""Pictures of the influence of parameters on a quantity of a study: tornado diagram and scatter plots."""

from __future__ import annotations

from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from guideload.base.arguments import checked
from guideload.base.arrays import Array
from guideload.base.number_text import capitalised, counted
from guideload.plots.style import (
    GREY,
    INK,
    draw_effects,
    drawing,
    legend_beside,
    look,
    name_rows,
    new_figure,
    plain,
    write_instead,
)
from guideload.study.result import StudyResult, weaker_parameters
from guideload.study.statistics import TOO_FEW, known

BARS = 16  # parameters in a tornado diagram
PANELS = 6  # parameters in a scatter plot
POINTS = 3000  # in a scatter plot: the first samples
TREND = 120  # least number of samples for a median line in a scatter plot
NAME = 26  # characters of a name beside an axis
STEPS = (1, 2, 2.5, 5, 10)  # between ticks, times powers of ten

write_no_result = partial(write_instead, reason="no sample has a result")


@checked
def tornado(result: StudyResult, name: str | None = None, ax: Axes | None = None) -> Axes:
    """Tornado diagram: influence of each parameter on a quantity or column, strongest first, with 95 % intervals.

    The bars are total Sobol indices, with the first-order index in a darker colour, if the design gives them; else rank
    correlations.
    """
    name = name or result.leading
    rows, values = result.driving(name), known(result.column(name))
    shown, sensitivity = rows.iloc[:BARS], result.metadata.sensitivity
    main, *ends = ("total", "total_low", "total_high") if sensitivity else ("rank_correlation", "low", "high")
    with drawing(ax, 7.6, 1.7 + 0.27 * len(shown)) as ax:
        set_title(ax, result, f"What drives {result.metadata.title_with_owner(name)}", values.size)
        if not values.size:
            return write_no_result(ax)
        strength, low, high = (shown[key].to_numpy(dtype=np.float64) for key in (main, *ends))
        if result.too_few or not np.isfinite(strength).any():
            return write_instead(ax, TOO_FEW if result.too_few else "nothing varies")
        places, folded = np.arange(len(shown)), shown.get("to_both_sides", [False] * len(shown))
        if sensitivity:
            first = np.clip(shown["first_order"].to_numpy(dtype=np.float64), 0, None)
            ax.barh(places, strength, 0.68, color="#9ecae6", label="total")
            ax.barh(places, first, 0.34, color="#0072B2", label="first order, alone")
            ax.set_xlim(0, max(1.0, 1.04 * float(np.nanmax(high))))
            ax.set_xlabel("Sobol index: share of the variance")
            legend_beside(ax)
        else:
            draw_effects(ax, strength)
            reach = min(1.0, 1.15 * float(np.nanmax(np.abs([low, high]))))
            ax.set_xlim(-reach, reach)
            words = "rank correlation; negative: falls as the parameter grows"
            ax.set_xlabel(
                f"{words}\n±: with the distance of the parameter from its median" if any(folded) else words
            )
        errors = np.clip([strength - low, high - strength], 0, None)
        ax.errorbar(
            strength, places, xerr=errors, fmt="none", ecolor=INK, elinewidth=0.9, capsize=2, zorder=4
        )
        name_rows(
            ax, (f"{'± ' * both}{short(str(one))}" for one, both in zip(shown.index, folded, strict=True))
        )
        for text in weaker_parameters(rows, BARS):
            ax.annotate(text, (1, 1), (0, 3), "axes fraction", "offset points", ha="right", color=GREY)
    return ax


@checked
def scatter(result: StudyResult, name: str | None = None, axes: list[Axes] | None = None) -> list[Axes]:
    """A quantity over each of its strongest parameters, with the median along it; not over a drawn motion.

    axes: one per parameter; None for new axes, at most PANELS. At most the first POINTS samples are drawn.
    """
    name = name or result.leading
    units = {one.name: one.unit for one in result.metadata.parameters if not one.is_draw}
    drivers = [str(one) for one in result.driving(name).index if one in units]
    names = drivers[: PANELS if axes is None else len(axes)]
    with look():
        if axes is None:
            across = min(len(names), 3)
            down = -(-len(names) // across)
            figure = new_figure(max(3.4 * across, 5.0), 0.8 + 2.6 * down)
            axes = [figure.add_subplot(down, across, i + 1) for i in range(len(names))]
            words = result.metadata.title_with_owner(name)
            title = capitalised(words) if result.metadata.chosen else f"What drives {words}"
            figure.suptitle(f"{title}: {result.metadata.machine.name}", parse_math=False)
        values = result.column(name)[:POINTS]
        for i, (ax, one) in enumerate(zip(axes, names, strict=False)):
            column = result.column(one)[:POINTS]
            there = ~(np.isnan(column) | np.isnan(values))
            if not there.any():
                write_no_result(ax)
            size, alpha = (14.0, 0.7) if there.sum() <= 300 else (5.0, 0.3)
            x, y = column[there], values[there]
            ax.scatter(x, y, size, color="#0072B2", alpha=alpha, linewidth=0, rasterized=True)
            _trend(ax, x, y)
            unit = "of its value" if units[one] == "1" else units[one]
            ax.set_xlabel(f"{short(one)} [{unit}]", parse_math=False)
            ax.set_ylabel(plain(result.metadata.title_with_unit(name)) if i % 3 == 0 else "")
            ax.xaxis.set_major_locator(MaxNLocator(5, steps=STEPS))
            ax.margins(x=0.04)
    return axes


def _trend(ax: Axes, x: Array, y: Array) -> None:
    """A line through the medians of twelve groups of equal size along x."""
    if x.size < TREND:
        return
    groups = np.array_split(np.argsort(x, kind="stable"), 12)
    middles = [(np.median(x[group]), np.median(y[group])) for group in groups]
    ax.plot(*np.transpose(middles), color=INK, linewidth=1.6)


def short(name: str) -> str:
    """A name beside an axis; an ellipsis replaces the middle of a long one."""
    return name if len(name) <= NAME else f"{name[: NAME // 2 - 1]}…{name[-NAME // 2 :]}"


def set_title(ax: Axes, result: StudyResult, title: str, samples: int, pad: float | None = None) -> None:
    """A title above the machine and the number of samples that are drawn. pad: points below it, for a legend."""
    text = f"{title}\n{result.metadata.machine.name}: {counted(samples, 'sample')}"
    ax.set_title(text, pad=pad, parse_math=False)
