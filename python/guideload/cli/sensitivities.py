"""The command `guideload sensitivities`: what drives a load or a life, from exact derivatives of one run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from guideload.cli import options
from guideload.cli.inputs import read_machine, read_motion
from guideload.cli.reporting import Shown, draws_report
from guideload.cli.terminal import status

if TYPE_CHECKING:
    from guideload.motion.moves import Moves
    from guideload.simulation.start import Start

FIGURES = ("peak_resultant", "mean_load", "life")


@click.command()
@draws_report
@options.machine_argument
@options.trace_argument
@click.option(
    "--of",
    "figure",
    type=click.Choice(FIGURES),
    default=FIGURES[0],
    show_default=True,
    help="Result to differentiate.",
)
@click.option("--carriage", help="Carriage; by default the most loaded one.")
@click.option(
    "--to",
    multiple=True,
    metavar="PARAMETER",
    help='Parameters to vary, such as "carriages.*.stiffness_y"; repeatable.',
)
@options.start_option
@options.trace_options
def sensitivities(
    machine_file: Path,
    trace_file: Path | Moves,
    figure: str,
    carriage: str | None,
    to: tuple[str, ...],
    start: Start,
    **given: Any,
) -> Shown:
    """Show which numbers of a machine drive a load or a life.

    They follow from exact derivatives of one run. The picture is a tornado diagram. For ranges of values, and for
    machines with clearance or preload, run a study.
    """
    from guideload.reports.sensitivities import sensitivities_report
    from guideload.sensitivity.influence import rank_influences

    with status("reading"):
        machine = read_machine(machine_file)
        motion = read_motion(trace_file, machine, **given)
    with status("computing derivatives"):
        found = rank_influences(machine, motion, figure, to, carriage, start)
    report = sensitivities_report(machine, motion, found)
    return Shown(report, lambda plots: plots.influence(machine, found))
