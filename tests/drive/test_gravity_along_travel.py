"""Vertical and inclined axes: weight, holding force, friction, power and motor torque by their formulas."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from machines import link, table
from reference import cart, cart_clear, preloaded

from guideload import (
    Body,
    Drive,
    Friction,
    Link,
    Machine,
    Motion,
    Moves,
    frequency_response,
    motion_from_trace,
    read_trace,
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
    keys = {"stiffness_y": 1e8, "stiffness_z": 1e8, "damping_y": 4e4, "damping_z": 4e4}
    body = Body(mass=MASS, center_of_mass=(0.0, ARM, 0.0), inertia=np.eye(3) * 0.5)
    gravity = (-G * np.sin(up), -G * np.cos(up), 0.0)
    return table(body, 2.0 * REACH, 0.3, gravity=gravity, **keys, **changes)


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
    quick = np.abs(RISE.velocity[:, 0]) > 0.01
    rubbing = needed.friction[quick] * RISE.velocity[quick, 0]
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


def test_rounding_turns_no_speed_beside_a_stop() -> None:
    """Down by 318 mm, where rounding did: friction and losses relieve the motor throughout."""
    drive = Drive(screw_lead=0.02, efficiency=0.8)
    limits = {"speed": 0.48, "acceleration": 3.4, "jerk": 172.0, "profile": "sine squared"}
    down = Moves(limits=limits, moves=[{"distance": -0.318, "dwell": 0.2}]).motion()
    needed = drive_requirements(simulate(axis(drive=drive, friction=Friction(seal=20.0)), down)).with_peaks
    assert needed.velocity is not None and needed.motor is not None
    assert needed.velocity.max() == 0.0 and needed.friction.max() == 0.0
    share = np.where(needed.velocity < 0.0, 0.8, 1.0)
    lever = drive.speed_per_motor_speed
    assert needed.motor.torque == pytest.approx(needed.force * lever * share, rel=1e-12)


def test_a_trace_has_the_torque_of_its_plan() -> None:
    """An estimated speed has a random sign at rest, where the gear has no loss."""
    time = np.arange(0.0, RISE.time[-1], 1e-3)
    assert RISE.position is not None
    trace = read_trace(
        {"t": time, "x_m": 1e-6 * np.round(1e6 * np.interp(time, RISE.time, RISE.position[:, 0]))}
    )
    machine = axis(drive=Drive(screw_lead=0.02, efficiency=0.5))
    planned, found = (drive_requirements(simulate(machine, one)) for one in (RISE, motion_from_trace(trace)))
    assert planned.motor is not None and found.motor is not None
    assert found.motor.rms_torque == pytest.approx(planned.motor.rms_torque, rel=5e-3)
    still = found.time > RISE.time[-1] - 0.2
    assert found.motor.torque[still] == pytest.approx(planned.holding_torque, rel=1e-2)


def test_report_states_holding_force_and_power_fed_back() -> None:
    machine = axis(drive=Drive(screw_lead=0.02))
    text = " ".join(result_report(simulate(machine, RISE)).text().split())
    assert "holds the cart at rest against gravity with 490 N at the cart, 1.56 N m at the motor" in text
    assert "Power flows back from the cart, up to" in text
    assert "against gravity" not in result_report(simulate(axis(0.0), RISE)).text()


@pytest.mark.parametrize("elastic", [False, True])
@pytest.mark.parametrize("build", [cart, cart_clear, preloaded])
def test_nothing_holds_a_horizontal_axis(build: Callable[[], Machine], elastic: bool) -> None:
    """Whatever the rounding of the loads of its carriages, which gravity across the rails presses and lifts."""
    machine = build().model_copy(update={"gravity": (0.0, -9.0, 3.0), "drive": Drive(screw_lead=0.02)})
    if elastic:
        screw = link("screw", stiffness=1e7, damping=1e3)
        machine = machine.model_copy(update={"links": (screw,), "free": ("x", *machine.free)})
    still = Motion.along_x([0.0, 0.01], [0.0, 0.0], velocity=[0.0, 0.0])
    needed = drive_requirements(simulate(machine, still))
    assert needed.holding_force == needed.holding_torque == 0.0


def test_gravity_along_the_travel_changes_neither_vibration_nor_response() -> None:
    """Of a linear machine: loads minus those at rest are the same for any direction of gravity."""
    upright, flat = simulate(axis(), RISE).quantities, simulate(axis(0.0), RISE).quantities
    moving = [data["force"] - data["static_force"] for data in (upright, flat)]
    assert np.abs(moving[0] - moving[1]).max() <= 1e-9 * np.abs(moving[0]).max()
    tool = [{"name": "tool", "at": (0.1, 0.2, 0.3)}]
    answers = [frequency_response(axis(angle, points=tool)).displacement for angle in (0.0, 90.0)]
    assert np.array_equal(*answers)


def test_an_elastic_drive_has_force_power_torque_and_holding_force() -> None:
    """A screw so stiff that nothing moves along x has those of the rigid drive; its own vibration comes in addition."""
    drive = Drive(screw_lead=0.02, efficiency=0.9, motor_inertia=1e-4)
    rigid = axis(drive=drive, friction=Friction(seal=5.0))
    screw = {"name": "screw", "point": (0.0, 0.0, 0.0), "direction": (1.0, 0.0, 0.0)}
    all_dofs = ("x", *rigid.free)
    stiff, soft = (
        rigid.model_copy(update={"links": (Link(**screw, stiffness=k, damping=d),), "free": all_dofs})
        for k, d in ((1e11, 1e6), (2e7, 4e3))
    )
    held, firm, springy = (drive_requirements(simulate(one, RISE)) for one in (rigid, stiff, soft))
    assert held.motor is not None and firm.motor is not None and held.power is not None
    # Along x the stiff machine is 5000 times as stiff as the guides, which both have.
    scale = 2e-3 * held.peak_force
    assert firm.force == pytest.approx(held.force, abs=scale)
    assert firm.power == pytest.approx(held.power, abs=scale * 0.5)
    assert firm.motor.torque == pytest.approx(held.motor.torque, abs=2e-3 * np.abs(held.motor.torque).max())
    for one in (held, firm, springy):
        assert one.holding_force == pytest.approx(MASS * G, rel=1e-9)
    still = simulate(soft, RISE)
    body = still.quantities["acceleration"][:, 0] - still.quantities["acceleration"][:, 5] * ARM
    inertia = MASS * (still.quantities["cart_acceleration"][:, 0] + body + G)
    assert springy.reaction == pytest.approx(inertia, abs=1e-6 * MASS * G)


@pytest.mark.parametrize(
    ("elastic", "words"),
    [(False, "The drive is rigid"), (True, "The drive is elastic: x is free, and screw")],
)
def test_a_report_says_what_the_drive_is_and_has_its_figures(elastic: bool, words: str) -> None:
    machine = axis(
        drive=Drive(screw_lead=0.02), points=[{"name": "tool", "at": (0, 0.1, 0), "settle_window": 1e-5}]
    )
    screw = Link(name="screw", point=(0, 0, 0), direction=(1, 0, 0), stiffness=2e7, damping=4e3)
    if elastic:
        machine = machine.model_copy(update={"links": (screw,), "free": ("x", *machine.free)})
    text = " ".join(result_report(simulate(machine, RISE)).text().split())
    assert words in text
    for figure in ("drive force", "power at the cart", "motor torque", "holds the cart at rest", "tool 10.0"):
        assert figure in text
