"""Pictures of a study: distributions, exceedance, what drives the peak, the band of the histories kept."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from guideload.base.numbers import load_with_unit
from guideload.plots.drivers import STEPS, nothing, scatter, set_title, short, tornado
from guideload.plots.style import GREY, INK, axes_or_new, carriage_look, look, new_figure
from guideload.study.quantities import LIFE, known_quantity, titled, unit_of, with_unit
from guideload.study.statistics import known, quantiles

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D
    from numpy.typing import NDArray

    from guideload.study.result import StudyResult

    Array = NDArray[np.float64]

FEW = 60  # samples up to which each is drawn as a dot: a shape of fewer would be one of chance
LINES = 20  # histories up to which each is drawn
LEVELS = (0.05, 0.5, 0.95)
OUTER = 0.01  # of the samples beyond the last mark, on the side that matters
SEEN = 0.995  # of the lives, and the probability that they are not reached: beyond, a long tail fills the picture


def distributions(result: StudyResult, name: str | None = None, ax: Axes | None = None) -> Axes:
    """How a quantity scatters, a row per carriage: its density, 5 % to 95 %, the median and the 99 % quantile.

    Of few samples every one is a dot instead, and of chosen cases nothing but the dots. For a life the
    outermost mark is the 1 % quantile.
    """
    name = name or result.leading
    names = _of_carriages(result, name)
    with look():
        ax = axes_or_new(ax, 8.0, 1.6 + 0.62 * len(names))
        columns = [known(result.column(column)) for column in names]
        what = "the cases" if result.studied.chosen else "distribution"
        set_title(
            ax,
            result,
            f"{titled(name, result.studied)}: {what}",
            max(values.size for values in columns),
        )
        outer = OUTER if known_quantity(name).smallest_is_worst else 1 - OUTER
        for row, values in enumerate(columns):
            color = carriage_look(row).color
            if result.studied.chosen:
                ax.plot(values, np.full(values.size, row), "o", color=color, markersize=4, alpha=0.6)
                continue
            if values.size > FEW:
                _shape(ax, values, row, color, log=name == LIFE)
            elif values.size:
                ax.plot(values, np.full(values.size, row - 0.22), "o", color=color, markersize=4, alpha=0.6)
            if values.size:
                low, middle, high, last = quantiles(values, (*LEVELS, outer)).values
                ax.plot([low, high], [row, row], color=color, linewidth=3.2, solid_capstyle="butt", zorder=3)
                ax.plot(middle, row, "o", color="white", markeredgecolor=color, markersize=6, zorder=4)
                if values.size > FEW:
                    ax.plot(last, row, "|", color=color, markersize=11, markeredgewidth=1.8, zorder=4)
        if not any(values.size for values in columns):
            return nothing(ax)
        ax.set_yticks(range(len(names)), [_label(column) for column in names])
        ax.set(ylim=(len(names) - 0.55, -0.85), xlabel=with_unit(name, result.studied))
        ax.yaxis.grid(False)
        ax.tick_params(axis="y", length=0)
        _scale(ax, name)
        ax.margins(x=0.03)
        if known_quantity(name).smallest_is_worst:
            ax.set_xlim(right=1.03 * max(np.quantile(values, SEEN) for values in columns if values.size))
        _mark_limit(ax, result, name)
        if result.studied.chosen:
            return ax
        side = "1 %" if known_quantity(name).smallest_is_worst else "99 %"
        marks = [
            ax.plot([], [], color=GREY, linewidth=3.2, label="5 % to 95 %")[0],
            ax.plot([], [], "o", color="white", markeredgecolor=GREY, markersize=6, label="median")[0],
        ]
        if max(values.size for values in columns) > FEW:
            marks += ax.plot([], [], "|", color=GREY, markersize=11, markeredgewidth=1.8, label=side)
        _legend_below_title(ax, marks)
    return ax


def exceedance(result: StudyResult, name: str | None = None, ax: Axes | None = None) -> Axes:
    """Probability that a quantity is passed, on a log scale, per carriage, with its band of 95 %.

    For a life: that it is not reached. The ink line is the machine: any of its carriages.
    """
    name = name or result.leading
    names = _of_carriages(result, name)
    smallest = known_quantity(name).smallest_is_worst
    with look():
        ax = axes_or_new(ax, 8.4, 4.6)
        title = f"{titled(name, result.studied)}: probability that it is {'not reached' if smallest else 'passed'}"
        set_title(ax, result, title, known(result.column(names[0])).size)
        smallest_probability, longest = 1.0, 0.0
        shown = [
            *enumerate(names),
            *([(-1, name)] if len(names) > 1 and known_quantity(name).has_worst else []),
        ]
        for index, column in shown:
            limits, share, low, high = _exceedance(result, column, smallest)
            if not limits.size:
                continue
            smallest_probability = min(smallest_probability, float(share.min()))
            longest = max(longest, float(limits[share <= SEEN].max(initial=0.0)))
            color, dash = (INK, "-") if index < 0 else carriage_look(index)
            width = 1.0 if index < 0 else 1.3 + 1.0 * (1 - (index + 1) / len(names))
            order = 4 if index < 0 else 3
            ax.fill_between(limits, low, high, color=color, alpha=0.13, linewidth=0, zorder=2)
            label = "machine (any)" if index < 0 else _label(column)
            ax.plot(limits, share, color=color, linestyle=dash, linewidth=width, label=label, zorder=order)
        if not ax.lines:
            return nothing(ax)
        bottom = 10.0 ** np.floor(np.log10(smallest_probability) - 0.3)
        ax.set(yscale="log", ylim=(bottom, 1.0), xlabel=with_unit(name, result.studied), ylabel="probability")
        ax.yaxis.set_major_locator(LogLocator(numticks=12))
        ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:g} %"))
        ax.yaxis.set_minor_locator(LogLocator(subs=tuple(range(2, 10)), numticks=12))
        ax.yaxis.set_minor_formatter(NullFormatter())
        _scale(ax, name)
        ax.margins(x=0.02)
        if smallest and longest:
            ax.set_xlim(right=longest)
        _mark_limit(ax, result, name, up=0.0)
        ax.legend(
            title="carriage, and 95 % band", loc="center left", bbox_to_anchor=(1.0, 0.5), alignment="left"
        )
    return ax


def band(result: StudyResult, carriage: str, ax: Axes | None = None) -> Axes:
    """Resultant load of a carriage over time: the band of the histories kept, and the machine as described.

    Of few histories each is a line. Raises ValueError if no histories were kept or there is no such carriage.
    """
    names = result.studied.carriages
    if carriage not in names:
        raise ValueError(f"no carriage {carriage!r}: the study has {', '.join(map(repr, names))}")
    data = result.histories
    if data is None or not data.sizes["sample"]:
        raise ValueError("no histories were kept: set histories in the study, e.g. histories = 100")
    color = carriage_look(names.index(carriage)).color
    resultant = data["resultant"].sel(carriage=carriage).transpose("sample", "time").values
    resultant = resultant[~np.isnan(resultant).any(axis=1)]
    time = data["time"].values
    with look():
        ax = axes_or_new(ax, 9.0, 3.6)
        set_title(ax, result, f"Resultant load of carriage {carriage}", len(resultant))
        if not len(resultant):
            return nothing(ax)
        if len(resultant) > LINES:
            low, middle, high = np.quantile(resultant, LEVELS, axis=0)
            whole = resultant.min(axis=0), resultant.max(axis=0)
            ax.fill_between(time, *whole, color=color, alpha=0.15, linewidth=0, label="all")
            ax.fill_between(time, low, high, color=color, alpha=0.3, linewidth=0, label="5 % to 95 %")
            ax.plot(time, middle, color=color, linewidth=1.3, label="median")
        else:
            for index, line in enumerate(resultant):
                ax.plot(time, line, color=color, linewidth=0.8, alpha=0.6, label="" if index else "samples")
        if "nominal_resultant" in data:
            nominal = data["nominal_resultant"].sel(carriage=carriage).values
            ax.plot(
                time, nominal, color=INK, linewidth=1.0, linestyle=(0, (5, 2)), label="machine as described"
            )
        ax.set(xlabel="time [s]", ylabel="√(F$_y$² + F$_z$²) [N]")
        ax.set_ylim(bottom=min(0.0, ax.get_ylim()[0]))
        ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), alignment="left")
    return ax


def save_study(result: StudyResult, folder: str | Path) -> list[Path]:
    """Save the pictures of a study as PNG in `folder`, made when missing; returns their paths.

    Distributions, exceedance, what drives the peak resultant, scatter; and a band for each carriage if histories
    were kept. Of chosen cases no exceedance and no tornado. Another figure stands for the peak resultant where that
    was not kept.
    """
    from guideload.plots import save

    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    if result.leading in result.quantities:
        paths.append(save(distributions(result), folder / "distributions.png"))
    if result.leading in result.quantities and not result.studied.chosen:
        paths.append(save(exceedance(result), folder / "exceedance.png"))
    if not result.studied.chosen:
        paths.append(save(tornado(result), folder / "tornado.png"))
    paths.append(save(scatter(result)[0], folder / "scatter.png"))
    if result.histories is not None and result.histories.sizes["sample"]:
        carriages = result.studied.carriages
        with look():
            figure = new_figure(9.0, 0.4 + 2.9 * len(carriages))
            sheet = figure.subplots(len(carriages), 1, squeeze=False)[:, 0]
            for ax, carriage in zip(sheet, carriages, strict=True):
                band(result, carriage, ax)
            for ax in sheet[:-1]:
                ax.set_xlabel("")
            for ax in sheet[1:]:
                if (legend := ax.get_legend()) is not None:
                    legend.remove()
        paths.append(save(sheet[0], folder / "histories.png"))
    return paths


def _shape(ax: Axes, values: Array, row: int, color: str, log: bool) -> None:
    """The density as a hill above the row, as high as all others; bins by Freedman and Diaconis.

    log: of the logarithms, for an axis that shows them.
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


