"""The machine: units, links, inertias that a body can have, immutability, and the packaged descriptions."""

import math
import pickle
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from machines import CENTER, INERTIA, body, carriage, machine
from rider_reference import cross

import guideload
from guideload.base.errors import ArgumentTypeError, ConfigError
from guideload.base.toml import tomllib
from guideload.machine.drive import Drive, Friction
from guideload.machine.laws import Sides
from guideload.machine.machine import DOFS, Body, Carriage, Link, Machine, Rail
from guideload.machine.modes import Modes
from guideload.machine.payloads import Payload
from guideload.machine.points import PointOfInterest
from guideload.machine.riders import Rider

EXAMPLES = Path(guideload.__file__).parent / "examples"
CART = Path(__file__).resolve().parents[1] / "data" / "cart.toml"


# ---- links


def test_each_carriage_is_two_pairs_of_links_with_half_its_stiffness_and_damping() -> None:
    table = machine(carriage(x=1.0), carriage("2", length="85 mm")).link_table()
    assert table.names == ("1:-y", "1:-z", "1:+y", "1:+z", "2:-y", "2:-z", "2:+y", "2:+z")
    assert table.points[:, 0].tolist() == [0.7, 0.7, 1.3, 1.3, -0.0425, -0.0425, 0.0425, 0.0425]
    assert np.all(table.points[:, 1:] == [0.05, -0.35])
    assert np.array_equal(table.directions, np.tile([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], (4, 1)))
    assert table.stiffness.tolist() == [2e8, 1.5e8] * 4
    assert table.damping.tolist() == [1e5, 5e4] * 4
    assert table.carriage.tolist() == [0] * 4 + [1] * 4


def test_extra_links_follow_with_unit_directions() -> None:
    rack = Link(name="rack", point=[0, 0, "1 mm"], direction=[3, 0, 4], stiffness="80 N/um", damping=0)
    table = machine(links=[rack], free=DOFS).link_table()
    assert table.names[-1] == "rack"
    assert table.points[-1].tolist() == [0.0, 0.0, 0.001]
    assert table.directions[-1].tolist() == [0.6, 0.0, 0.8]
    assert (table.stiffness[-1], table.damping[-1], table.carriage[-1]) == (8e7, 0.0, -1)


def test_links_alone_hold_a_machine() -> None:
    rack = Link(name="rack", point=(0, 0, 0), direction=(1, 0, 0), stiffness=8e7, damping=0)
    alone = machine(rails=[], carriages=[], links=[rack])
    assert alone.link_table().carriage.tolist() == [-1]
    assert alone.carriage_centers.shape == (0, 3)
    assert alone.rail_of_carriage.shape == (0,)


def test_centers_and_rails_of_carriages() -> None:
    rails = [Rail(name="left", position=(0.1, -0.2)), Rail(name="right", position=("100 mm", "200 mm"))]
    carriages = [carriage("a", rail="right", x=0.5), carriage("b", rail="left"), carriage("c", rail="right")]
    built = machine(*carriages, rails=rails)
    assert built.rail_of_carriage.tolist() == [1, 0, 1]
    assert built.carriage_centers.tolist() == [[0.5, 0.1, 0.2], [0.0, 0.1, -0.2], [0.0, 0.1, 0.2]]


# ---- inertia


def test_inertia_about_l_and_about_the_centre_of_mass_are_one_body() -> None:
    about_l = INERTIA - 1250.0 * cross(CENTER) @ cross(CENTER)  # model: J_L = J_S - m skew(r_S)^2
    shifted = body(inertia=about_l, inertia_about="L").central_inertia()
    assert np.abs(shifted - INERTIA).max() <= 1e-12 * np.abs(about_l).max()  # a few roundings of J_L
    assert np.array_equal(body().central_inertia(), INERTIA)


