"""The drive of the cart: motor, gear, pinion, screw, belt or linear motor; and the friction that it overcomes."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from pydantic import Field, StrictBool, field_validator, model_validator

from guideload.base.arrays import Array
from guideload.base.config import ConfigModel, in_range, listed, optional
from guideload.base.errors import ArgumentError, ValueRefused
from guideload.base.ranges import (
    ANGLE,
    ANGULAR_SPEED,
    DAMPING,
    EFFICIENCY,
    FORCE,
    FRICTION,
    INERTIA,
    MOMENT,
    RATIO,
)
from guideload.machine.components import PositiveLength, Vector, unit_vector

Ratio = Annotated[float, in_range(RATIO, nonzero=True)]
Efficiency = Annotated[float, in_range(EFFICIENCY, above=0.0)]
Angle = Annotated[float, in_range(ANGLE, least=0.0)]
Torque = Annotated[float, in_range(MOMENT, above=0.0)]
CurvePoint = Annotated[
    tuple[
        Annotated[float, in_range(ANGULAR_SPEED, least=0.0)], Annotated[float, in_range(MOMENT, least=0.0)]
    ],
    listed("speed", "torque"),
]
OUTPUTS = ("pinion_diameter", "pulley_diameter", "screw_lead", "linear_motor")
ROTARY = ("gear_ratio", "efficiency", "motor_inertia", "torque_curve", "rated_torque")  # of motors that turn


class Drive(ConfigModel):
    """The drive from the motor to the cart: a gear, then a pinion on a rack, a belt or a screw; or a linear motor."""

    gear_ratio: Ratio = optional(
        "motor turns per turn of pinion, pulley or screw; negative if the cart runs backwards", 1.0
    )
    pinion_diameter: PositiveLength | None = optional(
        'pitch diameter of the pinion on a rack, e.g. "127.3 mm"'
    )
    pulley_diameter: PositiveLength | None = optional('pitch diameter of the pulley of a belt, e.g. "60 mm"')
    screw_lead: PositiveLength | None = optional('travel per turn of the screw, e.g. "20 mm"')
    linear_motor: StrictBool = optional("true: the motor pushes the cart without a gear", False)
    efficiency: Efficiency = optional(
        "of gear and pinion, belt or screw together, e.g. 0.95; at least 0.01, at most 1", 1.0
    )
    motor_inertia: Annotated[float, in_range(INERTIA, least=0.0)] = optional(
        'of rotor, coupling and gear at the shaft of the motor, e.g. "0.004 kg m^2"', 0.0
    )
    torque_curve: Annotated[tuple[CurvePoint, ...], Field(min_length=2)] | None = optional(
        'largest torque of the motor by its speed, e.g. [["0 rpm", "40 N m"], ["3000 rpm", "25 N m"]]'
    )
    rated_torque: Torque | None = optional(
        "continuous torque of the motor, which the rms torque is compared with"
    )
    critical_speed: Annotated[float, in_range(ANGULAR_SPEED, above=0.0)] | None = optional(
        'largest speed of the screw, e.g. "1800 rpm": its critical speed, or that of its nut'
    )
    max_force: Annotated[float, in_range(FORCE, above=0.0)] | None = optional(
        'largest force at the cart, e.g. "12 kN": buckling of the screw, pull of the belt, peak of a motor'
    )
    pressure_angle: Angle | None = optional(
        'of the teeth of the rack, e.g. "20 deg": the rack then pushes the body away; needs push_direction'
    )
    helix_angle: Angle = optional('of the teeth of the rack, e.g. "19.5 deg"', 0.0)
    push_direction: Vector | None = optional(
        "vector across the rails from the rack to the pinion's axis, e.g. [0, 1, 0]"
    )

    @field_validator("push_direction")
    @classmethod
    def _across(cls, direction: Vector | None) -> Vector | None:
        if direction is None:
            return None
        if direction[0] != 0.0:
            raise ValueRefused("a direction across the rails: its x is 0", direction)
        return unit_vector(direction, "e.g. [0, 1, 0] for a rack below the pinion")

    @field_validator("torque_curve")
    @classmethod
    def _ascending(cls, curve: tuple[CurvePoint, ...] | None) -> tuple[CurvePoint, ...] | None:
        speeds = [speed for speed, _ in curve or ()]
        if any(right <= left for left, right in zip(speeds, speeds[1:], strict=False)):
            raise ValueRefused("points with ascending speed", curve)
        return curve

    @model_validator(mode="after")
    def _consistent(self) -> Drive:
        given = self.model_dump(exclude_unset=True)
        if sum(bool(getattr(self, key)) for key in OUTPUTS) != 1:
            raise ValueRefused(f"exactly one of {', '.join(OUTPUTS)}", given)
        rotary = [key for key in ROTARY if key in given]
        if self.linear_motor and rotary:
            raise ValueRefused(f"no {rotary[0]} beside linear_motor", given, "a linear motor does not turn")
        if self.critical_speed is not None and self.screw_lead is None:
            raise ValueRefused("screw_lead beside critical_speed", given, "only a screw has a critical speed")
        if (self.pressure_angle is None) != (self.push_direction is None):
            raise ValueRefused("both pressure_angle and push_direction, or neither", given)
        if self.pressure_angle is not None and self.pinion_diameter is None:
            raise ValueRefused(
                "pinion_diameter beside pressure_angle", given, "only a pinion is pushed off its rack"
            )
        if self.helix_angle and self.pressure_angle is None:
            raise ValueRefused("pressure_angle beside helix_angle", given)
        return self

    @property
    def speed_per_motor_speed(self) -> float:
        """Speed of the cart per speed of the motor [m/rad]. Raises ArgumentError for a linear motor."""
        if self.linear_motor:
            raise ArgumentError(
                "drive: a linear motor does not turn, so there is no motor speed; give the speed or position of the "
                "cart, or pinion_diameter, pulley_diameter or screw_lead"
            )
        diameter = self.pinion_diameter or self.pulley_diameter
        if diameter is not None:
            return 0.5 * diameter / self.gear_ratio
        assert self.screw_lead is not None
        return self.screw_lead / (2.0 * math.pi) / self.gear_ratio

    def gear_loss(self, power: Array) -> Array:
        """Torque of the motor over that of a drive without loss, by the power (n,) [W] at the cart.

        With power towards the cart the gear takes its share from the motor; with power back, from the cart. At
        standstill the force counts without loss.
        """
        return np.where(power > 0.0, 1.0 / self.efficiency, np.where(power < 0.0, self.efficiency, 1.0))

    @property
    def push_per_force(self) -> float:
        """Force with which the rack pushes the pinion away, per tangential force: tan(alpha) / cos(beta)."""
        return (
            0.0 if self.pressure_angle is None else math.tan(self.pressure_angle) / math.cos(self.helix_angle)
        )


class Friction(ConfigModel):
    """Friction of the guides along the travel, opposite to the velocity: sum(mu (|Fy| + |Fz|)) + n F_seal + c |v|."""

    coefficient: Annotated[float, in_range(FRICTION, least=0.0)] | None = optional(
        "mu of the loaded carriages without seals, e.g. 0.003; by default that of the product of each"
    )
    seal: Annotated[float, in_range(FORCE, least=0.0)] | None = optional(
        'friction of the seals of one carriage, e.g. "12 N"; by default that of its product'
    )
    viscous: Annotated[float, in_range(DAMPING, least=0.0)] = optional(
        'c of all carriages together, e.g. "15 N s/m"', 0.0
    )
