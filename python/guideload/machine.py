"""The machine: one rigid body on carriages that run along rails, its drive and its free dofs.

Axes: x along the rails, y and z across, right-handed; the origin is L, the reference point of the motion (in
the paper where pinion and rack mesh). A value is given as an SI number or as a string with its unit, and is
kept in SI units.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from difflib import get_close_matches
from functools import cached_property, partial
from os import PathLike
from typing import Annotated, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    BeforeValidator,
    Field,
    PlainValidator,
    StrictStr,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydantic.functional_validators import ModelWrapValidatorHandler
from pydantic_core import ErrorDetails, InitErrorDetails

from guideload._core import Scene
from guideload.config import Part, entries, located, number, read
from guideload.errors import ConfigError, KeyPath, ValueRefused, shown
from guideload.links import ENDS, LinkTable, read_only, table_of

Dof = Literal["x", "y", "z", "rx", "ry", "rz"]
DOFS: tuple[Dof, ...] = get_args(Dof)

Name = Annotated[StrictStr, Field(min_length=1)]
Length = Annotated[float, PlainValidator(partial(number, unit="m"))]
PositiveLength = Annotated[float, PlainValidator(partial(number, unit="m", above=0.0))]
Mass = Annotated[float, PlainValidator(partial(number, unit="kg", above=0.0))]
Inertia = Annotated[float, PlainValidator(partial(number, unit="kg m^2"))]
Stiffness = Annotated[float, PlainValidator(partial(number, unit="N/m", above=0.0))]
Damping = Annotated[float, PlainValidator(partial(number, unit="N s/m", least=0.0))]
Acceleration = Annotated[float, PlainValidator(partial(number, unit="m/s^2"))]
Plain = Annotated[float, PlainValidator(partial(number, unit="1"))]
Ratio = Annotated[float, PlainValidator(partial(number, unit="1", nonzero=True))]

_XYZ = BeforeValidator(partial(entries, names=("x", "y", "z")))
_YZ = BeforeValidator(partial(entries, names=("y", "z")))
_ROWS = BeforeValidator(partial(entries, names=("[Jxx, Jxy, Jxz]", "[Jyx, Jyy, Jyz]", "[Jzx, Jzy, Jzz]")))
Point = Annotated[tuple[Length, Length, Length], _XYZ]
Cross = Annotated[tuple[Length, Length], _YZ]
Vector = Annotated[tuple[Plain, Plain, Plain], _XYZ]
Gravity = Annotated[tuple[Acceleration, Acceleration, Acceleration], _XYZ]
InertiaRow = Annotated[tuple[Inertia, Inertia, Inertia], _XYZ]
Tensor = Annotated[tuple[InertiaRow, InertiaRow, InertiaRow], _ROWS]

Array = NDArray[np.float64]

# Of the largest entry: CAD systems print six digits, the last of which may be 5e-6 off, and a flat plate obeys
# the triangle rule with equality.
PRINTED_DIGITS = 1e-5
# Of the largest entry: what shifting a tensor to another point leaves of a moment that is zero.
ROUNDING = 1e-12


class Body(Part):
    """The moving body, rigid."""

    mass: Mass = Field(description='mass of all that moves with the carriages, e.g. "1250 kg"')
    center_of_mass: Point = Field(description='x, y, z from L, e.g. ["120 mm", "-650 mm", "180 mm"]')
    inertia_about: Literal["center_of_mass", "L"] = Field(
        default="center_of_mass", description="the point that the inertia is given about; axes as everywhere"
    )
    inertia: Tensor = Field(
        description="inertia tensor in kg m^2, e.g. [[420, 15, -8], [15, 310, 22], [-8, 22, 380]]"
    )

    @field_validator("inertia")
    @classmethod
    def _of_a_real_body(cls, rows: Tensor, info: ValidationInfo) -> Tensor:
        """Symmetric, positive definite and within the triangle rule; returned exactly symmetric."""
        given = np.array(rows)
        scale = np.abs(given).max()
        skew = np.abs(given - given.T)
        if skew.max() > PRINTED_DIGITS * scale:
            i, j = (int(k) for k in np.unravel_index(skew.argmax(), skew.shape))
            raise ValueRefused(
                "a symmetric tensor",
                rows,
                f"[{i}][{j}] and [{j}][{i}] are {given[i, j]:g} and {given[j, i]:g} kg m^2,"
                f" {skew[i, j]:g} kg m^2 apart",
            )
        given = 0.5 * (given + given.T)
        known = info.data
        if known.keys() >= {"mass", "center_of_mass", "inertia_about"}:  # else those are refused already
            _require_possible(
                _central(given, known["mass"], known["center_of_mass"], known["inertia_about"]), rows, scale
            )
        return _rows(given)

    def central_inertia(self) -> Array:
        """Inertia tensor about the centre of mass, shape (3, 3) [kg m^2], by J_S = J_L + m skew(r_S)^2."""
        return _central(np.array(self.inertia), self.mass, self.center_of_mass, self.inertia_about)


def _rows(tensor: Array) -> Tensor:
    a, b, c = ((float(x), float(y), float(z)) for x, y, z in tensor)
    return a, b, c


def _central(inertia: Array, mass: float, center: tuple[float, float, float], about: str) -> Array:
    r = np.array(center)
    return inertia if about == "center_of_mass" else inertia - mass * (r @ r * np.eye(3) - np.outer(r, r))


def _require_possible(central: Array, rows: Tensor, scale: float) -> None:
    """No mass is negative, so each principal moment is positive and at most the sum of the other two."""
    small, middle, large = (float(moment) for moment in np.linalg.eigvalsh(central))
    found = f"principal moments about the centre of mass are {small:g}, {middle:g}, {large:g} kg m^2"
    way_out = "check inertia_about, the units and the signs (entries of the tensor: Jxy = -sum m x y)"
    if small <= ROUNDING * scale:
        raise ValueRefused(
            "a positive definite tensor", rows, f"its {found}: the smallest is not above 0; {way_out}"
        )
    excess = large - (small + middle)
    if excess > PRINTED_DIGITS * scale:
        raise ValueRefused(
            "a tensor that a body can have (triangle rule: no principal moment above the sum of the others)",
            rows,
            f"its {found}: the largest is {excess:g} kg m^2 too large, {excess / large:.2%} of it; {way_out}",
        )


class Rail(Part):
    """A rail; it runs along x."""

    name: Name = Field(description='a name of its own, e.g. "1"')
    position: Cross = Field(description='y, z from L, e.g. ["50 mm", "-350 mm"]')


class Carriage(Part):
    """A carriage acts through two pairs of links, along y and z, at x -+ length/2 (paper, 4.1)."""

    name: Name = Field(description='a name of its own, e.g. "1"')
    rail: Name = Field(description="the name of the rail it runs on")
    x: Length = Field(description='x of its centre from L, e.g. "-500 mm"')
    length: PositiveLength = Field(description='distance between its two pairs of links, e.g. "85 mm"')
    stiffness_y: Stiffness = Field(description='stiffness of the whole carriage along y, e.g. "350 N/um"')
    stiffness_z: Stiffness = Field(description='stiffness of the whole carriage along z, e.g. "350 N/um"')
    damping_y: Damping = Field(description='damping of the whole carriage along y, e.g. "100 kN s/m"')
    damping_z: Damping = Field(description='damping of the whole carriage along z, e.g. "100 kN s/m"')


class Link(Part):
    """An extra link between body and drive frame, such as an elastic rack: spring and damper in parallel."""

    name: Name = Field(description='a name of its own, e.g. "rack"')
    point: Point = Field(description="x, y, z from L of its end on the body")
    direction: Vector = Field(
        description="the line it acts along, of any length, e.g. [1, 0, 0]; kept as a unit vector"
    )
    stiffness: Stiffness = Field(description='stiffness along its direction, e.g. "80 N/um"')
    damping: Damping = Field(description='damping along its direction, e.g. "20 kN s/m"')

    @field_validator("direction")
    @classmethod
    def _unit(cls, direction: Vector) -> Vector:
        length = math.hypot(*direction)
        if length == 0.0:
            raise ValueRefused(
                "a direction other than zero", direction, "e.g. [1, 0, 0] for a link along the rails"
            )
        x, y, z = direction
        return x / length, y / length, z / length


class Drive(Part):
    """From the motor to the cart: a gear, then a pinion on a rack or a screw."""

    gear_ratio: Ratio = Field(
        default=1.0,
        description="motor turns per turn of pinion or screw; negative if the cart runs backwards",
    )
    pinion_diameter: PositiveLength | None = Field(
        default=None, description='pitch diameter, e.g. "127.3 mm"'
    )
    screw_lead: PositiveLength | None = Field(
        default=None, description='travel per turn of the screw, e.g. "20 mm"'
    )

    @model_validator(mode="after")
    def _one_output(self) -> Drive:
        if (self.pinion_diameter is None) == (self.screw_lead is None):
            raise ValueRefused(
                "exactly one of pinion_diameter and screw_lead", self.model_dump(exclude_unset=True)
            )
        return self

    @property
    def speed_per_motor_speed(self) -> float:
        """Speed of the cart per speed of the motor [m/rad]."""
        if self.pinion_diameter is not None:
            return 0.5 * self.pinion_diameter / self.gear_ratio
        assert self.screw_lead is not None
        return self.screw_lead / (2.0 * math.pi) / self.gear_ratio


class Machine(Part):
    """A machine as `simulate` takes it. Raises ConfigError with all that is wrong, not only the first."""

    name: Name = Field(default="machine", description="a title for tables and pictures")
    free: tuple[Dof, ...] = Field(
        default=("y", "z", "rx", "ry", "rz"),
        min_length=1,
        description='dofs of L that may move, of "x", "y", "z", "rx", "ry", "rz"; the drive holds the others',
    )
    gravity: Gravity = Field(
        default=(0.0, -9.80665, 0.0), description="the vector that points down, in m/s^2"
    )
    body: Body = Field(description="the table [body]: mass, center_of_mass, inertia")
    drive: Drive | None = Field(
        default=None, description="the table [drive]; needed for a trace of the motor only"
    )
    rails: tuple[Rail, ...] = Field(default=(), description="one [[rails]] table each")
    carriages: tuple[Carriage, ...] = Field(default=(), description="one [[carriages]] table each")
    links: tuple[Link, ...] = Field(default=(), description="one [[links]] table for each extra link")

    @classmethod
    def from_toml(cls, file: str | PathLike[str]) -> Machine:
        """The machine described in a TOML file. Raises ConfigError naming file, row, key and value."""
        values, where = read(file)
        try:
            return cls(**values)
        except ConfigError as error:
            raise located(error, str(file), where) from None

    def with_free(self, free: Iterable[str]) -> Machine:
        """The same machine with other free dofs; the drive holds the rest."""
        values = {key: getattr(self, key) for key in Machine.model_fields}
        return Machine(**{**values, "free": tuple(free)})

    @field_validator("free")
    @classmethod
    def _in_order(cls, free: tuple[Dof, ...]) -> tuple[Dof, ...]:
        if len(set(free)) < len(free):
            raise ValueRefused("each dof once", list(free))
        return tuple(dof for dof in DOFS if dof in free)

    @model_validator(mode="wrap")
    @classmethod
    def _names_agree(cls, values: Any, handler: ModelWrapValidatorHandler[Machine]) -> Machine:
        """Checks names on the raw values, so that they are told together with what the parts refuse."""
        found = [
            InitErrorDetails(type="value_error", loc=path, input=refused.value, ctx={"error": refused})
            for path, refused in _name_conflicts(values)
        ]
        machine: Machine | None = None
        try:
            machine = handler(values)
        except ValidationError as error:
            for item in error.errors(include_url=False):
                found.append(_again(item))
        if machine is None or found:
            raise ValidationError.from_exception_data(cls.__name__, found)
        return machine

    @cached_property
    def carriage_centers(self) -> Array:
        """Centres of the carriages from L, shape (carriage, 3) [m]."""
        rails = [self.rails[i].position for i in self.rail_of_carriage]
        centers = [(carriage.x, *rail) for carriage, rail in zip(self.carriages, rails, strict=True)]
        return read_only(np.array(centers, dtype=np.float64).reshape(-1, 3))

    @cached_property
    def rail_of_carriage(self) -> NDArray[np.intp]:
        """Index of each carriage's rail, shape (carriage,)."""
        index = {rail.name: i for i, rail in enumerate(self.rails)}
        return read_only(np.array([index[carriage.rail] for carriage in self.carriages], dtype=np.intp))

    @cached_property
    def links_of_carriages(self) -> list[NDArray[np.int64]]:
        """Indices into the link table of the links of each carriage."""
        owner = self.link_table().carriage
        return [read_only(np.flatnonzero(owner == i).astype(np.int64)) for i in range(len(self.carriages))]

    @cached_property
    def links_of_rails(self) -> list[NDArray[np.int64]]:
        """Indices into the link table of the links of each rail's carriages."""
        table = self.link_table()
        rail = np.append(self.rail_of_carriage, -1)[table.carriage]  # extra links (-1) run on no rail
        return [read_only(np.flatnonzero(rail == i).astype(np.int64)) for i in range(len(self.rails))]

    @cached_property
    def rail_centers(self) -> Array:
        """Mean of the centres of each rail's carriages from L, (rail, 3) [m]; 0 for a rail without any."""
        centers = np.zeros((len(self.rails), 3))
        for i in set(self.rail_of_carriage.tolist()):
            centers[i] = self.carriage_centers[self.rail_of_carriage == i].mean(axis=0)
        return read_only(centers)

    @cached_property
    def scene(self) -> Scene:
        """The scene that the core integrates. Raises SceneError if the links leave the body unsupported."""
        table = self.link_table()
        return Scene(
            mass=self.body.mass,
            center_of_mass=self.body.center_of_mass,
            inertia=self.body.central_inertia().tolist(),
            gravity=self.gravity,
            free=self.free,
            points=table.points,
            directions=table.directions,
            stiffness=table.stiffness,
            damping=table.damping,
        )

    def link_table(self) -> LinkTable:
        """All links of the machine, computed once."""
        return self._links

    @cached_property
    def _links(self) -> LinkTable:
        return table_of(self)

    def __getstate__(self) -> dict[Any, Any]:
        """Fields only: what is computed from them is computed again where it is needed."""
        state = super().__getstate__()
        state["__dict__"] = {key: state["__dict__"][key] for key in type(self).model_fields}
        return state