@pytest.mark.parametrize("about", ["center_of_mass", "L"])
@pytest.mark.parametrize(
    ("moments", "words"),
    [
        ((1.0, 2.0, 3.5), "is 0.5 kg m^2 too large, 14.29% of it"),
        ((2.0, 3.0, 5.0 + 1e-4), "too large"),
        ((0.0, 1.0, 1.0), "not above 0"),
        ((-1.0, 1.0, 1.0), "not above 0"),
    ],
)
def test_an_inertia_that_no_body_has(about: str, moments: tuple[float, ...], words: str) -> None:
    turn = np.linalg.qr(np.arange(9.0).reshape(3, 3) ** 2 + np.eye(3))[0]
    inertia = turn @ np.diag(moments) @ turn.T
    offset = np.array([0.1, -0.2, 0.3])
    keys = {"mass": 10.0, "center_of_mass": offset, "inertia_about": about}
    if about == "L":
        inertia = inertia - 10.0 * cross(offset) @ cross(offset)
        body(**keys, inertia=inertia + 2.0 * np.eye(3))  # a body again
    with pytest.raises(ConfigError) as caught:
        body(**keys, inertia=inertia)
    assert caught.value.key == "inertia"
    assert "principal moments about the centre of mass" in str(caught.value)
    assert words in str(caught.value)


def test_a_flat_plate_is_a_body() -> None:
    """Equality in the triangle rule: blurred by rounding, and by printing six digits."""
    random = np.random.default_rng(1)
    for _ in range(50):
        turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
        inertia = turn @ np.diag([1.0, 2.0, 3.0]) @ turn.T
        assert np.array_equal(np.array(body(inertia=inertia).inertia), 0.5 * (inertia + inertia.T))
    body(inertia=np.diag([0.333333, 0.333333, 0.666667]))


def test_inertia_is_symmetric() -> None:
    skewed = INERTIA.copy()
    skewed[0, 1] += 0.5
    message = r"inertia: expected a symmetric tensor, .*15.5 and 15 .* 0.5 kg m\^2 apart"
    with pytest.raises(ConfigError, match=message):
        body(inertia=skewed)


# ---- drive


@pytest.mark.parametrize(
    ("drive", "speed"),
    [
        ({"gear_ratio": 12.0, "pinion_diameter": "127.3 mm"}, 0.1273 / 2 / 12),
        ({"pinion_diameter": 0.1}, 0.05),
        ({"screw_lead": "20 mm", "gear_ratio": 2}, 0.02 / (2 * math.pi) / 2),
        ({"screw_lead": "20 mm", "gear_ratio": -2}, -0.02 / (2 * math.pi) / 2),
    ],
)
def test_cart_speed_per_motor_speed(drive: dict[str, Any], speed: float) -> None:
    assert Drive(**drive).speed_per_motor_speed == pytest.approx(speed, rel=1e-15)


def test_a_drive_has_one_output() -> None:
    for drive in ({}, {"gear_ratio": 2}, {"screw_lead": 1, "pinion_diameter": 1}):
        with pytest.raises(ConfigError, match="exactly one of pinion_diameter, pulley_d"):
            Drive(**drive)


# ---- the machine as a value


def test_units_and_si_numbers_are_the_same_machine() -> None:
    assert carriage(stiffness_y="400 N/um", length="600 mm") == carriage()
    plain = machine(gravity=(0.0, -9.80665, 0.0))
    assert machine(gravity=[0, "-1 g_0", 0]) == plain
    assert hash(machine()) == hash(plain)


def test_free_dofs_stand_in_the_usual_order() -> None:
    assert machine().free == ("y", "z", "rx", "ry", "rz")
    held = machine().with_free(["rz", "rx", "ry"])
    assert held.free == ("rx", "ry", "rz")
    assert held.with_free(machine().free) == machine()
    with pytest.raises(ConfigError, match=r'free\[1\]: expected "x", .* got "roll"'):
        machine().with_free(["rx", "roll"])


def test_a_machine_never_changes() -> None:
    built = machine()
    table = built.link_table()
    assert built.link_table() is table
    arrays = [value for value in vars(table).values() if isinstance(value, np.ndarray)]
    for array in (*arrays, built.carriage_centers, built.rail_of_carriage):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1
    modes = Modes.of(Machine.from_toml(CART))
    for array in (*vars(modes).values(), *vars(pickle.loads(pickle.dumps(modes))).values()):
        assert not array.flags.writeable
    assert not PointOfInterest(name="tool", at=(0, 0, 0)).rotation.flags.writeable
    with pytest.raises(ValueError, match="frozen"):
        built.name = "other"
    assert built.with_free(["rx"]).free == ("rx",)  # also once the cached arrays exist


