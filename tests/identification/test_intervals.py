"""Intervals of fits with several minima: each minimum adds what the sum of squares allows around it."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from guideload.base.arrays import Array
from guideload.identification.fit import Minimum
from guideload.identification.uncertainty import interval

NARROW, WIDE, SECOND = 0.01, 0.1, 1.0  # standard deviations in two valleys, and where the second one is
QUANTILE = 1.959964


def two_valleys(excess: float, bend: float = 0.0) -> Any:
    """A fit of one coordinate: parabolas around 0 and `SECOND`, whose minimum is higher by `excess`."""

    def squares(x: float) -> float:
        if x < 0.5:
            return (x / NARROW) ** 2
        away = (x - SECOND) / WIDE
        return excess + (away * (1.0 + bend * max(away, 0.0))) ** 2

    def search(start: Array, held: Sequence[int], tolerance: float) -> Minimum:
        return Minimum(start.copy(), squares(float(start[0])), True)

    def covariance(x: Array) -> Array:
        return np.array([[(NARROW if x[0] < 0.5 else WIDE) ** 2]])

    objective = SimpleNamespace(
        bounds=np.array([[-5.0], [5.0]]), weights=np.full(1, 1e-3), search=search, covariance=covariance
    )
    other = Minimum(np.array([SECOND]), excess)
    return SimpleNamespace(objective=objective, minimum=Minimum(np.zeros(1), 0.0), others=(other,))


def test_another_minimum_adds_its_own_interval() -> None:
    """It is as wide as its own valley, less what its minimum is higher: sigma sqrt(1.96^2 - excess)."""
    reach = interval(two_valleys(2.0), 0, NARROW, np.inf)
    assert reach.low == pytest.approx(-QUANTILE * NARROW)
    assert reach.high == pytest.approx(SECOND + WIDE * np.sqrt(QUANTILE**2 - 2.0), rel=1e-3)


def test_a_minimum_beyond_the_level_adds_nothing() -> None:
    reach = interval(two_valleys(QUANTILE**2 + 0.01), 0, NARROW, np.inf)
    assert (reach.low, reach.high) == pytest.approx((-QUANTILE * NARROW, QUANTILE * NARROW))


def test_the_profile_around_another_minimum_counts_where_it_is_no_parabola() -> None:
    """The end solves excess + (a + bend a^2)^2 = 1.96^2, to a hundredth of sigma."""
    level = np.sqrt(QUANTILE**2 - 2.0)
    away = 2.0 * level / (1.0 + np.sqrt(1.0 + 4.0 * level))
    reach = interval(two_valleys(2.0, bend=1.0), 0, NARROW, np.inf)
    assert reach.high == pytest.approx(SECOND + WIDE * away, abs=0.01 * WIDE)
