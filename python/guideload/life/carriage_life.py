"""Life and static safety of one carriage."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from guideload.base.arrays import Array
from guideload.base.errors import LifeError
from guideload.catalogue.conditions import LifeConditions
from guideload.catalogue.product import Product
from guideload.catalogue.rating import Rating
from guideload.life.arrangement import Arrangement
from guideload.life.causes import PHASES, WorstInstant, shares_by_cause
from guideload.life.equivalent_load import AXES, RULES, EquivalentLoad, dynamic_load, static_load
from guideload.life.mean_load import integrals, mean_load
from guideload.life.rating_life import rating_life
from guideload.life.record import Record
from guideload.life.row_loads import row_loads
from guideload.life.static_safety import StaticSafety, static_safety
from guideload.machine.components import Carriage
from guideload.machine.laws import EXPONENT
from guideload.motion.uncertainty import COVER

SMALL_MOMENT = 1e-6  # N m per N of load: a smaller moment without rating is rounding


@dataclass(frozen=True, eq=False)
class CarriageLife:
    """Life and static safety of one carriage.

    name, rail, product       names of the carriage, its rail and its product
    rating                    dynamic rating of the product
    contact_factor            f_C
    rule                      the rule of the equivalent load
    index                     of the carriage in the machine
    damage                    (n - 1,) share of the life that each interval of the record costs
    distance                  m, travel in the record
    mean_load                 N, over distance
    life                      m
    static                    static safety
    factor_life, factor_safety  f_W: the load factor that, put into the catalogue's formula with statics with m a,
                              gives the life and the safety of the simulated loads
    worst                     causes of the worst instant
    rows                      N, largest load of the loaded row and smallest of the other one along y, of a carriage
                              with preloaded rows; None for others
    """

    name: str
    rail: str
    product: Product
    rating: Rating
    contact_factor: float
    rule: EquivalentLoad
    index: int
    damage: Array
    distance: float
    mean_load: float
    life: float
    static: StaticSafety
    factor_life: float
    factor_safety: float
    worst: WorstInstant
    rows: tuple[float, float] | None


def carriage_life(record: Record, index: int, place: Arrangement, conditions: LifeConditions) -> CarriageLife:
    """Life and static safety of the carriage with this index, whose product has ratings.

    Raises LifeError if the product lacks a rated moment that the rule counts.
    """
    machine, travel, loads = record.result.machine, record.travel, record.result.carriage_loads[:, index]
    carriage, product = machine.carriages[index], machine.product_of_carriage[index]
    assert product is not None and product.dynamic is not None
    preload = product.class_named(carriage.preload_class)
    contact = place.contact_factor if conditions.contact_factor is None else conditions.contact_factor
    rule = dynamic_load(conditions.rule, product, place, (preload and preload.preload) or 0.0)
    of_statics = static_load(conditions.rule, product, place)
    for name in dict.fromkeys((*rule.missing, *of_statics.missing)):
        _require_small(loads, name, carriage.name, product, conditions)
    rating, exponent = product.dynamic, product.dynamic.exponent
    power, path = integrals(travel, loads, rule, exponent)
    mean = mean_load(power, path, exponent)
    life = rating_life(rating, mean, conditions, contact)
    quasi_static = record.parts.quasi_static[:, index]
    static = static_safety(loads, product, of_statics, contact)
    catalogue_mean = mean_load(*integrals(travel, quasi_static, rule, exponent), exponent)
    catalogue_peak = float(of_statics.without_preload(quasi_static).max())
    distance, total = float(path.sum()), float(power.sum())
    share = distance / life / total if total else 0.0
    return CarriageLife(
        name=carriage.name,
        rail=carriage.rail,
        product=product,
        rating=rating,
        contact_factor=contact,
        rule=rule,
        index=index,
        damage=power * share,
        distance=distance,
        mean_load=mean,
        life=life,
        static=static,
        factor_life=mean / catalogue_mean if catalogue_mean else float("nan"),
        factor_safety=static.peak / catalogue_peak if catalogue_peak else float("nan"),
        worst=_worst(record, of_statics, static, index),
        rows=_rows(carriage, loads),
    )


def _rows(carriage: Carriage, loads: Array) -> tuple[float, float] | None:
    """Largest load of the loaded row and smallest load of the other one along y [N], if the law has two rows."""
    if carriage.preload_y is None or carriage.rolling is None:
        return None
    loaded, other = row_loads(loads[:, 1], carriage.preload_y, EXPONENT[carriage.rolling])
    return float(loaded.max()), float(other.min())


def _worst(record: Record, rule: EquivalentLoad, static: StaticSafety, index: int) -> WorstInstant:
    at, data = static.instant, record.result.quantities
    shares = rule.shares(record.result.carriage_loads[at, index], record.parts.at(at, index))
    noise = float("nan")
    if "resultant_sd" in data:
        noise = COVER * float(data["resultant_sd"][at, index])
    when = PHASES[record.phase[min(at, record.phase.size - 1)]]
    return WorstInstant(float(data["time"][at]), static.peak, shares_by_cause(shares), noise, when)


def _require_small(
    loads: Array, axis: str, carriage: str, product: Product, conditions: LifeConditions
) -> None:
    """Raise LifeError if the carriage carries a moment that the rule counts and the product has no rating for."""
    moment = float(np.abs(loads[:, 3 + AXES.index(axis)]).max())
    if moment <= SMALL_MOMENT * float(np.abs(loads[:, :3]).max()):
        return
    kind = "dynamic" if RULES[conditions.rule].rated == "dynamic" else "static"
    raise LifeError(
        f"carriage {carriage} carries a {axis} moment of up to {moment:.3g} N m, which the rule {conditions.rule} "
        f"counts, but {product.name} has no {kind}_moments.{axis}: add it to its record, or choose another rule"
    )
