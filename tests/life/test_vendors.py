"""Worked examples that makers print, from the machine where they give it. Each says what the print gets wrong."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest
from machines import table

from guideload._core import Law
from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError, ArgumentTypeError
from guideload.catalogue.conditions import RULES, LifeConditions, RuleName
from guideload.catalogue.product import Moments, Product
from guideload.catalogue.rating import Rating
from guideload.catalogue.stiffness import CONTACT_EXPONENT
from guideload.life.arrangement import Arrangement
from guideload.life.equivalent_load import dynamic_load, static_load
from guideload.life.largest_loads import largest_at
from guideload.life.load_parts import load_parts
from guideload.life.mean_load import integrals, mean_load
from guideload.life.rating_life import rating_life
from guideload.life.record import travel_of
from guideload.life.static_safety import static_safety
from guideload.machine.components import Body
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.simulation.simulation import simulate

FOUR = Arrangement(on_rail=2, side_by_side=1)


POINTS = {"length": 1e-6}  # makers take a table as rigid on springs, so the carriages are points


def product(dynamic: float, static: float, base: float = 50e3, exponent: float = 3.0) -> Product:
    rating = Rating(value=dynamic, base=base, exponent=exponent)
    return Product(name="p", maker="m", edition="e", type="ball", dynamic=rating, static=static)


# ---- THK HSR35: a table that is driven there and back


@pytest.fixture(scope="module")
def thk() -> tuple[Array, Motion, Machine]:
    """Loads by statics with m a of the four carriages, (time, 4, 6), in the order of THK; motion and machine."""
    heavy, light = np.array([-0.12, 0.35, 0.05]), np.array([0.0, 0.2, 0.0])
    center = (800.0 * heavy + 500.0 * light) / 1300.0
    body = Body(mass=1300.0, center_of_mass=center, inertia=np.diag([50.0, 50.0, 50.0]))
    machine = table(body, 0.6, 0.4, **POINTS, gravity=(0.0, -9.8, 0.0))
    steps = np.array([0.05, 2.8, 0.15])  # 12.5, 1400 and 37.5 mm at 0.5 m/s
    knots = np.cumsum([0.0, *steps, *steps])
    values = np.array([10.0, 0.0, -10.0 / 3.0, -10.0, 0.0, 10.0 / 3.0])
    time, acceleration = np.repeat(knots, 2)[1:-1], np.repeat(values, 2)
    velocity = np.repeat([0.0, 0.5, 0.5, 0.0, -0.5, -0.5, 0.0], 2)[1:-1]
    motion = Motion.along_x(time, acceleration, velocity=velocity)
    return load_parts(simulate(machine, motion, times=motion.time)).quasi_static, motion, machine


@pytest.mark.parametrize(
    ("instant", "acceleration", "printed", "lateral"),
    [
        (2, 0.0, [2891.0, 4459.0, 3479.0, 1911.0], 0.0),
        (0, 10.0, [-275.6, 7625.6, 6645.6, -1255.6], 333.3),
        (4, -10.0 / 3.0, [3946.6, 3403.4, 2423.4, 2966.6], 111.1),
    ],
)
def test_thk_loads_of_statics_and_of_a_run_whose_acceleration_grows_slowly(
    thk: tuple[Array, Motion, Machine],
    instant: int,
    acceleration: float,
    printed: list[float],
    lateral: float,
) -> None:
    """To 0.1 N, the last printed digit; of the run after a ramp of 2 s, some hundred periods of the lowest mode."""
    ramp = Motion.along_x(np.array([0.0, 2.0, 2.5]), acceleration * np.array([0.0, 1.0, 1.0]))
    for loads in (thk[0][instant], simulate(thk[2], ramp).carriage_loads[-1]):
        assert np.sort(-loads[:, 1]) == pytest.approx(np.sort(printed), abs=0.1)
        assert np.sort(loads[:, 2]) == pytest.approx([-lateral, -lateral, lateral, lateral], abs=0.1)


def test_thk_mean_loads_lives_and_safety(thk: tuple[Array, Motion, Machine]) -> None:
    """The lives are printed with three digits, some of them cut off: 20 674 km as 20 600, 44 881 km as 44 800."""
    loads, motion, machine = thk
    travel = travel_of(simulate(machine, motion, times=motion.time))
    conditions = LifeConditions(load_factor=1.5)
    old, new = product(50.2e3, 81.4e3), product(65.0e3, 91.7e3)
    rule = dynamic_load("thk", old, FOUR)
    means = sorted(mean_load(*integrals(travel, loads[:, i], rule, 3.0), 3.0) for i in range(4))
    assert means == pytest.approx([1985.5, 2940.1, 3520.4, 4492.2], abs=0.06)
    for part, printed in ((old, (239e6, 73.7e6, 43.0e6, 20.6e6)), (new, (519.7e6, 160e6, 93.2e6, 44.8e6))):
        assert part.dynamic is not None
        for mean, life in zip(means, printed, strict=True):
            assert rating_life(part.dynamic, mean, conditions) == pytest.approx(life, rel=4e-3)
    of = [largest_at(motion.time, loads[:, i], static_load("thk", old, FOUR)) for i in range(4)]
    static = [static_safety(one, old, 1.0) for one in of]
    assert min(one.safety for one in static) == pytest.approx(10.2, abs=0.05)


# ---- IKO ME25: a table under weight and process force at constant speed


def test_iko_loads_life_and_safety() -> None:
    """IKO rounds the moments to 224 and 140 N m before it divides them: up to 3 N of each load, and 4410 km of 4429."""
    at, up = np.array([[0.0, 0.0, 0.043], [0.075, 0.080, 0.068]]), np.array([1.0, 1.0, 1.0])

    def ours(point: Array) -> Array:
        """Our axes from IKO's: x along the rails, y up, z to the other side; from the drive at (Y, Z) = (150, 10)."""
        x, across, height = np.asarray(point) * up
        return np.array([x, height - 0.010, 0.150 - across])

    body = Body(mass=20.0, center_of_mass=ours(at.mean(axis=0)), inertia=np.eye(3))
    machine = table(body, 0.100, 0.150, ours(np.zeros(3)), **POINTS)
    motion = Motion.along_x([0.0, 1.0], [0.0, 0.0], velocity=[0.5, 0.5])
    motion = motion.with_force(ours(np.array([0.060, 0.050, 0.083])), (1000.0, -1000.0, -2000.0))
    result = simulate(machine, motion)
    loads = load_parts(result).quasi_static
    order = np.argsort(loads[0, :, 1])
    assert -loads[0, order, 1] == pytest.approx([1750, 346, 252, -1150], abs=4.0)
    assert -loads[0, order, 2] == pytest.approx([1600, -600, 1600, -600], abs=1e-3)
    assert result.carriage_loads[-1] == pytest.approx(
        loads[-1], abs=1e-3
    )  # the run itself, at constant speed
    part = product(18.1e3, 21.1e3)
    rule = dynamic_load("iko", part, FOUR)
    means = [mean_load(*integrals(travel_of(result), loads[:, i], rule, 3.0), 3.0) for i in order]
    printed = [2710, 808, 1750, 1510]
    assert sorted(means) == pytest.approx(sorted(printed), abs=4.0)
    assert part.dynamic is not None
    life = rating_life(part.dynamic, max(means), LifeConditions(load_factor=1.5))
    assert life == pytest.approx(4429e3, abs=0.5e3)
    of = [largest_at(motion.time, loads[:, i], static_load("iko", part, FOUR)) for i in range(4)]
    static = [static_safety(one, part, 1.0) for one in of]
    assert min(one.safety for one in static) == pytest.approx(6.3, abs=0.05)


