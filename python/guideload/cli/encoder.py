"""The command `guideload encoder`: report and picture of a trace."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from guideload.cli import options
from guideload.cli.inputs import read_inspection, read_machine
from guideload.cli.reporting import Shown, draws_report
from guideload.cli.terminal import status


@click.command()
@draws_report
@options.trace_file_argument
@click.option(
    "--machine",
    "machine_file",
    metavar="MACHINE.TOML",
    type=options.InputFile,
    help="Machine whose modes the trace is compared with; its [drive] converts motor speed to cart speed.",
)
@click.option(
    "--ratio",
    help='Travel of the cart per turn of the motor, e.g. "33.3 mm", which converts motor speed without a machine.',
)
@options.trace_options
def encoder(trace_file: Path, machine_file: Path | None, ratio: str | None, **reading: Any) -> Shown:
    """Report on an encoder trace, and draw it.

    The picture has samples, acceleration with its band, and spectrum. The report states quantum, kind of time
    stamps, damage and repairs; the result of the smoothing; and with --machine the modes that the trace can show.
    """
    from guideload.reports.trace import encoder_report

    machine = None if machine_file is None else read_machine(machine_file)
    with status("reading and smoothing"):
        inspection = read_inspection(trace_file, machine, ratio, **reading)
    return Shown(encoder_report(inspection), lambda plots: plots.encoder(inspection)[0])
