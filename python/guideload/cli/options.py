"""Arguments and options that several commands share."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from typing import Any, get_args, get_type_hints

import click

from guideload.cli.outputs import PICTURE_ENDINGS
from guideload.traces.options import ReadingOptions, SmoothingOptions

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
    """A number in SI units, or text with a unit, which the library converts."""

    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float | str:
        try:
            return float(value)
        except ValueError:
            return str(value)


POSITIVE = Positive()
# click types of the options for traces, by the types of their values; other options are text.
OPTION_TYPES: dict[frozenset[type], click.ParamType[Any]] = {
    frozenset((float, str)): NumberOrText(),
    frozenset((int,)): click.IntRange(0, 62),
    frozenset((float,)): POSITIVE,
}

machine_argument = click.argument("machine_file", metavar="MACHINE.TOML", type=InputFile)
trace_argument = click.argument("trace_file", metavar="TRACE", type=InputFile)
optional_trace_argument = click.argument("trace_file", metavar="[TRACE]", type=InputFile, required=False)
picture_option = click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    help=f"Picture to write ({', '.join(ending[1:] for ending in PICTURE_ENDINGS)}).",
)
overwrite_picture_option = click.option("--overwrite", is_flag=True, help="Replace files that exist.")
overwrite_option = click.option(
    "--overwrite", is_flag=True, help="Replace the files of an earlier run in the folder."
)
no_pictures_option = click.option("--no-pictures", is_flag=True, help="Write the numbers only.")
folder_option = partial(click.option, "-o", "--output", type=Folder, help="Folder to write.")
report_option = click.option(
    "--report",
    type=click.Path(path_type=Path, dir_okay=False),
    help="HTML report to write: one file that opens in any browser and prints on A4.",
)
free_option = click.option("--free", help="Free dofs of L, e.g. y,z,rx,ry,rz, instead of the machine file's.")
rtol_option = click.option(
    "--rtol",
    type=POSITIVE,
    default=1e-6,
    show_default=True,
    help="Tolerance of the loads, relative to the load scale.",
)


def trace_options(command: Any) -> Any:
    """Add the options of `traces.options`, which control reading and smoothing of a trace, to a command."""
    hints = get_type_hints(ReadingOptions, include_extras=True)
    hints |= get_type_hints(SmoothingOptions, include_extras=True)
    for name, hint in reversed(hints.items()):
        types, (text,) = frozenset(get_args(hint.__origin__)) - {type(None)}, hint.__metadata__
        declaration: dict[str, Any] = {"help": f"{text[0].upper()}{text[1:]}."}
        if name == "cross_check":
            declaration = {"help": f"Do not {text}.", "flag_value": False, "default": None}
        elif bool in types:
            declaration |= {"is_flag": True, "default": None}
        elif name != "unit":  # a number is text here: the unit of a count
            declaration["type"] = OPTION_TYPES.get(types)
        option = "--no-cross-check" if name == "cross_check" else f"--{name.replace('_', '-')}"
        command = click.option(option, name, **declaration)(command)
    return command
