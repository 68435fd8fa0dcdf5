"""Golden files of the command line: the help of every command, and the message of calls that must fail.

`python tests/golden.py --write` writes them anew; read the difference before it is committed. The calls are those in
the files themselves: write a line `$ guideload ...` there, and its message is filled in. Each ends with exit code 2,
a message on standard error, and no file written.
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
CALL = "$ guideload "  # begins a line of a call


def pages() -> dict[str, Callable[[], str]]:
    """The content of each golden file by its name."""
    found = {f"help/{name.replace(' ', '_')}": lambda name=name: help_page(name) for name in commands()}
    errors = [file.stem for file in sorted((FOLDER / "errors").glob("*.txt"))]
    return found | {f"errors/{name}": lambda name=name: error_page(calls(name)) for name in errors}


def calls(name: str) -> list[str]:
    """The calls of a golden file of errors: what follows CALL in its lines."""
    lines = (FOLDER / "errors" / f"{name}.txt").read_text(encoding="utf-8").splitlines()
    return [line.removeprefix(CALL) for line in lines if line.startswith(CALL)]


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
            texts.append(f"{CALL}{call}\n{message}")
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
