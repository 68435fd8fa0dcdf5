"""Golden files of the command line: the help of every command, and the message of calls that must fail.

`python tests/golden.py --write` writes them anew; read the difference before it is committed.
"""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import click
import numpy as np
import pandas as pd
import watched
from click.testing import CliRunner
from command_line import MACHINE, contents, write_trace

from guideload.cli.inputs import EXAMPLES
from guideload.cli.main import main

FOLDER = Path(__file__).resolve().parents[1] / "golden"
WIDTH = 100  # characters of a line of help
POINT = '[[points]]\nname = "tool"\nat = ["100 mm", "-800 mm", "200 mm"]\naxes = [[0, 0, 1], [1, 0, 0]]\n'
RIDER = """
[[riders]]
name = "slide"
mass = "100 kg"
center_of_mass = ["0 mm", "300 mm", "0 mm"]
inertia = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
direction = [0, 0, 1]
motion = "moves.toml"
"""
STUDY = """\
machine = "machine.toml"
trace = "trace.csv"
samples = 20
seed = 1
[limits]
peak_resultant = "0.5 N"
[[vary]]
path = "body.mass"
distribution = "uniform"
plus_minus = "10 %"
"""
MOVE = "'distance=0.4 m, speed=1 m/s, acceleration=4 m/s^2, jerk=200 m/s^3, dwell=0.5 s'"
FORCES = f"{MOVE} --forces forces.csv --forces-at tool"

# By page, calls that end with exit code 2, a message on standard error, and no file written.
ERRORS: dict[str, list[str]] = {
    "options": [
        *(
            f"run machine.toml trace.csv -o out {options}"
            for options in (
                "--method euler", "--rtol 0", "--rtol small", "--rtol nan", "--step -1", "--step inf",
                "--step 1e-3", "--free y,roll", "--free y,y", "--free ''", "--max-speed -1", "--max-speed nan",
                "--rate nan", "--format xlsx", "--smoothing none", "--kind torque",
            )
        ),
        "chart machine.toml trace.csv -o out --budget 0",
        "chart machine.toml trace.csv -o out --free x,y",
        "study study.toml -o out --samples 0",
        "study study.toml -o out --threads 0",
        "study study.toml -o out --seed -1",
        "probability study.toml --limit 'peak=8 kN'",
        "probability study.toml --limit 'peak_resultant[9z]=8 kN'",
        "run machine.toml -o out",
        "check machine.toml --forces-at tool",
        "check machine.toml --unit mm",
        "stability machine.toml --forces-at tool",
        "stability machine.toml --unit mm",
    ],
    "files": [
        "check missing.toml",
        "run machine.toml missing.csv -o out",
        "run machine.toml . -o out",
        "run machine.toml backwards.csv -o out",
        "run machine.toml jump.csv -o out",
        "encoder jump.csv",
        "check negative.toml",
        "check unclosed.toml",
        "check twice.toml",
        "check quotes.toml",
        "check ratio.toml",
        "check trace.csv machine.toml",
        "check headers.toml",
        "check class.toml",
        "check untyped.toml",
        "check loose.toml",
        "modes loose.toml",
        "run loose.toml trace.csv -o out",
        "run machine.toml trace.csv -o out --free x,y",
        "study missing.toml -o out",
        "study missing.toml -o out --resume",
        "study path.toml -o out",
        "life machine.toml trace.csv",
        "catalogue show catalogue.toml HGH26CA",
        "catalogue check short.toml",
    ],
    "outputs": [
        "run machine.toml trace.csv -o trace.csv",
        "run machine.toml trace.csv -o trace.csv/out",
        "run machine.toml trace.csv -o full",
        "run machine.toml trace.csv -o full --overwrite",
        "run machine.toml full/loads.nc -o full --overwrite",
        "study study.toml -o trace.csv/out",
        "study study.toml -o full",
        "study study.toml -o full --resume",
        "demo -o full",
        "modes machine.toml -o modes.bmp",
        "modes machine.toml -o modes",
        "modes machine.toml -o trace.csv/modes.png",
        "modes machine.toml -o none/modes.png",
        "modes disguised.png -o disguised.png --overwrite",
        "encoder trace.csv -o disguised.png",
        "init machine.toml",
        "init machine.toml --kind gantry",
        "init none/machine.toml",
        "init trace.csv/machine.toml",
        "init --study",
        "init --moves",
        "init --catalogue",
        "init --catalogue --moves",
        "init --catalogue --study",
        "init --catalogue --kind gantry",
    ],
    "forces": [
        "run machine.toml trace.csv -o out --forces forces.csv",
        "run machine.toml trace.csv -o out --forces forces.csv --forces-at spindle",
        f"run machine.toml -o out --move {MOVE} --forces-at tool",
        "run machine.toml trace.csv -o out --forces-at tool",
        "run machine.toml both.csv -o out --column velocity_m_s --forces-at tool --clock uniform",
        "run machine.toml trace.csv -o out --forces forces.csv --forces-at tool --forces-start '1 mm'",
        "run machine.toml trace.csv -o out --forces forces.csv --forces-at tool --forces-start 1",
        f"limit machine.toml --move {FORCES} --of jerk",
    ],
    "moves": [
        "run machine.toml moves.toml -o out --rate 1000",
        "run machine.toml moves.toml -o out --no-cross-check",
        "run machine.toml -o out --move 'distance=1,2 m, speed=2 m/s'",
        f"run machine.toml -o out --move {MOVE} --smoothing auto",
        f"run machine.toml moves.toml -o out --move {MOVE}",
        "run machine.toml machine.toml -o out",
        "run machine.toml -o out --move 'distanz=1 m'",
        "encoder moves.toml",
        "study moving.toml -o out",
        "run rider.toml trace.csv -o out --rider arm=moves.toml",
    ],
    "watch": [
        "monitor watch monitor.toml --record-only",
        "monitor watch monitor.toml --follow none.csv",
        "monitor watch monitor.toml --follow none.csv -o out",
        "monitor watch monitor.toml -o none/out",
        "monitor watch unlimited.toml --stop-at-limit",
    ],
}  # fmt: skip