def _scale(ax: Axes, name: str) -> None:
    """Lives on a log axis: they go with a power of the load, and spread over decades."""
    if name != LIFE:
        ax.xaxis.set_major_locator(MaxNLocator(8, steps=STEPS))
        return
    ax.set_xscale("log")
    ax.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5), numticks=12))
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.xaxis.set_minor_formatter(NullFormatter())


def _exceedance(result: StudyResult, column: str, smallest: bool) -> tuple[Array, Array, Array, Array]:
    if not smallest:
        limits, (share, low, high) = result.exceedance(column)
        return limits, share, low, high
    from guideload.study.statistics import exceedance as of_values

    # A life of infinity has no place in the picture.
    limits, (share, low, high) = of_values(-result.column(column))
    there = np.isfinite(limits)
    return -limits[there], share[there], low[there], high[there]


def _mark_limit(ax: Axes, result: StudyResult, name: str, up: float = 1.0) -> None:
    """A line at the limit; one far beyond all samples is told of at the edge, and leaves them their room.

    up: part of the axes' height at which it is named, 0 or 1.
    """
    limit = result.limits().get(name)
    if limit is None:
        return
    log = ax.get_xscale() == "log"
    low, high, place = np.log10([*ax.get_xlim(), limit]) if log else (*ax.get_xlim(), limit)
    text, at = f"limit {load_with_unit(limit, unit_of(name))}", place
    if low - (high - low) <= place <= high + (high - low):
        ax.axvline(limit, color=INK, linewidth=1.0, linestyle=(0, (5, 3)), zorder=3.5)
        low, high = min(low, place - 0.05 * (high - place)), max(high, place + 0.05 * (place - low))
        ax.set_xlim(*((10**low, 10**high) if log else (low, high)))
    elif place > high:
        text, at = f"{text} \N{RIGHTWARDS ARROW}", high
    else:
        text, at = f"\N{LEFTWARDS ARROW} {text}", low
    left = at <= low + 0.85 * (high - low)
    ax.annotate(
        text,
        (10**at if log else at, up),
        (4 if left else -4, -2 if up else 4),
        xycoords=("data", "axes fraction"),
        textcoords="offset points",
        ha="left" if left else "right",
        va="top" if up else "bottom",
        fontsize=8,
        path_effects=[withStroke(linewidth=2.5, foreground="white")],
        zorder=6,
    )


def _legend_below_title(ax: Axes, marks: list[Line2D]) -> None:
    ax.legend(handles=marks, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, borderaxespad=0.2)


def _of_carriages(result: StudyResult, name: str) -> list[str]:
    """The columns of a quantity: of each carriage, or its only one. Raises ValueError if there is no such."""
    if name not in result.quantities:
        raise ValueError(f"no quantity {name!r}: the study has {', '.join(map(repr, result.quantities))}")
    if known_quantity(name).of_machine:
        return [name]
    return [f"{name}[{carriage}]" for carriage in result.studied.carriages]


def _label(column: str) -> str:
    return short(column.partition("[")[2].removesuffix("]") or "machine")
