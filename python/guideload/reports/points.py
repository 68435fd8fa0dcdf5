"""The part of a run's report on the points of the machine: sag, peaks, settling."""

from __future__ import annotations

import numpy as np

from guideload.base.number_text import counted, seconds
from guideload.drive.requirements import is_elastic
from guideload.reports.report import Column, Definitions, Section, Table, Value
from guideload.simulation.point_motion import Settling
from guideload.simulation.result import Result

DEFINITIONS = (
    "Displacement relative to the frame that travels with the drive. Sag: its size at rest. Peaks: largest "
    "distance from the place at rest, and |x|, |y|, |z| of it; largest speed and acceleration in the travelling frame; "
    "abs. acc.: with the acceleration of the cart, as a sensor on the body measures it."
)
SETTLING = (
    "Settling: from the last acceleration of a move until the point stays within its window around the place at rest, "
    "which process forces shift."
)
RIGID = "The drive is rigid (x is held): screw, rack or belt add nothing to these times."


def points_section(result: Result) -> Section:
    """Sag, peaks and settling of the points; empty without points."""
    title = "Motion of the points"
    if not result.machine.points:
        return Section(title)
    columns = result.point_columns
    lengths = {"sag": "sag_m", "peak": "peak_m"} | {f"|{axis}|": f"peak_{axis}_m" for axis in "xyz"}
    sag, peak, *along = (
        Column(label, 1e6 * columns[name], "um", "length") for label, name in lengths.items()
    )
    table = Table(
        Column("point", [point.name for point in result.machine.points]),
        sag,
        peak,
        Column("at", columns["time_of_peak_s"], "s", "3 decimals"),
        *along,
        Column("speed", 1e3 * columns["peak_velocity_m_s"], "mm/s", "length"),
        Column("acc.", columns["peak_acceleration_m_s2"], "m/s2", "length"),
        Column("abs. acc.", columns["peak_absolute_acceleration_m_s2"], "m/s2", "length"),
    )
    settling = [one for one in result.settling() if one.spans]
    no_band = (
        "The motion of the points has no credible band: it is that of the estimated acceleration."
        if "band_method" in result.quantities.attrs
        else ""
    )
    rigid = RIGID if settling and not is_elastic(result.machine) else ""
    return Section(
        title,
        table,
        _settling_table(settling),
        rigid,
        *map(_not_settled, settling),
        Definitions(DEFINITIONS, SETTLING if settling else "", no_band),
    )


def _settling_table(found: list[Settling]) -> Table:
    """Settling times of the points with a window and moves."""
    headings = [("point",), ("window", "um", "length"), ("moves", "", "whole")]
    headings += [
        ("longest", "ms", "milliseconds"),
        ("after", "s", "3 decimals"),
        ("median", "ms", "milliseconds"),
    ]
    rows: list[tuple[Value, ...]] = []
    for one in found:
        known = np.flatnonzero(np.isfinite(one.time))
        times: tuple[Value, ...] = None, None, None
        if known.size:
            worst = int(known[one.time[known].argmax()])
            times = one.time[worst], one.spans[worst].end, float(np.median(one.time[known]))
        rows.append((one.point, 1e6 * one.window, len(one.spans), *times))
    return Table.by_rows(headings, rows)


def _not_settled(one: Settling) -> str:
    late = np.flatnonzero(np.isnan(one.time))
    if not late.size:
        return ""
    return (
        f"{one.point} is not seen to settle after {counted(late.size, 'move')}, the first of which ends at "
        f"{seconds(one.spans[late[0]].end)} s: the next move or the end of the record comes first."
    )
