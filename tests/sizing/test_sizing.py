"""Sizing agrees with single runs, ranks by rating, and finds limits at which exactly one more step fails."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from command_line import TRACE, guideload, refused, write_rated
from moves import GENTLE
from reference import cart

from guideload import (
    ArgumentError,
    Catalogue,
    Life,
    LifeConditions,
    Machine,
    Motion,
    Move,
    Moves,
    Product,
    RunError,
    life_of,
    simulate,
)
from guideload.audit.motion_plausibility import input_warnings
from guideload.audit.plausibility import machine_warnings
from guideload.base.number_text import digits
from guideload.base.warnings import WarningText
from guideload.cli.inputs import EXAMPLES
from guideload.drive import drive_requirements
from guideload.machine.components import joined
from guideload.machine.drive import Drive
from guideload.machine.modes import Modes
from guideload.machine.riders import Rider
from guideload.reports.report import Table
from guideload.reports.sizing import limit_report, sizing_report
from guideload.sizing import Sizing, largest, size
from guideload.sizing.limits import at_pace, with_payload
from guideload.sizing.requirements import margins_of
from guideload.sizing.size import with_product

TIME = GENTLE.times(125.0)
PLACE, SPEED, ACCELERATION = GENTLE.motion(TIME)
MOTION = Motion.along_x(TIME, ACCELERATION, velocity=SPEED, position=PLACE)
WANTED = LifeConditions(life="2000 km", safety=3.0)
MOMENTS = {"roll": 500.0, "pitch": 400.0, "yaw": 400.0}


def product(name: str, rating: float, **keys: object) -> Product:
    values = {"name": name, "maker": "made up", "edition": "1", "type": "ball", "static": 1.5 * rating}
    values |= {"dynamic": {"value": rating, "base": 1e5}, "static_moments": MOMENTS}
    return Product(**(values | keys))


def classes(*stiffness: float) -> list[dict[str, object]]:
    return [{"name": f"Z{i}", "stiffness": k} for i, k in enumerate(stiffness)]


CATALOGUE = Catalogue(
    products=[
        product("large", 4e4, preload_classes=classes(3e8, 6e8)),
        product("small", 1e4, preload_classes=classes(1e8)),
        product("middle", 2e4),
        product("unrated", 9e4, dynamic=None),
        product(
            "middle of 50 km",
            2e4 * 2 ** (1 / 3),
            static=3e4,
            dynamic={"value": 2e4 * 2 ** (1 / 3), "base": 5e4},
        ),
    ]
)


@pytest.fixture(scope="module")
def sized() -> Sizing:
    return size(cart(), MOTION, CATALOGUE, conditions=WANTED)


def test_every_candidate_is_a_run_of_its_own(sized: Sizing) -> None:
    """Life, safety and first mode are those of a machine with this product."""
    for one in sized.candidates[:-1]:
        machine = with_product(cart(), one.product, one.preload_class)
        life = life_of(simulate(machine, MOTION), WANTED)
        assert (one.life, one.life_hours) == (life.machine, life.hours(life.machine))
        assert one.static_safety == life.weakest.static.safety
        assert one.first_mode == Modes.of(machine).frequency.min()
        assert one.holds == (life.machine >= 2e6 and life.weakest.static.safety >= 3.0)


def test_ranked_by_the_rating_for_one_distance(sized: Sizing) -> None:
    """A rating counts for the same travel; what cannot be run is last and says why."""
    names = [one.name for one in sized.candidates]
    assert names == ["small Z0", "middle", "middle of 50 km", "large Z0", "large Z1", "unrated"]
    same = sized.candidates[1:3]
    assert same[0].life == pytest.approx(same[1].life, rel=1e-12)
    assert "rating" in sized.candidates[-1].reason
    first = sized.smallest
    assert first is not None and first.holds
    assert not any(one.holds for one in sized.candidates if one.size < first.size)
    assert list(sized.table().index) == names


def test_candidates_after_the_smallest_that_holds_change_no_answer() -> None:
    """With `larger`, those up to there and so many more are tried, with the same figures; none holds: all are tried."""
    made = [product(f"P{i}", 1e4 + 2e3 * i) for i in range(8)]
    made[3:3] = [product("unrated", 3e4, dynamic=None)]
    catalogue = Catalogue(products=made)
    whole = size(cart(), MOTION, catalogue, conditions=WANTED)
    assert whole.smallest is not None and whole.untried == 0
    place = whole.candidates.index(whole.smallest)
    for larger in (0, 2, 100):
        some = size(cart(), MOTION, catalogue, conditions=WANTED, larger=larger)
        count = min(place + 1 + larger, 8)
        assert len(some.candidates) + some.untried == 9
        assert [one.name for one in some.candidates][:count] == [one.name for one in whole.candidates][:count]
        pd.testing.assert_frame_equal(some.table()[:count], whole.table()[:count])
        answers = [sizing_report(cart(), one).answer[0] for one in (some, whole)]
        assert answers[1].startswith(answers[0])  # after it, the number of those that could not be run
        assert some.result is not None and some.best is not None
        assert life_of(some.result, WANTED).machine == some.best.life
    assert not size(cart(), MOTION, catalogue, conditions=LifeConditions(safety=1e3), larger=0).untried
    with pytest.raises(ArgumentError, match="larger: expected a whole number from 0"):
        size(cart(), MOTION, catalogue, larger=-1)


def test_the_next_smaller_product_is_named_with_its_best_class(sized: Sizing) -> None:
    """Of the products in the table that are smaller, the largest, and of its classes the one that comes nearest."""
    wanted = 1.01 * max(one.static_safety for one in sized.candidates if one.machine is not None)
    largest_one = product("largest", 9e4, static_moments={key: 50 * value for key, value in MOMENTS.items()})
    catalogue = Catalogue(products=[*CATALOGUE.products, largest_one])
    found = size(cart(), MOTION, catalogue, conditions=LifeConditions(safety=wanted))
    assert found.smallest is not None and found.smallest.name == "largest"
    near = {one.name: one.margins.smallest for one in found.candidates if one.name.startswith("large Z")}
    name = max(near, key=near.__getitem__)
    (answer,) = sizing_report(cart(), found).answer
    assert f"The next smaller one does not: {name}, the best of its preload classes" in answer
    assert "No stiffness was required" in answer


def test_a_product_without_law_keeps_that_of_the_machine() -> None:
    # Without moments: they would give the carriages a width.
    machine = with_product(cart(), product("lawless", 2e4, static_moments={}), None)
    assert np.array_equal(Modes.of(machine).frequency, Modes.of(cart()).frequency)


def test_damping_ratios_stay() -> None:
    """Four times the stiffness along y and z: twice the frequencies, the same damping ratios."""
    before = Modes.of(cart())
    stiffness = 4.0 * cart().carriages[0].laws[0].stiffness
    stiff = product("stiff", 1e4, preload_classes=classes(stiffness), static_moments={})
    after = Modes.of(with_product(cart(), stiff, "Z0"))
    assert after.frequency == pytest.approx(2.0 * before.frequency, rel=1e-12)
    assert after.damping_ratio == pytest.approx(before.damping_ratio, rel=1e-9)


@pytest.mark.parametrize("quantity", ["pace", "payload", "overhang"])
def test_limits_are_where_a_requirement_fails(quantity: Any) -> None:
    """At the limit all requirements are met; a thousandth beyond it the named one is not."""
    machine = with_product(cart(), CATALOGUE["large"], "Z0")
    places: dict[str, Any] = {"payload": {"at": (0.3, 0.2, 0.1)}, "overhang": {"direction": (0, 0, 1)}}
    limit = largest(machine, MOTION, quantity, conditions=WANTED, **places.get(quantity, {}))
    assert limit.margins.hold and limit.margins.smallest == pytest.approx(1.0, abs=2e-3)
    beyond = {
        "pace": lambda: (machine, at_pace(MOTION, 1.001 * limit.value)),
        "payload": lambda: (changed(machine, 1.001 * limit.value, (0.3, 0.2, 0.1)), MOTION),
        "overhang": lambda: (shifted(machine, 1.001 * limit.value), MOTION),
    }[quantity]()
    place = {
        "payload": " more at (300, 200, 100) mm from L",
        "overhang": "m along (0, 0, 1)",
        "pace": "given pace",
    }
    assert place[quantity] in limit_report(machine, limit, WANTED).answer[0]
    margins = margins_of(life_of(simulate(*beyond), WANTED))
    assert not margins.hold and margins.first_to_fail == limit.margins.first_to_fail


@pytest.mark.parametrize("quantity", ["payload", "overhang"])
def test_a_limit_of_what_is_added_is_not_negative(quantity: Any) -> None:
    """Of a machine that meets its requirement by less than the accuracy of the search."""
    machine = with_product(cart(), CATALOGUE["large"], "Z0")
    safety = life_of(simulate(machine, MOTION), WANTED).weakest.static.safety
    limit = largest(machine, MOTION, quantity, conditions=LifeConditions(safety=safety / (1.0 + 3e-5)))
    assert 0.0 <= limit.value and limit.margins.hold


@pytest.mark.parametrize("name", ["speed", "acceleration", "deceleration", "jerk"])
def test_limits_of_moves_are_where_a_requirement_fails(name: Any) -> None:
    """A bound in the middle of what the limit changes: it is met at the value found, and not a thousandth beyond."""
    machine = with_product(cart(), CATALOGUE["large"], "Z0")
    jerk = 60.0 if name == "jerk" else 8.0  # slower ramps make the machine vibrate too little to tell
    limits = {"acceleration": 1.0, "deceleration": 1.2, "jerk": jerk, "dwell": 0.3}
    # At the lower speed it is the speed that limits the acceleration.
    way, *speeds = (0.1, 0.05, 0.04) if name == "speed" else (0.4, 0.8, 0.7)
    ways = zip((way, -way), speeds, strict=True)
    listed = [Move(distance=each, speed=speed, **limits) for each, speed in ways]
    moves = Moves(moves=listed, rate=256)

    def found(factor: float, conditions: LifeConditions) -> Life:
        return life_of(simulate(machine, moves.with_limit(name, factor).motion()), conditions)

    low, high = (found(factor, WANTED).weakest.static.safety for factor in (1.0, 2.0))
    assert high < 0.999 * low
    wanted = LifeConditions(safety=0.5 * (low + high))
    limit = largest(machine, moves, name, conditions=wanted)
    factor = limit.value / moves.limit(name)
    assert 1.0 < factor < 2.0 and limit.margins.hold
    assert margins_of(found(factor, wanted)).hold and not margins_of(found(1.001 * factor, wanted)).hold
    # Asked for more than it has, it is lowered.
    lowered = largest(machine, moves.with_limit(name, 2.0), name, conditions=wanted)
    assert lowered.value == pytest.approx(limit.value, rel=1e-3)


def test_a_limit_ends_where_a_force_lacks_its_phase() -> None:
    """At the speed that the move just reaches: v^2/a + v a/j is its distance."""
    machine = with_product(cart(), CATALOGUE["large"], "Z0")
    force = {"force": (0.0, -100.0, 0.0), "during": "constant speed"}
    keys = {"speed": 0.3, "acceleration": 2.0, "jerk": 40.0, "dwell": 0.3}
    moves = Moves(moves=[Move(distance=0.4, forces=[force], **keys)], rate=256)
    limit = largest(machine, moves, "speed", conditions=LifeConditions(safety=0.1))
    reached = np.polynomial.Polynomial([-0.4, 2.0 / 40.0, 1.0 / 2.0]).roots().max()
    assert limit.value == math.inf and limit.margins.hold
    assert limit.tried[1] == pytest.approx(reached, rel=1e-3) and limit.tried[1] < reached
    assert "constant speed" in limit.beyond and limit.beyond in limit_report(machine, limit, WANTED).answer[0]
    # Downwards too: with v^2/a + v a/j of the way left, the acceleration cannot be halved.
    short = Moves(moves=[Move(distance=0.08, forces=[force], **keys)], rate=256)
    safety = life_of(simulate(machine, short.motion())).weakest.static.safety
    wanted = LifeConditions(safety=1.001 * safety)
    assert largest(machine, short, "acceleration", conditions=wanted).value < 2.0
    with pytest.raises(
        RunError, match="missed even at 0.* with less the moves are refused: .*constant speed"
    ):
        largest(machine, short, "acceleration", conditions=LifeConditions(safety=2.0 * safety))


def changed(machine: Machine, mass: float, at: tuple[float, float, float]) -> Machine:
    return machine.model_copy(update={"body": with_payload(machine.body, mass, np.array(at))})


def shifted(machine: Machine, distance: float) -> Machine:
    body = machine.body
    center = (body.center_of_mass[0], body.center_of_mass[1], body.center_of_mass[2] + distance)
    return machine.model_copy(update={"body": body.model_copy(update={"center_of_mass": center})})


def test_pace_keeps_the_travel() -> None:
    """Speed and acceleration are derivatives of the same travel in another time."""
    fast = at_pace(MOTION, 2.0)
    assert fast.velocity is not None and fast.position is not None
    assert np.ptp(fast.time) == pytest.approx(0.5 * np.ptp(MOTION.time))
    travel = np.sum(0.5 * (fast.velocity[1:, 0] + fast.velocity[:-1, 0]) * np.diff(fast.time))
    assert travel == pytest.approx(np.sum(0.5 * (SPEED[1:] + SPEED[:-1]) * np.diff(TIME)), abs=1e-9)
    gain = np.cumsum(0.5 * (fast.acceleration[1:, 0] + fast.acceleration[:-1, 0]) * np.diff(fast.time))
    assert np.abs(gain - fast.velocity[1:, 0]).max() < 1e-3


@pytest.mark.parametrize("size", [0.0, 3.0])
def test_bodies_that_are_joined_have_the_sum_of_their_moments(size: float) -> None:
    """Mass, first moment and inertia about L add up; a payload is a point mass."""
    body, at, inertia = cart().body, np.array([0.3, -0.2, 0.5]), size * np.eye(3)
    loaded = joined(body, 70.0, at, inertia)
    assert loaded == with_payload(body, 70.0, at) or size
    moment = body.mass * np.array(body.center_of_mass) + 70.0 * at
    assert (loaded.mass, loaded.center_of_mass) == (body.mass + 70.0, pytest.approx(moment / loaded.mass))

    def about_reference(mass: float, r: np.ndarray, central: np.ndarray) -> np.ndarray:
        return np.asarray(central + mass * (r @ r * np.eye(3) - np.outer(r, r)))

    first, both = (
        about_reference(one.mass, np.array(one.center_of_mass), one.central_inertia())
        for one in (body, loaded)
    )
    assert both == pytest.approx(first + about_reference(70.0, at, inertia), rel=1e-12)


def test_what_cannot_be_sized_is_refused() -> None:
    with pytest.raises(ArgumentError, match="'huge' is neither a name in the catalogue.*; its makers are m"):
        size(cart(), MOTION, CATALOGUE, products=["huge"])
    machine = with_product(cart(), CATALOGUE["small"], "Z0")
    with pytest.raises(RunError, match="is missed even without payload"):
        largest(machine, MOTION, "payload", conditions=LifeConditions(life="1e9 km"))
    with pytest.raises(ArgumentError, match="quantity"):
        largest(machine, MOTION, "price")
    with pytest.raises(ArgumentError, match="speed: expected planned moves"):
        largest(machine, MOTION, "speed")
    trapezoid = Moves(moves=[Move(distance=1, speed=1, acceleration=1, profile="trapezoid")], rate=64)
    with pytest.raises(ArgumentError, match="jerk: no move has this limit"):
        largest(machine, trapezoid, "jerk")
    with pytest.raises(RunError, match="at 0.0156 of the speed"):
        largest(machine, trapezoid, "speed", conditions=LifeConditions(life="1e9 km"))
    endless = largest(machine, replace(MOTION), "pace", conditions=LifeConditions(safety=1e-6))
    assert math.isinf(endless.value)


def test_an_answer_that_nobody_can_build_is_told() -> None:
    """At the answer, not at the motion that was given; with the limit that is missing, not with a unit."""
    machine = with_product(cart(), CATALOGUE["small"], "Z0")
    conditions = LifeConditions(safety=1e-6)
    found = largest(machine, MOTION, "pace", conditions=conditions)
    told = limit_report(machine, found, conditions).warnings
    speed = np.abs(found.motion.velocity).max()
    assert speed > 10.0 > np.abs(MOTION.velocity).max()
    assert any(f"at this pace: the cart reaches {digits(speed)} m/s" in text for text in told)
    assert all("max_speed" in text and " mm" not in text for text in told if "at this pace" in text)
    assert not any("at this pace" in text for text in input_warnings(machine, MOTION))


def test_a_payload_is_judged_with_the_machine_that_carries_it() -> None:
    """Without a requirement that ends it before, 1024 times the mass sags and vibrates as no machine does."""
    machine, conditions = with_product(cart(), CATALOGUE["small"], "Z0"), LifeConditions(safety=1e-6)
    found = largest(machine, MOTION, "payload", conditions=conditions)
    assert found.machine.body.mass == pytest.approx(machine.body.mass + found.tried[1], rel=1e-12)
    keys = {
        one.key for one in limit_report(machine, found, conditions).warnings if isinstance(one, WarningText)
    }
    assert {"sag", "load at rest"} <= keys


def test_hours_at_stated_cycles_do_not_follow_the_pace_and_others_do() -> None:
    """Stated cycles per hour stay at each pace, and the report says so, and where the motion does not fit."""
    machine = with_product(cart(), CATALOGUE["large"], "Z0")
    duration = float(np.ptp(TIME))
    for cycles, fits in ((None, True), (100.0, True), (3600.0 / duration * 100.0, False)):
        conditions = LifeConditions(safety=3.0, cycles_per_hour=cycles)
        found = largest(machine, MOTION, "pace", conditions=conditions)
        report = limit_report(machine, found, conditions)
        lasts = float(np.ptp(found.motion.time))
        assert lasts == pytest.approx(duration / found.value, rel=1e-9)
        said = [text for text in report.answer if "is kept at every pace" in text]
        assert len(said) == (cycles is not None)
        assert all(f"it lasts {digits(lasts, 4)} s there" in text for text in said)
        assert any("leaves less time than the motion lasts" in text for text in report.warnings) != fits


def test_a_limit_of_moves_is_told_with_what_the_moves_reach() -> None:
    """A short stroke never reaches the speed that its limit allows."""
    machine, conditions = with_product(cart(), CATALOGUE["large"], "Z0"), LifeConditions(safety=1e-6)
    moves = Moves(moves=[Move(distance=0.1, speed=0.2, acceleration=1, profile="trapezoid")], rate=64)
    answer = limit_report(
        machine, largest(machine, moves, "speed", conditions=conditions), conditions
    ).answer[0]
    assert (
        f"reach only {digits(math.sqrt(0.1))} m/s" in answer
    )  # sqrt(a d): half the way speeding up, half braking


@pytest.mark.parametrize(
    "given", [(0, 0), (0, 0, math.nan), (0, 0, math.inf), "here", [[0, 0, 1]], ("a", 0, 0)]
)
def test_a_place_is_three_finite_numbers_of_its_quantity(given: Any) -> None:
    machine = with_product(cart(), CATALOGUE["small"], "Z0")
    for quantity, name in (("payload", "at"), ("overhang", "direction")):
        expected = "(three finite numbers up to 1e\\+09|a list or None|an array of real numbers)"
        with pytest.raises(ArgumentError, match=f"^{name}: expected {expected}, got"):
            largest(machine, MOTION, quantity, **{name: given})


def test_a_place_belongs_to_its_quantity_and_of_a_direction_the_length_does_not_matter() -> None:
    machine = with_product(cart(), CATALOGUE["small"], "Z0")
    with pytest.raises(ArgumentError, match='at: belongs to the quantity "payload" alone'):
        largest(machine, MOTION, "pace", at=(0, 0, 0))
    with pytest.raises(ArgumentError, match='direction: belongs to the quantity "overhang" alone'):
        largest(machine, MOTION, "payload", direction=(1, 0, 0))
    with pytest.raises(ArgumentError, match="^direction: expected a vector other than zero"):
        largest(machine, MOTION, "overhang", direction=(0, 0, 0))
    limits = [largest(machine, MOTION, "overhang", direction=(0, 0, size)).value for size in (1, 1e9)]
    assert limits[0] == limits[1]


def test_a_limit_says_where_smaller_values_fail() -> None:
    """A payload that balances a body off centre: without it the carriages of one side carry too much."""
    machine = with_product(cart(), CATALOGUE["small"], "Z0")
    body = machine.body.model_copy(update={"center_of_mass": (0.0, 0.0, 0.45)})
    aside = machine.model_copy(update={"body": body})
    alone = life_of(simulate(aside, MOTION)).weakest.static.safety
    wanted = LifeConditions(safety=1.1 * alone)
    found = largest(aside, MOTION, "payload", at=(0.0, 0.0, -0.45), conditions=wanted)
    assert found.value > 0.0 and found.failing[0] == 0.0
    for value in found.failing:
        changed = aside.model_copy(update={"body": with_payload(body, value, np.array([0.0, 0.0, -0.45]))})
        assert life_of(simulate(changed, MOTION)).weakest.static.safety < wanted.least_safety
    assert "but not at every smaller value: it fails at 0, " in limit_report(
        aside, found, wanted
    ).text().replace("\n", " ")


def test_riders_move_in_every_run() -> None:
    """A life is that of the run in which the rider moves; candidates that cannot be run share their reason."""
    slide = Rider(
        name="slide",
        mass=100.0,
        center_of_mass=(0.1, -0.4, -0.3),
        inertia=[[4, 0, 0], [0, 5, 0], [0, 0, 3]],
        direction=(0, 0, 1),
        motion="slide.toml",
    )
    machine = cart().model_copy(update={"riders": (slide,)})
    two = Catalogue(products=[CATALOGUE["large"], CATALOGUE["small"]])
    found = size(machine, MOTION, two, riders={"slide": MOTION})
    for one in found.candidates:
        run = simulate(
            with_product(machine, one.product, one.preload_class), MOTION, riders={"slide": MOTION}
        )
        assert one.life == life_of(run, machine.life).machine
    text = sizing_report(machine, size(machine, MOTION, two)).text()
    assert text.count("has the motion") == 1 and "and 1 more: riders" in " ".join(text.split())


def test_commands(tmp_path: Path) -> None:
    """`size` marks the smallest product that holds, `limit` gives the pace."""
    machine, trace, catalogue = (
        EXAMPLES / name for name in ("manipulator.toml", "manipulator.csv", "catalogue.toml")
    )
    text = guideload("size", machine, trace, "--from", catalogue, "--life", "5000 km", "--safety", 3).stdout
    assert "* HGH25CA Z0" in text and "- BM W 20-B" in text
    answer, reasons = " ".join(text.split()).split("Not run")
    assert "1 candidate could not be run, see below." in answer and "HSR35LA" in reasons
    assert "products: 'x'" in refused("size", machine, trace, "--from", catalogue, "--product", "x")
    assert "product" in refused("limit", machine, trace)
    assert "--at needs --of payload" in refused("limit", machine, trace, "--at", "0,0,1")
    assert "--direction needs --of overhang" in refused(
        "limit", machine, trace, "--of", "payload", "--direction", "1,0,0"
    )


@pytest.mark.parametrize(
    "name", ["motor speed", "motor torque", "rms torque of the motor", "speed of the screw", "drive force"]
)
def test_the_pace_at_which_a_limit_of_the_drive_is_reached(name: str) -> None:
    """A limit of 0.6 of the use at the present pace is used up at a slower one: speeds grow with the pace.

    Forces grow with about its square: the body also turns on its guides. There is no rotor: torque is force times
    lead / 2 pi over the ratio.
    """
    share, lead, fast = 0.6, 0.02, 1e4
    drive: dict[str, Any] = {"screw_lead": lead, "gear_ratio": 2.0, "torque_curve": [[0, fast], [fast, fast]]}
    machine = with_product(cart(), CATALOGUE["large"], "Z0").model_copy(
        update={"drive": Drive(**drive), "gravity": (0, -9.81, 0)}
    )
    needed = drive_requirements(simulate(machine, MOTION))
    assert needed.motor is not None and needed.velocity is not None
    screw = np.abs(needed.velocity).max() * 2 * np.pi / lead
    torque = np.abs(needed.force).max() * lead / (2 * np.pi) / 2.0
    drive |= {
        "motor speed": {"torque_curve": [[0, fast], [share * 2.0 * screw, fast]]},
        "motor torque": {"torque_curve": [[0, share * torque], [fast, share * torque]]},
        "rms torque of the motor": {"rated_torque": share * needed.motor.rms_torque},
        "speed of the screw": {"critical_speed": share * screw},
        "drive force": {"max_force": share * needed.peak_force},
    }[name]
    limit = largest(
        machine.model_copy(update={"drive": Drive(**drive)}),
        MOTION,
        "pace",
        conditions=LifeConditions(safety=1e-3),
    )
    assert limit.margins.first_to_fail == name
    slower = drive_requirements(simulate(machine, at_pace(MOTION, limit.value)))
    assert slower.motor is not None
    used = {
        "motor torque": np.abs(slower.force).max() / np.abs(needed.force).max(),
        "rms torque of the motor": slower.motor.rms_torque / needed.motor.rms_torque,
        "drive force": slower.peak_force / needed.peak_force,
    }
    assert (
        used.get(name, limit.value) == pytest.approx(share, rel=5e-4) and used.get(name, limit.value) <= share
    )
    assert limit.tried == (pytest.approx(limit.value / 16.0), 1.0) and not limit.failing
    assert limit.motion.velocity is not None
    assert np.abs(limit.motion.velocity).max() == pytest.approx(limit.value * np.abs(SPEED).max(), rel=1e-12)


@pytest.mark.parametrize(
    ("text", "names"),
    [
        (["middle"], ["middle"]),  # a name goes before the words that others share
        (["MADE up 50"], ["middle of 50 km"]),
        (["up"], ["small", "middle", "middle of 50 km", "large", "large", "unrated"]),
        (["small", "large"], ["small", "large", "large"]),
    ],
)
def test_products_are_chosen_by_name_maker_or_size(text: list[str], names: list[str]) -> None:
    found = size(cart(), MOTION, CATALOGUE, products=text, conditions=WANTED)
    assert [one.product.name for one in found.candidates] == names
    for words in ("made 5", "", " "):  # 5 is not 50
        with pytest.raises(ArgumentError, match="neither a name in the catalogue nor words of maker"):
            size(cart(), MOTION, CATALOGUE, products=[words])


def test_a_name_with_blanks_is_found_and_a_wrong_one_has_a_neighbour() -> None:
    catalogue = Catalogue(products=[product(name, 1e5) for name in ("HGH20CA", "HGH25CA")])
    found = size(cart(), MOTION, catalogue, products=["hgh 20 ca"], conditions=WANTED)
    assert [one.product.name for one in found.candidates] == ["HGH20CA"]
    with pytest.raises(ArgumentError, match="did you mean HGH25CA"):
        size(cart(), MOTION, catalogue, products=["HHG25CA"])


def test_a_row_tells_ratings_mass_and_where_the_stiffness_comes_from() -> None:
    catalogue = Catalogue(
        products=[product("own", 1e4), product("new", 2e4, mass=0.5, preload_classes=classes(1e8))]
    )
    found = size(cart(), MOTION, catalogue, conditions=LifeConditions(life="100 h"))
    table = found.table()
    assert table["stiffness_from"].to_dict() == {"own": "by machine file", "new Z0": "by catalogue"}
    assert math.isnan(table["carriage_mass_kg"]["own"]) and table["carriage_mass_kg"]["new Z0"] == 2.0
    assert table["dynamic_rating_N"].tolist() == [1e4, 2e4] and table["static_rating_N"].tolist() == [
        1.5e4,
        3e4,
    ]
    for one in found.candidates:
        assert one.margins is not None and table["life_hours"][one.name] == one.life_hours
        assert one.margins.ratios["life"] == pytest.approx(table["life_hours"][one.name] / 100.0, rel=1e-12)


def test_a_place_may_have_units(tmp_path: Path) -> None:
    command = ["limit", write_rated(tmp_path), TRACE, "--of", "payload", "--safety", 2, "--at"]
    told = [guideload(*command, place).stdout for place in ("0,0.3,0", "0 mm,300 mm,0")]
    assert told[0] == told[1] and "Tried: " in told[0] and "stroke 2.253 m" in " ".join(told[0].split())
    assert 'expected a length in m, got "1 kg"' in refused(*command, "1 kg,0,0")
    assert "expected three numbers" in refused(*command, "0,0")


def test_a_product_replaces_type_stated_rotations_and_keeps_the_structure() -> None:
    """The damping ratio of the law in series stays: b (k_s/k)^2 grows with the square root of k_s."""
    shared = {
        "length": 0.05,
        "stiffness_y": 2e8,
        "stiffness_z": 2e8,
        "stiffness_roll": 3e4,
        "compliance_y": 4e-9,
    }
    shared |= {"damping_y": 5e3, "damping_z": 5e3}
    tables = [{"name": one.name, "rail": one.rail, "x": one.x, "type": "wagon"} for one in cart().carriages]
    machine = cart().model_copy(update={"carriages": tables, "carriage_types": {"wagon": shared}})
    curve = {"press": [[0, 0], [1e-5, 4e3]], "lift": [[0, 0], [1e-5, 3e3]], "side": [[0, 0], [1e-5, 2e3]]}
    new = product("new", 2e4, preload_classes=[{"name": "Z", "curve": curve}], row_spacing=0.03)
    equipped = with_product(machine, new, "Z")
    assert not any("carriage type" in text for text in machine_warnings(equipped))  # that no carriage has now
    before, after = machine.carriages[0], equipped.carriages[0]
    assert (after.type, after.stiffness_roll, after.stiffness_y, after.width) == (None, None, None, 0.03)
    stiffness = [one.laws[0].stiffness for one in (before, after)]
    assert stiffness == pytest.approx([2e8 / 1.8, 4e8 / 2.6], rel=1e-12)
    damping = [one.damping_shares[0] * one.damping_y for one in (before, after)]
    assert damping[1] / damping[0] == pytest.approx(math.sqrt(stiffness[1] / stiffness[0]), rel=1e-12)


def test_stiffness_of_a_candidate_tells_its_source() -> None:
    """Printed, estimated, or the machine file's where the record allows no estimate."""
    alone = {"body_length": 0.06, "preload_classes": [{"name": "A", "share_of_C": 0.05}]}
    made = [
        product("estimated", 2e4, **alone),
        product("from zero", 3e4, **alone | {"preload_classes": [{"name": "A", "share_of_C": [0, 0.02]}]}),
        product("printed", 4e4, preload_classes=classes(3e8)),
        product("unknown", 5e4, preload_classes=[{"name": "A"}]),
    ]
    found = size(cart(), MOTION, Catalogue(products=made), conditions=WANTED)
    assert [one.stiffness_from for one in found.candidates] == [
        "estimated, within 30 %",
        "estimated, within a factor of 2",
        "by catalogue",
        "by machine file",
    ]
    estimate = made[0].stiffness_estimate("A")
    assert estimate is not None and found.candidates[0].machine is not None
    carriage = found.candidates[0].machine.carriages[0]
    assert carriage.stiffness_y == carriage.stiffness_z == estimate.stiffness
    words = sizing_report(cart(), found).text().replace("\n", " ")
    (table,) = (part for part in sizing_report(cart(), found, 2).sections[0].parts if isinstance(part, Table))
    names = [row[0] for row in table.rows]
    assert len(names) == 2 and any(name.startswith("* ") for name in names)
    assert (
        "stiffness: 1 candidate estimated, within 30 %; 1 candidate estimated, within a factor of 2" in words
    )
    assert "; 1 candidate by machine file" in words


