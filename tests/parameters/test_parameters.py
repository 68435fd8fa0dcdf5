"""Paths: what they mean in a machine, and that the core is told what a machine with these values would be."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from samples import with_value

from guideload import Study, peak_loads, run_study
from guideload._core import Law
from guideload.base.errors import ValueRefused
from guideload.catalogue.stiffness import CONTACT_EXPONENT
from guideload.machine.laws import Sides
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.parameters.parameters import Change, Form, Parameters

MOTION = Motion.along_x([0.0, 1.0], [0.0, 0.0])
INERTIA = ((420.0, 15.0, -8.0), (15.0, 310.0, 22.0), (-8.0, 22.0, 380.0))
CURVE = ((0.0, 0.0), (6e-6, 2e3), (35e-6, 15e3))


def carriage(name: str, rail: str, x: float, **keys: Any) -> dict[str, Any]:
    values: dict[str, Any] = {"name": name, "rail": rail, "x": x, "length": 0.12}
    values |= {"stiffness_y": 1.2e8, "stiffness_z": 1.1e8, "damping_y": 1e5, "damping_z": 9e4}
    return values | keys


def machine(**changes: Any) -> Machine:
    """Every law somewhere: linear, clear, by side, preloaded, curve; two rails; two extra links."""
    values: dict[str, Any] = {
        "body": {"mass": 1250.0, "center_of_mass": (0.12, -0.65, 0.18), "inertia": INERTIA},
        "rails": [{"name": "left", "position": (0.05, -0.35)}, {"name": "right", "position": (0.06, 0.35)}],
        "carriages": [
            carriage("plain", "left", -0.5),
            carriage("clear", "left", 0.5, clearance_y=5e-6, damping_in_contact=True),
            carriage(
                "by side", "right", -0.5, stiffness_y={"positive": 1e8, "negative": 2e8}, clearance_y=3e-6
            ),
            carriage("pre", "right", 0.4, preload_y=2e3, rolling="ball", stiffness_z=None, curve_z=CURVE),
        ],
        "links": [
            dict(name="rack", point=(0.0, 0.1, 0.0), direction=(1, 0, 0), stiffness=8e7, damping=2e4),
            dict(name="stop", point=(0.5, 0.1, 0.2), direction=(0, 1, 1), curve=CURVE, damping=0.0),
        ],
    }
    return Machine(**(values | changes))


def law_keys(stiffness: Any, clearance: float, preload: Any, rolling: Any, curve: Any, share: float) -> dict:
    """A law by the names that the core's changes use."""
    if curve is not None:
        return {"curve": curve, "share": share, "scale": 1.0}
    if isinstance(stiffness, Sides):
        sides = {"positive_stiffness": stiffness.positive, "negative_stiffness": stiffness.negative}
        return {key: share * value for key, value in sides.items()} | {"clearance": clearance}
    if preload is not None:
        return {
            "stiffness": share * stiffness,
            "preload": share * preload,
            "exponent": CONTACT_EXPONENT[rolling],
        }
    return {"stiffness": share * stiffness, "clearance": clearance}


def law_of(keys: dict[str, Any]) -> Law:
    if "curve" in keys:
        points = np.array(keys["curve"])
        law = Law.curve(np.vstack([-points[:0:-1], points]))
        return law.scaled(keys["share"]).scaled(keys["scale"])
    if "positive_stiffness" in keys:
        return Law.sided(keys["positive_stiffness"], keys["negative_stiffness"], keys["clearance"])
    if "preload" in keys:
        return Law.preloaded(keys["stiffness"], keys["preload"], keys["exponent"])
    return Law.sided(keys["stiffness"], keys["stiffness"], keys["clearance"])


