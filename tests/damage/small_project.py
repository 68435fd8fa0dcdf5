"""A folder with a small valid file of every kind that guideload reads, and the commands that read them."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet

from guideload import Machine, Motion, simulate
from guideload.cli.inputs import EXAMPLES

PROJECT = Path(__file__).parent / "project"
COMMANDS = tuple((PROJECT / "commands.txt").read_text(encoding="utf-8").splitlines())
# What plain.toml has more in wavy.toml, loaded.toml, riding.toml and elastic.toml.
MOUNTING = 'mounting_error = ["20 um", "0 um"]\n'
PROFILE = """straightness = [["-2 m", "0 um", "0 um"], ["0 m", "15 um", "-5 um"], ["2 m", "0 um", "0 um"]]
waviness = { rms = ["1 um", "1 um"], wavelengths = ["0.5 m", "2 m"], exponent = 2.0, seed = 1 }
"""
EFFICIENCY = "efficiency = 0.95\n"
PUSH = """pressure_angle = "20 deg"
helix_angle = "19.5283 deg"
push_direction = [0, 1, 0]
"""
PAYLOAD = """
[[payloads]]
name = "crate"
mass = "90 kg"
center_of_mass = ["300 mm", "250 mm", "-100 mm"]
inertia = [[1.5, 0, 0], [0, 1.2, 0], [0, 0, 0.9]]
times = [["0.2 s", "0.5 s"]]
"""
RIDER = """
[[riders]]
name = "slide"
direction = [0, 0, 1]
position = "100 mm"
mass = "25 kg"
center_of_mass = ["0 mm", "300 mm", "-200 mm"]
inertia = [[0.5, 0, 0], [0, 0.4, 0], [0, 0, 0.3]]
"""
LENGTHS = 'length = "41 mm"\nwidth = "30 mm"\n'
ROTATIONS = """stiffness_pitch = "250 kN m/rad"
stiffness_yaw = "250 kN m/rad"
stiffness_roll = "80 kN m/rad"
"""
BASE = """
[base]
compliance = [
    [1e-10, 0, 0, 0, 0, 0],
    [0, 1e-10, 0, 0, 0, 0],
    [0, 0, 1e-10, 0, 0, 0],
    [0, 0, 0, 1e-9, 0, 0],
    [0, 0, 0, 0, 1e-9, 0],
    [0, 0, 0, 0, 0, 1e-9],
]
"""
DAMPED = "damping_in_contact = true"
FRICTION_AND_TOOL = """
[friction]
seal = "12 N"
viscous = "15 N s/m"

[[points]]
name = "tool"
at = ["150 mm", "-1000 mm", "180 mm"]
"""


def _table(head: str, *columns: np.ndarray) -> str:
    rows = (",".join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True))
    return "\n".join([head, *rows, ""])


def write_project(folder: Path) -> None:
    """Write the files; all together are some 50 kB, and no command takes more than a few seconds."""
    for name in ("manipulator.toml", "gantry.toml", "catalogue.toml", "identify.toml"):
        shutil.copy(EXAMPLES / name, folder)
    for file in PROJECT.glob("*.toml"):
        shutil.copy(file, folder)
    plain, bent = (_text(folder / name) for name in ("plain.toml", "bent.toml"))
    _write(folder / "wavy.toml", plain.replace(MOUNTING, MOUNTING + PROFILE))
    _write(folder / "loaded.toml", plain.replace(EFFICIENCY, EFFICIENCY + PUSH) + PAYLOAD)
    _write(folder / "riding.toml", plain + RIDER)
    _write(folder / "elastic.toml", plain.replace(LENGTHS, ROTATIONS) + BASE)
    _write(folder / "preloaded.toml", bent.replace(DAMPED, "damping_in_contact = false"))
    _write(folder / "slide.toml", _text(folder / "moves.toml").replace("0.1 m", "0.05 m"))
    drive = folder / "manipulator.toml"
    _write(drive, _text(drive) + FRICTION_AND_TOOL)
    time = np.arange(400) * 2e-3
    turn = 2 * np.pi * np.clip((time - 0.1) / 0.5, 0, 1)
    speed = np.round(0.25 * (1 - np.cos(turn)), 5)
    force = 100 * np.sin(20 * time) * (time < 0.6)
    acceleration = np.gradient(speed, time)
    current = acceleration * 15.6 + 0.2 * np.sin(900 * time)
    machine = Machine.from_toml(drive)
    measured = simulate(machine, Motion.along_x(time, acceleration)).quantities
    noise = 0.01 * np.sin(1e4 * time**2)
    sensor = measured["point_acceleration"][:, 0, 1] + noise
    cell = measured["force"][:, 0, 1] + 100 * noise
    response = np.arange(20.0, 300.0, 40.0)
    texts = {
        "cases.csv": "body.mass [kg],motion.scale\n1250,1\n1300,1.1\n1200,0.9\n",
        "trace.csv": _table("t [s],v [m/s],I [A]", time, speed, current),
        "sensors.csv": _table("t [s],ay [m/s^2],cell [N]", time, sensor, cell),
        "forces.csv": _table("t [s],Fx [N],Fy [N],Mz [N m]", time, force, 2 * force, force / 10),
        "response.csv": _table(
            "frequency [Hz],head y re [m/N],head y im [m/N]", response, 2e-8 + 0 * response, -1e-10 * response
        ),
        "samples.txt": "".join(f"{i},{c}\n" for i, c in enumerate(_counts())),
    }
    for name, text in texts.items():
        _write(folder / name, text)
    columns = {"t [s]": time, "v [m/s]": speed}
    np.savez(folder / "trace.npz", **columns)
    time = np.arange(13_000) * 1e-3  # two blocks
    # Moves with rests between them, and noise: such a record is smoothed four times as soon as a sine.
    phase = np.clip(np.abs((time / 2) % 2 - 1) * 1.4 - 0.2, 0, 1)
    place = 0.4 * phase**2 * (3 - 2 * phase) + np.random.default_rng(0).normal(0.0, 1e-5, time.size)
    columns = {"t [s]": time, "x [m]": np.round(place, 6)}
    parquet.write_table(pa.table(columns), folder / "trace.parquet")


def _text(file: Path) -> str:
    return file.read_text(encoding="utf-8")


def _write(file: Path, text: str) -> None:
    file.write_text(text, encoding="utf-8")


def _counts() -> list[int]:
    """Counts of an encoder: at rest until a monitor has settled, then to and fro."""
    time = 1e-3 * np.maximum(np.arange(3000) - 1500, 0)
    return np.round(0.05 * (1 - np.cos(7.5 * time)) / 2e-5).astype(int).tolist()


def words_of(line: str) -> tuple[list[str], str | None]:
    """The words of a command line, and the file that it reads from standard input, if any."""
    command, _, file = line.partition(" < ")
    return [word.replace("_", " ") if word[:1].isdigit() else word for word in command.split()], file or None


def files_of(line: str, folder: Path) -> list[str]:
    """Names of the files of the project that a command reads: those of its line, and those named in these."""
    present = {path.name for path in folder.iterdir() if path.is_file()}
    found: list[str] = []
    names = re.split(r"[ =]", line)
    while names:
        name = names.pop(0)
        if name in present and name not in found:
            found.append(name)
            if name.endswith(".toml"):
                names += re.findall(r'"([^"]*)"', _text(folder / name))
    return found
