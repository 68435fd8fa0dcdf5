"""How life and static safety of a carriage follow from its loads: ratings, factors and rules of its product."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from guideload.base.arrays import Array
from guideload.base.errors import LifeError
from guideload.catalogue.conditions import LifeConditions
from guideload.catalogue.product import Product
from guideload.catalogue.rating import Rating
from guideload.life.arrangement import Arrangement, arrangements
from guideload.life.equivalent_load import AXES, RULES, EquivalentLoad, dynamic_load, static_load
from guideload.life.rating_life import rating_life
from guideload.life.static_safety import safety
from guideload.machine.components import Carriage
from guideload.machine.machine import Machine

NO_ARM = 1e-9  # m: a link of a carriage with a shorter arm about an axis carries no moment about it


@dataclass(frozen=True, eq=False)
class Criteria:
    """How life and static safety of one carriage follow from its loads.

    name, rail, product   names of the carriage and its rail, and its product
    index                 of the carriage in the machine
    rating, static_rating  dynamic rating of the product, and its static rating C0 [N]
    contact_factor        f_C
    preload               N, of the carriage, whether it counts or not; 0 with clearance, None if it is not known
    rule, static_rule     rules of the equivalent load, for the life and for the static safety
    conditions            how life and static safety are judged
    """

    name: str
    rail: str
    product: Product
    index: int
    rating: Rating
    static_rating: float
    contact_factor: float
    preload: float | None
    rule: EquivalentLoad
    static_rule: EquivalentLoad
    conditions: LifeConditions

    def life_under(self, mean_load: ArrayLike) -> Array:
        """The life [m] under a mean load [N]."""
        return rating_life(self.rating, mean_load, self.conditions, self.contact_factor)

    def safety_under(self, peak: ArrayLike) -> Array:
        """The static safety under a largest equivalent load [N]."""
        return safety(self.contact_factor * self.static_rating, peak)

    @property
    def unrated_moments(self) -> tuple[str, ...]:
        """Axes of moments that the rules count, and for which the product has no rated moment."""
        return tuple(dict.fromkeys((*self.rule.missing, *self.static_rule.missing)))

    def unrated(self, axis: str, carries: str) -> LifeError:
        """The error for a moment without rating. carries: what the carriage carries, "carries a roll moment"."""
        rule = self.conditions.rule
        kind = "dynamic" if RULES[rule].rated == "dynamic" else "static"
        return LifeError(
            f"carriage {self.name} {carries}, which the rule {rule} counts, but {self.product.name} has no "
            f"{kind}_moments.{axis}: add it to its record, or choose another rule"
        )


def known_criteria(machine: Machine, conditions: LifeConditions) -> tuple[Criteria, ...]:
    """The criteria of the carriages whose products have dynamic and static rating; may be empty."""
    places = arrangements(machine)
    return tuple(
        _criteria(machine, index, product, places[index], conditions)
        for index, product in enumerate(machine.product_of_carriage)
        if product is not None and product.dynamic and product.static
    )


def criteria_of(machine: Machine, conditions: LifeConditions) -> tuple[Criteria, ...]:
    """As `known_criteria`. Raises LifeError if no carriage has ratings."""
    if not (rated := known_criteria(machine, conditions)):
        raise LifeError(
            f"{machine.name}: no carriage has a product with dynamic and static rating; write one at each carriage, "
            'as in product = "HGH25CA" (`guideload catalogue list` shows the packaged ones); for products of your own '
            'catalogue file, name it by catalogue = "FILE.toml"'
        )
    return rated


def _criteria(
    machine: Machine, index: int, product: Product, place: Arrangement, conditions: LifeConditions
) -> Criteria:
    assert product.dynamic is not None and product.static is not None
    carriage = machine.carriages[index]
    preload = _preload(carriage, product)
    effect = (carriage.rolling or product.type) if conditions.preload_in_life else None
    counted = (preload or 0.0, effect)
    contact = place.contact_factor if conditions.contact_factor is None else conditions.contact_factor
    return Criteria(
        name=carriage.name,
        rail=carriage.rail,
        product=product,
        index=index,
        rating=product.dynamic,
        static_rating=product.static,
        contact_factor=contact,
        preload=preload,
        rule=dynamic_load(conditions.rule, product, place, *counted),
        static_rule=static_load(conditions.rule, product, place, *counted),
        conditions=conditions,
    )


def _preload(carriage: Carriage, product: Product) -> float | None:
    """The preload [N] of a carriage: its own, else the largest of its class; 0 with clearance, None if unknown."""
    if own := max(carriage.preload_y or 0.0, carriage.preload_z or 0.0):
        return own
    if carriage.clearance_y or carriage.clearance_z:
        return 0.0
    of_class = product.preload_range(carriage.preload_class)
    return None if of_class is None else of_class[1]


def require_rated_moments(machine: Machine, criteria: Criteria) -> None:
    """Raise LifeError if the links of a carriage can carry a moment that its rules count and that is not rated."""
    i = criteria.index
    links, center, axes = machine.links_of_carriages[i], machine.carriage_centers[i], machine.carriage_axes[i]
    arms = np.abs(machine.link_table().arms(links, center, axes))
    for axis in criteria.unrated_moments:
        if arms[:, 3 + AXES.index(axis)].max(initial=0.0) > NO_ARM:
            raise criteria.unrated(axis, f"can carry a {axis} moment")
