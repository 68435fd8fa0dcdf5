"""The monitor of a machine: its constants, and the smoother that suits a motion.

The smoother has one free number, its time constant: a short one passes noise of the encoder on to the loads, a long one
rounds off the jerks that make the machine vibrate. Candidates are tried with the monitor itself, on the counts that the
encoder would show for a typical motion, and the one with the smallest error of the peak loads is taken.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError, shortened
from guideload.machine.machine import Machine
from guideload.monitor.estimator import filter_taps
from guideload.monitor.monitor import Monitor, require_supported
from guideload.monitor.settings import MonitorSettings
from guideload.motion.motion import Motion
from guideload.motion.travel import travel_at, travel_of
from guideload.simulation.simulation import simulate

ORDERS = (3, 5)
TIME_CONSTANTS = (1.0, 1.5, 2.0, 2.2, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 8.0, 11.0, 15.0)  # samples
MOST_SAMPLES = 200_000  # of the motion: the choice of the smoother then takes half a minute
# Counts by which the encoder is shifted, so that it rounds otherwise.
PHASES = tuple(k / 10.0 for k in range(10))


@dataclass(frozen=True, eq=False)
class Design:
    """The monitor of a machine with the smoother that was chosen.

    machine, settings     as given
    order, time_constant  of the smoother; the time constant in samples
    taps                  weights of the smoother, see `monitor.estimator`
    peak_error            largest relative error of a carriage's peak y-z resultant on the motion, over the phases
    load_error            N, rms error of the loads Fy, Fz on the motion
    """

    machine: Machine
    settings: MonitorSettings
    order: int
    time_constant: float
    taps: Array
    peak_error: float
    load_error: float

    def monitor(self) -> Monitor:
        """A new monitor, without samples."""
        return Monitor(self.machine, self.settings, self.taps)

    @property
    def title(self) -> list[str]:
        """What was designed, and how exact it is on the motion, in lines for the head of a file."""
        settings = self.settings
        return [
            f"Load monitor of {shortened(self.machine.name)}, written by `guideload monitor build`.",
            f"Period {settings.period:g} s, {settings.travel_per_count:g} m per count, lag {settings.lag} samples.",
            f"Smoother of order {self.order}, time constant {self.time_constant:g} samples; "
            f"peak loads on the given motion within {100 * self.peak_error:.1f} %.",
        ]


def designed(machine: Machine, motion: Motion, settings: MonitorSettings) -> Design:
    """The monitor of a machine, for motions like this one.

    Raises SceneError for a machine that is not linear, whose rack pushes, or without carriages; ArgumentError for a
    motion that does not move the cart.
    """
    require_supported(machine)
    path = SampledPath.of(machine, motion, settings)
    best: Design | None = None
    for order in ORDERS:
        for time_constant in TIME_CONSTANTS:
            taps = filter_taps(order, time_constant, settings.lag)
            errors = [path.errors(Monitor(machine, settings, taps), phase) for phase in PHASES]
            peak, load = (max(column) for column in zip(*errors, strict=True))
            if best is None or peak < best.peak_error:
                best = Design(machine, settings, order, time_constant, taps, peak, load)
    assert best is not None
    return best


@dataclass(frozen=True, eq=False)
class SampledPath:
    """A motion at the samples of a controller, with standstill around it, and its loads.

    position (n,) m; loads (n, carriages, 5): Fy, Fz, Mx, My, Mz.
    """

    position: Array
    loads: Array

    @classmethod
    def of(cls, machine: Machine, motion: Motion, settings: MonitorSettings) -> SampledPath:
        """The motion sampled with the period of the settings. Raises ArgumentError if the cart does not move."""
        start, end = float(motion.time[0]), float(motion.time[-1])
        steps = math.floor((end - start) / settings.period)
        if steps >= MOST_SAMPLES:
            raise ArgumentError(
                f"period: the motion has {steps:.4g} samples of {settings.period:g} s, at most {MOST_SAMPLES} are "
                "tried with every smoother; give a part of the motion with its fastest moves, or check the period"
            )
        grid: Array = start + settings.period * np.arange(steps + 1, dtype=np.float64)
        begin = 0.0 if motion.velocity is None else float(motion.velocity[0, 0])
        moved = travel_at(motion.time, travel_of(motion.excitation), grid)[:, 0]
        position = moved + begin * (grid - start)
        if grid.size < 8 or float(np.ptp(position)) < 100.0 * abs(settings.travel_per_count):
            raise ArgumentError(
                "monitor: the motion needs at least 8 samples and a travel of 100 counts, got "
                f"{grid.size} samples and {float(np.ptp(position)):.3g} m"
            )
        loads = simulate(machine, motion, times=np.minimum(grid, end)).carriage_loads[..., 1:]
        return cls(position, loads)

    def errors(self, monitor: Monitor, phase: float) -> tuple[float, float]:
        """Largest relative error of a peak resultant, and rms error of the loads [N], from the counts of an encoder."""
        constants, settings = monitor.constants(), monitor.settings
        before = int(constants["settling"]) + int(constants["tap_count"]) + 4
        steady = np.pad(self.position, (before, settings.lag), mode="edge")
        counts = np.round(steady / settings.travel_per_count + phase).astype(np.int64)
        _, _, loads = monitor.push(np.arange(counts.size) * settings.ticks, counts)
        found = loads[before + settings.lag :]
        peaks = [np.hypot(each[..., 0], each[..., 1]).max(axis=0) for each in (found, self.loads)]
        rms = float(np.sqrt(np.mean(np.square(found[..., :2] - self.loads[..., :2]))))
        return float(np.abs(peaks[0] / peaks[1] - 1.0).max()), rms