def _name_conflicts(values: Any) -> Iterator[tuple[KeyPath, ValueRefused]]:
    """Names used twice, rails that do not exist, a machine that nothing holds; from unchecked values."""
    if not isinstance(values, dict):
        return
    rails, carriages, links = (_names(values, key, "name") for key in ("rails", "carriages", "links"))
    if not values.get("carriages") and not values.get("links"):
        yield ("carriages",), ValueRefused("at least one [[carriages]] or [[links]] table", [])
    for i, rail in _names(values, "carriages", "rail"):
        known = sorted({name for _, name in rails})
        if rail not in known:
            near = get_close_matches(rail, known, n=1)
            hint = f'did you mean "{near[0]}"?' if near else "add a [[rails]] table with that name"
            yield ("carriages", i, "rail"), ValueRefused(f"a rail's name ({shown(known)})", rail, hint)
    for key, named in (("rails", rails), ("carriages", carriages), ("links", links)):
        first: dict[str, int] = {}
        for i, name in named:
            if first.setdefault(name, i) < i:
                yield (
                    (key, i, "name"),
                    ValueRefused("a name of its own", name, f"{key}[{first[name]}] has it already"),
                )
    taken = {f"{name}:{end}" for _, name in carriages for end in ENDS}
    for i, name in links:
        if name in taken:
            yield (
                ("links", i, "name"),
                ValueRefused("a name of its own", name, "a link of a carriage has it already"),
            )


def _again(item: ErrorDetails) -> InitErrorDetails:
    """A finding of pydantic, to be raised once more beside others."""
    return InitErrorDetails(type=item["type"], loc=item["loc"], input=item["input"], ctx=item.get("ctx", {}))


def _names(values: dict[str, Any], key: str, name: str) -> list[tuple[int, str]]:
    """Index and text of `name` in each entry of the list `values[key]` that has one, table or Part."""
    parts = values.get(key, ())
    if not isinstance(parts, list | tuple):
        return []
    texts = [part.get(name) if isinstance(part, dict) else getattr(part, name, None) for part in parts]
    return [(i, text) for i, text in enumerate(texts) if isinstance(text, str)]
