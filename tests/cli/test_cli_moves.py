"""Planned moves on the command line: wherever a trace is taken, a motion file or --move is taken; and for riders."""

from pathlib import Path

import numpy as np
import pytest
from command_line import MACHINE, TRACE, guideload
from golden_pages import RIDER

from guideload import Machine, Moves, Result, simulate
from guideload.cli.inputs import EXAMPLES

MOVE = "distance=0.8 m, speed=1.5 m/s, acceleration=4 m/s^2, jerk=200 m/s^3, dwell=0.2 s"


@pytest.fixture
def moves(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """The motion file that `init` writes, in the working directory."""
    monkeypatch.chdir(tmp_path)
    assert "guideload run machine.toml moves.toml" in guideload("init", "--moves").stdout
    return "moves.toml"


def loads(*arguments: str) -> Result:
    guideload("run", MACHINE, *arguments, "-o", "out", "--no-pictures", "--overwrite")
    return Result.load("out/loads.nc")


def test_run_takes_a_motion_file(moves: str) -> None:
    data, motion = loads(moves).data, Moves.from_toml(moves).motion()
    assert np.array_equal(data["cart_acceleration"], motion.acceleration)
    assert np.array_equal(data["cart_position"], motion.position)
    report = Path("out/report.txt").read_text(encoding="utf-8")
    assert "the motion is known exactly, at all frequencies" in report and "credible band" not in report


def test_run_takes_moves_of_the_command_line(moves: str) -> None:
    back = MOVE.replace("distance=0.8", "distance=-0.8")
    data = loads("--move", MOVE, "--move", back).data
    assert data["cart_position"].values.max() == 0.8
    assert np.array_equal(data["cart_acceleration"], Moves.from_texts([MOVE, back]).motion().acceleration)


@pytest.mark.parametrize(
    "command", ["check", "stability", "chart --budget 1 --no-pictures", "compare --move"], ids=str
)
def test_other_commands_take_it(moves: str, command: str) -> None:
    name, *options = command.split()
    if name == "compare":
        text = guideload(name, MACHINE, moves, TRACE, *options, MOVE).stdout
        assert all(run in text for run in ("moves", "manipulator", "--move"))
        return
    assert guideload(name, MACHINE, moves, *options).stdout


def test_life_size_and_limit_take_it(moves: str) -> None:
    catalogue = EXAMPLES / "catalogue.toml"
    assert "* HGH25CA" in guideload("size", MACHINE, moves, "--from", catalogue, "--life", "5000 km").stdout
    guideload("init")
    machine = Path("machine.toml")
    text = machine.read_text(encoding="utf-8").replace("# catalogue =", "catalogue =")
    text = text.replace("[[carriages]]", '[[carriages]]\nproduct = "HGH25CA"\npreload_class = "ZA"')
    machine.write_text(text, encoding="utf-8")
    guideload("init", "--catalogue")
    assert "carriages last" in guideload("life", machine, moves, "--no-bands").stdout
    text = guideload("limit", machine, moves, "--of", "acceleration", "--safety", 14.5).stdout
    assert "up to an acceleration limit of" in " ".join(text.split())


def test_a_study_takes_it(moves: str) -> None:
    text = (EXAMPLES / "study.toml").read_text(encoding="utf-8").replace("10_000", "16")
    text = text.replace("histories = 20", "histories = 0").replace('"manipulator.csv"', f'"{moves}"')
    text = text.replace('"manipulator.toml"', repr(MACHINE))
    Path("study.toml").write_text(text, encoding="utf-8")
    report = guideload("study", "study.toml", "-o", "out", "--no-pictures").stdout
    assert "motion moves.toml: " in report and "neglects the uncertainty" not in report


@pytest.mark.parametrize(
    ("given", "file"), [([], "machines/moves.toml"), (["--rider", "slide=o.toml"], "o.toml")]
)
def test_the_motion_of_a_rider(moves: str, given: list[str], file: str) -> None:
    """The file beside the machine file; one of the command line in place of it; both as in Python."""
    Path("machines").mkdir()
    text = Path(MACHINE).read_text(encoding="utf-8")
    Path("machines/machine.toml").write_text(f"{text}\n{RIDER}", encoding="utf-8")
    for name, distance in (("machines/moves.toml", 40), ("o.toml", 80)):
        limits = 'speed = "1 m/s"\nacceleration = "4 m/s^2"\njerk = "200 m/s^3"'
        Path(name).write_text(f'[[moves]]\ndistance = "{distance} mm"\n{limits}\n', encoding="utf-8")
    cart = "machines/moves.toml"
    guideload("run", "machines/machine.toml", cart, *given, "-o", "out", "--no-pictures")
    machine = Machine.from_toml("machines/machine.toml")
    riders = {"slide": Moves.from_toml(file).motion()}
    wanted = simulate(machine, Moves.from_toml(cart).motion(), riders=riders)
    assert np.array_equal(Result.load("out/loads.nc").data["force"], wanted.data["force"])