def told(of: Machine, changes: Sequence[Change] = (), row: Sequence[float] = ()) -> dict[str, Any]:
    """What the core is told of a machine, with `changes` made as it makes them for one row of values."""
    table, body = of.link_table(), of.body
    laws = []
    for part in of.carriages:
        for axis in ("y", "z") * 2:
            keys = (getattr(part, f"{key}_{axis}") for key in ("stiffness", "clearance", "preload"))
            laws.append(law_keys(*keys, part.rolling, getattr(part, f"curve_{axis}"), 0.5))
    laws += [law_keys(x.stiffness, x.clearance, x.preload, x.rolling, x.curve, 1.0) for x in of.links]
    core: dict[str, Any] = {
        "mass": np.array([[body.mass]]),
        "center_of_mass": np.array(body.center_of_mass)[:, None],
        "inertia": np.array(body.inertia),
        "gravity": np.array(of.gravity)[:, None],
        "point": table.points.copy(),
        "damping": table.damping[:, None].copy(),
        "offset": table.offsets[:, None].copy(),
        "center": of.carriage_centers.copy(),
        "acceleration": np.ones((1, 1)),
        "wrench": np.ones((1, 1)),
    }
    for (name, i, j), constant, terms in changes:
        value = constant + sum(factor * row[column] for column, factor in terms)
        if name == "law":
            assert j in laws[i]  # a law has only what it has a place for
            laws[i][j] = value
        else:
            core[name][i, j] = value
            if name == "inertia":
                core[name][j, i] = value
    return core | {"laws": [law_of(keys) for keys in laws]}


def assert_same(one: dict[str, Any], other: dict[str, Any]) -> None:
    d = np.linspace(-5e-5, 5e-5, 401)
    for name, value in one.items():
        if name != "laws":
            assert np.allclose(value, other[name], rtol=1e-14, atol=1e-16), name
    for a, b in zip(one["laws"], other["laws"], strict=True):
        assert a.kind == b.kind
        assert np.allclose(a.edges, b.edges, rtol=1e-13, atol=0.0)
        assert np.allclose(a.force(d), b.force(d), rtol=1e-12, atol=1e-9)


def changes(of: Machine, *columns: tuple[Form, str]) -> tuple[Change, ...]:
    parameters = Parameters(of, MOTION)
    return parameters.changes((form, [one.path for one in parameters.at(path)]) for form, path in columns)


# ---- what is changed

EVERY = [parameter.path for parameter in Parameters(machine(), MOTION) if parameter.path != "motion.scale"]


def test_the_helper_builds_the_machines_own_laws() -> None:
    of = machine()
    laws, d = told(of)["laws"], np.linspace(-5e-5, 5e-5, 401)
    for mine, its in zip(laws, of.link_table().laws, strict=True):
        assert np.array_equal(mine.force(d), its.force(d))


@pytest.mark.parametrize("path", EVERY)
def test_a_changed_value_is_a_machine_built_with_it(path: str) -> None:
    of = machine()
    parameters = Parameters(of, MOTION)
    (parameter,) = parameters.at(path)
    value = 1.07 * parameter.value + (1e-3 if parameter.unit == "m" and not parameter.floor else 0.0)
    if path.endswith(("clearance_y", "clearance_z", "clearance")):
        value += 2e-6
    built = told(with_value(of, path, value))
    shares: list[tuple[Form, float]] = [("value", value), ("shift", value - parameter.value)]
    if parameter.value:
        shares.append(("factor", value / parameter.value))
    for form, number in shares:
        assert_same(told(of, parameters.changes([(form, [path])]), [number]), built)
    same, own = told(of, parameters.changes([("value", [path])]), [parameter.value]), told(of)
    assert all(np.array_equal(same[name], own[name]) for name in own if name != "laws")  # to the last bit


