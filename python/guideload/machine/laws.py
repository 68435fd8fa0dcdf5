"""Elastic laws of carriages and links: the keys of a machine file, their checks, and the core's law.

A carriage has these keys once for y and once for z (`stiffness_y`, `curve_z`), an extra link once, without a
suffix. A deflection is that of the body along the direction, counted from the position without load. Each key is
checked against the keys before it in its model: curve, stiffness, preload, clearance, rolling, damping_in_contact.
"""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any, Literal, TypeVar

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, PlainValidator, ValidationInfo, model_validator
from pydantic_core import PydanticKnownError

from guideload._core import Law
from guideload.base.config import ConfigModel, entries, number
from guideload.base.errors import ValueRefused

Value = TypeVar("Value")
ModelLevel = Literal["linear", "piecewise linear", "smooth nonlinear"]
# Exponent of force over deflection of one row: Hertz contact at a point; at a line, by the rolling bearing standards.
EXPONENT = {"ball": 3.0 / 2.0, "roller": 10.0 / 9.0}
NO_EXACT = "preloaded contacts have no exact solution"
MOST_POINTS = 16  # of a curve in the core
ROUNDING = 1e-12  # of the largest force of a curve: rounding of the force interpolated at 0 m
EXCLUDED: dict[str, dict[str, str]] = {  # keys that each key excludes, and the way out
    "stiffness": {"curve": "the curve is the whole law: keep one of them"},
    "preload": {"curve": "a curve holds its preload: keep one of them"},
    "clearance": {
        "preload": "preload leaves no clearance: keep one of them",
        "curve": "draw the clearance into the curve, as points of 0 N",
    },
}


# ---- stiffness


class Sides(ConfigModel):
    """A stiffness that differs between the two directions."""

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
    """One stiffness, or one for each direction. Raises ValueRefused, or the ValidationError of `Sides`."""
    if isinstance(value, dict | Sides):
        return Sides.model_validate(value)
    return number(value, "N/m", above=0.0)


def _stiffness_or_curve(value: float | Sides | None, info: ValidationInfo) -> float | Sides | None:
    curve = f"curve{_suffix(info)}"
    if value is None and curve in info.data and info.data[curve] is None:
        raise PydanticKnownError("missing")
    return value


# ---- curve


def _through_zero(points: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    """Check that the law rises through [0, 0], or begins there as the half for positive deflections."""
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


# ---- keys that exclude or need each other


def _suffix(info: ValidationInfo) -> str:
    """ "_y" or "_z" of a carriage's key, "" of a link's."""
    _, underscore, axis = (info.field_name or "").partition("_")
    return underscore + axis


def _alone(value: Value, info: ValidationInfo) -> Value:
    """Refuse a value if a key that it excludes has one as well."""
    suffix = _suffix(info)
    for key, way_out in EXCLUDED[(info.field_name or "").removesuffix(suffix)].items():
        if value and info.data.get(key + suffix) is not None:
            raise ValueRefused(f"no {info.field_name} beside {key}{suffix}", value, way_out)
    return value


def _with_one_stiffness(value: float | None, info: ValidationInfo) -> float | None:
    """Refuse a preload beside a stiffness that differs by side."""
    suffix = _suffix(info)
    if value is not None and isinstance(info.data.get(f"stiffness{suffix}"), Sides):
        raise ValueRefused(
            f"no {info.field_name} beside a stiffness{suffix} that differs by side",
            value,
            f"write stiffness{suffix} as one value, the catalogue's at no load, or the whole law as curve{suffix}",
        )
    return value


def with_preload(value: str | None, info: ValidationInfo, keys: tuple[str, ...]) -> str | None:
    """Require the rolling element if one of the preloads `keys` has a value, and refuse it otherwise."""
    if value is None and any(info.data.get(key) is not None for key in keys):
        raise PydanticKnownError("missing")
    return _needing(value, info, keys, f"no {info.field_name} without a preload")


def with_clearance(value: bool, info: ValidationInfo, keys: tuple[str, ...]) -> bool:
    """Refuse damping in contact only, unless one of the clearances `keys` is above 0."""
    return _needing(value, info, keys, "false without a clearance")


def _needing(value: Value, info: ValidationInfo, keys: tuple[str, ...], expected: str) -> Value:
    """Refuse a value if none of `keys` has one; a key that was refused itself counts as one."""
    if value and all(key in info.data and not info.data[key] for key in keys):
        way_out = f"add {' or '.join(keys)}, or leave {info.field_name} out"
        raise ValueRefused(expected, value, way_out)
    return value


CurvePoint = Annotated[
    tuple[
        Annotated[float, PlainValidator(partial(number, unit="m"))],
        Annotated[float, PlainValidator(partial(number, unit="N"))],
    ],
    BeforeValidator(partial(entries, names=("deflection", "force"))),
]
Curve = Annotated[tuple[CurvePoint, ...], BeforeValidator(_as_list), AfterValidator(_through_zero)]
Stiffness = Annotated[
    Annotated[float | Sides, BeforeValidator(_stiffness)] | None,
    AfterValidator(_alone),
    AfterValidator(_stiffness_or_curve),
]
Preload = Annotated[
    Annotated[float, PlainValidator(partial(number, unit="N", above=0.0))] | None,
    AfterValidator(_alone),
    AfterValidator(_with_one_stiffness),
]
Clearance = Annotated[float, PlainValidator(partial(number, unit="m", least=0.0)), AfterValidator(_alone)]
Rolling = Literal["ball", "roller"]


# ---- fields; where: "along z", suffix: "_z"


def curve_field(where: str, suffix: str = "") -> Any:
    text = f"points [deflection, force] {where} instead of stiffness{suffix}, e.g. "
    example = '[["0 um", "0 N"], ["20 um", "9 kN"]]; from [0, 0] on they hold for both directions'
    return Field(default=None, description=text + example)


def stiffness_field(where: str, suffix: str = "") -> Any:
    text = f'stiffness {where}, e.g. "350 N/um" (or curve{suffix} instead)'
    return Field(default=None, validate_default=True, description=text)


def preload_field(where: str, suffix: str = "") -> Any:
    text = (
        f'preload {where}, e.g. "2.09 kN", beside stiffness{suffix} at no load; leave it out if there is none'
    )
    return Field(default=None, description=text)


def clearance_field(where: str) -> Any:
    return Field(default=0.0, description=f'clearance {where} to either side, e.g. "5 um"')


# ---- the law


def law_of(
    stiffness: float | Sides | None,
    clearance: float,
    preload: float | None,
    rolling: Rolling | None,
    curve: tuple[tuple[float, float], ...] | None,
) -> Law:
    """The core's law of checked keys, a linear one where the keys amount to that. Raises SceneError.

    stiffness: N/m. clearance: m to either side. preload: N. curve: points (deflection [m], force [N]), mirrored if
    it begins at [0, 0].
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
