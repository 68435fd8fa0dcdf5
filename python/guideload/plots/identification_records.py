"""Pictures of records in time: measured against computed, their difference, and both spectra."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.signal import welch

from guideload.plots.style import CARRIAGE_COLORS, GREY, INK, legend_above, look, new_figure, plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from guideload.base.arrays import Array
    from guideload.identification.records import Record
    from guideload.identification.result import Identification

RECORD_PICTURES = tuple(f"record_{number}.png" for number in range(1, 10))  # of the first records
MOST_CHANNELS = 4  # that are drawn
MEASURED, COMPUTED, DIFFERENCE = GREY, CARRIAGE_COLORS[0], INK
PARTS = 8  # of a record, whose spectra are averaged


def records(found: Identification, data: Record) -> list[Axes]:
    """Measured against computed values of a record in time: histories, difference and spectra of each channel.

    data: one of the data of the identification. Returns the axes.
    """
    measured, predicted = data.measured, data.predicted(found.model, found.nuisance_values(data))
    titles = [f"{name} [{unit}]" for name, unit in data.titles]
    count = min(len(titles), MOST_CHANNELS)
    with look():
        figure = new_figure(10.0, 0.8 + 3.4 * count)
        grid = figure.add_gridspec(2 * count, 2, width_ratios=[2.0, 1.0], height_ratios=[2.0, 1.0] * count)
        axes: list[Axes] = []
        for i in range(count):
            above = figure.add_subplot(grid[2 * i, 0])
            below = figure.add_subplot(grid[2 * i + 1, 0], sharex=above)
            beside = figure.add_subplot(grid[2 * i : 2 * i + 2, 1])
            _histories(above, below, data.window_time, measured[i], predicted[i])
            _spectra(beside, data.window_time, measured[i], predicted[i])
            above.set_title(plain(titles[i]), loc="left", parse_math=False)
            if i == 0:
                legend_above(beside, 2)
            axes += [above, below, beside]
        axes[-2].set_xlabel("time of the record [s]")
        axes[-1].set_xlabel("frequency [Hz]")
        figure.suptitle(f"{found.nominal.name}: {data.name}, measured and computed", parse_math=False)
    return axes


def _histories(above: Axes, below: Axes, time: Array, measured: Array, predicted: Array) -> None:
    gaps = np.flatnonzero(np.diff(time) > 2.0 * np.median(np.diff(time))) + 1  # windows that are left out

    def broken(values: Array) -> Array:
        return np.insert(values, gaps, np.nan)

    above.plot(broken(time), broken(measured), color=MEASURED, linewidth=1.6)
    above.plot(broken(time), broken(predicted), color=COMPUTED, linewidth=0.8)
    above.tick_params(labelbottom=False)
    below.plot(broken(time), broken(measured - predicted), color=DIFFERENCE, linewidth=0.6)
    below.axhline(0.0, color=GREY, linewidth=0.8)
    below.set_ylabel("difference")


def _spectra(ax: Axes, time: Array, measured: Array, predicted: Array) -> None:
    """Amplitude spectral densities, by Welch's method on a uniform grid."""
    step = float(np.median(np.diff(time)))
    grid = np.arange(time[0], time[-1], step)
    for values, color, width, label in (
        (measured, MEASURED, 2.0, "measured"),
        (predicted, COMPUTED, 1.0, "computed"),
        (measured - predicted, DIFFERENCE, 0.8, "difference"),
    ):
        even = np.interp(grid, time, values)
        hertz, density = welch(even, 1.0 / step, nperseg=max(grid.size // PARTS, 8))
        ax.loglog(hertz[1:], np.sqrt(density[1:]), color=color, linewidth=width, label=label)
    ax.set_ylabel("amplitude density [unit/√Hz]")
