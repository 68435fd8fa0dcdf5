"""Picture of the speed of the methods against their accuracy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullFormatter

from guideload.base.numbers import milliseconds, scientific
from guideload.methods.diagram import MODEL_ACCURACY, setting_range
from guideload.plots.labels import AT_THE_END, BESIDE, FROM_AFAR, Labels, Point
from guideload.plots.style import GREY, PALE, axes_or_new, look

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from guideload.methods.diagram import Row, WorkPrecision

# Colour and marker of each method; a fixed step is dashed and hollow.
METHODS = {"exact": ("#009E73", "D"), "implicit": ("#0072B2", "o"), "rk45": ("#D55E00", "s")}
LADDERS = {"rtol": "tolerance", "step": "fixed step", None: ""}
FRONT = "#f2c14e"
ROOM = 2.5  # decades right of the last point, for the names of the methods


def work_precision(chart: WorkPrecision, ax: Axes | None = None) -> Axes:
    """Time of every method against the error that it makes, both logarithmic; faster is lower, better is right.

    The error is that of the dynamic load, or where nothing moves that of the load. Small figures are the
    tolerances and steps asked for. A ring marks the front, an arrow what `auto` picks.
    """
    of, largest = "dynamic load", chart.reference.largest_dynamic
    if largest is None:
        of, largest = "load (nothing moves)", chart.reference.largest_load
    runs = [rows for rows in chart.runs() if rows[0].seconds is not None]
    with look():
        ax = axes_or_new(ax, 9.0, 5.4)
        ax.set_title(f"Speed against accuracy: {chart.machine.name}")
        ax.set(xlabel=f"error, of the largest {of}", ylabel="time from the motion to the loads")
        if not runs or largest <= 0.0:
            ax.text(0.5, 0.5, "there is no load to compare", transform=ax.transAxes, ha="center", color=GREY)
            return ax
        ax.set(xscale="log", yscale="log")
        points = [(float(run[0].error or 0.0) / largest, float(run[0].seconds or 0.0)) for run in runs]
        smallest = min(error for error, _ in points if error > 0.0)
        points = [(max(error, smallest), seconds) for error, seconds in points]
        _frame(ax, points, MODEL_ACCURACY * chart.reference.largest_load / largest)
        if chart.reference.limit is not None:
            _limit_of_reference(ax, chart.reference.limit / largest)
        _front(ax, [point for run, point in zip(runs, points, strict=True) if run[0].pareto_optimal])
        ladders: dict[tuple[str, str | None], list[tuple[list[Row], Point]]] = {}
        for run, point in zip(runs, points, strict=True):
            ladders.setdefault(run[0].setting[:2], []).append((run, point))
        for (method, kind), ladder in ladders.items():
            _ladder(ax, method, kind, [point for _, point in ladder])
        _failures(ax, chart)
        _write_labels(ax, chart, ladders)
    return ax


def _frame(ax: Axes, points: list[Point], model: float) -> None:
    """Limits, ticks and the line beyond which digits are arithmetic; the error falls to the right."""
    errors, seconds = np.array(points).T
    worst = max(float(errors.max()), 1e-2, model)
    ax.set_xlim(10.0 ** np.ceil(np.log10(worst)), float(errors.min()) / 10.0**ROOM)
    ax.set_ylim(float(seconds.min()) / 2.2, float(seconds.max()) * 2.2)
    ax.xaxis.set_major_locator(LogLocator(numticks=30))
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: _share(value)))
    ax.xaxis.set_minor_locator(FixedLocator([]))
    ax.yaxis.set_major_locator(LogLocator(numticks=12))
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: _duration(value)))
    ax.yaxis.set_minor_locator(LogLocator(subs=(2.0, 5.0), numticks=12))
    between = FuncFormatter(lambda value, _: _duration(value))
    ax.yaxis.set_minor_formatter(between if seconds.max() < 1e4 * seconds.min() else NullFormatter())
    ax.axvline(model, color=GREY, linewidth=0.9, linestyle=(0, (4, 3)), zorder=1)
    ax.annotate(
        f"{scientific(MODEL_ACCURACY)} of the load: beyond, small rotations\nlimit the model, digits are arithmetic",
        (model, 1.0),
        xycoords=("data", "axes fraction"),
        xytext=(4, -3),
        textcoords="offset points",
        va="top",
        fontsize=7.5,
        color=GREY,
    )


def _limit_of_reference(ax: Axes, limit: float) -> None:
    """The strip in which the reference can tell no errors."""
    ax.axvspan(limit, ax.get_xlim()[1], color=PALE, alpha=0.45, zorder=0, linewidth=0)
    ax.annotate(
        "below what the\nreference can tell",
        (limit, 1.0),
        xycoords=("data", "axes fraction"),
        xytext=(4, -3),
        textcoords="offset points",
        va="top",
        fontsize=7.5,
        color=GREY,
    )


def _front(ax: Axes, points: list[Point]) -> None:
    """Rings on the rows of the front, joined by a band."""
    errors, seconds = np.array(sorted(points)).T
    style: dict[str, Any] = {"color": FRONT, "zorder": 2}
    ax.plot(errors, seconds, linewidth=5.0, solid_capstyle="round", alpha=0.55, **style)
    ax.plot(
        errors,
        seconds,
        linestyle="",
        marker="o",
        markersize=13,
        markerfacecolor="none",
        markeredgewidth=2.0,
        markeredgecolor=FRONT,
        label="front: nothing is both faster and more accurate",
        zorder=2,
    )
    ax.legend(loc="lower left", frameon=True, framealpha=1.0, edgecolor="none")


def _ladder(ax: Axes, method: str, kind: str | None, points: list[Point]) -> None:
    """The settings of one method as a line with markers."""
    color, marker = METHODS[method]
    ax.plot(
        *np.array(points).T,
        color=color,
        linestyle="--" if kind == "step" else "-",
        marker=marker,
        markersize=5.5,
        markerfacecolor="white" if kind == "step" else color,
        zorder=3,
    )


def _write_labels(
    ax: Axes, chart: WorkPrecision, ladders: dict[tuple[str, str | None], list[tuple[list[Row], Point]]]
) -> None:
    """What `auto` picks, the methods at the ends of their lines, and the settings where there is room."""
    labels = Labels(ax)
    for (method, kind), ladder in ladders.items():
        name = ", ".join(part for part in (method, LADDERS[kind]) if part)
        ends = [point for _, point in ladder[:-4:-1]]
        labels.add(name, ends, AT_THE_END, color=METHODS[method][0], fontsize=8.5, weight="bold")
    for ladder in ladders.values():
        for run, point in ladder:
            if chart.auto_row in run:
                labels.add("auto picks this", [point], FROM_AFAR, arrow=True, fontsize=8.5)
    for (method, kind), ladder in ladders.items():
        for run, point in ladder:
            if kind is not None:
                color = METHODS[method][0]
                labels.add(setting_range(run), [point], BESIDE, must=False, color=color, fontsize=6.5)


def _failures(ax: Axes, chart: WorkPrecision) -> None:
    """What could not be drawn, below the picture."""
    without: dict[tuple[str, str | None], list[Row]] = {}
    for row in chart.rows:
        if row.failed is not None:
            without.setdefault(row.setting[:2], []).append(row)
    if without:
        names = ", ".join(
            f"{method} at {kind} {setting_range(rows)}" if kind else method
            for (method, kind), rows in without.items()
        )
        ax.set_xlabel(f"{ax.get_xlabel()}\nwithout a result: {names}")


def _share(value: float) -> str:
    """An error as an engineer says it: in percent, or in decades where percent has too many zeros."""
    return f"{100.0 * value:g} %" if value > 0.9e-3 else scientific(value)


def _duration(seconds: float) -> str:
    if seconds < 0.9e-3:
        return f"{1e6 * seconds:g} µs"
    return f"{milliseconds(seconds)} ms" if seconds < 0.9 else f"{seconds:g} s"
