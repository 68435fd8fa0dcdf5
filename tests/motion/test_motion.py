"""Laws of Motion: refusals, and forces that are added exactly."""

import copy
import dataclasses
import pickle

import numpy as np
import pytest
from trace_files import refuses

from guideload.base.errors import ArgumentTypeError
from guideload.motion.forces import Forces
from guideload.motion.motion import Motion, velocity_at, with_instants
from guideload.motion.moves import Moves

TIME = np.array([0.0, 1.0, 2.0, 2.0, 3.0, 4.0])
ALONG = np.array([0.0, 1.0, 1.0, -1.0, 0.0, 0.5])


def beyond(width: int) -> np.ndarray:
    """A history (6, width) whose last sample has a value beyond any."""
    return np.where(np.eye(6, width, -5), 1e200, 0.0)


def side(motion, name, at, late):
    """The history just before or just after a time, independent of the code under test."""
    time = motion.time
    part = slice(np.flatnonzero(time <= at)[-1], None) if late else slice(np.flatnonzero(time >= at)[0] + 1)
    return np.apply_along_axis(lambda y: np.interp(at, time[part], y), 0, getattr(motion, name)[part])


def test_arrays_are_read_only_copies():
    given = ALONG.copy()
    motion = Motion.along_x(TIME, given, velocity=given)
    given[0] = 9.0
    assert motion.acceleration[0, 0] == 0.0
    assert motion.acceleration.shape == (6, 3) and np.all(motion.acceleration[:, 1:] == 0.0)
    assert motion.velocity is not None and motion.position is None and motion.wrench is None
    with pytest.raises(ValueError, match="read-only"):
        motion.acceleration[0, 0] = 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        motion.source = "other"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"time": [0.0]}, "at least 2 stamps, got 1"),
        ({"time": [0.0, 1.0, 0.5, 2.0, 3.0, 4.0]}, r"time\[2\]: expected at least 1.0 s"),
        ({"time": [0.0, 1.0, 1.0, 1.0, 3.0, 4.0]}, r"time\[1\] to time\[3\]: at most two equal"),
        ({"time": [0.0, 1.0, np.nan, 2.0, 3.0, 4.0]}, r"time\[2\]: expected a finite number, got nan"),
        ({"acceleration": np.zeros((5, 3))}, r"acceleration: expected shape \(6, 3\), got \(5, 3\)"),
        ({"velocity": np.zeros(6)}, r"velocity: expected shape \(6, 3\)"),
        ({"wrench": np.zeros((6, 3))}, r"wrench: expected shape \(6, 6\)"),
        ({"motor_speed": np.zeros((6, 1))}, r"motor_speed: expected shape \(6,\)"),
        ({"acceleration": np.where(np.eye(6, 3, -5), np.inf, 0.0)}, r"acceleration\[5, 0\].*inf"),
        (
            {"acceleration": beyond(3)},
            r"acceleration\[5, 0\]: .* acceleration up to 1e\+08 m/s\^2, got 1e\+200",
        ),
        ({"time": TIME * 1e300}, r"time\[1\]: expected a time up to 1e\+11 s"),
        ({"position": beyond(3)}, r"position\[5, 0\]: expected a position of the cart up to 1e\+07 m"),
        ({"velocity": beyond(3)}, r"velocity\[5, 0\]: expected a speed up to"),
        ({"motor_speed": beyond(1)[:, 0]}, r"motor_speed\[5\]: expected an angular speed up to"),
        ({"wrench": beyond(6)}, r"wrench\[5, 0\]: "),
    ],
)
def test_refusals_name_the_place(change, message):
    given = {"time": TIME, "acceleration": np.zeros((6, 3)), **change}
    refuses(message, Motion, **given)


