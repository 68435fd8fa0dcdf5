"""A trace as its smoothing found it: samples, motion and band, for a report and a picture of the trace alone."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from guideload.base.arrays import Array
from guideload.base.units import factor
from guideload.machine.machine import Machine
from guideload.machine.modes import Modes
from guideload.motion.resolution import TraceResolution, usable_bandwidth
from guideload.smoothing.estimation import Estimate
from guideload.smoothing.smoothing import Kind, Kinematics, Method, smooth
from guideload.traces.reading import Trace


@dataclass(frozen=True, eq=False)
class Inspection:
    """What was found in a trace.

    trace    as it was read
    machine  whose modes it is compared with, or None
    kind     "position" or "velocity": what its samples are to the smoothing
    value    (n,) samples: m or m/s of the cart; rad/s of the motor where no drive tells the cart's speed from it
    quantum  step of the value, 0 if none is known
    of_motor whether all figures are those of the motor: then accelerations are in rad/s2, not m/s2
    found    position, velocity and acceleration by the smoothing, in the units of the value
    """

    trace: Trace
    machine: Machine | None
    kind: Kind
    value: Array
    quantum: float
    of_motor: bool
    found: Kinematics

    def __repr__(self) -> str:
        return f"<Inspection of {self.trace!r}>"

    @classmethod
    def of(
        cls,
        trace: Trace,
        machine: Machine | None = None,
        *,
        smoothing: Method = "auto",
        window: float | None = None,
    ) -> Inspection:
        """Smooth a trace, as `motion_from_trace` does; see `smoothing.smooth`. Raises TraceError.

        A motor's speed becomes the cart's where the machine has a [drive], and else stays the motor's.
        """
        ratio, of_motor = 1.0, False
        if trace.kind == "motor_speed":
            drive = None if machine is None else machine.drive
            of_motor = drive is None
            ratio = 1.0 if drive is None else drive.speed_per_motor_speed
        kind, value, quantum = trace.samples(ratio)
        found = smooth(trace.time, value, kind, smoothing, quantum=quantum, window=window)
        return cls(trace, machine, kind, value, quantum, of_motor, found)

    @property
    def time(self) -> Array:
        """(n,) s."""
        return self.trace.time

    @property
    def step(self) -> float:
        """Usual distance of the samples [s]."""
        return float(np.median(np.diff(self.time)))

    @property
    def smoothed(self) -> Array:
        """(n,) what the samples are without their noise, in their unit."""
        return self.found.position if self.kind == "position" else self.found.velocity

    @property
    def deviation(self) -> Array | None:
        """(n,) standard deviation of the acceleration in its unit; None where the smoothing tells none."""
        if not isinstance(self.found, Estimate):
            return None
        return np.sqrt(np.maximum(self.found.acceleration_variance, 0.0))

    @cached_property
    def differences(self) -> Array:
        """(n,) acceleration by plain differences of the samples, in its unit."""
        return smooth(self.time, self.value, self.kind, "differences").acceleration

    @property
    def band(self) -> float:
        """Hz, up to which accelerations are shown."""
        return usable_bandwidth(self.time, self.found.bandwidth)

    @cached_property
    def modes(self) -> Modes | None:
        """The modes of the machine; None where there is none, or only the motor's motion is known."""
        return None if self.machine is None or self.of_motor else Modes.of(self.machine)

    @cached_property
    def resolution(self) -> TraceResolution | None:
        """The band against the modes of the machine; None where `modes` is."""
        if self.machine is None or self.modes is None:
            return None
        return TraceResolution.of(
            self.machine, self.modes, self.time, self.found.acceleration, self.band, self.step
        )

    @property
    def unit(self) -> tuple[str, float]:
        """Unit in which samples are shown, and its factor on `value`."""
        if self.of_motor:
            return "rpm", 1.0 / factor("rpm", "rad/s")
        return ("m" if self.kind == "position" else "m/s"), 1.0

    @property
    def acceleration_unit(self) -> str:
        """Unit in which accelerations are shown, in plain letters."""
        return "rad/s2" if self.of_motor else "m/s2"
