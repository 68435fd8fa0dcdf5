"""The commands `guideload size` and `guideload limit`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from guideload.cli import options
from guideload.cli.inputs import read_machine, read_motion, read_moves, requirements
from guideload.cli.reporting import Shown, shows_report
from guideload.cli.terminal import status

if TYPE_CHECKING:
    from guideload.motion.moves import Moves
    from guideload.reports.report import Report

MOST_ROWS = 40  # of candidates in the terminal


@click.command()
@shows_report
@options.machine_argument
@options.trace_argument
@click.option(
    "--from",
    "catalogue_file",
    type=options.InputFile,
    help="Catalogue file.  [default: the packaged catalogues]",
)
@click.option(
    "--product",
    "products",
    multiple=True,
    help='Products to try: a name, or words of maker and name such as "HIWIN 25"; repeatable.',
)
@options.requirement_options
@options.trace_options
def size(
    machine_file: Path,
    trace_file: Path | Moves,
    catalogue_file: Path | None,
    products: tuple[str, ...],
    **reading: Any,
) -> Shown:
    """Find the smallest product of a catalogue that holds.

    It must reach life and static safety under a motion, within the limits of product and drive.
    """
    from guideload.catalogue.catalogue import Catalogue
    from guideload.catalogue.packaged import only_maker, packaged_catalogue
    from guideload.reports.sizing import sizing_report
    from guideload.sizing.size import size as find

    with status("reading"):
        machine = read_machine(machine_file)
        conditions = requirements(machine, reading)
        motion = read_motion(trace_file, machine, **reading)
        if catalogue_file is None:
            catalogue = packaged_catalogue(only_maker(products))
        else:
            catalogue = Catalogue.from_toml(catalogue_file)
    with status("running every candidate"):
        found = find(machine, motion, catalogue, products=products or None, conditions=conditions)
    report = sizing_report(machine, found, MOST_ROWS)
    return Shown(report, page=lambda pages: pages.sizing_page(machine, found))


@click.command()
@shows_report
@options.machine_argument
@options.trace_argument
@click.option(
    "--of",
    "quantity",
    type=click.Choice(["pace", "payload", "overhang", "speed", "acceleration", "deceleration", "jerk"]),
    default="pace",
    show_default=True,
    help="What grows until a requirement fails: pace of the motion, payload [kg], shift of the centre of mass [m], or "
    "a limit of planned moves.",
)
@click.option(
    "--at",
    type=options.Vector("m"),
    help='Payload\'s place from L, e.g. "0 mm,300 mm,0 mm".  [default: 0,0,0]',
)
@click.option("--direction", type=options.Vector("1"), help="Direction of the overhang.  [default: 1,0,0]")
@options.requirement_options
@options.trace_options
def limit(
    machine_file: Path,
    trace_file: Path | Moves,
    quantity: Any,
    at: tuple[float, float, float] | None,
    direction: tuple[float, float, float] | None,
    **reading: Any,
) -> Report:
    """Find how fast, how heavy or how far out a machine may work.

    The limit is where a requirement fails. Required are life and static safety, and what the limits of products and
    drive allow.
    """
    from guideload.reports.sizing import limit_report
    from guideload.sizing.limits import largest

    places: dict[str, Any] = {"at": at, "direction": direction}
    places = {name: value for name, value in places.items() if value is not None}
    for name, of in (("at", "payload"), ("direction", "overhang")):
        if name in places and quantity != of:
            raise click.UsageError(f"--{name} needs --of {of}, got --of {quantity}")
    with_forces = any(reading[name] is not None for name in reading if name.startswith("forces"))
    if with_forces and quantity in ("speed", "acceleration", "deceleration", "jerk"):
        raise click.UsageError(
            f"--of {quantity} plans the moves anew at every try, but forces have fixed time stamps: leave --forces "
            "out, or use --of pace"
        )
    with status("reading"):
        machine = read_machine(machine_file)
        conditions = requirements(machine, reading)
        reading_only = {name: value for name, value in reading.items() if not name.startswith("forces")}
        moves = None if with_forces else read_moves(trace_file, **reading_only)
        motion = moves or read_motion(trace_file, machine, **reading)
    with status("searching the limit"):
        found = largest(machine, motion, quantity, conditions=conditions, **places)
    return limit_report(machine, found, conditions)
