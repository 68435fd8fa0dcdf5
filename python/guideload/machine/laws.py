"""Elastic laws as a machine file gives them: the types of their keys, what excludes what, the core's law.

A carriage has these keys once for y and once for z (`stiffness_y`, `curve_z`), an extra link once, without a
suffix. A deflection is that of the body along the direction, counted from where the carriage or link carries
nothing. Each key is checked against those that stand before it in its part: curve, stiffness, preload,
clearance, then what is one per part.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, PlainValidator, ValidationInfo, model_validator
from pydantic_core import PydanticKnownError

from guideload._core import Law
from guideload.base.config import ConfigModel, entries, number
from guideload.base.errors import ValueRefused

ModelLevel = Literal["linear", "piecewise linear", "smooth nonlinear"]
# Of the force of one row over its deflection: Hertz' contact at a point; at a line, as rolling bearings count it.
EXPONENT = {"ball": 3.0 / 2.0, "roller": 10.0 / 9.0}
NO_EXACT = "preloaded contacts have no exact solution"
MOST_POINTS = 16  # of a curve in the core
# Of the largest force of a curve: what the arithmetic between two points leaves of zero.
ROUNDING = 1e-12


# ---- stiffness


class Sides(ConfigModel):
    """A stiffness that differs between the two directions of motion."""

    positive: Annotated[float, PlainValidator(partial(number, unit="N/m", least=0.0))] = Field(
        description='stiffness when the body moves in the positive direction, e.g. "300 N/um"'
    )
    negative: Annotated[float, PlainValidator(partial(number, unit="N/m", least=0.0))] = Field(
        description='stiffness when the body moves in the negative direction, e.g. "500 N/um"'
    )

    @model_validator(mode="after")
    def _one_holds(self) -> Sides:
        if self.positive == self.negative == 0.0:
            raise ValueRefused("at least one side > 0 N/m", self.model_dump())
        return self


def _stiffness(value: object) -> float | Sides:
    """One stiffness, or the table of both sides. Raises ValueRefused, or the table's own ValidationError."""
    if isinstance(value, dict | Sides):
        return Sides.model_validate(value)
    return number(value, "N/m", above=0.0)


def _one_of_two(value: float | Sides | None, info: ValidationInfo) -> float | Sides | None:
    """Exactly one of stiffness and curve."""
    curve = _beside(info, "curve")
    if curve not in info.data:
        return value  # refused already
    if value is None and info.data[curve] is None:
        raise PydanticKnownError("missing")
    if value is not None and info.data[curve] is not None:
        raise ValueRefused(
            f"no {info.field_name} beside {curve}",
            value,
            "the curve is the whole law: keep one of them",
        )
    return value


# ---- curve


