"""Picture of a frequency response: magnitude and phase of every point over the frequency."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.ticker import MultipleLocator

from guideload.base.arguments import checked
from guideload.machine.machine import Machine
from guideload.machine.response import FrequencyResponse
from guideload.plots.spectra import label_hertz, mark_modes, set_frequency_ticks
from guideload.plots.style import carriage_look, legend_beside, look, new_figure
from guideload.reports.response import source_unit, source_words


@checked
def frequency_response(machine: Machine, response: FrequencyResponse) -> list[Axes]:
    """Magnitude [um per m/s2 or per N] and phase of the points' displacement over the frequency.

    A column per point, with a line for each of x, y and z; grey lines are the natural frequencies. Returns the axes:
    magnitude and phase of the first point, of the second, ...
    """
    magnitude = 1e6 * response.magnitude
    top = float(magnitude.max()) or 1.0
    axes: list[Axes] = []
    with look():
        figure = new_figure(2.0 + 6.0 * len(response.points), 6.0)
        grid = figure.add_gridspec(2, len(response.points), height_ratios=[2, 1])
        for i, name in enumerate(response.points):
            over = figure.add_subplot(grid[0, i], sharey=axes[0] if axes else None)
            under = figure.add_subplot(grid[1, i], sharex=over)
            for axis in range(3):
                if response.magnitude[:, i, axis].max() <= response.least:
                    continue
                for ax, values in ((over, magnitude), (under, response.phase)):
                    color, label = carriage_look(axis).color, "xyz"[axis]
                    ax.plot(response.frequency, values[:, i, axis], color=color, label=label)
            bottom = max(magnitude[magnitude > 0].min(initial=top), 1e-5 * top)
            over.set(xscale="log", yscale="log", ylim=(bottom, 2 * top))
            over.set_title(name, parse_math=False)
            over.set_ylabel(f"displacement [um per {source_unit(response)}]")
            under.set(xlabel="frequency [Hz]", ylabel="phase [deg]", ylim=(-190, 190))
            under.yaxis.set_major_locator(MultipleLocator(90))
            set_frequency_ticks(over)
            mark_modes(under, response.natural)
            label_hertz(over, mark_modes(over, response.natural))
            axes += [over, under]
        legend_beside(axes[-2], "along")
        figure.suptitle(f"{machine.name}: response to {source_words(response)}", parse_math=False)
    return axes
