"""The report of a trace: its samples, its smoothing, and the modes of a machine that it shows."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from guideload.audit.motion_plausibility import plausible_motion, resolution_warnings
from guideload.base.number_text import counted, digits, milliseconds
from guideload.motion.resolution import TraceResolution
from guideload.motion.uncertainty import COVER
from guideload.reports.report import Column, Definitions, Report, Section, Table, known_or_empty
from guideload.smoothing.estimation import MotionEstimate, noise_warnings
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
    "Warning: the machine has no [drive] (gear_ratio, and pinion_diameter, pulley_diameter or screw_lead) to convert "
    "the speed of the motor to that of the cart (or --ratio): the figures are those of the motor, and the modes are "
    "not compared."
)


def encoder_report(inspection: Inspection) -> Report:
    """The report of a trace: samples, smoothing, largest values, and the modes that it shows."""
    trace, time, step = inspection.trace, inspection.time, inspection.step
    sampled = f"{time.size} samples at {digits(1 / step, 4)} Hz, a sample every {milliseconds(step, 4)} ms"
    modes = [] if inspection.resolution is None else [resolution_section(inspection.resolution)]
    no_drive = inspection.resolution is None and inspection.machine is not None
    return Report(
        title=f"Trace {trace.source}",
        answer=[f"{trace.source}, column {trace.column}: {', '.join(_largest_lines(inspection))}."],
        warnings=[*trace_warnings(inspection), *([NO_DRIVE] if no_drive else [])],
        sections=[
            Section("Trace", [f"{digits(np.ptp(time), 4)} s, {sampled}", *trace.notes]),
            Section("From samples to acceleration", _smoothing_lines(inspection)),
            *modes,
        ],
    )


def trace_warnings(inspection: Inspection) -> Iterator[str]:
    """Of the samples, of the motion that the smoothing estimates, and of the load that it may hide."""
    trace, found = inspection.trace, inspection.kinematics
    if not inspection.of_motor:
        acceleration, speed, place = (
            each[:, None] for each in (found.acceleration, found.velocity, found.position)
        )
        source = f"{trace.source}, column {trace.column}"
        yield from plausible_motion(inspection.time, acceleration, speed, place, source)
    yield from (*trace.warnings, *noise_warnings(found), *resolution_warnings(inspection.resolution))


def resolution_section(resolution: TraceResolution) -> Section:
    """A row per mode: whether it is within the bandwidth, share of the response, ringing that the trace shows."""
    title, limit = "Modes against the trace's band", resolution.bandwidth
    if np.isinf(limit):
        return Section(title, resolution.text)
    is_excited = resolution.participating
    shares = 100.0 * np.where(is_excited, resolution.participation, 0.0)
    rings = known_or_empty(100.0 * np.where(is_excited, resolution.ringing, np.nan))
    table = Table(
        Column("mode", [str(mode + 1) for mode in range(len(resolution.frequency))]),
        Column("natural", resolution.frequency, "Hz", "4 digits"),
        Column("in the band", np.where(resolution.frequency <= limit, "yes", "no").tolist(), kind="whole"),
        Column("share of response", shares, "%", "2 digits"),
        Column("ringing shown", rings, "%", "2 digits"),
        Column("moves mostly in", [", ".join(dofs) for dofs in resolution.moving]),
    )
    return Section(title, table, f"band: {resolution.text}", Definitions(DEFINITIONS))


def _smoothing_lines(inspection: Inspection) -> list[str]:
    """Model, noise, bandwidth and jumps that the smoothing estimated, or its note if it estimates no noise."""
    estimate = inspection.kinematics
    if not isinstance(estimate, MotionEstimate):
        return [estimate.note.replace("m/s", "rad/s") if inspection.of_motor else estimate.note]
    if not np.any(estimate.acceleration):
        return [estimate.note]
    unit, factor = inspection.unit
    noise = f"noise {digits(factor * estimate.noise)} {unit} rms before rounding"
    rounding = inspection.quantum / np.sqrt(12.0)
    if rounding:
        share = estimate.noise / rounding
        quantum = f"{digits(factor * rounding)} {unit}"
        noise += f", {digits(share)} times the rounding noise of the quantum, {quantum}"
    else:
        noise += "; the quantum is unknown"
    oscillator = []
    if estimate.oscillation:
        oscillator = [f"the axis follows its drive as an oscillator of {estimate.oscillation}"]
    length = float(np.diff(estimate.jumps, axis=1).sum())
    point = "drive's position" if estimate.oscillation else "position"
    jumps = f"sudden changes in {counted(len(estimate.jumps), 'place')}, {digits(length)} s in all"
    return [
        f"white noise model of derivative {estimate.order} of the {point} ({MOVES[estimate.order]}), chosen by "
        "likelihood; its density varies along the trace",
        *oscillator,
        noise,
        f"bandwidth at sudden changes {digits(estimate.bandwidth)} Hz; half the sampling rate is "
        f"{digits(0.5 / inspection.step, 4)} Hz",
        jumps if estimate.jumps.size else "no sudden changes",
    ]


def _largest_lines(inspection: Inspection) -> list[str]:
    """Largest speed and acceleration, with the 95 % credible band if it is estimated."""
    unit, at = inspection.acceleration_unit, inspection.peak
    speed = inspection.unit[1] * float(np.abs(inspection.kinematics.velocity).max())
    largest_speed = f"largest speed {digits(speed, 4)} {'rpm' if inspection.of_motor else 'm/s'}"
    acceleration = float(inspection.kinematics.acceleration[at])
    if not acceleration:
        return [f"{largest_speed}, no acceleration"]
    largest = f"largest acceleration {digits(acceleration, 4)} {unit} at {digits(inspection.time[at], 4)} s"
    if inspection.deviation is None:
        return [largest_speed, f"{largest}; this method estimates no band"]
    half = COVER * inspection.deviation
    band = f"95 % band {digits(acceleration - half[at], 4)} to {digits(acceleration + half[at], 4)}"
    return [
        largest_speed,
        f"{largest}, {band}; half width of the band, median over the trace: "
        f"{digits(float(np.median(half)), 2)} {unit}",
    ]