def test_every_copy_with_changes_is_checked_and_computed_anew() -> None:
    built = Machine.from_toml(CART)
    assert built.scene is built.scene
    for copied in (built.copy, built.model_copy):
        with pytest.raises(ConfigError, match="gravity"):
            copied(update={"gravity": "x"})
        assert np.all(copied(update={"gravity": (0, 0, 0)}).static_carriage_loads == 0.0)
    with pytest.raises(ArgumentTypeError, match="update: expected a mapping or None"):
        built.model_copy(update=3)  # type: ignore[arg-type]


@pytest.mark.parametrize("kind", [Payload, Rider])
def test_a_payload_or_a_rider_is_no_main_body(kind: type[Body]) -> None:
    own = {"name": "p"} | ({"direction": (1, 0, 0)} if kind is Rider else {"times": [(0.1, 0.2)]})
    part = kind(**{**dict(body()), **own})
    with pytest.raises(ConfigError, match=f"body: expected a Body, not a {kind.__name__}, got"):
        machine(body=part)


def test_problems_in_code_have_their_key_and_no_file() -> None:
    with pytest.raises(ConfigError, match='^stiffness_z: expected > 0 N/m, got "-1 N/um"') as caught:
        carriage(stiffness_z="-1 N/um")
    assert (caught.value.file, caught.value.row, caught.value.key) == (None, None, "stiffness_z")
    assert caught.value.value == "-1 N/um"
    with pytest.raises(ConfigError) as caught:
        machine(carriages=[carriage(), carriage(rail="2"), {"name": "3"}], gravity=None)
    keys = [problem.key for problem in caught.value.problems]
    assert keys[:4] == ["carriages[1].rail", "carriages[1].name", "gravity", "carriages[2].rail"]


# ---- the packaged descriptions


def test_the_cart_of_the_tests_is_that_of_the_yardstick() -> None:
    example = Machine.from_toml(CART)
    assert example.body == body()
    assert example.gravity == (0.0, -9.80665, 0.0)
    assert example.free == ("y", "z", "rx", "ry", "rz")
    table = example.link_table()
    ends = (-0.56, -0.56, -0.44, -0.44, 0.44, 0.44, 0.56, 0.56)  # y and z link at each
    expected = [(x, 0.05, z) for z in (-0.35, 0.35) for x in ends]
    assert np.allclose(table.points, expected, rtol=0, atol=1e-15)  # -0.5 - 0.06 rounds once
    assert set(table.stiffness) == {6e7}
    assert set(table.damping) == {5e4}
    assert example.drive is not None
    assert example.drive.speed_per_motor_speed == pytest.approx(0.1273 / 2 / 12, rel=1e-15)


def test_every_mode_of_the_example_is_damped_as_rolling_guides_are() -> None:
    damping = Modes.of(Machine.from_toml(EXAMPLES / "manipulator.toml")).damping_ratio
    assert 0.019 < damping.min() and damping.max() < 0.04


def test_modes_of_one_frequency_take_the_damping_of_the_dampers_that_they_move() -> None:
    """Heave and roll of one frequency are a spring and damper on either side, each on its own."""
    mass, stiffness, damping = 100.0, 1e8, (2e2, 2e4)
    links = [
        Link(
            name=str(side), point=(0.0, 0.0, side), direction=(0.0, 1.0, 0.0), stiffness=stiffness, damping=c
        )
        for side, c in zip((-0.5, 0.5), damping, strict=True)
    ]
    inertia = np.diag([0.25 * mass, mass, mass]).tolist()  # two masses at the links
    given = Body(mass=mass, center_of_mass=(0, 0, 0), inertia=inertia, inertia_about="center_of_mass")
    machine = Machine(body=given, links=links, free=["y", "rx"])
    found = Modes.of(machine)
    ends = np.array(damping) / (2.0 * np.sqrt(stiffness * mass / 2.0))
    np.testing.assert_allclose(np.sort(found.damping_ratio), ends, rtol=1e-9)
    np.testing.assert_allclose(
        found.damped_frequency, found.frequency * np.sqrt(1.0 - found.damping_ratio**2)
    )


def test_the_template_is_a_machine_and_explains_every_key() -> None:
    file = EXAMPLES / "machine.toml"
    template = Machine.from_toml(file)
    assert len(template.carriages) == 4
    text = file.read_text(encoding="utf-8")
    for part in (Machine, Body, Drive, Friction, Rail, Carriage, Sides, Link):
        for key in part.model_fields:
            assert key in text, f"{part.__name__}.{key} is not in the template"