def test_own_values_are_the_machine_where_rotations_are_stated() -> None:
    """Stiffnesses against rotation are distances of links, which do not vary themselves."""
    stated = {
        "stiffness_pitch": "10 MN m/rad",
        "stiffness_yaw": "8 MN m/rad",
        "stiffness_roll": "100 kN m/rad",
    }
    places = [("left", -0.5), ("left", 0.5), ("right", -0.5), ("right", 0.4)]
    carriages = [carriage(f"{rail} {x}", rail, x) | {"length": None} | stated for rail, x in places]
    of, move = machine(carriages=carriages, links=[]), Motion.along_x([0.0, 0.1, 0.2], [0.0, 5.0, 0.0])
    nominal = peak_loads(of, move).largest[:, 6]
    for parameter in Parameters(of, move):
        found = run_study(Study(machine=of, motion=move, cases={parameter.path: [parameter.value]}))
        peaks = [found.column(f"max_resultant_N[{each.name}]")[0] for each in of.carriages]
        assert peaks == pytest.approx(nominal, rel=1e-12), parameter.path


def test_all_at_once_is_a_machine_built_with_all() -> None:
    of = machine()
    parameters = Parameters(of, MOTION)
    varied = [parameters.at(path)[0] for path in EVERY]
    built, row = of, []
    for k, parameter in enumerate(varied):
        row.append(parameter.value * (1.0 + 0.001 * (k % 7 - 3)) + (1e-6 if parameter.unit == "m" else 0.0))
        built = with_value(built, parameter.path, row[-1])
    assert_same(told(of, parameters.changes(("value", [path]) for path in EVERY), row), told(built))


def test_two_columns_on_one_point_add_up() -> None:
    made = dict((target, (constant, terms)) for target, constant, terms in changes(
        machine(), ("value", "carriages[plain].x"), ("value", "carriages[plain].length")
    ))  # fmt: skip
    assert made["point", 0, 0] == (0.0, ((0, 1.0), (1, -0.5)))
    assert made["point", 2, 0] == (0.0, ((0, 1.0), (1, 0.5)))
    assert made["center", 0, 0] == (0.0, ((0, 1.0),))


def test_one_column_for_many_parameters_is_a_factor_on_each_value() -> None:
    of = machine()
    made = changes(of, ("factor", "carriages.*.damping"))
    table = of.link_table()
    assert {target: terms for target, _, terms in made} == {
        ("damping", i, 0): ((0, table.damping[i]),) for i in range(16)
    }


def test_every_target_occurs_once_and_motion_is_a_factor() -> None:
    parameters = Parameters(machine(), MOTION.with_force((0, 0, 0), (0, 0, 1)))
    made = parameters.changes(("value", [parameter.path]) for parameter in parameters)
    targets = [target for target, _, _ in made]
    assert len(set(targets)) == len(targets)
    assert {("acceleration", 0, 0), ("wrench", 0, 0)} <= set(targets)


# ---- what paths mean


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ("carriages[0].x", ["carriages[plain].x"]),
        ('carriages["by side"].x', ["carriages[by side].x"]),
        ("carriages[2].stiffness_y", [f"carriages[by side].stiffness_y.{side}" for side in ("positive", "negative")]),
        ("carriages[plain].stiffness", ["carriages[plain].stiffness_y", "carriages[plain].stiffness_z"]),
        ("carriages[pre].preload", ["carriages[pre].preload_y"]),
        ("carriages[pre].curve_z", ["carriages[pre].curve_z.scale"]),
        ("rails.*.position.y", ["rails[left].position.y", "rails[right].position.y"]),
        ("rails[*].position", [f"rails[{rail}].position.{axis}" for rail in ("left", "right") for axis in "yz"]),
        ("links[rack].point", [f"links[rack].point.{axis}" for axis in "xyz"]),
        ("gravity", ["gravity.x", "gravity.y", "gravity.z"]),
        ("body.center_of_mass", [f"body.center_of_mass.{axis}" for axis in "xyz"]),
    ],
)  # fmt: skip
def test_paths_by_index_name_and_whole(path: str, expected: list[str]) -> None:
    assert [parameter.path for parameter in Parameters(machine(), MOTION).at(path)] == expected


