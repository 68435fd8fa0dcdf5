"""The equivalent load of a carriage: one number for its force and moment, by the rule of a maker.

All rules have one form. With c = (Fy, Fz, Mx, My, Mz), each component weighted by its sign, a rule adds the weighted
magnitudes in two groups A and B, and P = max(A, B) + minor min(A, B); minor is 1 for a plain sum. So a rule is data,
and P is linear in time wherever the loads are and no component, and not A - B, changes its sign. A preload raises small
P; by how much, the core knows.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from guideload._core import raised_loads
from guideload.base.arrays import Array, Indices
from guideload.catalogue.conditions import RuleName
from guideload.catalogue.product import Product
from guideload.life.arrangement import Arrangement

COMPONENTS = ("Fy", "Fz", "Mx", "My", "Mz")  # columns 1 to 5 of a load
AXES = ("roll", "yaw", "pitch")  # Mx, My, Mz
# How a preload raises small loads: as the loaded one of two rows of balls or rollers, which carries F0 (1 + e)^n under
# P = F0 ((1 + e)^n - (1 - e)^n); or as makers print it.
PreloadEffect = Literal["ball", "roller", "power", "linear"]
PRINTED: dict[RuleName, PreloadEffect] = {"rexroth": "power", "thomson": "linear"}


class Rule(NamedTuple):
    """A rule of the equivalent load.

    source, note    where it is from; its formula, without the lift and side factors of the product
    minor           factor on the smaller group
    rated           whether moments are divided by the "static" or by the "dynamic" rated moments
    always_moments  whether moments count also if several carriages, not side by side, run on the rail
    side_moments    moments in the group of the side load
    """

    source: str
    note: str
    minor: float = 1.0
    rated: str = "static"
    always_moments: bool = False
    side_moments: tuple[str, ...] = ()


RULES: dict[RuleName, Rule] = {
    "sum": Rule(
        "Rollon",
        "P = |Fy| + |Fz| + C0 (|Mx|/M0x + |My|/M0y + |Mz|/M0z), on the safe side",
        always_moments=True,
    ),
    "thk": Rule(
        "THK, general catalogue",
        "P = |Fy| + |Fz|; a single carriage on its rail, or carriages side by side: + C0/M0 |M| of each axis",
    ),
    "hiwin": Rule(
        "HIWIN, series HG EG WE QH QE QW RG QR",
        "P = |Fy| + |Fz|; moments of a single carriage, or of carriages side by side, are added as by the rule thk",
    ),
    "hiwin_mg": Rule(
        "HIWIN, series MG",
        "P = the larger of |Fy| and |Fz|, and half of the smaller; moments as by the rule thk",
        minor=0.5,
    ),
    "iko": Rule(
        "IKO, general catalogue",
        "Fr = |Fy| + C0/T0 |Mx| + C0/Tx |Mz|, Fa = |Fz| + C0/Ty |My|, P = the larger + 0.6 the smaller",
        minor=0.6,
        always_moments=True,
        side_moments=("yaw",),
    ),
    "rexroth": Rule(
        "Bosch Rexroth; not compared with a primary source",
        "P = |Fy| + |Fz| + C (|Mx|/Mt + |My|/ML + |Mz|/ML)",
        rated="dynamic",
        always_moments=True,
    ),
    "thomson": Rule("Thomson", "P = |Fy| + |Fz|; single carriage: + C/M |M| of each axis", rated="dynamic"),
}


@dataclass(frozen=True, eq=False)
class EquivalentLoad:
    """The rule of the equivalent load of one carriage."""

    # (2, 5, 2) of the groups A and B, of the components Fy, Fz, Mx, My, Mz, for positive and negative values [1, 1,
    # 1/m, 1/m, 1/m]
    weights: Array
    minor: float  # factor on the smaller group
    # moments that the rule counts, but for which the product has no rated moment
    missing: tuple[str, ...] = ()
    preload: float = 0.0  # N, that raises small loads; 0: none
    effect: PreloadEffect = "ball"  # how it raises them

    @property
    def of_core(self) -> tuple[Array, float, float, str]:
        """The rule as an argument of `_core`."""
        return self.weights, self.minor, self.preload, self.effect

    def groups(self, loads: Array) -> tuple[Array, Array]:
        """A and B [N] of loads (..., 6): force [N] and moment [N m]."""
        parts = np.concatenate([np.maximum(loads[..., 1:], 0.0), np.maximum(-loads[..., 1:], 0.0)], axis=-1)
        sums = parts @ self.weights.transpose(2, 1, 0).reshape(-1, 2)
        return sums[..., 0], sums[..., 1]

    def without_preload(self, loads: Array) -> Array:
        """P [N] of loads (..., 6), without the effect of the preload."""
        groups = self.groups(loads)
        return np.asarray(np.maximum(*groups) + self.minor * np.minimum(*groups))

    def with_preload(self, load: Array) -> Array:
        """The effective load [N] of a load [N]: small loads add to the preload, large ones replace it."""
        if not self.preload:
            return load
        return raised_loads(np.ravel(load), self.of_core).reshape(np.shape(load))

    def __call__(self, loads: Array) -> Array:
        """P [N] of loads (..., 6): force [N] and moment about the carriage centre [N m]."""
        return self.with_preload(self.without_preload(loads))

    def shares(self, loads: Array, parts: Array) -> Array:
        """P [N] of one load (6,) without the effect of the preload, split into the shares of its parts (k, 6).

        The parts add up to the load. This P is linear in it as long as no sign changes, so the shares add up to it.
        """
        signs: Indices = (loads[1:] < 0.0).astype(np.intp)
        slopes = [
            np.where(signs, -1.0, 1.0) * weights[np.arange(len(COMPONENTS)), signs]
            for weights in self.weights
        ]
        first, second = self.groups(loads)
        larger, smaller = slopes if first >= second else slopes[::-1]
        return np.asarray(parts[:, 1:] @ (larger + self.minor * smaller))


PLAIN_SUM = EquivalentLoad(
    np.stack([np.pad(np.full((1, 2), 1.0), ((i, len(COMPONENTS) - 1 - i), (0, 0))) for i in range(2)]), 1.0
)  # |Fy| + |Fz|


def row_loads(force: Array, preload: float, rolling: PreloadEffect) -> tuple[Array, Array]:
    """Loads [N] of the loaded and the other row under a load [N] of a preloaded carriage in one direction.

    F = F0 ((1 + e)+^n - (1 - e)+^n), e deflection over that at which a row opens. Both rows carry the preload F0 at no
    load; beyond 2^n F0 the other row is open. n is 3/2 for balls, 10/9 for rollers.
    """
    loaded = replace(PLAIN_SUM, preload=preload, effect=rolling).with_preload(np.abs(force))
    return loaded, loaded - np.abs(force)


def dynamic_load(
    rule: RuleName,
    product: Product,
    arrangement: Arrangement,
    preload: float = 0.0,
    effect: PreloadEffect | None = None,
) -> EquivalentLoad:
    """The equivalent load for the life.

    preload: N, of the carriage. effect: None: the rule as the maker prints it, mostly without the preload.
    """
    return _equivalent_load(RULES[rule], product, arrangement, preload, effect or PRINTED.get(rule))


def static_load(
    rule: RuleName,
    product: Product,
    arrangement: Arrangement,
    preload: float = 0.0,
    effect: PreloadEffect | None = None,
) -> EquivalentLoad:
    """The equivalent load for the static safety (ISO 14728-2): a plain sum of the terms, moments over static moments.

    preload: N, of the carriage. effect: None: the preload does not count, as the maker prints the rule.
    """
    plain = RULES[rule]._replace(minor=1.0, rated="static")
    return _equivalent_load(plain, product, arrangement, preload, effect)


def _equivalent_load(
    rule: Rule, product: Product, arrangement: Arrangement, preload: float, effect: PreloadEffect | None
) -> EquivalentLoad:
    rating, moments = product.static, product.static_moments
    if rule.rated == "dynamic":
        rating = None if product.dynamic is None else product.dynamic.value
        moments = product.dynamic_moments
    weights = np.zeros((2, len(COMPONENTS), 2))
    weights[0, 0] = product.lift_factor, 1.0
    weights[1, 1] = product.side_factor
    missing: list[str] = []
    if rule.always_moments or arrangement.alone or arrangement.side_by_side > 1:
        for component, axis in enumerate(AXES, start=2):
            rated = getattr(moments, axis)
            if rated is None or rating is None:
                missing.append(axis)
            else:
                weights[int(axis in rule.side_moments), component] = rating / rated
    found = EquivalentLoad(weights, rule.minor, tuple(missing))
    return found if effect is None else replace(found, preload=preload, effect=effect)
