"""A trace and its smoothing: samples, motion and bandwidth, for a report and a picture of the trace alone."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from guideload.base.arrays import Array, errors_name
from guideload.base.units import factor
from guideload.machine.drive import Drive
from guideload.machine.machine import Machine
from guideload.machine.modes import Modes
from guideload.motion.resolution import TraceResolution
from guideload.motion.stamps import usable_bandwidth
from guideload.smoothing.estimation import MotionEstimate
from guideload.smoothing.smoothing import Kind, Kinematics, Method, smooth
from guideload.traces.reading import Trace


@dataclass(frozen=True, eq=False)
class Inspection:
    """A trace and the motion that the smoothing estimates from it.

    trace       as read
    machine     with whose modes the trace is compared, or None
    kind        of the samples for the smoothing: "position" or "velocity"
    value       (n,) samples: m or m/s of the cart; rad/s of the motor if there is no [drive] to convert them
    quantum     smallest change of the value, 0 if unknown
    of_motor    whether this is the motion of the motor, with accelerations in rad/s2, not of the cart in m/s2
    kinematics  position, velocity and acceleration by the smoothing, in the units of the value
    """

    trace: Trace
    machine: Machine | None
    kind: Kind
    value: Array
    quantum: float
    of_motor: bool
    kinematics: Kinematics

    def __repr__(self) -> str:
        return f"<Inspection of {self.trace!r}>"

    @classmethod
    def of(
        cls,
        trace: Trace,
        machine: Machine | None = None,
        *,
        drive: Drive | None = None,
        smoothing: Method = "auto",
        window: float | None = None,
    ) -> Inspection:
        """Smooth a trace, as `motion_from_trace` does but across long gaps; see `smoothing.smooth`. Raises TraceError.

        A motor speed is converted to the cart's by `drive`, by default the [drive] of the machine, if it has one.
        """
        if drive is None and machine is not None:
            drive = machine.drive
        of_motor = trace.kind == "motor_speed" and drive is None
        kind, value, quantum = trace.samples(drive)
        with errors_name(trace.source):
            kinematics = smooth(trace.time, value, kind, smoothing, quantum=quantum, window=window)
        return cls(trace, machine, kind, value, quantum, of_motor, kinematics)

    @property
    def time(self) -> Array:
        """(n,) s."""
        return self.trace.time

    @property
    def step(self) -> float:
        """Median time between samples [s]."""
        return float(np.median(np.diff(self.time)))

    @property
    def smoothed(self) -> Array:
        """(n,) the samples as smoothed, in their unit."""
        return self.kinematics.position if self.kind == "position" else self.kinematics.velocity

    @property
    def deviation(self) -> Array | None:
        """(n,) standard deviation of the acceleration in its unit; None where the smoothing estimates none."""
        estimate = self.kinematics
        if not isinstance(estimate, MotionEstimate):
            return None
        return np.sqrt(np.maximum(estimate.acceleration_variance, 0.0))

    @cached_property
    def differences(self) -> Array:
        """(n,) acceleration by plain differences of the samples, in its unit."""
        return smooth(self.time, self.value, self.kind, "differences").acceleration

    @property
    def bandwidth(self) -> float:
        """Bandwidth [Hz] up to which the trace shows accelerations; inf if they are known exactly."""
        return usable_bandwidth(self.time, self.kinematics.bandwidth)

    @property
    def peak(self) -> int:
        """Index of the largest acceleration."""
        return int(np.abs(self.kinematics.acceleration).argmax())

    @cached_property
    def resolution(self) -> TraceResolution | None:
        """Resolution of the trace for the machine; None without a machine, or for the motion of the motor."""
        if self.machine is None or self.of_motor:
            return None
        modes, acceleration = Modes.of(self.machine), self.kinematics.acceleration
        return TraceResolution.of(self.machine, modes, self.time, acceleration, self.bandwidth, self.step)

    @property
    def unit(self) -> tuple[str, float]:
        """Unit in which samples are shown, and the factor from `value` to it."""
        if self.of_motor:
            return "rpm", 1.0 / factor("rpm", "rad/s")
        return ("m" if self.kind == "position" else "m/s"), 1.0

    @property
    def acceleration_unit(self) -> str:
        """Unit in which accelerations are shown, in plain letters."""
        return "rad/s2" if self.of_motor else "m/s2"