def test_every_full_path_leads_back_to_its_parameter() -> None:
    rails = [{"name": name, "position": (0.05, z)} for name, z in (("1", -0.3), ("2", 0.3))]
    numbered = machine(rails=rails, carriages=[carriage("1", "1", -0.5), carriage("10", "2", 0.5)])
    for of in (machine(), numbered):
        parameters = Parameters(of, MOTION)
        for parameter in parameters:
            assert parameters.at(parameter.path) == (parameter,)


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("body.mas", "a known path.*did you mean body.mass"),
        ("body", "a known path"),
        ("motion", "a known path"),
        ("carriages.*.stifness_y", r"did you mean carriages\.\*\.stiffness_y"),
        ("carriages[plain].clearence", r"did you mean carriages.*clearance"),
        ("carriages[clean].x", 'its carriages are "plain", "clear", "by side", "pre"'),
        ("carriages[4].x", "its carriages are"),
        ("carriages.x", r"did you mean carriages\.\*\.x"),
        ("nonsense", r"paths begin with body\., "),
        ("carriages[plain].preload_y", r"carriages\[plain\] has none; it takes a preload"),
        ("carriages.*.preload", r"carriages\[plain\] has none"),
        ("carriages[pre].clearance", "it takes a stiffness without preload"),
        ("carriages[clear].clearance_z", "a clearance above 0 if damping_in_contact is true"),
        ("carriages[pre].stiffness_z", "it takes one stiffness, in place of a curve"),
        ("carriages[plain].stiffness_y.positive", "it takes a stiffness by side"),
        ("links[rack].curve.scale", "it takes a curve"),
        ("motion.force_scale", "it takes a motion with a process force"),
    ],
)
def test_paths_that_lead_nowhere_are_refused_with_what_is_near(path: str, words: str) -> None:
    with pytest.raises(ValueRefused, match=words) as caught:
        Parameters(machine(), MOTION).at(path)
    assert caught.value.value == path


def test_a_number_that_is_a_name_and_another_index_is_refused() -> None:
    rails = [{"name": name, "position": (0.05, z)} for name, z in (("1", -0.3), ("2", 0.3))]
    of = machine(rails=rails, carriages=[carriage("a", "1", -0.5), carriage("b", "2", 0.5)])
    parameters = Parameters(of, MOTION)
    with pytest.raises(ValueRefused, match=r'write rails\["1"\] or rails\["2"\]'):
        parameters.at("rails[1].position.y")
    assert parameters.at('rails["1"].position.y')[0].value == 0.05
    assert parameters.at("rails[2].position.z")[0].value == 0.3
    with pytest.raises(ValueRefused, match="it has no links|links are none"):
        Parameters(machine(links=[]), MOTION).at("links.*.damping")


def test_a_parameter_knows_what_it_cannot_be() -> None:
    parameters = Parameters(machine(), MOTION)
    for path, low, fine in (
        ("body.mass", 0.0, 1e-6),
        ("carriages[plain].length", 0.0, 1e-9),
        ("carriages[plain].clearance_y", -1e-9, 0.0),
        ("carriages[plain].damping_y", -1.0, 0.0),
        ("carriages[by side].stiffness_y.positive", -1.0, 0.0),
        ("carriages[plain].stiffness_y", 0.0, 1.0),
    ):
        (parameter,) = parameters.at(path)
        with pytest.raises(ValueRefused, match=r"> 0|>= 0"):
            parameter.require(low, 1.0)
        parameter.require(fine, 1.0)
    parameters.at("carriages[plain].x")[0].require(-1e3, 1e3)
    for low, high in ((-1e9, 0.0), (0.0, 1e9), (-np.inf, np.inf)):
        with pytest.raises(ValueRefused, match="a position up to 10000 m"):
            parameters.at("carriages[plain].x")[0].require(low, high)
