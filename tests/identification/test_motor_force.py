"""Motor force: exact derivatives, known values found again, and the published mass of a measured axis."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hammer_tests import derivative_errors, unknown
from motor_records import MASS, OFFSET, SEAL, VISCOUS, axis, force_of, moves, seen

from guideload import Machine, Motion, motion_from_trace, read_trace
from guideload.base.errors import ArgumentError, TraceError
from guideload.identification.model import Model
from guideload.identification.motor_force import MotorForce
from guideload.identification.result import identify
from guideload.identification.unknowns import UnknownTable
from guideload.identification.written_files import machine_text
from guideload.reports.identification import identification_report

MASS_OF = (UnknownTable(path="body.mass"),)
NOMINAL = {"friction": {"seal": 7.0, "viscous": 150.0}}
DRIVE = {"screw_lead": 0.02, "efficiency": 0.9, "motor_inertia": 1e-4}


@pytest.fixture(scope="module")
def motion() -> Motion:
    return moves(3.0)


def test_derivatives_are_exact(motion: Motion) -> None:
    """Against central differences, for a torque with losses and an unknown delay."""
    machine = axis(drive=DRIVE)
    model = Model(machine, unknown(machine, *MASS_OF, UnknownTable(path="carriages.*.stiffness_y")))
    time = motion.time[50:-50] + 0.0003
    data = MotorForce.of(machine, motion, time, np.sin(time), torque=True, delayed=True)
    nuisance = np.array([9.0, 180.0, 0.2, 0.002])
    own_steps = 1e-6 * np.array([10.0, 100.0, 1.0, 1e-2])
    errors, own = derivative_errors(data, model, np.array([0.1, -0.2]), nuisance, 1e-6, own_steps)
    assert errors.max() < 1e-6 and own.max() < 1e-4


def test_exact_force_gives_mass_friction_offset_and_delay(motion: Motion) -> None:
    true, nominal = axis(), axis(body={**axis().body.model_dump(), "mass": 120.0}, **NOMINAL)
    delay = 0.0021
    time = motion.time[20:-20]
    force = force_of(true, motion, time - delay) + OFFSET
    data = MotorForce.of(nominal, motion, time, force, delayed=True)
    found = identify(nominal, MASS_OF, [data], starts=1)
    assert found.estimates[0].value == pytest.approx(MASS, rel=1e-6)
    nuisance = found.nuisance_values(found.data[0])
    assert nuisance == pytest.approx([SEAL, VISCOUS, OFFSET, delay], rel=1e-5)


def test_two_records_share_the_friction_of_the_machine(motion: Motion, tmp_path: Path) -> None:
    """A record and its copy: the same values, half the variance of one, and one row of each key in the file."""
    nominal, noise = axis(**NOMINAL), 2.0 * np.random.default_rng(2).standard_normal(motion.time.size)
    values = force_of(axis(), motion, motion.time) + OFFSET + noise
    names = "motor force", "copy"
    data = [MotorForce.of(nominal, motion, motion.time, values, name=name, level=2.0) for name in names]
    alone, both = (identify(nominal, MASS_OF, one, starts=1) for one in (data[:1], data))
    friction = slice(1, 3)
    assert both.fit.minimum.x[friction] == pytest.approx(alone.fit.minimum.x[friction], rel=1e-6)
    # The sums over windows are in another order.
    assert both.covariance[friction, friction] == pytest.approx(
        0.5 * alone.covariance[friction, friction], rel=1e-5
    )
    assert len({one.value for each in both.data for one in both.nuisance_estimates(each)[:2]}) == 2
    nominal.to_toml(tmp_path / "machine.toml")
    text = machine_text(both, tmp_path / "machine.toml", tmp_path)
    (tmp_path / "after.toml").write_text(text, encoding="utf-8")
    after = Machine.from_toml(tmp_path / "after.toml").friction
    seal, viscous = (one.value for one in both.nuisance_estimates(both.data[0])[:2])
    assert (after.seal, after.viscous) == pytest.approx((seal, viscous), rel=1e-5)


def test_samples_of_a_coarse_encoder_do_not_pull_the_mass(motion: Motion) -> None:
    """A quantum of 20 um at 1 kHz: differentiated twice it would be 14 m/s2 of noise on 3 m/s2 of motion."""
    machine, rng = axis(**NOMINAL), np.random.default_rng(3)
    force = force_of(axis(), motion, motion.time) + OFFSET
    force += 5.0 * rng.standard_normal(force.size)
    data = MotorForce.of(machine, seen(motion, 2e-5), motion.time, force)
    one = identify(machine, MASS_OF, [data], starts=1).estimates[0]
    assert one.low < MASS < one.high and one.value == pytest.approx(MASS, rel=0.01)


def test_jumps_of_acceleration_in_a_slow_trace_do_not_pull_the_mass() -> None:
    """Trapezoids of velocity at 100 Hz, the force at 1 kHz: errors of both signs, each of some 0.15 kg."""
    nominal, errors = axis(**NOMINAL), []
    for seed in range(4):
        rng, time = np.random.default_rng(seed), np.arange(0.0, 6.0, 1e-3)
        acceleration, start, side = np.zeros(time.size), 0.2, 1.0
        while start < 5.0:
            size, ramp = rng.uniform(2.0, 4.0), rng.uniform(0.15, 0.3)
            for first, sign in ((start, side), (start + ramp + 0.1, -side)):
                acceleration[(time >= first) & (time < first + ramp)] += sign * size
            start, side = start + 2.0 * ramp + rng.uniform(0.2, 0.4), -side
        velocity = np.append(0.0, np.cumsum(0.5e-3 * (acceleration[1:] + acceleration[:-1])))
        motion = Motion.along_x(time, acceleration, velocity=velocity)
        force = force_of(axis(), motion, time) + OFFSET + 2.0 * rng.standard_normal(time.size)
        data = MotorForce.of(nominal, seen(motion, step=10), time, force)
        one = identify(nominal, MASS_OF, [data], starts=1).estimates[0]
        assert one.low < MASS < one.high
        errors.append(one.value - MASS)
    assert abs(np.mean(errors)) < 0.2  # three standard errors


def test_what_the_drive_force_cannot_tell_is_refused(motion: Motion) -> None:
    time = motion.time
    for machine, words in (
        (axis(friction={"coefficient": 0.003}), "friction.coefficient.*leave it out"),
        (axis(free=["x", "y", "z", "rx", "ry", "rz"]), "hold x"),
    ):
        with pytest.raises(ArgumentError, match=words):
            MotorForce.of(machine, motion, time, np.sin(time))
    with pytest.raises(ArgumentError, match="drive.*give a force"):
        MotorForce.of(axis(), motion, time, np.sin(time), torque=True)
    with pytest.raises(TraceError, match="does not overlap"):
        MotorForce.of(axis(), motion, time + 100.0, np.sin(time))


@cache
def emps(file: Path) -> tuple[Machine, Motion, np.ndarray, np.ndarray]:
    """A measured ball screw axis with 40 kg too much in the machine file, its motion, stamps and force."""
    table, motion = pd.read_csv(file), motion_from_trace(read_trace(file))
    body = {"mass": 135.0, "center_of_mass": [0.0, 0.0, 0.0], "inertia": np.eye(3).tolist()}
    return axis(body=body, **NOMINAL), motion, motion.time, 35.15065 * table["u_V"].to_numpy()


@pytest.mark.parametrize(
    "part", [(-np.inf, np.inf), (0.0, 12.45), (12.45, np.inf)], ids=["all", "first", "second"]
)
def test_mass_of_emps(shared_data: Path, part: tuple[float, float]) -> None:
    """The published 95.11 kg within 0.5 % and inside the interval, in the whole record and in each half alone."""
    machine, motion, time, force = emps(shared_data / "emps_bangbang_1kHz.csv")
    found = identify(machine, MASS_OF, [MotorForce.of(machine, motion, time, force, part=part)], starts=1)
    one = found.estimates[0]
    assert one.value == pytest.approx(95.11, rel=0.005)
    assert one.low < 95.11 < one.high and one.high - one.low < 2.0


@pytest.mark.parametrize("torque", [False, True])
def test_in_one_direction_only_the_sum_of_dry_friction_and_offset_is_known(
    motion: Motion, torque: bool
) -> None:
    """A trip there: the sum is that of the machine, and neither of the two has a value of its own."""
    drive = {"gear_ratio": 4.0, "screw_lead": 0.02}
    true, nominal = axis(drive=drive), axis(drive=drive, **NOMINAL)
    shift = 1.1 * float(np.abs(motion.velocity[:, 0]).max())
    there = Motion.along_x(motion.time, motion.acceleration[:, 0], velocity=motion.velocity[:, 0] + shift)
    lever = true.drive.speed_per_motor_speed if torque else 1.0
    noise = np.random.default_rng(1).normal(0.0, 0.5, there.time.size)
    values = lever * (force_of(true, there, there.time) + OFFSET + noise)
    data = MotorForce.of(nominal, there, there.time, values, torque=torque)
    found = identify(nominal, MASS_OF, [data], starts=1)
    (group,) = found.undetermined
    assert group.combinations == 1 and "offset of motor force" in group.names and len(group.names) == 2
    ends = [float(end) for end in re.search(r"\((\S+) to (\S+)\)$", group.words).groups()]
    assert ends[0] < lever * (2.0 * SEAL + OFFSET) < ends[1] and np.ptp(ends) < 2.0 * lever
    by_name = {one.parameter.name.split()[0]: one for one in found.nuisance_estimates(data)}
    identified = {name for name, one in by_name.items() if one.is_identified}
    assert identified == {"friction.viscous"} and len(by_name) == 3
    text = " ".join(identification_report(found).text().split())
    assert group.words in text and "friction.seal -" in text
    both = MotorForce.of(nominal, motion, motion.time, force_of(true, motion, motion.time) + OFFSET)
    assert not identify(nominal, MASS_OF, [both], starts=1).undetermined
