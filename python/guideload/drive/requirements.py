"""What a motion asks of its drive: force and power at the cart, torque and speed of the motor."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple, cast

import numpy as np

from guideload.base.arguments import checked
from guideload.base.arrays import Array, Flags
from guideload.base.errors import ArgumentError
from guideload.base.maxima import maxima_between
from guideload.base.methods import Method
from guideload.machine.drive import Drive
from guideload.machine.machine import DOFS, Machine
from guideload.motion.motion import Motion, velocity_at
from guideload.simulation.drive_force import friction_force, rolling_speed
from guideload.simulation.finer_histories import with_instants_for_peaks
from guideload.simulation.peaks import RESULTANT
from guideload.simulation.result import Result
from guideload.simulation.run import Run
from guideload.simulation.simulation import peak_loads
from guideload.simulation.start import StartState

BESIDE = 1e-6  # of an interval, from a standstill to an instant beside it
ROUNDING = 1e-9  # of the static loads of all links: what they leave along x if gravity has no part there
NO_RACK = {"pressure_angle": None, "helix_angle": 0.0, "push_direction": None}


@dataclass(frozen=True, eq=False)
class Motor:
    """Torque and speed of the motor at the instants of a result.

    speed           (time,) rad/s
    torque          (time,) N m: (F lever) / efficiency if power flows to the cart, times efficiency if it flows back,
                    F lever at standstill; plus motor inertia times angular acceleration
    largest_torque  (time,) N m, of the torque curve at this speed; nan beyond its last speed; None without a curve
    rated_torque    N m, or None
    """

    speed: Array
    torque: Array
    largest_torque: Array | None
    rated_torque: float | None
    time: Array

    @property
    def rms_torque(self) -> float:
        """Root of the mean square over time [N m]."""
        return rms(self.time, self.torque)

    @property
    def use(self) -> Array | None:
        """|torque| over the largest torque at its speed (time,); inf beyond the last speed of the curve."""
        if self.largest_torque is None:
            return None
        beyond = np.isnan(self.largest_torque)
        used = np.abs(self.torque) / np.where(beyond | (self.largest_torque == 0.0), 1.0, self.largest_torque)
        return np.where(beyond | ((self.largest_torque == 0.0) & (self.torque != 0.0)), np.inf, used)


@dataclass(frozen=True, eq=False)
class DriveRequirements:
    """Force of the drive on the cart along x at the instants of a result; peaks and margins are those at any time.

    time      (time,) s
    velocity  (time,) m/s of the cart, or None
    reaction  (time,) N without friction: from inertia, gravity along x, process forces and vibration. It holds x; if x
              is free, it is the force of the links along x, which are the elastic drive
    friction  (time,) N, share that overcomes the friction of the guides; 0 at standstill
    motor     torque and speed of the motor; None for a linear motor, without [drive] or without velocity
    machine   the machine
    """

    time: Array
    velocity: Array | None
    reaction: Array
    friction: Array
    motor: Motor | None
    machine: Machine
    # Not a field that `dataclasses.replace` keeps: it belongs to these histories.
    _with_peaks: DriveRequirements | None = field(default=None, init=False, repr=False)

    @property
    def with_peaks(self) -> DriveRequirements:
        """The same with the instants added at which force, power, torque or speed is largest."""
        return self._with_peaks or self

    @property
    def force(self) -> Array:
        """Force of the drive on the cart (time,) [N]."""
        return self.reaction + self.friction

    @property
    def peak_force(self) -> float:
        """Largest magnitude of the force at any time [N]."""
        return float(np.abs(self.with_peaks.force).max())

    @property
    def rms_force(self) -> float:
        """Root of the mean square of the force over time [N]."""
        return rms(self.time, self.force)

    @property
    def holding_force(self) -> float:
        """Force [N] that holds the cart with all its payloads at rest: against gravity along x, without friction."""
        laden = self.machine.with_payloads(payload.name for payload in self.machine.payloads)
        scene = (laden if self.machine.payloads else self.machine).scene
        loads = scene.static_link_loads()
        held = -loads @ _along_x(self.machine) if is_elastic(self.machine) else scene.static_reaction()[0]
        return float(held) if abs(held) > ROUNDING * np.abs(loads).sum() else 0.0

    @property
    def holding_torque(self) -> float | None:
        """Torque of the motor [N m] that holds the cart at rest, without loss in the gear; None without `motor`."""
        drive = self.machine.drive
        return (
            None if self.motor is None or drive is None else self.holding_force * drive.speed_per_motor_speed
        )

    @cached_property
    def power(self) -> Array | None:
        """Power at the cart (time,) [W]; negative where the cart feeds the drive; None without velocity."""
        return None if self.velocity is None else self.force * self.velocity

    @cached_property
    def margins(self) -> dict[str, float]:
        """Each limit of the machine over what the motion asks, by name; inf where the motion asks nothing."""
        found: list[tuple[str, float | None, float]] = []
        drive, motor = self.machine.drive, self.with_peaks.motor
        if drive is None:
            return {}
        if motor is not None and self.motor is not None:
            speed = float(np.abs(motor.speed).max())
            if drive.torque_curve is not None and motor.use is not None:
                found.append(("motor speed", drive.torque_curve[-1][0], speed))
                within = np.abs(motor.speed) <= drive.torque_curve[-1][0]
                found.append(("motor torque", 1.0, float(motor.use[within].max(initial=0.0))))
            rms_torque = 0.0 if motor.rated_torque is None else self.motor.rms_torque
            found.append(("rms torque of the motor", motor.rated_torque, rms_torque))
            found.append(("speed of the screw", drive.critical_speed, abs(speed / drive.gear_ratio)))
        found.append(("drive force", drive.max_force, self.peak_force))
        return {name: limit / asked if asked else np.inf for name, limit, asked in found if limit is not None}

    @property
    def push(self) -> Array:
        """Force (time,) [N] with which the rack pushes the body away; zeros without a pressure angle."""
        drive = self.machine.drive
        return np.abs(self.force) * (0.0 if drive is None else drive.push_per_force)


@checked
def drive_requirements(result: Result) -> DriveRequirements:
    """What the motion of a result asks of the drive of its machine.

    Peaks are those at any time; if instants were given or rails are not straight, those at the reported instants. If x
    is free, the drive is elastic: the links along x. Raises ArgumentError if there is friction but no velocity, and if
    the result reports no instant.
    """
    machine, run = result.machine, result.whole_run
    time, acceleration, velocity = map(result.history, ("time", "cart_acceleration", "cart_velocity"))
    assert time is not None and acceleration is not None
    if not time.size:
        raise ArgumentError("times: the result reports no instant, so the drive has no peak force")
    motion = rolling = None
    if velocity is not None:
        motion, rolling = Motion(time, acceleration, velocity), rolling_speed(time, acceleration, velocity)
    own = _Histories.of(result, None if velocity is None else velocity[:, 0], rolling)
    needed = own.requirements(machine)
    if run is None:
        return needed

    def histories_of(there: Run) -> _Histories:
        speeds = (
            (None, None)
            if motion is None or rolling is None
            else _speeds_between(motion, rolling, there.time)
        )
        return _Histories.of(Result.of_run(there), *speeds)

    def magnitudes_at(times: Array) -> Array:
        return _magnitudes(histories_of(replace(run, times=times)).requirements(machine))

    dense, finer = own, with_instants_for_peaks(run)
    if finer is not run:
        dense = dense.joined(histories_of(finer))
    if motion is not None and rolling is not None:
        dense = dense.joined(histories_of(replace(run, times=_beside_jumps(motion, rolling, machine.drive))))
    magnitudes = _magnitudes(dense.requirements(machine))
    found = maxima_between(dense.time, magnitudes, magnitudes.max(axis=0), magnitudes_at)
    dense = dense.joined(histories_of(replace(run, times=found)))
    object.__setattr__(needed, "_with_peaks", dense.requirements(machine))
    return needed


class _Histories(NamedTuple):
    """What the requirements follow from, at n instants.

    time (n,) s; acceleration, speed, rolling speed (n,) m/s2, m/s, m/s of the cart along x, the speeds None if unknown;
    reaction, friction (n,) N.
    """

    time: Array
    acceleration: Array
    speed: Array | None
    rolling: Array | None
    reaction: Array
    friction: Array

    @classmethod
    def of(cls, result: Result, speed: Array | None, rolling: Array | None) -> _Histories:
        """Those of a result, with speed and rolling speed [m/s]: the latter is 0 at standstill."""
        machine = result.machine
        time, reactions = result.history("time"), result.history("reaction")
        assert time is not None and reactions is not None
        reaction = reactions[:, DOFS.index("x")]
        if is_elastic(machine):
            loads = result.history("link_load")
            assert loads is not None
            reaction = -loads @ _along_x(machine)
        acceleration = result.history("cart_acceleration")
        assert acceleration is not None
        friction = friction_force(machine, result.carriage_loads, rolling)
        return cls(time, acceleration[:, 0], speed, rolling, reaction, friction)

    def joined(self, other: _Histories) -> _Histories:
        """With the instants of the other that are not among its own."""
        new = ~np.isin(other.time, self.time)
        order = np.argsort(np.append(self.time, other.time[new]), kind="stable")
        pairs = zip(self, other, strict=True)
        return _Histories._make(
            None if a is None or b is None else np.append(a, b[new])[order] for a, b in pairs
        )

    def requirements(self, machine: Machine) -> DriveRequirements:
        """What they ask of the drive of the machine."""
        motor = None
        if machine.drive is not None and not machine.drive.linear_motor and self.speed is not None:
            motor = self._motor(machine.drive)
        return DriveRequirements(self.time, self.speed, self.reaction, self.friction, motor, machine)

    def _motor(self, drive: Drive) -> Motor:
        assert self.speed is not None and self.rolling is not None
        lever, force = drive.speed_per_motor_speed, self.reaction + self.friction
        speed = self.speed / lever
        loss = drive.gear_loss(force * self.rolling)
        torque = force * lever * loss + drive.motor_inertia * self.acceleration / lever
        largest = None
        if drive.torque_curve is not None:
            speeds, torques = np.array(drive.torque_curve).T
            largest = np.interp(np.abs(speed), speeds, torques, right=np.nan)
        return Motor(speed, torque, largest, drive.rated_torque, self.time)


def _speeds_between(motion: Motion, rolling: Array, times: Array) -> tuple[Array, Array]:
    """Speed and rolling speed of the cart along x [m/s] at instants between the stamps of a motion.

    rolling: the latter at the stamps.
    """
    speed, stamps = velocity_at(motion, times)[:, 0], motion.time
    before = np.searchsorted(stamps, times, side="right") - 1
    after = np.minimum(before + 1, stamps.size - 1)
    return speed, np.where((rolling[before] == 0.0) & (rolling[after] == 0.0), 0.0, speed)


def _beside_jumps(motion: Motion, rolling: Array, drive: Drive | None) -> Array:
    """Instants [s] just after a start, before a stop, and on both sides of a reversal and of the motor's last speed.

    There friction and the loss of the gear jump, and the torque curve ends. rolling: rolling speed at the stamps.
    """
    steps, change = np.diff(motion.time), np.diff(motion.acceleration[:, 0])
    rests = rolling == 0.0
    places: list[tuple[Flags, Array | float]] = [
        (rests[:-1] & ~rests[1:], BESIDE),
        (~rests[:-1] & rests[1:], 1.0 - BESIDE),
    ]
    last = 0.0
    if drive is not None and drive.torque_curve is not None:
        last = drive.torque_curve[-1][0] * drive.speed_per_motor_speed
    for level in {0.0, last, -last}:
        start, end = rolling[:-1] - level, rolling[1:] - level
        passes = start * end < 0.0
        # The root of start + b s + c s^2, the speed beyond the level at a share s of the interval.
        c, v = 0.5 * (steps * change)[passes], start[passes]
        b = end[passes] - v - c
        q = -0.5 * (b + np.copysign(np.sqrt(np.maximum(b * b - 4.0 * c * v, 0.0)), b))
        share = v / q
        share = np.where((share >= 0.0) & (share <= 1.0), share, q / np.where(c == 0.0, 1.0, c))
        share = np.minimum(np.maximum(share, BESIDE), 1.0 - BESIDE)
        places += [(passes, share - BESIDE), (passes, share + BESIDE)]
    times = [motion.time[:-1][where] + at * steps[where] for where, at in places]
    return np.setdiff1d(np.concatenate(times), motion.time)


def _magnitudes(needed: DriveRequirements) -> Array:
    """Histories (time, k) whose largest values are sought."""
    found = [np.abs(needed.force), np.abs(needed.friction)]
    if needed.power is not None and needed.velocity is not None:
        found += [needed.power, -needed.power, np.abs(needed.velocity)]
    if (motor := needed.motor) is not None:
        found += [np.abs(motor.torque)]
        found += [] if motor.use is None else [np.where(np.isinf(motor.use), 0.0, motor.use)]
    return np.stack(found, axis=1)


def is_elastic(machine: Machine) -> bool:
    """Whether links along x hold the cart to its drive; otherwise the drive is rigid, and x follows the motion."""
    return "x" in machine.free


def _along_x(machine: Machine) -> Array:
    """(link,) x of the direction of each link."""
    return machine.link_table().directions[:, 0]


def share_of_push(result: Result, needed: DriveRequirements) -> Array:
    """Share (carriage,) of the push of the rack in the peak resultants: 1 - peak without the push / peak.

    The same motions of cart and riders are run without the push. Raises ArgumentError if the result reports other
    instants than the samples.
    """
    drive, data = result.machine.drive, result.quantities
    peaks = result.peak_columns["peak_resultant_N"]
    if drive is None or drive.push_direction is None:
        return np.zeros_like(peaks)
    if needed.velocity is None:
        raise ArgumentError("times: the share of the push needs the loads at the samples; leave times out")
    wrench = data["wrench"].copy()
    wrench[:, :3] -= needed.push[:, None] * np.array(drive.push_direction)
    if "foot_load" in data:  # the force of rails that are not straight, which `peak_loads` adds
        wrench += data["foot_load"] @ result.machine.link_table().rows
    velocity, position = (data[name] if name in data else None for name in ("cart_velocity", "cart_position"))
    motion = Motion(data["time"], data["cart_acceleration"], velocity, position, wrench)
    riders = {}
    if "rider_position" in data:
        places, speeds, rates = (
            data.by_label(f"rider_{one}") for one in ("position", "velocity", "acceleration")
        )
        riders = {
            name: Motion.along_x(data["time"], rates[name], velocity=speeds[name], position=place)
            for name, place in places.items()
        }
    machine = result.machine.model_copy(update={"drive": drive.model_copy(update=NO_RACK)})
    method, attributes = cast("Method", result.method), data.attrs
    step = float(attributes["step_s"]) if "step_s" in attributes else None
    start = cast("StartState", attributes.get("start", "rest"))
    rtol = float(attributes["rtol"])
    without = peak_loads(machine, motion, method, riders=riders, rtol=rtol, step=step, start=start)
    return np.asarray(1.0 - without.largest[:, RESULTANT] / peaks)


def rms(time: Array, values: Array) -> float:
    """Root of the mean square over time of values that are linear between the instants."""
    steps = np.diff(time)
    duration, size = float(steps.sum()), float(np.abs(values).max(initial=0.0))
    if size == 0.0:
        return 0.0
    values = values / size  # the squares stay within the range of numbers
    if duration == 0.0:
        return size * float(np.sqrt(np.mean(values**2)))
    left, right = values[:-1], values[1:]
    # A sum in pairs: it rounds less than a scalar product, whose threads wait for each other.
    squares = (steps * (left * left + left * right + right * right)).sum()
    return size * float(np.sqrt(squares / (3.0 * duration)))
