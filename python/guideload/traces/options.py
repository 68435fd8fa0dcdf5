"""The options of reading a trace, described once: for `read_trace`, the command line and a study's table [reading]."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from inspect import Parameter, signature
from typing import Annotated, Any, Literal, TypedDict, TypeVar, cast, get_type_hints

Number = float | str  # in SI, or as text with its unit
Function = TypeVar("Function", bound=Callable[..., Any])


class ReadingOptions(TypedDict, total=False):
    """Keywords of `read_trace`, each with its type and a short description; None counts as not given."""

    column: Annotated[str | None, "column of the measured motion; else the one whose header gives its unit"]
    unit: Annotated[Number | None, 'unit of that column, e.g. rpm; for counts the travel per count: "5e-8 m"']
    kind: Annotated[str | None, "kind of that column: position, counts, velocity (of the cart), motor_speed"]
    time: Annotated[str | None, "column of the time stamps; with a rate, of a counter of cycles"]
    time_unit: Annotated[str | None, "unit of the time column, e.g. ms; else that of its header, or s"]
    rate: Annotated[Number | None, "samples per second, in place of a time column"]
    clock: Annotated[str | None, "time stamps are uniform, ticks, jitter or on_change; else detected"]
    quantum: Annotated[Number | None, 'smallest change of the value, e.g. "5e-8 m"; else detected']
    counter_bits: Annotated[int | None, "bits of a counter that wraps around, 0 for none; else detected"]
    hold: Annotated[float | None, "number of rows with each value, 1 to use all rows; else detected"]
    date_order: Annotated[str | None, "order in dates such as 03/04/2024: dmy or mdy; else by days above 12"]
    max_speed: Annotated[Number | None, 'greatest speed that the axis can have, e.g. "2 m/s"']
    allow_gaps: Annotated[bool | None, "accept steps in time far above the usual one"]
    repair: Annotated[
        str | Iterable[str] | None,
        "damaged rows to leave out: all, or some of empty,doubled,clock,outliers,stuck; other damage is refused",
    ]
    cross_check: Annotated[bool | None, "compare position with velocity where the table has both"]


class SmoothingOptions(TypedDict, total=False):
    """Keywords of `motion_from_trace` and `Inspection.of`, each with its type and a short description."""

    smoothing: Annotated[
        Literal["auto", "savitzky_golay", "differences"],
        "from samples to acceleration: auto, with a 95 % band; for comparison savitzky_golay or differences",
    ]
    window: Annotated[float | None, "window of savitzky_golay in seconds"]


def with_reading_options(function: Function) -> Function:
    """Decorator: list the `**options` of a function one by one in its signature, as `help` shows it."""
    plain = signature(function)
    listed = [
        Parameter(name, Parameter.KEYWORD_ONLY, default=None, annotation=hint)
        for name, hint in get_type_hints(ReadingOptions).items()
    ]
    positional = [one for one in plain.parameters.values() if one.kind is not Parameter.VAR_KEYWORD]
    cast(Any, function).__signature__ = plain.replace(parameters=[*positional, *listed])
    return function