def pages() -> dict[str, Callable[[], str]]:
    """The content of each golden file by its name."""
    found = {f"help/{name.replace(' ', '_')}": lambda name=name: help_page(name) for name in commands()}
    return found | {f"errors/{name}": lambda name=name: error_page(ERRORS[name]) for name in ERRORS}


def commands(command: click.Command = main, name: str = "guideload") -> Iterator[str]:
    """The words of every command and group."""
    yield name
    if isinstance(command, click.Group):
        for below, one in command.commands.items():
            yield from commands(one, f"{name} {below}")


def help_page(name: str) -> str:
    words = [*name.split()[1:], "--help"]
    ended = CliRunner().invoke(
        main, words, prog_name="guideload", terminal_width=WIDTH, catch_exceptions=False
    )
    assert ended.exit_code == 0
    return ended.stdout


def error_page(calls: list[str]) -> str:
    """Each call with its message."""
    with project() as folder:
        before = contents(folder)
        texts = []
        for call in calls:
            ended = CliRunner().invoke(main, shlex.split(call), prog_name="guideload", catch_exceptions=False)
            assert (ended.exit_code, ended.stdout) == (2, ""), f"{call}: {ended.exit_code}, {ended.output}"
            assert contents(folder) == before, call
            message = ended.stderr[ended.stderr.index("Error: ") :].replace(str(folder.resolve()), "FOLDER")
            texts.append(f"$ guideload {call}\n{message}")
    return "\n".join(texts)


@contextmanager
def project() -> Iterator[Path]:
    """A folder, as working directory, with a machine, traces, forces, moves and a study, and a bad one of most."""
    home = Path.cwd()
    with TemporaryDirectory() as name:
        os.chdir(name)
        try:
            write_files(Path(name))
            yield Path(name)
        finally:
            os.chdir(home)


def write_files(folder: Path) -> None:
    plain = Path(MACHINE).read_text(encoding="utf-8")
    text = f"{plain}\n{POINT}"
    write_trace(folder / "trace.csv", 900, 0.2)
    rows = pd.read_csv("trace.csv")
    rows["Fx [N]"], rows["Mz [N m]"] = 800.0 * np.sin(300.0 * rows["time_s"]), 50.0
    rows.to_csv("both.csv", index=False)
    rows.drop(columns="velocity_m_s").to_csv("forces.csv", index=False)
    rows["velocity_m_s"] += np.where(rows.index == 500, 5.0, 0.0)
    rows[["time_s", "velocity_m_s"]].to_csv("jump.csv", index=False)
    times = [f"{1e-3 * i:.3f},0.1" for i in range(20)]
    moves, catalogue = (
        (EXAMPLES / f"{name}.toml").read_text(encoding="utf-8") for name in ("moves", "catalogue")
    )
    product = '[[carriages]]\nproduct = "HGH25CA"\npreload_class = {}\n'
    named = 'catalogue = "catalogue.toml"\n' + plain.replace("[[carriages]]\n", product, 1)
    watched.write_monitor(folder)
    watch = (folder / "monitor.toml").read_text(encoding="utf-8").splitlines(keepends=True)
    texts = {
        "machine.toml": text,
        "negative.toml": plain.replace('"1250 kg"', '"-1250 kg"').replace("stiffness_y", "stifness_y", 1),
        "unclosed.toml": "name = [",
        "quotes.toml": plain.replace('"1250 kg"', "“1250 kg”"),
        "ratio.toml": plain.replace("gear_ratio = 12.0", 'gear_ratio = "1:12"'),
        "twice.toml": 'name = "a"\nname = "b"\n',
        "headers.toml": "[body]\n[body]\n",
        "class.toml": named.format('"ZC"'),
        "untyped.toml": named.format("1"),
        "loose.toml": plain.replace('free = ["y"', 'free = ["x", "y"'),
        "rider.toml": f"{plain}\n{RIDER}",
        "study.toml": STUDY,
        "path.toml": STUDY.replace("body.mass", "body.mas"),
        "moving.toml": STUDY.replace("trace.csv", "moves.toml") + "[reading]\nclock = 'uniform'\n",
        "moves.toml": moves,
        "catalogue.toml": catalogue,
        "short.toml": catalogue.replace(', base = "50 km" }', " }"),
        "backwards.csv": "\n".join(["time_s,velocity_m_s", *times, times[5], ""]),
        "disguised.png": plain,
        "unlimited.toml": "".join(line for line in watch if not line.startswith("load_limit")),
        "full/loads.nc": "mine",
    }  # fmt: skip
    (folder / "full").mkdir()
    for name, content in texts.items():
        (folder / name).write_text(content, encoding="utf-8")


def stale(write: bool = False) -> list[str]:
    """Names of the golden files that differ from what the program says now; they are written anew if asked."""
    found = []
    for name, page in pages().items():
        file, text = FOLDER / f"{name}.txt", page()
        if not file.exists() or file.read_text(encoding="utf-8") != text:
            found.append(name)
            if write:
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text(text, encoding="utf-8")
    return found
