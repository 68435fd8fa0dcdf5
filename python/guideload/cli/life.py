"""The commands life and duty: life and static safety under a motion, and under several load cases together."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from guideload.cli import options
from guideload.cli.inputs import read_machine, read_motion, read_riders, requirements
from guideload.cli.reporting import Shown, draws_report, shows_report
from guideload.cli.terminal import status

if TYPE_CHECKING:
    from guideload.motion.moves import Moves
    from guideload.simulation.start import Start


@click.command()
@draws_report
@options.machine_argument
@options.trace_argument
@options.requirement_options
@click.option("--no-bands", is_flag=True, help="Leave out the credible bands, which take longest.")
@options.start_option
@options.rider_option
@options.trace_options
def life(
    machine_file: Path,
    trace_file: Path | Moves,
    no_bands: bool,
    start: Start,
    riders: tuple[str, ...],
    **given: Any,
) -> Shown:
    """Show life and static safety under a motion.

    The report also has the causes of the worst load. The carriages name products of a catalogue. The picture shows
    the damage along the rails.
    """
    from guideload.life.life import life_of
    from guideload.reports.life import life_report
    from guideload.simulation.simulation import simulate

    with status("reading"):
        machine = read_machine(machine_file)
        conditions = requirements(machine, given)
        motion = read_motion(trace_file, machine, **given)
        moved = read_riders(machine, machine_file, riders)
    with status("computing loads and life"):
        result = simulate(machine, motion, riders=moved, start=start)
        found = life_of(result, conditions)
        shown = life_report(found, band=not no_bands)
    return Shown(shown, lambda plots: plots.rail_damage(found))


@click.command()
@shows_report
@click.argument("duty_file", metavar="DUTY.TOML", type=options.InputFile)
def duty(duty_file: Path) -> Shown:
    """Show life and static safety under a duty cycle.

    A duty cycle is load cases with their cycles per hour or shift. Each case has a machine, or changes of one, and
    a motion. The report says which case uses which share of the life.
    """
    from guideload.duty.duty_cycle import DutyCycle
    from guideload.reports.duty import duty_report

    with status("running the cases"):
        found = DutyCycle.from_toml(duty_file)
    return Shown(duty_report(found), page=lambda pages: pages.duty_page(found))
