"""What the commands share: kinds of options, reading a machine and a trace, telling and printing."""

from __future__ import annotations

import gc
import math
import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from guideload.base.errors import SceneError
from guideload.cli.outputs import Refused

if TYPE_CHECKING:
    from guideload.machine.machine import Machine
    from guideload.motion.motion import Motion
    from guideload.traces.inspection import Inspection

InputFile = click.Path(path_type=Path)
Folder = click.Path(path_type=Path, file_okay=False)


class Positive(click.FloatRange):
    """A finite number above 0."""

    def __init__(self) -> None:
        super().__init__(min=0.0, min_open=True)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        number = float(super().convert(value, param, ctx))
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number", param, ctx)
        return number


POSITIVE = Positive()


class NumberOrText(click.ParamType[float | str]):
    """A number in SI, or text with its unit, as the library takes it."""

    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float | str:
        try:
            return float(value)
        except ValueError:
            return str(value)


def trace_options(command: Any) -> Any:
    """The options that say how a trace is read; what is left out is taken from its header."""
    options = [
        click.option(
            "--column", help="Column of the measured motion; else the one whose header tells its unit."
        ),
        click.option(
            "--unit", help='Unit of that column, e.g. rpm or mm/s; for counts the travel of one: "5e-8 m".'
        ),
        click.option("--kind", help="What it is: position, counts, velocity (of the cart) or motor_speed."),
        click.option("--time", help="Column of the time stamps; with --rate, of a counter of cycles."),
        click.option("--rate", type=NumberOrText(), help="Samples per second, in place of a time column."),
        click.option(
            "--clock", help="Kind of the time stamps: uniform, ticks, jitter or on_change; else detected."
        ),
        click.option(
            "--quantum", type=NumberOrText(), help='Step of the value, e.g. "5e-8 m"; else detected.'
        ),
        click.option(
            "--counter-bits",
            type=click.IntRange(0, 62),
            help="Width of a counter of counts that runs over, 0 for none; else detected.",
        ),
        click.option(
            "--hold",
            type=POSITIVE,
            help="Rows in which each value stands, in a log faster than its signal; 1 takes all; else detected.",
        ),
        click.option(
            "--date-order", help="Of dates such as 03/04/2024: dmy or mdy; else from days above 12."
        ),
        click.option(
            "--max-speed", type=NumberOrText(), help='Greatest speed the axis can have, e.g. "2 m/s".'
        ),
        click.option(
            "--allow-gaps", is_flag=True, default=None, help="Accept steps in time far above the usual one."
        ),
        click.option(
            "--repair",
            help="Damage to leave out: all, or some of empty,doubled,clock,outliers,stuck; else it is refused.",
        ),
        click.option(
            "--no-cross-check",
            "cross_check",
            flag_value=False,
            default=None,
            help="Do not compare position with velocity where the table has both.",
        ),
        click.option(
            "--smoothing",
            help="From samples to acceleration: auto, which tells its band; for comparison spline, savitzky_golay or "
            "differences.",
        ),
        click.option("--window", type=POSITIVE, help="Window of savitzky_golay in seconds."),
    ]
    for option in reversed(options):
        command = option(command)
    return command


def read_machine(machine_file: Path, free: str | None = None) -> Machine:
    """The machine, with other free dofs if they are given; a body that nothing supports is refused here."""
    from guideload.machine.machine import DOFS, Machine

    machine, place = Machine.from_toml(machine_file), str(machine_file)
    if free is not None:
        dofs = [dof.strip() for dof in free.split(",")]
        if len(set(dofs)) < len(dofs) or not set(dofs) <= set(DOFS):
            raise Refused(f'--free: expected one or more of {",".join(DOFS)}, each once, got "{free}"')
        machine, place = machine.with_free(dofs), f"{machine_file} with --free {free}"
    try:
        _ = machine.scene  # made once, and kept by the machine
    except SceneError as error:
        raise Refused(f"{place}: {error}") from error
    return machine


def read_motion(trace_file: Path, machine: Machine, **reading: Any) -> Motion:
    from guideload.traces.reading import motion_from_trace, read_trace

    given, smoothing = _split(reading)
    return motion_from_trace(read_trace(trace_file, **given), drive=machine.drive, **smoothing)


def read_inspection(trace_file: Path, machine: Machine | None, **reading: Any) -> Inspection:
    from guideload.traces.inspection import Inspection
    from guideload.traces.reading import read_trace

    given, smoothing = _split(reading)
    return Inspection.of(read_trace(trace_file, **given), machine, **smoothing)


def _split(reading: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """The options of `trace_options` that were given: those of the reading, and those of the smoothing."""
    given = {name: value for name, value in reading.items() if value is not None}
    return given, {name: given.pop(name) for name in ("smoothing", "window") if name in given}


@contextmanager
def uncollected() -> Iterator[None]:
    """No search for garbage in cycles: while modules are imported it takes 0.1 s and finds none."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


def working(what: str) -> AbstractContextManager[Any]:
    """Tell what is being done, on a terminal only and apart from the output."""
    if not sys.stderr.isatty():
        return nullcontext()
    from rich.console import Console

    return Console(stderr=True).status(f"{what} ...")


def output_encoding() -> str:
    return getattr(sys.stdout, "encoding", None) or "utf-8"


def tell(text: str) -> None:
    """To standard output; signs that it cannot show are replaced."""
    encoding = output_encoding()
    click.echo(text.rstrip("\n").encode(encoding, errors="replace").decode(encoding))
