"""The largest loads of carriages that their static safety needs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from guideload._core import largest_equivalent_load
from guideload.base.arrays import Array
from guideload.life.criteria import Criteria
from guideload.life.equivalent_load import EquivalentLoad
from guideload.life.static_safety import LargestLoads
from guideload.simulation.result import Result


def largest_loads(result: Result, criteria: Sequence[Criteria]) -> list[LargestLoads]:
    """The largest loads of the carriages with these criteria.

    At any time, also between the reported instants; over rails that are not straight, the largest at the reported
    instants. P0 is largest where it is without preload, which raises all loads in their order.
    """
    rules = {one.index: one.static_rule for one in criteria}
    wanted = (rules.get(i) for i in range(len(result.machine.carriages)))
    found = result.extremes([None if rule is None else rule.of_core for rule in wanted])
    if found is None:
        time, loads = result.history("time"), result.carriage_loads
        assert time is not None
        return [largest_at(time, loads[:, one.index], one.static_rule) for one in criteria]
    sizes = np.maximum(np.abs(found.smallest), np.abs(found.largest))[:, :6]
    return [
        LargestLoads(float(one.static_rule.with_preload(bare)), float(bare), float(when), sizes[one.index])
        for one, (bare, when) in zip(criteria, found.equivalent, strict=True)
    ]


def largest_at(time: Array, loads: Array, rule: EquivalentLoad) -> LargestLoads:
    """The largest of loads (n, 6) [N, N m] at instants (n,) [s]."""
    at, peak, sizes = largest_equivalent_load(np.ascontiguousarray(loads), rule.of_core)
    return LargestLoads(peak, float(rule.without_preload(loads[at])), float(time[at]), np.array(sizes))
