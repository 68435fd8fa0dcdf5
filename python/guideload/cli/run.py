"""The commands that compute loads: run, and demo on the packaged example."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from guideload.cli import options
from guideload.cli.exit_codes import exit_if, picture_failure
from guideload.cli.inputs import EXAMPLES, paths, read_machine, read_motion, read_riders
from guideload.cli.outputs import FORMATS, OF_POINTS, PICTURES, atomic_output
from guideload.cli.reporting import Shown, shows_report
from guideload.cli.terminal import print_report, print_text, status

if TYPE_CHECKING:
    from guideload.base.methods import Method
    from guideload.motion.moves import Moves
    from guideload.reports.report import Report
    from guideload.simulation.result import Result
    from guideload.simulation.start import Start

PAPER_DOFS = ("rx", "ry", "rz")


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
            written = _write(results[name], folder / name, "netcdf", not no_pictures)
            failures.append(written.failure)
    titles = {"All dofs that the guides support": results["guides"], "The paper's dofs": results["paper"]}
    print_report(comparison(titles))
    print_text(
        f"Loads, reports and pictures are in {output}: guides (all dofs) and paper (the paper's dofs)."
    )
    exit_if(*failures)


@click.command()
@shows_report
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
) -> Shown:
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
    options.refuse_tolerance_of_exact(method)
    if output is None:
        if report is None:
            raise click.UsageError(
                "expected -o FOLDER, for loads, report and pictures, or --report FILE.html, or both"
            )
        for name, given in (("--format", file_format is not None), ("--no-pictures", no_pictures)):
            if given:
                raise click.UsageError(f"{name} needs -o: it is about the files in that folder")
    form = file_format or "netcdf"
    inputs = paths(machine_file, trace_file, reading["forces"])
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
                machine, motion, method=method, riders=moved, rtol=rtol, step=step, start=start, strict=strict
            )
        if folder is not None:
            return _write(result, folder, form, not no_pictures)
    return Shown(result_report(result), page=lambda pages: pages.run_page(result))


def _output_names(file_format: str, pictures: bool) -> set[str]:
    """Names of the files that `_write` writes."""
    names = {FORMATS[file_format], "report.txt", *((*PICTURES, OF_POINTS) if pictures else ())}
    return names | {"loads.json"} if file_format == "csv" else names


def _write(result: Result, folder: Path, file_format: str, with_pictures: bool) -> Shown:
    """Write loads, report and pictures of a run; the pictures are drawn once, for the folder and the HTML page."""
    from guideload.base.cores import threads
    from guideload.reports.run import result_report

    pictures, failure = None, None
    with status("writing the loads"), threads(1) as submit:
        _ = result.quantities  # computed once, for both threads
        report = submit(result_report, result)  # computes the audit while the file is written
        getattr(result, f"to_{file_format}")(folder / FORMATS[file_format])
        found: Report = report.result()
        (folder / "report.txt").write_text(found.text(), encoding="utf-8")
    if with_pictures:
        with status("drawing the pictures"):
            from guideload.plots.run import drawings
            from guideload.plots.saving import save_each

            drawn = pictures = drawings(result)
            failure = picture_failure(lambda: save_each(drawn, folder))
    return Shown(found, page=lambda pages: pages.run_page(result, pictures), failure=failure)
