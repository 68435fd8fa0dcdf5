"""Picture of what drives a figure of a run: bars of its change by a small change of each number."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from guideload.base.arguments import checked
from guideload.plots.style import GREY, axes_or_new, look, plain
from guideload.reports.sensitivities import FIGURES

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from guideload.machine.machine import Machine
    from guideload.sensitivity.influence import Influence

BARS = 20


@checked
def influence(machine: Machine, found: Influence, ax: Axes | None = None) -> Axes:
    """Tornado diagram from exact derivatives, strongest first."""
    changes = found.changes[:BARS]
    places = np.arange(changes.size)
    with look():
        ax = axes_or_new(ax, 8.6, 1.7 + 0.27 * changes.size)
        ax.barh(places, changes, 0.68, color=np.where(changes >= 0, "#0072B2", "#D55E00").tolist())
        ax.axvline(0, color=GREY, linewidth=0.8)
        labels = [
            plain(f"{column.name} + {step}")
            for column, step in zip(found.columns[:BARS], found.steps[:BARS], strict=True)
        ]
        ax.set_yticks(places, labels)
        ax.set_ylim(changes.size - 0.4, -0.6)
        ax.yaxis.grid(False)
        ax.tick_params(axis="y", length=0)
        title = f"{machine.name}: {FIGURES[found.figure]} of carriage {found.carriage}, {found.value:.4g} {found.unit}"
        ax.set_title(title, parse_math=False)
        ax.set_xlabel(f"effect of the change [{found.unit}]")
    return ax
