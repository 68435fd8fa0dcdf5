"""The components of a machine: body, rails, carriages, extra links, drive.

A value is an SI number or a string with its unit; it is stored as an SI number.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable
from typing import Annotated, Literal, NamedTuple, cast

import numpy as np
from pydantic import AfterValidator, Field, StrictStr, ValidationInfo, field_validator, model_validator
from pydantic_core import PydanticKnownError

from guideload._core import Law
from guideload.base.arrays import Array
from guideload.base.config import ConfigModel, in_range, listed, not_required, optional
from guideload.base.errors import SceneError, ValueRefused
from guideload.base.ranges import (
    ACCELERATION,
    DAMPING,
    DIRECTION,
    INERTIA,
    LENGTH,
    MASS,
    POSITION,
    ROLL,
    TILTING,
    TRAVEL,
)
from guideload.base.visible_text import HIDDEN, escaped
from guideload.machine.inertia import PRINTED_DIGITS, central, point_inertia, require_physical
from guideload.machine.laws import (
    Clearance,
    Compliance,
    Curve,
    DampingInContact,
    ElasticModel,
    Preload,
    Rolling,
    Stiffness,
    law_field,
)
from guideload.machine.straightness import Profile, Straightness, Waviness, spline_through


def _printable(name: str) -> str:
    """`name`, in which nothing steers a terminal or reorders text. Raises ValueRefused."""
    found = HIDDEN.search(name)
    if found is not None:
        which = f"{escaped(found[0])} is character {found.start() + 1}"
        raise ValueRefused("a name without control characters and marks of writing direction", name, which)
    return name


Name = Annotated[StrictStr, Field(min_length=1), AfterValidator(_printable)]
Length = Annotated[float, in_range(POSITION)]
TravelPosition = Annotated[float, in_range(TRAVEL)]
PositiveLength = Annotated[float, in_range(LENGTH, above=0.0)]
RotationalStiffness = Annotated[float, in_range(TILTING, above=0.0)]
Roll = Annotated[float, in_range(ROLL)]
Mass = Annotated[float, in_range(MASS, above=0.0)]
Inertia = Annotated[float, in_range(INERTIA)]
Damping = Annotated[float, in_range(DAMPING, least=0.0)]
Acceleration = Annotated[float, in_range(ACCELERATION)]
Plain = Annotated[float, in_range(DIRECTION)]

_XYZ = listed("x", "y", "z")
_YZ = listed("y", "z")
_ROWS = listed("[Jxx, Jxy, Jxz]", "[Jyx, Jyy, Jyz]", "[Jzx, Jzy, Jzz]")
Point = Annotated[tuple[Length, Length, Length], _XYZ]
Cross = Annotated[tuple[Length, Length], _YZ]
Vector = Annotated[tuple[Plain, Plain, Plain], _XYZ]
Gravity = Annotated[tuple[Acceleration, Acceleration, Acceleration], _XYZ]
InertiaRow = Annotated[tuple[Inertia, Inertia, Inertia], _XYZ]
Tensor = Annotated[tuple[InertiaRow, InertiaRow, InertiaRow], _ROWS]


class Body(ConfigModel):
    """The moving rigid body."""

    mass: Mass = Field(description='mass of all that moves with the carriages, e.g. "1250 kg"')
    center_of_mass: Point = Field(description='x, y, z from L, e.g. ["120 mm", "-650 mm", "180 mm"]')
    inertia_about: Literal["center_of_mass", "L"] = optional(
        "the reference point of the inertia; its axes are x, y, z", "center_of_mass"
    )
    inertia: Tensor = Field(
        description="inertia tensor in kg m^2, e.g. [[420, 15, -8], [15, 310, 22], [-8, 22, 380]]"
    )

    @field_validator("inertia")
    @classmethod
    def _physical(cls, rows: Tensor, info: ValidationInfo) -> Tensor:
        """Check symmetry, definiteness and triangle rule; return the exactly symmetric tensor."""
        tensor = np.array(rows)
        scale = np.abs(tensor).max()
        skew = np.abs(tensor - tensor.T)
        if skew.max() > PRINTED_DIGITS * scale:
            i, j = (int(k) for k in np.unravel_index(skew.argmax(), skew.shape))
            raise ValueRefused(
                "a symmetric tensor",
                rows,
                f"[{i}][{j}] and [{j}][{i}] are {tensor[i, j]:g} and {tensor[j, i]:g} kg m^2,"
                f" {skew[i, j]:g} kg m^2 apart",
            )
        tensor = 0.5 * (tensor + tensor.T)
        others = [info.data[key] for key in ("mass", "center_of_mass", "inertia_about") if key in info.data]
        if len(others) == 3:  # none of them was refused
            require_physical(central(tensor, *others), rows, scale)
        return cast(Tensor, tuple(map(tuple, tensor.tolist())))

    def central_inertia(self) -> Array:
        """Inertia tensor about the centre of mass, shape (3, 3) [kg m^2]: J_S = J_L + m skew(r_S)^2."""
        return central(np.array(self.inertia), self.mass, self.center_of_mass, self.inertia_about)


def sum_bodies(body: Body, others: Iterable[Body]) -> Body:
    """Bodies that move as one: sums of mass, first moment, and inertia about the common centre of mass."""
    for other in others:
        body = joined(body, other.mass, np.array(other.center_of_mass), other.central_inertia())
    return body


def joined(body: Body, mass: float, center: Array, inertia: Array) -> Body:
    """A body together with a mass [kg], its centre (3,) [m] from L and its inertia (3, 3) [kg m^2] about it."""
    total, own = body.mass + mass, np.array(body.center_of_mass)
    reduced = body.mass * mass / total
    return Body(
        mass=total,
        center_of_mass=((body.mass * own + mass * center) / total).tolist(),
        inertia=(body.central_inertia() + inertia + point_inertia(reduced, center - own)).tolist(),
    )


class Rail(ConfigModel):
    """A rail along x."""

    name: Name = Field(description='a unique name, e.g. "1"')
    position: Cross = Field(description='y, z from L, e.g. ["50 mm", "-350 mm"]')
    roll: Roll = optional(
        'angle about x by which y and z of its carriages are turned, y towards z, e.g. "90 deg"', 0.0
    )
    mounting_error: Cross = optional(
        'y, z by which it is mounted beside its position, e.g. ["20 um", "-5 um"]; it loads the carriages',
        (0.0, 0.0),
    )
    straightness: Straightness | None = optional(
        'points [x, dy, dz] of its displacement, x in the fixed frame, e.g. [["0 m", "0 um", "0 um"], ...]'
    )
    straightness_file: Name | None = optional(
        'a CSV file with these points, relative to the machine file: columns "x [mm],dy [um],dz [um]"'
    )
    waviness: Waviness | None = optional("a random displacement in addition, with rms, wavelengths and seed")

    @field_validator("straightness_file")
    @classmethod
    def _was_read(cls, name: str | None, info: ValidationInfo) -> str | None:
        if name is not None and info.data.get("straightness", ()) is None:
            raise ValueRefused("no straightness_file in code", name, "give its points as straightness")
        return name

    @property
    def profiles(self) -> tuple[Profile, ...]:
        """The profiles whose sum is its displacement; none for a straight rail."""
        points = () if self.straightness is None else (spline_through(self.straightness),)
        return points if self.waviness is None else (*points, self.waviness)


class Distances(NamedTuple):
    """Distances [m] between the links of a carriage, which with their stiffness resist its rotations."""

    pitch: float  # of the links along y, along the rail
    yaw: float  # of the links along z, along the rail
    roll: float  # of the links along y, across the rail; 0 if they are in the middle of the rail


NO_CATALOGUE = (
    ', e.g. "10 kN s/m" (not in catalogues: `guideload modes` prints damping ratios, mostly near 2 %)'
)


class Carriage(ElasticModel):
    """A carriage: one link along y and one along z at each of its ends, x - length/2 and x + length/2 (paper, 4.1).

    With `width` it has two links along y at each end, at z - width/2 and z + width/2, which resist roll. y and z are
    those of its rail. Its elastic law along y and z follows from stiffness, clearance, preload or curve; see
    `guideload.machine.laws`.
    """

    model_config = not_required("damping_y", "damping_z")  # its type may give them

    name: Name = Field(description='a unique name, e.g. "1"')
    rail: Name = Field(description="the name of the rail it runs on")
    type: Name | None = optional("a table of [carriage_types], which gives the keys that are left out here")
    x: Length = Field(description='x of its centre from L, e.g. "-500 mm"')
    stiffness_pitch: RotationalStiffness | None = optional(
        'stiffness against rotation about z, e.g. "250 kN m/rad", in place of the one by length'
    )
    stiffness_yaw: RotationalStiffness | None = optional(
        'stiffness against rotation about y, e.g. "250 kN m/rad", in place of the one by length'
    )
    stiffness_roll: RotationalStiffness | None = optional(
        'stiffness against rotation about x, e.g. "80 kN m/rad" (or width instead)'
    )
    length: PositiveLength | None = optional(
        'distance between its two ends along x, e.g. "85 mm"; a product may give it', validate_default=True
    )
    width: PositiveLength | None = optional(
        'distance across the rail of its rows of balls or rollers, e.g. "23 mm", which resist roll; '
        "a product may give it"
    )
    curve_y: Curve | None = law_field("curve", "of the whole carriage along y", "_y")
    curve_z: Curve | None = law_field("curve", "of the whole carriage along z", "_z")
    stiffness_y: Stiffness = law_field("stiffness", "of the whole carriage along y", "_y")
    stiffness_z: Stiffness = law_field("stiffness", "of the whole carriage along z", "_z")
    preload_y: Preload = law_field("preload", "of the whole carriage along y", "_y")
    preload_z: Preload = law_field("preload", "of the whole carriage along z", "_z")
    clearance_y: Clearance = law_field("clearance", "along y")
    clearance_z: Clearance = law_field("clearance", "along z")
    compliance_y: Compliance = law_field("compliance", "along y")
    compliance_z: Compliance = law_field("compliance", "along z")
    rolling: Rolling = None
    damping_y: Damping = Field(description=f"damping of the whole carriage along y{NO_CATALOGUE}")
    damping_z: Damping = Field(description=f"damping of the whole carriage along z{NO_CATALOGUE}")
    damping_in_contact: DampingInContact = False
    mounting_error: Cross = optional(
        'y, z of its own by which it is too high or too far across, e.g. ["5 um", "0 um"]; adds to that of its rail',
        (0.0, 0.0),
    )
    product: Name | None = optional(
        'a packaged product, or one of the catalogue file or of [[products]], e.g. "HGH25CA"; it gives '
        "length, width and stiffness if they are left out"
    )
    preload_class: Name | None = optional(
        'preload class of the product, e.g. "ZA"; needed if the product has several'
    )

    @property
    def laws(self) -> tuple[Law, Law]:
        """The elastic laws of the whole carriage along y and along z, in series with the structure's compliance."""
        return self._law("_y", self.compliance_y), self._law("_z", self.compliance_z)

    @property
    def own_laws(self) -> tuple[Law, Law]:
        """The elastic laws of the carriage alone."""
        return self._law("_y"), self._law("_z")

    @property
    def damping_shares(self) -> tuple[float, float]:
        """What the compliance in series leaves of the damping along y and along z: (k_s/k)^2.

        k: nominal stiffness of the carriage, whose damper is parallel to it; k_s: together with the structure. A
        vibration of amplitude a then moves the carriage by a k_s/k, and its damper dissipates (k_s/k)^2 of the energy.
        """
        y, z = (law.stiffness for law in self.own_laws)
        return (1.0 + y * self.compliance_y) ** -2.0, (1.0 + z * self.compliance_z) ** -2.0

    @field_validator("length")
    @classmethod
    def _length_or_stiffness(cls, length: float | None, info: ValidationInfo) -> float | None:
        """Require length unless pitch and yaw stiffness, which replace it, are both given."""
        replaced = all(info.data.get(key, 0.0) is not None for key in ("stiffness_pitch", "stiffness_yaw"))
        if length is None and not replaced:
            raise PydanticKnownError("missing")
        if length is not None and replaced:
            way_out = "they replace what length gives: keep one of them"
            raise ValueRefused("no length beside stiffness_pitch and stiffness_yaw", length, way_out)
        return length

    @field_validator("width")
    @classmethod
    def _width_or_stiffness(cls, width: float | None, info: ValidationInfo) -> float | None:
        if width is not None and info.data.get("stiffness_roll") is not None:
            way_out = "either gives the stiffness against roll: keep one of them"
            raise ValueRefused("no width beside stiffness_roll", width, way_out)
        return width

    @model_validator(mode="after")
    def _possible(self) -> Carriage:
        """Refuse a rotational stiffness that links with the carriage's stiffness cannot have in any machine."""
        try:
            distances = self.distances
        except SceneError:  # an impossible law: the scene reports it
            return self
        for key, distance in distances._asdict().items():
            if not LENGTH.holds(distance):
                axis = "z" if key == "yaw" else "y"
                reason = (
                    f"with stiffness_{axis} its links would be {distance:.3g} m apart: is the unit right?"
                )
                raise ValueRefused(f"a possible stiffness_{key}", getattr(self, f"stiffness_{key}"), reason)
        return self

    @property
    def resists_roll(self) -> bool:
        """Whether its links along y are in two rows."""
        return self.width is not None or self.stiffness_roll is not None

    @property
    def distances(self) -> Distances:
        """The distances of its links; a stiffness k_r against a rotation takes 2 sqrt(k_r/k), with the nominal k."""

        def distance(rotational: float | None, law: Law, otherwise: float | None) -> float:
            return (otherwise or 0.0) if rotational is None else 2.0 * math.sqrt(rotational / law.stiffness)

        along_y, along_z = self.own_laws
        return Distances(
            pitch=distance(self.stiffness_pitch, along_y, self.length),
            yaw=distance(self.stiffness_yaw, along_z, self.length),
            roll=distance(self.stiffness_roll, along_y, self.width),
        )


