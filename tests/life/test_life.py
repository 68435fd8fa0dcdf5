"""Life and safety of a machine: their parts add up, their limits are told, and what is missing is refused."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from lives import PRODUCT, cart, moved
from machines import carriage, having, machine, with_carriages
from moves import BRISK, GENTLE, Move
from texts import one_line

from guideload._core import Law
from guideload.base.errors import ArgumentError, ConfigError, LifeError
from guideload.base.number_text import kilometres
from guideload.catalogue.conditions import RULES, LifeConditions, RuleName
from guideload.catalogue.product import Product
from guideload.catalogue.stiffness import CONTACT_EXPONENT
from guideload.life.arrangement import arrangements
from guideload.life.bands import LifeBand
from guideload.life.by_place import rail_damage
from guideload.life.equivalent_load import row_loads
from guideload.life.life import Life, life_of
from guideload.life.load_parts import CAUSES, load_parts
from guideload.life.rating_life import failure_probability, system_life
from guideload.machine.components import sum_bodies
from guideload.machine.payloads import Payload
from guideload.machine.riders import Rider
from guideload.motion.motion import Motion
from guideload.reports.life import life_report
from guideload.simulation.result import Result
from guideload.simulation.simulation import simulate
from guideload.sizing.requirements import margins_of


@pytest.fixture(scope="module")
def result() -> Result:
    return simulate(cart(), moved(BRISK))


@pytest.fixture(scope="module")
def life(result: Result) -> Life:
    return life_of(result)


def test_a_mean_load_above_the_peak_load_is_explained_where_it_stands(life: Life) -> None:
    """Carriages that bear hardly any moment: those are counted, and are no part of the resultant."""
    assert "P_m exceeds" not in life_report(life, band=False).text()
    narrow = Product(**{**PRODUCT, "static_moments": {"roll": 6.0, "pitch": 5.0, "yaw": 5.0}})
    found = life_of(simulate(cart().model_copy(update={"products": (narrow,)}), moved(BRISK)))
    peaks = np.hypot(*np.moveaxis(found.record.result.carriage_loads[:, :, 1:3], 2, 0)).max(axis=0)
    assert all(one.mean_load > peaks[one.index] for one in found.carriages)
    text = " ".join(life_report(found, band=False).text().split())
    assert "P_m exceeds the peak load of carriage 1a, 1b, 2a and 2b" in text and "C0 (|Mx|/M0x" in text


def test_the_causes_add_up_to_the_worst_load_and_the_phases_to_one(life: Life) -> None:
    for one in life.carriages:
        assert sum(one.worst.shares.values()) == pytest.approx(one.worst.load, rel=1e-12)
        assert one.static.safety == pytest.approx(60e3 / one.worst.load, rel=1e-15)
        assert list(one.worst.shares) == ["weight", "acceleration", "vibration"]  # there is nothing else
    assert sum(life.phases.values()) == pytest.approx(1.0, rel=1e-12)
    assert life.phases["at rest"] < 1e-3  # standing costs no life


@pytest.mark.parametrize("settings", [{}, {"method": "implicit", "step": 1e-3}])
def test_the_causes_of_the_worst_load_are_those_at_its_time(settings: dict[str, Any]) -> None:
    """Also between coarse samples, in which the acceleration changes."""
    soft = {"stiffness_y": 3.8e7, "stiffness_z": 3.8e7, "damping_y": 4e4, "damping_z": 4e4}
    changed = with_carriages(cart(), **soft)
    motion = moved(Move(speed=0.5, acceleration=5.0, jerk=60.0, dwell=0.2, cruise=0.05), 20.0)
    for one in life_of(simulate(changed, motion, **settings)).carriages:
        then = simulate(changed, motion, times=[one.worst.time], **settings)
        parts, load = load_parts(then), then.carriage_loads[0, one.index]
        causes = np.stack([part[0, one.index] for part in parts.values()])
        expected = dict(zip(parts, one.static_rule.shares(load, causes), strict=True))
        assert one.worst.shares == pytest.approx(expected, rel=1e-6, abs=1e-6 * one.worst.load)


def test_each_cause_of_the_worst_load_has_its_share() -> None:
    """A mounting error, a payload from 0.1 s on, and a force: each share is what the bare, straight cart lacks."""
    bare, motion = cart(), moved(BRISK)
    wrong = with_carriages(bare, bare.carriages[0].name, mounting_error=(3e-5, 1e-5))
    keys = {"name": "part", "center_of_mass": (0.3, 0.2, -0.1), "times": [(0.1, 9.0)]}
    part = Payload(mass=90.0, inertia=((1.5, 0, 0), (0, 1.2, 0), (0, 0, 0.9)), **keys)
    wrench = np.outer(100.0 * np.sin(3.0 * motion.time), np.eye(6)[2])
    machine = wrong.model_copy(update={"payloads": (part,)})
    life = life_of(simulate(machine, replace(motion, wrench=wrench)))
    parts = life.record.parts
    assert [*parts] == [cause for cause in CAUSES if cause not in ("rider", "preload")]  # there are none
    for one in life.carriages:
        assert sum(one.worst.shares.values()) == pytest.approx(one.worst.load, rel=1e-12)

    size = np.abs(parts["weight"]).max()
    np.testing.assert_allclose(parts["weight"][0], bare.static_carriage_loads, atol=1e-9 * size)
    np.testing.assert_allclose(
        parts["rail error"][0], wrong.static_carriage_loads - bare.static_carriage_loads, atol=1e-9 * size
    )
    after = np.flatnonzero(life.record.travel.time == 0.1)[1]  # there are two stamps at the change
    loaded = load_parts(simulate(bare.model_copy(update={"body": sum_bodies(bare.body, [part])}), motion))
    carried = parts["weight"] + parts["payload"] + parts["acceleration"]
    np.testing.assert_allclose(carried[after:], loaded.quasi_static[after - 1 :], atol=1e-9 * size)
    assert not parts["payload"][:after].any()


def test_the_weight_of_a_rider_elsewhere_is_a_cause_of_its_own() -> None:
    """A rider that moves slowly by 0.3 m; the acceleration has the share that it has with a rider that stands."""
    keys = {"center_of_mass": (-0.1, -0.2, 0.1), "inertia": np.diag([3.0, 4.0, 5.0]).tolist()}
    rider = Rider(name="slide", mass=300.0, direction=(1.0, 0.0, 0.0), **keys)
    machine, motion = cart().model_copy(update={"riders": (rider,)}), moved(GENTLE)
    time = motion.time
    jerk = np.array([1.0, -1.0, -1.0, 1.0]) * 0.3 / 2.0 / (0.25 * time[-1]) ** 3
    slide = Motion.along_x(
        time[0] + 0.25 * time[-1] * np.arange(5), np.append(0.0, np.cumsum(jerk) * 0.25 * time[-1])
    )
    parts, still = (
        load_parts(simulate(machine, motion, riders=one, times=time)) for one in ({"slide": slide}, {})
    )
    size = np.abs(parts["weight"]).max()
    np.testing.assert_allclose(parts["acceleration"], still["acceleration"], atol=1e-9 * size)
    there = machine.model_copy(update={"riders": (rider.model_copy(update={"position": 0.3}),)})
    # The body still vibrates a little, and with it the rider.
    np.testing.assert_allclose(
        parts["rider"][-1],
        there.static_carriage_loads - machine.static_carriage_loads,
        rtol=1e-6,
        atol=1e-7 * size,
    )


def test_damage_of_all_places_is_that_of_all_carriages(life: Life) -> None:
    for place in life.places:
        damage = sum(one.damage.sum() for one in life.carriages if one.rail == place.rail)
        assert place.damage.sum() == pytest.approx(damage, rel=1e-12)
    for one in life.carriages:
        assert one.damage.sum() == pytest.approx(life.distance / one.life, rel=1e-12)


def test_slow_motion_needs_no_load_factor_and_fast_motion_does(life: Life) -> None:
    slow = life_of(simulate(cart(), moved(Move(speed=0.5, acceleration=0.25, jerk=0.5))))
    for one, fast in zip(slow.carriages, life.carriages, strict=True):
        assert [one.factor_life, one.factor_safety] == pytest.approx([1.0, 1.0], abs=2e-3)
        assert fast.factor_safety > 1.1 > one.factor_safety


@pytest.mark.parametrize("error", [0.0, 10e-6])
def test_the_load_factor_in_the_catalogue_formula_gives_the_simulated_life(error: float) -> None:
    """Of a machine so stiff that its loads are those of statics, on straight rails, with f_W in the formula."""
    stiff = with_carriages(cart(), stiffness_y=4e11, stiffness_z=4e11)
    static = simulate(stiff, moved(BRISK))
    life = life_of(simulate(with_carriages(cart(), "1a", mounting_error=(error, 0.0)), moved(BRISK)))
    for one in life.carriages:
        conditions = LifeConditions(load_factor=one.factor_life)
        catalogue = life_of(static, conditions).carriages[one.index]
        assert catalogue.life == pytest.approx(one.life, rel=1e-3)


def test_machine_and_rails_last_as_the_weibull_sum_of_their_carriages(life: Life) -> None:
    lives = np.array([one.life for one in life.carriages])
    assert life.machine == pytest.approx(np.sum(lives**-1.5) ** (-1 / 1.5), rel=1e-13)
    assert life.machine == pytest.approx(system_life(list(life.rails.values())), rel=1e-13)
    assert system_life([3.0] * 4) == pytest.approx(3.0 * 4 ** (-1 / 1.5), rel=1e-14)
    assert system_life([3.0, np.inf]) == 3.0 and system_life([np.inf] * 2) == np.inf
    for travel in (0.5 * life.machine, life.machine, 3.0 * life.machine):
        failures = [failure_probability(travel, one, 0.9) for one in lives]
        assert life.failure_probability(travel) == pytest.approx(
            1 - np.prod(1 - np.array(failures)), rel=1e-12
        )
    assert life.failure_probability(life.machine) == pytest.approx(0.1, rel=1e-12)
    # Probabilities of survival multiply, if each life is that of 90 %.
    survival = np.prod(0.9 ** ((life.machine / lives) ** 1.5))
    assert survival == pytest.approx(0.9, rel=1e-13)


def test_hours_and_years_follow_from_the_plan(result: Result) -> None:
    plan = life_of(result, LifeConditions(cycles_per_hour=60, hours_per_year=4000))
    assert plan.hours(plan.distance) == pytest.approx(1 / 60, rel=1e-14)
    assert plan.years(plan.distance) == pytest.approx(1 / 60 / 4000, rel=1e-14)
    always = life_of(result)
    assert always.hours(always.distance) * 3600 == pytest.approx(np.ptp(result.quantities["time"]), rel=1e-14)
    assert always.years(1.0) == always.hours(1.0) / 8766  # continuous operation
    lasts = np.ptp(result.quantities["time"])
    for cycles, said in ((3599.0 / lasts, False), (3601.0 / lasts, True)):
        text = one_line(life_report(life_of(result, LifeConditions(cycles_per_hour=cycles))).text())
        assert ("s for the motion, which lasts" in text) is said
    assert not life_of(result, LifeConditions(life="1e9 km")).holds
    assert not life_of(result, LifeConditions(safety=1e3)).holds
    assert always.holds


@pytest.mark.parametrize(
    ("unit", "per_cycle"), [("m", 0.0), ("h", 1 / 60), ("years", 1 / 60 / 4000), ("cycles", 1.0)]
)
def test_a_required_life_in_any_unit_divides_at_the_life(result: Result, unit: str, per_cycle: float) -> None:
    plan = LifeConditions(cycles_per_hour=60, hours_per_year=4000)
    life = life_of(result, plan)
    reached = life.machine * (per_cycle / life.distance if per_cycle else 1.0)
    for factor, holds in ((1 - 1e-12, True), (1 + 1e-12, False)):
        wanted = life_of(result, plan.model_copy(update={"life": f"{factor * reached!r} {unit}"}))
        assert wanted.wanted == pytest.approx(factor * life.machine, rel=1e-14)
        assert wanted.holds is holds
        assert margins_of(wanted).ratios["life"] == pytest.approx(1 / factor, rel=1e-14)


def test_a_life_that_fatigue_will_not_end_is_said_so(result: Result) -> None:
    text = "fatigue will not end it"
    light, heavy = (life_of(result, LifeConditions(load_factor=factor)) for factor in (1e-2, 100.0))
    assert light.hours(light.machine) > 1e5 > heavy.hours(heavy.machine)
    assert text in life_report(light, band=False).answer[0]
    assert text not in life_report(heavy, band=False).answer[0]
    missed = life_of(result, LifeConditions(load_factor=1e-2, life=f"{2 * light.machine!r} m"))
    assert text not in life_report(missed, band=False).answer[0]
    safe = life_of(result, LifeConditions(load_factor=1e-2, life="1 km"))
    assert "one fails before 1 km is below 0.01 %." in life_report(safe, band=False).answer[0]


def test_factors_of_the_whole_formula(result: Result) -> None:
    plain = life_of(result).carriages[0]
    conditions = LifeConditions(
        hardness_factor=0.9, temperature_factor=0.8, contact_factor=0.81, load_factor=1.5, reliability=0.99
    )
    changed = life_of(result, conditions)
    ratio = (0.9 * 0.8 * 0.81 / 1.5) ** 3 * (np.log(0.99) / np.log(0.9)) ** (1 / 1.5)
    assert changed.carriages[0].life == pytest.approx(ratio * plain.life, rel=1e-13)
    assert changed.carriages[0].static.safety == pytest.approx(0.81 * plain.static.safety, rel=1e-14)
    assert any("the life is that of 1.5 times these loads" in note for note in changed.notes)


def test_loads_of_the_rows_are_those_of_the_law() -> None:
    for rolling, exponent in CONTACT_EXPONENT.items():
        law = Law.preloaded(4e8, 2e3, exponent)
        deflection = np.linspace(0.0, 2.0, 9) * law.edges[-1]
        loaded, other = row_loads(law.force(deflection), 2e3, rolling)
        share = deflection / law.edges[-1]
        assert loaded == pytest.approx(2e3 * (1 + share) ** exponent, rel=1e-13)
        assert other == pytest.approx(2e3 * np.maximum(1 - share, 0) ** exponent, abs=1e-9)


def test_rows_of_a_preloaded_carriage_carry_the_preload_at_rest() -> None:
    """Heavier than the preload: the unloaded row opens; lighter: both rows carry, and differ by the load."""
    for preload, opens in ((8e3, False), (500.0, True)):
        classes = [{"name": "A", "stiffness": 4e8, "preload": preload}]
        product = Product(**{**PRODUCT, "preload_classes": classes})
        keys = {"preload_y": preload, "rolling": "ball"}
        built = having(with_carriages(cart(), **keys), products=[product])
        for one in life_of(simulate(built, moved(GENTLE, 200.0))).carriages:
            assert one.rows is not None
            largest, smallest = one.rows
            assert largest > preload > smallest and (smallest == 0.0) == opens


@pytest.mark.parametrize("law", ["class", "range", "curve", "own"])
def test_preload_counts_by_default_and_the_print_says_what_it_leaves_out(law: str) -> None:
    """The largest preload of the class, or that of the own law; with the causes, and in the note of the print."""
    stiffness: dict[str, Any] = {"stiffness": 4e8}
    if law == "curve":
        curve = [[0.0, 0.0], [1e-4, 4e4]]
        stiffness = {"curve": dict.fromkeys(("press", "lift", "side"), curve)}
    preload = 9e3 if law == "own" else 8e3
    of_class = {"share_of_C0": [0.1, 8e3 / 60e3]} if law == "range" else {"preload": 8e3}
    classes = [{"name": "A", **stiffness, **of_class}]
    own = {"preload_y": 7e3, "preload_z": 9e3, "rolling": "ball"} if law == "own" else {}
    products = [Product(**{**PRODUCT, "preload_classes": classes})]
    run = simulate(having(with_carriages(cart(), **own), products=products), moved(GENTLE, 200.0))
    counted, printed = life_of(run), life_of(run, LifeConditions(preload_in_life=False))
    assert counted.with_preload is None and printed.with_preload is not None
    reason = "A preload F0 raises it"  # beside a mean load above the peak
    for found, has in ((counted, True), (printed, False)):
        shown = " ".join(life_report(found, band=False).text().split()).partition("P_m exceeds")[2]
        assert (reason in shown.partition("P_m: mean")[0]) == has
    for one, other, again in zip(
        counted.carriages, printed.carriages, printed.with_preload.carriages, strict=True
    ):
        assert again.life == one.life < 0.5 * other.life and one.preload == other.preload == preload
        loaded, _ = row_loads(np.array([other.static.peak]), preload, "ball")
        assert one.static.peak == pytest.approx(float(loaded[0]), rel=1e-13)
        assert one.static.safety == pytest.approx(60e3 / one.static.peak, rel=1e-13)
        assert sum(one.worst.shares.values()) == pytest.approx(one.static.peak, rel=1e-12)
        assert one.worst.shares["preload"] == pytest.approx(one.static.peak - other.static.peak, rel=1e-9)
        assert one.mean_load >= preload
    said = "\n".join(printed.notes)
    assert f"{kilometres(counted.machine)} km instead of {kilometres(printed.machine)} km" in said


def test_carriages_side_by_side_share_the_contact_factor() -> None:
    near = [
        carriage(name, x=x, product="20") for name, x in (("a", 0.0), ("b", 0.105), ("c", 0.5), ("d", 0.605))
    ]
    found = arrangements(machine(*near, carriage("e", x=0.71), products=[Product(**PRODUCT)]))
    assert [place.side_by_side for place in found] == [2, 2, 3, 3, 3]  # e, without product, is 105 mm from d
    assert {place.on_rail for place in found} == {5}
    assert found[0].contact_factor == 0.81 and found[2].contact_factor == 0.72


def test_a_product_without_length_is_said_to_count_as_apart() -> None:
    product = Product(**{key: value for key, value in PRODUCT.items() if key != "carriage_length"})
    machine = cart().model_copy(update={"products": (product,)})
    found = life_of(simulate(machine, moved(BRISK)))
    assert any("carriage_length of 20 is not known" in note for note in found.notes)
    given = life_of(simulate(machine, moved(BRISK)), LifeConditions(contact_factor=0.81))
    assert not any(
        "carriage_length" in note for note in [*given.notes, *life_of(simulate(cart(), moved(BRISK))).notes]
    )


def test_no_travel_is_negative_or_unknown(life: Life) -> None:
    """Of a distance of 0 nothing fails, and after an infinite one everything has."""
    assert life.failure_probability(0.0) == 0.0 and life.failure_probability(np.inf) == 1.0
    assert life.hours(0.0) == 0.0 and life.hours(np.inf) == np.inf
    (place, *_) = life.places
    for wrong in (-1.0, np.nan):
        for question in (life.failure_probability, life.hours, life.years, place.worst_window):
            with pytest.raises(ArgumentError, match="(travel|life|width): expected a.* 0 m, got"):
                question(wrong)
    with pytest.raises(ArgumentError, match="width: expected a length above 0 m"):
        place.worst_window(0.0)


def test_damage_lies_where_the_carriage_was() -> None:
    """At constant damage per path from 0 to 1 m and three times as much from 1 to 2 m; the way back costs nothing."""
    position = np.array([[0.0, 1.0, 2.0, 0.0]])
    place = rail_damage("1", position, np.array([[1.0, 3.0, 0.0]]))
    middle = 0.5 * (place.edges[1:] + place.edges[:-1])
    assert place.density[middle < 0.99] == pytest.approx(1.0, rel=1e-9)
    assert place.density[middle > 1.01] == pytest.approx(3.0, rel=1e-9)
    assert place.worst_window() == pytest.approx((1.0, 2.0, 0.75), rel=1e-12)
    assert place.worst_window(5.0) == pytest.approx((0.0, 2.0, 1.0), rel=1e-12)


def test_limits_that_are_passed_are_told(result: Result) -> None:
    def notes(move: Motion, **changes: Any) -> str:
        products = [Product(**{**PRODUCT, **changes})]
        return "\n".join(life_of(simulate(cart().model_copy(update={"products": products}), move)).notes)

    far = moved(GENTLE)
    assert notes(far).startswith("no preload is known of carriage 1a, 1b, 2a and 2b") and "\n" not in notes(
        far
    )
    assert "the stroke of" in notes(far, carriage_length="5 m")
    assert "speed reaches 1.6 m/s, but 20 allows 1.5 m/s" in notes(far, max_speed=1.5)
    assert "acceleration reaches 2.2 m/s2, but 20 allows 2 m/s2" in notes(far, max_acceleration=2.0)
    assert "P exceeds 0.5 C" in notes(far, dynamic={"value": "5 kN", "base": "50 km"})
    assert "not checked by a person: static" in notes(far, unverified=["static"])


def test_what_is_missing_is_refused() -> None:
    motion = moved(GENTLE)
    with pytest.raises(LifeError, match="no carriage has a product"):
        life_of(simulate(machine(carriage("1"), carriage("2", x=0.5), free=["y", "rz"]), motion))
    with pytest.raises(LifeError, match="velocity of the cart is unknown"):
        life_of(simulate(cart(), Motion.along_x(motion.time, motion.acceleration[:, 0])))
    with pytest.raises(LifeError, match="does not move"):
        life_of(simulate(cart(), Motion.along_x([0.0, 1.0], [0.0, 0.0], velocity=[0.0, 0.0])))
    without = Product(**{**PRODUCT, "static_moments": {}})
    loads = simulate(cart().model_copy(update={"products": [without]}), motion)
    with pytest.raises(
        LifeError, match=r"moment of up to .* which the rule sum counts, but 20 has no static_moments"
    ):
        life_of(loads)
    assert life_of(loads, LifeConditions(rule="thk")).machine > 0.0


@pytest.mark.parametrize("width", [0.1, 1e-4])
def test_the_life_lies_in_its_band_as_both_are_written(
    result: Result, monkeypatch: pytest.MonkeyPatch, width: float
) -> None:
    life = life_of(result)
    lives = np.array([one.life for one in life.carriages])
    ends = life.machine * (1.0 - width), life.machine * (1.0 + width)
    monkeypatch.setattr(
        Life, "band", LifeBand(lives * (1.0 - width), lives * (1.0 + width), ends, "as in this test")
    )
    answer, text = life_report(life).answer[0], " ".join(life_report(life).text().split())
    low, high = map(kilometres, ends)
    row = text.partition(" machine ")[2].partition("P_m:")[0]
    assert (f"{low} to {high}" in row) == (f"{low} to {high} km, 95 %" in answer) == (width > 0.01)
    assert ("within 0.01 %" in row) == (width < 0.01)


@pytest.mark.parametrize("rule", RULES)
def test_the_report_names_the_factors_of_the_product_that_count(rule: RuleName, result: Result) -> None:
    """The static safety falls with the side factor under every rule, and the formulas of the report say so."""

    def judged(**keys: float) -> Life:
        one = Product(**PRODUCT, dynamic_moments=PRODUCT["static_moments"], **keys)
        machine = result.machine.model_copy(update={"products": [one]})
        return life_of(Result(machine, result.data), LifeConditions(rule=rule))

    plain, factor = judged(), judged(side_factor=1.28)
    assert (factor.table()["static_safety"] < plain.table()["static_safety"]).all()
    assert "side_factor of the product, 1.28." in life_report(factor).text().replace("\n", " ")
    assert "factor of the product" not in life_report(plain).text().replace("\n", " ")


def test_a_loaded_result_has_the_same_life_but_no_band(tmp_path: Any, life: Life, result: Result) -> None:
    result.to_netcdf(tmp_path / "loads.nc")
    again = life_of(Result.load(tmp_path / "loads.nc"))
    assert again.table().equals(life.table())
    assert again.band is None and life.band is None  # an exact motion has no uncertainty


def test_whether_the_preload_counts_is_true_or_false() -> None:
    for value in ("off", 1):
        with pytest.raises(ConfigError, match="preload_in_life: expected true or false"):
            LifeConditions(preload_in_life=value)
