"""What the commands share: kinds of options, reading a machine and a trace, telling and printing."""

from __future__ import annotations

import gc
import math
import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args, get_type_hints

import click

from guideload.base.errors import SceneError
from guideload.cli.outputs import Refused
from guideload.traces.options import ReadingOptions, SmoothingOptions

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


# Types of the options of reading, by the types of their values; others are text.
OPTION_TYPES: dict[frozenset[type], click.ParamType[Any]] = {
    frozenset((float, str)): NumberOrText(),
    frozenset((int,)): click.IntRange(0, 62),
    frozenset((float,)): POSITIVE,
}


def trace_options(command: Any) -> Any:
    """The options that say how a trace is read and smoothed (see `traces.options`)."""
    hints = get_type_hints(ReadingOptions, include_extras=True)
    hints |= get_type_hints(SmoothingOptions, include_extras=True)
    for name, hint in reversed(hints.items()):
        types, (text,) = get_args(hint.__origin__), hint.__metadata__
        option = f"--{name.replace('_', '-')}"
        text = f"{text[0].upper()}{text[1:]}."
        if name == "cross_check":
            text = f"Do not {hint.__metadata__[0]}."
            made = click.option("--no-cross-check", name, flag_value=False, default=None, help=text)
        elif bool in types:
            made = click.option(option, is_flag=True, default=None, help=text)
        else:
            is_text = name == "unit"  # a bare number would be metres per count
            kind = None if is_text else OPTION_TYPES.get(frozenset(types) - {type(None)})
            made = click.option(option, type=kind, help=text)
        command = made(command)
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
    smoothing = {name: given.pop(name) for name in SmoothingOptions.__annotations__ if name in given}
    return given, smoothing


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