UNIT = (
    4.0 * sys.float_info.epsilon
)  # error of the length of a unit vector: roundings of its components and of hypot


def unit_vector(direction: Vector, example: str) -> Vector:
    """The direction with length 1; unchanged if it has it. Raises ValueRefused with the example for a zero vector."""
    length = math.hypot(*direction)
    if length < sys.float_info.min:  # 0, or so small that it has lost digits
        raise ValueRefused("a direction other than zero", direction, example)
    if abs(length - 1.0) <= UNIT:
        return direction
    x, y, z = direction
    return x / length, y / length, z / length


class Link(ElasticModel):
    """An extra link between body and travelling frame, such as an elastic rack: spring and damper in parallel."""

    name: Name = Field(description='a unique name, e.g. "rack"')
    point: Point = Field(description="x, y, z from L of the point where it acts on the body")
    direction: Vector = Field(
        description="vector of any length along which it acts, e.g. [1, 0, 0]; it is scaled to a unit vector"
    )
    curve: Curve | None = law_field("curve", "along its direction")
    stiffness: Stiffness = law_field("stiffness", "along its direction")
    preload: Preload = law_field("preload", "along its direction")
    clearance: Clearance = law_field("clearance", "along its direction")
    rolling: Rolling = None
    damping: Damping = Field(description='damping along its direction, e.g. "20 kN s/m"')
    damping_in_contact: DampingInContact = False

    @field_validator("direction")
    @classmethod
    def _unit(cls, direction: Vector) -> Vector:
        return unit_vector(direction, "e.g. [1, 0, 0] for a link along the rails")

    @property
    def law(self) -> Law:
        """The elastic law along its direction."""
        return self._law()
