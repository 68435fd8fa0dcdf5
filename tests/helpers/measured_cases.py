"""Cases of docs/measured.md: numbers identified on one part of a record, the rest predicted without fitting.

Each function takes a folder with the files of its case and gives figures for the table, and curves for its picture.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from motor_records import axis
from scipy.io import loadmat

from guideload import Inspection, Machine, Motion, motion_from_trace, read_trace
from guideload.base.arrays import Array
from guideload.base.errors import TraceError
from guideload.identification.model import parse_place
from guideload.identification.motor_force import MotorForce
from guideload.identification.result import Identification, NuisanceEstimate, UnknownEstimate, identify
from guideload.identification.sensor_log import Channel, SensorLog
from guideload.identification.uncertainty import NORMAL_QUANTILE
from guideload.identification.unknowns import UnknownTable
from guideload.machine.response import frequency_response
from guideload.traces.channels import read_channels

MASS_OF = (UnknownTable(path="body.mass"),)
# Printed with the records of EMPS: gain of the drive, and mass, friction, offset as identified by their authors.
GAIN, EMPS_MASS, EMPS_VISCOUS, EMPS_DRY, EMPS_OFFSET = 35.15065, 95.1089, 203.5034, 20.3935, -3.1648
EMPS_FIRST, EMPS_SECOND = "emps_bangbang_1kHz.csv", "DATA_EMPS_PULSES.mat"
EMPS_HALF = 12.45  # s
AFTER_PULSE = 0.1  # s
RACK_MASS, RACK_PER_TURN, RACK_GAIN = 24.7, 0.02, 200.0  # kg, m, N/V: from the scripts beside the record
RACK_BRAKES = 0.25  # s: from here on the force is predicted; the speed is largest at 0.28 s
SCREW_LEAD = 0.012  # m: table over motor at 11 Hz, to 1 %
SCREW_RATE, SCREW_PERIOD, SCREW_LINES = 2000, 2000, (11, 300)  # Hz, samples of a period, Hz of the multisine
SCREW_HIGHEST, SCREW_UP_TO = 60, 110  # Hz: of what is identified, and of what is predicted
KEYS = ("stiffness", "damping")
SCREW_RECORDS = {"first position": "DhresL_m40pR.mat", "second position": "Dhres_40n8l.mat"}
MILL_LOGS = tuple(f"experiment_{i:02d}.csv" for i in range(1, 19))


@dataclass(frozen=True, eq=False)
class Predicted:
    """Measured values (n,) at times (n,) s, those predicted for them, and half the width of the 95 % interval (n,)."""

    time: Array
    measured: Array
    value: Array
    half: Array

    @property
    def is_inside(self) -> Array:
        return abs(self.measured - self.value) <= self.half

    @property
    def inside(self) -> float:
        """Share of the measured values inside the interval."""
        return float(self.is_inside.mean())

    @property
    def rms(self) -> float:
        """Of the difference."""
        return float(np.sqrt(np.mean((self.measured - self.value) ** 2)))

    @property
    def relative(self) -> float:
        """rms of the difference over that of the measured values."""
        return self.rms / float(np.sqrt(np.mean(self.measured**2)))


def predict(found: Identification, data: MotorForce) -> Predicted:
    """A force that was not fitted, by the numbers of the one that was.

    Its variance is that of the identified numbers, by the derivatives of the prediction, plus the mean square of what
    the fit left of its own record.
    """
    objective, fitted = found.fit.objective, found.data[0]
    nuisance = found.nuisance_values(fitted)

    def differences(of: MotorForce) -> tuple[Array, Array]:
        residuals, scale = of.residuals(found.model, nuisance), of.scales
        slopes = np.hstack([residuals.by_unknowns, residuals.by_nuisance * objective.units[objective.p :]])
        return residuals.values * scale, slopes * scale[:, None]

    left, (ahead, slopes) = differences(fitted)[0], differences(data)
    variance = np.einsum("ij,jk,ik->i", slopes, found.covariance, slopes) + np.mean(left**2)
    measured = data.measured[0]
    return Predicted(data.window_time, measured, measured + ahead, NORMAL_QUANTILE * np.sqrt(variance))


def ahead(machine: Machine, fitted: MotorForce, others: MotorForce) -> tuple[Identification, Predicted]:
    found = identify(machine, MASS_OF, [fitted], starts=1)
    return found, predict(found, others)


# ---- EMPS: a ball screw axis with a load in translation, 1 kHz; Janot, Gautier and Brunot 2019


def emps_first(folder: Path) -> tuple[Machine, Motion, Array]:
    """The axis, its motion, and the force of its drive [N]."""
    file = folder / EMPS_FIRST
    force = GAIN * read_channels(file, {"u_V": None}).values[:, 0]
    machine = axis(body={"mass": 100.0, "center_of_mass": [0.0, 0.0, 0.0], "inertia": np.eye(3).tolist()})
    return machine, motion_from_trace(read_trace(file)), force


def emps_halves(folder: Path) -> tuple[Identification, Predicted]:
    """The force of the second half of the first record, by numbers from its first half."""
    machine, motion, force = emps_first(folder)
    halves = (
        MotorForce.of(machine, motion, motion.time, force, part=part)
        for part in ((-np.inf, EMPS_HALF), (EMPS_HALF, np.inf))
    )
    return ahead(machine, *halves)


def emps_pulses(folder: Path) -> tuple[Identification, Predicted, Array]:
    """The force of the second record by numbers from the first, and which values follow an edge of a pulse."""
    machine, motion, force = emps_first(folder)
    log = loadmat(folder / EMPS_SECOND, squeeze_me=True)
    second = motion_from_trace(read_trace({"t": log["t"], "q_m": log["qm"]}))
    data = MotorForce.of(machine, second, second.time, log["gtau"] * log["vir"])
    found, result = ahead(machine, MotorForce.of(machine, motion, motion.time, force), data)
    edges = log["t"][1:][np.diff(log["pulses_N"]) != 0.0]
    since = result.time[:, None] - edges
    return found, result, np.any((since > -data.windows.counts[0] * 1e-3) & (since < AFTER_PULSE), axis=1)


def emps_acceleration(folder: Path) -> tuple[Predicted, Predicted]:
    """Acceleration from the encoder with its band, against the published model under the measured force.

    The second one has the scatter of the force (printed: 2.1843 N) beside the band.
    """
    _, motion, force = emps_first(folder)
    inspection = Inspection.of(read_trace(folder / EMPS_FIRST))
    speed, band = inspection.kinematics.velocity, inspection.deviation
    assert band is not None
    model = (force - EMPS_VISCOUS * speed - EMPS_DRY * np.sign(speed) - EMPS_OFFSET) / EMPS_MASS
    moves = abs(speed) > 0.01 * abs(speed).max()
    of_band, of_both = (
        Predicted(
            motion.time[moves],
            model[moves],
            inspection.kinematics.acceleration[moves],
            NORMAL_QUANTILE * np.hypot(band, scatter)[moves],
        )
        for scatter in (0.0, 2.1843 / EMPS_MASS)
    )
    return of_band, of_both


# ---- a rack axis with a load cell in the drive, and the servo's own record on another clock; Mnich


def rack(folder: Path) -> tuple[UnknownEstimate, NuisanceEstimate, Predicted]:
    """Mass from the whole stroke, delay between the clocks, and the force of braking by numbers from speeding up."""
    body = {"mass": RACK_MASS, "center_of_mass": [0.0, 0.0, 0.0], "inertia": np.eye(3).tolist()}
    machine = axis(body=body, drive={"screw_lead": RACK_PER_TURN})
    trace = read_trace(folder / "a3MR.csv", column="Servo motor speed", unit="rpm")
    motion = motion_from_trace(trace, machine.drive)
    cell = read_channels(folder / "a3NI.csv", {"Force": None})

    def force(low: float, high: float) -> MotorForce:
        values = RACK_GAIN * cell.values[:, 0]
        return MotorForce.of(machine, motion, cell.time, values, delayed=True, part=(low, high))

    whole = identify(machine, MASS_OF, [force(-np.inf, np.inf)], starts=2)
    weighed = (UnknownTable(path="body.mass", spread=0.001),)  # the fit needs an unknown
    found = identify(machine, weighed, [force(-np.inf, RACK_BRAKES)], starts=2)
    delay = whole.nuisance_estimates(whole.data[0])[-1]
    return whole.estimates[0], delay, predict(found, force(RACK_BRAKES, np.inf))


# ---- a ball screw axis under a multisine of 11 to 300 Hz, encoders on motor and table; Beauduin


@dataclass(frozen=True, eq=False)
class Screw:
    """Acceleration of the table over that of the motor.

    frequency  (n,) Hz; measured, value, low, high: (n,) its size, as measured, predicted, and its 95 % interval
    natural    Hz, of the table on its drive, with the ends of its interval; delay: s, between the encoders
    """

    frequency: Array
    measured: Array
    value: Array
    low: Array
    high: Array
    natural: tuple[float, float, float]
    delay: float

    @property
    def peak(self) -> float:
        """Hz, of the largest measured value."""
        return float(self.frequency[self.measured.argmax()])

    @property
    def inside(self) -> float:
        """Share of the measured values inside the interval, above what was identified."""
        here = (self.frequency > SCREW_HIGHEST) & (self.frequency <= SCREW_UP_TO)
        return float(((self.measured >= self.low) & (self.measured <= self.high))[here].mean())


def screw(folder: Path, file: str) -> Screw:
    """Stiffness and damping of the drive from motion up to SCREW_HIGHEST, and the resonance that follows.

    The periods are averaged, and differentiated by their Fourier coefficients. The mass is arbitrary: its ratio to
    stiffness and damping is what counts.
    """
    mass, start = 100.0, 100.0 * (2.0 * np.pi * 150.0) ** 2
    drive = {"name": "drive", "point": [0.0, 0.0, 0.0], "direction": [1.0, 0.0, 0.0]}
    drive |= {"stiffness": start, "damping": 0.1 * np.sqrt(start * mass)}
    machine = Machine(
        body={"mass": mass, "center_of_mass": [0.0, 0.0, 0.0], "inertia": np.eye(3).tolist()},
        links=[drive],
        points=[{"name": "table", "at": [0.0, 0.0, 0.0]}],
        free=["x"],
        gravity=[0.0, 0.0, 0.0],
    )
    log = loadmat(folder / file, squeeze_me=True)
    hertz = np.fft.rfftfreq(SCREW_PERIOD, 1.0 / SCREW_RATE)

    def acceleration(position: Array) -> Array:
        mean = np.reshape(position, (-1, SCREW_PERIOD))[2:].mean(axis=0)  # the first two swing in
        return np.asarray(-((2.0 * np.pi * hertz) ** 2) * np.fft.rfft(mean))

    motor = acceleration(log["theta_m"] * SCREW_LEAD / (2.0 * np.pi))
    table = acceleration(1e-9 * log["pos_t"])
    slow = (hertz >= SCREW_LINES[0]) & (hertz <= SCREW_HIGHEST)
    given, seen = (np.tile(np.fft.irfft(np.where(slow, one, 0.0)), 3) for one in (motor, table))
    time = np.arange(given.size) / SCREW_RATE
    second = slice(SCREW_PERIOD, 2 * SCREW_PERIOD)  # the machine has swung in
    data = SensorLog.of(
        machine,
        Motion.along_x(time, given),
        [Channel(parse_place("table x", machine))],
        time[second],
        seen[second, None],
    )
    unknown = tuple(UnknownTable(path=f"links[drive].{key}") for key in KEYS)
    found = identify(machine, unknown, [data], starts=1)
    stiffness = found.estimates[0]
    low, value, high = (
        float(np.sqrt(k / mass)) / (2.0 * np.pi) for k in (stiffness.low, stiffness.value, stiffness.high)
    )
    lines = (hertz >= SCREW_LINES[0]) & (hertz <= SCREW_LINES[1])

    def size(z: Array) -> Array:
        """(n,) by the machine at these coordinates of the unknowns."""
        values = {key: one.value(x) for key, one, x in zip(KEYS, found.unknowns, z.tolist(), strict=True)}
        at = machine.model_copy(update={"links": (machine.links[0].model_copy(update=values),)})
        return np.asarray(abs(frequency_response(at, hertz[lines]).absolute_acceleration[:, 0, 0]))

    best, rng = found.fit.minimum.x[:2], np.random.default_rng(1)
    draws = np.array([size(z) for z in rng.multivariate_normal(best, found.covariance[:2, :2], 400)])
    predicted, measured = size(best), abs(table[lines] / motor[lines])
    left = np.log(measured / predicted)[hertz[lines] <= SCREW_HIGHEST]
    scatter = np.sqrt(np.mean(left**2)) * rng.standard_normal(draws.shape)
    ends = np.quantile(draws * np.exp(scatter), [0.025, 0.975], axis=0)
    delay = found.nuisance_estimates(data)[-1].value
    return Screw(hertz[lines], measured, predicted, *ends, (value, low, high), delay)


# ---- a CNC mill, 10 Hz, current of its axes in A; University of Michigan SMART lab


def mill(folder: Path, name: str = "Y") -> tuple[Predicted, Predicted]:
    """Current of an axis by friction from the first half of log 1: of its second half, and of log 18, with a worn tool.

    1 A counts as 1 N here.
    """
    body = {"mass": 8.0, "center_of_mass": [0.0, 0.0, 0.0], "inertia": np.eye(3).tolist()}
    machine = axis(body=body)

    def current(log: str, low: float, high: float) -> MotorForce:
        options = {"column": f"{name}1_ActualVelocity", "unit": "mm/s", "kind": "velocity", "rate": 10}
        motion = motion_from_trace(read_trace(folder / log, cross_check=False, **options))
        values = read_channels(folder / log, {f"{name}1_CurrentFeedback": None}, rate=10).values[:, 0]
        # The values that are predicted are single ones, not means over windows.
        return MotorForce.of(machine, motion, motion.time, values, window=0.05, part=(low, high))

    first, last = "michigan_cnc_experiment_01.csv", "michigan_cnc_experiment_18.csv"
    half = 0.5 * len(read_channels(folder / first, {"Y1_ActualVelocity": None}, rate=10).time) / 10.0
    found = identify(machine, MASS_OF, [current(first, -np.inf, half)], starts=1)
    return predict(found, current(first, half, np.inf)), predict(found, current(last, -np.inf, np.inf))


def refusal(file: Path) -> str:
    """Why the log of the axis X of the mill is refused; "" if it is read."""
    try:
        read_trace(file, column="X1_ActualVelocity", unit="mm/s", kind="velocity", rate=10)
    except TraceError as error:
        return str(error)
    return ""
