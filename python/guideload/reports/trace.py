"""A trace as text: what was read, what the smoothing chose, and which modes of a machine it shows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from rich.console import RenderableType

from guideload.motion.uncertainty import COVER
from guideload.reports.elements import WIDTH, new_table, remark, section, to_text
from guideload.smoothing.estimation import Estimate

if TYPE_CHECKING:
    from guideload.motion.resolution import TraceResolution
    from guideload.traces.inspection import Inspection

BAND_DEFINITIONS = (
    "Share: of the links' static answer to an acceleration along x, the part in the mode. "
    "Ringing shown: what is left of it after a sudden change, which the trace shows as a ramp. Hidden: by how much "
    "the dynamic load after the largest change that may have been sudden is higher if it was: an upper bound for a "
    "single change, by the nominal stiffness of the links."
)
# What moves are made of whose position has a white derivative of that order.
MOVES = {3: "acceleration that jumps", 4: "jerk that jumps", 5: "smooth moves", 6: "moves that ring"}
NO_DRIVE = (
    "Note: the machine has no [drive] with gear_ratio and pinion_diameter or screw_lead to tell the cart's speed from "
    "the motor's: the figures are the motor's, and the modes are not compared."
)


def encoder_report(inspection: Inspection, width: int = WIDTH, encoding: str = "utf-8") -> str:
    """What was found in a trace."""
    trace = inspection.trace
    parts: list[RenderableType] = [
        f"{trace.source}, column {trace.column}",
        *section("Trace"),
        *_extent_lines(inspection),
        *trace.notes,
        *section("From samples to acceleration"),
        *_smoothing_lines(inspection),
        *_largest_lines(inspection),
    ]
    if inspection.resolution is not None:
        parts += resolution_parts(inspection.resolution)
    elif inspection.machine is not None:
        parts += ["", *remark(NO_DRIVE)]
    return to_text(parts, width, encoding)


def resolution_report(resolution: TraceResolution, width: int = WIDTH, encoding: str = "utf-8") -> str:
    """The band of a trace against the modes of a machine."""
    return to_text(resolution_parts(resolution), width, encoding)


def resolution_parts(resolution: TraceResolution) -> list[RenderableType]:
    """A row per mode: whether the trace's band holds it, whether x excites it, and what is left of its ringing."""
    found = resolution
    parts: list[RenderableType] = section("Modes against the trace's band")
    if np.isinf(found.bandwidth):
        return [*parts, found.text]
    table = new_table("mode", "natural\nHz", "in the\nband", "share of\nanswer %", "ringing\nshown %")
    table.add_column("moves mostly in")
    for mode, frequency in enumerate(found.frequency):
        taking_part = bool(found.participating[mode])
        table.add_row(
            str(mode + 1),
            f"{float(frequency):.4g}",
            "yes" if frequency <= found.bandwidth else "no",
            f"{100 * float(found.participation[mode]):.2g}" if taking_part else "0",
            f"{100 * float(found.ringing[mode]):.2g}" if taking_part else "",
            ", ".join(found.moving[mode]),
        )
    return [*parts, table, f"band: {found.text}", "", *remark(*found.warnings(), BAND_DEFINITIONS)]


def _extent_lines(inspection: Inspection) -> list[str]:
    time, step = inspection.time, inspection.step
    rate = f"{1 / step:.4g} Hz, a sample every {1e3 * step:.4g} ms"
    return [f"{np.ptp(time):.4g} s, {time.size} samples at {rate}"]


def _smoothing_lines(inspection: Inspection) -> list[str]:
    """What was chosen; of a method that estimates no noise its own note."""
    estimate = inspection.found
    if not isinstance(estimate, Estimate):
        note = estimate.note
        return [note.replace("m/s", "rad/s") if inspection.of_motor else note]
    if not np.any(inspection.found.acceleration):
        return [estimate.note]
    return [
        f"white derivative {estimate.order} of the position, as of {MOVES[estimate.order]}, by likelihood; adapted "
        "along the trace",
        _noise_line(inspection, estimate),
        f"sudden changes are followed up to {inspection.found.bandwidth:.3g} Hz; half the samples' rate is "
        f"{0.5 / inspection.step:.4g} Hz",
        _jumps_line(estimate),
        *([f"warning: {estimate.warning}"] if estimate.warning else []),
    ]


def _noise_line(inspection: Inspection, estimate: Estimate) -> str:
    unit, factor = inspection.unit
    told = f"noise {factor * estimate.noise:.3g} {unit} rms before rounding"
    floor = inspection.quantum / np.sqrt(12.0)
    if not floor:
        return f"{told}; no quantum is known to compare with"
    return f"{told}, {estimate.noise / floor:.3g} times that of rounding to the quantum, {factor * floor:.3g} {unit}"


def _jumps_line(estimate: Estimate) -> str:
    count = len(estimate.jumps)
    if not count:
        return "no jumps"
    longest = float(np.diff(estimate.jumps, axis=1).sum())
    return f"jumps in {count} {'place' if count == 1 else 'places'}, {longest:.3g} s in all"


def _largest_lines(inspection: Inspection) -> list[str]:
    """Largest speed and acceleration, with the 95 % band where one is told."""
    (_, factor), unit = inspection.unit, inspection.acceleration_unit
    speed_unit = "rpm" if inspection.of_motor else "m/s"
    acceleration, deviation = inspection.found.acceleration, inspection.deviation
    at = int(np.abs(acceleration).argmax())
    speed = factor * float(np.abs(inspection.found.velocity).max())
    if not acceleration[at]:
        return [f"largest speed {speed:.4g} {speed_unit}, no acceleration"]
    largest = f"largest acceleration {acceleration[at]:.4g} {unit} at {inspection.time[at]:.4g} s"
    if deviation is None:
        largest += "; this method tells no band"
        return [f"largest speed {speed:.4g} {speed_unit}", largest]
    low, high = (float(acceleration[at] + sign * COVER * deviation[at]) for sign in (-1, 1))
    usual = COVER * float(np.median(deviation))
    return [
        f"largest speed {speed:.4g} {speed_unit}",
        f"{largest}, 95 % band {low:.4g} to {high:.4g}; as a median it is +-{usual:.2g} wide",
    ]
