"""Picture of what drives a figure of a run: bars of its change by a small change of each number."""

from __future__ import annotations

from matplotlib.axes import Axes

from guideload.base.arguments import checked
from guideload.machine.machine import Machine
from guideload.plots.style import draw_effects, drawing, name_rows
from guideload.reports.sensitivities import figure_text
from guideload.sensitivity.influence import Influence

BARS = 20


@checked
def influence(machine: Machine, found: Influence, ax: Axes | None = None) -> Axes:
    """Tornado diagram from exact derivatives, strongest first."""
    unit, scale = ("km", 1e-3) if found.unit == "m" else (found.unit, 1.0)
    changes = scale * found.changes[:BARS]
    with drawing(ax, 8.6, 1.7 + 0.27 * changes.size) as ax:
        draw_effects(ax, changes)
        shown = zip(found.columns[:BARS], found.steps, strict=False)
        name_rows(ax, (f"{column.name} + {step}" for column, step in shown))
        ax.set_title(f"{machine.name}: {figure_text(found)}", parse_math=False)
        ax.set_xlabel(f"effect of the change [{unit}]")
    return ax
