"""Copies and pickles of machines, studies and results give the same results to the last bit."""

import copy
import json
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import MACHINE, write_trace
from machines import with_mass

from guideload.base.errors import ArgumentError
from guideload.machine.machine import Machine
from guideload.simulation.simulation import simulate
from guideload.study.execution import run_study
from guideload.study.metadata import FILE, StudyMetadata
from guideload.study.study import Study
from guideload.traces.reading import motion_from_trace, read_trace

Copy = Callable[[Any], Any]
COPIES: list[Copy] = [copy.copy, copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))]
VARY = ({"path": "body.mass", "distribution": "uniform", "plus_minus": "5 %"},)


def study(folder: Path) -> Study:
    machine = Machine.from_toml(MACHINE)
    motion = motion_from_trace(read_trace(write_trace(folder / "trace.csv", 800, 0.2)), machine.drive)
    return Study(machine=machine, motion=motion, vary=VARY, samples=8, seed=1)


@pytest.mark.parametrize("duplicate", COPIES, ids=["copy", "deepcopy", "pickle"])
def test_a_copy_gives_the_same_results(tmp_path: Path, duplicate: Copy) -> None:
    one = study(tmp_path)
    machine, motion = one.machine, one.motion
    result = simulate(machine, motion)  # the scene is cached now
    assert "scene" in machine.__dict__ and result.audit
    other = duplicate(machine)
    assert other == machine and other is not machine
    assert np.array_equal(simulate(other, duplicate(motion)).carriage_loads, result.carriage_loads)
    same = duplicate(result)
    assert np.array_equal(same.carriage_loads, result.carriage_loads)
    assert str(same.audit) == str(result.audit)
    first, second = run_study(one), run_study(duplicate(one))
    for column in first.store.columns:
        assert np.array_equal(first.column(column), second.column(column))
    assert duplicate(first).metadata == first.metadata


@pytest.mark.parametrize("duplicate", COPIES, ids=["copy", "deepcopy", "pickle"])
def test_a_changed_copy_has_cached_values_of_its_own(duplicate: Copy) -> None:
    machine = Machine.from_toml(MACHINE)
    at_rest = machine.scene.static_link_loads()
    heavier = with_mass(duplicate(machine), "2 t")
    assert heavier.scene is not machine.scene
    assert abs(heavier.scene.static_link_loads()).sum() > 1.1 * abs(at_rest).sum()
    np.testing.assert_array_equal(machine.scene.static_link_loads(), at_rest)


def test_damaged_metadata_is_refused_and_named(tmp_path: Path) -> None:
    """Every truncation, and every list of columns or measures that lost an entry."""
    folder = tmp_path / "study"
    run_study(study(tmp_path), folder)
    text = (folder / FILE).read_text(encoding="utf-8")
    values = json.loads(text)
    damaged = [text[:size] for size in range(0, len(text) - 2, 97)]
    for key in ("columns", "measures"):
        damaged += [json.dumps(values | {key: values[key][:size]}) for size in range(len(values[key]))]
    swapped = [values["measures"][-1], *values["measures"][1:]]
    damaged += [json.dumps(values | {"measures": swapped}), json.dumps(values | {"runs": -1})]
    last = max(carriage for _, carriage, _ in values["measures"])
    others = [i for i, (_, carriage, _) in enumerate(values["measures"]) if carriage != last]
    damaged.append(
        json.dumps(values | {key: [values[key][i] for i in others] for key in ("columns", "measures")})
    )
    damaged.append(f'{{"content": "samples of a guideload study", "x": {"[" * 100_000}{"]" * 100_000}}}')
    for content in damaged:
        (folder / FILE).write_text(content, encoding="utf-8")
        with pytest.raises(ArgumentError) as caught:
            StudyMetadata.read(folder)
        assert str(folder / FILE) in str(caught.value)
