"""Carriage types: shared keys, overriding, errors that name both places, and studies of a type's value."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from guideload.base.errors import ConfigError
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.study import Study, run_study

FILE = """
rails = [{ name = "1", position = [0, -0.2] }, { name = "2", position = [0, 0.2] }]
[body]
mass = "100 kg"
center_of_mass = [0.0, 0.1, 0.05]
inertia = [[4, 0, 0], [0, 5, 0], [0, 0, 6]]
[carriage_types.front]
length = "50 mm"
stiffness_y = "200 N/um"
stiffness_z = "150 N/um"
damping_y = "5 kN s/m"
damping_z = "4 kN s/m"
[[carriages]]
name = "a"
rail = "1"
x = -0.2
type = "front"
[[carriages]]
name = "b"
rail = "1"
x = 0.2
type = "front"
stiffness_y = "120 N/um"
[[carriages]]
name = "c"
rail = "2"
x = 0.0
type = "front"
"""


def read(tmp_path: Path, *changes: tuple[str, str]) -> Machine:
    text = FILE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    file = tmp_path / "machine.toml"
    file.write_text(text, encoding="utf-8")
    return Machine.from_toml(file)


def test_a_type_gives_the_keys_that_a_carriage_leaves_out(tmp_path: Path) -> None:
    machine = read(tmp_path)
    assert [one.stiffness_y for one in machine.carriages] == [2e8, 1.2e8, 2e8]
    assert [one.length for one in machine.carriages] == [0.05] * 3
    written_out = read(tmp_path, ('type = "front"', "\n".join(FILE.splitlines()[7:12])))
    assert written_out.carriages[0].model_copy(update={"type": "front"}) == machine.carriages[0]


def test_a_machine_with_types_survives_json(tmp_path: Path) -> None:
    machine = read(tmp_path)
    assert Machine(**json.loads(machine.model_dump_json())) == machine


@pytest.mark.parametrize(
    ("old", "new", "key", "words"),
    [
        ('"200 N/um"', '"-2 N/um"', "carriage_types.front.stiffness_y", "> 0 N/m"),
        ('"200 N/um"', '"200 um"', "carriage_types.front.stiffness_y", "a stiffness"),
        ('"50 mm"', '"50 mm"\nlenght = 1', "carriage_types.front.lenght", '"length"'),
        ('"50 mm"', '"50 mm"\nx = 1', "carriage_types.front.x", "known key"),
        (
            'stiffness_y = "120 N/um"',
            'curve_y = [["0 um", "0 N"], ["9 um", "2 kN"]]',
            "carriage_types.front.stiffness_y",
            "carriages[1] takes it from this type",
        ),
        ('type = "front"', 'type = "fornt"', "carriages[0].type", 'did you mean "front"?'),
        ('damping_z = "4 kN s/m"', "", "carriage_types.front.damping_z", 'add the key "damping_z"'),
        ('stiffness_z = "150 N/um"', "", "carriage_types.front.stiffness_z", 'add the key "stiffness_z"'),
    ],
)
def test_errors_name_the_place_once(tmp_path: Path, old: str, new: str, key: str, words: str) -> None:
    with pytest.raises(ConfigError) as caught:
        read(tmp_path, (old, new))
    assert [problem.key for problem in caught.value.problems] == [key]
    assert words in str(caught.value)
    assert caught.value.row is not None


def study(machine: Machine, path: str | list[str], **keys: Any) -> Any:
    time = np.linspace(0.0, 0.05, 101)
    motion = Motion.along_x(time, np.where(time < 0.02, 4.0, 0.0))
    entry = {"path": path, "distribution": "uniform", "plus_minus": "20 %", **keys}
    return Study(machine=machine, motion=motion, samples=8, seed=5, vary=[entry])


def test_a_study_varies_the_value_of_a_type_in_all_carriages_that_take_it(tmp_path: Path) -> None:
    machine = read(tmp_path)
    by_type = study(machine, "carriage_types.front.stiffness_y").plan()
    assert by_type.factors[0].targets == ("carriages[a].stiffness_y", "carriages[c].stiffness_y")
    both = ["carriages[a].stiffness_y", "carriages[c].stiffness_y"]
    tables = [
        run_study(study(machine, path, name="k")).table()
        for path in ("carriage_types[front].stiffness_y", both)
    ]
    assert np.array_equal(tables[0]["max_resultant_N[b]"], tables[1]["max_resultant_N[b]"])


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("carriage_types.back.length", "its types are front"),
        ("carriage_types.front.x", "a key that carriages take"),
        ("carriage_types.front.width", "a width"),
    ],
)
def test_paths_of_no_type_are_refused(tmp_path: Path, path: str, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        study(read(tmp_path), path)
