"""Laws of planned moves: exact ends, limits kept and reached, the shortest time, and loads without approximation."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import cart
from scipy.optimize import linprog

from guideload import ConfigError, Motion, Move, MoveLimits, Moves, simulate
from guideload.motion.moves import MOST_STAMPS
from guideload.motion.profiles import DEVIATION, Limits, Pieces, fastest_move

PROFILES = ("jerk limited", "trapezoid", "sine squared", "polynomial 5")
EXACT = PROFILES[:2]
LIMITS = {"speed": 2.0, "acceleration": 5.0, "jerk": 200.0}


def decades(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(math.log10(low), math.log10(high)).map(lambda power: 10.0**power)


@st.composite
def planned(draw: st.DrawFn) -> tuple[float, Limits]:
    """A distance and limits over many decades, so that all combinations of reached limits occur."""
    profile = draw(st.sampled_from(PROFILES))
    speed, most, least = draw(decades(0.01, 10)), draw(decades(0.1, 100)), draw(decades(0.1, 100))
    free = profile == "trapezoid" or (profile != "jerk limited" and draw(st.booleans()))
    return draw(decades(1e-6, 100)), Limits(
        profile, speed, most, least, math.inf if free else draw(decades(0.1, 1e6))
    )


def many(law: Any) -> Any:
    return settings(derandomize=True, max_examples=150, deadline=None)(law)


def duration(distance: float, limits: Limits) -> float:
    return float(fastest_move(distance, limits).length.sum())


def steepest(pieces: Pieces) -> float:
    return float(np.abs((pieces.end - pieces.start) / pieces.length).max())


@given(planned())
@many
def test_a_move_ends_at_rest_after_its_distance_within_all_limits(case: tuple[float, Limits]) -> None:
    distance, limits = case
    pieces = fastest_move(distance, limits)
    assert pieces.length.min() > 0.0
    speeds, places = pieces.speeds(), pieces.distances()
    assert abs(speeds[-1]) <= 1e-12 * speeds.max()
    assert places[-1] == pytest.approx(distance, rel=1e-12)
    within = 1.0 + 1e-12
    assert speeds.max() <= limits.speed * within and speeds.min() >= -1e-12 * speeds.max()
    assert pieces.start.max() <= limits.acceleration * within
    assert pieces.start.min() >= -limits.deceleration * within
    # The length of a piece that is short against its ramp is rounded.
    assert steepest(pieces) <= limits.jerk * (1.0 + 1e-9)
    jumps = np.append(pieces.start, 0.0) - np.append(0.0, pieces.end)
    assert limits.profile == "trapezoid" or np.abs(jumps).max() <= 1e-15 * pieces.start.max()


@given(planned())
@many
def test_limits_are_reached_where_the_distance_allows(case: tuple[float, Limits]) -> None:
    """A profile could be no faster: it has its largest speed, or its largest accelerations or jerk throughout."""
    distance, limits = case
    pieces = fastest_move(distance, limits)
    # The polynomial has its largest jerk at its ends alone: the lines are less steep there.
    jerk = 60.0 * distance / pieces.time**3 if limits.profile == "polynomial 5" else steepest(pieces)
    ratios = {
        "speed": pieces.speeds().max() / limits.speed,
        "acceleration": pieces.start.max() / limits.acceleration,
        "deceleration": -pieces.start.min() / limits.deceleration,
        "jerk": jerk / limits.jerk,
    }
    close = 1e-4  # straight lines flatten the largest acceleration of curves, and the jerk of sines, by less
    if limits.profile == "polynomial 5":
        assert max(ratios.values()) == pytest.approx(1.0, abs=close)
        return
    cruise = pieces.length[(pieces.start == 0.0) & (pieces.end == 0.0)].sum()
    assert cruise == 0.0 or ratios["speed"] == pytest.approx(1.0, rel=1e-12)
    for side in ("acceleration", "deceleration"):
        assert max(ratios[side], ratios["jerk"]) == pytest.approx(1.0, abs=close)
    if limits.profile == "jerk limited":
        assert ratios["jerk"] == pytest.approx(1.0, rel=1e-6)


def farthest(time: float, limits: Limits, steps: int) -> float:
    """The largest distance in a time from rest to rest under the limits, by a linear program (no code of ours)."""
    h = time / steps
    jumps = math.isinf(limits.jerk)
    # Unknown: the acceleration at the ends of the steps, or its mean in each of them if it may jump.
    count = steps if jumps else steps + 1
    gain = np.eye(steps) if jumps else 0.5 * (np.eye(steps, count) + np.eye(steps, count, 1))
    speed = np.tril(np.ones((steps, steps))) @ gain * h
    # The distance is the integral of the speed: minus the integral of (time since the start) times the acceleration.
    since = (np.arange(count) + 0.5) * h if jumps else np.arange(count) * h
    reach = -since * h
    rows, bounds = [speed], [np.full(steps, limits.speed)]
    if not jumps:
        change = np.diff(np.eye(count), axis=0) / h
        rows += [change, -change]
        bounds += [np.full(steps, limits.jerk)] * 2
    most = [(-limits.deceleration, limits.acceleration)] * count
    if not jumps:
        most[0] = most[-1] = (0.0, 0.0)
    found = linprog(
        -reach, np.vstack(rows), np.concatenate(bounds), speed[-1:], np.zeros(1), most, method="highs"
    )
    assert found.status == 0
    return -float(found.fun)


@pytest.mark.parametrize(
    ("distance", "limits"),
    [
        (1.2, Limits("jerk limited", 2.0, 5.0, 5.0, 200.0)),  # all limits reached
        (1.2, Limits("jerk limited", 2.0, 5.0, 2.5, 40.0)),  # another deceleration
        (0.4, Limits("jerk limited", 2.0, 5.0, 5.0, 40.0)),  # without the speed
        (0.02, Limits("jerk limited", 2.0, 5.0, 5.0, 40.0)),  # without speed and acceleration
        (0.1, Limits("jerk limited", 2.0, 8.0, 1.0, 20.0)),  # deceleration reached, acceleration not
        (0.3, Limits("jerk limited", 0.3, 5.0, 5.0, 20.0)),  # speed reached, acceleration not
        (1.2, Limits("trapezoid", 2.0, 5.0, 3.0, math.inf)),
        (0.2, Limits("trapezoid", 2.0, 5.0, 3.0, math.inf)),
    ],
)
def test_no_motion_under_the_limits_goes_farther_in_the_time(distance: float, limits: Limits) -> None:
    """The error of the linear program falls with its steps."""
    best = farthest(duration(distance, limits), limits, 300)
    assert best == pytest.approx(distance, rel=4e-3)


def test_durations_are_those_of_closed_forms() -> None:
    """Time = d / v + v / a + a / j where all limits are reached, and its special cases (textbook)."""
    v, a, j = 2.0, 5.0, 200.0
    cases = {
        (1.2, "jerk limited"): 1.2 / v + v / a + a / j,
        (0.002, "jerk limited"): 4.0 * (0.002 / (2.0 * j)) ** (1 / 3),
        (1.2, "trapezoid"): 1.2 / v + v / a,
        (0.2, "trapezoid"): 2.0 * math.sqrt(0.2 / a),
        (1.8, "sine squared"): 1.8 / v + 2.0 * v / a,
        (0.5, "sine squared"): 2.0 * math.sqrt(2.0 * 0.5 / a),
        (9.0, "polynomial 5"): 15.0 / 8.0 * 9.0 / v,
        (0.5, "polynomial 5"): math.sqrt(10.0 / math.sqrt(3.0) * 0.5 / a),
        (0.02, "polynomial 5"): (60.0 * 0.02 / j) ** (1 / 3),
    }
    for (distance, profile), expected in cases.items():
        limits = Limits(profile, v, a, a, math.inf if profile in ("trapezoid", "sine squared") else j)
        close = 2e-5 if profile == "polynomial 5" else 1e-14  # of straight lines
        assert duration(distance, limits) == pytest.approx(expected, rel=close)


@given(planned(), st.sampled_from(["speed", "acceleration", "deceleration", "jerk"]), st.floats(1.0, 10.0))
@many
def test_a_higher_limit_never_takes_longer(case: tuple[float, Limits], name: str, factor: float) -> None:
    distance, limits = case
    raised = Limits(**{**vars(limits), name: factor * getattr(limits, name)})
    assert duration(distance, raised) <= duration(distance, limits) * (1.0 + 1e-12)


@given(planned())
@many
def test_units_and_the_sense_of_time_do_not_matter(case: tuple[float, Limits]) -> None:
    """Twice all lengths takes the same time. Backwards in time, acceleration and deceleration change places."""
    distance, limits = case
    twice = Limits(limits.profile, *(2.0 * x for x in list(vars(limits).values())[1:]))
    assert np.array_equal(fastest_move(2.0 * distance, twice).length, fastest_move(distance, limits).length)
    there = fastest_move(distance, limits)
    swapped = Limits(limits.profile, limits.speed, limits.deceleration, limits.acceleration, limits.jerk)
    back = fastest_move(distance, swapped)
    assert back.length == pytest.approx(there.length[::-1], rel=1e-9, abs=1e-9 * there.length.sum())
    assert -back.end[::-1] == pytest.approx(there.start, abs=1e-9 * there.start.max())


def moves(*changes: dict[str, Any], **options: Any) -> Moves:
    return Moves(moves=[Move(**(LIMITS | change)) for change in changes], **options)


def of_profile(profile: str, **changes: Any) -> dict[str, Any]:
    return {"profile": profile, "jerk": None if profile == "trapezoid" else 200.0} | changes


@pytest.mark.parametrize("profile", PROFILES)
def test_velocity_and_position_are_the_integrals_of_the_acceleration(profile: str) -> None:
    """At every stamp, with the acceleration linear between them. Moves and pauses end where and when they should."""
    there, back = (
        of_profile(profile, distance=1.2, dwell=0.3),
        of_profile(profile, target=-0.1, deceleration=3.0),
    )
    planned = moves(there, back, repeat=2, start=0.05)
    motion = planned.motion()
    time, acceleration = motion.time, motion.acceleration[:, 0]
    assert motion.velocity is not None and motion.position is not None
    step = np.diff(time)
    speed = np.append(0.0, np.cumsum(0.5 * step * (acceleration[1:] + acceleration[:-1])))
    gained = step * (speed[:-1] + step * (2.0 * acceleration[:-1] + acceleration[1:]) / 6.0)
    assert motion.velocity[:, 0] == pytest.approx(speed, abs=1e-11)
    assert motion.position[:, 0] == pytest.approx(0.05 + np.append(0.0, np.cumsum(gained)), abs=1e-11)
    assert motion.velocity[-1, 0] == 0.0 and motion.position[-1, 0] == -0.1
    paused = (motion.position[:, 0] == 1.25) & (motion.velocity[:, 0] == 0.0)
    assert np.ptp(time[paused]) == pytest.approx(0.3, rel=1e-9)
    assert motion.uncertainty is None and motion.exact and motion.usable_bandwidth == np.inf


@pytest.mark.parametrize("profile", PROFILES)
def test_a_negative_distance_is_the_mirror_image(profile: str) -> None:
    there = moves(of_profile(profile, distance=0.7, dwell=0.1)).motion()
    back = moves(of_profile(profile, distance=-0.7, dwell=0.1)).motion()
    assert np.array_equal(back.time, there.time)
    for name in ("acceleration", "velocity", "position"):
        assert np.array_equal(getattr(back, name), -getattr(there, name))


def test_corners_have_stamps_and_jumps_have_two() -> None:
    """Without the grid a jerk-limited move has 8 corners; a trapezoid has jumps before and after each of its phases."""
    smooth = moves({"distance": 1.2}, rate=1e-3).motion()
    assert smooth.time.size == 8 and np.all(np.diff(smooth.time) > 0.0)
    assert smooth.acceleration[:, 0] == pytest.approx([0, 5, 5, 0, 0, -5, -5, 0], abs=1e-15)
    # Two trapezoids without a pause: from the deceleration of the one to the acceleration of the other in one jump.
    jumps = moves(*[of_profile("trapezoid", distance=1.2)] * 2, rate=1e-3).motion()
    levels = [0, 5, 5, 0, 0, -5, -5, 5, 5, 0, 0, -5, -5, 0]
    assert jumps.acceleration[:, 0] == pytest.approx(levels, abs=1e-14)
    assert np.count_nonzero(np.diff(jumps.time) == 0.0) == 7


def test_between_the_corners_all_steps_are_equal_to_the_bit() -> None:
    """A cached propagator serves them all: the exact method is as fast as on a uniform trace."""
    steps = np.diff(moves({"distance": 1.2, "dwell": 0.5}, repeat=3, rate=1000.0).motion().time)
    values, counts = np.unique(steps, return_counts=True)
    assert values[counts.argmax()] == 2.0**-10
    assert counts.max() >= steps.size - 3 * 9 * 2  # beside each corner the steps are shorter


@pytest.mark.parametrize("profile", EXACT)
def test_loads_do_not_depend_on_the_stamps(profile: str) -> None:
    """Piecewise linear acceleration is exact in the model: eight times the stamps give the same loads."""
    step = of_profile(profile, distance=0.3, dwell=0.1)
    coarse, fine = (moves(step, rate=rate).motion() for rate in (256.0, 2048.0))
    times = np.linspace(0.0, coarse.time[-1], 500)
    loads = [simulate(cart(), motion, times=times).data["link_load"].values for motion in (coarse, fine)]
    assert np.abs(loads[0] - loads[1]).max() <= 1e-9 * np.abs(loads[1]).max()


@pytest.mark.parametrize("profile", PROFILES[2:])
def test_loads_of_curved_profiles_are_within_the_stated_deviation(profile: str) -> None:
    """Against the curve itself at 40 times the stamps."""
    motion = moves(of_profile(profile, distance=0.3, dwell=0.1)).motion()
    end = motion.time[-1] - 0.1
    time = np.linspace(0.0, end, 40_001)
    s = time / end
    if profile == "polynomial 5":
        curve = 0.3 / end**2 * 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)
    else:  # no speed limit is reached: two halves
        curve = 2.0 * (0.6 / end) / (0.5 * end) * np.sin(2.0 * np.pi * s) ** 2 * np.where(s < 0.5, 1.0, -1.0)
    true = np.interp(motion.time, time, curve)
    peak = np.abs(curve).max()
    assert np.abs(motion.acceleration[:, 0] - true).max() <= 2.0 * DEVIATION[profile] * peak
    reference = Motion.along_x(np.append(time, end + 0.1), np.append(curve, 0.0))
    times = np.linspace(0.0, end + 0.1, 400)
    loads = [simulate(cart(), each, times=times).data["link_load"].values for each in (motion, reference)]
    moved = np.abs(loads[1] - loads[1][0]).max()
    assert np.abs(loads[0] - loads[1]).max() <= 10.0 * DEVIATION[profile] * moved


def test_limits_of_all_moves_are_those_that_a_move_does_not_give() -> None:
    shared = Moves(limits=MoveLimits(**LIMITS), moves=[Move(distance=1), Move(target=0, speed=1)])
    own = moves({"distance": 1}, {"target": 0, "speed": 1})
    assert np.array_equal(shared.motion().acceleration, own.motion().acceleration)
    jumping = Moves(
        limits=MoveLimits(**LIMITS), moves=[Move(distance=1), Move(target=0, profile="trapezoid")]
    )
    own = moves({"distance": 1}, of_profile("trapezoid", target=0))
    assert np.array_equal(jumping.motion().acceleration, own.motion().acceleration)


@pytest.mark.parametrize("name", ["speed", "acceleration", "deceleration", "jerk"])
def test_a_limit_is_scaled_for_the_moves_that_have_it(name: str) -> None:
    """Deceleration as the acceleration goes with it, unless it is the one that is scaled."""
    before = moves({"distance": 1}, of_profile("trapezoid", distance=1, acceleration=4))
    after = before.with_limit(name, 2.0)
    expected = {"speed": (2, 2), "acceleration": (5, 4), "jerk": (200, None)}
    for key, values in expected.items():
        scaled = tuple(value and value * (2 if key == name else 1) for value in values)
        assert tuple(getattr(move, key) for move in after.complete) == scaled
    assert [move.deceleration for move in after.complete] == (
        [10, 8] if name == "deceleration" else [None] * 2
    )
    assert after.limit(name) == 2.0 * before.limit(name)


FORCE = "[[moves]]\ndistance = 1\ntime = 1\n\n[[moves.forces]]\n"
ROW = "distance = 1\nspeed = 1\nacceleration = 1\njerk = 10\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[[moves]]\nspeed = 1", r"row 1: moves\[0\]: expected either distance or target"),
        (f"[[moves]]\n{ROW}target = 2", r"row 1: moves\[0\]: expected either distance or target"),
        (
            f"[[moves]]\n{ROW}[[moves]]\ndistance = 1",
            r"row 6: moves\[1\].speed: expected a largest speed.*\[limits\]",
        ),
        ("[[moves]]\ndistance = 1\nspeed = 1\nacceleration = 2", r'moves\[0\].jerk: .*profile = "trapezoid"'),
        (
            ROW.join(("[[moves]]\n", 'profile = "trapezoid"')),
            r", row 5: moves\[0\].jerk: expected no jerk beside a trapezoid, got 10; its accel",
        ),
        (
            f'[limits]\nprofile = "trapezoid"\n[[moves]]\n{ROW}',
            r"row 7: moves\[0\].jerk: expected no jerk beside",
        ),
        (
            '[limits]\nprofile = "trapezoid"\nspeed = 1\nacceleration = 1\njerk = 2\n[[moves]]\ndistance = 1',
            "row 5: limits.jerk: expected no jerk beside a trapezoid, got 2",
        ),
        (f'[[moves]]\n{ROW}profile = "triangle"', 'row 6: .*"jerk limited", "trapezoid".*got "triangle"'),
        ("[[moves]]\ndistance = 0", r"row 2: moves\[0\].distance: expected a value other than 0 m, got 0"),
        (f"[[moves]]\n{ROW}dwell = -1", r"row 6: moves\[0\].dwell: expected >= 0 s, got -1"),
        ('[[moves]]\ndistance = "1 s"', r'row 2: moves\[0\].distance: expected a length in m, got "1 s"'),
        (
            '[[moves]]\ndistance = 1\nspeed = "-1 m/s"',
            r'row 3: moves\[0\].speed: expected > 0 m/s, got "-1 m/s"',
        ),
        (
            f"start = 1\n[[moves]]\n{ROW.replace('distance', 'target')}",
            r"row 3: .*another place than the cart's, got 1",
        ),
        (
            f"repeat = 2\n[[moves]]\n{ROW.replace('distance', 'target')}",
            "another place.*in repetition 2, got 1",
        ),
        (f"repeat = 0\n[[moves]]\n{ROW}", "row 1: repeat: expected a whole number, at least 1, got 0"),
        (f"repeat = 1000000000\n[[moves]]\n{ROW}", "row 1: repeat: .*at most 5e.06 stamps"),
        (f"rate = 0.9e9\n[[moves]]\n{ROW}", "row 1: rate: .*at most 5e.06 stamps"),
        (f'repeat = 2000\n[[moves]]\n{ROW}profile = "polynomial 5"', "row 1: repeat: .*at most 5e.06 stamps"),
        ("[[moves]]\ndistance = 1\nspeed = 1e-10", "row 3: .*expected a speed from 1e-09 to 1e.08 m/s"),
        ("[[moves]]\ndistance = 1\ntime = 1e-100", "row 3: .*expected a period from 1e-09 to 1e.11 s"),
        (f"[[moves]]\n{ROW}acelleration = 1", 'did you mean "acceleration"'),
        ("rate = 100", r"moves: expected \[\[moves\]\] tables.*guideload init --moves"),
        ("[body]\nmass = 1", r"moves: expected \[\[moves\]\] tables.*this is a machine file"),
        ("moves = []", "row 1: moves: expected at least one entry"),
        (
            FORCE + 'during = "at rest"\nforce = [1, 0, 0]',
            r"row 6: moves\[0\].forces\[0\].during: .*has no dwell",
        ),
        (FORCE + 'during = "cutting"\nforce = [1, 0, 0]', 'row 6: .*"constant speed".*got "cutting"'),
        (
            FORCE + "force = [0, 0, 0]",
            r"row 5: moves\[0\].forces\[0\]: expected a force or a moment other than",
        ),
        (
            FORCE + 'force = ["1 m", 0, 0]',
            r'row 6: .*forces\[0\].force\[0\]: expected a force in N, got "1 m"',
        ),
        (FORCE + "force = [1, 0]", r"row 6: moves\[0\].forces\[0\].force: expected \[x, y, z\]"),
    ],
)
def test_refusals_name_row_key_and_value(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "moves.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=f"(?s)moves.toml.*{message}"):
        Moves.from_toml(file)


def test_a_missing_file_says_which_command_writes_one(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="`guideload init --moves` writes one"):
        Moves.from_toml(tmp_path / "none.toml")


def test_texts_of_the_command_line() -> None:
    text = "distance=1.2 m, speed=2 m/s, acceleration=5 m/s^2, jerk = 200 m/s^3,dwell=0.5 s"
    planned = Moves.from_texts([text, text.replace("distance=1.2", "target=0")])
    same = moves({"distance": 1.2, "dwell": 0.5}, {"target": 0, "dwell": 0.5})
    assert np.array_equal(planned.motion().acceleration, same.motion().acceleration)
    for wrong, message in (
        ("distance", "key=value"),
        ("speed=1 m/s, speed=2 m/s", "each key once"),
        ("way=1 m", "known key"),
        ("distance=1", "add the unit"),
    ):
        with pytest.raises(ConfigError, match=message):
            Moves.from_texts([wrong])


@given(
    st.lists(planned(), min_size=1, max_size=4),
    st.lists(st.floats(0.0, 1.0), min_size=4, max_size=4),
    st.integers(1, 3),
)
@settings(derandomize=True, max_examples=60, deadline=None)
def test_every_list_of_moves_is_a_motion(
    cases: list[tuple[float, Limits]], dwell: list[float], repeat: int
) -> None:
    """Stamps ascend with at most two equal ones (Motion refuses others); ends and total time are those of the moves."""
    listed, lasting = [], 0.0
    for (distance, limits), pause in zip(cases, dwell, strict=False):
        values = {**vars(limits), "jerk": None if math.isinf(limits.jerk) else limits.jerk}
        listed.append(Move(distance=distance, dwell=pause, **values))
        lasting += repeat * (duration(distance, limits) + pause)
    if lasting * 64.0 > MOST_STAMPS:
        return
    motion = Moves(moves=listed, repeat=repeat, rate=64.0).motion()
    assert motion.time[-1] == pytest.approx(lasting, rel=1e-12)
    assert motion.velocity is not None and motion.position is not None
    total = repeat * sum(distance for distance, _ in cases)
    assert motion.position[-1, 0] == pytest.approx(total, rel=1e-12) and motion.velocity[-1, 0] == 0.0
    for before, after in pairwise(np.flatnonzero(np.diff(motion.time) == 0.0)):
        assert after > before + 1


def test_a_move_is_no_limits_and_a_count_of_numpy_is_a_count() -> None:
    move = Move(distance=1.0, **LIMITS)
    with pytest.raises(ConfigError, match="limits: expected a MoveLimits, not a Move, got"):
        Moves(moves=[{"distance": 1.0}], limits=move)
    twice = Moves(moves=[move], repeat=np.int64(2))
    assert twice == Moves(moves=[move], repeat=2) and type(twice.repeat) is int
    with pytest.raises(ConfigError, match="repeat: expected a whole number, at least 1"):
        Moves(moves=[move], repeat=np.bool_(True))
