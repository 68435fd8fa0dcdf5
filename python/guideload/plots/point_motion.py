"""Picture of the points: displacement from the place at rest over time, and its spectrum."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from guideload.audit.figures import uniform
from guideload.base.arguments import checked
from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError
from guideload.plots.long_records import draw_history, is_long, worst_cycle
from guideload.plots.spectra import even_step, mark_modes, octave_bands, power_density, set_frequency_ticks
from guideload.plots.style import (
    GREY,
    carriage_look,
    legend_beside,
    look,
    new_figure,
    run_title,
    write_instead,
)
from guideload.simulation.result import Result

SMALLEST = 1e-6  # of the largest amplitude: smaller lines are rounding


@checked
def points(result: Result) -> list[Axes]:
    """Displacement of every point from its place at rest [um] along x, y and z, and its spectral density [um/√Hz].

    A row per point: over time, of a long record as an envelope with the worst cycle beside it; and over the frequency,
    averaged in bands of 1/12 octave, with the natural frequencies. Grey lines are the settle window. Returns the axes
    row by row. Raises ArgumentError if the result reports no instant, or if the machine has no points.
    """
    machine, data = result.machine, result.quantities
    if not machine.points:
        raise ArgumentError("the machine has no points to draw")
    names = list(result.point_columns and data["point"])
    moving = 1e6 * (data["point_displacement"] - data["static_point_displacement"])
    parts = [slice(None), worst_cycle(result)] if is_long(result) else [slice(None)]
    axes: list[Axes] = []
    with look():
        figure = new_figure(5.5 * (1 + len(parts)), 1.0 + 2.8 * len(names))
        panels = figure.subplots(len(names), 1 + len(parts), squeeze=False)
        for row, (name, point, of_point) in enumerate(
            zip(names, machine.points, np.moveaxis(moving, 1, 0), strict=True)
        ):
            for column, part in enumerate(parts):
                ax = panels[row, column]
                envelope = len(parts) > 1 and column == 0
                for axis, values in enumerate(of_point[part].T):
                    color = carriage_look(axis).color
                    draw_history(ax, data["time"][part], values, envelope, color=color, linewidth=0.9)
                ax.set_ylabel("from rest [um]")
                window = 1e6 * (point.settle_window or 0.0)
                if 0.0 < window < np.abs(of_point).max():
                    for side in (-window, window):
                        ax.axhline(side, color=GREY, linewidth=0.8)
                ax.set_title(f"{name}{', worst cycle' if column else ''}", parse_math=False)
            _draw_spectrum(panels[row, -1], result, of_point)
            axes += list(panels[row])
        for ax in panels[-1, :-1]:
            ax.set_xlabel("time [s]")
        panels[-1, -1].set_xlabel("frequency [Hz]")
        figure.suptitle(f"Motion of the points\n{run_title(result)}", parse_math=False)
    return axes


def _draw_spectrum(ax: Axes, result: Result, moving: Array) -> None:
    time = result.quantities["time"]
    if np.ptp(time) == 0.0:
        write_instead(ax, "a single instant has no spectrum")
        return
    step, even = uniform(time, moving, even_step(result.quantities))
    frequency, density, _ = octave_bands(*power_density(step, even))
    amplitude = np.sqrt(density)
    top = float(amplitude.max(initial=0.0))
    if top == 0.0:
        write_instead(ax, "the point does not move")
        return
    for axis in range(3):
        ax.plot(frequency, amplitude[:, axis], color=carriage_look(axis).color, label="xyz"[axis])
    ax.set(xscale="log", yscale="log", ylim=(SMALLEST * top, 2.0 * top), ylabel="um/√Hz", title="Spectrum")
    set_frequency_ticks(ax)
    mark_modes(ax, result.modes.frequency)
    legend_beside(ax, "along")
