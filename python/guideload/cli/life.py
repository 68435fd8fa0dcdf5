"""The command `guideload life`: life and static safety under a motion."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from guideload.cli import options
from guideload.cli.inputs import paths, read_machine, read_motion, read_riders
from guideload.cli.outputs import picture_draft
from guideload.cli.reporting import shows_report
from guideload.cli.terminal import status

if TYPE_CHECKING:
    from guideload.motion.moves import Moves
    from guideload.reports.report import Report
    from guideload.simulation.start import Start

RULES = ("sum", "thk", "hiwin", "hiwin_mg", "iko", "rexroth", "thomson")
CONDITIONS = ("rule", "reliability", "life", "safety")


@click.command()
@shows_report
@options.machine_argument
@options.trace_argument
@click.option(
    "--rule", type=click.Choice(RULES), help="Rule of the equivalent load, instead of the machine file's."
)
@click.option("--reliability", type=options.POSITIVE, help="Probability that the life is reached, e.g. 0.95.")
@click.option("--life", help='Life to be reached, e.g. "20000 km", "10000 h" or "10 years".')
@click.option("--safety", type=options.POSITIVE, help="Static safety to be reached, e.g. 3.")
@click.option("--no-bands", is_flag=True, help="Leave out the credible bands, which take longest.")
@options.start_option
@options.rider_option
@options.picture_option
@options.overwrite_picture_option
@options.trace_options
def life(
    machine_file: Path,
    trace_file: Path | Moves,
    no_bands: bool,
    start: Start,
    riders: tuple[str, ...],
    output: Path | None,
    overwrite: bool,
    **given: Any,
) -> Report:
    """Show life and static safety of the carriages under a measured or planned motion, and their causes.

    The carriages name products of a catalogue. The picture shows the damage along the rails.
    """
    from guideload.life.life import life_of
    from guideload.reports.life import life_report
    from guideload.simulation.simulation import simulate

    changes = {key: given.pop(key) for key in CONDITIONS}
    changes = {key: value for key, value in changes.items() if value is not None}
    with picture_draft(output, overwrite, *paths(machine_file, trace_file, given["forces"])) as draft:
        with status("reading"):
            machine = read_machine(machine_file)
            conditions = machine.life.model_copy(update=changes)
            motion = read_motion(trace_file, machine, **given)
            moved = read_riders(machine, machine_file, riders)
        with status("computing loads and life"):
            result = simulate(machine, motion, riders=moved, start=start)
            found = life_of(result, conditions)
            shown = life_report(found, band=not no_bands)
        if draft is not None:
            from guideload import plots

            plots.save(plots.rail_damage(found), draft)
    return shown
