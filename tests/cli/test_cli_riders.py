"""Riders on the command line: the motion of the machine file, and another one by --rider."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command_line import MACHINE, guideload, write_trace
from golden_pages import RIDER

from guideload import Machine, Moves, Result, simulate
from guideload.cli.inputs import read_motion

MOVE = """[[moves]]
distance = "{} mm"
speed = "1 m/s"
acceleration = "4 m/s^2"
jerk = "200 m/s^3"
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A machine whose rider has a motion file, another motion file, and a trace."""
    (tmp_path / "machines").mkdir()
    text = Path(MACHINE).read_text(encoding="utf-8")
    (tmp_path / "machines" / "machine.toml").write_text(f"{text}\n{RIDER}", encoding="utf-8")
    (tmp_path / "machines" / "moves.toml").write_text(MOVE.format(40), encoding="utf-8")
    (tmp_path / "other.toml").write_text(MOVE.format(80), encoding="utf-8")
    write_trace(tmp_path / "trace.csv", 900, 0.2)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("given", "file"),
    [([], "machines/moves.toml"), (["--rider", "slide=other.toml"], "other.toml")],
)
def test_the_motion_of_a_rider(given: list[str], file: str) -> None:
    """The file beside the machine file; one of the command line in place of it; both as in Python."""
    trace = ("machines/machine.toml", "trace.csv")
    guideload("run", *trace, *given, "-o", "out", "--no-pictures")
    machine = Machine.from_toml("machines/machine.toml")
    motion = read_motion(Path("trace.csv"), machine)
    wanted = simulate(machine, motion, riders={"slide": Moves.from_toml(file).motion()})
    assert np.array_equal(Result.load("out/loads.nc").data["force"], wanted.data["force"])
