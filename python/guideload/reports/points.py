"""The part of a run's report on the points of the machine: sag, peaks, settling."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from rich.console import RenderableType
from rich.text import Text

from guideload.base.number_text import counted, milliseconds
from guideload.reports.elements import new_table, remark, section

if TYPE_CHECKING:
    from guideload.simulation.point_motion import Settling
    from guideload.simulation.result import Result

DEFINITIONS = (
    "Displacement relative to the carriage frame, which travels with the drive. Sag: its size at rest. Peaks: largest "
    "distance from the place at rest, and |x|, |y|, |z| of it; largest speed and acceleration in the carriage frame; "
    "abs. acc.: with the acceleration of the cart, as a sensor on the body measures it."
)
SETTLING = (
    "Settling: from the last acceleration of a move until the point stays within its window around the place at rest, "
    "which process forces shift."
)


def points_section(result: Result) -> list[RenderableType]:
    """Sag, peaks and settling of the points; empty without points."""
    if not result.machine.points:
        return []
    headings = (
        "sag\num",
        "peak\num",
        "at\ns",
        "|x|\num",
        "|y|\num",
        "|z|\num",
        "speed\nmm/s",
        "acc.\nm/s2",
        "abs. acc.\nm/s2",
    )
    table = new_table("point", *headings)
    columns = result.point_columns
    lengths = ("sag_m", "peak_m", "peak_x_m", "peak_y_m", "peak_z_m")
    for i, point in enumerate(result.machine.points):
        sag, peak, *along = (three_digits(1e6 * columns[name][i]) for name in lengths)
        speed = three_digits(1e3 * columns["peak_velocity_m_s"][i])
        rates = (
            three_digits(columns[f"peak_{name}_m_s2"][i])
            for name in ("acceleration", "absolute_acceleration")
        )
        table.add_row(
            Text(point.name), sag, peak, f"{columns['time_of_peak_s'][i]:.3f}", *along, speed, *rates
        )
    notes = [DEFINITIONS]
    if "band_method" in result.quantities.attrs:
        notes.append(
            "The motion of the points has no credible band: it is that of the estimated acceleration."
        )
    return [*section("Motion of the points"), table, *settling_parts(result), *remark(*notes)]


def settling_parts(result: Result) -> list[RenderableType]:
    """A table of the settling times of the points with a window; empty without one, or without moves."""
    found = [one for one in result.settling() if one.spans]
    if not found:
        return []
    table = new_table("point", "window\num", "moves\n", "longest\nms", "after\ns", "median\nms")
    for one in found:
        known = np.flatnonzero(np.isfinite(one.time))
        row = ["", "", ""]
        if known.size:
            worst = int(known[one.time[known].argmax()])
            median = float(np.median(one.time[known]))
            row = [milliseconds(one.time[worst]), f"{one.spans[worst].end:.3f}", milliseconds(median)]
        table.add_row(Text(one.point), three_digits(1e6 * one.window), str(len(one.spans)), *row)
    return [table, *remark(SETTLING, *filter(None, map(_not_settled, found)))]


def _not_settled(one: Settling) -> str:
    late = np.flatnonzero(np.isnan(one.time))
    if not late.size:
        return ""
    return (
        f"{one.point} is not seen to settle after {counted(late.size, 'move')}, the first of which ends at "
        f"{one.spans[late[0]].end:.3f} s: the next move or the end of the record comes first."
    )


def three_digits(value: float) -> str:
    """A number with three digits, without an exponent."""
    size = abs(value)
    return f"{value:.{0 if size >= 100 else 1 if size >= 10 else 2 if size >= 1 else 3}f}"
