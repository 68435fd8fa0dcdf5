"""The commands that compute loads: run, and demo on the packaged example."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from guideload.base.errors import PictureError
from guideload.cli import options
from guideload.cli.exit_codes import exit_if, picture_failure
from guideload.cli.inputs import EXAMPLES, paths, read_machine, read_motion, read_riders
from guideload.cli.outputs import (
    FORMATS,
    OF_POINTS,
    PICTURES,
    atomic_output,
    require_report,
    write_errors,
    write_manifest,
)
from guideload.cli.terminal import print_report, print_text, status

if TYPE_CHECKING:
    from guideload.base.methods import Method
    from guideload.motion.moves import Moves
    from guideload.plots.run import Pictures
    from guideload.reports.report import Report
    from guideload.simulation.result import Result
    from guideload.simulation.start import Start

PAPER_DOFS = ("rx", "ry", "rz")


@contextmanager
def no_garbage_collection() -> Iterator[None]:
    """Switch off garbage collection, which takes 0.1 s while modules are imported.

    What exists at the end is frozen: the first search after the end would go through all modules, 0.2 s. The next run
    in the same process thaws it.
    """
    was_enabled = gc.isenabled()
    gc.unfreeze()
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        if was_enabled:
            gc.enable()


@click.command()
@options.folder_option(default=Path("guideload-demo"), show_default=True)
@options.no_pictures_option
@options.overwrite_option
def demo(output: Path, no_pictures: bool, overwrite: bool) -> None:
    """Run the packaged example.

    It runs twice: with all dofs that the guides support, and with the dofs of the paper, where y and z of L are held.
    The guides then do not carry the weight, as a comparison of the tables shows.
    """
    from guideload.reports.run import comparison
    from guideload.simulation.simulation import simulate

    names = _output_names("netcdf", not no_pictures)
    results, failures = {}, []
    with atomic_output(output, {"guides": names, "paper": names}, overwrite) as folder:
        with status("reading the example"):
            machine = read_machine(EXAMPLES / "manipulator.toml")
            motion = read_motion(EXAMPLES / "manipulator.csv", machine)
        for name, with_dofs in (("guides", machine), ("paper", machine.with_free(PAPER_DOFS))):
            with status(f"computing the loads, {name}"):
                results[name] = simulate(with_dofs, motion)
            pictures = None if no_pictures else _pictures(results[name])
            _, failure = _write(results[name], folder / name, "netcdf", pictures, output / name)
            failures.append(failure)
    titles = {"All dofs that the guides support": results["guides"], "The paper's dofs": results["paper"]}
    print_report(comparison(titles))
    print_text(
        f"Loads, reports and pictures are in {output}: guides (all dofs) and paper (the paper's dofs)."
    )
    exit_if(*failures)


@click.command()
@options.machine_argument
@options.trace_argument
@options.folder_option()
@options.method_option
@options.rtol_option
@options.start_option
@click.option(
    "--step", type=options.POSITIVE, help="Fixed step in seconds, for exponential, rk45 and implicit."
)
@options.free_option
@options.rider_option
@click.option(
    "--format",
    "file_format",
    type=click.Choice(list(FORMATS)),
    help="File format of the loads.  [default: netcdf]",
)
@options.no_pictures_option
@options.report_option
@options.overwrite_option
@click.option("--strict", is_flag=True, help="Fail, and write nothing, if the audit doubts the result.")
@options.trace_options
@no_garbage_collection()
def run(
    machine_file: Path,
    trace_file: Path | Moves,
    output: Path | None,
    method: Method,
    rtol: float,
    start: Start,
    step: float | None,
    free: str | None,
    riders: tuple[str, ...],
    file_format: str | None,
    no_pictures: bool,
    report: Path | None,
    overwrite: bool,
    strict: bool,
    **reading: Any,
) -> None:
    """Compute the load of every carriage under a motion.

    TRACE: a measured motion, or a motion file (.toml) with planned moves, in every command. -o writes a folder with
    loads, report and pictures, --report one HTML file; at least one of them is needed.
    """
    from guideload.reports.run import result_report
    from guideload.simulation.simulation import simulate

    if step is not None and method in ("auto", "exact"):
        raise click.UsageError(
            "--step needs --method rk45 or implicit, or exponential for preloaded contacts; "
            f"{method} has no fixed step"
        )
    if output is None:
        _require_report_alone(report, file_format, no_pictures)
    form = file_format or "netcdf"
    inputs = paths(machine_file, trace_file, reading["forces"])
    require_report(report, overwrite, *inputs, folder=output)
    with ExitStack() as stack:
        folder = None
        if output is not None:
            names = {"": _output_names(form, not no_pictures)}
            folder = stack.enter_context(atomic_output(output, names, overwrite, inputs))
        with status("reading"):
            machine = read_machine(machine_file, free)
            motion = read_motion(trace_file, machine, **reading)
            moved = read_riders(machine, machine_file, riders)
        with status("computing the loads"):
            result = simulate(
                machine,
                motion,
                method=method,
                riders=moved,
                rtol=rtol,
                step=step,
                start=start,
                strict=strict,
            )
        shown, failure, pictures = None, None, None
        if folder is not None and output is not None:
            pictures = None if no_pictures else _pictures(result)
            shown, failure = _write(result, folder, form, pictures, output)
    print_report(shown or result_report(result))
    if report is not None:
        with status("writing the HTML report"):
            from guideload import html_report

            html_report.save(result, report, replace=overwrite, pictures=pictures)
    print_text(f"Wrote {' and '.join(str(path) for path in (output, report) if path is not None)}.")
    exit_if(failure)


def _require_report_alone(report: Path | None, file_format: str | None, no_pictures: bool) -> None:
    """Raise UsageError unless an HTML report is wanted, and no option that acts on the folder of -o."""
    if report is None:
        raise click.UsageError(
            "expected -o FOLDER, for loads, report and pictures, or --report FILE.html, or both"
        )
    for name, given in (("--format", file_format is not None), ("--no-pictures", no_pictures)):
        if given:
            raise click.UsageError(f"{name} needs -o: it is about the files in that folder")


def _output_names(file_format: str, pictures: bool) -> set[str]:
    """Names of the files that `_write` writes."""
    names = {FORMATS[file_format], "report.txt", *((*PICTURES, OF_POINTS) if pictures else ())}
    return names | {"loads.json"} if file_format == "csv" else names


def _pictures(result: Result) -> Pictures:
    """The pictures of a run, which are drawn once for the folder and the HTML report."""
    from guideload.plots.run import drawings

    return drawings(result)


def _write(
    result: Result, folder: Path, file_format: str, pictures: Pictures | None, output: Path
) -> tuple[Report, PictureError | None]:
    """Write loads, report, pictures and manifest of a run; return the report, and the error of missing pictures.

    output: the folder for messages.
    """
    from guideload.base.cores import threads
    from guideload.reports.run import result_report

    failure = None
    with write_errors(output):
        folder.mkdir(exist_ok=True)
        with status("writing the loads"), threads(1) as submit:
            _ = result.quantities  # computed once, for both threads
            report = submit(result_report, result)  # computes the audit while the file is written
            getattr(result, f"to_{file_format}")(folder / FORMATS[file_format])
            found: Report = report.result()
            (folder / "report.txt").write_text(found.text(), encoding="utf-8")
        if pictures is not None:
            with status("drawing the pictures"):
                from guideload.plots.saving import save_each

                failure = picture_failure(lambda: save_each(pictures, folder))
        write_manifest(folder)
    return found, failure
