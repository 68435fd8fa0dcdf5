"""The report of a trace: its samples, its smoothing, and the modes of a machine that it shows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from rich.console import RenderableType

from guideload.base.number_text import counted
from guideload.motion.uncertainty import COVER
from guideload.reports.elements import WIDTH, new_table, remark, section, to_text
from guideload.smoothing.estimation import Estimate

if TYPE_CHECKING:
    from guideload.motion.resolution import TraceResolution
    from guideload.traces.inspection import Inspection

DEFINITIONS = (
    "Share of response: part of the static link loads under an acceleration along x that is in the mode. "
    "Ringing shown: the trace shows a sudden change as a ramp; ringing of the mode after the ramp over ringing after "
    "the sudden change. Hidden: increase of the dynamic load if the largest change that may have been sudden was "
    "sudden; an upper bound for a single change, with nominal stiffness of the links."
)
# Motions by the order of the derivative of position that is white noise.
MOVES = {3: "acceleration that jumps", 4: "jerk that jumps", 5: "smooth moves", 6: "moves that ring"}
NO_DRIVE = (
    "Note: the machine has no [drive] (gear_ratio, and pinion_diameter or screw_lead) to convert the speed of the "
    "motor to that of the cart: the figures are those of the motor, and the modes are not compared."
)


def encoder_report(inspection: Inspection, width: int = WIDTH, encoding: str = "utf-8") -> str:
    """The report of a trace: samples, smoothing, largest values, and the modes that it shows."""
    trace, time, step = inspection.trace, inspection.time, inspection.step
    parts: list[RenderableType] = [
        f"{trace.source}, column {trace.column}",
        *section("Trace"),
        f"{np.ptp(time):.4g} s, {time.size} samples at {1 / step:.4g} Hz, a sample every {1e3 * step:.4g} ms",
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
    """The modes of a machine that a trace shows, as text."""
    return to_text(resolution_parts(resolution), width, encoding)


def resolution_parts(resolution: TraceResolution) -> list[RenderableType]:
    """A row per mode: whether it is within the bandwidth, share of the response, ringing that the trace shows."""
    parts: list[RenderableType] = section("Modes against the trace's band")
    if np.isinf(resolution.bandwidth):
        return [*parts, resolution.text]
    table = new_table("mode", "natural\nHz", "in the\nband", "share of\nresponse %", "ringing\nshown %")
    table.add_column("moves mostly in")
    for mode, frequency in enumerate(resolution.frequency):
        is_excited = bool(resolution.participating[mode])
        table.add_row(
            str(mode + 1),
            f"{float(frequency):.4g}",
            "yes" if frequency <= resolution.bandwidth else "no",
            f"{100 * float(resolution.participation[mode]):.2g}" if is_excited else "0",
            f"{100 * float(resolution.ringing[mode]):.2g}" if is_excited else "",
            ", ".join(resolution.moving[mode]),
        )
    return [
        *parts,
        table,
        f"band: {resolution.text}",
        "",
        *remark(*resolution.warnings(), DEFINITIONS),
    ]


def _smoothing_lines(inspection: Inspection) -> list[str]:
    """Model, noise, bandwidth and jumps that the smoothing estimated, or its note if it estimates no noise."""
    estimate = inspection.kinematics
    if not isinstance(estimate, Estimate):
        return [estimate.note.replace("m/s", "rad/s") if inspection.of_motor else estimate.note]
    if not np.any(estimate.acceleration):
        return [estimate.note]
    unit, factor = inspection.unit
    noise = f"noise {factor * estimate.noise:.3g} {unit} rms before rounding"
    rounding = inspection.quantum / np.sqrt(12.0)
    if rounding:
        share = estimate.noise / rounding
        noise += f", {share:.3g} times the rounding noise of the quantum, {factor * rounding:.3g} {unit}"
    else:
        noise += "; the quantum is unknown"
    length = float(np.diff(estimate.jumps, axis=1).sum())
    point = "drive's position" if estimate.oscillation else "position"
    jumps = f"jumps in {counted(len(estimate.jumps), 'place')}, {length:.3g} s in all"
    return [
        f"white noise model of derivative {estimate.order} of the {point} ({MOVES[estimate.order]}), chosen by "
        "likelihood; its density varies along the trace",
        *(
            [f"the axis follows its drive as an oscillator of {estimate.oscillation}"]
            if estimate.oscillation
            else []
        ),
        noise,
        f"bandwidth at sudden changes {estimate.bandwidth:.3g} Hz; half the sampling rate is "
        f"{0.5 / inspection.step:.4g} Hz",
        jumps if estimate.jumps.size else "no jumps",
        *([f"warning: {estimate.warning}"] if estimate.warning else []),
    ]


def _largest_lines(inspection: Inspection) -> list[str]:
    """Largest speed and acceleration, with the 95 % credible band if it is estimated."""
    unit, at = inspection.acceleration_unit, inspection.peak
    speed = inspection.unit[1] * float(np.abs(inspection.kinematics.velocity).max())
    largest_speed = f"largest speed {speed:.4g} {'rpm' if inspection.of_motor else 'm/s'}"
    acceleration = float(inspection.kinematics.acceleration[at])
    if not acceleration:
        return [f"{largest_speed}, no acceleration"]
    largest = f"largest acceleration {acceleration:.4g} {unit} at {inspection.time[at]:.4g} s"
    if inspection.deviation is None:
        return [largest_speed, f"{largest}; this method estimates no band"]
    half = COVER * inspection.deviation
    band = f"95 % band {acceleration - half[at]:.4g} to {acceleration + half[at]:.4g}"
    return [largest_speed, f"{largest}, {band}; its median is +-{float(np.median(half)):.2g}"]
