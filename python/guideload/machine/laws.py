"""Elastic laws of carriages and links: the keys of a machine file, their checks, and the core's law.

A carriage has each key for y and for z (`stiffness_y`, `curve_z`); an extra link has it without suffix. Deflection is
the displacement of the body along the direction, from the unloaded position. Each key is checked against the keys
before it in its model, in the order curve, stiffness, preload, clearance, rolling, damping_in_contact.
"""

from __future__ import annotations

from functools import lru_cache, partial
from typing import Annotated, Any, Literal, TypeVar, get_args

import numpy as np
from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    StrictBool,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydantic_core import PydanticKnownError

from guideload._core import Law
from guideload.base.config import ConfigModel, in_range, optional
from guideload.base.errors import ValueRefused
from guideload.base.ranges import CLEARANCE, COMPLIANCE, PRELOAD, STIFFNESS
from guideload.catalogue.curve import CurvePoint, CurvePoints, through_zero
from guideload.catalogue.preload_class import stiffness_or
from guideload.catalogue.stiffness import CONTACT_EXPONENT

Value = TypeVar("Value")
ModelLevel = Literal["linear", "piecewise linear", "smooth nonlinear"]
LEVELS: tuple[ModelLevel, ...] = get_args(ModelLevel)
LEVEL_OF_KIND = {"linear": 0, "sided": 1, "curve": 1, "preloaded": 2}  # indices into LEVELS
NO_EXACT = "preloaded contacts have no exact solution"
EXCLUDED: dict[str, dict[str, str]] = {  # {key: {key that excludes it: way out}}
    "stiffness": {"curve": "the curve is the whole law: keep one of them"},
    "preload": {"curve": "a curve holds its preload: keep one of them"},
    "clearance": {
        "preload": "preload leaves no clearance: keep one of them",
        "curve": "draw the clearance into the curve, as points of 0 N",
    },
}


# ---- stiffness


class Sides(ConfigModel):
    """A stiffness for positive and another one for negative deflections."""

    positive: Annotated[float, in_range(STIFFNESS, least=0.0)] = Field(
        description='stiffness when the body moves in the positive direction, e.g. "300 N/um"'
    )
    negative: Annotated[float, in_range(STIFFNESS, least=0.0)] = Field(
        description='stiffness when the body moves in the negative direction, e.g. "500 N/um"'
    )

    @model_validator(mode="after")
    def _one_positive(self) -> Sides:
        if self.positive == self.negative == 0.0:
            raise ValueRefused("at least one side > 0 N/m", self.model_dump())
        return self


def _as_list(value: object) -> object:
    return value.tolist() if isinstance(value, np.ndarray) else value


# ---- types


Curve = Annotated[tuple[CurvePoint, ...], BeforeValidator(_as_list), AfterValidator(through_zero)]
Stiffness = Annotated[float | Sides, BeforeValidator(partial(stiffness_or, Sides))] | None
Preload = Annotated[float, in_range(PRELOAD, above=0.0)] | None
Clearance = Annotated[float, in_range(CLEARANCE, least=0.0)]
Compliance = Annotated[float, in_range(COMPLIANCE, least=0.0)]
Rolling = Annotated[
    Literal["ball", "roller"] | None,
    Field(validate_default=True, description='rolling element of a preloaded contact: "ball" or "roller"'),
]
DampingInContact = Annotated[
    StrictBool, Field(description="whether the damping acts only outside the clearance")
]


# ---- fields

DESCRIPTIONS = {
    "curve": "points [deflection, force] {where} instead of stiffness{suffix}, e.g. "
    '[["0 um", "0 N"], ["20 um", "9 kN"]]; from [0, 0] on they hold for both directions',
    "stiffness": 'stiffness {where}, e.g. "350 N/um" (or curve{suffix} instead)',
    "preload": 'preload {where}, e.g. "2.09 kN", beside stiffness{suffix} at no load; leave it out if there is none',
    "clearance": 'clearance {where} to either side, e.g. "5 um"',
    "compliance": "compliance {where} of what is in series with the carriage, as bolted joint and table, "
    'e.g. "2 um/kN"',
}


def law_field(key: str, where: str, suffix: str = "") -> Any:
    """The field of a key. where: direction in words, as "along z"; suffix: "_y" or "_z", none for an extra link."""
    default = 0.0 if key in ("clearance", "compliance") else None
    text = DESCRIPTIONS[key].format(where=where, suffix=suffix)
    return optional(text, default, validate_default=key == "stiffness")


