"""Process forces on the command line: wherever a motion is taken, in a file of their own or in columns of the trace."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command_line import guideload, refused, write_rated
from golden_pages import POINT, write_files

from guideload import Machine, Motion, Result, Study, read_forces, simulate
from guideload.cli.inputs import read_motion

MOVE = "distance=0.4 m, speed=1 m/s, acceleration=4 m/s^2, jerk=200 m/s^3, dwell=0.5 s"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A machine with a point, a trace, and the trace with columns of forces, in the working directory."""
    monkeypatch.chdir(tmp_path)
    write_files(tmp_path)
    return tmp_path


def loads(*arguments: str) -> Result:
    guideload("run", "machine.toml", *arguments, "-o", "out", "--no-pictures", "--overwrite")
    return Result.load("out/loads.nc")


def test_a_file_of_its_own_and_columns_of_the_trace_agree() -> None:
    """With the same stamps both are the run in Python, to the bit."""
    own = loads("trace.csv", "--forces", "forces.csv", "--forces-at", "tool", "--forces-axes", "point").data
    machine = Machine.from_toml("machine.toml")
    motion = read_motion(Path("trace.csv"), machine)
    forced = motion.with_forces(read_forces("forces.csv"), machine.point("tool"), own_axes=True)
    assert np.array_equal(own["force"], simulate(machine, forced).data["force"])
    assert np.array_equal(own["wrench"][np.isin(own["time"], forced.time)], forced.wrench)
    for given in (["--forces-at", "tool"], ["--forces", "both.csv", "--forces-at", "tool"]):
        columns = loads("both.csv", "--column", "velocity_m_s", *given, "--forces-axes", "point").data
        assert np.array_equal(columns["force"], own["force"])
    forces = ["--forces", "forces.csv", "--forces-at", "tool"]
    checked = guideload("check", "machine.toml", "trace.csv", *forces).stdout
    assert "process forces of forces.csv at tool" in checked


def test_a_given_unit_of_time_is_that_of_both() -> None:
    """Seconds under a header that says ms."""
    text = Path("both.csv").read_text(encoding="utf-8")
    Path("wrong.csv").write_text(text.replace("time_s", "time_ms", 1), encoding="utf-8")
    wanted = loads("both.csv", "--column", "velocity_m_s", "--forces-at", "tool").data["force"]
    for given in ([], ["--forces", "wrong.csv"]):
        options = ["--column", "velocity_m_s", "--time-unit", "s", "--forces-at", "tool", *given]
        assert np.array_equal(loads("wrong.csv", *options).data["force"], wanted)


@pytest.mark.parametrize(
    "command",
    ["life", "size --from catalogue.toml --product HGH25CA", "limit --of pace", "compare", "stability",
     "chart --budget 1 --no-pictures"],
)  # fmt: skip
def test_other_commands_take_forces(command: str) -> None:
    name, *options = command.split()
    traces = ["trace.csv", "both.csv", "--column", "velocity_m_s"] if name == "compare" else ["trace.csv"]
    forces = ["--forces", "forces.csv", "--forces-at", "tool"]
    if name in ("life", "limit"):
        write_rated(Path(), POINT)
    assert guideload(name, "machine.toml", *traces, *forces, *options).stdout


def test_planned_moves_take_forces() -> None:
    data = loads(
        "--move", MOVE, "--forces", "forces.csv", "--forces-at", "tool", "--forces-start", "50 ms"
    ).data
    assert data.attrs["motion_notes"].count("process forces") == 1


def test_a_study_takes_forces() -> None:
    text = 'machine = "machine.toml"\ntrace = "trace.csv"\nsamples = 2\nseed = 1\n'
    vary = '[[vary]]\npath = "body.mass"\ndistribution = "normal"\nsigma = "1 %"\n'
    forces = '[forces]\nfile = "forces.csv"\nat = "tool"\naxes = "point"\n'
    Path("study.toml").write_text(text + forces + vary, encoding="utf-8")
    study, machine = Study.from_toml("study.toml"), Machine.from_toml("machine.toml")
    motion = read_motion(
        Path("trace.csv"), machine, forces=Path("forces.csv"), forces_at="tool", forces_axes="point"
    )
    assert isinstance(motion, Motion) and np.array_equal(study.motion.wrench, motion.wrench)
    assert Path("forces.csv") in study.inputs
    of_trace = forces.replace("forces.csv", "both.csv").replace("axes", 'start = "0 s"\naxes')
    for options in ({}, {"time_unit": "ms"}):  # the columns of the trace have its stamps
        reading = '[reading]\ncolumn = "velocity_m_s"\n' + "".join(
            f'{k} = "{v}"\n' for k, v in options.items()
        )
        own = text.replace("trace.csv", "both.csv") + reading + of_trace + vary
        Path("study.toml").write_text(own, encoding="utf-8")
        scale, wrench = 1e-3 if options else 1.0, Study.from_toml("study.toml").motion
        assert wrench.time == pytest.approx(scale * motion.time) and np.allclose(wrench.wrench, motion.wrench)
    Path("study.toml").write_text(text + forces.replace("forces.csv", "none.csv") + vary, encoding="utf-8")
    assert "forces.file: expected a file that exists" in refused("study", "study.toml", "-o", "study")
