"""The machine: one rigid body on carriages that run along rails, its drive and its free degrees of freedom (dofs).

Axes: x along the rails, y and z across them, right-handed. The origin is the reference point L, whose motion is given
(in the paper the point where pinion and rack mesh).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from difflib import get_close_matches
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Any, Literal, cast, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationError, field_validator, model_validator
from pydantic.functional_validators import ModelWrapValidatorHandler
from pydantic_core import InitErrorDetails

from guideload._core import Law, Scene
from guideload.base.arrays import Array
from guideload.base.config import ConfigModel
from guideload.base.errors import MOST_PROBLEMS, ConfigError, KeyPath, ValueRefused, shown
from guideload.base.toml import located, read_toml
from guideload.catalogue.conditions import LifeConditions
from guideload.catalogue.product import Product
from guideload.machine.components import Body, Carriage, Gravity, Link, Name, Rail
from guideload.machine.drive import Drive, Friction
from guideload.machine.laws import LEVEL_OF_KIND, LEVELS, ModelLevel
from guideload.machine.links import ENDS, LinkTable, read_only, table_of
from guideload.machine.products import filled, product_problems, with_catalogue
from guideload.machine.riders import MOST_RIDERS, Rider, joined

Dof = Literal["x", "y", "z", "rx", "ry", "rz"]
DOFS: tuple[Dof, ...] = get_args(Dof)


class Machine(ConfigModel):
    """A machine: body, drive, rails, carriages and links. Raises ConfigError with all problems at once."""

    name: Name = Field(default="machine", description="a title for tables and pictures")
    free: tuple[Dof, ...] = Field(
        default=("y", "z", "rx", "ry", "rz"),
        min_length=1,
        description='dofs of L that may move, of "x", "y", "z", "rx", "ry", "rz"; the drive holds the others',
    )
    gravity: Gravity = Field(
        default=(0.0, -9.80665, 0.0), description="acceleration of gravity, points down, in m/s^2"
    )
    body: Body = Field(description="the table [body]: mass, center_of_mass, inertia")
    riders: tuple[Rider, ...] = Field(
        default=(),
        max_length=MOST_RIDERS,
        description="one [[riders]] table for each body that moves along the main body, such as a cross slide",
    )
    drive: Drive | None = Field(
        default=None, description="the table [drive]; needed for a trace of the motor, and for torques"
    )
    friction: Friction | None = Field(
        default=None, description="the table [friction] of the guides; it adds to the drive's force"
    )
    rails: tuple[Rail, ...] = Field(default=(), description="one [[rails]] table per rail")
    carriages: tuple[Carriage, ...] = Field(default=(), description="one [[carriages]] table per carriage")
    links: tuple[Link, ...] = Field(default=(), description="one [[links]] table for each extra link")
    catalogue: Name | None = Field(
        default=None, description='a catalogue file, relative to the machine file, e.g. "catalogue.toml"'
    )
    products: tuple[Product, ...] = Field(
        default=(), description="one [[products]] table for each product that is not in a catalogue file"
    )
    life: LifeConditions = Field(
        default=LifeConditions(), description="the table [life]: how life and static safety are judged"
    )

    @classmethod
    def from_toml(cls, file: str | PathLike[str]) -> Machine:
        """The machine described in a TOML file. Raises ConfigError naming file, row, key and value."""
        values, places = read_toml(file)
        try:
            return cls(**with_catalogue(values, Path(file)))
        except ConfigError as error:
            raise located(error, str(file), places) from None

    def with_free(self, free: Iterable[str]) -> Machine:
        """The same machine with other free dofs; the drive holds the rest."""
        return self.model_copy(update={"free": tuple(free)})

    @field_validator("free")
    @classmethod
    def _in_order_of_dofs(cls, free: tuple[Dof, ...]) -> tuple[Dof, ...]:
        if len(set(free)) < len(free):
            raise ValueRefused("each dof once", list(free))
        return tuple(dof for dof in DOFS if dof in free)

    @model_validator(mode="wrap")
    @classmethod
    def _with_checked_names(cls, values: Any, handler: ModelWrapValidatorHandler[Machine]) -> Machine:
        """Check the names before the components are validated, so that all problems are reported at once."""
        problems = [
            InitErrorDetails(type="value_error", loc=path, input=refused.value, ctx={"error": refused})
            for path, refused in _name_conflicts(values)
        ]
        without_product = {
            item["loc"][:2] for item in problems if item["loc"][2:] in (("product",), ("preload_class",))
        }
        try:
            machine = handler(filled(values))
        except ValidationError as error:
            found = cast(list[InitErrorDetails], error.errors(include_url=False))
            # An unknown product would have given the keys that are missing.
            problems += [
                item for item in found if item["type"] != "missing" or item["loc"][:2] not in without_product
            ]
        if problems:
            raise ValidationError.from_exception_data(cls.__name__, problems)
        return machine

    @cached_property
    def whole_body(self) -> Body:
        """The main body with all riders at their positions."""
        return (
            joined([self.body, *(rider.at(rider.position) for rider in self.riders)])
            if self.riders
            else self.body
        )

    @cached_property
    def carriage_centers(self) -> Array:
        """Centres of the carriages, from L, shape (carriage, 3) [m]."""
        rails = [self.rails[i].position for i in self.rail_of_carriage]
        centers = [(carriage.x, *rail) for carriage, rail in zip(self.carriages, rails, strict=True)]
        return read_only(np.array(centers, dtype=np.float64).reshape(-1, 3))

    @cached_property
    def rail_of_carriage(self) -> NDArray[np.intp]:
        """Index of each carriage's rail, shape (carriage,)."""
        index = {rail.name: i for i, rail in enumerate(self.rails)}
        return read_only(np.array([index[carriage.rail] for carriage in self.carriages], dtype=np.intp))

    @cached_property
    def product_of_carriage(self) -> tuple[Product | None, ...]:
        """The product that each carriage names, or None."""
        products = {product.name: product for product in self.products}
        return tuple(
            None if carriage.product is None else products[carriage.product] for carriage in self.carriages
        )

    @cached_property
    def links_of_carriages(self) -> tuple[NDArray[np.int64], ...]:
        """For each carriage, the indices of its links in the link table."""
        return tuple(map(read_only, _places(self.link_table().carriage, len(self.carriages))))

    @cached_property
    def links_of_rails(self) -> tuple[NDArray[np.int64], ...]:
        """For each rail, the indices of the links of its carriages in the link table."""
        table = self.link_table()
        rail = np.append(self.rail_of_carriage, -1)[table.carriage]  # -1 for extra links
        return tuple(map(read_only, _places(rail, len(self.rails))))

    @cached_property
    def rail_centers(self) -> Array:
        """Mean of the carriage centres on each rail, from L, (rail, 3) [m]; 0 for a rail without carriages."""
        centers = np.zeros((len(self.rails), 3))
        for center, on_it in zip(centers, _places(self.rail_of_carriage, len(self.rails)), strict=True):
            if on_it.size:
                center[:] = self.carriage_centers[on_it].mean(axis=0)
        return read_only(centers)

    @cached_property
    def scene(self) -> Scene:
        """The scene that the core integrates. Raises SceneError if the links do not support the body."""
        table = self.link_table()
        return self._scene_with(table.laws, table.damping_in_contact)

    @cached_property
    def nominal_scene(self) -> Scene:
        """The linearised scene: every link has its nominal stiffness, and its damping always acts."""
        if self.model_level == "linear":
            return self.scene
        table = self.link_table()
        laws = [Law.linear(stiffness) for stiffness in table.stiffness]
        return self._scene_with(laws, np.zeros(len(laws), dtype=np.bool_))

    def _scene_with(self, laws: Sequence[Law], damping_in_contact: NDArray[np.bool_]) -> Scene:
        table = self.link_table()
        return Scene(
            mass=self.body.mass,
            center_of_mass=self.body.center_of_mass,
            inertia=self.body.central_inertia().tolist(),
            gravity=self.gravity,
            free=self.free,
            points=table.points,
            directions=table.directions,
            laws=laws,
            damping=table.damping,
            damping_in_contact=damping_in_contact,
            riders=[rider.for_core() for rider in self.riders],
        )

    @property
    def model_level(self) -> ModelLevel:
        """The lowest model level that covers the laws of all links."""
        return LEVELS[max((LEVEL_OF_KIND[law.kind] for law in self._links.laws), default=0)]

    def link_table(self) -> LinkTable:
        """All links of the machine; computed once."""
        return self._links

    @cached_property
    def _links(self) -> LinkTable:
        return table_of(self.carriages, self.carriage_centers, self.links)

    def __eq__(self, other: object) -> bool:
        """Whether all fields are equal; cached properties are not compared."""
        if not isinstance(other, Machine):
            return NotImplemented
        return all(getattr(self, key) == getattr(other, key) for key in type(self).model_fields)


