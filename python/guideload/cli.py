"""The command line `guideload`. Exit codes: 0 fine, 1 the computation failed, 2 the input was refused.

Every module that costs time to import is imported by the command that needs it, so that `--help` is instant
and `run --no-pictures` loads no matplotlib.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from guideload.errors import ConfigError, GuideloadError, SceneError, TraceError

if TYPE_CHECKING:
    from guideload.machine import Machine
    from guideload.motion import Motion
    from guideload.result import Result
    from guideload.simulation import Method

EXAMPLES = files("guideload") / "examples"
FORMATS = {"netcdf": "loads.nc", "parquet": "loads.parquet", "csv": "loads.csv"}
PICTURES = ("scene.png", "figures_7_to_11.png", "resultant.png", "moments.png", "modes.png", "spectrum.png")
OUTPUTS = (*FORMATS.values(), "loads.json", *PICTURES, "report.txt")
PAPER_DOFS = ("rx", "ry", "rz")
BAD_INPUT = 2

InputFile = click.Path(path_type=Path)
POSITIVE = click.FloatRange(min=0.0, min_open=True)
Folder = click.Path(path_type=Path, file_okay=False)


class Refused(click.ClickException):
    """Input that cannot be used."""

    exit_code = BAD_INPUT


class NumberOrText(click.ParamType[float | str]):
    """A number in SI, or text with its unit, as the library takes it."""

    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float | str:
        try:
            return float(value)
        except ValueError:
            return str(value)


class Commands(click.Group):
    """Commands that end with one message and an exit code where the library raises."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except (ConfigError, SceneError, TraceError) as error:
            raise Refused(str(error)) from error
        except (GuideloadError, OSError) as error:
            raise click.ClickException(str(error)) from error


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="guideload")
def main() -> None:
    """Dynamic load of linear rolling guides, from a measured motion to the load of every carriage.

    Start with `guideload demo`, or with `guideload init`, which writes a machine.toml to fill in.
    """


@main.command()
@click.option(
    "-o", "--output", type=Folder, default=Path("guideload-demo"), show_default=True, help="Folder to write."
)
@click.option("--no-pictures", is_flag=True, help="Write the numbers only.")
@click.option("--overwrite", is_flag=True, help="Replace the files of an earlier run in the folder.")
def demo(output: Path, no_pictures: bool, overwrite: bool) -> None:
    """Run the packaged example with all dofs that its guides carry, and with the paper's dofs.

    The paper holds y and z of L, which hides the weight from the guides: the tables of peaks show both.
    """
    from guideload import report
    from guideload.machine import Machine
    from guideload.simulation import simulate

    _require_free(output, overwrite)
    with _working("reading the example"):
        machine = Machine.from_toml(str(EXAMPLES / "manipulator.toml"))
        motion = _read_motion(Path(str(EXAMPLES / "manipulator.csv")), machine)
    results = {}
    with _written_whole(output) as folder:
        for name, machine_with_dofs in (("guides", machine), ("paper", machine.with_free(PAPER_DOFS))):
            with _working(f"computing the loads, {name}"):
                results[name] = simulate(machine_with_dofs, motion)
            _write(results[name], folder / name, "netcdf", not no_pictures)
    titles = {"All dofs that the guides carry": results["guides"], "The paper's dofs": results["paper"]}
    _print(report.comparison(titles, encoding=_encoding()))
    _print(f"Loads, reports and pictures are in {output}: guides (all dofs) and paper (the paper's dofs).")


@main.command()
@click.argument("path", type=InputFile, default=Path("machine.toml"))
def init(path: Path) -> None:
    """Write a commented machine.toml to fill in."""
    try:
        with path.open("x", encoding="utf-8", newline="\n") as file:
            file.write((EXAMPLES / "machine.toml").read_text(encoding="utf-8"))
    except FileExistsError:
        raise Refused(
            f"{path} exists and is left as it is; give another name: guideload init NAME.toml"
        ) from None
    _print(f"Wrote {path}. Fill it in, then: guideload check {path}")


