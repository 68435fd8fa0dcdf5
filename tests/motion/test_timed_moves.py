"""Laws of moves with a time and of process forces by phase: the time and the impulse are exact, limits are kept."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reference import cart
from test_moves import LIMITS, PROFILES, decades, duration, many, planned, steepest

from guideload import ArgumentError, ConfigError, Motion, Moves, simulate
from guideload.motion.phase_forces import PhaseForce
from guideload.motion.profiles import Limits, fastest_move, limits_of_time, slowed

PHASES = ("speeding up", "constant speed", "braking", "at rest", None)


@given(st.sampled_from(PROFILES), decades(1e-4, 100), decades(1e-2, 100))
@many
def test_a_time_alone_gives_the_move(profile: str, distance: float, time: float) -> None:
    (leg,) = Moves(moves=[{"distance": distance, "time": time, "profile": profile}], rate=1e-6)._legs
    pieces = leg.pieces
    assert pieces.time == pytest.approx(time, rel=1e-12)
    assert pieces.distances()[-1] == pytest.approx(distance, rel=1e-12)
    assert abs(pieces.speeds()[-1]) <= 1e-12 * pieces.speeds().max()
    change = pieces.start + pieces.end
    phases = [pieces.length[np.sign(change) == sign].sum() / time for sign in (1.0, 0.0, -1.0)]
    assert phases == pytest.approx([0.5, 0.0, 0.5] if profile == "polynomial 5" else [1 / 3] * 3, rel=1e-9)


@given(planned(), st.floats(1.0, 10.0))
@many
def test_under_limits_a_time_is_reached_and_all_limits_are_kept(
    case: tuple[float, Limits], factor: float
) -> None:
    distance, limits = case
    wanted = factor * duration(distance, limits)
    given = {key: value for key, value in vars(limits).items() if value != math.inf}
    (leg,) = Moves(moves=[{"distance": distance, "time": wanted, **given}], rate=1e-6)._legs
    pieces, within = leg.pieces, 1.0 + 1e-9
    assert pieces.time == pytest.approx(wanted, rel=1e-12)
    assert pieces.distances()[-1] == pytest.approx(distance, rel=1e-12)
    assert pieces.speeds().max() <= limits.speed * within
    assert (
        -limits.deceleration * within
        <= pieces.start.min()
        < pieces.start.max()
        <= limits.acceleration * within
    )
    assert steepest(pieces) <= limits.jerk * within
    with pytest.raises(
        ConfigError, match=r"moves\[0\].time: expected at least .* s, the shortest time under its"
    ):
        Moves(moves=[{"distance": distance, "time": 0.99 * duration(distance, limits), **given}], rate=1e-6)


@pytest.mark.parametrize(
    ("profile", "limit", "shortest"),
    [
        ("trapezoid", "acceleration", lambda d, a: 2.0 * math.sqrt(d / a)),
        ("trapezoid", "deceleration", lambda d, b: math.sqrt(2.0 * d / b)),
        ("jerk limited", "acceleration", lambda d, a: 2.0 * math.sqrt(d / a)),
        ("jerk limited", "jerk", lambda d, j: (32.0 * d / j) ** (1 / 3)),
        ("jerk limited", "speed", lambda d, v: d / v),
        ("sine squared", "acceleration", lambda d, a: 2.0 * math.sqrt(2.0 * d / a)),
        ("sine squared", "jerk", lambda d, j: 2.0 * (2.0 * math.pi * d / j) ** (1 / 3)),
        ("polynomial 5", "acceleration", lambda d, a: math.sqrt(10.0 / math.sqrt(3.0) * d / a)),
    ],
)
def test_under_one_limit_any_time_is_reached_that_is_possible(
    profile: str, limit: str, shortest: Callable[[float, float], float]
) -> None:
    """Closed forms of the shortest time, in which the limits that are left out have no bound."""
    distance, value = 0.7, 3.0
    least = shortest(distance, value)
    move = {"distance": distance, "profile": profile, limit: value}
    for factor in (1.001, 1.05, 1.3, 3.0):
        (leg,) = Moves(moves=[{**move, "time": factor * least}], rate=1e-6)._legs
        pieces = leg.pieces
        reached = {
            "speed": pieces.speeds().max(), "acceleration": abs(pieces.start).max(),
            "deceleration": -pieces.start.min(), "jerk": pieces.jerk,
        }  # fmt: skip
        assert reached[limit] <= value * (1.0 + 1e-9)
        assert pieces.time == pytest.approx(factor * least, rel=1e-12)
        assert pieces.distances()[-1] == pytest.approx(distance, rel=1e-12)
    with pytest.raises(ConfigError, match=f"expected at least {least:.4g} s"):
        Moves(moves=[{**move, "time": 0.999 * least}], rate=1e-6)


@pytest.mark.parametrize("profile", PROFILES[:3])
def test_a_slower_speed_is_reached_and_the_ramps_follow(profile: str) -> None:
    distance, time, speed = 1.0, 1.2, 1.0
    (leg,) = Moves(moves=[{"distance": distance, "time": time, "speed": speed, "profile": profile}])._legs
    assert leg.pieces.speeds().max() == pytest.approx(speed, rel=1e-12)
    assert leg.pieces.time == pytest.approx(time, rel=1e-12)
    limits = limits_of_time(distance, time, profile, speed)
    assert leg.pieces.start.max() == pytest.approx(limits.acceleration, rel=1e-5)


def test_a_slowed_move_has_the_powers_of_time_in_its_speed_acceleration_and_jerk() -> None:
    fast = fastest_move(1.2, Limits("jerk limited", 2.0, 5.0, 4.0, 200.0))
    slow = slowed(fast, 3.0 * fast.time)
    assert slow.speeds() == pytest.approx(fast.speeds() / 3.0, abs=1e-14)
    assert slow.start == pytest.approx(fast.start / 9.0) and slow.jerk == pytest.approx(fast.jerk / 27.0)


def test_the_limits_of_a_move_with_a_time_cannot_be_searched() -> None:
    with pytest.raises(ArgumentError, match=r"speed: moves\[0\] keeps its time"):
        Moves(moves=[{"distance": 1, "time": 1}]).limit("speed")


def impulse(motion: Motion) -> Any:
    """Integral of the wrench (6,) over time, which is linear between the stamps."""
    assert motion.wrench is not None
    step = np.diff(motion.time)[:, None]
    return (0.5 * step * (motion.wrench[1:] + motion.wrench[:-1])).sum(axis=0)


@pytest.mark.parametrize("during", PHASES)
@pytest.mark.parametrize("profile", PROFILES)
def test_the_impulse_is_force_times_duration_of_the_phase(profile: str, during: Any) -> None:
    one = PhaseForce(
        force=(-800.0, 100.0, -200.0), moment=(1.0, 2.0, 3.0), at=(0.1, 0.6, 0.15), during=during
    )
    shape = {"profile": profile, "distance": 3.0, "dwell": 0.5} | LIMITS
    shape |= {"jerk": None} if profile == "trapezoid" else {}
    if profile == "polynomial 5" and during == "constant speed":
        with pytest.raises(
            ConfigError, match=r"moves\[0\].forces\[0\].during: expected a phase that the move has"
        ):
            Moves(moves=[{**shape, "forces": [one]}])
        return
    plain = {**shape, "distance": -1.0}
    moves = Moves(moves=[plain, {**shape, "forces": [one]}, plain], repeat=3)
    pieces = moves._legs[1].pieces
    change = np.sign(pieces.start + pieces.end)
    lasting = {"speeding up": 1.0, "constant speed": 0.0, "braking": -1.0}
    time = 0.5 if during == "at rest" else pieces.time
    if during in lasting:
        time = pieces.length[change == lasting[during]].sum()
    motion = moves.motion()
    force = np.array(one.force)
    wrench = np.append(force, np.array(one.moment) + np.cross(one.at, force))
    assert impulse(motion) == pytest.approx(3 * time * wrench, rel=1e-12)
    assert motion.wrench is not None and motion.exact
    acting = (motion.wrench != 0.0).any(axis=1)
    assert (motion.wrench[acting] == wrench).all() and acting.any() and not acting.all()


def test_forces_add_up_and_change_neither_motion_nor_superposition() -> None:
    """The model of the cart is linear: its loads under both forces are those of each, minus those without."""
    one = {"force": ["-1 kN", 0, 0], "at": [0, "0.3 m", 0], "during": "constant speed"}
    other = {"force": [0, "-2 kN", 0]}
    loads, kept = [], []
    for forces in ([one, other], [one], [other], []):
        motion = Moves(moves=[{"distance": 1.2, "dwell": 0.2, **LIMITS, "forces": forces}]).motion()
        times = np.linspace(0.0, motion.time[-1], 400)
        loads.append(simulate(cart(), motion, times=times).data["link_load"].values)
        kept.append(np.interp(times, motion.time, motion.acceleration[:, 0]))
    assert np.abs(loads[0] - loads[1] - loads[2] + loads[3]).max() <= 1e-9 * np.abs(loads[0]).max()
    assert kept[0] == pytest.approx(kept[3], abs=1e-12)


def test_each_move_is_described() -> None:
    force = {"force": ["-800 N", 0, 0], "at": [0, "0.6 m", 0], "during": "braking"}
    planned = [
        {"distance": 1.2, "dwell": 1, "forces": [force], **LIMITS},
        {"target": 0, "time": 3, "profile": "trapezoid"},
    ]
    notes = Moves(moves=planned).motion().notes
    assert notes[1] == (
        "move 1: 1.2 m in 1.025 s, speed up to 2 m/s, acceleration 5 and -5 m/s2, jerk 200 m/s3; force (-800, 0, 0) N "
        "at (0, 0.6, 0) m from L, braking"
    )
    assert notes[2].startswith(
        "move 2: -1.2 m in 3 s, speed up to 0.6 m/s, acceleration 0.6 and -0.6 m/s2, the acc"
    )
    many = Moves(moves=[{"distance": 1, "time": 1}] * 25)
    assert many.motion().notes[-1] == "and 5 more moves"
