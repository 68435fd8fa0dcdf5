"""The picture of step stability: eigenvalues in the stability region of rk45, and the numerical damping per period."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from guideload.base.arguments import checked
from guideload.base.arrays import Complex
from guideload.base.errors import ArgumentError
from guideload.base.methods import METHODS
from guideload.method_comparison.step_stability import ON_ANY, Stability
from guideload.plots.style import CARRIAGE_COLORS, GREY, look, new_figure
from guideload.simulation.stability_function import error_per_period, stability_function

LEFT, RIGHT, TOP = -5.5, 0.7, 5.5  # limits of the picture, in h λ; no scene has an eigenvalue with Re h λ > 0
REGION = "#d8e6f2"
SMALLEST, LARGEST = 1e-13, 1.0  # limits of the amplitude error; smaller ones are rounding
STEPS_PER_PERIOD = (2, 4, 6, 10, 20, 30, 60, 100, 200)


@checked
def stability(stability: Stability, axes: Sequence[Axes] | None = None) -> list[Axes]:
    """Left the stability region of rk45 with h λ of the machine, right the amplitude error of a period.

    h is the longest stable step, and the interval between samples of the motion; the lower half plane, which
    mirrors the upper one, is left out. The error is that of an undamped mode, over its steps per period.
    """
    if axes is not None and len(axes) < 2:
        raise ArgumentError(f"the picture needs 2 axes, got {len(axes)}")
    with look():
        if axes is None:
            figure = new_figure(11.5, 5.2)
            axes = list(figure.subplots(1, 2, width_ratios=(1.0, 1.15)))
            figure.suptitle(f"{stability.machine.name}: step stability", parse_math=False)
        _draw_region(axes[0], stability)
        _draw_periods(axes[1], stability)
    return list(axes[:2])


def _draw_region(ax: Axes, stability: Stability) -> None:
    real, imaginary = np.meshgrid(np.linspace(LEFT, RIGHT, 400), np.linspace(0.0, TOP, 400))
    size = np.abs(stability_function("rk45", real + 1j * imaginary))
    ax.contourf(real, imaginary, size, levels=[0.0, 1.0], colors=[REGION])
    ax.contour(real, imaginary, size, levels=[1.0], colors=[GREY], linewidths=0.8)
    ax.axvline(0.0, color=GREY, linewidth=0.8)
    handles: list[Line2D | Patch] = [Patch(facecolor=REGION, edgecolor=GREY, label="rk45 is stable, |R| ≤ 1")]
    steps = (
        (stability.predicted_step, CARRIAGE_COLORS[0], "o", "longest stable step"),
        (stability.sample_interval, CARRIAGE_COLORS[1], "D", "sample interval"),
    )
    upper = stability.eigenvalues[stability.eigenvalues.imag >= 0.0]
    for step, color, marker, name in steps:
        points = step * upper
        inside = (points.real >= LEFT) & (points.imag <= TOP)
        label = f"h λ for the {name}, h = {1e3 * step:.3g} ms"
        style: dict[str, Any] = {
            "color": color,
            "markerfacecolor": "none",
            "markersize": 5.5,
            "markeredgewidth": 1.4,
        }
        drawn = points[inside]
        handles += ax.plot(drawn.real, drawn.imag, marker, clip_on=False, zorder=5, label=label, **style)
        if not inside.all():
            label = f"{np.count_nonzero(~inside)} of them outside, up to |h λ| = {np.abs(points).max():.3g}"
            handles.append(Line2D([], [], linestyle="", label=label))
            _point_outwards(ax, points[~inside], color)
    ax.set(xlim=(LEFT, RIGHT), ylim=(0.0, TOP), xlabel="Re h λ", ylabel="Im h λ")
    ax.set_aspect("equal")
    ax.set_title("Stability region of rk45")
    ax.legend(handles=handles, loc="upper left")


def _point_outwards(ax: Axes, points: Complex, color: str) -> None:
    """A triangle on the edge of the picture towards each point outside of it."""
    for point in points:
        to_left, to_top = max(1.0, point.real / LEFT), max(1.0, point.imag / TOP)
        at = point / max(to_left, to_top)
        marker = "<" if to_left >= to_top else "^"
        ax.plot([at.real], [at.imag], marker, color=color, markersize=7, clip_on=False, zorder=5)


def _draw_periods(ax: Axes, stability: Stability) -> None:
    steps = np.geomspace(2.0, 300.0, 400)
    for method in ON_ANY[1:]:
        color = METHODS[method].color
        lost = np.array([error_per_period(method, count)[0] for count in steps])
        lost[np.abs(lost) < SMALLEST] = np.nan
        ax.plot(steps, np.where(lost > 0.0, lost, np.nan), color=color, label=f"{method} damps")
        if np.any(lost < 0.0):
            gained, dashes = np.where(lost < 0.0, -lost, np.nan), (0, (2, 1.2))
            ax.plot(steps, gained, color=color, linestyle=dashes, label=f"{method} amplifies: unstable")
    vibrating = stability.eigenvalues[stability.eigenvalues.imag > 0.0]
    samples = 2.0 * np.pi / vibrating.imag / stability.sample_interval
    for index, count in enumerate(samples[(samples >= steps[0]) & (samples <= steps[-1])]):
        label = None if index else "modes of the machine, one step per sample"
        ax.axvline(count, color=GREY, linewidth=1.0, linestyle=(0, (4, 2)), zorder=1, label=label)
    ax.plot([], [], " ", label="exact, exponential: no error at any step")
    ax.set(xscale="log", yscale="log", xlim=(steps[0], steps[-1]), ylim=(SMALLEST, LARGEST))
    ax.set_xticks(STEPS_PER_PERIOD, [str(count) for count in STEPS_PER_PERIOD])
    ax.set_xticks([], minor=True)
    ax.set(xlabel="steps per period", ylabel="relative change of amplitude per period")
    ax.set_title("Numerical damping of an undamped vibration")
    # On white, because the lines of the modes cross it.
    ax.legend(loc="upper right", frameon=True, facecolor="white", edgecolor="none", framealpha=1.0)
