"""Pictures of a study: distributions, exceedance, failures, band of load histories; and a folder with all of them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from guideload.base.arguments import checked
from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError
from guideload.base.number_text import capitalised, load_with_unit, number
from guideload.life.rating_life import failure_probability
from guideload.plots.drivers import STEPS, scatter, set_title, short, tornado, write_no_result
from guideload.plots.saving import save_each
from guideload.plots.style import (
    GREY,
    INK,
    carriage_look,
    drawing,
    legend_beside,
    look,
    name_rows,
    new_figure,
    plain,
)
from guideload.study import statistics
from guideload.study.quantities import LIFE, QUANTITIES, SAFETY
from guideload.study.result import RANKED, StudyResult
from guideload.study.statistics import known

FEW = 60  # samples up to which each is drawn as a dot, as their histogram would be random
LINES = 20  # histories up to which each is drawn as a line
POINTS = 120  # travels of a curve of failures
LEAST = 1e-3  # smallest probability of a failure in the picture
LEVELS = (0.05, 0.5, 0.95)
OUTER = 0.01  # share of the samples beyond the outermost mark, on the worse side
SHOWN = 0.995  # share of the lives in the picture; the rest is a long tail that would fill it


@checked
def distributions(result: StudyResult, name: str | None = None, ax: Axes | None = None) -> Axes:
    """Distribution of a quantity, one row per carriage: histogram, 5 % to 95 %, median and 99 % quantile with interval.

    Few samples are drawn as dots in place of the histogram, given cases as dots only. For a life, whose small values
    are worse, the 1 % quantile replaces the 99 % quantile.
    """
    name = name or result.leading
    names = _of_carriages(result, name)
    smallest, chosen = QUANTITIES[name].smallest_is_worst, result.metadata.chosen
    with drawing(ax, 8.0, 1.6 + 0.62 * len(names)) as ax:
        columns = [known(result.column(column)) for column in names]
        most = max(values.size for values in columns)
        title = capitalised(result.metadata.title(name))
        room = None if chosen else 22.0  # for the legend
        set_title(ax, result, f"{title}: {'the cases' if chosen else 'distribution'}", most, room)
        for row, values in enumerate(columns):
            color = carriage_look(row).color
            if chosen or 0 < values.size <= FEW:
                places = np.full(values.size, row if chosen else row - 0.22)
                ax.plot(values, places, "o", color=color, markersize=4, alpha=0.6)
            elif values.size:
                _density(ax, values, row, color, log=name == LIFE)
            if values.size and not chosen:
                _mark_quantiles(ax, result, names[row], row, OUTER if smallest else 1 - OUTER)
        if not most:
            return write_no_result(ax)
        name_rows(ax, map(_label, names))
        ax.set(ylim=(len(names) - 0.55, -0.85), xlabel=plain(result.metadata.title_with_unit(name)))
        _scale(ax, name)
        ax.margins(x=0.03)
        if smallest:
            ax.set_xlim(right=1.03 * max(np.quantile(values, SHOWN) for values in columns if values.size))
        _mark_limit(ax, result, name)
        if not chosen:
            marks = [
                ax.plot([], [], color=GREY, linewidth=3.2, label="5 % to 95 %")[0],
                ax.plot([], [], "o", color="white", markeredgecolor=GREY, markersize=6, label="median")[0],
            ]
            if most > FEW:
                side = f"{1 if smallest else 99} %, its 95 % interval"
                marks += ax.plot([], [], "|", color=GREY, markersize=11, markeredgewidth=1.8, label=side)
            ax.legend(handles=marks, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, borderaxespad=0.2)
    return ax


def _mark_quantiles(ax: Axes, result: StudyResult, column: str, row: int, outer: float) -> None:
    rows, color = result.quantiles(column, (*LEVELS, outer)), carriage_look(row).color
    low, middle, high, last = rows["value"]
    ax.plot([low, high], [row, row], color=color, linewidth=3.2, solid_capstyle="butt", zorder=3)
    ax.plot(middle, row, "o", color="white", markeredgecolor=color, markersize=6, zorder=4)
    if known(result.column(column)).size > FEW:
        ax.plot(last, row, "|", color=color, markersize=11, markeredgewidth=1.8, zorder=4)
        ends = rows[["low", "high"]].loc[outer].to_numpy(dtype=np.float64)
        if np.isfinite(ends).all():
            ax.plot(ends, [row, row], "|-", color=color, linewidth=1.0, markersize=5, zorder=4)


@checked
def exceedance(result: StudyResult, name: str | None = None, ax: Axes | None = None) -> Axes:
    """Probability that a quantity exceeds a limit, over the limit, per carriage, with 95 % intervals.

    For a life: that it does not reach the limit. The black line is the probability for any carriage of the machine.
    """
    name = name or result.leading
    names = _of_carriages(result, name)
    smallest, worse = QUANTITIES[name].smallest_is_worst, QUANTITIES[name].worse
    with drawing(ax, 8.4, 4.6) as ax:
        title = capitalised(result.metadata.title(name))
        title += f": probability that a limit is {'not reached' if smallest else 'exceeded'}"
        set_title(ax, result, title, known(result.column(names[0])).size)
        smallest_probability, longest = 1.0, 0.0
        machine = [(-1, name)] if len(names) > 1 and worse is not None else []
        for index, column in [*enumerate(names), *machine]:
            sign = -1.0 if smallest else 1.0
            values = sign * result.column(column)
            limits, (share, low, high, _) = statistics.exceedance(values, replicate=result.replicate)
            finite = np.isfinite(limits)  # infinite lives cannot be drawn
            limits, share, low, high = sign * limits[finite], share[finite], low[finite], high[finite]
            if not limits.size:
                continue
            smallest_probability = min(smallest_probability, float(share.min()))
            longest = max(longest, float(limits[share <= SHOWN].max(initial=0.0)))
            color, dash = (INK, "-") if index < 0 else carriage_look(index)
            width = 1.0 if index < 0 else 1.3 + 1.0 * (1 - (index + 1) / len(names))
            order = 4 if index < 0 else 3
            ax.fill_between(limits, low, high, color=color, alpha=0.13, linewidth=0, zorder=2)
            label = "machine (any)" if index < 0 else plain(_label(column))
            ax.plot(limits, share, color=color, linestyle=dash, linewidth=width, label=label, zorder=order)
        if not ax.lines:
            return write_no_result(ax)
        bottom = 10.0 ** np.floor(np.log10(smallest_probability) - 0.3)
        ax.set(xlabel=plain(result.metadata.title_with_unit(name)), ylabel="probability")
        ax.set(yscale="log", ylim=(bottom, 1.0))
        ax.yaxis.set_major_locator(LogLocator(numticks=12))
        ax.yaxis.set_major_formatter(_percent)
        ax.yaxis.set_minor_locator(LogLocator(subs=tuple(range(2, 10)), numticks=12))
        ax.yaxis.set_minor_formatter(NullFormatter())
        _scale(ax, name)
        ax.margins(x=0.02)
        if smallest and longest:
            ax.set_xlim(right=longest)
        _mark_limit(ax, result, name, up=0.0)
        legend_beside(ax, "carriage, and 95 % interval")
    return ax


@checked
def failure(result: StudyResult, ax: Axes | None = None) -> Axes:
    """Probability of a failure by fatigue before a travel, over the travel: of each carriage, and of any of them.

    A dashed line is the share of the samples in which the rating life of the machine is shorter than the travel. At
    most the first samples are used, as for rank correlations. Raises ArgumentError without ratings.
    """
    if LIFE not in result.quantities:
        raise ArgumentError(f"the study has no life: its quantities are {', '.join(result.quantities)}")
    reliability = result.metadata.machine.life.reliability
    lives = [(name, known(result.column(f"{LIFE}[{name}]"))[:RANKED]) for name in result.owners(LIFE)]
    machine = known(result.column(LIFE))[:RANKED]
    with drawing(ax, 8.4, 4.6) as ax:
        set_title(ax, result, "Probability of a failure by fatigue before a travel", machine.size)
        finite = machine[np.isfinite(machine)]
        if not finite.size:
            return write_no_result(ax)
        travel = np.geomspace(0.05 * float(np.quantile(finite, 0.01)), 8.0 * float(np.median(finite)), POINTS)
        curves = [
            (plain(short(name)), values, *carriage_look(i), 1.2) for i, (name, values) in enumerate(lives)
        ]
        curves = curves if len(lives) > 1 else []
        for label, values, color, dash, width in (*curves, ("machine (any)", machine, INK, "-", 1.8)):
            share = [np.mean(failure_probability(one, values, reliability)) for one in travel]
            ax.plot(travel, share, color=color, linestyle=dash, linewidth=width, label=label)
        shorter = np.searchsorted(np.sort(machine), travel) / machine.size
        label = "samples with a\nshorter rating life"
        ax.plot(travel, np.where(shorter > 0.0, shorter, np.nan), "--", color=INK, linewidth=1.0, label=label)
        ax.set(yscale="log", ylim=(LEAST, 1.0), xlabel="travel [km]", ylabel="probability")
        _scale(ax, LIFE)
        ax.yaxis.set_major_formatter(_percent)
        ax.margins(x=0.0)
        required, repetition = result.metadata.machine.life.life, result.metadata.repetition
        asked = None if required is None or repetition is None else 1e-3 * repetition.travel(required)
        wanted = result.limits.get(LIFE, asked)
        if wanted is not None:
            label = f"required life,\n{number(wanted)} km"
            ax.axvline(wanted, color=INK, linewidth=1.0, linestyle=(0, (1, 2)), label=label)
        legend_beside(ax, "carriage")
    return ax


@checked
def band(result: StudyResult, carriage: str, ax: Axes | None = None) -> Axes:
    """Resultant load of a carriage over time: band of the stored histories, and history of the nominal machine.

    Few histories are drawn as lines. Raises ArgumentError without histories, or for an unknown carriage.
    """
    names = result.metadata.carriages
    if carriage not in names:
        raise ArgumentError(f"no carriage {carriage!r}: the study has {', '.join(map(repr, names))}")
    data = result.histories
    if data is None or not data.sizes["sample"]:
        raise ArgumentError("no histories were stored: set histories in the study, e.g. histories = 100")
    color = carriage_look(names.index(carriage)).color
    resultant = data["resultant"].sel(carriage=carriage).transpose("sample", "time").values
    resultant = resultant[~np.isnan(resultant).any(axis=1)]
    time = data["time"].values
    with drawing(ax, 9.0, 3.6) as ax:
        set_title(ax, result, f"Resultant load of carriage {carriage}", len(resultant))
        if not len(resultant):
            return write_no_result(ax)
        if len(resultant) > LINES:
            low, middle, high = np.quantile(resultant, LEVELS, axis=0)
            extremes = resultant.min(axis=0), resultant.max(axis=0)
            ax.fill_between(time, *extremes, color=color, alpha=0.15, linewidth=0, label="all")
            ax.fill_between(time, low, high, color=color, alpha=0.3, linewidth=0, label="5 % to 95 %")
            ax.plot(time, middle, color=color, linewidth=1.3, label="median")
        else:
            for index, line in enumerate(resultant):
                ax.plot(time, line, color=color, linewidth=0.8, alpha=0.6, label="" if index else "samples")
        if "nominal_resultant" in data:
            nominal, dash = data["nominal_resultant"].sel(carriage=carriage).values, (0, (5, 2))
            ax.plot(time, nominal, color=INK, linewidth=1.0, linestyle=dash, label="nominal machine")
        ax.set(xlabel="time [s]", ylabel="√(Fy² + Fz²) [N]")
        ax.set_ylim(bottom=min(0.0, ax.get_ylim()[0]))
        legend_beside(ax)
    return ax


@checked
def save_study(result: StudyResult, folder: str | Path) -> list[Path]:
    """Save the pictures of a study as PNG in `folder`, which is made if missing; returns their paths.

    They are distributions, exceedance, tornado and scatter of the main quantity; distributions of life and static
    safety and the probability of failure if carriages have ratings; and a band for each carriage if histories are
    stored. Given cases have neither exceedance nor tornado nor failure. Raises PictureError if some cannot be drawn,
    after the others are saved.
    """
    return save_each(study_drawings(result), folder)


def study_drawings(result: StudyResult) -> dict[str, Callable[[], Axes]]:
    """The pictures of a study by file name, see `save_study`; each is drawn at its first call."""
    chosen, is_quantity = result.metadata.chosen, result.leading in result.quantities
    drawn = {distributions: is_quantity, exceedance: is_quantity and not chosen, tornado: not chosen}
    drawings: dict[str, Callable[[], Axes]] = {
        draw.__name__: partial(draw, result) for draw, wanted in drawn.items() if wanted
    }
    if LIFE in result.quantities:
        drawings["life"] = partial(distributions, result, LIFE)
        drawings["static_safety"] = partial(distributions, result, SAFETY)
        if not chosen:
            drawings["failure"] = partial(failure, result)
    drawings["scatter"] = lambda: scatter(result)[0]
    if result.histories is not None and result.histories.sizes["sample"]:
        drawings["histories"] = partial(_bands, result)
    return {f"{name}.png": cache(draw) for name, draw in drawings.items()}


def _bands(result: StudyResult) -> Axes:
    """The bands of all carriages on one sheet; returns its first axes."""
    carriages = result.metadata.carriages
    with look():
        figure = new_figure(9.0, 0.4 + 2.9 * len(carriages))
        sheet = figure.subplots(len(carriages), 1, squeeze=False)[:, 0]
        for ax, carriage in zip(sheet, carriages, strict=True):
            band(result, carriage, ax)
        ends = np.array([ax.get_ylim() for ax in sheet])  # loads side by side have one scale
        for ax in sheet:
            ax.set_ylim(ends.min(), ends.max())
        for ax in sheet[:-1]:
            ax.set_xlabel("")
        for ax in sheet[1:]:
            if (legend := ax.get_legend()) is not None:
                legend.remove()
    return cast(Axes, sheet[0])


def _density(ax: Axes, values: Array, row: int, color: str, log: bool) -> None:
    """A histogram above the row, with the same height in all rows; bins by Freedman and Diaconis.

    log: whether the bins are equal on a log axis.
    """
    if log:
        values = np.log10(values[values > 0])
    low, high = float(values.min()), float(values.max())
    if not (np.isfinite(low) and high > low):
        return
    first, last = np.quantile(values, [0.25, 0.75])
    width = 2 * (last - first) / values.size ** (1 / 3)
    count = int(np.clip((high - low) / width if width > 0 else 20, 8, 120))
    counts, edges = np.histogram(values, count)
    edges = 10**edges if log else edges
    ax.stairs(row - 0.75 * counts / counts.max(), edges, baseline=row, fill=True, color=color, alpha=0.3)


def _percent(probability: float, _: float) -> str:
    return f"{100 * probability:g} %"


def _scale(ax: Axes, name: str) -> None:
    """A log axis for lives, which spread over decades, and a linear one for other quantities."""
    if name != LIFE:
        ax.xaxis.set_major_locator(MaxNLocator(8, steps=STEPS))
        return
    ax.set_xscale("log")
    ax.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5), numticks=12))
    ax.xaxis.set_major_formatter("{x:g}")
    ax.xaxis.set_minor_formatter(NullFormatter())


def _mark_limit(ax: Axes, result: StudyResult, name: str, up: float = 1.0) -> None:
    """A line with a label at the limit; if it is far from all samples, a label with an arrow at the edge.

    up: height of the label, 0 at the bottom or 1 at the top of the axes.
    """
    limit = result.metadata.limits.get(name)
    if limit is None:
        return
    log = ax.get_xscale() == "log"
    low, high, place = np.log10([*ax.get_xlim(), limit]) if log else (*ax.get_xlim(), limit)
    text, at = f"limit {load_with_unit(limit, QUANTITIES[name].unit)}", place
    if low - (high - low) <= place <= high + (high - low):
        ax.axvline(limit, color=INK, linewidth=1.0, linestyle=(0, (5, 3)), zorder=3.5)
        low, high = min(low, place - 0.05 * (high - place)), max(high, place + 0.05 * (place - low))
        ax.set_xlim(*((10**low, 10**high) if log else (low, high)))
    elif place > high:
        text, at = f"{text} \N{RIGHTWARDS ARROW}", high
    else:
        text, at = f"\N{LEFTWARDS ARROW} {text}", low
    left = at <= low + 0.85 * (high - low)
    place, offset = (10**at if log else at, up), (4 if left else -4, -2 if up else 4)
    sides: dict[str, Any] = {"ha": "left" if left else "right", "va": "top" if up else "bottom"}
    halo = [withStroke(linewidth=2.5, foreground="white")]
    note = ax.annotate(text, place, offset, ("data", "axes fraction"), "offset points", fontsize=8, **sides)
    note.set(path_effects=halo, zorder=6)


def _of_carriages(result: StudyResult, name: str) -> list[str]:
    """Columns of a quantity, one per carriage, or one for the machine. Raises ArgumentError for an unknown quantity."""
    if name not in result.quantities:
        raise ArgumentError(f"no quantity {name!r}: the study has {', '.join(map(repr, result.quantities))}")
    return result.of_carriages(name)


def _label(column: str) -> str:
    return short(column.partition("[")[2].removesuffix("]") or "machine")
