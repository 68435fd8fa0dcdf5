"""Arguments and options that several commands have."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from typing import Any

import click

from guideload.cli.outputs import PICTURE_ENDINGS

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


class NumberOrText(click.ParamType[float | str]):
    """A number in SI, or text with its unit, as the library takes it."""

    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float | str:
        try:
            return float(value)
        except ValueError:
            return str(value)


POSITIVE = Positive()

machine_argument = click.argument("machine_file", metavar="MACHINE.TOML", type=InputFile)
trace_argument = click.argument("trace_file", metavar="TRACE", type=InputFile)
optional_trace_argument = click.argument("trace_file", metavar="[TRACE]", type=InputFile, required=False)
picture_option = click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    help=f"Picture to write ({', '.join(ending[1:] for ending in PICTURE_ENDINGS)}).",
)
overwrite_picture_option = click.option("--overwrite", is_flag=True, help="Replace the picture if it exists.")
overwrite_option = click.option(
    "--overwrite", is_flag=True, help="Replace the files of an earlier run in the folder."
)
no_pictures_option = click.option("--no-pictures", is_flag=True, help="Write the numbers only.")
folder_option = partial(click.option, "-o", "--output", type=Folder, help="Folder to write.")
free_option = click.option("--free", help="Dofs of L that may move, instead of the machine's: y,z,rx,ry,rz.")
rtol_option = click.option(
    "--rtol",
    type=POSITIVE,
    default=1e-6,
    show_default=True,
    help="Tolerance of the loads, relative to the load scale.",
)


def trace_options(command: Any) -> Any:
    """The options that say how a trace is read; what is not given is taken from its header."""
    options = [
        click.option(
            "--column", help="Column of the measured motion; else the one whose header names its unit."
        ),
        click.option(
            "--unit", help='Unit of that column, e.g. rpm or mm/s; for counts the travel of one: "5e-8 m".'
        ),
        click.option("--kind", help="Its quantity: position, counts, velocity (of the cart) or motor_speed."),
        click.option("--time", help="Column of the time stamps; with --rate, of a counter of cycles."),
        click.option("--rate", type=NumberOrText(), help="Samples per second, instead of a time column."),
        click.option(
            "--clock", help="Kind of the time stamps: uniform, ticks, jitter or on_change; else detected."
        ),
        click.option(
            "--quantum", type=NumberOrText(), help='Smallest step of the value, e.g. "5e-8 m"; else detected.'
        ),
        click.option(
            "--counter-bits",
            type=click.IntRange(0, 62),
            help="Width of a counter that wraps around, 0 for none; else detected.",
        ),
        click.option(
            "--hold",
            type=POSITIVE,
            help="Rows that repeat each value, in a log faster than its signal; 1 uses every row; else detected.",
        ),
        click.option(
            "--date-order",
            help="Order of dates such as 03/04/2024: dmy or mdy; else detected from days above 12.",
        ),
        click.option(
            "--max-speed", type=NumberOrText(), help='Highest speed that the axis can reach, e.g. "2 m/s".'
        ),
        click.option(
            "--allow-gaps", is_flag=True, default=None, help="Accept time steps far above the usual one."
        ),
        click.option(
            "--repair",
            help="Damage to leave out: all, or some of empty,doubled,clock,outliers,stuck; else such a trace is "
            "refused.",
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
            help="How acceleration is estimated: auto, with its 95 % band; for comparison spline, savitzky_golay or "
            "differences.",
        ),
        click.option("--window", type=POSITIVE, help="Window of savitzky_golay in seconds."),
    ]
    for option in reversed(options):
        command = option(command)
    return command
