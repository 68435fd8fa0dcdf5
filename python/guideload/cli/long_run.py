"""The command `guideload long-run`: peaks and life over a record that is too long for memory."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from guideload.base.errors import GuideloadError
from guideload.cli import options
from guideload.cli.exit_codes import INTERRUPTED
from guideload.cli.inputs import read_machine
from guideload.cli.outputs import require_file, write_table
from guideload.cli.terminal import print_report, print_text, status

if TYPE_CHECKING:
    from guideload.base.methods import Method
    from guideload.simulation.start import Start

ENDINGS = (".csv", ".parquet")


@click.command("long-run")
@options.machine_argument
@click.argument("trace_file", metavar="TRACE.PARQUET", type=options.InputFile)
@click.option(
    "-o", "--output", type=options.FilePath, help="Table to write, a row per block: .csv or .parquet."
)
@click.option("--rows", type=click.IntRange(min=8192), help="Rows of a block.  [default: 65536]")
@options.method_option
@options.rtol_option
@options.start_option
@options.free_option
@click.option("--overwrite", is_flag=True, help="Replace the table.")
@options.trace_options
def long_run(
    machine_file: Path,
    trace_file: Path,
    output: Path | None,
    rows: int | None,
    method: Method,
    rtol: float,
    start: Start,
    free: str | None,
    overwrite: bool,
    **reading: Any,
) -> None:
    """Compute peaks and life over a record of any length.

    TRACE.PARQUET is read, smoothed and run in blocks, each of which starts where the one before ended; histories of the
    loads are not stored. Ctrl-C or a block that fails ends the run; the values so far are reported.
    """
    from guideload.long_runs.blocks import ROWS, motion_blocks
    from guideload.long_runs.long_run import LongRun
    from guideload.reports.long_run import long_run_report

    options.refuse_tolerance_of_exact(method)
    if output is not None:
        require_file(output, ENDINGS, overwrite, machine_file, trace_file)
    machine = read_machine(machine_file, free)
    run = LongRun(machine, method, rtol=rtol, start=start)
    given = {name: value for name, value in reading.items() if value is not None}
    ended: BaseException | None = None
    with status("running the blocks"):
        try:
            for block in motion_blocks(trace_file, machine.drive, rows=rows or ROWS, **given):
                run.add(block)
        except (KeyboardInterrupt, GuideloadError, MemoryError) as error:
            if not run.blocks:
                raise
            ended = error
    print_report(long_run_report(run))
    if output is not None:
        write_table(run.table(), output, overwrite)
        print_text(f"Wrote {output}.")
    if ended is not None:
        cause = "Interrupted" if isinstance(ended, KeyboardInterrupt) else "The next block failed"
        click.echo(f"{cause}: these values are of the record up to {run.blocks[-1].end:.3f} s.", err=True)
        if isinstance(ended, KeyboardInterrupt):
            raise SystemExit(INTERRUPTED)
        raise ended
