"""Properties of machine files: what is written is read, and what is refused is named with its key and row."""

import json
import math
import sys
from pathlib import Path
from typing import Any

import lives
import numpy as np
import pytest
import random_machines
import tomli_w
from hypothesis import assume, given
from hypothesis import strategies as st
from moves import GENTLE

from guideload import file_template, simulate
from guideload.base.errors import ConfigError
from guideload.base.ranges import OF_MACHINES, SMALLEST_MOMENT
from guideload.base.visible_text import HIDDEN
from guideload.life.load_parts import load_parts
from guideload.machine.components import unit_vector
from guideload.machine.machine import Machine

UNITS = {"m": {"m": 1, "mm": 1e3, "um": 1e6}, "kg": {"kg": 1, "t": 1e-3}, "N/m": {"N/m": 1, "N/um": 1e-6}}
SINGLE = {"body.mass": "kg", "carriages.x": "m", "carriages.length": "m", "carriages.stiffness_y": "N/m"}
TEXT = st.text(min_size=1, max_size=12)
NAMES = st.lists(TEXT.filter(lambda text: not HIDDEN.search(text)), min_size=3, max_size=3, unique=True)


def written(value: Any) -> str:
    """A value in TOML; text with escapes as in JSON."""
    if isinstance(value, list):
        return f"[{', '.join(map(written, value))}]"
    if isinstance(value, str):
        return '"' + "".join(c if c.isalnum() else f"\\U{ord(c):08x}" for c in value) + '"'
    return json.dumps(value)


def toml(values: dict[str, Any]) -> str:
    """Tables in TOML: a dict is a table, a list of dicts an array of tables; other keys come first."""
    plain = {key: value for key, value in values.items() if not _is_table(value)}
    rows = [f"{key} = {written(value)}" for key, value in plain.items()]
    for key, value in values.items():
        for table in (
            value if isinstance(value, list) and _is_table(value) else [value] if _is_table(value) else []
        ):
            rows += [f"[[{key}]]" if isinstance(value, list) else f"[{key}]", toml(table)]
    return "\n".join(rows)


def _is_table(value: Any) -> bool:
    return isinstance(value, dict) or (isinstance(value, list) and bool(value) and isinstance(value[0], dict))


def machine(names: list[str], numbers: dict[str, Any]) -> dict[str, Any]:
    def number(key: str) -> Any:
        return numbers[key]

    carriage = {"x": number("carriages.x"), "length": number("carriages.length"), "rail": names[0]}
    carriage |= {
        "stiffness_y": number("carriages.stiffness_y"),
        "stiffness_z": 1e8,
        "damping_y": 1,
        "damping_z": 0,
    }
    inertia = [[420, 15, -8], [15, 310, 22], [-8, 22, 380]]
    return {
        "name": names[2],
        "body": {"mass": number("body.mass"), "center_of_mass": [0, 0, 0], "inertia": inertia},
        "rails": [{"name": names[0], "position": [0, "-350 mm"]}, {"name": names[1], "position": [0, 0]}],
        "carriages": [carriage | {"name": names[1]}, carriage | {"name": names[2], "rail": names[1]}],
    }


@st.composite
def quantities(draw: st.DrawFn, unit: str) -> tuple[Any, float]:
    """A value with or without a unit, and the same in SI."""
    number = draw(st.floats(1e-3, 1e3))
    name = draw(st.sampled_from([None, *UNITS[unit]]))
    return (number, number) if name is None else (f"{number!r} {name}", number / UNITS[unit][name])


def read(folder: Path, values: dict[str, Any]) -> Machine:
    file = folder / "machine.toml"
    file.write_text(toml(values), encoding="utf-8")
    return Machine.from_toml(file)


@given(NAMES, st.fixed_dictionaries({key: quantities(unit) for key, unit in SINGLE.items()}))
def test_a_file_is_read_as_it_was_written(
    tmp_path: Path, names: list[str], numbers: dict[str, tuple[Any, float]]
) -> None:
    found = read(tmp_path, machine(names, {key: value for key, (value, _) in numbers.items()}))
    assert [rail.name for rail in found.rails] == names[:2]
    assert [carriage.rail for carriage in found.carriages] == names[:2]
    assert [carriage.name for carriage in found.carriages] == names[1:] and found.name == names[2]
    one = found.carriages[1]
    got = [found.body.mass, one.x, one.length, one.stiffness_y]
    np.testing.assert_allclose(got, [numbers[key][1] for key in SINGLE], rtol=1e-15)
    # The machine as plain numbers, in a file again, is the same machine.
    assert read(tmp_path, found.model_dump(mode="json", exclude_defaults=True)) == found