def test_a_force_on_own_stamps_has_its_moment_about_l():
    point, force, moment = np.array([0.1, -0.2, 0.3]), np.array([5.0, 7.0, -3.0]), np.array([1.0, 2.0, 3.0])
    motion = Motion.along_x(TIME, ALONG).with_force(point, force, moment)
    assert motion.wrench is not None
    assert np.allclose(motion.wrench, [*force, *(moment + np.cross(point, force))], rtol=1e-15)
    assert np.array_equal(motion.time, TIME)
    twice = motion.with_force(point, force, moment)
    assert twice.wrench is not None and np.allclose(twice.wrench, 2.0 * motion.wrench, rtol=1e-15)
    assert len(twice.notes) == 2


def test_a_force_on_other_stamps_is_united_exactly():
    """Both histories are what they were, on either side of every stamp and between stamps."""
    motion = Motion.along_x(TIME, ALONG, velocity=TIME, motor_speed=10.0 * TIME)
    when = np.array([0.5, 1.0, 1.5, 1.5, 2.5])  # begins and ends with a jump, and has one between
    force = np.array([[1.0, 0, 0], [2.0, 0, 0], [4.0, 0, 0], [-1.0, 0, 0], [3.0, 0, 0]])
    both = motion.with_force([0.0, 0.0, 1.0], force, time=when)
    assert both.time.tolist() == [0.0, 0.5, 0.5, 1.0, 1.5, 1.5, 2.0, 2.0, 2.5, 2.5, 3.0, 4.0]
    for at in (0.0, 0.25, 0.5, 0.75, 1.0, 1.2, 1.5, 1.7, 2.0, 2.2, 2.5, 2.8, 3.0, 3.5, 4.0):
        for late in (False, True):
            for name in ("acceleration", "motor_speed"):
                np.testing.assert_allclose(*(side(m, name, at, late) for m in (both, motion)), 1e-14, 1e-15)
            inside = (0.5 <= at < 2.5) if late else (0.5 < at <= 2.5)
            alone = Motion(when, np.zeros((5, 3)), wrench=np.hstack([force, np.zeros((5, 3))]))
            wanted = side(alone, "wrench", at, late)[0] if inside else 0.0
            got = side(both, "wrench", at, late)
            assert got[:3] == pytest.approx([wanted, 0.0, 0.0], abs=1e-14)
            assert got[3:] == pytest.approx([0.0, wanted, 0.0], abs=1e-14)  # z cross x is y


@pytest.mark.parametrize("with_position", [True, False])
def test_the_speed_between_stamps_is_the_integral_of_the_acceleration(with_position: bool) -> None:
    """Exactly, of a linear acceleration; an error of the position has no part in it."""
    time, new = np.array([0.0, 0.5, 2.0]), np.array([0.1, 0.4, 1.3, 1.9])

    def speed(t: np.ndarray) -> np.ndarray:
        return 0.3 + 2.0 * t - 0.7 * t**2

    place = 0.3 * time + time**2 - 0.7 / 3.0 * time**3 + [0.0, 1e-3, 0.0] if with_position else None
    motion = Motion.along_x(time, 2.0 - 1.4 * time, velocity=speed(time), position=place)
    finer = with_instants(motion, new)
    assert finer.velocity is not None
    np.testing.assert_allclose(finer.velocity[:, 0], speed(finer.time), rtol=1e-14)
    np.testing.assert_allclose(velocity_at(motion, finer.time)[:, 0], speed(finer.time), rtol=1e-14)


def test_the_speed_beside_a_standstill_has_the_sign_of_the_move() -> None:
    """At the floating-point numbers next to its start and its stop; beside a reversal it has both signs."""
    limits = {"speed": 0.48, "acceleration": 3.4, "jerk": 172.0, "profile": "sine squared"}
    down = Moves(limits=limits, moves=[{"distance": -0.318}]).motion()
    start, stop = down.time[np.flatnonzero(down.velocity[:, 0])[[0, -1]] + [-1, 1]]
    beside = np.sort(
        [start + np.spacing(1e-2) * np.arange(300), stop - np.spacing(stop) * np.arange(300)], axis=1
    )
    assert velocity_at(down, beside.ravel())[:, 0].max() == 0.0
    turning = Motion.along_x([0.0, 1.0], [-2.0, -2.0], velocity=[1.0, -1.0])
    assert velocity_at(turning, np.array([0.5 - 1e-9, 0.5 + 1e-9]))[:, 0] == pytest.approx(
        [2e-9, -2e-9], rel=1e-6
    )