def trace_options(command: Any) -> Any:
    """The options that say how a trace is read; what is left out is taken from its header."""
    options = [
        click.option(
            "--column", help="Column of the measured motion; else the one whose header tells its unit."
        ),
        click.option(
            "--unit", help='Unit of that column, e.g. rpm or mm/s; for counts the travel of one: "5e-8 m".'
        ),
        click.option("--kind", help="What it is: position, counts, velocity (of the cart) or motor_speed."),
        click.option("--time", help="Column of the time stamps."),
        click.option("--rate", type=NumberOrText(), help="Samples per second, in place of a time column."),
        click.option(
            "--max-speed", type=NumberOrText(), help='Greatest speed the axis can have, e.g. "2 m/s".'
        ),
        click.option(
            "--allow-gaps", is_flag=True, default=None, help="Accept steps in time far above the usual one."
        ),
        click.option(
            "--no-cross-check",
            "cross_check",
            flag_value=False,
            default=None,
            help="Do not compare position with velocity where the table has both.",
        ),
        click.option(
            "--smoothing", help="From samples to acceleration: auto, savitzky_golay or differences."
        ),
        click.option("--window", type=POSITIVE, help="Window of savitzky_golay in seconds."),
    ]
    for option in reversed(options):
        command = option(command)
    return command


@main.command()
@click.argument("machine_file", metavar="MACHINE.TOML", type=InputFile)
@click.argument("trace_file", metavar="[TRACE]", type=InputFile, required=False)
@trace_options
def check(machine_file: Path, trace_file: Path | None, **reading: Any) -> None:
    """Check a machine, and a trace if one is given, and tell what was understood."""
    from guideload import report
    from guideload.machine import Machine

    machine = Machine.from_toml(machine_file)
    _print(report.machine_report(machine, encoding=_encoding()))
    if trace_file is not None:
        _print(report.motion_report(_read_motion(trace_file, machine, **reading), encoding=_encoding()))


@main.command("modes")
@click.argument("machine_file", metavar="MACHINE.TOML", type=InputFile)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Picture to write (png, svg, pdf).",
)
@click.option("--overwrite", is_flag=True, help="Replace the picture if it exists.")
def natural_modes(machine_file: Path, output: Path | None, overwrite: bool) -> None:
    """Natural frequencies, damping ratios and mode shapes of a machine."""
    from guideload import report
    from guideload.machine import Machine
    from guideload.modes import Modes

    if output is not None and output.exists() and not overwrite:
        raise Refused(f"{output} exists; give another name, or --overwrite")
    machine = Machine.from_toml(machine_file)
    modes = Modes.of(machine)
    if output is not None:
        from guideload import plots

        with tempfile.TemporaryDirectory(prefix=f".{output.name}-", dir=output.parent) as space:
            try:
                draft = plots.save(plots.modes(machine, modes)[0], Path(space) / output.name)
            except ValueError as error:  # an ending that matplotlib does not know
                raise Refused(f"{output}: {error}") from error
            draft.replace(output)
    _print(report.modes_report(machine, modes, encoding=_encoding()))
    if output is not None:
        _print(f"Wrote {output}.")