@pytest.mark.parametrize(
    ("radial", "lateral", "printed"),
    [(1750.0, 1600.0, 2710.0), (346.0, -600.0, 808.0), (252.0, 1600.0, 1750.0), (-1150.0, -600.0, 1510.0)],
)
def test_iko_equivalent_loads_of_the_printed_loads(radial: float, lateral: float, printed: float) -> None:
    load = np.array([0.0, -radial, lateral, 0.0, 0.0, 0.0])
    assert dynamic_load("iko", product(1.0, 1.0), FOUR)(load) == pytest.approx(printed, abs=5.0)


@pytest.mark.parametrize(
    ("rating", "exponent", "printed", "digit"), [(124e3, 10.0 / 3.0, 220e6, 1e6), (95.2e3, 3.0, 43e6, 0.5e6)]
)
def test_iko_lives_at_10_kn(rating: float, exponent: float, printed: float, digit: float) -> None:
    assert Rating(value=rating, base=50e3, exponent=exponent).life(10e3) == pytest.approx(printed, abs=digit)


# ---- factors and short cuts of catalogues


@pytest.mark.parametrize(
    ("reliability", "printed"),
    [(0.90, 1.0), (0.95, 0.62), (0.96, 0.53), (0.97, 0.44), (0.98, 0.33), (0.99, 0.21)],
)
def test_reliability_factors_of_iso_14728(reliability: float, printed: float) -> None:
    conditions = LifeConditions(reliability=reliability)
    rating = Rating(value=1.0, base=1e5, exponent=3.0)
    # 96 and 95 % are printed 0.53 and 0.62 for 0.528 and 0.618: within the last digit.
    assert rating_life(rating, 1.0, conditions) / 1e5 == pytest.approx(printed, abs=0.0052)


