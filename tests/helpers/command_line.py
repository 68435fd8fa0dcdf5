"""Calls of the command line, and what they find and leave in folders."""

from pathlib import Path

import numpy as np
from click.testing import CliRunner, Result

from guideload.cli.inputs import EXAMPLES
from guideload.cli.main import main
from guideload.cli.outputs import MANIFEST

MACHINE = str(EXAMPLES / "manipulator.toml")
TRACE = str(EXAMPLES / "manipulator.csv")
RISE = 0.5  # s, of the move in `write_trace`


def guideload(*arguments: object, code: int = 0) -> Result:
    """A call that must end with this exit code."""
    ended = CliRunner().invoke(main, [str(argument) for argument in arguments], catch_exceptions=False)
    assert ended.exit_code == code, ended.output
    return ended


def refused(*arguments: object, code: int = 2) -> str:
    """The message of a call that must fail: on standard error alone, without a traceback."""
    ended = guideload(*arguments, code=code)
    assert ended.stdout == "" and "Traceback" not in ended.stderr
    return ended.stderr


def write_trace(path: Path, samples: int, start: float) -> str:
    """Velocity of a cart at 1 kHz: at rest until `start` [s], then up to 0.5 m/s and down again."""
    time = np.arange(samples) * 1e-3
    velocity = 0.25 * (1 - np.cos(2 * np.pi * np.clip((time - start) / RISE, 0, 1)))
    rows = (f"{t:.3f},{v:.5f}\n" for t, v in zip(time, velocity, strict=True))
    path.write_text("time_s,velocity_m_s\n" + "".join(rows), encoding="utf-8")
    return str(path)


def write_rated(folder: Path, more: str = "") -> Path:
    """The packaged machine whose carriages are of a product, with the catalogue beside it; more: tables of the file."""
    (folder / "catalogue.toml").write_bytes((EXAMPLES / "catalogue.toml").read_bytes())
    text = Path(MACHINE).read_text(encoding="utf-8")
    text = text.replace("stiffness_y", 'product = "HGH25CA"\npreload_class = "ZA"\nstiffness_y')
    file = folder / "machine.toml"
    file.write_text(f'catalogue = "catalogue.toml"\n{text}\n{more}', encoding="utf-8")
    return file


def names(folder: Path) -> set[str]:
    """The files in a folder, except the manifest."""
    return {path.name for path in folder.iterdir()} - {MANIFEST}


def contents(folder: Path) -> dict[Path, bytes]:
    """The bytes of all files below a folder."""
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
