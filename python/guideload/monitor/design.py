"""The monitor of a machine: its constants, and the smoother that suits a motion.

The smoother has one free number, its time constant: a short one passes noise of the encoder on to the loads, a long one
rounds off the jerks that make the machine vibrate. Candidates are tried with the monitor itself, on the counts that the
encoder would show for a typical motion, and the one with the smallest error of the peak loads is taken.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from guideload._core import Monitor
from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError, SceneError
from guideload.life.criteria import Criteria, criteria_of
from guideload.life.equivalent_load import EquivalentLoad
from guideload.machine.machine import Machine
from guideload.monitor.estimator import taps_of
from guideload.monitor.settings import MonitorSettings
from guideload.motion.motion import Motion
from guideload.simulation.simulation import simulate

ORDERS = (3, 5)
TIME_CONSTANTS = (1.0, 1.5, 2.0, 2.2, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 8.0, 11.0, 15.0)  # samples
PHASES = (0.0, 0.3, 0.6)  # counts by which the encoder is shifted: its rounding is another one each time
MOST_CARRIAGES = 16


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
        """A new monitor. `push(stamps, counts)` takes arrays of uint32."""
        return monitor_of(self.machine, self.settings, self.taps)


def designed(machine: Machine, motion: Motion, settings: MonitorSettings) -> Design:
    """The monitor of a machine, for motions like this one.

    Raises SceneError for a machine that is not linear, whose rack pushes, or without carriages; ArgumentError for a
    motion that does not move the cart.
    """
    _require_supported(machine)
    path = SampledPath.of(machine, motion, settings)
    best: Design | None = None
    for order in ORDERS:
        for time_constant in TIME_CONSTANTS:
            taps = taps_of(order, time_constant, settings.lag)
            errors = [path.errors(monitor_of(machine, settings, taps), settings, phase) for phase in PHASES]
            peak, load = (max(column) for column in zip(*errors, strict=True))
            if best is None or peak < best.peak_error:
                best = Design(machine, settings, order, time_constant, taps, peak, load)
    assert best is not None
    return best


def monitor_of(machine: Machine, settings: MonitorSettings, taps: Array) -> Monitor:
    """The monitor of a machine with this smoother."""
    _require_supported(machine)
    rated = {}
    if any(
        product is not None and product.dynamic and product.static for product in machine.product_of_carriage
    ):
        rated = {one.index: one for one in criteria_of(machine, machine.life)}
    rules = [_judged(rated.get(index), settings) for index in range(len(machine.carriages))]
    exponents = {exponent for _, exponent in rules}
    if len(exponents) > 1:
        raise SceneError(
            "monitor: the carriages have balls and rollers; a monitor has one exponent of the life"
        )
    return Monitor(
        machine.scene,
        groups=machine.links_of_carriages,
        centers=machine.carriage_places,
        judged=[judged for judged, _ in rules],
        period=settings.period,
        quantum=settings.quantum,
        input=settings.of_core,
        taps=taps,
        lag=settings.lag,
        roller=exponents == {10.0 / 3.0},
    )


Judged = tuple[tuple[Array, float, float, str], float, float, float]


def _judged(criteria: Criteria | None, settings: MonitorSettings) -> tuple[Judged, float]:
    """Rule, limit, bin and capacity of a carriage, and its exponent. Without ratings: |Fy| + |Fz|, and no life."""
    if criteria is None:
        weights = np.zeros((2, 5, 2))
        weights[0, :2] = 1.0
        return (EquivalentLoad(weights, 1.0).of_core, settings.limit, settings.bin, 0.0), 3.0
    for axis in criteria.rule.missing:
        raise criteria.unrated(axis, f"may carry a {axis} moment")
    capacity = float(criteria.life_under(1.0))  # of 1 N, so it is life times load^p
    return (criteria.rule.of_core, settings.limit, settings.bin, capacity), criteria.rating.exponent


def _require_supported(machine: Machine) -> None:
    """Refuse what a monitor does not compute."""
    machine.require_no_payloads("a load monitor")
    if not machine.has_straight_rails:
        raise SceneError(
            "monitor: a rail is not straight, which a monitor does not know; leave its profile out"
        )
    if not 1 <= len(machine.carriages) <= MOST_CARRIAGES:
        got = len(machine.carriages)
        raise SceneError(f"monitor: expected 1 to {MOST_CARRIAGES} carriages, got {got}")
    if machine.model_level != "linear":
        raise SceneError(
            f"monitor: the machine is {machine.model_level}; contact changes would take a number of "
            "operations that has no bound. Give every carriage and link a single stiffness, such as the slope of its "
            "curve at the working load"
        )
    if machine.drive is not None and machine.drive.pressure_angle is not None:
        raise SceneError(
            "monitor: drive.pressure_angle: the push of the rack is not part of a monitor; leave it out of the file"
        )


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
        grid: Array = start + settings.period * np.arange(steps + 1, dtype=np.float64)
        position = _position(motion, grid)
        if grid.size < 8 or float(np.ptp(position)) < 100.0 * abs(settings.quantum):
            raise ArgumentError(
                "monitor: the motion needs at least 8 samples and a travel of 100 counts, got "
                f"{grid.size} samples and {float(np.ptp(position)):.3g} m"
            )
        loads = simulate(machine, motion, times=np.minimum(grid, end)).carriage_loads[..., 1:]
        return cls(position, loads)

    def errors(self, monitor: Monitor, settings: MonitorSettings, phase: float) -> tuple[float, float]:
        """Largest relative error of a peak resultant, and rms error of the loads [N], from the counts of an encoder."""
        constants = monitor.constants()
        before = int(constants["settling"]) + int(constants["tap_count"]) + 4
        steady = np.pad(self.position, (before, settings.lag), mode="edge")
        counts = np.round(steady / settings.quantum + phase).astype(np.int64)
        stamps = (np.arange(counts.size) * settings.ticks).astype(np.uint32)
        wrapped = (counts & (2**settings.counter_bits - 1)).astype(np.uint32)
        _, _, loads = monitor.push(stamps, wrapped)
        found = loads[before + settings.lag :]
        peaks = [np.hypot(each[..., 0], each[..., 1]).max(axis=0) for each in (found, self.loads)]
        rms = float(np.sqrt(np.mean(np.square(found[..., :2] - self.loads[..., :2]))))
        return float(np.abs(peaks[0] / peaks[1] - 1.0).max()), rms


def _position(motion: Motion, instants: Array) -> Array:
    """Travel (m,) along x since the start, exact for the acceleration, which is linear between stamps."""
    time, acceleration = motion.time, motion.acceleration[:, 0]
    step = np.diff(time)
    start = 0.0 if motion.velocity is None else float(motion.velocity[0, 0])
    velocity = start + np.concatenate([[0.0], np.cumsum(step * (acceleration[1:] + acceleration[:-1]) / 2.0)])
    change = step * velocity[:-1] + step**2 * (2.0 * acceleration[:-1] + acceleration[1:]) / 6.0
    travel = np.concatenate([[0.0], np.cumsum(change)])
    at = np.clip(np.searchsorted(time, instants, side="right") - 1, 0, step.size - 1)
    since = instants - time[at]
    jerk = np.diff(acceleration)[at] / np.where(step[at] > 0.0, step[at], 1.0)
    return np.asarray(
        travel[at] + since * (velocity[at] + since * (acceleration[at] / 2.0 + since * jerk / 6.0))
    )
