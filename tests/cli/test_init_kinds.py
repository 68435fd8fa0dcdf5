"""The machine files that `guideload init --kind` writes: each is a machine and runs with the example moves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command_line import guideload, refused

from guideload.cli.inputs import EXAMPLES, MACHINE_KINDS
from guideload.machine.machine import Machine
from guideload.machine.modes import Modes
from guideload.motion.moves import Moves
from guideload.simulation.simulation import simulate


def written(tmp_path: Path, kind: str) -> Machine:
    path = tmp_path / "machine.toml"
    guideload("init", path, "--kind", kind)
    return Machine.from_toml(path)


@pytest.mark.parametrize("kind", ["two-rails", *MACHINE_KINDS])
def test_each_kind_is_a_machine_that_moves(tmp_path: Path, kind: str) -> None:
    machine = written(tmp_path, kind)
    assert Modes.of(machine).damping_ratio.max() < 0.12
    result = simulate(machine, Moves.from_toml(EXAMPLES / "moves.toml").motion())
    assert not result.audit.doubts
    weight = machine.body.mass * np.array(machine.gravity)
    carried = result.quantities["static_force"].sum(axis=0)
    carried[0] -= result.quantities["static_reaction"][0]  # of held x: the drive
    assert carried == pytest.approx(weight, rel=1e-9, abs=1e-6)


def test_a_motion_file_for_a_kind_has_its_own_command_which_the_refusal_names(tmp_path: Path) -> None:
    """What the message says to run writes both files, and they fit each other."""
    told = refused("init", "--moves", "--kind", "vertical")
    assert "run `guideload init --moves` and `guideload init --kind vertical`" in told
    for options in (["--moves"], ["--kind", "vertical"]):
        guideload("init", tmp_path, *options)
    assert (
        "cart from 0 to 1.2 m"
        in guideload("check", tmp_path / "machine.toml", tmp_path / "moves.toml").stdout
    )


def test_two_rails_is_the_default(tmp_path: Path) -> None:
    machine = written(tmp_path, "two-rails")
    assert machine == Machine.from_toml(EXAMPLES / "machine.toml")
