"""Reports of machines: laws in words and figures, the state at rest, mistaken units, nominal stiffness."""

from typing import Any

import numpy as np
import pytest
import reference as ref
from click.testing import CliRunner
from texts import one_line

from guideload.cli.inputs import EXAMPLES
from guideload.cli.main import main
from guideload.machine.components import Carriage, Link
from guideload.machine.machine import Machine
from guideload.machine.modes import Modes
from guideload.reports.elements import WIDTH
from guideload.reports.machine import machine_report, modes_report

SIDES = {"positive": "90 N/um", "negative": "140 N/um"}
CURVE = [["0 um", "0 N"], ["6 um", "400 N"], ["16 um", "2 kN"]]
CLEARANCE = "5 um of clearance to either side, then "
# Other values of every carriage, and their law in words.
LAWS: dict[str, tuple[dict[str, Any], str]] = {
    "sides": ({"stiffness_y": SIDES}, "y 90 N/um towards +y, 140 N/um towards -y"),
    "clearance": ({"clearance_z": "5 um"}, f"z {CLEARANCE}120 N/um"),
    "both": (
        {"stiffness_z": SIDES, "clearance_z": "5 um", "damping_in_contact": True},
        f"z {CLEARANCE}90 N/um towards +z, 140 N/um towards -z, damping only in contact",
    ),
    "clearance along two axes": ({"clearance_y": "5 um", "clearance_z": "5 um"}, f"y, z {CLEARANCE}120 N/um"),
    "curve": (
        {"curve_y": CURVE, "stiffness_y": None},
        "curve through 0 um 0 N, 6 um 400 N, 16 um 2000 N; mirrored",
    ),
    # 2^n F0, and d0 = 2 n F0 / k0.
    "balls": (
        {"preload_y": "1.2 kN", "rolling": "ball"},
        "y 120 N/um at no load, preload 1200 N, balls; one row opens at 3394 N, 30 um",
    ),
    "rollers": (
        {"preload_y": "1.2 kN", "rolling": "roller"},
        "y 120 N/um at no load, preload 1200 N, rollers; one row opens at 2592 N, 22.2 um",
    ),
}


def example(links: tuple[Link, ...] = (), **of_carriage: Any) -> Machine:
    return ref.cart(**of_carriage).model_copy(update={"links": links})


@pytest.mark.parametrize(("changes", "words"), LAWS.values(), ids=LAWS)
def test_laws_that_are_not_linear_are_described(changes: dict[str, Any], words: str) -> None:
    text = machine_report(example(**changes))
    assert f"1a, 1b, 2a, 2b {words}" in one_line(text).replace("y curve", "curve")
    assert max(map(len, text.splitlines())) <= WIDTH
    assert "*" in text and "nominal stiffness" in text


def test_a_linear_machine_has_no_laws_in_words() -> None:
    for machine in (
        example(),
        example(clearance_y=0.0),
        example(stiffness_y={"positive": 1e8, "negative": 1e8}),
    ):
        assert "*" not in machine_report(machine)
        assert "nominal" not in modes_report(machine, Modes.of(machine))


def test_extra_links_have_place_direction_and_law() -> None:
    rack = Link(
        name="rack", point=(0, 0.1, 0), direction=(2, 0, 0), stiffness=8e7, damping=2e4, clearance="10 um"
    )
    text = one_line(machine_report(example(links=(rack,))))
    assert "rack (0, 100, 0) (1, 0, 0) 20 10 um of clearance to either side, then 80 N/um" in text


def test_the_report_begins_with_the_state_at_rest() -> None:
    first = "machine: linear. At rest: supported in every free dof. 5 natural modes at "
    assert one_line(machine_report(example())).startswith(first)
    loose = one_line(machine_report(example(clearance_z="5 um")))
    assert "At rest: free within its clearance" in loose and "within its clearance in z, and in ry" in loose
    # The carriage that carries most has 5366 N on two ends: 2^1.5 times half of the preload opens a row of it.
    for preload, opens in ((1800.0, True), (2000.0, False)):
        text = one_line(machine_report(example(preload_y=preload, rolling="ball")))
        assert ("2b:-y, 2b:+y have a row open at rest" in text) is opens


@pytest.mark.parametrize(
    ("changes", "question"),
    [
        ({}, None),
        ({"clearance_y": 9e-4}, None),
        ({"clearance_y": 5.0}, "is it in m?"),
        ({"stiffness_y": 120.0, "stiffness_z": 120.0}, "the lowest mode is at"),
        ({"damping_y": 1e8, "damping_z": 1e8}, "a damping ratio is"),
    ],
)
def test_values_of_no_machine_are_taken_for_mistaken_units(
    changes: dict[str, Any], question: str | None
) -> None:
    text = one_line(machine_report(example(**changes)))
    assert ("Numbers without unit are SI" in text) is (question is not None)
    assert question is None or question in text


def test_the_stiffness_of_the_modes_is_described() -> None:
    machine = example(**LAWS["sides"][0])
    assert "This machine is piecewise linear. The frequencies are" in modes_report(machine, Modes.of(machine))
    stiffer = example(stiffness_y=140e6)
    np.testing.assert_allclose(Modes.of(machine).frequency, Modes.of(stiffer).frequency, rtol=1e-12)


@pytest.mark.parametrize("changes", [changes for changes, _ in LAWS.values()], ids=LAWS)
def test_nominal_scene_is_that_of_the_linear_machine(changes: dict[str, Any]) -> None:
    machine = example(**changes)
    none = dict.fromkeys(("curve_y", "curve_z", "preload_y", "preload_z", "rolling"))
    plain = none | {"damping_in_contact": False, "clearance_y": 0.0, "clearance_z": 0.0}
    carriages = [
        Carriage(
            **{
                **dict(part),
                **plain,
                "stiffness_y": part.laws[0].stiffness,
                "stiffness_z": part.laws[1].stiffness,
            }
        )
        for part in machine.carriages
    ]
    linear = machine.model_copy(update={"carriages": carriages})
    assert machine.nominal_scene.model_level == linear.model_level == "linear"
    for nominal, same in zip(machine.nominal_scene.matrices()[0], linear.scene.matrices()[0], strict=True):
        np.testing.assert_array_equal(nominal, same)


def test_check_and_modes_take_every_law(tmp_path: Any) -> None:
    text = (EXAMPLES / "manipulator.toml").read_text(encoding="utf-8")
    old = 'stiffness_y = "55 N/um"'
    text = text.replace(old, 'stiffness_y = { positive = "90 N/um", negative = "140 N/um" }', 1)
    text = text.replace(old, 'curve_y = [["0 um", "0 N"], ["6 um", "400 N"], ["16 um", "2 kN"]]', 1)
    text = text.replace(old, f'{old}\npreload_y = "1.2 kN"\nrolling = "ball"', 1)
    (tmp_path / "machine.toml").write_text(text, encoding="utf-8")
    for command in ("check", "modes"):
        ended = CliRunner().invoke(main, [command, str(tmp_path / "machine.toml")])
        assert ended.exit_code == 0 and "nominal stiffness" in one_line(ended.output)
