"""The command line `guideload`. Exit codes: 0 fine, 1 the computation failed, 2 the input was refused.

Every module that costs time to import is imported by the command that needs it, so that `--help` is instant
and `run --no-pictures` loads no matplotlib.
"""

from __future__ import annotations

import atexit
import gc
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from guideload.base.errors import ArgumentError, ConfigError, GuideloadError, SceneError, TraceError
from guideload.cli import encoder as cli_encoder
from guideload.cli import methods as cli_methods
from guideload.cli import study as cli_study
from guideload.cli.outputs import (
    FORMATS,
    PICTURE_ENDINGS,
    PICTURES,
    Refused,
    picture_draft,
    require_free,
    require_picture,
    unwritable,
    write_manifest,
    written_whole,
)
from guideload.cli.shared import (
    POSITIVE,
    Folder,
    InputFile,
    output_encoding,
    read_machine,
    read_motion,
    tell,
    trace_options,
    uncollected,
    working,
)

if TYPE_CHECKING:
    from guideload.simulation.result import Result
    from guideload.simulation.simulation import Method

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
PAPER_DOFS = ("rx", "ry", "rz")


class Commands(click.Group):
    """Commands that end with one message and an exit code where the library raises."""

    def invoke(self, ctx: click.Context) -> Any:
        atexit.register(gc.freeze)  # or the interpreter searches all modules for garbage as it ends, 0.25 s
        try:
            return super().invoke(ctx)
        except (ArgumentError, ConfigError, SceneError, TraceError) as error:
            raise Refused(str(error)) from error
        except BrokenPipeError:  # the reader of our output has gone, as `head` does: click ends quietly
            raise
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
    from guideload.machine.machine import Machine
    from guideload.reports import result as report
    from guideload.simulation.simulation import simulate

    names = _names_of_run("netcdf", not no_pictures)
    require_free(output, {"guides": names, "paper": names}, overwrite)
    results = {}
    with written_whole(output) as folder:
        with working("reading the example"):
            machine = Machine.from_toml(EXAMPLES / "manipulator.toml")
            motion = read_motion(EXAMPLES / "manipulator.csv", machine)
        for name, machine_with_dofs in (("guides", machine), ("paper", machine.with_free(PAPER_DOFS))):
            with working(f"computing the loads, {name}"):
                results[name] = simulate(machine_with_dofs, motion)
            _write(results[name], folder / name, "netcdf", not no_pictures, output / name)
    titles = {"All dofs that the guides carry": results["guides"], "The paper's dofs": results["paper"]}
    tell(report.comparison(titles, encoding=output_encoding()))
    tell(f"Loads, reports and pictures are in {output}: guides (all dofs) and paper (the paper's dofs).")


@main.command()
@click.argument("path", type=InputFile, required=False)
@click.option(
    "--study", is_flag=True, help="Write a study.toml, on the loads of machine.toml where it scatters."
)
def init(path: Path | None, study: bool) -> None:
    """Write a commented machine.toml to fill in, or a study.toml."""
    name = "study.toml" if study else "machine.toml"
    path = path or Path(name)
    template = (EXAMPLES / name).read_text(encoding="utf-8")
    if study:  # the example is of the packaged machine; this one of that which `init` and the user's log give
        template = template.replace('"manipulator.toml"', '"machine.toml"').replace(
            '"manipulator.csv"', '"trace.csv"'
        )
    try:
        with path.open("x", encoding="utf-8", newline="\n") as file:
            file.write(template)
    except FileExistsError:
        option = " --study" if study else ""
        raise Refused(
            f"{path} exists and is left as it is; give another name: guideload init NAME.toml{option}"
        ) from None
    except OSError as error:
        raise unwritable(path, error) from None
    if study:
        beside = "put machine.toml (`guideload init` writes one) and trace.csv, a measured motion, beside it"
        tell(f"Wrote {path}. Fill it in and {beside}, then: guideload study {path} -o out/")
    else:
        tell(f"Wrote {path}. Fill it in, then: guideload check {path}")


