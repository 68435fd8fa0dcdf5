"""The machine: one rigid body on carriages that run along rails, its drive and its free degrees of freedom (dofs).

Axes: x along the rails, y and z across them, right-handed. The origin is the reference point L, whose motion is given
(in the paper the point where pinion and rack mesh).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from os import PathLike
from os.path import relpath
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, cast, get_args

import numpy as np
from pydantic import Field, ValidationError, field_validator, model_validator
from pydantic.functional_validators import ModelWrapValidatorHandler
from pydantic_core import InitErrorDetails

from guideload._core import Law, Scene
from guideload.base.arguments import checked
from guideload.base.arrays import Array, Flags, Indices, Integers, read_only
from guideload.base.atomic import atomic_write
from guideload.base.config import exactly, optional
from guideload.base.errors import ArgumentError, SceneError, ValueRefused, shown
from guideload.base.file_model import FileModel
from guideload.base.notebook import as_html
from guideload.base.number_text import number
from guideload.catalogue.conditions import LifeConditions
from guideload.catalogue.product import Product
from guideload.machine.base import Base
from guideload.machine.carriage_types import CarriageTypes, TypesByName, at_types, with_types
from guideload.machine.components import Body, Carriage, Gravity, Link, Name, Rail, TravelPosition, sum_bodies
from guideload.machine.drive import Drive, Friction
from guideload.machine.laws import LEVEL_OF_KIND, LEVELS, ModelLevel
from guideload.machine.links import LinkTable, offsets_of_rails, own_axes, table_of
from guideload.machine.names import name_conflicts
from guideload.machine.payloads import Payload
from guideload.machine.points import PointOfInterest
from guideload.machine.products import filled, of_invalid_products, with_catalogue, with_packaged
from guideload.machine.report_head import ReportHead
from guideload.machine.riders import MOST_RIDERS, Rider
from guideload.machine.straightness import with_straightness

Dof = Literal["x", "y", "z", "rx", "ry", "rz"]
DOFS: tuple[Dof, ...] = get_args(Dof)
GIVING = (("product",), ("preload_class",), ("type",))  # keys of a carriage that give it others


class Machine(FileModel):
    """A machine: body, drive, rails, carriages and links. Raises ConfigError with all problems at once."""

    FILE: ClassVar = "machine.toml"
    WRITTEN_BY: ClassVar = "`guideload init` writes one"
    REQUIRED: ClassVar = ("body", "[body], as a machine file has")

    name: Name = optional("a title for tables and pictures", "machine")
    free: tuple[Dof, ...] = optional(
        'dofs of L that may move, of "x", "y", "z", "rx", "ry", "rz"; the drive holds the others',
        ("y", "z", "rx", "ry", "rz"),
        min_length=1,
    )
    gravity: Gravity = optional("acceleration of gravity, points down, in m/s^2", (0.0, -9.80665, 0.0))
    body: Annotated[Body, exactly(Body)] = Field(
        description="the table [body]: mass, center_of_mass, inertia"
    )
    riders: tuple[Rider, ...] = optional(
        "one [[riders]] table for each body that moves along the main body, such as a cross slide",
        (),
        max_length=MOST_RIDERS,
    )
    drive: Drive | None = optional("the table [drive]; needed for a trace of the motor, and for torques")
    friction: Friction | None = optional("the table [friction] of the guides; it adds to the drive's force")
    rest_at: TravelPosition = optional(
        "position of the cart at rest, where rails are not straight; a run rests where it starts", 0.0
    )
    base: Base | None = optional("the table [base]: its compliance; left out if it is rigid")
    rails: tuple[Rail, ...] = optional("one [[rails]] table per rail", ())
    carriages: tuple[Carriage, ...] = optional("one [[carriages]] table per carriage", ())
    carriage_types: CarriageTypes = Field(
        default_factory=TypesByName,
        description="a table [carriage_types.NAME] of keys for each type that carriages name by `type`",
    )
    links: tuple[Link, ...] = optional("one [[links]] table for each extra link", ())
    points: tuple[PointOfInterest, ...] = optional(
        "one [[points]] table for each point of the body whose motion matters", ()
    )
    payloads: tuple[Payload, ...] = optional("one [[payloads]] table for each mass that comes and goes", ())
    catalogue: Name | None = optional(
        'a file of products that are not packaged, relative to the machine file, e.g. "mine.toml"'
    )
    products: tuple[Product, ...] = optional(
        "one [[products]] table for each product that is not in a catalogue file", ()
    )
    life: LifeConditions = optional(
        "the table [life]: how life and static safety are judged", LifeConditions()
    )
    report: ReportHead = optional(
        "the table [report]: project, customer and others, for the head of reports", ReportHead()
    )

    def _repr_html_(self) -> str:
        import pandas as pd

        rows = [
            {"rail": one.rail, "product": one.product or "", "x_m": x, "y_m": y, "z_m": z}
            for one, (x, y, z) in zip(self.carriages, self.carriage_centers.tolist(), strict=True)
        ]
        names = pd.Index([one.name for one in self.carriages], name="carriage")
        mass = f"{number(self.whole_body.mass)} kg moved, free {', '.join(self.free)}"
        return as_html(f"{self.name}: {self.model_level}, {mass}", pd.DataFrame(rows, index=names))

    @checked
    def to_toml(self, file: str | PathLike[str]) -> None:
        """Write a machine file from which `from_toml` reads this machine: numbers in SI units, products included.

        The key `motion` of a rider names the same file, as seen from the new folder. A file that exists is
        replaced, whole or not at all; its comments are lost. Raises OSError.
        """
        import tomli_w

        # The products of a catalogue are among the products.
        values = self.model_dump(mode="json", exclude_defaults=True, exclude_none=True, exclude={"catalogue"})
        for rider in values.get("riders", ()):
            if "motion" in rider and self._folder is not None:
                rider["motion"] = Path(relpath(self._folder / rider["motion"], Path(file).parent)).as_posix()
        with atomic_write(Path(file)) as draft:
            draft.write_bytes(tomli_w.dumps(values).encode())

    @classmethod
    def _of_file(cls, values: dict[str, Any], file: Path) -> Machine:
        return cls(**with_catalogue(with_straightness(values, file.parent), file))

    @checked
    def with_free(self, free: Iterable[str]) -> Machine:
        """The same machine with other free dofs; the drive holds the rest."""
        return self.model_copy(update={"free": tuple(free)})

    @checked
    def with_payloads(self, payloads: Iterable[str]) -> Machine:
        """The machine with the payloads of these names as part of its body, and without the others.

        Raises ArgumentError for a name that no payload has.
        """
        names = frozenset(payloads)
        known = [payload.name for payload in self.payloads]
        if unknown := sorted(names.difference(known)):
            there = f"it has {', '.join(known)}" if known else "it has no [[payloads]]"
            raise ArgumentError(
                f"{self.name}: expected names of payloads of the machine, got {shown(unknown[0])}; {there}"
            )
        if names not in self._with_payloads:
            body = sum_bodies(self.body, (payload for payload in self.payloads if payload.name in names))
            self._with_payloads[names] = self.model_copy(update={"body": body, "payloads": ()})
        return self._with_payloads[names]

    def require_no_payloads(self, what: str) -> None:
        """Raise ArgumentError for a machine whose payloads come and go, which `what` does not know."""
        if self.payloads:
            raise ArgumentError(
                f"payloads: {what} knows no payloads that come and go; run the machine (simulate, guideload run), or "
                f"make them part of its body: machine.with_payloads([{shown(self.payloads[0].name)}])"
            )

    def require_standing_riders(self, what: str) -> None:
        """Raise ArgumentError for a machine with a rider that names its motion, which `what` does not know."""
        for rider in self.riders:
            if rider.motion is not None:
                raise ArgumentError(
                    f"riders: {what} has riders at their positions, but {shown(rider.name)} has the motion "
                    f"{shown(rider.motion)}; run the machine (simulate, guideload run), or leave the key motion out"
                )

    @cached_property
    def _with_payloads(self) -> dict[frozenset[str], Machine]:
        return {}

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
        given, values = values, with_packaged(with_types(values))
        problems = [
            InitErrorDetails(type="value_error", loc=path, input=refused.value, ctx={"error": refused})
            for path, refused in name_conflicts(values)
        ]
        lacking = {one["loc"][:2] for one in problems if one["loc"][2:] in GIVING}
        lacking |= {("carriages", i) for i in of_invalid_products(values)}
        try:
            machine = handler(filled(values))
        except ValidationError as error:
            found = cast(list[InitErrorDetails], error.errors(include_url=False))
            # An unknown or invalid product, or an unknown type, would have given the keys that are missing.
            problems += [one for one in found if one["type"] != "missing" or one["loc"][:2] not in lacking]
        if problems:
            raise ValidationError.from_exception_data(cls.__name__, at_types(problems, given))
        return machine

    @checked
    def point(self, name: str) -> PointOfInterest:
        """The point of [[points]] with this name. Raises ArgumentError if there is none."""
        for one in self.points:
            if one.name == name:
                return one
        known = ", ".join(one.name for one in self.points)
        there = f"it has {known}" if known else "it has no [[points]]"
        raise ArgumentError(
            f"{self.name}: expected the name of a point of the machine, got {name!r}; {there}"
        )

    @cached_property
    def whole_body(self) -> Body:
        """The main body with all riders at their positions."""
        return sum_bodies(self.body, (rider.at(rider.position) for rider in self.riders))

    @cached_property
    def carriage_centers(self) -> Array:
        """Centres of the carriages, from L, shape (carriage, 3) [m]."""
        rails = [self.rails[i].position for i in self.rail_of_carriage]
        centers = [(carriage.x, *rail) for carriage, rail in zip(self.carriages, rails, strict=True)]
        return read_only(np.array(centers, dtype=np.float64).reshape(-1, 3))

    @cached_property
    def carriage_places(self) -> Array:
        """Centre of each carriage and roll of its rail, (carriage, 4) [m, m, m, rad]: point and axes of its load."""
        rolls = [self.rails[i].roll for i in self.rail_of_carriage]
        return read_only(np.column_stack([self.carriage_centers, rolls]))

    @cached_property
    def carriage_axes(self) -> Array:
        """Own x, y and z of each carriage, as rows, in the axes of the machine: (carriage, 3, 3)."""
        return read_only(own_axes(self.carriage_places))

    @property
    def in_one_line(self) -> bool:
        """Whether all carriages are in one line, as on a single rail."""
        across = self.carriage_centers[:, 1:]
        return across.size > 0 and not np.ptp(across, axis=0).any()

    @property
    def has_rolled_rails(self) -> bool:
        """Whether the own axes of a carriage differ from those of the machine."""
        return bool(self.carriage_places[:, 3].any())

    @cached_property
    def mounting_errors(self) -> Array:
        """Mounting error of each carriage in the axes of the machine, shape (carriage, 3) [m].

        It is the sum of that of the carriage, which is along its own y and z, and that of its rail.
        """
        own = np.array([(0.0, *carriage.mounting_error) for carriage in self.carriages]).reshape(-1, 3)
        rails = [(0.0, *self.rails[i].mounting_error) for i in self.rail_of_carriage]
        return read_only(np.einsum("ij,ijk->ik", own, self.carriage_axes) + np.reshape(rails, (-1, 3)))

    @cached_property
    def rail_of_carriage(self) -> Indices:
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
    def seal_forces(self) -> Array:
        """Friction of the seals of each carriage (carriage,) [N]: of [friction], or else of its product."""
        if self.friction is not None and self.friction.seal is not None:
            return read_only(np.full(len(self.carriages), self.friction.seal))
        seals = [None if one is None else one.seal_force for one in self.product_of_carriage]
        return read_only(np.array([0.0 if one is None else one.per_carriage for one in seals]))

    @cached_property
    def links_of_carriages(self) -> tuple[Integers, ...]:
        """For each carriage, the indices of its links in the link table."""
        return tuple(map(read_only, _places(self.link_table().carriage, len(self.carriages))))

    @cached_property
    def static_carriage_loads(self) -> Array:
        """Static loads of the carriages (carriage, 6): force [N], and moment about the carriage centre [N m]."""
        loads = self.scene.static_group_loads(self.links_of_carriages, self.carriage_places)
        return read_only(loads)

    def resultants(self, loads: Array) -> Array:
        """Resultants (time, carriage) [N] in the y-z plane of link loads (time, link) [N]."""
        directions = self.link_table().directions[:, 1:]
        sums = [loads[:, links] @ directions[links] for links in self.links_of_carriages]
        return np.asarray(np.linalg.norm(np.array(sums).reshape(len(sums), len(loads), 2), axis=2).T)

    @cached_property
    def links_of_rails(self) -> tuple[Integers, ...]:
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
    def rail_places(self) -> Array:
        """As `carriage_places`, for the loads of the rails: (rail, 4) [m, m, m, rad]."""
        return read_only(np.column_stack([self.rail_centers, [rail.roll for rail in self.rails]]))

    @cached_property
    def scene(self) -> Scene:
        """The scene that the core integrates. Raises SceneError if the links do not support the body."""
        table = self.link_table()
        try:
            return self._scene_with(table.laws, table.damping_in_contact)
        except SceneError as error:
            if self.in_one_line and not any(carriage.resists_roll for carriage in self.carriages):
                way_out = (
                    "carriages in one line resist roll if each has the key width, the distance of its rows"
                )
                raise SceneError(f"{error}; {way_out}") from None
            raise

    @cached_property
    def nominal_scene(self) -> Scene:
        """The linearised scene: every link has its nominal stiffness, and its damping always acts."""
        if self.model_level == "linear":
            return self.scene
        table = self.link_table()
        laws = [Law.linear(stiffness) for stiffness in table.stiffness]
        return self._scene_with(laws, np.zeros(len(laws), dtype=np.bool_))

    def _scene_with(self, laws: Sequence[Law], damping_in_contact: Flags) -> Scene:
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
            offsets=self.offsets,
            base_compliance=None if self.base is None else self.base.compliance,
            riders=[rider.for_core() for rider in self.riders],
        )

    @property
    def has_straight_rails(self) -> bool:
        """Whether no rail has a profile; it may have a mounting error."""
        return not any(rail.profiles for rail in self.rails)

    @cached_property
    def offsets(self) -> Array:
        """Displacement of the foot of each link at rest, from mounting errors and profiles of rails, (link,) [m]."""
        return read_only(self.link_table().offsets + self.rail_offsets(np.array([self.rest_at]))[0][0])

    def rail_offsets(self, position: Array) -> tuple[Array, Array]:
        """Displacements [m] and slopes [1] of the rails at all links, along the links, each (n, link).

        position: (n,) m, of the cart. Raises SceneError where the profile of a rail is not known.
        """
        rails = [self.rails[rail] for rail in self.rail_of_carriage]
        return offsets_of_rails(rails, self.carriages, self.link_table(), position)

    @cached_property
    def model_level(self) -> ModelLevel:
        """The lowest model level that covers the laws of all links."""
        return LEVELS[max((LEVEL_OF_KIND[law.kind] for law in self._links.laws), default=0)]

    def link_table(self) -> LinkTable:
        """All links of the machine; computed once."""
        return self._links

    @cached_property
    def _links(self) -> LinkTable:
        return table_of(self.carriages, self.carriage_places, self.links, self.mounting_errors)


def _places(owner: Indices, count: int) -> list[Integers]:
    """For each of `count` owners, the ascending indices of its entries in `owner`; -1 is no owner."""
    order = np.argsort(owner, kind="stable")
    return np.split(order, np.searchsorted(owner[order], np.arange(count + 1)))[1:-1]
