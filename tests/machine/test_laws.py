"""Elastic laws of carriages and links: valid and refused keys, and the core's laws."""

import pickle
from typing import Any

import machines
import numpy as np
import pytest
from machines import link, machine

from guideload._core import Law
from guideload.base.errors import ConfigError
from guideload.catalogue.stiffness import CONTACT_EXPONENT
from guideload.machine.laws import Sides
from guideload.machine.machine import Carriage, Machine

DEFLECTION = np.linspace(-40e-6, 40e-6, 161)
CURVE = [["-20 um", "-12 kN"], ["-5 um", "-2 kN"], [0, 0], ["5 um", "1 kN"], ["20 um", "9 kN"]]
HALF = [["0 um", "0 N"], ["5 um", "1 kN"], ["20 um", "9 kN"]]
SIDES = {"positive": "300 N/um", "negative": "500 N/um"}
PRELOAD = {"preload": 1, "rolling": "ball"}

# keys of one direction, without suffix; kind of its law, nominal stiffness, edges
LAWS: dict[str, tuple[dict[str, Any], str, float, list[float]]] = {
    "linear": ({"stiffness": "350 N/um"}, "linear", 3.5e8, []),
    "sides": ({"stiffness": SIDES}, "sided", 5e8, [0.0]),
    "one side": ({"stiffness": {"positive": 3e8, "negative": 0}}, "sided", 3e8, [0.0]),
    "clearance": ({"stiffness": 3.5e8, "clearance": "5 um"}, "sided", 3.5e8, [-5e-6, 5e-6]),
    "clearance and sides": ({"stiffness": SIDES, "clearance": 5e-6}, "sided", 5e8, [-5e-6, 5e-6]),
    "balls": (
        {"stiffness": "539 N/um", "preload": "2.09 kN", "rolling": "ball"},
        "preloaded",
        5.39e8,
        [-3.0 * 2090.0 / 5.39e8, 3.0 * 2090.0 / 5.39e8],  # d0 = 2 n F0/k0
    ),
    "rollers": (
        {"stiffness": 8e8, "preload": 4e3, "rolling": "roller"},
        "preloaded",
        8e8,
        [-20.0 / 9.0 * 4e3 / 8e8, 20.0 / 9.0 * 4e3 / 8e8],
    ),
    "curve": ({"curve": CURVE}, "curve", 1e4 / 15e-6, [-5e-6, 0.0, 5e-6]),
    "odd curve": ({"curve": HALF}, "curve", 8e3 / 15e-6, [-5e-6, 5e-6]),
}
MODEL_LEVEL = {
    "linear": "linear",
    "sided": "piecewise linear",
    "curve": "piecewise linear",
    "preloaded": "smooth nonlinear",
}


def carriage(name: str = "1", y: dict[str, Any] | None = None, z: dict[str, Any] | None = None) -> Carriage:
    """A carriage with the keys of a law along y and along z; one stiffness where none are given."""
    values: dict[str, Any] = {"damping_y": 2e4, "damping_z": 1e4, "stiffness_y": None, "stiffness_z": None}
    for axis, keys in (("y", y), ("z", z)):
        for key, value in (keys or {"stiffness": 3.5e8}).items():
            values[key if key in ("rolling", "damping_in_contact") else f"{key}_{axis}"] = value
    return machines.carriage(name, **values)


# ---- the law of a description


@pytest.mark.parametrize("name", LAWS)
def test_kind_nominal_stiffness_and_edges(name: str) -> None:
    keys, kind, nominal, edges = LAWS[name]
    whole = carriage(y=keys)
    for law in (link(**keys).law, whole.laws[0], carriage(z=keys).laws[1]):
        assert law.kind == kind
        assert law.stiffness == pytest.approx(nominal, rel=1e-14)
        assert law.edges == pytest.approx(edges, rel=1e-14)
    assert (whole.laws[1].kind, whole.laws[1].stiffness) == ("linear", 3.5e8)