@given(TEXT)
def test_a_name_is_taken_as_it_is_or_refused_at_its_key(tmp_path: Path, name: str) -> None:
    values = machine(
        ["one", "two", name],
        {"body.mass": 1, "carriages.x": 0, "carriages.length": 1} | {"carriages.stiffness_y": 1e8},
    )
    if not HIDDEN.search(name):
        assert read(tmp_path, values).carriages[1].name == name
        return
    with pytest.raises(ConfigError) as caught:
        read(tmp_path, values)
    assert [problem.key for problem in caught.value.problems] == ["name", "carriages[1].name"]
    assert all(problem.row for problem in caught.value.problems)
    assert not HIDDEN.search(str(caught.value).replace("\n", ""))


JUNK = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=True) | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=2),
    max_leaves=5,
)


@given(
    st.sampled_from(["name", "free", "gravity", "body", "drive", "rails", "carriages", "links", "x"]), JUNK
)
def test_whatever_stands_at_a_key_is_a_machine_or_an_error_of_ours(key: str, value: Any) -> None:
    numbers = dict.fromkeys(SINGLE, 1.0)
    try:
        Machine(**(machine(["a", "b", "c"], numbers) | {key: value}))
    except ConfigError as error:
        assert error.problems and all(problem.key for problem in error.problems) and str(error)


@pytest.mark.parametrize("key", SINGLE)
@pytest.mark.parametrize("beyond", [1e200, 1e-200, "1e99 {unit}", 1e18])
def test_values_that_no_machine_has_are_refused_at_the_key(tmp_path: Path, key: str, beyond: Any) -> None:
    unit = SINGLE[key]
    if key == "carriages.x" and beyond == 1e-200:
        beyond = -1e200  # a position may be as near to L as it likes
    beyond = beyond.format(unit=unit) if isinstance(beyond, str) else beyond
    with pytest.raises(ConfigError) as caught:
        read(tmp_path, machine(["a", "b", "c"], dict.fromkeys(SINGLE, 1.0) | {key: beyond}))
    for problem in caught.value.problems:
        assert problem.key.replace("[0]", "").replace("[1]", "") == key and problem.row
        assert f"{unit}" in problem.expected and "is the unit right?" in problem.hint


def test_the_ends_of_each_range_are_inside() -> None:
    for one in OF_MACHINES:
        for value in (one.least, one.most, -one.most, 0.0):
            assert one.holds(value)
        for value in (one.most * 1.001, -2 * one.most, *([one.least / 2] if one.least else [])):
            assert not one.holds(value)
    smallest = {"mass": 1e-6, "center_of_mass": (0, 0, 0), "inertia": np.eye(3) * SMALLEST_MOMENT}
    values = machine(["a", "b", "c"], dict.fromkeys(SINGLE, 1.0))
    assert Machine(**(values | {"body": smallest})).body.mass == 1e-6
    with pytest.raises(ConfigError, match="principal moments of at least"):
        Machine(**(values | {"body": smallest | {"inertia": np.eye(3) * SMALLEST_MOMENT / 2}}))


def test_a_curve_is_not_steeper_than_a_stiffness_may_be() -> None:
    values = machine(["a", "b", "c"], dict.fromkeys(SINGLE, 1.0))
    steep = dict(values["carriages"][0], curve_z=[[0, 0], [1e-9, 1e8]])
    del steep["stiffness_z"]
    with pytest.raises(ConfigError, match=r"curve_z: expected a slope up to 1e\+15 N/m"):
        Machine(**(values | {"carriages": [steep]}))


KINDS = ("two-rails", "one-rail", "gantry", "vertical", "manipulator")


