"""The work-precision diagram as a picture: time of the methods over the error of their loads."""

from __future__ import annotations

from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullFormatter, NullLocator

from guideload.base.arguments import checked
from guideload.base.methods import METHODS
from guideload.base.number_text import milliseconds, scientific
from guideload.method_comparison.diagram import MODEL_ACCURACY, SettingResult, WorkPrecision, setting_range
from guideload.plots.style import GREY, INK, PALE, drawing, legend_beside, write_instead

Point = tuple[float, float]
Run = tuple[list[SettingResult], Point]

# Fixed steps have dashed lines and hollow markers.
KINDS = {"rtol": ", tolerance", "step": ", fixed step", None: ""}
PARETO_COLOR = "#f2c14e"
NOTE = 75  # characters in a line of the note below the axes
ROOM = 0.5  # decades right of the last point


@checked
def work_precision(chart: WorkPrecision, ax: Axes | None = None) -> Axes:
    """Time of every method over the error of its loads, both logarithmic; lower is faster, right is more accurate.

    The error is relative to the largest dynamic load, or to the largest load if nothing moves. Small figures are the
    tolerance or step at the ends of a curve. A ring marks a Pareto optimal row, an arrow the one that `auto` picks.
    """
    load, largest = "dynamic load", chart.reference.largest_dynamic
    if largest is None:
        load, largest = "load (nothing moves)", chart.reference.largest_load
    runs = [(rows, rows[0].cost) for rows in chart.runs()]
    costs = [(rows, cost) for rows, cost in runs if cost is not None]
    with drawing(ax, 9.0, 5.4) as ax:
        ax.set_title(f"Work-precision diagram: {chart.machine.name}", parse_math=False)
        ax.set(xlabel=f"error / largest {load}", ylabel="time from the motion to the loads")
        if not costs or largest <= 0.0:
            return write_instead(ax, "there is no load to compare")
        ax.set(xscale="log", yscale="log")
        smallest = min(error for _, (error, _) in costs if error > 0.0)
        curves: dict[tuple[str, str | None], list[Run]] = {}
        for rows, (error, seconds) in costs:
            point = max(error, smallest) / largest, seconds
            curves.setdefault(rows[0].setting.curve, []).append((rows, point))
        drawn = [run for curve in curves.values() for run in curve]
        model = MODEL_ACCURACY * chart.reference.largest_load / largest
        _set_axes(ax, [point for _, point in drawn], model)
        _mark_limits(ax, model, chart.reference.limit, largest)
        _draw_pareto(ax, [point for rows, point in drawn if rows[0].pareto_optimal])
        for (method, kind), curve in curves.items():
            _draw_curve(ax, method, kind, curve)
        for rows, point in drawn:
            if chart.auto_row in rows:
                arrow = {"arrowstyle": "-|>", "color": INK, "linewidth": 0.8, "shrinkB": 6}
                style: dict[str, Any] = {"textcoords": "offset points", "ha": "right"}
                ax.annotate("auto picks this", point, (-30, 24), arrowprops=arrow, **style)
        _name_failures(ax, chart)
        legend_beside(ax, "method")
    return ax


def _set_axes(ax: Axes, points: list[Point], model: float) -> None:
    """Limits and ticks; the error falls to the right. model: accuracy of the model, inside the limits."""
    errors, seconds = np.array(points).T
    worst = max(float(errors.max()), 1e-2, model)
    ax.set_xlim(10.0 ** np.ceil(np.log10(worst)), float(errors.min()) / 10.0**ROOM)
    ax.set_ylim(float(seconds.min()) / 2.2, float(seconds.max()) * 2.2)
    ax.xaxis.set_major_locator(LogLocator(numticks=30))
    ax.xaxis.set_major_formatter(_error_text)
    ax.xaxis.set_minor_locator(NullLocator())
    ax.yaxis.set_major_locator(LogLocator(numticks=12))
    ax.yaxis.set_major_formatter(_time_text)
    ax.yaxis.set_minor_locator(LogLocator(subs=(2.0, 5.0), numticks=12))
    ax.yaxis.set_minor_formatter(_time_text if seconds.max() < 1e4 * seconds.min() else NullFormatter())


def _mark_limits(ax: Axes, model: float, reference: float | None, largest: float) -> None:
    """A line at the accuracy of the model, and a grey area below the error [N] of the reference."""
    ax.axvline(model, color=GREY, linewidth=0.9, linestyle=(0, (4, 3)), zorder=1)
    text = f"{scientific(MODEL_ACCURACY)} of the load: beyond, small rotations\nlimit the model, digits are arithmetic"
    texts = [(model, text, "left")]
    if reference is not None:
        ax.axvspan(reference / largest, ax.get_xlim()[1], color=PALE, alpha=0.45, zorder=0, linewidth=0)
        texts.append((reference / largest, "below the error\nof the reference", "right"))
    for error, text, side in texts:
        style: dict[str, Any] = {"textcoords": "offset points", "va": "top", "fontsize": 7.5, "color": GREY}
        offset = (4 if side == "left" else -4, -3)
        ax.annotate(text, (error, 1.0), offset, ha=side, xycoords=("data", "axes fraction"), **style)


def _draw_pareto(ax: Axes, points: list[Point]) -> None:
    """Rings on the Pareto optimal rows, joined by a band."""
    errors, seconds = np.array(sorted(points)).T
    style: dict[str, Any] = {"color": PARETO_COLOR, "zorder": 2}
    ax.plot(errors, seconds, linewidth=5.0, solid_capstyle="round", alpha=0.55, **style)
    label = "Pareto optimal: nothing is\nboth faster and more accurate"
    style |= {"markersize": 13, "markerfacecolor": "none", "markeredgewidth": 2.0}
    ax.plot(errors, seconds, "o", label=label, **style)


def _draw_curve(ax: Axes, method: str, kind: str | None, curve: list[Run]) -> None:
    color, marker = METHODS[method].color, METHODS[method].marker
    dashes, face = ("--", "white") if kind == "step" else ("-", color)
    style: dict[str, Any] = {"color": color, "marker": marker, "markersize": 5.5, "markerfacecolor": face}
    points = np.array([point for _, point in curve])
    ax.plot(*points.T, linestyle=dashes, zorder=3, label=method + KINDS[kind], **style)
    for rows, point in curve[:1] + curve[1:][-1:] if kind else []:
        offset, label = (6, -9) if kind == "step" else (6, 4), setting_range(rows)
        ax.annotate(label, point, offset, textcoords="offset points", color=color, fontsize=7.0)


def _name_failures(ax: Axes, chart: WorkPrecision) -> None:
    """The settings without a result, below the picture."""
    failed: dict[tuple[str, str | None], list[SettingResult]] = {}
    for row in chart.rows:
        if row.failed is not None:
            failed.setdefault(row.setting.curve, []).append(row)
    names = [
        f"{method} at {kind} {setting_range(rows)}" if kind else method
        for (method, kind), rows in failed.items()
    ]
    if names:
        note = fill(f"without a result: {', '.join(names)}", NOTE)
        ax.set_xlabel(f"{ax.get_xlabel()}\n{note}")


def _error_text(error: float, _: float) -> str:
    """In percent, or as a power of ten where percent has too many zeros."""
    return f"{100.0 * error:g} %" if error > 0.9e-3 else scientific(error)


def _time_text(seconds: float, _: float) -> str:
    if seconds < 0.9e-3:
        return f"{1e6 * seconds:g} µs"
    return f"{milliseconds(seconds)} ms" if seconds < 0.9 else f"{seconds:g} s"
