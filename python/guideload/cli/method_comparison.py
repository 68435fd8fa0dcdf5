"""The commands that compare integration methods: chart (work-precision diagram) and stability."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from guideload.cli import options
from guideload.cli.inputs import paths, read_machine, read_motion, read_optional_motion
from guideload.cli.outputs import CHART, PICTURE_ENDINGS, atomic_output, file_draft, require_file
from guideload.cli.reporting import Shown, draws_report, shows_report
from guideload.cli.terminal import status

if TYPE_CHECKING:
    from guideload.motion.moves import Moves
    from guideload.reports.report import Report


@click.command()
@shows_report
@options.machine_argument
@options.trace_argument
@click.option(
    "-o",
    "--output",
    type=options.Folder(or_picture=True),
    default=Path("guideload-chart"),
    show_default=True,
    help="Folder to write; or a picture alone, such as chart.png.",
)
@click.option(
    "--budget",
    type=options.POSITIVE,
    default=20.0,
    show_default=True,
    help="Time in seconds for all runs together; settings that would exceed it are skipped.",
)
@options.free_option
@options.no_pictures_option
@options.overwrite_option
@options.trace_options
def chart(
    machine_file: Path,
    trace_file: Path | Moves,
    output: Path,
    budget: float,
    free: str | None,
    no_pictures: bool,
    overwrite: bool,
    **reading: Any,
) -> Report:
    """Draw the work-precision diagram of all methods.

    Every method computes the loads of a machine under a motion, with a range of tolerances and fixed steps. The
    error is the difference of the loads from a reference, whose own error is reported.
    """
    from guideload.base.finite import require_finite_table
    from guideload.method_comparison.runner import work_precision
    from guideload.reports.work_precision import chart_report

    inputs = paths(machine_file, trace_file, reading["forces"])
    names = {"report.txt", *(name for name in CHART if not (no_pictures and name.endswith(".png")))}
    is_picture = output.suffix.lower() in PICTURE_ENDINGS
    if is_picture and no_pictures:
        raise click.UsageError(f"--no-pictures needs a folder (-o), got the picture {output}")
    if is_picture:
        require_file(output, PICTURE_ENDINGS, overwrite, *inputs)
        output_draft = file_draft(output, overwrite)
    else:
        output_draft = atomic_output(output, {"": names}, overwrite, inputs)
    with output_draft as draft:
        with status("reading"):
            machine = read_machine(machine_file, free)
            motion = read_motion(trace_file, machine, **reading)
        with status(f"running every method, {budget:g} s at most"):
            diagram = work_precision(machine, motion, budget=budget)
        report = chart_report(diagram)
        if not is_picture:
            table = diagram.table()
            require_finite_table(table, table.columns)  # a setting that failed has no numbers
            table.to_csv(draft / "chart.csv", index=False)
            (draft / "report.txt").write_text(report.text(), encoding="utf-8")
        if not no_pictures:
            with status("drawing the picture"):
                from guideload import plots

                plots.save(plots.work_precision(diagram), draft if is_picture else draft / "chart.png")
    return report


@click.command()
@draws_report
@options.machine_argument
@options.optional_trace_argument
@options.rtol_option
@options.free_option
@options.trace_options
def stability(
    machine_file: Path, trace_file: Path | Moves | None, rtol: float, free: str | None, **reading: Any
) -> Shown:
    """Find the longest stable step of rk45.

    With a longer step an eigenvalue of the machine leaves the stability region of rk45. The report also lists the
    difficulties of the scene, and steps, time and error of every method. These are of a run under the motion, or under
    a standard move if no trace is given.
    """
    from guideload.method_comparison.step_stability import stability as step_stability
    from guideload.reports.stability import stability_report

    with status("reading"):
        machine = read_machine(machine_file, free)
        motion = read_optional_motion(trace_file, machine, **reading)
    with status("running every method"):
        found = step_stability(machine, motion, rtol=rtol)
    return Shown(stability_report(found), lambda plots: plots.stability(found)[0])