COMMENTED_KEY = re.compile(
    r"^# (\w+ = [\[\d\"].*|\[\[?\w+\]\]?.*)$", re.MULTILINE
)  # a table, or a key with its value


@pytest.mark.parametrize("output", ["pinion_diameter", "screw_lead"])
def test_the_commented_lines_of_the_template_work_too(tmp_path: Path, output: str) -> None:
    text = (EXAMPLES / "machine.toml").read_text(encoding="utf-8")
    link = text[text.index("# [[links]]") :].replace("\n# ", "\n").removeprefix("# ")
    text = COMMENTED_KEY.sub(r"\1", text[: text.index("# Extra links")])
    other = {
        "pinion_diameter": ("screw_lead",),
        "screw_lead": ("pinion_diameter", "pressure", "helix", "push"),
    }
    for key in other[output]:
        text = text.replace(f"\n{key}", f"\n# {key}")
    file = tmp_path / "machine.toml"
    file.write_text(text + link, encoding="utf-8")
    (tmp_path / "catalogue.toml").write_bytes((EXAMPLES / "catalogue.toml").read_bytes())
    built = Machine.from_toml(file)
    assert built.link_table().names[-1] == "rack"
    assert built.friction is not None and built.friction.seal == 12.0
    assert built.drive is not None
    assert built.drive.rated_torque == 12.0
    if output == "screw_lead":
        assert built.drive.screw_lead == 0.02
    else:
        assert built.drive.push_direction == (0.0, 1.0, 0.0)


def test_the_blocks_of_the_template_are_laws_of_its_carriages() -> None:
    text = (EXAMPLES / "machine.toml").read_text(encoding="utf-8")
    blocks = ["\n".join(re.findall(r"^#   (\w+ = .*)$", block, re.M)) for block in text.split("\n#\n")]
    given = Machine.from_toml(EXAMPLES / "machine.toml").carriages[0]
    kinds = []
    for block in filter(None, blocks):
        keys = tomllib.loads(block)
        changes = {"stiffness_y": None, **keys} if "curve_y" in keys else keys
        kinds.append(given.model_copy(update=changes).laws[0].kind)
    assert kinds == ["sided", "sided", "preloaded", "curve"]


def test_two_ends_resist_tilting_as_a_row_of_balls_does() -> None:
    """The template's rule: ends at +-length/2 with half of k each are a row of length Le = sqrt(3) length."""
    row, stiffness = 0.07, 4e8
    table = machine(carriage(length=row / math.sqrt(3.0), stiffness_y=stiffness)).link_table()
    along_y = table.directions[:, 1] == 1.0
    tilting = float(np.sum(table.stiffness[along_y] * table.points[along_y, 0] ** 2))
    assert tilting == pytest.approx(stiffness * row**2 / 12.0, rel=1e-14)


def test_copies_are_equal_and_compute_what_follows_from_their_fields_anew() -> None:
    example, same = (Machine.from_toml(EXAMPLES / "manipulator.toml") for _ in range(2))
    loads = example.scene.static_link_loads()
    assert example.scene is example.scene and example.rail_centers is not same.rail_centers
    for other in (same, pickle.loads(pickle.dumps(example))):
        assert example == other and hash(example) == hash(other)
        assert np.array_equal(other.scene.static_link_loads(), loads)
    assert example != example.with_free(["y"]) and example != "manipulator"
    lighter = example.model_copy(update={"gravity": (0.0, -1.0, 0.0)})
    assert lighter.scene.static_link_loads() == pytest.approx(loads / 9.80665, rel=1e-12)
    with pytest.raises(ConfigError, match="mass"):
        example.body.model_copy(update={"mass": -1.0})


def test_arrays_that_were_computed_from_fields_are_not_compared() -> None:
    wavy = Rail(name="1", position=(0, 0), waviness={"rms": (1e-5, 0), "wavelengths": (0.5, 2), "seed": 1})
    one, same = (machine(rails=[wavy], points=[{"name": "tool", "at": (0, 0, 0)}]) for _ in range(2))
    for each in (one, same):
        assert each.rail_offsets(np.zeros(1))[0].any() and each.points[0].rotation.any()
    assert one == same
