"""The part of a run's report on the drive: force, power, torque, push of the rack."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from guideload.base.arrays import Array
from guideload.base.number_text import (
    KINDS,
    digits,
    fixed,
    joined,
    load_in_table,
    number,
    percent,
    seconds,
    signed,
)
from guideload.base.warnings import LIMITS, WarningText
from guideload.drive.requirements import DriveRequirements, Motor, is_elastic, share_of_push
from guideload.machine.machine import Machine
from guideload.reports.report import Part, Table, Value
from guideload.simulation.result import Result

RPM = 60.0 / (2.0 * np.pi)  # per rad/s
TIE = 1e-9  # of equal peaks, which differ by rounding, the first is shown


def drive_warnings(needed: DriveRequirements) -> list[str]:
    """Warnings of a motor, screw or drive that cannot make the motion."""
    return [one for one in _limits(needed) if isinstance(one, WarningText)]


def drive_parts(result: Result, needed: DriveRequirements) -> list[Part]:
    """What the drive is, a table of force, power and torque, and what they mean."""
    return [drive_words(result.machine), _table(needed), *_sentences(result, needed)]


def drive_words(machine: Machine) -> str:
    """Whether the drive is rigid or elastic, and what that means."""
    if not is_elastic(machine):
        return (
            "The drive is rigid: x is held, so the cart follows the motion exactly, and screw, rack or belt have no "
            "part in vibration and settling."
        )
    names = [link.name for link in machine.links if link.direction[0]]
    return f"The drive is elastic: x is free, and {joined(names)} along x holds the cart to the motion of the drive."


def _table(needed: DriveRequirements) -> Table:
    rows: list[tuple[Value, ...]] = []
    whole = needed.with_peaks

    def add(name: str, history: Array, unit: str, kind: str = "load", rms: float | None = None) -> None:
        sizes, show = np.abs(history), KINDS[kind]
        at = int(np.argmax(sizes >= (1.0 - TIE) * sizes.max()))
        rows.append((name, show(history[at]), whole.time[at], None if rms is None else show(rms), unit))

    add("drive force", whole.force, "N", rms=needed.rms_force)
    if whole.friction.any():
        add("  of it friction", whole.friction, "N")
    if whole.power is not None:
        add("power at the cart", whole.power, "W")
    if whole.motor is not None and needed.motor is not None:
        add("motor torque", whole.motor.torque, "N m", "3 digits", needed.motor.rms_torque)
        add("motor speed", RPM * whole.motor.speed, "rpm", "whole")
    if whole.push.any():
        add("push of the rack", whole.push, "N")
    return Table.by_rows(
        [("",), ("peak", "", "load"), ("at", "s", "3 decimals"), ("rms", "", "load"), ("unit",)], rows
    )


def _sentences(result: Result, needed: DriveRequirements) -> Iterator[str]:
    power = needed.with_peaks.power
    if needed.holding_force:
        torque = needed.holding_torque
        motor = "" if torque is None else f" at the cart, {digits(torque)} N m at the motor"
        held = f"{load_in_table(needed.holding_force)} N{motor}"
        yield f"The drive holds the cart at rest against gravity with {held}, without friction and losses."
        if power is not None and power.min() < 0.0:
            yield f"Power flows back from the cart, up to {load_in_table(-float(power.min()))} W."
    machine, seals = needed.machine, needed.machine.seal_forces
    if seals.any() and needed.friction.any() and (machine.friction is None or machine.friction.seal is None):
        yield f"The seals of the products take {digits(seals.sum())} N together; seal in [friction] replaces it."
    rolling = {one.name: one.friction_coefficient for one in machine.product_of_carriage if one is not None}
    own = [f"{number(value)} of {name}" for name, value in rolling.items() if value]
    if own and needed.friction.any() and (machine.friction is None or machine.friction.coefficient is None):
        yield f"The friction coefficient is that of the products, {joined(own)}; coefficient in [friction] replaces it."
    yield from (one for one in _limits(needed) if not isinstance(one, WarningText))
    if needed.push.any() and needed.velocity is not None:
        shares = share_of_push(result, needed)
        names = (carriage.name for carriage in result.machine.carriages)
        listed = ", ".join(
            f"{name} {signed(share, 'percent')}" for name, share in zip(names, shares, strict=True)
        )
        yield (
            "The rack pushes the body away with F tan(pressure angle) / cos(helix angle), whatever the direction of F. "
            f"Share of this push in the peak resultant: {listed}."
        )


def _limits(needed: DriveRequirements) -> Iterator[str]:
    """How near the motion comes to the limits of motor, screw and drive; beyond them as warnings."""
    if needed.with_peaks.motor is not None and needed.motor is not None:
        yield from _motor_limits(needed.with_peaks.motor, needed.motor.rms_torque)
    for name in ("speed of the screw", "drive force"):
        if (margin := needed.margins.get(name)) is not None:
            reached = f"{name} reaches {percent(1.0 / margin)} of its limit."
            yield f"The {reached}" if margin >= 1.0 else WarningText("motor", f"Warning: the {reached}")


def _motor_limits(motor: Motor, rms_torque: float) -> Iterator[str]:
    fastest, most = RPM * float(np.abs(motor.speed).max()), LIMITS["motor speed"].most
    if fastest > most:
        yield WarningText(
            "motor speed",
            f"Warning: the motor reaches {fixed(fastest)} rpm, beyond {number(most)} rpm: is the travel per turn right "
            "(screw_lead, pinion_diameter, gear_ratio), and the speed in m/s?",
        )
    if motor.use is not None:
        at = int(motor.use.argmax())
        use = motor.use[at]
        place = f"at {seconds(motor.time[at])} s and {fixed(RPM * abs(motor.speed[at]))} rpm"
        if np.isinf(use):
            text = f"too slow: {place} its torque curve has no torque. Take a faster motor or gear."
            yield WarningText("motor", f"Warning: the motor is {text}")
        else:
            yield f"The motion needs at most {percent(use)} of the motor's largest torque, {place}."
            if not LIMITS["motor"].holds(use):
                text = f"too weak: {place} the motion needs {percent(use)} of its largest torque."
                way_out = "Take a larger motor, another gear ratio or less acceleration."
                yield WarningText("motor", f"Warning: the motor is {text} {way_out}")
    if motor.rated_torque is not None:
        share = rms_torque / motor.rated_torque
        yield f"The rms torque is {percent(share)} of the rated torque."
        if not LIMITS["motor"].holds(share):
            text = f"its rms torque is {percent(share)} of the rated torque."
            yield WarningText("motor", f"Warning: the motor overheats: {text}")