def test_a_roller_rating_for_50_km_is_larger_than_for_100_km_by_the_ratio_of_makers() -> None:
    ball, roller = (Rating(value=1.0, base=100e3, exponent=p) for p in (3.0, 10.0 / 3.0))
    assert ball.with_base(50e3).value == pytest.approx(2.0 ** (1.0 / 3.0), rel=1e-15)
    assert roller.with_base(50e3).value == pytest.approx(2.0**0.3, rel=1e-15)
    assert roller.with_base(50e3).life(0.3) == pytest.approx(roller.life(0.3), rel=1e-14)


def test_rules_of_a_single_carriage_with_moments() -> None:
    """The formulas of the makers, written out."""
    part = Product(
        name="p",
        maker="m",
        edition="e",
        type="ball",
        dynamic={"value": 20e3, "base": 50e3},
        static=30e3,
        static_moments=Moments(roll=300.0, pitch=250.0, yaw=200.0),
        dynamic_moments=Moments(roll=200.0, pitch=150.0, yaw=100.0),
        lift_factor=1.19,
        side_factor=1.28,
    )
    load = np.array([0.0, 500.0, -400.0, 6.0, -5.0, 4.0])
    forces, roll, yaw, pitch = 1.19 * 500.0 + 1.28 * 400.0, 6.0 / 300.0, 5.0 / 200.0, 4.0 / 250.0
    radial, axial = 1.19 * 500.0 + 30e3 * (roll + pitch), 1.28 * 400.0 + 30e3 * yaw
    moments = 30e3 * (roll + yaw + pitch)
    dynamic = 20e3 * (6.0 / 200.0 + 5.0 / 100.0 + 4.0 / 150.0)
    upright = 1.19 * 500.0 + moments
    expected: dict[RuleName, float] = {
        "sum": forces + moments,
        "thk": forces + moments,
        "hiwin": forces + moments,
        "hiwin_mg": upright + 0.5 * 1.28 * 400.0,
        "iko": max(radial, axial) + 0.6 * min(radial, axial),
        "rexroth": forces + dynamic,
        "thomson": forces + dynamic,
    }
    alone = Arrangement(1, 1)
    for rule, value in expected.items():
        assert dynamic_load(rule, part, alone)(load) == pytest.approx(value, rel=1e-14), rule
    for rule in ("thk", "hiwin", "thomson"):  # without moments where several carriages run on the rail
        assert dynamic_load(rule, part, FOUR)(load) == pytest.approx(forces, rel=1e-14)
    assert dynamic_load("thk", part, Arrangement(2, 2))(load) == pytest.approx(forces + moments, rel=1e-14)


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("rolling", ["ball", "roller"])
def test_every_rule_counts_what_the_loaded_row_carries(
    rule: RuleName, rolling: Literal["ball", "roller"]
) -> None:
    """Rule x preload x load, against the rows of the carriage law; with P much smaller and larger than the preload."""
    n = CONTACT_EXPONENT[rolling]
    share = np.concatenate(
        [np.linspace(0.0, 1.0, 101), [1.5, 3.0]]
    )  # deflection over that at which a row opens
    for preload in (1.0, 2.09e3, 5e4):
        law = Law.preloaded(5.39e8, preload, n)
        load = law.force(share * law.edges[-1])
        moments = Moments(roll=400.0, pitch=300.0, yaw=300.0)
        part = product(34.9e3, 52.8e3).model_copy(
            update={"static_moments": moments, "dynamic_moments": moments}
        )
        plain = dynamic_load(rule, part, FOUR)
        for counted in (
            dynamic_load(rule, part, FOUR, preload, rolling),
            static_load(rule, part, FOUR, preload, rolling),
        ):
            for direction in np.vstack(
                [np.eye(6)[1:], -np.eye(6)[1:], np.array([0, 0.3, -0.2, 0.01, 0, -0.02])]
            ):
                unit = float(counted.without_preload(direction))
                if unit == 0.0:
                    continue  # a moment that the rule leaves out
                row = preload * (1.0 + share) ** n
                assert counted(np.outer(load / unit, direction)) == pytest.approx(row, rel=1e-12)
        assert plain.preload == 0.0


