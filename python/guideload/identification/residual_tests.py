"""Tests of the residuals: is their size that of the noise, are they white, do they have a trend?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2, norm

from guideload.base.arrays import Array
from guideload.identification.fit import Fit

RARE = 0.01  # probability below which a test says that something is wrong
FEWEST = 8  # values of which a series can be judged
OUTLIER = 4.0  # standard deviations: one of 16 000 values is further out by chance


@dataclass(frozen=True)
class ResidualTest:
    """The residuals of one group of values that share a noise level.

    name      the group
    count     its values
    rms       root mean square of the residuals, in standard deviations of the noise as stated
    factor    estimated noise over stated noise; None where it is known
    doubts    in words
    """

    name: str
    count: int
    rms: float
    factor: float | None
    doubts: tuple[str, ...]


def residual_tests(fit: Fit) -> tuple[ResidualTest, ...]:
    """A test of each group of values."""
    labels = [label for each in fit.objective.data for label in each.labels]
    in_time = [each.instants is not None for each in fit.objective.data for _ in each.noise]
    tests = []
    for i, noise in enumerate(fit.noise):
        here = np.flatnonzero(fit.objective.noise_of == i)
        values, factor = fit.residuals[here], float(fit.objective.factors[i])
        doubts = _size(factor * values, float(fit.free_values[i])) if noise.known else []
        if not in_time[i]:
            doubts += _series(values)
        elif alike := _likeness(values):
            doubts.append(
                f"neighbouring differences are alike (correlation {alike:.2f}): the model lacks something, such as a "
                "law of friction or of a link; the intervals are widened for it"
            )
        doubts += [
            f"the {labels[here[k]]} is {abs(values[k]):.1f} standard deviations off"
            for k in np.flatnonzero(abs(values) > OUTLIER).tolist()[:3]
        ]
        rms = factor * float(np.sqrt(np.mean(values**2))) if here.size else 0.0
        tests.append(ResidualTest(noise.name, here.size, rms, None if noise.known else factor, tuple(doubts)))
    return tuple(tests)


def _size(values: Array, free: float) -> list[str]:
    if free < 1.0:
        return []
    squares = float(values @ values)
    ratio = float(np.sqrt(squares / free))
    if chi2.sf(squares, free) < RARE:
        return [
            f"the differences are {ratio:.2g} times the stated noise: the noise is larger, or the model lacks something"
        ]
    if chi2.cdf(squares, free) < RARE:
        return [f"the differences are only {ratio:.2g} times the stated noise: it is stated too large"]
    return []


def _series(values: Array) -> list[str]:
    """Doubts about values in the order of frequency or time: neighbours alike, or a trend."""
    n = values.size
    if n < FEWEST or not values.any():
        return []
    doubts = []
    if likeness := _likeness(values):
        doubts.append(
            f"neighbouring differences are alike (correlation {likeness:.2f}): they are not noise alone, the model "
            "lacks something, and the intervals are too narrow"
        )
    order = np.linspace(-1.0, 1.0, n)
    trend = float(order @ values / np.sqrt(order @ order) / np.sqrt(np.mean(values**2)))
    if 2.0 * norm.sf(abs(trend)) < RARE:
        doubts.append("the differences have a trend from the first value to the last")
    return doubts


def _likeness(values: Array) -> float:
    """Correlation of neighbours; 0 if it may be chance."""
    likeness = float(values[1:] @ values[:-1]) / max(float(values @ values), np.finfo(float).tiny)
    return likeness if norm.sf(likeness * np.sqrt(values.size)) < 0.5 * RARE else 0.0