def _through_zero(points: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    """A law that rises through [0, 0], or its half for positive deflections, which begins there."""
    half = points[:1] == ((0.0, 0.0),)
    most = (MOST_POINTS + 1) // 2 if half else MOST_POINTS
    if not 2 <= len(points) <= most:
        mirrored = "; one that begins at [0, 0] is mirrored, which doubles its points" if half else ""
        raise ValueRefused(
            f"2 to {most} points [deflection, force]", points, f"these are {len(points)}{mirrored}"
        )
    deflection, force = np.array(points).T
    for values, unit, words, falls in (
        (deflection, "m", "deflections in ascending order, each once", np.diff(deflection) <= 0.0),
        (force, "N", "forces that never fall as the deflection grows", np.diff(force) < 0.0),
    ):
        if falls.any():
            i = int(falls.argmax())
            found = f"[{i}] and [{i + 1}] have {values[i]:g} and {values[i + 1]:g} {unit}"
            raise ValueRefused(words, points, found)
    if deflection[0] > 0.0 or deflection[-1] <= 0.0:
        way_out = "add the points of the other direction; a curve that begins at [0, 0] holds for both"
        reach = f"it reaches from {deflection[0]:g} to {deflection[-1]:g} m"
        raise ValueRefused("points on both sides of 0 m", points, f"{reach}: {way_out}")
    at_zero = float(np.interp(0.0, deflection, force))
    if abs(at_zero) > ROUNDING * np.abs(force).max():
        raise ValueRefused(
            "a curve through [0, 0]",
            points,
            f"its force at 0 m is {at_zero:g} N: count deflections from no load",
        )
    if force[0] == force[-1]:
        raise ValueRefused("forces that rise somewhere", points, "this curve never resists")
    return points


def _as_list(value: object) -> object:
    return value.tolist() if isinstance(value, np.ndarray) else value


# ---- preload, clearance, and what is one per part


def _preloaded_alone(value: float | None, info: ValidationInfo) -> float | None:
    """A preload goes with one stiffness, and with no curve."""
    if value is None:
        return value
    stiffness, curve = _beside(info, "stiffness"), _beside(info, "curve")
    if info.data.get(curve) is not None:
        raise ValueRefused(
            f"no {info.field_name} beside {curve}", value, "a curve holds its preload: keep one of them"
        )
    if isinstance(info.data.get(stiffness), Sides):
        raise ValueRefused(
            f"no {info.field_name} beside a {stiffness} that differs by side",
            value,
            f"give {stiffness} as one value, the catalogue's at no load, or the whole law as {curve}",
        )
    return value


def _clear_alone(value: float, info: ValidationInfo) -> float:
    """A clearance goes with a stiffness of either form, and with neither preload nor curve."""
    preload, curve = _beside(info, "preload"), _beside(info, "curve")
    if value > 0.0 and info.data.get(preload) is not None:
        raise ValueRefused(
            f"no {info.field_name} beside {preload}", value, "preload leaves no play: keep one of them"
        )
    if value > 0.0 and info.data.get(curve) is not None:
        raise ValueRefused(
            f"no {info.field_name} beside {curve}", value, "draw the play into the curve, as points of 0 N"
        )
    return value


def with_preload(value: str | None, info: ValidationInfo, keys: tuple[str, ...]) -> str | None:
    """What rolls, where one of the preloads `keys` is given, and only there."""
    given = [info.data.get(key) is not None for key in keys]
    if value is None and any(given):
        raise PydanticKnownError("missing")
    if value is not None and not any(given) and info.data.keys() >= set(keys):
        way_out = f"add {' or '.join(keys)}, or leave {info.field_name} out"
        raise ValueRefused(f"no {info.field_name} without a preload", value, way_out)
    return value


def with_clearance(value: bool, info: ValidationInfo, keys: tuple[str, ...]) -> bool:
    """Damping in contact only, where one of the clearances `keys` is given."""
    if value and info.data.keys() >= set(keys) and not any(info.data[key] for key in keys):
        way_out = f"add {' or '.join(keys)}, or leave {info.field_name} out"
        raise ValueRefused("false without a clearance", value, way_out)
    return value


def _beside(info: ValidationInfo, key: str) -> str:
    """The name of `key` for the direction of the field that is checked: "curve_y" beside "stiffness_y"."""
    _, underscore, axis = (info.field_name or "").partition("_")
    return f"{key}{underscore}{axis}"


CurvePoint = Annotated[
    tuple[
        Annotated[float, PlainValidator(partial(number, unit="m"))],
        Annotated[float, PlainValidator(partial(number, unit="N"))],
    ],
    BeforeValidator(partial(entries, names=("deflection", "force"))),
]
Curve = Annotated[tuple[CurvePoint, ...], BeforeValidator(_as_list), AfterValidator(_through_zero)]
Stiffness = Annotated[
    Annotated[float | Sides, BeforeValidator(_stiffness)] | None, AfterValidator(_one_of_two)
]
Preload = Annotated[
    Annotated[float, PlainValidator(partial(number, unit="N", above=0.0))] | None,
    AfterValidator(_preloaded_alone),
]
Clearance = Annotated[
    float, PlainValidator(partial(number, unit="m", least=0.0)), AfterValidator(_clear_alone)
]
Rolling = Literal["ball", "roller"]


# ---- the law


def law_of(
    stiffness: float | Sides | None,
    clearance: float,
    preload: float | None,
    rolling: Rolling | None,
    curve: tuple[tuple[float, float], ...] | None,
) -> Law:
    """The core's law of checked keys; the core makes it a linear one where it amounts to that. Raises SceneError.

    stiffness: N/m. clearance: m to either side. preload: N. curve: (deflection m, force N), mirrored where it
    begins at [0, 0].
    """
    if curve is not None:
        points = np.array(curve)
        return Law.curve(np.vstack([-points[:0:-1], points]) if curve[0] == (0.0, 0.0) else points)
    assert stiffness is not None
    if isinstance(stiffness, Sides):
        return Law.sided(stiffness.positive, stiffness.negative, clearance)
    if preload is not None:
        assert rolling is not None
        return Law.preloaded(stiffness, preload, EXPONENT[rolling])
    return Law.sided(stiffness, stiffness, clearance)


def model_level_of(laws: Iterable[Law]) -> ModelLevel:
    """The lowest rung of the model that has all these laws."""
    kinds = {law.kind for law in laws}
    if "preloaded" in kinds:
        return "smooth nonlinear"
    return "piecewise linear" if kinds & {"sided", "curve"} else "linear"
