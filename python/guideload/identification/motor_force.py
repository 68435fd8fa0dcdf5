"""Force or torque of the motor under a measured motion: moving mass, friction and offset.

The drive pushes the cart with its reaction along x and overcomes the friction, so that

    force = reaction(mass, stiffnesses; acceleration) + sign(v) n seal + viscous v,

measured with a constant offset (weight of a cable, a tilted rail, zero of the amplifier) and, if asked for, a delay.
The acceleration is the mean of the trace's posterior. The error of a posterior mean is independent of the mean itself
(Berkson's kind), so it does not pull the mass towards zero, as differentiated samples would; it is part of the
residuals and thereby of every interval. At a jump of the acceleration this does not hold: the estimate is a ramp over
some stamps of the trace, and the jump lies beyond it on both sides, which would make the mass too large. Means of both
over some stamps are equal, so windows are no shorter.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError
from guideload.identification.measured import WIDE, Noise, NuisanceParameter
from guideload.identification.model import Excitation, ModelAt
from guideload.identification.records import Record, Windows
from guideload.machine.machine import DOFS, Machine
from guideload.motion.motion import Motion
from guideload.simulation.drive_force import friction_coefficients, require_held_x

WINDOWS = 5000  # of a record by default: means over 5 ms in a record of 25 s
STAMPS = 4.0  # of a measured trace in a window at least: an estimated acceleration shows a jump as a ramp over as many
SLOW = 0.01  # of the largest speed: below it friction may stick, which the law of the machine does not say
FIRST_LEVEL = 0.01  # of the force's standard deviation: where the search for its noise starts
LONGEST_DELAY = 0.05  # s, of a current loop or of a filter in the drive
FRICTION = {"seal": "N", "viscous": "N s/m"}
X = DOFS.index("x")


@dataclass(frozen=True, eq=False)
class MotorForce(Record):
    """A measured force [N] of the drive on the cart, or a torque [N m] of the motor; its motion has a velocity."""

    known: bool  # whether the standard deviation of the noise is known
    friction: tuple[str, ...]  # keys of [friction] that are unknown
    machine: Machine  # the machine, with the values of the keys that are known
    torque: bool = False
    delayed: bool = False  # whether the delay of the measured values is unknown

    @classmethod
    def of(
        cls,
        machine: Machine,
        motion: Motion,
        time: Array,
        values: Array,
        *,
        name: str = "motor force",
        torque: bool = False,
        friction: tuple[str, ...] = ("seal", "viscous"),
        delayed: bool = False,
        level: float | None = None,
        window: float | None = None,
        part: tuple[float, float] = (-np.inf, np.inf),
    ) -> MotorForce:
        """A measured force (n,) of a motion.

        level: standard deviation of the noise of one value, None if unknown. window: s; by default a 5000th of the
        record, at least four stamps of a measured trace. part: s, first and last instant used.
        Raises ArgumentError for a machine whose drive force depends on more, TraceError for a record too short.
        """
        _require_supported(machine, motion, torque)
        excitation = Excitation.of(machine, motion)
        assert motion.velocity is not None
        velocity = motion.velocity[:, 0]
        margin = LONGEST_DELAY if delayed else 0.0  # so that any delay leads to an instant of the motion
        low, high = max(part[0], motion.time[0] + margin), min(part[1], motion.time[-1] - margin)
        usable = (time >= low) & (time <= high)
        usable &= abs(np.interp(time, motion.time, velocity)) > SLOW * abs(velocity).max()
        span = float(np.ptp(time[usable])) if usable.any() else 0.0
        windows = Windows.of(time, usable, window or max(span / WINDOWS, STAMPS * _step(motion)), name)
        first = FIRST_LEVEL * float(values[windows.samples].std())
        return cls(
            name=name,
            excitation=excitation,
            time=time,
            values=values[:, None],
            windows=windows,
            levels=np.array([level or first or 1.0]),
            known=level is not None,
            friction=friction,
            machine=machine,
            torque=torque,
            delayed=delayed,
        )

    # ---- as the fit sees it

    @cached_property
    def nuisance(self) -> tuple[NuisanceParameter, ...]:
        largest = float(abs(self.values[self.windows.samples]).max()) or 1.0
        force = largest / (abs(self._lever) if self.torque else 1.0)
        scales = {"seal": force / len(self.machine.carriages), "viscous": force / abs(self._speed).max()}
        found = []
        for key in self.friction:
            name, expected, scale = f"friction.{key}", self._known(key), scales[key]
            bounds = (0.0, np.inf)
            title = f"{name} in {self.name}"
            found.append(NuisanceParameter(title, FRICTION[key], expected, WIDE * scale, scale, bounds, name))
        unit = "N m" if self.torque else "N"
        found.append(NuisanceParameter(f"offset of {self.name}", unit, 0.0, WIDE * largest, largest))
        if self.delayed:
            bounds = (-LONGEST_DELAY, LONGEST_DELAY)
            found.append(NuisanceParameter(f"delay of {self.name}", "s", 0.0, LONGEST_DELAY, 1e-3, bounds))
        return tuple(found)

    @property
    def noise(self) -> tuple[Noise, ...]:
        return (Noise(self.name, self.known, float(self.levels[0]), self.titles[0][1]),)

    @property
    def titles(self) -> tuple[tuple[str, str], ...]:
        return ((self.name, "N m" if self.torque else "N"),)

    # ---- the prediction

    def predicted(self, model: ModelAt, nuisance: Array) -> tuple[Array, Array, Array]:
        k, motion, speed = len(self.friction), self.excitation.motion, self._speed
        instants = self.time[self.windows.samples] - (nuisance[k + 1] if self.delayed else 0.0)
        instants = self.excitation.within(instants)
        at, velocity = model.run(self.excitation).at(instants), np.interp(instants, motion.time, speed)
        reaction = at.history("reaction", np.eye(len(DOFS))[X])
        acceleration, jerk = at.inputs[:, X], at.input_slopes[:, X]
        per_unit = {"seal": len(self.machine.carriages) * np.sign(velocity), "viscous": velocity}
        friction = {key: self._known(key) for key in FRICTION}
        friction |= dict(zip(self.friction, nuisance.tolist(), strict=False))
        force = reaction.values + sum(friction[key] * per_unit[key] for key in FRICTION)
        gain, inertia = self._as_measured(force, velocity)
        by_nuisance = [self.windows.mean(gain * per_unit[key]) for key in self.friction]
        by_nuisance.append(np.ones(self.windows.first.size))
        if self.delayed:
            steps = np.searchsorted(motion.time, instants, "right").clip(1, speed.size - 1)
            faster = np.diff(speed)[steps - 1] / np.diff(motion.time)[steps - 1]
            rate = gain * (reaction.slope + friction["viscous"] * faster) + inertia * jerk
            by_nuisance.append(-self.windows.mean(rate))
        predicted = self.windows.mean(gain * force + inertia * acceleration) + nuisance[k]
        by_unknowns = model.by_z(self.windows.mean(gain * reaction.by))
        return predicted[None], by_unknowns[:, None], np.array(by_nuisance)[:, None]

    def _as_measured(self, force: Array, velocity: Array) -> tuple[Array | float, float]:
        """The measured quantity per force on the cart (n,), and per acceleration of the cart."""
        if not self.torque:
            return 1.0, 0.0
        drive = self.machine.drive
        assert drive is not None
        return self._lever * drive.gear_loss(force * velocity), drive.motor_inertia / self._lever

    @property
    def _speed(self) -> Array:
        """(time,) m/s of the cart at the stamps of its motion."""
        assert self.excitation.motion.velocity is not None
        return self.excitation.motion.velocity[:, 0]

    @property
    def _lever(self) -> float:
        assert self.machine.drive is not None
        return self.machine.drive.speed_per_motor_speed

    def _known(self, key: str) -> float:
        friction, seals = self.machine.friction, self.machine.seal_forces
        if key == "seal":
            return float(seals.mean()) if seals.size else 0.0
        return 0.0 if friction is None else float(getattr(friction, key))


def _step(motion: Motion) -> float:
    """Time [s] between the stamps of a measured trace; 0 for an exact motion."""
    if motion.uncertainty is None:
        return 0.0
    return float(np.median(np.diff(motion.uncertainty.stamps(motion.time))))


def _require_supported(machine: Machine, motion: Motion, torque: bool) -> None:
    """Raise ArgumentError for a machine whose drive force has a part that is not modelled by this kind of data."""
    require_held_x(machine)
    if motion.velocity is None:
        raise ArgumentError(
            "identify: motor force needs the velocity of the cart, which this motion does not have"
        )
    if friction_coefficients(machine).any():
        raise ArgumentError(
            "friction.coefficient: the force of the motor cannot separate it from friction.seal unless the loads "
            "change much; leave it out of the machine that is identified, or state 0 where its products have one, so "
            "that seal holds all dry friction"
        )
    if torque and (machine.drive is None or machine.drive.linear_motor):
        raise ArgumentError(
            "identify: a torque of the motor needs a [drive] that turns it into a force; give a force"
        )