@pytest.mark.parametrize("name", LAWS)
def test_each_end_of_a_carriage_has_half_of_its_forces_at_the_same_deflections(name: str) -> None:
    keys, kind, nominal, _ = LAWS[name]
    given = carriage(y=keys)
    table = machine(given, links=(link(**keys),)).link_table()
    assert [law.kind for law in table.laws] == [kind, "linear", kind, "linear", kind]
    assert table.stiffness == pytest.approx([0.5 * nominal, 1.75e8] * 2 + [nominal], rel=1e-14)
    whole = given.laws[0].force(DEFLECTION)
    for end in (0, 2):
        # each end rounds its own few operations, near an edge as a part of the largest force
        assert 2.0 * table.laws[end].force(DEFLECTION) == pytest.approx(whole, rel=1e-13, abs=1e-9)
        assert table.laws[end].edges == pytest.approx(given.laws[0].edges, rel=1e-14)
    assert np.array_equal(table.laws[4].force(DEFLECTION), whole)


def test_forces_are_those_of_the_description() -> None:
    d = np.array([-25e-6, -2e-6, 0.0, 2e-6, 25e-6])
    clear = link(stiffness=SIDES, clearance="5 um").law
    assert clear.force(d) == pytest.approx([-1e4, 0, 0, 0, 6e3], rel=1e-12, abs=0)
    assert link(curve=CURVE).law.force(d) == pytest.approx([-46e3 / 3, -800, 0, 400, 35e3 / 3], rel=1e-12)
    for rolling, exponent in (("ball", 1.5), ("roller", 10.0 / 9.0)):  # Hertz; line contact
        law = link(stiffness=5e8, preload=2e3, rolling=rolling).law
        assert law.force(law.edges) == pytest.approx(2e3 * 2.0**exponent * np.array([-1, 1]), rel=1e-12)
        assert CONTACT_EXPONENT[rolling] == exponent


def test_force_slope_and_energy_are_arrays() -> None:
    """What they are for each law: rust/core/tests/laws/law.rs."""
    law = Law.sided(3e8, 5e8, 5e-6).scaled(0.5)
    beyond = np.abs(DEFLECTION) - 5e-6
    k = np.where(beyond > 0.0, np.where(DEFLECTION > 0.0, 1.5e8, 2.5e8), 0.0)
    np.testing.assert_allclose(law.force(DEFLECTION), np.sign(DEFLECTION) * k * beyond, atol=1e-9)
    np.testing.assert_allclose(law.energy(DEFLECTION), 0.5 * k * beyond**2, rtol=1e-12)
    inside = np.abs(beyond) > 1e-12
    np.testing.assert_array_equal(law.tangent(DEFLECTION)[inside], k[inside])


def test_a_curve_from_zero_on_holds_for_both_directions() -> None:
    mirrored = [["-20 um", "-9 kN"], ["-5 um", "-1 kN"], *HALF]
    odd = link(curve=HALF).law
    assert np.array_equal(odd.force(DEFLECTION), link(curve=mirrored).law.force(DEFLECTION))
    assert odd.force(-DEFLECTION) == pytest.approx(-odd.force(DEFLECTION), rel=1e-13, abs=1e-9)
    clear = link(curve=[[0, 0], ["5 um", 0], ["25 um", "7 kN"]]).law
    same = link(stiffness="350 N/um", clearance="5 um").law
    assert clear.force(DEFLECTION) == pytest.approx(same.force(DEFLECTION), rel=1e-12, abs=1e-9)


@pytest.mark.parametrize(
    "keys",
    [
        {"stiffness": 3.5e8, "clearance": 0},
        {"stiffness": 3.5e8, "clearance": "0 um"},
        {"stiffness": {"positive": "350 N/um", "negative": 3.5e8}},
        {"curve": [[0, 0], ["20 um", "7 kN"]]},
        {"curve": [["-20 um", "-7 kN"], ["4 um", "1.4 kN"], ["10 um", "3.5 kN"]]},
    ],
)
def test_what_amounts_to_one_stiffness_is_linear(keys: dict[str, Any]) -> None:
    found, plain = machine(carriage(y=keys, z=keys)), machine(carriage())
    a, b = found.link_table(), plain.link_table()
    assert found.model_level == "linear"
    assert [law.kind for law in a.laws] == ["linear"] * 4
    # The slope of a curve is a quotient: one rounding.
    assert a.stiffness == pytest.approx(b.stiffness, rel=1e-15 if "curve" in keys else 0.0)
    assert np.array_equal(a.damping, b.damping)