def _places(owner: NDArray[np.intp], count: int) -> list[NDArray[np.int64]]:
    """For each of `count` owners, the ascending indices of its entries in `owner`; -1 is no owner."""
    order = np.argsort(owner, kind="stable")
    return np.split(order, np.searchsorted(owner[order], np.arange(count + 1)))[1:-1]


def _name_conflicts(values: Any) -> Iterator[tuple[KeyPath, ValueRefused]]:
    """Problems of unchecked values: duplicate names, unknown rails, neither carriages nor links."""
    if not isinstance(values, dict):
        return
    yield from product_problems(values)
    rails, carriages, links, riders = (
        _names(values, key, "name") for key in ("rails", "carriages", "links", "riders")
    )
    if not values.get("carriages") and not values.get("links"):
        yield ("carriages",), ValueRefused("at least one [[carriages]] or [[links]] table", [])
    known = {name for _, name in rails}
    expected = f"a rail's name ({shown(sorted(known))})"
    unknown = ((i, rail) for i, rail in _names(values, "carriages", "rail") if rail not in known)
    for number, (i, rail) in enumerate(unknown):
        near = get_close_matches(rail, sorted(known), n=1) if number < MOST_PROBLEMS else []
        hint = f'did you mean "{near[0]}"?' if near else "add a [[rails]] table with that name"
        yield ("carriages", i, "rail"), ValueRefused(expected, rail, hint)
    for key, named in (("rails", rails), ("carriages", carriages), ("links", links), ("riders", riders)):
        first: dict[str, int] = {}
        for i, name in named:
            if first.setdefault(name, i) < i:
                yield (
                    (key, i, "name"),
                    ValueRefused("a unique name", name, f"{key}[{first[name]}] has it already"),
                )
    taken = {f"{name}:{end}" for _, name in carriages for end in ENDS}
    for i, name in links:
        if name in taken:
            yield (
                ("links", i, "name"),
                ValueRefused("a unique name", name, "a link of a carriage has it already"),
            )


def _names(values: dict[str, Any], key: str, name: str) -> list[tuple[int, str]]:
    """(index, text) of the key `name` of each entry of `values[key]`; entries without this text are left out."""
    tables = values.get(key, ())
    if not isinstance(tables, list | tuple):
        return []
    texts = [table.get(name) if isinstance(table, dict) else getattr(table, name, None) for table in tables]
    return [(i, text) for i, text in enumerate(texts) if isinstance(text, str)]