# ---- the model


class ElasticModel(ConfigModel):
    """Base of carriages and links: checks which keys of an elastic law are combined, and builds the law."""

    @field_validator(*(key + suffix for key in EXCLUDED for suffix in ("", "_y", "_z")), check_fields=False)
    @classmethod
    def _without_excluded(cls, value: Value, info: ValidationInfo) -> Value:
        """Require stiffness or curve; refuse a value together with a key that it excludes."""
        name = info.field_name or ""
        key, underscore, axis = name.partition("_")
        suffix = underscore + axis
        if key == "stiffness" and value is None and info.data.get(f"curve{suffix}", "refused") is None:
            raise PydanticKnownError("missing")
        for other, way_out in EXCLUDED[key].items():
            if value and info.data.get(other + suffix) is not None:
                raise ValueRefused(f"no {name} beside {other}{suffix}", value, way_out)
        if key == "preload" and value and isinstance(info.data.get(f"stiffness{suffix}"), Sides):
            stiffness, curve = f"stiffness{suffix}", f"curve{suffix}"
            way_out = (
                f"write {stiffness} as one value, the catalogue's at no load, or the whole law as {curve}"
            )
            raise ValueRefused(f"no {name} beside a {stiffness} that differs by side", value, way_out)
        return value

    @field_validator("rolling", check_fields=False)
    @classmethod
    def _with_preload(cls, value: str | None, info: ValidationInfo) -> str | None:
        keys = [key for key in cls.model_fields if key in ("preload", "preload_y", "preload_z")]
        if value is None and any(info.data.get(key) is not None for key in keys):
            raise PydanticKnownError("missing")
        return _refuse_without(value, info, keys, "no rolling without a preload")

    @field_validator("damping_in_contact", check_fields=False)
    @classmethod
    def _with_clearance(cls, value: bool, info: ValidationInfo) -> bool:
        keys = [key for key in cls.model_fields if key.startswith("clearance")]
        return _refuse_without(value, info, keys, "false without a clearance")

    @field_validator("compliance_y", "compliance_z", check_fields=False)
    @classmethod
    def _no_compliance_with_preload(cls, value: float, info: ValidationInfo) -> float:
        suffix = (info.field_name or "")[-2:]
        if value and info.data.get(f"preload{suffix}") is not None:
            way_out = (
                f"the two have no closed form: write the law as curve{suffix}, with compliance times force added "
                "to each deflection"
            )
            raise ValueRefused(f"no {info.field_name} beside preload{suffix}", value, way_out)
        return value

    def _law(self, suffix: str = "", compliance: float = 0.0) -> Law:
        """The law of the keys with this suffix, in series with a compliance [m/N]. Raises SceneError if impossible.

        In series, each deflection grows by the compliance times the force, so a slope k becomes k/(1 + k compliance).
        """
        keys = (*(f"{key}{suffix}" for key in ("curve", "stiffness", "preload", "clearance")), "rolling")
        return _make_law(*(getattr(self, key) for key in keys), compliance)


@lru_cache(maxsize=1024)
def _make_law(
    curve: CurvePoints | None,
    stiffness: float | Sides | None,
    preload: float | None,
    clearance: float,
    rolling: str | None,
    compliance: float,
) -> Law:
    """The law of these keys: many carriages share one."""
    if curve is not None:
        points = np.array(curve)
        points[:, 0] += compliance * points[:, 1]
        return Law.curve(np.vstack([-points[:0:-1], points]) if curve[0] == (0.0, 0.0) else points)
    if isinstance(stiffness, Sides):
        positive, negative = (k / (1.0 + k * compliance) for k in (stiffness.positive, stiffness.negative))
        return Law.sided(positive, negative, clearance)
    assert stiffness is not None
    if preload is not None and rolling is not None:
        return Law.preloaded(stiffness, preload, CONTACT_EXPONENT[rolling])
    stiffness = stiffness / (1.0 + stiffness * compliance)
    return Law.sided(stiffness, stiffness, clearance)


def _refuse_without(value: Value, info: ValidationInfo, keys: list[str], expected: str) -> Value:
    """Refuse `value` if none of the keys that it needs has a value; one that was refused itself counts as given."""
    if value and all(key in info.data and not info.data[key] for key in keys):
        way_out = f"add {' or '.join(keys)}, or leave {info.field_name} out"
        raise ValueRefused(expected, value, way_out)
    return value
