"""Picture of the fatigue damage along the rails."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from guideload.base.arguments import checked
from guideload.life.life import Life
from guideload.plots.style import carriage_look, drawing, legend_beside, write_instead


@checked
def rail_damage(life: Life, ax: Axes | None = None) -> Axes:
    """Damage per metre of rail over x, of all carriages that pass, as a share of the life per 1000 km of travel.

    A pale area is the metre of each rail with the largest damage, which fails first.
    """
    with drawing(ax, 9.0, 3.6) as ax:
        if not life.places:
            return write_instead(ax, "the position of the cart is unknown")
        per_travel = 1e6 / life.distance  # records in 1000 km
        for index, place in enumerate(life.places):
            color, dash = carriage_look(index)
            start, end, share = place.worst_window()
            label = f"{place.rail}: {100 * share:.0f} % from {start:.2f} to {end:.2f} m"
            height = np.append(place.density, place.density[-1:]) * per_travel
            ax.step(place.edges, height, where="post", color=color, linestyle=dash, label=label)
            ax.axvspan(start, end, color=color, alpha=0.08, linewidth=0)
        ax.set_ylim(bottom=0.0)
        ax.set(xlabel="x from L at the start of the record [m]", ylabel="damage per metre in 1000 km [1/m]")
        ax.set_title("Fatigue damage along the rails", parse_math=False)
        legend_beside(ax, "rail")
    return ax
