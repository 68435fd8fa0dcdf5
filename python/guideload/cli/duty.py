"""The command `guideload duty`: life and static safety under several load cases together."""

from __future__ import annotations

from pathlib import Path

import click

from guideload.cli import options
from guideload.cli.options import InputFile
from guideload.cli.outputs import require_report
from guideload.cli.terminal import output_encoding, print_text, status


@click.command()
@click.argument("duty_file", metavar="DUTY.TOML", type=InputFile)
@options.report_option
@click.option("--overwrite", is_flag=True, help="Replace the HTML report.")
def duty(duty_file: Path, report: Path | None, overwrite: bool) -> None:
    """Show life and static safety under a duty cycle: load cases with their cycles per hour or shift.

    Each case has a machine, or changes of one, and a motion. The report says which case uses which share of the life.
    """
    from guideload.duty.duty_cycle import DutyCycle
    from guideload.reports.duty import duty_report

    require_report(report, overwrite, duty_file)
    with status("running the cases"):
        found = DutyCycle.from_toml(duty_file)
    if report is not None:
        from guideload import html_report

        html_report.save_page(html_report.duty_page(found), report)
    print_text(duty_report(found, encoding=output_encoding()))
    if report is not None:
        print_text(f"Wrote {report}.")
