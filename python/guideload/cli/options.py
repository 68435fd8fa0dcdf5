"""Arguments and options that several commands share."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Literal, get_args, get_type_hints

import click
from click.core import ParameterSource

from guideload.base.errors import ConfigError, ValueRefused
from guideload.base.methods import CHOICES as METHOD_CHOICES
from guideload.base.number_text import capitalised
from guideload.base.units import quantity
from guideload.cli.outputs import PICTURE_ENDINGS
from guideload.traces.options import ReadingOptions, SmoothingOptions

InputFile = click.Path(path_type=Path)
FilePath = click.Path(path_type=Path, dir_okay=False)
# Of files with a schema.
FileKind = Literal["machine", "study", "catalogue", "motion", "duty", "monitor", "identify"]


class Folder(click.Path):
    """A folder to write, or a picture if allowed; another name that ends like that of a file is refused."""

    def __init__(self, or_picture: bool = False) -> None:
        super().__init__(path_type=Path, file_okay=or_picture)
        self.allowed = PICTURE_ENDINGS if or_picture else ()

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        path = Path(str(super().convert(value, param, ctx)))
        ending = path.suffix.lower()
        if ending in FILE_ENDINGS and ending not in self.allowed and not path.is_dir():
            or_picture = f" or a picture ({', '.join(self.allowed)})" if self.allowed else ""
            self.fail(f"expected a folder{or_picture}, got {path}, which names a file", param, ctx)
        return path


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


class Quantity(NumberOrText):
    """A number in the SI unit `unit`, or text with any unit, as a number in `unit`."""

    def __init__(self, unit: str) -> None:
        self.unit = unit

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        try:
            return quantity(super().convert(value, param, ctx), self.unit)
        except ValueRefused as refused:
            self.fail(str(refused), param, ctx)


class Vector(click.ParamType[tuple[float, ...]]):
    """Three numbers, separated by commas, each with or without a unit."""

    name = "x,y,z"

    def __init__(self, unit: str) -> None:
        self.component = Quantity(unit)

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, ...]:
        if isinstance(value, tuple):
            return value
        parts = str(value).split(",")
        if len(parts) != 3:
            self.fail(f'expected three numbers such as "0,0.3,0", got {value!r}', param, ctx)
        return tuple(self.component.convert(part, param, ctx) for part in parts)


FILE_ENDINGS = (*PICTURE_ENDINGS, ".html", ".txt", ".nc", ".csv", ".parquet", ".json", ".toml")
POSITIVE = Positive()
MOVES = "guideload.moves"  # key of the texts of --move in the context
# click types of the options for traces, by the types of their values; other options are text.
OPTION_TYPES: dict[frozenset[type], click.ParamType[Any]] = {
    frozenset((float, str)): NumberOrText(),
    frozenset((int,)): click.IntRange(0, 62),
    frozenset((float,)): POSITIVE,
}

RULES = ("sum", "thk", "hiwin", "hiwin_mg", "iko", "rexroth", "thomson")
machine_argument = click.argument("machine_file", metavar="MACHINE.TOML", type=InputFile)
trace_file_argument = click.argument("trace_file", metavar="TRACE", type=InputFile)
picture_option = click.option(
    "-o",
    "--output",
    type=FilePath,
    help=f"Picture to write ({', '.join(ending[1:] for ending in PICTURE_ENDINGS)}).",
)
overwrite_picture_option = click.option("--overwrite", is_flag=True, help="Replace files that exist.")
overwrite_option = click.option(
    "--overwrite", is_flag=True, help="Replace the files of an earlier run in the folder."
)
no_pictures_option = click.option("--no-pictures", is_flag=True, help="Write the numbers only.")
folder_option = partial(click.option, "-o", "--output", type=Folder(), help="Folder to write.")
report_option = click.option(
    "--report",
    type=FilePath,
    help="HTML report to write: one file that opens in any browser and prints on A4.",
)
free_option = click.option(
    "--free",
    help="Directions in which the body may move on the guides (degrees of freedom of L), e.g. y,z,rx,ry,rz, instead of "
    "the machine file's.",
)
rider_option = click.option(
    "--rider",
    "riders",
    multiple=True,
    metavar="NAME=FILE",
    help="Trace or motion file of the travel of a rider, instead of that of the machine file; repeatable.",
)
method_option = click.option(
    "--method",
    type=click.Choice(METHOD_CHOICES),
    default="auto",
    show_default=True,
    help="Integration method; auto is the cheapest that the machine allows.",
)
start_option = click.option(
    "--start",
    type=click.Choice(("auto", "rest", "quasi-static")),
    default="auto",
    show_default=True,
    help="State in which the run starts; auto is quasi-static, the static equilibrium under the "
    "first acceleration and force, for a record that begins under way, else rest.",
)
rtol_option = click.option(
    "--rtol",
    type=POSITIVE,
    default=1e-6,
    show_default=True,
    help="Tolerance of the loads, relative to the load scale.",
)


def refuse_tolerance_of_exact(method: str) -> None:
    """Raise UsageError if the command line gives --rtol to the method that has no tolerance."""
    given = click.get_current_context().get_parameter_source("rtol")
    if method == "exact" and given is not ParameterSource.DEFAULT:
        raise click.UsageError("--rtol needs --method exponential, rk45 or implicit; exact has no tolerance")


def together(*given: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Decorator: several options, in the order in which the help shows them."""

    def decorate(command: Any) -> Any:
        for option in reversed(given):
            command = option(command)
        return command

    return decorate


