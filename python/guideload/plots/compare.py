"""The picture of a comparison: the resultant of the most loaded carriage of each run, and all peaks."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes

from guideload.base.arguments import checked
from guideload.plots.long_records import draw_history, is_long
from guideload.plots.style import carriage_look, legend_beside, look, new_figure
from guideload.reports.compare import require_carriages
from guideload.simulation.result import Result

MOST_CHARACTERS = 60  # of the names of carriages side by side below the axes, each as wide as the longest


@checked
def comparison(results: Mapping[str, Result]) -> tuple[Axes, Axes]:
    """Above, the resultant of each run's most loaded carriage over time; below, the peaks of all carriages.

    Of a long record the range of the resultant in each column of the picture is drawn.

    Raises ArgumentError if a machine has no carriages.
    """
    require_carriages(results)
    with look():
        figure = new_figure(10.0, 6.8)
        above, below = figure.subplots(2, 1)
        width = 0.8 / len(results)
        for i, (title, result) in enumerate(results.items()):
            data, style = result.quantities, carriage_look(i)
            peaks, at = result.peak_columns["peak_resultant_N"], result.largest_load().index
            line, envelope = data["resultant"][:, at], is_long(result)
            draw_history(above, data["time"], line, envelope, color=style.color, linestyle=style.dash)
            places = np.arange(peaks.size) + (i - 0.5 * (len(results) - 1)) * width
            below.bar(places, peaks, width, color=style.color, label="_")
            below.containers[-1].set_label(f"{title}, largest on {result.machine.carriages[at].name}")
        names = [carriage.name for carriage in next(iter(results.values())).machine.carriages]
        are_long = len(names) * max(map(len, names)) > MOST_CHARACTERS
        turned = {"rotation": 60, "ha": "right", "rotation_mode": "anchor"} if are_long else {}
        below.set_xticks(np.arange(len(names)), names, parse_math=False, **turned)
        above.set(ylabel="resultant [N]", xlabel="time [s]", title="Most loaded carriage of each run")
        above.set_ylim(bottom=0.0)
        below.set(ylabel="peak resultant [N]", xlabel="carriage", title="Peaks")
        legend_beside(below)
    return above, below
