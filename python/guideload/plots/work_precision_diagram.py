"""The work-precision diagram as a picture: time of the methods over the error of their loads."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullFormatter

from guideload.base.number_text import milliseconds, scientific
from guideload.method_comparison.diagram import MODEL_ACCURACY, setting_range
from guideload.plots.labels import AT_THE_END, BESIDE, FROM_AFAR, Labels, Point
from guideload.plots.style import GREY, PALE, axes_or_new, look, write_instead

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from guideload.method_comparison.diagram import Row, WorkPrecision

    Curves = dict[tuple[str, str | None], list[tuple[list[Row], Point]]]

# Colour and marker of each method; fixed steps have dashed lines and hollow markers.
METHODS = {"exact": ("#009E73", "D"), "implicit": ("#0072B2", "o"), "rk45": ("#D55E00", "s")}
KINDS = {"rtol": ", tolerance", "step": ", fixed step", None: ""}
PARETO_COLOR = "#f2c14e"
ROOM = 2.5  # decades right of the last point, for the names of the methods


def work_precision(chart: WorkPrecision, ax: Axes | None = None) -> Axes:
    """Time of every method over the error of its loads, both logarithmic; lower is faster, right is more accurate.

    The error is relative to the largest dynamic load, or to the largest load if nothing moves. Small figures are
    tolerances and steps. A ring marks a Pareto optimal row, an arrow the one that `auto` picks.
    """
    load, largest = "dynamic load", chart.reference.largest_dynamic
    if largest is None:
        load, largest = "load (nothing moves)", chart.reference.largest_load
    runs = [(rows, rows[0].cost) for rows in chart.runs()]
    costs = [(rows, cost) for rows, cost in runs if cost is not None]
    with look():
        ax = axes_or_new(ax, 9.0, 5.4)
        ax.set_title(f"Work-precision diagram: {chart.machine.name}", parse_math=False)
        ax.set(xlabel=f"error / largest {load}", ylabel="time from the motion to the loads")
        if not costs or largest <= 0.0:
            return write_instead(ax, "there is no load to compare")
        ax.set(xscale="log", yscale="log")
        smallest = min(error for _, (error, _) in costs if error > 0.0)
        curves: Curves = {}
        for rows, (error, seconds) in costs:
            point = max(error, smallest) / largest, seconds
            curves.setdefault(rows[0].setting.curve, []).append((rows, point))
        drawn = [run for curve in curves.values() for run in curve]
        model = MODEL_ACCURACY * chart.reference.largest_load / largest
        _set_axes(ax, [point for _, point in drawn], model)
        _mark_limits(ax, model, chart.reference.limit, largest)
        _draw_pareto(ax, [point for rows, point in drawn if rows[0].pareto_optimal])
        for (method, kind), curve in curves.items():
            _draw_curve(ax, method, kind, [point for _, point in curve])
        _name_failures(ax, chart)
        _write_labels(ax, chart, curves)
    return ax


def _set_axes(ax: Axes, points: list[Point], model: float) -> None:
    """Limits and ticks; the error falls to the right. model: accuracy of the model, inside the limits."""
    errors, seconds = np.array(points).T
    worst = max(float(errors.max()), 1e-2, model)
    ax.set_xlim(10.0 ** np.ceil(np.log10(worst)), float(errors.min()) / 10.0**ROOM)
    ax.set_ylim(float(seconds.min()) / 2.2, float(seconds.max()) * 2.2)
    ax.xaxis.set_major_locator(LogLocator(numticks=30))
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: _error_text(value)))
    ax.xaxis.set_minor_locator(FixedLocator([]))
    times = FuncFormatter(lambda value, _: _time_text(value))
    ax.yaxis.set_major_locator(LogLocator(numticks=12))
    ax.yaxis.set_major_formatter(times)
    ax.yaxis.set_minor_locator(LogLocator(subs=(2.0, 5.0), numticks=12))
    ax.yaxis.set_minor_formatter(times if seconds.max() < 1e4 * seconds.min() else NullFormatter())


def _mark_limits(ax: Axes, model: float, reference: float | None, largest: float) -> None:
    """A line at the accuracy of the model, and a grey area below the error [N] of the reference."""
    ax.axvline(model, color=GREY, linewidth=0.9, linestyle=(0, (4, 3)), zorder=1)
    text = f"{scientific(MODEL_ACCURACY)} of the load: beyond, small rotations\nlimit the model, digits are arithmetic"
    texts = [(model, text)]
    if reference is not None:
        ax.axvspan(reference / largest, ax.get_xlim()[1], color=PALE, alpha=0.45, zorder=0, linewidth=0)
        texts.append((reference / largest, "below the error\nof the reference"))
    for error, text in texts:
        style: dict[str, Any] = {"textcoords": "offset points", "va": "top", "fontsize": 7.5, "color": GREY}
        ax.annotate(text, (error, 1.0), (4, -3), xycoords=("data", "axes fraction"), **style)


def _draw_pareto(ax: Axes, points: list[Point]) -> None:
    """Rings on the Pareto optimal rows, joined by a band."""
    errors, seconds = np.array(sorted(points)).T
    style: dict[str, Any] = {"color": PARETO_COLOR, "zorder": 2}
    ax.plot(errors, seconds, linewidth=5.0, solid_capstyle="round", alpha=0.55, **style)
    label = "Pareto optimal: nothing is both faster and more accurate"
    style |= {"markersize": 13, "markerfacecolor": "none", "markeredgewidth": 2.0}
    ax.plot(errors, seconds, "o", label=label, **style)
    ax.legend(loc="lower left", frameon=True, framealpha=1.0, edgecolor="none")


def _draw_curve(ax: Axes, method: str, kind: str | None, points: list[Point]) -> None:
    color, marker = METHODS[method]
    dashes, face = ("--", "white") if kind == "step" else ("-", color)
    style: dict[str, Any] = {"color": color, "marker": marker, "markersize": 5.5, "markerfacecolor": face}
    ax.plot(*np.array(points).T, linestyle=dashes, zorder=3, **style)


def _write_labels(ax: Axes, chart: WorkPrecision, curves: Curves) -> None:
    """The methods at the ends of their curves, what `auto` picks, and the settings where there is room."""
    labels = Labels(ax)
    for (method, kind), curve in curves.items():
        ends = [point for _, point in curve[:-4:-1]]
        name, color = method + KINDS[kind], METHODS[method][0]
        labels.add(name, ends, AT_THE_END, color=color, fontsize=8.5, weight="bold")
    runs = [(method, kind, run) for (method, kind), curve in curves.items() for run in curve]
    for _, _, (rows, point) in runs:
        if chart.auto_row in rows:
            labels.add("auto picks this", [point], FROM_AFAR, arrow=True, fontsize=8.5)
    for method, kind, (rows, point) in runs:
        if kind is not None:
            color = METHODS[method][0]
            labels.add(setting_range(rows), [point], BESIDE, optional=True, color=color, fontsize=6.5)


def _name_failures(ax: Axes, chart: WorkPrecision) -> None:
    """The settings without a result, below the picture."""
    failed: dict[tuple[str, str | None], list[Row]] = {}
    for row in chart.rows:
        if row.failed is not None:
            failed.setdefault(row.setting.curve, []).append(row)
    names = [
        f"{method} at {kind} {setting_range(rows)}" if kind else method
        for (method, kind), rows in failed.items()
    ]
    if names:
        ax.set_xlabel(f"{ax.get_xlabel()}\nwithout a result: {', '.join(names)}")


def _error_text(error: float) -> str:
    """In percent, or as a power of ten where percent has too many zeros."""
    return f"{100.0 * error:g} %" if error > 0.9e-3 else scientific(error)


def _time_text(seconds: float) -> str:
    if seconds < 0.9e-3:
        return f"{1e6 * seconds:g} µs"
    return f"{milliseconds(seconds)} ms" if seconds < 0.9 else f"{seconds:g} s"