@main.command()
@click.argument("machine_file", metavar="MACHINE.TOML", type=InputFile)
@click.argument("trace_file", metavar="TRACE", type=InputFile)
@click.option("-o", "--output", type=Folder, required=True, help="Folder to write.")
@click.option(
    "--method", type=click.Choice(["auto", "exact", "rk45", "implicit"]), default="auto", show_default=True
)
@click.option(
    "--rtol",
    type=POSITIVE,
    default=1e-6,
    show_default=True,
    help="Tolerance of the loads, part of the load scale.",
)
@click.option("--step", type=POSITIVE, help="Fixed step in seconds, for rk45 and implicit.")
@click.option("--free", help="Dofs of L that may move, instead of the machine's: y,z,rx,ry,rz.")
@click.option(
    "--format", "file_format", type=click.Choice(list(FORMATS)), default="netcdf", show_default=True
)
@click.option("--no-pictures", is_flag=True, help="Write the numbers only.")
@click.option("--overwrite", is_flag=True, help="Replace the files of an earlier run in the folder.")
@trace_options
def run(
    machine_file: Path,
    trace_file: Path,
    output: Path,
    method: Method,
    rtol: float,
    step: float | None,
    free: str | None,
    file_format: str,
    no_pictures: bool,
    overwrite: bool,
    **reading: Any,
) -> None:
    """Compute the load of every carriage of a machine under a measured motion."""
    from guideload import report
    from guideload.machine import Machine
    from guideload.simulation import simulate

    if step is not None and method in ("auto", "exact"):
        raise click.UsageError(f"--step is for --method rk45 and implicit; {method} makes no step error")
    _require_free(output, overwrite)
    with _working("reading"):
        machine = Machine.from_toml(machine_file)
        if free is not None:
            machine = machine.with_free([dof.strip() for dof in free.split(",")])
        motion = _read_motion(trace_file, machine, **reading)
    with _working("computing the loads"):
        result = simulate(machine, motion, method=method, rtol=rtol, step=step)
    with _written_whole(output) as folder:
        _write(result, folder, file_format, not no_pictures)
    _print(report.result_report(result, encoding=_encoding()))
    _print(f"Wrote {output}.")


def _read_motion(trace_file: Path, machine: Machine, **reading: Any) -> Motion:
    from guideload.encoder import motion_from_trace, read_trace

    given = {name: value for name, value in reading.items() if value is not None}
    smoothing = {name: given.pop(name) for name in ("smoothing", "window") if name in given}
    return motion_from_trace(read_trace(trace_file, **given), drive=machine.drive, **smoothing)


def _write(result: Result, folder: Path, file_format: str, pictures: bool) -> None:
    """Loads, report and pictures of a run."""
    from guideload import report

    folder.mkdir(exist_ok=True)
    with _working("writing the loads"):
        getattr(result, f"to_{file_format}")(folder / FORMATS[file_format])
        (folder / "report.txt").write_text(report.result_report(result), encoding="utf-8")
    if pictures:
        with _working("drawing the pictures"):
            from guideload import plots

            plots.save_all(result, folder)


def _require_free(output: Path, overwrite: bool) -> None:
    """Before any work: the folder is new or empty, or the user wants its files replaced."""
    if not overwrite and output.is_dir() and any(output.iterdir()):
        raise Refused(
            f"the folder {output} is not empty; give another one, or --overwrite to replace its files"
        )


@contextmanager
def _written_whole(output: Path) -> Iterator[Path]:
    """A draft folder to write in, which becomes `output` when all is written; on failure nothing is left.

    In a folder with files in it, ours of an earlier run are replaced or removed, and all others stay.
    """
    output = output.resolve()
    output.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{output.name}-", dir=output.parent) as space:
        draft = Path(space) / output.name
        draft.mkdir()
        yield draft
        if output.is_dir() and any(output.iterdir()):
            _move_into(draft, output)
        else:
            if output.is_dir():
                output.rmdir()
            draft.rename(output)


def _move_into(draft: Path, folder: Path) -> None:
    folder.mkdir(exist_ok=True)
    for name in OUTPUTS:
        if not (draft / name).exists():
            (folder / name).unlink(missing_ok=True)
    for path in draft.iterdir():
        if path.is_dir():
            _move_into(path, folder / path.name)
        else:
            path.replace(folder / path.name)


def _working(what: str) -> AbstractContextManager[Any]:
    """Tell what is being done, on a terminal only and apart from the output."""
    if not sys.stderr.isatty():
        return nullcontext()
    from rich.console import Console

    return Console(stderr=True).status(f"{what} ...")


def _encoding() -> str:
    return getattr(sys.stdout, "encoding", None) or "utf-8"


def _print(text: str) -> None:
    """To standard output; signs that it cannot show are replaced."""
    encoding = _encoding()
    click.echo(text.rstrip("\n").encode(encoding, errors="replace").decode(encoding))