@main.command()
@click.argument("machine_file", metavar="MACHINE.TOML", type=InputFile)
@click.argument("trace_file", metavar="[TRACE]", type=InputFile, required=False)
@trace_options
def check(machine_file: Path, trace_file: Path | None, **reading: Any) -> None:
    """Check a machine, and a trace if one is given, and tell what was understood.

    Of both together: which of the machine's modes the trace can show.
    """
    from guideload.reports.machine import machine_report

    machine = read_machine(machine_file)
    tell(machine_report(machine, encoding=output_encoding()))
    if trace_file is not None:
        from guideload.motion.resolution import TraceResolution
        from guideload.reports import result as report
        from guideload.reports.trace import resolution_report

        motion = read_motion(trace_file, machine, **reading)
        tell(report.motion_report(motion, encoding=output_encoding()))
        tell("\n" + resolution_report(TraceResolution.of_motion(machine, motion), encoding=output_encoding()))


@main.command("modes")
@click.argument("machine_file", metavar="MACHINE.TOML", type=InputFile)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    help=f"Picture to write ({', '.join(ending[1:] for ending in PICTURE_ENDINGS)}).",
)
@click.option("--overwrite", is_flag=True, help="Replace the picture if it exists.")
def natural_modes(machine_file: Path, output: Path | None, overwrite: bool) -> None:
    """Natural frequencies, damping ratios and mode shapes of a machine."""
    from guideload.machine.modes import Modes
    from guideload.reports.machine import modes_report

    if output is not None:
        require_picture(output, overwrite, machine_file)
    with picture_draft(output) as draft:
        machine = read_machine(machine_file)
        modes = Modes.of(machine)
        if draft is not None:
            from guideload import plots

            plots.save(plots.modes(machine, modes)[0], draft)
    tell(modes_report(machine, modes, encoding=output_encoding()))
    if output is not None:
        tell(f"Wrote {output}.")


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
@uncollected()
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
    from guideload.simulation.simulation import simulate

    if step is not None and method in ("auto", "exact"):
        raise click.UsageError(f"--step is for --method rk45 and implicit; {method} makes no step error")
    names = _names_of_run(file_format, not no_pictures)
    require_free(output, {"": names}, overwrite, inputs=(machine_file, trace_file))
    with written_whole(output) as folder:
        with working("reading"):
            machine = read_machine(machine_file, free)
            motion = read_motion(trace_file, machine, **reading)
        with working("computing the loads"):
            result = simulate(machine, motion, method=method, rtol=rtol, step=step)
        text = _write(result, folder, file_format, not no_pictures, output)
    if (encoding := output_encoding()).lower() != "utf-8":  # the file's; other encodings lack signs
        from guideload.reports import result as report

        text = report.result_report(result, encoding=encoding)
    tell(text)
    tell(f"Wrote {output}.")


def _names_of_run(file_format: str, pictures: bool) -> set[str]:
    """The names that `_write` may write."""
    names = {FORMATS[file_format], "report.txt", *(PICTURES if pictures else ())}
    return names | {"loads.json"} if file_format == "csv" else names


def _write(result: Result, folder: Path, file_format: str, pictures: bool, shown: Path) -> str:
    """Loads, report, pictures and manifest of a run; gives the report. Errors call the folder `shown`."""
    from concurrent.futures import ThreadPoolExecutor

    from guideload.reports import result as report

    try:
        folder.mkdir(exist_ok=True)
        with working("writing the loads"), ThreadPoolExecutor(1) as beside:
            _ = result.data  # made once, for both of the following
            told = beside.submit(report.result_report, result)  # computes the audit while the file is written
            getattr(result, f"to_{file_format}")(folder / FORMATS[file_format])
            text = told.result()
            (folder / "report.txt").write_text(text, encoding="utf-8")
        if pictures:
            with working("drawing the pictures"):
                from guideload import plots

                plots.save_all(result, folder)
        write_manifest(folder)
        return text
    except OSError as error:
        raise click.ClickException(f"{shown}: cannot be written: {error.strerror or error}") from error


main.add_command(cli_encoder.encoder)
main.add_command(cli_methods.chart)
main.add_command(cli_methods.stability)
main.add_command(cli_study.study)