def test_effective_loads_of_preloaded_carriages() -> None:
    part, none = product(20e3, 30e3), np.zeros(6)
    load = np.array([0.0, -500.0, 0.0, 0.0, 0.0, 0.0])
    part = part.model_copy(update={"dynamic_moments": Moments(roll=1.0, pitch=1.0, yaw=1.0)})
    for rule, at_500 in (
        ("rexroth", 1000.0 * (500.0 / 2800.0 + 1.0) ** 1.5),
        ("thomson", 1000.0 + 1000.0 / 3.0),
    ):
        rule_of = dynamic_load(rule, part, FOUR, 1000.0)
        assert rule_of(none) == pytest.approx(1000.0, rel=1e-14)  # the preload alone
        assert rule_of(load) == pytest.approx(at_500, rel=1e-14)
        assert rule_of(10.0 * load) == pytest.approx(5000.0, rel=1e-14)
    for rule in set(RULES) - {"rexroth", "thomson"}:  # their makers print no effect of a preload
        assert dynamic_load(rule, part, Arrangement(2, 1), 1000.0)(load) == pytest.approx(500.0, rel=1e-14)
    for rule in RULES:
        assert static_load(rule, part, FOUR, 1000.0)(load) == pytest.approx(500.0, rel=1e-14)


def test_a_rating_refuses_loads_and_bases_that_are_none() -> None:
    rating = Rating(value=30e3, base=50e3, exponent=3.0)
    assert rating.life(0.0) == np.inf and rating.life([30e3, 15e3]).tolist() == [50e3, 400e3]
    for load in (-5.0, np.nan, [1.0, -1.0]):
        with pytest.raises(ArgumentError, match="^mean_load: expected loads >= 0 N, got"):
            rating.life(load)
    for base in (0.0, -1.0, np.nan):
        with pytest.raises(ArgumentError, match="^base: expected > 0 m, got"):
            rating.with_base(base)
    with pytest.raises(ArgumentTypeError, match="^mean_load"):
        rating.life("5 kN")
    with pytest.raises(ArgumentTypeError, match="^base"):
        rating.with_base("100 km")  # type: ignore[arg-type]
