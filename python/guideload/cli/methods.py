"""Commands about the methods themselves: their speed against their accuracy, and where they fail."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from guideload.cli.outputs import (
    CHART,
    PICTURE_ENDINGS,
    picture_draft,
    require_free,
    require_picture,
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
    working,
)


@click.command()
@click.argument("machine_file", metavar="MACHINE.TOML", type=InputFile)
@click.argument("trace_file", metavar="TRACE", type=InputFile)
@click.option(
    "-o", "--output", type=Folder, default=Path("guideload-chart"), show_default=True, help="Folder to write."
)
@click.option(
    "--budget",
    type=POSITIVE,
    default=20.0,
    show_default=True,
    help="Seconds that all runs together may take; settings that would exceed it are skipped.",
)
@click.option("--free", help="Dofs of L that may move, instead of the machine's: y,z,rx,ry,rz.")
@click.option("--no-pictures", is_flag=True, help="Write the numbers only.")
@click.option("--overwrite", is_flag=True, help="Replace the files of an earlier run in the folder.")
@trace_options
def chart(
    machine_file: Path,
    trace_file: Path,
    output: Path,
    budget: float,
    free: str | None,
    no_pictures: bool,
    overwrite: bool,
    **reading: Any,
) -> None:
    """Chart the speed of every method against its accuracy, for a machine under a measured motion.

    Every method runs over its range of tolerances and fixed steps; the error is that of the loads against a
    reference whose own error is told.
    """
    from guideload.methods.comparison import work_precision
    from guideload.reports.work_precision import chart_report

    names = {"report.txt", *(name for name in CHART if not (no_pictures and name.endswith(".png")))}
    require_free(output, {"": names}, overwrite, inputs=(machine_file, trace_file))
    with written_whole(output) as folder:
        with working("reading"):
            machine = read_machine(machine_file, free)
            motion = read_motion(trace_file, machine, **reading)
        with working(f"running every method, {budget:g} s at most"):
            precision = work_precision(machine, motion, budget=budget)
        try:
            precision.table().to_csv(folder / "chart.csv", index=False)
            (folder / "report.txt").write_text(chart_report(precision), encoding="utf-8")
            if not no_pictures:
                with working("drawing the picture"):
                    from guideload import plots

                    plots.save(plots.work_precision(precision), folder / "chart.png")
            write_manifest(folder)
        except OSError as error:
            raise click.ClickException(f"{output}: cannot be written: {error.strerror or error}") from error
    tell(chart_report(precision, encoding=output_encoding()))
    tell(f"Wrote {output}.")


@click.command()
@click.argument("machine_file", metavar="MACHINE.TOML", type=InputFile)
@click.argument("trace_file", metavar="[TRACE]", type=InputFile, required=False)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    help=f"Picture to write ({', '.join(ending[1:] for ending in PICTURE_ENDINGS)}).",
)
@click.option(
    "--rtol",
    type=POSITIVE,
    default=1e-6,
    show_default=True,
    help="Tolerance of the loads, part of the load scale, of the runs whose cost is told.",
)
@click.option("--free", help="Dofs of L that may move, instead of the machine's: y,z,rx,ry,rz.")
@click.option("--overwrite", is_flag=True, help="Replace the picture if it exists.")
@trace_options
def stability(
    machine_file: Path,
    trace_file: Path | None,
    output: Path | None,
    rtol: float,
    free: str | None,
    overwrite: bool,
    **reading: Any,
) -> None:
    """Tell how long the steps of every method may be, and what that costs on a machine.

    The longest stable step of rk45 is predicted from the machine's eigenvalues and measured by runs that grow
    without bound. The cost is that of a measured motion, or of a standard move if none is given.
    """
    from guideload.methods.step_stability import stability as limits_of
    from guideload.reports.stability import stability_report

    if output is not None:
        require_picture(output, overwrite, machine_file)
    with picture_draft(output) as draft:
        with working("reading"):
            machine = read_machine(machine_file, free)
            motion = None if trace_file is None else read_motion(trace_file, machine, **reading)
        with working("trying steps"):
            found = limits_of(machine, motion, rtol=rtol)
        if draft is not None:
            from guideload import plots

            plots.save(plots.stability(found)[0], draft)
    tell(stability_report(found, encoding=output_encoding()))
    if output is not None:
        tell(f"Wrote {output}.")
