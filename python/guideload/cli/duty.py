"""The command `guideload duty`: life and static safety under several load cases together."""

from __future__ import annotations

from pathlib import Path

import click

from guideload.cli.options import InputFile
from guideload.cli.reporting import Shown, shows_report
from guideload.cli.terminal import status


@click.command()
@shows_report
@click.argument("duty_file", metavar="DUTY.TOML", type=InputFile)
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