def test_products_that_differ_in_name_only_share_a_run() -> None:
    twins = [
        product("a", 2e4, mass=1.0),
        product("b", 2e4, mass=2.0, page="7"),
        product("c", 2e4, static=2e4),
    ]
    a, b, c = size(cart(), MOTION, Catalogue(products=twins), conditions=WANTED).candidates
    assert a.machine is b.machine and c.machine is not a.machine
    assert [one.product for one in (a, b, c)] == twins


def test_if_none_holds_the_nearest_is_told_and_run_under_its_own_name() -> None:
    """The largest margin is not that of the largest rating; the other name of the one run is not told."""
    weak = {key: 0.1 * value for key, value in MOMENTS.items()}
    rows = {"row_length": "208 mm", "row_spacing": "20 mm"}  # or the moments would give them
    made = [
        product(name, rating, static_moments=moments, **rows)
        for name, rating, moments in (("twin", 2e4, MOMENTS), ("near", 2e4, MOMENTS), ("weak", 4e4, weak))
    ]
    conditions = LifeConditions(safety=1e3)
    found = size(cart(), MOTION, Catalogue(products=made[1:]), conditions=conditions)
    assert found.best is not None and found.best.name == "near"
    assert "The nearest is near: static safety is" in sizing_report(cart(), found).answer[0]
    both = size(cart(), MOTION, Catalogue(products=made), conditions=conditions)
    assert both.best is not None and both.result is not None
    assert {one.product for one in both.result.machine.carriages} == {both.best.name}


