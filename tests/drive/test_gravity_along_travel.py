"""Vertical and inclined axes: weight, holding force, friction, power and motor torque by their formulas."""

from __future__ import annotations

import numpy as np
import pytest

from guideload import (
    Body,
    Carriage,
    Drive,
    Friction,
    Machine,
    Motion,
    Moves,
    Rail,
    frequency_response,
    peak_loads,
    simulate,
)
from guideload.drive import drive_requirements
from guideload.reports.run import result_report

G, MASS, ARM, REACH = 9.80665, 50.0, 0.12, 0.2  # kg; m, from rails to centre of mass; m, from L to a carriage
RISE = Moves(
    limits={"speed": 0.5, "acceleration": 3.0, "jerk": 100.0},
    moves=[{"distance": 0.4, "dwell": 0.4}, {"target": 0.0, "dwell": 0.4}],
).motion()


def axis(angle: float = 90.0, **changes: object) -> Machine:
    """A table on two rails that rise by an angle [deg]; x points up the rails, its centre of mass is ARM off them."""
    up = np.radians(angle)
    rails = [Rail(name=name, position=(0.0, z)) for name, z in (("l", -0.15), ("r", 0.15))]
    values = {"length": 0.05, "stiffness_y": 1e8, "stiffness_z": 1e8, "damping_y": 4e4, "damping_z": 4e4}
    carriages = [
        Carriage(name=f"{rail.name}{end}", rail=rail.name, x=x, **values)
        for rail in rails
        for end, x in (("-", -REACH), ("+", REACH))
    ]
    body = Body(mass=MASS, center_of_mass=(0.0, ARM, 0.0), inertia=np.eye(3) * 0.5)
    gravity = (-G * np.sin(up), -G * np.cos(up), 0.0)
    return Machine(body=body, rails=rails, carriages=carriages, gravity=gravity, **changes)


def pairs() -> float:
    """Sum over the links of x^2 of their ends, over x of a carriage: the lever of the pitch moment."""
    ends = np.array([-REACH - 0.025, -REACH + 0.025, REACH - 0.025, REACH + 0.025])
    return float((ends**2).sum() / (2.0 * REACH))


@pytest.mark.parametrize("angle", [-90.0, 0.0, 30.0, 90.0])
def test_weight_along_the_travel_is_held_by_the_drive_and_tilts_the_table(angle: float) -> None:
    """Reaction m g sin; carriages -m g cos/4 and, from the moment m g sin ARM, a couple of equal stiffnesses."""
    machine = axis(angle)
    result = simulate(machine, RISE)
    needed = drive_requirements(result)
    along, across = MASS * G * np.sin(np.radians(angle)), MASS * G * np.cos(np.radians(angle))
    assert needed.holding_force == pytest.approx(along, abs=1e-9)
    couple = along * ARM / (2.0 * pairs())  # on each of the two rails
    expected = [-across / 4.0 + sign * couple for sign in (-1.0, 1.0, -1.0, 1.0)]
    force = result.quantities["static_force"]
    assert force[:, 1] == pytest.approx(expected, abs=1e-9)
    assert force[:, 1].sum() == pytest.approx(-across, abs=1e-9)
    moment = (force[:, 1] * machine.carriage_centers[:, 0]).sum() + result.quantities["static_moment"][
        :, 2
    ].sum()
    assert moment == pytest.approx(along * ARM, abs=1e-9)  # weight -m g sin along x at height ARM: +z
    assert not result.audit.doubts


def test_energy_of_the_drive_over_a_closed_cycle_is_friction_alone() -> None:
    """Up and down again: gravity gives back what it took; of the work of the drive the losses remain."""
    machine = axis(friction=Friction(seal=5.0))
    needed = drive_requirements(simulate(machine, RISE))
    assert needed.power is not None and needed.power.min() < -100.0
    work = float(np.sum(0.5 * np.diff(needed.time) * (needed.power[1:] + needed.power[:-1])))
    assert work == pytest.approx(4.0 * 5.0 * 2.0 * 0.4, rel=2e-2)  # vibration dissipates some
    quick = np.abs(RISE.velocity[:, 0]) > 0.01  # type: ignore[index]
    rubbing = needed.friction[quick] * RISE.velocity[quick, 0]  # type: ignore[index]
    assert (rubbing > 0.0).all()


def test_motor_torque_going_down_is_relieved_by_the_losses() -> None:
    """At constant speed: m g r / eta upwards, m g r eta downwards; m g r holds."""
    machine = axis(drive=Drive(screw_lead=0.02, efficiency=0.8))
    lever = 0.02 / (2.0 * np.pi)
    time = np.linspace(0.0, 0.01, 11)
    for speed, share in ((0.2, 1.25), (-0.2, 0.8), (0.0, 1.0)):
        motion = Motion.along_x(time, 0 * time, velocity=np.full(11, speed))
        needed = drive_requirements(simulate(machine, motion))
        assert needed.motor is not None
        assert needed.motor.torque == pytest.approx(np.full(11, MASS * G * lever * share), rel=1e-9)
        assert needed.holding_torque == pytest.approx(MASS * G * lever, rel=1e-12)


def test_report_states_holding_force_and_power_fed_back() -> None:
    machine = axis(drive=Drive(screw_lead=0.02))
    text = " ".join(result_report(simulate(machine, RISE)).text().split())
    assert "holds the cart at rest against gravity with 490 N at the cart, 1.56 N m at the motor" in text
    assert "Power flows back from the cart, up to" in text
    assert "against gravity" not in result_report(simulate(axis(0.0), RISE)).text()


def test_gravity_along_the_travel_changes_neither_vibration_nor_response() -> None:
    """Of a linear machine: loads minus those at rest are the same for any direction of gravity."""
    upright, flat = simulate(axis(), RISE).quantities, simulate(axis(0.0), RISE).quantities
    moving = [data["force"] - data["static_force"] for data in (upright, flat)]
    assert np.abs(moving[0] - moving[1]).max() <= 1e-9 * np.abs(moving[0]).max()
    peaks = peak_loads(axis(), RISE)
    assert peaks.largest[:, 6] == pytest.approx(upright["resultant"].max(axis=0), rel=1e-12)
    tool = [{"name": "tool", "at": (0.1, 0.2, 0.3)}]
    answers = [frequency_response(axis(angle, points=tool)).displacement for angle in (0.0, 90.0)]
    assert np.array_equal(*answers)