@pytest.mark.parametrize("name", LAWS)
def test_the_model_level_is_the_highest_that_a_law_needs(name: str) -> None:
    keys, kind, _, _ = LAWS[name]
    others = [carriage(), carriage("2")]
    held = machine(*others, carriage("3", z=keys)).with_free(["y", "z"])
    assert held.model_level == MODEL_LEVEL[kind] == held.scene.model_level
    preloaded = link(stiffness=1e8, preload=1e3, rolling="ball")
    assert machine(*others, carriage("3", z=keys), links=(preloaded,)).model_level == "smooth nonlinear"


def test_damping_pauses_within_a_clearance_only() -> None:
    clear = {"stiffness": 3.5e8, "clearance": "5 um", "damping_in_contact": True}
    table = machine(carriage(z=clear), carriage("2"), links=(link(**clear),)).link_table()
    assert table.damping_in_contact.dtype == np.bool_
    assert table.damping_in_contact.tolist() == [False, True] * 2 + [False] * 4 + [True]
    assert table.damping.tolist() == [1e4, 5e3] * 4 + [1e4]


# ---- the description as a value


@pytest.mark.parametrize("name", LAWS)
def test_a_description_survives_json_pickling_and_copying(name: str) -> None:
    keys = LAWS[name][0]
    given = machine(carriage(y=keys), carriage("2", z=keys), links=(link(**keys),))
    again = Machine.model_validate_json(given.model_dump_json())
    others = (again, Machine(**given.model_dump()), pickle.loads(pickle.dumps(given)), given.model_copy())
    for other in others:
        assert other == given
        assert hash(other) == hash(given)
    for other in others:
        laws = zip(other.link_table().laws, given.link_table().laws, strict=True)
        assert all(np.array_equal(a.force(DEFLECTION), b.force(DEFLECTION)) for a, b in laws)


def test_a_law_changes_with_a_copy() -> None:
    clear = carriage().model_copy(update={"clearance_y": "5 um"})
    assert [law.kind for law in clear.laws] == ["sided", "linear"]
    assert clear.model_copy(update={"clearance_y": 0}) == carriage()
    curved = carriage().model_copy(update={"stiffness_z": None, "curve_z": HALF})
    assert curved.laws[1].kind == "curve"
    with pytest.raises(ConfigError, match="clearance_y: expected no clearance_y beside preload_y"):
        clear.model_copy(update={"preload_y": 2e3, "rolling": "ball"})


def test_units_si_numbers_and_arrays_are_the_same_description() -> None:
    assert link(stiffness=SIDES) == link(stiffness=Sides(positive=3e8, negative=5e8))
    assert link(stiffness=1e8, clearance="5 um") == link(stiffness=1e8, clearance=5e-6)
    preload = {"stiffness": 1e8, "rolling": "ball"}
    assert link(**preload, preload="2.09 kN") == link(**preload, preload=2090)
    assert link(curve=HALF) == link(curve=np.array([[0, 0], [5e-6, 1e3], [20e-6, 9e3]]))


# ---- what is refused