# What life and static safety must reach; `inputs.requirements` takes their values.
requirement_options = together(
    click.option(
        "--rule", type=click.Choice(RULES), help="Rule of the equivalent load, instead of the file's."
    ),
    click.option(
        "--reliability", type=POSITIVE, help="Probability with which the life is reached, e.g. 0.95."
    ),
    click.option("--life", help='Required life, e.g. "20000 km", "10000 h" or "10 years".'),
    click.option("--safety", type=POSITIVE, help="Required static safety, e.g. 3."),
)
# Process forces; `inputs.read_motion` takes their values.
force_options = together(
    click.option(
        "--forces",
        type=InputFile,
        help="Process forces on the body: a table with columns such as Fx [N] and Mz [N m]; without it, "
        "--forces-at takes columns of TRACE.",
    ),
    click.option(
        "--forces-at", metavar="POINT", help="Point of the machine file ([[points]]) where the forces act."
    ),
    click.option(
        "--forces-axes",
        type=click.Choice(["machine", "point"]),
        help="Axes of the forces: of the machine, or the point's own.  [default: machine]",
    ),
    click.option(
        "--forces-start",
        type=Quantity("s"),
        help='Time in the motion at which the forces\' time stamps are 0, e.g. "0.35 s".',
    ),
)


def _moves_or_file(ctx: click.Context, param: click.Parameter, given: Any) -> Any:
    """The files given, or the moves of --move; UsageError for both in one place, or neither where one is needed."""
    texts = ctx.meta.get(MOVES)
    several = param.nargs != 1
    if texts and (not given or several):
        from guideload.motion.moves import Moves

        try:
            moves = Moves.from_texts(texts)
        except ConfigError as error:
            raise ConfigError(error.problems, "--move", error.others) from None
        return (*given, moves) if several else moves
    if texts:
        raise click.UsageError(f"expected a TRACE or --move, got both: {given}")
    if not given and param.metavar == "TRACE":
        raise click.UsageError("Missing argument 'TRACE': a trace, a motion file (.toml), or --move")
    return given


def motion_argument(name: str, metavar: str, nargs: int = 1) -> Callable[[Any], Any]:
    """Decorator: an argument for a trace or a motion file, the option --move, which stands for one, and forces."""

    move = click.option(
        "--move",
        multiple=True,
        is_eager=True,
        expose_value=False,
        callback=lambda ctx, _, texts: ctx.meta.update({MOVES: texts}),
        help='Planned move in place of TRACE, e.g. "distance=1.2 m, speed=2 m/s, acceleration=5 m/s^2, '
        'jerk=200 m/s^3, dwell=0.5 s"; repeatable.',
    )
    argument = click.argument(
        name, metavar=metavar, type=InputFile, nargs=nargs, required=False, callback=_moves_or_file
    )
    return together(argument, move, force_options)


trace_argument = motion_argument("trace_file", "TRACE")
optional_trace_argument = motion_argument("trace_file", "[TRACE]")


def trace_options(command: Any) -> Any:
    """Add the options of `traces.options`, which control reading and smoothing of a trace, to a command."""
    hints = get_type_hints(ReadingOptions, include_extras=True)
    hints |= get_type_hints(SmoothingOptions, include_extras=True)
    for name, hint in reversed(hints.items()):
        types, (text,) = frozenset(get_args(hint.__origin__)) - {type(None)}, hint.__metadata__
        declaration: dict[str, Any] = {"help": f"{capitalised(text)}."}
        if name == "cross_check":
            declaration = {"help": f"Do not {text}.", "flag_value": False, "default": None}
        elif bool in types:
            declaration |= {"is_flag": True, "default": None}
        elif name != "unit":  # a number is text here: the unit of a count
            declaration["type"] = OPTION_TYPES.get(types)
        command = click.option(option_name(name), name, **declaration)(command)
    return command


def option_name(name: str) -> str:
    """The option of the command line that sets a keyword of `traces.options`."""
    return "--no-cross-check" if name == "cross_check" else f"--{name.replace('_', '-')}"
