"""Force and torque of the drive: printed examples, power balance, the push of a rack."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from machines import link, table
from moves import BRISK
from reference import cart, cart_clear, preloaded

from guideload import (
    ArgumentError,
    Body,
    ConfigError,
    Drive,
    Friction,
    Machine,
    Motion,
    Moves,
    motion_from_trace,
    read_trace,
    simulate,
)
from guideload.drive import DriveRequirements, drive_requirements
from guideload.drive.requirements import rms, share_of_push
from guideload.machine.riders import Rider
from guideload.motion.motion import refined, with_instants
from guideload.motion.standstill import is_moving
from guideload.reports.run import result_report

G = 9.80665
RACK = {
    "gear_ratio": 10.0,
    "pinion_diameter": 0.1,
    "pressure_angle": "20 deg",
    "push_direction": (0.0, 1.0, 0.0),
}


def motion(sign: float = 1.0) -> Motion:
    """A brisk move, with velocity."""
    time = BRISK.times(1e3)
    place, speed, acceleration = (sign * history for history in BRISK.motion(time))
    return Motion.along_x(time, acceleration, velocity=speed, position=place)


def slide(mass: float, friction: Friction, gravity: tuple[float, float, float] = (0.0, -G, 0.0)) -> Machine:
    """A point-like mass in the middle of four stiff carriages."""
    body = Body(mass=mass, center_of_mass=(0, 0, 0), inertia=np.eye(3) * mass * 0.01)
    return table(body, 0.6, 0.4, friction=friction, gravity=gravity)


def constant(acceleration: float, speed: float) -> Motion:
    """0.01 s of a constant acceleration that begins at a speed."""
    time = np.linspace(0.0, 0.01, 11)
    return Motion.along_x(time, np.full(11, acceleration), velocity=speed + acceleration * time)


def at_start(machine: Machine, move: Motion) -> float:
    """The force of the drive at the first instant, before the body vibrates."""
    return float(drive_requirements(simulate(machine, move)).force[0])


def test_printed_forces_of_a_horizontal_table() -> None:
    """THK: 80 kg, mu 0.003, 15 N of seals, 6.67 m/s2: 550, 17, -516 N when it starts, moves evenly, stops."""
    horizontal = slide(80.0, Friction(coefficient=0.003, seal=15.0 / 4))
    forces = [at_start(horizontal, constant(a, 1.0)) for a in (6.67, 0.0, -6.67)]
    assert forces == pytest.approx([550.0, 17.0, -516.0], abs=1.0)


def test_printed_forces_of_a_vertical_table() -> None:
    """THK: 50 kg, 20 N of friction, 1.5 m/s2, g 9.8; up 585, 510, 435 N, down 395, 470, 545 N."""
    vertical = slide(50.0, Friction(seal=5.0), gravity=(-9.8, 0.0, 0.0))
    up = [at_start(vertical, constant(a, 1.0)) for a in (1.5, 0.0, -1.5)]
    down = [at_start(vertical, constant(a, -1.0)) for a in (-1.5, 0.0, 1.5)]
    assert up == pytest.approx([585.0, 510.0, 435.0], abs=1e-6)
    assert down == pytest.approx([395.0, 470.0, 545.0], abs=1e-6)
    assert drive_requirements(simulate(vertical, constant(0.0, 0.0))).holding_force == pytest.approx(490.0)


def geared(**changes: object) -> DriveRequirements:
    drive = Drive(**({"gear_ratio": 10.0, "pinion_diameter": 0.1} | changes))
    machine = cart().model_copy(
        update={"drive": drive, "friction": Friction(coefficient=0.004, seal=8.0, viscous=20.0)}
    )
    return drive_requirements(simulate(machine, motion()))


@pytest.mark.parametrize("output", [{"pinion_diameter": 0.1}, {"pinion_diameter": None, "pulley_diameter": 0.08},
                                    {"pinion_diameter": None, "screw_lead": 0.02}, {"gear_ratio": -3.0}])  # fmt: skip
def test_a_gear_without_loss_keeps_the_power(output: dict[str, float]) -> None:
    """Power of the motor = power at the cart; with an efficiency the difference is the loss in either direction."""
    needed = geared(**output)
    assert needed.motor is not None and needed.power is not None
    assert np.allclose(
        needed.motor.torque * needed.motor.speed, needed.power, atol=1e-9 * np.abs(needed.power).max()
    )
    lossy = geared(**output, efficiency=0.8)
    assert lossy.motor is not None
    power = lossy.motor.torque * lossy.motor.speed
    assert np.allclose(power, np.where(needed.power > 0, needed.power / 0.8, 0.8 * needed.power), atol=1e-6)
    assert (power >= needed.power - 1e-6).all()


def test_inertia_of_the_motor_takes_torque_by_its_acceleration() -> None:
    plain, heavy = geared(), geared(motor_inertia=0.01)
    assert plain.motor is not None and heavy.motor is not None
    expected = 0.01 * motion().acceleration[:, 0] * 10.0 / 0.05
    assert np.allclose(heavy.motor.torque - plain.motor.torque, expected, atol=1e-9)


def test_use_of_the_torque_curve() -> None:
    """The curve is linear between its points; beyond the last there is no torque."""
    curve = [(0.0, 40.0), (200.0, 40.0), (400.0, 20.0)]
    motor = geared(torque_curve=curve).motor
    assert motor is not None and motor.use is not None and motor.largest_torque is not None
    fast = int(np.abs(motor.speed).argmax())
    assert motor.largest_torque[fast] == pytest.approx(40.0 - (abs(motor.speed[fast]) - 200.0) / 10.0)
    short = geared(torque_curve=[(0.0, 40.0), (100.0, 40.0)]).motor
    assert short is not None and short.use is not None and np.isinf(short.use.max())


def test_rms_is_that_of_straight_lines() -> None:
    """Of t from 0 to 2, rms = 2/sqrt(3), on any stamps; a jump counts no time."""
    for time in ([0.0, 2.0], [0.0, 0.3, 0.3, 1.9, 2.0]):
        assert rms(np.array(time), np.array(time)) == pytest.approx(2.0 / np.sqrt(3.0), rel=1e-14)


@pytest.mark.parametrize("machine", [cart, cart_clear, preloaded])
def test_peaks_are_those_at_any_time(machine: Callable[[], Machine]) -> None:
    """With friction and a motor: as under the same motion with 64 times as many stamps."""
    time = np.linspace(0.0, 1.0, 101)
    rate = np.where((time > 0.1) & (time < 0.4), 2.2, np.where((time > 0.6) & (time < 0.9), -2.2, 0.0))
    speed = np.append(0.0, np.cumsum(0.005 * (rate[1:] + rate[:-1])))
    place = np.append(0.0, np.cumsum(0.01 * speed[:-1] + 1e-4 / 6.0 * (2.0 * rate[:-1] + rate[1:])))
    coarse = Motion.along_x(time, rate, velocity=speed, position=place)
    curve = ((0.0, 90.0), (600.0, 20.0))
    drive = Drive(screw_lead=0.02, motor_inertia=1e-3, efficiency=0.85, torque_curve=curve)
    friction = Friction(coefficient=0.004, seal=5.0, viscous=20.0)
    driven = machine().model_copy(update={"drive": drive, "friction": friction})

    def largest(needed: DriveRequirements) -> list[float]:
        assert needed.power is not None and needed.motor is not None and needed.motor.use is not None
        signed = needed.power, -needed.power, needed.motor.use
        sizes = map(np.abs, (needed.force, needed.motor.torque, needed.motor.speed))
        return [float(history.max()) for history in (*signed, *sizes)]

    parts = np.full(time.size - 1, 64)
    needed = drive_requirements(simulate(driven, coarse))
    dense = drive_requirements(simulate(driven, refined(coarse, parts)))
    within = 1e-6 if machine is preloaded else 1e-9
    np.testing.assert_allclose(largest(needed.with_peaks), largest(dense.with_peaks), rtol=within)
    assert (np.array(largest(needed)) < (1.0 - 1e-4) * np.array(largest(dense))).any()


def test_friction_and_loss_just_after_a_start_and_beside_a_reversal_count() -> None:
    """In closed form, of a body that no acceleration along x makes vibrate."""
    time = np.linspace(0.0, 0.3, 4)
    rate, speed = 4.0 - 10.0 * time, 4.0 * time - 5.0 * time**2
    drive = Drive(screw_lead=0.02, efficiency=0.8)
    one = slide(100.0, Friction(seal=50.0)).model_copy(update={"drive": drive})
    starting = drive_requirements(simulate(one, Motion.along_x(time, rate, velocity=speed))).with_peaks
    assert starting.motor is not None
    assert starting.motor.torque.max() == pytest.approx(600.0 / 0.8 * 0.02 / (2.0 * np.pi), rel=1e-5)
    turning = drive_requirements(simulate(one, Motion.along_x(time, rate, velocity=speed - 0.13))).with_peaks
    root = np.roots([-5.0, 4.0, -0.13]).min()
    beside = np.abs(turning.time - root) < 1e-6
    force = 100.0 * (4.0 - 10.0 * root)
    found = turning.force[beside]
    assert [found.min(), found.max()] == pytest.approx([force - 200.0, force + 200.0], rel=1e-5)


def test_the_margin_of_torque_counts_up_to_the_last_speed_of_the_curve() -> None:
    """In closed form: a constant torque under a curve that falls, passed between two stamps."""
    time, lever = np.linspace(0.0, 0.3, 4), 0.02 / (2.0 * np.pi)
    curve = ((0.0, 90.0), (0.53 / lever, 20.0))
    one = slide(100.0, Friction(seal=0.0)).model_copy(
        update={"drive": Drive(screw_lead=0.02, torque_curve=curve)}
    )
    for sign in (1.0, -1.0):
        moved = Motion.along_x(time, np.full(4, sign * 4.0), velocity=sign * 4.0 * time)
        margins = drive_requirements(simulate(one, moved)).margins
        assert margins["motor torque"] == pytest.approx(20.0 / (400.0 * lever), rel=1e-5)
        assert margins["motor speed"] == pytest.approx(0.53 / 1.2, rel=1e-12)


def ringing() -> Machine:
    """A table whose vibration amplifies changes of the push 2.4 times."""
    body = Body(mass=306.0, center_of_mass=(0.3, -0.2, 0.05), inertia=np.diag([26.0, 20.0, 28.0]))
    return table(body, 0.3, 0.66, stiffness_y=4.5e8, damping_y=1e4, damping_z=1e4)


def pulse() -> Motion:
    """0.3 s that begin with an acceleration of 0.1 s."""
    time = np.arange(601) / 2000.0
    acceleration = np.where(time < 0.1, 5.0 * np.sin(10.0 * np.pi * time) ** 2, 0.0)
    speed = np.cumsum(acceleration) / 2000.0 - acceleration / 4000.0
    return Motion.along_x(time, acceleration, velocity=speed)


@pytest.mark.parametrize(
    ("build", "motion"), [(cart, motion), (cart_clear, motion), (preloaded, motion), (ringing, pulse)]
)
def test_push_of_the_rack_belongs_to_the_force(
    build: Callable[[], Machine], motion: Callable[[], Motion]
) -> None:
    """The result is that of the push as a process force at L, and the push follows from the force of that result."""
    machine = build().model_copy(
        update={"drive": Drive(**RACK, helix_angle="15 deg"), "friction": Friction(seal=20.0)}
    )
    result = simulate(machine, motion(), rtol=1e-9)
    needed = drive_requirements(result)
    expected = np.abs(needed.force) * np.tan(np.radians(20.0)) / np.cos(np.radians(15.0))
    assert needed.push == pytest.approx(expected, rel=1e-12)
    bare = machine.model_copy(update={"drive": None})
    force = np.zeros((expected.size, 3))
    force[:, 1] = expected
    stamps = result.quantities["time"]
    pushed = with_instants(motion(), stamps).with_force((0, 0, 0), force)
    by_hand = simulate(bare, pushed, rtol=1e-9, times=stamps)
    scale = np.abs(by_hand.quantities["force"]).max()
    assert np.abs(result.quantities["force"] - by_hand.quantities["force"]).max() <= 1e-8 * scale


def test_push_does_not_depend_on_the_direction_of_travel() -> None:
    """A table that is symmetric in x is pushed alike when it moves forwards and backwards."""
    machine = slide(80.0, Friction()).model_copy(update={"drive": Drive(**RACK)})
    there, back = (drive_requirements(simulate(machine, motion(sign))) for sign in (1.0, -1.0))
    assert there.push.max() > 80.0
    assert back.push == pytest.approx(there.push, rel=1e-9, abs=1e-9)


PATHS = [{}, {"times": [0.5, 1.0, 1.7, 2.0]}, {"method": "implicit", "step": 1e-3}]


@pytest.mark.parametrize("keys", PATHS)
def test_the_push_follows_the_force_between_the_stamps(keys: dict[str, Any]) -> None:
    """A slow process force of four stamps along x, without inertia: the load of each carriage is in closed form."""
    machine = slide(80.0, Friction()).model_copy(update={"drive": Drive(**RACK)})
    time, wrench = np.array([0.0, 0.5, 1.5, 2.0]), np.zeros((4, 6))
    wrench[:, 0] = [0.0, 1000.0, -1000.0, 0.0]
    velocity = np.tile([0.05, 0.0, 0.0], (4, 1))
    result = simulate(machine, Motion(time, np.zeros((4, 3)), velocity, wrench=wrench), **keys)
    instants, loads = result.quantities["time"], result.quantities["force"][:, :, 1]
    push = np.tan(np.radians(20.0)) * np.abs(np.interp(instants, time, wrench[:, 0]))
    # The table swings by some 1e-6 of the weight at the corners of the force.
    assert loads == pytest.approx(np.tile((push - 80.0 * G)[:, None] / 4.0, (1, 4)), abs=0.1)
    if "times" not in keys:
        mean = 0.5 * np.tan(np.radians(20.0)) * 1000.0
        assert np.trapezoid(loads[:, 0], instants) / 2.0 == pytest.approx((mean - 80.0 * G) / 4.0, abs=0.1)


@pytest.mark.parametrize("keys", PATHS)
def test_the_push_does_not_depend_on_the_samples(keys: dict[str, Any]) -> None:
    """A move given by its corners, and with 500 samples in each interval."""
    machine = cart().model_copy(update={"drive": Drive(**RACK)})
    coarse = Motion.along_x([0.0, 0.5, 0.55, 1.5, 1.6, 2.0], [0.0, 3.0, -2.0, -2.0, 1.0, 0.0])
    found = simulate(machine, coarse, **keys).quantities
    wanted = simulate(machine, refined(coarse, np.full(5, 500)), times=found["time"]).quantities["force"]
    push = found["wrench"][:, 1].max()
    assert push > 1000.0
    # Between two stamps the push is followed to a quarter of a percent.
    assert np.abs(found["force"] - wanted).max() < 0.0025 * push


def test_share_of_the_push_in_the_peaks() -> None:
    """It is found from the result alone, and agrees with two runs."""
    machine = cart().model_copy(update={"drive": Drive(**RACK)})
    result = simulate(machine, motion())
    without = simulate(cart(), motion()).peak_columns["peak_resultant_N"]
    share = share_of_push(result, drive_requirements(result))
    assert share == pytest.approx(1.0 - without / result.peak_columns["peak_resultant_N"], abs=1e-9)
    assert np.abs(share).max() > 0.01
    assert "Share of this push" in " ".join(result_report(result).text().split())


def test_share_of_the_push_with_riders_agrees_with_two_runs() -> None:
    """Riders that move, and riders with a motion in the file that stand, move or stand without the push too."""
    slide = {"name": "slide", "mass": 180.0, "center_of_mass": (0.1, 0.3, -0.2), "inertia": np.eye(3) * 9.0}
    riders = (Rider(**slide, direction=(0.2, -0.1, 2.0), motion="slide.toml"),)
    without = cart().model_copy(update={"riders": riders})
    machine = without.model_copy(update={"drive": Drive(**RACK)})
    for travels in ({}, {"slide": motion(-0.5)}):
        pushed, free = (simulate(one, motion(), riders=travels) for one in (machine, without))
        share = share_of_push(pushed, drive_requirements(pushed))
        peaks, bare = (one.peak_columns["peak_resultant_N"] for one in (pushed, free))
        assert share == pytest.approx(1.0 - bare / peaks, abs=1e-6)
        assert np.abs(share).max() > 0.01


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"pinion_diameter": 0.1, "screw_lead": 0.02}, "exactly one of pinion_diameter"),
        ({}, "exactly one of pinion_diameter"),
        ({"linear_motor": True, "gear_ratio": 2.0}, "no gear_ratio beside linear_motor"),
        ({"pinion_diameter": 0.1, "pressure_angle": "20 deg"}, "both pressure_angle and push_direction"),
        (
            {"screw_lead": 0.1, "pressure_angle": "20 deg", "push_direction": (0, 1, 0)},
            "pinion_diameter beside",
        ),
        ({"pinion_diameter": 0.1, "helix_angle": "20 deg"}, "pressure_angle beside helix_angle"),
        (RACK | {"push_direction": (1.0, 1.0, 0.0)}, "across the rails"),
        (RACK | {"pressure_angle": "89 deg"}, "an angle"),
        ({"pinion_diameter": 0.1, "efficiency": 1.2}, "an efficiency"),
        ({"pinion_diameter": 0.1, "efficiency": 0.0}, "> 0"),
        ({"pinion_diameter": 0.1, "efficiency": 5e-324}, "an efficiency from 0.01 to 1"),
        ({"linear_motor": True, "efficiency": 0.9}, "no efficiency beside linear_motor"),
        ({"pinion_diameter": 0.1, "torque_curve": [("0 rpm", 3.0)]}, "at least 2 entries"),
        ({"linear_motor": "yes"}, "linear_motor: expected true or false"),
        ({"pinion_diameter": 0.1, "torque_curve": [("100 rpm", 3.0), ("0 rpm", 3.0)]}, "ascending speed"),
    ],
)
def test_impossible_drives_are_refused(values: dict[str, object], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        Drive(**values)


def test_what_cannot_be_known_is_refused() -> None:
    free = cart().with_free(("x", "y", "z", "rx", "ry", "rz"))
    still = replace(motion(), velocity=None)
    with pytest.raises(ArgumentError, match="velocity: friction needs"):
        drive_requirements(simulate(cart().model_copy(update={"friction": Friction(seal=2.0)}), still))
    with pytest.raises(ArgumentError, match="a linear motor does not turn"):
        _ = Drive(linear_motor=True).speed_per_motor_speed
    held = free.model_copy(update={"links": (link("rack", stiffness=1e8),), "drive": Drive(**RACK)})
    with pytest.raises(ArgumentError, match="x is free"):
        simulate(held, motion())


def test_the_rms_of_huge_and_of_no_forces_is_finite() -> None:
    time = np.array([0.0, 1.0, 3.0])
    assert rms(time, np.zeros(3)) == 0.0
    assert rms(time, 1e200 * np.array([3.0, 3.0, 3.0])) == pytest.approx(3e200, rel=1e-14)
    assert rms(time, np.array([0.0, 3.0, 0.0])) == pytest.approx(np.sqrt(3.0), rel=1e-14)


@pytest.mark.parametrize("quantum", [1e-7, 1e-6, 2e-5])
def test_a_trace_has_no_friction_at_rest(quantum: float) -> None:
    """An estimated speed is not quite zero there; dry friction with its random sign would heat the motor."""
    friction, time = Friction(seal=25.0), np.arange(0.0, 4.0, 1e-3)
    s = np.clip((time - 1.5) / 0.6, 0.0, 1.0)
    place = 0.5 * (s - np.sin(2.0 * np.pi * s) / (2.0 * np.pi))
    speed, on = 0.5 / 0.6 * (1.0 - np.cos(2.0 * np.pi * s)), (time > 1.5) & (time < 2.1)
    acceleration = 0.5 / 0.36 * 2.0 * np.pi * np.sin(2.0 * np.pi * s) * on
    planned = Motion.along_x(time, acceleration, velocity=speed * on, position=place)
    table = {"t [s]": time, "x [m]": quantum * np.round(place / quantum)}
    machine = slide(80.0, friction)
    found, exact = (
        drive_requirements(simulate(machine, one)) for one in (motion_from_trace(read_trace(table)), planned)
    )
    rest = (found.time < 1.45) | (found.time > 2.15)
    assert not found.friction[rest].any() and np.abs(exact.friction).max() == pytest.approx(100.0)
    assert found.rms_force == pytest.approx(exact.rms_force, rel=0.01)


def test_slow_moves_there_and_back_have_friction() -> None:
    """Legs of 0.1 mm at 0.1 mm/s after a fast move, with no stamp at a reversal."""
    time = np.arange(0.0, 8.0, 1e-3) + 0.37e-3
    fast = np.interp(time, [0.2, 0.4, 1.8, 2.0], [0.0, 1.0, 1.0, 0.0])
    legs = 1e-4 * np.clip(10.0 * np.sin(np.pi * (time - 2.0)), -1.0, 1.0)
    speed = fast + np.where(time > 2.0, legs, 0.0)
    along = np.zeros((2, time.size, 3))
    along[:, :, 0] = np.gradient(speed, time), speed
    assert np.array_equal(is_moving(time, *along), speed != 0.0)


def test_a_trace_rests_before_and_after_it_creeps() -> None:
    """A fast move, a dwell, a move at 5 mm/s, a dwell: the last three are one slow stretch."""
    fine = np.arange(0.0, 4.3, 1e-4)
    corners = [0.5, 0.7, 1.8, 2.0, 2.3, 2.305, 3.295, 3.3]
    speed = np.interp(fine, corners, [0.0, 1.0, 1.0, 0.0, 0.0, 5e-3, 5e-3, 0.0])
    place = np.append(0.0, np.cumsum(0.5e-4 * (speed[1:] + speed[:-1])))[::10]
    measured = motion_from_trace(read_trace({"t [s]": fine[::10], "x [m]": 1e-6 * np.round(1e6 * place)}))
    assert measured.velocity is not None
    moving = is_moving(measured.time, measured.acceleration, measured.velocity)
    assert np.mean(moving != (speed[::10] > 0.0)) < 0.005  # of the ends


def test_a_trace_of_speeds_rests() -> None:
    """The integral of their noise drifts."""
    time = np.arange(0.0, 5.0, 1e-3)
    speed = np.interp(
        time, [0.5, 0.9, 1.5, 1.9, 3.0, 3.4, 4.0, 4.4], [0.0, 1.0, 1.0, 0.0, 0.0, -1.0, -1.0, 0.0]
    )
    noise = 3e-4 * np.random.default_rng(0).normal(size=time.size)
    measured = motion_from_trace(read_trace({"t [s]": time, "v [m/s]": speed + noise}, column="v [m/s]"))
    assert measured.velocity is not None
    moving = is_moving(measured.time, measured.acceleration, measured.velocity)
    assert np.mean(moving != (speed != 0.0)) < 0.02


@pytest.mark.parametrize("profile", ["jerk limited", "sine squared", "polynomial 5"])
def test_a_planned_motion_stands_exactly(profile: str) -> None:
    limits = {"speed": 1.0, "acceleration": 5.0, "jerk": 200.0, "profile": profile}
    steps = [{"distance": 0.3, "dwell": 0.2}, {"distance": 0.2}, {"distance": -0.5, "dwell": 0.1}]
    planned = Moves(limits=limits, moves=steps).motion()
    assert planned.velocity is not None
    moving = is_moving(planned.time, planned.acceleration, planned.velocity)
    known = np.abs(planned.velocity[:, 0]) > 1e-12
    assert np.array_equal(moving, known)


def test_creeping_has_friction() -> None:
    """However slow it is beside the moves."""
    time = np.linspace(0.0, 4.0, 4001)
    corners = [0.0, 0.2, 0.8, 1.0, 1.2, 3.8, 4.0]
    speed = np.interp(time, corners, [0.0, 2.0, 2.0, 0.0, 1e-3, 1e-3, 0.0])
    acceleration = np.gradient(speed, time)
    given = np.column_stack([speed, 0.0 * speed, 0.0 * speed])
    creeps = (time > 1.3) & (time < 3.7)
    assert is_moving(time, np.column_stack([acceleration, 0 * time, 0 * time]), given)[creeps].all()