@pytest.mark.parametrize(
    ("keys", "key", "words"),
    [
        ({}, "stiffness", "(or curve instead), got nothing"),
        ({"stiffness": 0}, "stiffness", "> 0 N/m"),
        ({"stiffness": {"positive": 1}}, "stiffness.negative", 'got nothing; add the key "negative"'),
        ({"stiffness": {"positive": 1, "negative": -1}}, "stiffness.negative", ">= 0 N/m, got -1"),
        ({"stiffness": {"positive": "1 m", "negative": 1}}, "stiffness.positive", "a stiffness in N/m"),
        ({"stiffness": {"positive": 0, "negative": 0}}, "stiffness", "at least one side > 0 N/m"),
        ({"stiffness": 1, "curve": HALF}, "stiffness", "no stiffness beside curve, got 1; .* keep one"),
        ({"stiffness": SIDES, "curve": HALF}, "stiffness", "no stiffness beside curve"),
        ({"stiffness": 1, "clearance": "-5 um"}, "clearance", '>= 0 m, got "-5 um"'),
        (
            {"curve": HALF, "clearance": 5},
            "clearance",
            "no clearance beside curve, got 5; draw the clearance",
        ),
        ({"stiffness": 1, "preload": 0, "rolling": "ball"}, "preload", "> 0 N, got 0; .*leave it out"),
        ({"stiffness": 1, "preload": "1 um", "rolling": "ball"}, "preload", "a force in N"),
        ({"curve": HALF} | PRELOAD, "preload", "no preload beside curve, got 1"),
        ({"stiffness": SIDES} | PRELOAD, "preload", "differs by side, got 1; write stiffness as one value"),
        ({"stiffness": 1, "clearance": 1} | PRELOAD, "clearance", "no clearance beside preload"),
        ({"stiffness": 1, "preload": 1}, "rolling", '"ball" or "roller", got nothing; add the key "rolling"'),
        ({"stiffness": 1, "preload": 1, "rolling": "balls"}, "rolling", '"ball" or "roller", got "balls"'),
        ({"stiffness": 1, "rolling": "ball"}, "rolling", 'without a preload, got "ball"; add preload'),
        ({"stiffness": 1, "damping_in_contact": True}, "damping_in_contact", "got true; add clearance"),
        ({"curve": HALF, "damping_in_contact": True}, "damping_in_contact", "false without a clearance"),
        ({"stiffness": 1, "damping_in_contact": "yes"}, "damping_in_contact", "true or false"),
        ({"curve": 3}, "curve", "a list, got 3"),
        ({"curve": [[0, 0], 3]}, "curve[1]", "[deflection, force], got 3"),
        ({"curve": [[0, 0], [0, "1 m"]]}, "curve[1][1]", "a force in N"),
        ({"curve": []}, "curve", "2 to 16 points"),
        ({"curve": [[0, 0]]}, "curve", "2 to 8 points"),
        ({"curve": [[i - 1, i] for i in range(17)]}, "curve", "2 to 16 points .*; these are 17"),
        ({"curve": [[i, i] for i in range(9)]}, "curve", "2 to 8 points .*; .* is mirrored"),
        ({"curve": [[0, 0], [2, 1], [2, 3]]}, "curve", "ascending order.*[1] and [2] have 2 and 2 m"),
        ({"curve": [[-1, 1], [0, 0], [1, 1]]}, "curve", "never fall.*[0] and [1] have 1 and 0 N"),
        ({"curve": [[1, 1], [2, 2]]}, "curve", "both sides of 0 m, .* from 1 to 2 m: .* begins at [0, 0]"),
        ({"curve": [[-1, -1], [0, 0]]}, "curve", "both sides of 0 m"),
        ({"curve": [[-1, -1], [1, 3]]}, "curve", "a curve through [0, 0], .* force at 0 m is 1 N"),
        ({"curve": [[0, 1], [1, 3]]}, "curve", "a curve through [0, 0], .* force at 0 m is 1 N"),
        ({"curve": [[-1, 0], [1, 0]]}, "curve", "never resists"),
    ],
)
def test_refusals_name_key_value_and_way_out(keys: dict[str, Any], key: str, words: str) -> None:
    """Of a link, and of a carriage in either direction beside one that is sound."""
    once = ("rolling", "damping_in_contact")
    with pytest.raises(ConfigError) as caught:
        link(**keys)
    assert [problem.key for problem in caught.value.problems] == [key]
    assert all(part in str(caught.value) for part in words.split(".*"))
    for axis, y, z in (("y", keys, None), ("z", None, keys)):
        if not keys:
            continue  # the sound direction would stand in
        with pytest.raises(ConfigError) as caught:
            carriage(y=y, z=z)
        stem = key.partition(".")[0].partition("[")[0]
        named = key if stem in once else f"{stem}_{axis}{key.removeprefix(stem)}"
        assert [problem.key for problem in caught.value.problems] == [named]


def test_the_most_points_that_a_curve_may_have() -> None:
    whole = [[-1, -0.5], *([d, d + d**2] for d in range(15))]
    assert link(curve=whole).law.edges.tolist() == list(range(14))
    half = [[d, d**2] for d in range(8)]  # the slope does not change at 0
    assert link(curve=half).law.edges.tolist() == [d for d in range(-6, 7) if d]


def test_a_preload_in_one_direction_is_enough_for_what_rolls() -> None:
    keys = {"stiffness": 5e8, "preload": "2 kN", "rolling": "roller"}
    assert [law.kind for law in carriage(y=keys).laws] == ["preloaded", "linear"]
    assert [law.kind for law in carriage(z=keys).laws] == ["linear", "preloaded"]
