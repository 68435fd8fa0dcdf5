"""Walks find the valley of a second minimum, and nothing beside a parabola."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from guideload.base.arrays import Array
from guideload.identification.fit import Minimum, Objective, other_valleys

SIGMA, SECOND, JUMP = 0.1, 0.8, 0.5


class TwoValleys(Objective):
    """A sum of squares of two coordinates with a minimum of 20 at 0 and, beyond a jump, one of 0 at `SECOND`."""

    p, weights = 2, np.full(2, 1e-3)
    bounds = np.array([[-5.0, -5.0], [5.0, 5.0]])

    def __init__(self, second: bool) -> None:
        self.second = second

    def of_data(self, x: Array) -> tuple[Array, Array]:
        beyond = self.second and x[0] > JUMP
        along = (x[0] - SECOND) / SIGMA if beyond else x[0] / SIGMA
        values = np.array([along, (x[1] - 0.3 * x[0]) / SIGMA, 0.0 if beyond else np.sqrt(20.0)])
        return values, np.array([[1.0, 0.0], [-0.3, 1.0], [0.0, 0.0]]) / SIGMA

    def search(self, start: Array, held: Sequence[int], tolerance: float = 0.0) -> Minimum:
        """Only the other coordinate moves: to its minimum in closed form."""
        x = start.copy()
        if list(held) == [0]:
            x[1] = 0.3 * x[0]
        else:
            x[0] = 0.3 * x[1] / 1.09
        return Minimum(x, float((self.of_data(x)[0] ** 2).sum()), True)


def test_a_walk_finds_the_other_valley() -> None:
    starts = list(other_valleys(TwoValleys(second=True), Minimum(np.zeros(2), 20.0)))
    assert any(JUMP < start[0] < SECOND + 3.0 * SIGMA for start in starts)
    assert not list(other_valleys(TwoValleys(second=False), Minimum(np.zeros(2), 20.0)))