def test_a_limit_is_told_as_the_share_that_is_used() -> None:
    """A speed 6 % below its limit is not `1.07 times what is wanted`."""
    machine = cart().model_copy(update={"drive": Drive(linear_motor=True, max_force=2e4)})
    found = size(machine, MOTION, CATALOGUE, conditions=LifeConditions(safety=1e-6))
    assert found.smallest is not None and found.smallest.margins is not None
    share = digits(100.0 / found.smallest.margins.ratios["drive force"])
    assert f"drive force is {share} % of its limit" in sizing_report(machine, found).answer[0]


def test_a_limit_of_the_drive_is_among_the_requirements_that_are_named() -> None:
    conditions, found = LifeConditions(safety=1e-6), {}
    for force in (1.0, 2e4, None):
        machine = cart().model_copy(update={"drive": Drive(linear_motor=True, max_force=force)})
        sizing = size(machine, MOTION, CATALOGUE, conditions=conditions)
        (found[force],) = sizing_report(machine, sizing).answer
    limits = "(no life is required) within the limits of drive and product"
    assert limits in found[1.0] and limits in found[2e4] and "within" not in found[None]
    assert "none of" in found[1.0] and "The nearest is" in found[1.0]


@pytest.mark.parametrize("is_checked", [True, False])
def test_a_limit_warns_of_values_that_nobody_has_checked(is_checked: bool) -> None:
    doubtful = product("doubtful", 4e4, unverified=() if is_checked else ("dynamic",))
    machine = with_product(cart(), doubtful, None)
    report = limit_report(machine, largest(machine, MOTION, "payload", conditions=WANTED), WANTED)
    assert any("not checked by a person" in text for text in report.warnings) != is_checked


def test_two_makers_by_the_names_of_their_products() -> None:
    run = EXAMPLES / "manipulator.toml", EXAMPLES / "manipulator.csv"
    pair = "--product", "HGW25CC ZA", "--product", "THK SHS25C C1"
    text = " ".join(guideload("compare", *run, *pair).stdout.split())
    assert "HGW25CC ZA: Warning: stiffness of all carriages (HGW25CC ZA) estimated, within 30 %" in text
    for wrong, words in (("HGW25CC", "HGW25CC Z0"), ("HGW25CC ZC", "Z0, ZA, ZB"), ("HGW25C", "did you mean")):
        assert words in refused("compare", *run, "--product", "HGH25CA ZA", "--product", wrong)
    text = guideload("size", *run, "--product", "HGW25CC", "--product", "SHS25C").stdout
    assert "HGW25CC ZA" in text and "SHS25C C1" in text
