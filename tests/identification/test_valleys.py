"""Fits with several minima: walks find the other valleys, and each minimum adds its part of the intervals."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from guideload.base.arrays import Array
from guideload.identification.fit import Minimum, Objective, other_valleys
from guideload.identification.uncertainty import interval

SIGMA, BEYOND, JUMP = 0.1, 0.8, 0.5


class TwoValleys(Objective):
    """A sum of squares of two coordinates with a minimum of 20 at 0 and, beyond a jump, one of 0 at `BEYOND`."""

    p, weights = 2, np.full(2, 1e-3)
    bounds = np.array([[-5.0, -5.0], [5.0, 5.0]])

    def __init__(self, second: bool) -> None:
        self.second = second

    def of_data(self, x: Array) -> tuple[Array, Array]:
        beyond = self.second and x[0] > JUMP
        along = (x[0] - BEYOND) / SIGMA if beyond else x[0] / SIGMA
        values = np.array([along, (x[1] - 0.3 * x[0]) / SIGMA, 0.0 if beyond else np.sqrt(20.0)])
        return values, np.array([[1.0, 0.0], [-0.3, 1.0], [0.0, 0.0]]) / SIGMA

    def search(self, start: Array, held: Sequence[int] = (), tolerance: float = 0.0) -> Minimum:
        """Only the other coordinate moves: to its minimum in closed form."""
        x = start.copy()
        if list(held) == [0]:
            x[1] = 0.3 * x[0]
        else:
            x[0] = 0.3 * x[1] / 1.09
        return Minimum(x, float((self.of_data(x)[0] ** 2).sum()), True)


def test_a_walk_finds_the_other_valley_and_nothing_beside_a_parabola() -> None:
    starts = list(other_valleys(TwoValleys(second=True), Minimum(np.zeros(2), 20.0)))
    assert any(JUMP < start[0] < BEYOND + 3.0 * SIGMA for start in starts)
    assert not list(other_valleys(TwoValleys(second=False), Minimum(np.zeros(2), 20.0)))


NARROW, WIDE, SECOND = 0.01, 0.1, 1.0  # standard deviations in two valleys, and where the second one is
QUANTILE = 1.959964


def fit_of_two_valleys(excess: float, bend: float = 0.0) -> Any:
    """A fit of one coordinate: parabolas around 0 and `SECOND`, whose minimum is higher by `excess`."""

    def squares(x: float) -> float:
        if x < 0.5:
            return (x / NARROW) ** 2
        away = (x - SECOND) / WIDE
        return excess + (away * (1.0 + bend * max(away, 0.0))) ** 2

    objective = SimpleNamespace(
        bounds=np.array([[-5.0], [5.0]]),
        weights=np.full(1, 1e-3),
        search=lambda start, **_: Minimum(start.copy(), squares(float(start[0])), True),
        covariance=lambda x: np.array([[(NARROW if x[0] < 0.5 else WIDE) ** 2]]),
        at_bound=lambda x: abs(x) >= 5.0,
    )
    other = Minimum(np.array([SECOND]), excess)
    return SimpleNamespace(objective=objective, minimum=Minimum(np.zeros(1), 0.0), others=(other,))


LEFT = np.sqrt(QUANTILE**2 - 2.0)  # what a minimum that is higher by 2 leaves of the quantile


@pytest.mark.parametrize(
    ("excess", "bend", "high", "tolerance"),
    [
        (2.0, 0.0, SECOND + WIDE * LEFT, 1e-3),
        (2.0, 1.0, SECOND + WIDE * 2.0 * LEFT / (1.0 + np.sqrt(1.0 + 4.0 * LEFT)), 1e-3),
        (QUANTILE**2 + 0.01, 0.0, QUANTILE * NARROW, 1e-8),
    ],
    ids=["parabola", "profile", "beyond the level"],
)
def test_another_minimum_adds_its_own_interval(
    excess: float, bend: float, high: float, tolerance: float
) -> None:
    """The end solves excess + (a + bend a^2)^2 = 1.96^2, to a hundredth of sigma; above the level nothing is added."""
    reach = interval(fit_of_two_valleys(excess, bend), 0, NARROW, np.inf)
    assert reach.low == pytest.approx(-QUANTILE * NARROW) and reach.high == pytest.approx(high, abs=tolerance)