@pytest.mark.parametrize("when", [[-1.0, 2.0], [0.0, 1.0]])
def test_a_force_is_cut_to_the_time_of_the_motion(when):
    motion = Motion.along_x([0.0, 1.0], [0.0, 0.0]).with_force([0, 0, 0], [4.0, 0, 0], time=when)
    assert motion.time.tolist() == [0.0, 1.0]
    assert motion.wrench is not None and motion.wrench[:, 0].tolist() == [4.0, 4.0]


@pytest.mark.parametrize(
    ("arguments", "time", "message"),
    [
        (([0.0, 0.0, 0.0],), None, "force, moment or both"),
        (([0.0, 0.0, 0.0], None, [0.0, 0.0, 1e300]), None, r"moment\[2\]: "),
        (([0.0, 0.0], [1.0, 0.0, 0.0]), None, r"point: expected shape \(3,\)"),
        (([0.0, 0.0, 0.0], np.zeros((5, 3))), None, r"force: expected shape \(6, 3\)"),
        (([0.0, 0.0, 0.0], np.zeros((2, 3))), [1.0, 0.0], r"time\[1\]"),
    ],
)
def test_refusals_of_a_force(arguments, time, message):
    refuses(message, Motion.along_x(TIME, ALONG).with_force, *arguments, time=time)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))])
def test_arrays_of_copies_are_read_only(copied):
    motion = copied(Motion.along_x(TIME, ALONG, velocity=ALONG))
    forces = copied(Forces([0.0, 1.0], np.ones((2, 3)), np.zeros((2, 3))))
    for array in (motion.time, motion.acceleration, motion.velocity, forces.time, forces.force):
        assert not array.flags.writeable


@pytest.mark.parametrize(
    ("field", "value"),
    [("bandwidth", "x"), ("bandwidth", None), ("acceleration", None), ("uncertainty", "x"), ("notes", 3),
     ("notes", "abc"), ("warnings", [1]), ("source", None), ("exact", "no"), ("recorded", 2)],
)  # fmt: skip
def test_a_field_of_another_type_is_refused(field, value):
    with pytest.raises(ArgumentTypeError, match=f"^{field}: expected"):
        dataclasses.replace(Motion.along_x(TIME, ALONG), **{field: value})


@pytest.mark.parametrize("bandwidth", [0.0, -1.0, np.nan])
def test_a_bandwidth_is_positive(bandwidth):
    refuses("bandwidth: expected > 0 Hz", Motion.along_x, TIME, ALONG, bandwidth=bandwidth)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        (([], np.zeros((0, 3)), np.zeros((0, 3))), "time: expected at least 2 stamps, got 0"),
        (([1.0, 0.0], np.ones((2, 3)), np.ones((2, 3))), r"time\[1\]: expected at least 1.0 s"),
        (([0.0, 1.0], np.ones((2, 2)), np.ones((2, 3))), r"force: expected shape \(2, 3\), got \(2, 2\)"),
        (([0.0, 1.0], np.ones((2, 3)), np.full((2, 3), np.nan)), r"moment\[0, 0\]: expected a finite number"),
    ],
)
def test_forces_that_cannot_act_are_refused(fields, message):
    refuses(message, Forces, *fields)
    for wrong in (None, "a"):
        with pytest.raises(ArgumentTypeError, match="^time: expected"):
            Forces(wrong, wrong, wrong)
    assert Forces([0, 1], [[1, 0, 0]] * 2, [[0, 0, 0]] * 2, notes=["a"]).notes == ("a",)
