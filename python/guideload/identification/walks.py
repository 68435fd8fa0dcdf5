"""Walks from a minimum along each unknown, which find other minima where a nonlinear machine has several.

The stiffness of such a machine jumps where a contact opens or a row carries no load, so the sum of squares has several
valleys, some narrower than the distance of the starts of a fit. A walk holds one unknown at growing distances and fits
the others; where the sum of squares falls, or grows much less than that of a linear fit, another valley is near.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from guideload.base.arrays import Array
from guideload.identification.objective import COARSE, Objective

STEPS = (1.0, 2.0, *(3.0 * 1.5**k for k in range(16)))  # standard deviations of the linear fit
FURTHEST = 1.0  # spreads before the data at which a walk ends; at a kink the standard deviation says little
LOWER = 0.5  # of the increase of a linear fit, below which the walk is in another valley


def other_valleys(objective: Objective, best: Array, squares: float) -> Iterator[Array]:
    """Starts of searches in other valleys, around a minimum with this sum of squares."""
    slopes = np.vstack([objective.of_data(best)[1], np.diag(objective.weights)])
    covariance = np.linalg.inv(slopes.T @ slopes)
    for index in range(objective.p):
        sigma = float(np.sqrt(covariance[index, index]))
        furthest = FURTHEST / float(objective.weights[index])
        for side in (-1.0, 1.0):
            x, before, last = best, squares, 0.0
            for step in STEPS:
                held = best[index] + side * step * sigma
                inside = objective.bounds[0, index] < held < objective.bounds[1, index]
                if not inside or step * sigma > furthest:
                    break
                start = x + side * (step - last) / sigma * covariance[:, index]
                start[index] = held
                end = objective.search(start, held=[index], tolerance=COARSE)
                if step > 1.0 and (end.squares < before or end.squares - squares < LOWER * step**2):
                    yield end.x
                x, before, last = end.x, end.squares, step
