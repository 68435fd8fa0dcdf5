"""The largest loads of carriages that their static safety needs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from guideload._core import largest_equivalent_load
from guideload.base.arrays import Array
from guideload.life.criteria import Criteria
from guideload.life.equivalent_load import EquivalentLoad
from guideload.life.static_safety import LargestLoads
from guideload.machine.machine import Machine
from guideload.simulation.result import Result
from guideload.simulation.run import Extremes

if TYPE_CHECKING:
    from guideload._core import Rule


def largest_loads(result: Result, criteria: Sequence[Criteria]) -> list[LargestLoads]:
    """The largest loads of the carriages with these criteria.

    They are the largest at any time, also between the reported instants; over rails that are not straight, those at the
    reported instants. The instant of the largest P0 does not depend on the preload, which keeps the order of loads.
    """
    found = result.extremes(static_rules(result.machine, criteria))
    if found is not None:
        return largest_of(found, criteria)
    time, loads = result.history("time"), result.carriage_loads
    assert time is not None
    return [largest_at(time, loads[:, one.index], one.static_rule) for one in criteria]


def static_rules(machine: Machine, criteria: Sequence[Criteria]) -> list[Rule | None]:
    """The static rule of each carriage for the core; None for a carriage without criteria."""
    rules = {one.index: one.static_rule.of_core for one in criteria}
    return [rules.get(i) for i in range(len(machine.carriages))]


def largest_of(extremes: Extremes, criteria: Sequence[Criteria]) -> list[LargestLoads]:
    """The largest loads from extremes with the rules of `static_rules`."""
    sizes = np.maximum(np.abs(extremes.smallest), np.abs(extremes.largest))[:, :6]
    return [
        LargestLoads(float(one.static_rule.with_preload(bare)), float(bare), float(when), sizes[one.index])
        for one, (bare, when) in zip(criteria, extremes.equivalent, strict=True)
    ]


def largest_at(time: Array, loads: Array, rule: EquivalentLoad) -> LargestLoads:
    """The largest of loads (n, 6) [N, N m] at instants (n,) [s]."""
    at, peak, sizes = largest_equivalent_load(np.ascontiguousarray(loads), rule.of_core)
    return LargestLoads(peak, float(rule.without_preload(loads[at])), float(time[at]), np.array(sizes))
