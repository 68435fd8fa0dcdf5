"""Life and static safety in a study: how they follow from the loads of its samples, or why they do not."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from guideload.base.arrays import Array
from guideload.base.errors import LifeError
from guideload.base.number_text import joined, load_in_sentence
from guideload.life.arrangement import SIDE_BY_SIDE
from guideload.life.criteria import Criteria, criteria_of, require_rated_moments
from guideload.life.limits import limit_notes
from guideload.life.mean_load import Travel
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.parameters.parameters import changed, part_path
from guideload.study.factors import Factor

EXPONENT = 3.0  # of the mean load where no carriage has a rating
LEAVE_OUT = 'or leave "load" out of quantities'


@dataclass(frozen=True)
class RatedStudy:
    """Life and static safety in a study."""

    criteria: tuple[Criteria, ...] = ()  # of the carriages with ratings; empty if neither is computed
    reason: str = ""  # why not, or empty
    # for the report: limits that the motion passes, what was left out, or why neither is computed
    notes: tuple[str, ...] = ()
    travel: float = math.nan  # of the cart in the motion [m]; nan without criteria

    @property
    def exponent(self) -> float:
        """Exponent of the mean load."""
        return self.criteria[0].rating.exponent if self.criteria else EXPONENT


def rated_study(
    machine: Machine, motion: Motion, factors: Sequence[Factor], cases: Array | None
) -> RatedStudy:
    """Life and static safety of the carriages whose products have ratings, by the machine's table [life]."""
    try:
        criteria, travel = criteria_of(machine, machine.life), Travel.of(motion)
        _require_possible(machine, travel, criteria, factors, cases)
    except LifeError as error:
        has_products = any(machine.product_of_carriage)
        notes = (f"Life and static safety are not computed: {error}.",) if has_products else ()
        return RatedStudy(reason=str(error), notes=notes)
    told = (*limit_notes(machine, criteria, travel, motion.position), *_preload_notes(criteria, factors))
    return RatedStudy(criteria, notes=tuple(f"Warning: {note}." for note in told), travel=travel.distance)


def _preload_notes(criteria: Sequence[Criteria], factors: Sequence[Factor]) -> Iterator[str]:
    """On the preloads that count and are the same in every sample."""
    varied = [target for factor in factors for target in factor.targets if ".preload_" in target]
    same: dict[float, list[str]] = {}
    for one in criteria:
        own = part_path("carriages", one.name)
        if one.rule.preload and not any(target.startswith(own) for target in varied):
            same.setdefault(one.rule.preload, []).append(one.name)
    if same:
        forces = joined(f"{load_in_sentence(force)} (carriage {joined(of)})" for force, of in same.items())
        yield (
            f"the preload does not scatter: every sample has {forces}, the upper end of the preload class or what the "
            "machine file states. Life and static safety of single carriages differ with theirs"
        )


def _require_possible(
    machine: Machine,
    travel: Travel,
    criteria: Sequence[Criteria],
    factors: Sequence[Factor],
    cases: Array | None,
) -> None:
    """Raise LifeError if the life of the samples cannot be computed from one rule for each carriage.

    The rule depends on whether carriages of a rail are side by side, which must be so in all samples or in none.
    """
    if not travel.velocity.any():
        raise LifeError("the cart does not move along x, so there is no mean load over distance")
    exponents = {one.rating.exponent: one.name for one in reversed(criteria)}
    if len(exponents) > 1:
        found = joined(f"{exponent:.4g} (carriage {name})" for exponent, name in sorted(exponents.items()))
        raise LifeError(
            f"the mean loads of a study have one exponent, but the ratings have {found}: run a study of the machine "
            f"with products of each exponent, {LEAVE_OUT}"
        )
    for one in criteria:
        require_rated_moments(machine, one)
    low, high = machine.carriage_centers[:, 0] + np.zeros((2, 1))  # (carriage,) smallest and largest x
    for i, ends in _places(machine, factors, cases):
        low[i], high[i] = ends
    lengths = [(one and one.carriage_length) or 0.0 for one in machine.product_of_carriage]
    for i, j in combinations(range(len(lengths)), 2):
        same_rail = machine.rail_of_carriage[i] == machine.rail_of_carriage[j]
        near = SIDE_BY_SIDE * max(lengths[i], lengths[j])
        closest = max(0.0, low[i] - high[j], low[j] - high[i])
        farthest = max(high[i] - low[j], high[j] - low[i])
        if same_rail and near and closest <= near < farthest:
            names = joined(machine.carriages[k].name for k in (i, j))
            raise LifeError(
                f"carriages {names} are side by side (at most {near:.3g} m apart) in some samples and apart in "
                f"others, which changes f_C and the rule: narrow the distribution of x, {LEAVE_OUT}"
            )


def _places(
    machine: Machine, factors: Sequence[Factor], cases: Array | None
) -> Iterator[tuple[int, tuple[float, float]]]:
    """Index of each carriage whose x varies, and the smallest and largest x of the samples."""
    index = {f"{part_path('carriages', one.name)}.x": i for i, one in enumerate(machine.carriages)}
    for column, factor in enumerate(factors):
        if factor.marginal is not None:
            reach = factor.marginal.reach
        else:
            assert cases is not None
            reach = float(cases[:, column].min()), float(cases[:, column].max())
        for target in index.keys() & set(factor.targets):
            low, high = sorted(changed(machine.carriages[index[target]].x, factor.form, end) for end in reach)
            yield index[target], (low, high)