def with_everything() -> Machine:
    """Products with requirements, a profile of a rail, a payload, a rider, points, an elastic base."""
    given = lives.cart(life={"life": "20000 h"})
    rails = [
        given.rails[0].model_copy(update={"straightness": ((-5.0, 0.0, 3e-6), (5.0, 0.0, 3e-6))}),
        given.rails[1],
    ]
    tensor = ((0.5, 0.0, 0.0), (0.0, 0.4, 0.0), (0.0, 0.0, 0.3))
    part: dict[str, Any] = {"mass": 25.0, "center_of_mass": (0.0, 0.3, 0.0), "inertia": tensor}
    more: dict[str, Any] = {
        "rails": rails,
        "payloads": [{"name": "box", "times": [[0.1, 0.2]], **part}],
        "points": [{"name": "tool", "at": (0.1, 0.2, 0.3), "settle_window": "10 um"}],
        "riders": [{"name": "slide", "direction": (0.1, 0.7, 0.2), **part}],
        "report": {"project": 'a "quoted" name \\ #1'},
    }
    return given.model_copy(update=more)


@given(st.tuples(*[st.floats(-1e3, 1e3)] * 3).filter(any))
def test_a_unit_vector_is_its_own(direction: tuple[float, float, float]) -> None:
    assume(math.hypot(*direction) >= sys.float_info.min)
    unit = unit_vector(direction, "")
    assert unit_vector(unit, "") == unit and math.isclose(math.hypot(*unit), 1.0, rel_tol=1e-15)


@pytest.mark.parametrize("carriages", [5, {"name": "a"}])
def test_carriages_that_are_no_list_are_refused_beside_products(carriages: Any) -> None:
    values = dict(with_everything()) | {"carriages": carriages, "links": [{"name": "one"}]}
    with pytest.raises(ConfigError, match="carriages: expected a list"):
        Machine(**values)


def test_an_invalid_product_is_told_once() -> None:
    given = with_everything().model_dump()
    given["products"][0]["mass"] = -1.0
    for key in ("length", "width", "stiffness_y", "stiffness_z"):  # which the product would have given
        for carriage in given["carriages"]:
            del carriage[key]
    with pytest.raises(ConfigError) as caught:
        Machine(**given)
    assert [problem.key for problem in caught.value.problems] == ["products[0].mass"]


@pytest.mark.parametrize("kind", [*KINDS, "everything", *range(12)])
def test_a_machine_that_is_written_is_read_again(kind: str | int, tmp_path: Path) -> None:
    if isinstance(kind, int):
        machine = Machine(**random_machines.values(kind))
    else:
        machine = with_everything() if kind == "everything" else Machine.from_text(file_template(kind))
    machine.to_toml(tmp_path / "machine.toml")
    assert Machine.from_toml(tmp_path / "machine.toml") == machine


def test_a_rider_keeps_its_motion_file_when_its_machine_is_written_into_another_folder(
    tmp_path: Path,
) -> None:
    """Also by way of a copy; from there back into the first folder it has its first name."""
    values = with_everything().model_dump(mode="json", exclude_none=True)
    values["riders"][0]["motion"] = "slide.toml"
    (tmp_path / "new" / "deeper").mkdir(parents=True)
    machine = Machine.from_text(tomli_w.dumps(values), tmp_path / "machine.toml")
    machine.model_copy(update={"name": "copy"}).to_toml(tmp_path / "new" / "deeper" / "machine.toml")
    moved = Machine.from_toml(tmp_path / "new" / "deeper" / "machine.toml")
    assert moved.riders[0].motion == "../../slide.toml"
    moved.to_toml(tmp_path / "back.toml")
    assert Machine.from_toml(tmp_path / "back.toml").riders == machine.riders


def test_points_of_a_file_are_written_into_the_machine_file(tmp_path: Path) -> None:
    (tmp_path / "rail.csv").write_text("x [m],dy [um],dz [um]\n-5,0,3\n0,1,2\n5,0,3\n", encoding="utf-8")
    text = file_template("two-rails").replace(
        'name = "left"', 'name = "left"\nstraightness_file = "rail.csv"', 1
    )
    (tmp_path / "first.toml").write_text(text, encoding="utf-8")
    machine = Machine.from_toml(tmp_path / "first.toml")
    machine.to_toml(tmp_path / "second.toml")
    again = Machine.from_toml(tmp_path / "second.toml")
    assert again == machine and machine.rails[0].straightness is not None
    assert load_parts(simulate(machine, lives.moved(GENTLE))).keys() >= {"weight", "rail error"}
