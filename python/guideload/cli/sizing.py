"""The commands `guideload size` and `guideload limit`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from guideload.cli import options
from guideload.cli.inputs import read_machine, read_motion, read_moves
from guideload.cli.reporting import shows_report
from guideload.cli.terminal import status

if TYPE_CHECKING:
    from guideload.catalogue.conditions import LifeConditions
    from guideload.cli.reporting import Shown
    from guideload.machine.machine import Machine
    from guideload.motion.moves import Moves
    from guideload.reports.report import Report

life_option = click.option("--life", help='Life to be reached, e.g. "20000 km", "10000 h" or "10 years".')
safety_option = click.option("--safety", type=options.POSITIVE, help="Static safety to be reached, e.g. 3.")


class Vector(click.ParamType[tuple[float, ...]]):
    """Three numbers, separated by commas."""

    name = "x,y,z"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, ...]:
        if isinstance(value, tuple):
            return value
        try:
            numbers = tuple(float(part) for part in str(value).split(","))
        except ValueError:
            numbers = ()
        if len(numbers) != 3:
            self.fail(f"expected three numbers such as 0,0.3,0, got {value!r}", param, ctx)
        return numbers


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
    help="Product to try, instead of all; repeatable.",
)
@life_option
@safety_option
@options.trace_options
def size(
    machine_file: Path,
    trace_file: Path | Moves,
    catalogue_file: Path | None,
    products: tuple[str, ...],
    life: str | None,
    safety: float | None,
    **reading: Any,
) -> Shown:
    """Find the smallest product of a catalogue whose carriages last, and are safe, under a motion."""
    from guideload.catalogue.catalogue import Catalogue
    from guideload.catalogue.packaged import packaged_catalogue
    from guideload.reports.sizing import sizing_report
    from guideload.sizing.size import size as find

    with status("reading"):
        machine = read_machine(machine_file)
        motion = read_motion(trace_file, machine, **reading)
        catalogue = packaged_catalogue() if catalogue_file is None else Catalogue.from_toml(catalogue_file)
    with status("running every candidate"):
        conditions = _conditions(machine, life, safety)
        found = find(machine, motion, catalogue, products=products or None, conditions=conditions)
    return sizing_report(machine, found), lambda pages: pages.sizing_page(machine, found)


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
@click.option("--at", type=Vector(), help="Place of the payload from L, in m.  [default: 0,0,0]")
@click.option("--direction", type=Vector(), help="Direction of the overhang.  [default: 1,0,0]")
@life_option
@safety_option
@options.trace_options
def limit(
    machine_file: Path,
    trace_file: Path | Moves,
    quantity: Any,
    at: tuple[float, float, float] | None,
    direction: tuple[float, float, float] | None,
    life: str | None,
    safety: float | None,
    **reading: Any,
) -> Report:
    """Find how fast, how heavy or how far out a machine may work until life or static safety fails."""
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
        reading_only = {name: value for name, value in reading.items() if not name.startswith("forces")}
        moves = None if with_forces else read_moves(trace_file, **reading_only)
        motion = moves or read_motion(trace_file, machine, **reading)
    with status("searching the limit"):
        conditions = _conditions(machine, life, safety)
        found = largest(machine, motion, quantity, conditions=conditions, **places)
    return limit_report(machine, found, conditions)


def _conditions(machine: Machine, life: str | None, safety: float | None) -> LifeConditions:
    """The requirements of the machine, or those of the command line."""
    given = {"life": life, "safety": safety}
    return machine.life.model_copy(update={key: value for key, value in given.items() if value is not None})
