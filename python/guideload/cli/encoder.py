"""The command `guideload encoder`: the report of a trace, and its picture."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import Any

import click

from guideload.cli.outputs import PICTURE_ENDINGS, draft_beside, require_picture, unwritable
from guideload.cli.shared import (
    InputFile,
    output_encoding,
    read_inspection,
    read_machine,
    tell,
    trace_options,
    working,
)


@click.command()
@click.argument("trace_file", metavar="TRACE", type=InputFile)
@click.option(
    "--machine",
    "machine_file",
    metavar="MACHINE.TOML",
    type=InputFile,
    help="Machine whose modes the trace is compared with; its [drive] makes a motor's speed the cart's.",
)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    help=f"Picture to write ({', '.join(ending[1:] for ending in PICTURE_ENDINGS)}).",
)
@click.option("--overwrite", is_flag=True, help="Replace the picture if it exists.")
@trace_options
def encoder(
    trace_file: Path, machine_file: Path | None, output: Path | None, overwrite: bool, **reading: Any
) -> None:
    """Report on an encoder trace, and draw it: samples, acceleration with its band, spectrum.

    The report gives quantum, kind of time stamps, damage and repairs; what the smoothing chose; and with a machine
    which of its modes the trace can show.
    """
    from guideload.reports.trace import encoder_report

    if output is not None:
        require_picture(output, overwrite, *filter(None, (trace_file, machine_file)))
    with nullcontext() if output is None else draft_beside(output) as draft:
        machine = None if machine_file is None else read_machine(machine_file)
        with working("reading and smoothing"):
            inspection = read_inspection(trace_file, machine, **reading)
        if output is not None and draft is not None:
            from guideload import plots

            with working("drawing the picture"):
                try:
                    plots.save(plots.encoder(inspection)[0], draft / output.name).replace(output)
                except OSError as error:
                    raise unwritable(output, error) from error
    tell(encoder_report(inspection, encoding=output_encoding()))
    draw = f"guideload encoder {trace_file} ... -o picture.png draws it."
    tell(draw if output is None else f"Wrote {output}.")
