"""Subset simulation (Au and Beck 2001): a small probability as a product of larger ones, each of the next level.

Several independent populations run side by side, so that their scatter gives the error of their mean. Each starts with
independent samples; the best tenth of them start Markov chains that stay beyond the level which they have reached, by
conditional sampling with a step adapted to the acceptance (Papaioannou et al. 2015). It needs no gradient and finds
all regions that its samples reach, and its work grows with the logarithm of the probability.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Array

Margin = Callable[[Array], Array]  # (n, factors) normal scores to (n,) margins, positive beyond the limit

SAMPLES = (
    2000  # of a population at a level: the bias of the product falls with their number, here to 1 or 2 %
)
SHARE = 0.1  # of the samples that start chains: the usual value; work is nearly the same from 0.1 to 0.3
ACCEPTED = 0.44  # share of accepted candidates at which chains forget fastest (Papaioannou et al. 2015)
FIRST_STEP = 0.6


def subset_simulation(
    margin: Margin, factors: int, populations: int, least: float, generator: np.random.Generator
) -> Array:
    """(populations,) independent estimates of the probability that the margin of normal scores is positive.

    An estimate is 0 if its samples do not get on towards the limit, or below the probability `least`.
    """
    scores = generator.standard_normal((populations, SAMPLES, factors))
    margins = _of(margin, scores)
    estimates, level = np.ones(populations), np.full(populations, -np.inf)
    active = np.arange(populations)
    starts = np.empty((populations, int(SHARE * SAMPLES)), np.intp)
    while active.size:
        for i in active:
            starts[i], level[i], share = _next_level(margins[i], float(level[i]), starts.shape[1], generator)
            estimates[i] *= share
        estimates[estimates < least] = 0.0
        active = active[(level[active] <= 0.0) & (estimates[active] > 0.0)]
        if active.size:
            first = starts[active, :, None]
            begin = (
                np.take_along_axis(scores[active], first, 1),
                np.take_along_axis(margins[active], first[..., 0], 1),
            )
            scores[active], margins[active] = _chains(margin, *begin, level[active, None], generator)
    return estimates


def _next_level(
    margins: Array, level: float, count: int, generator: np.random.Generator
) -> tuple[NDArray[np.intp], float, float]:
    """Samples that start chains, the next level (infinite beyond the limit), and the share of samples beyond it.

    The share is 0 if no sample is beyond the present level.
    """
    beyond = margins > 0.0
    if beyond.mean() >= SHARE:
        return np.zeros(count, np.intp), np.inf, float(beyond.mean())
    threshold = float(np.partition(margins, -count)[-count])
    if threshold <= level:  # many samples have the same margin
        higher = margins[margins > level]
        threshold = float(higher.min()) if higher.size else np.inf
    inside = np.flatnonzero(margins >= threshold)
    if not inside.size:
        return np.zeros(count, np.intp), np.inf, 0.0
    chosen = generator.permutation(inside)[:count]
    return np.resize(chosen, count), min(threshold, 0.0), inside.size / margins.size


def _chains(
    margin: Margin, scores: Array, margins: Array, level: Array, generator: np.random.Generator
) -> tuple[Array, Array]:
    """Samples (population, SAMPLES) beyond the levels, from chains that start at these, side by side."""
    steps = np.full((len(scores), 1, 1), FIRST_STEP)
    all_scores, all_margins = [scores], [margins]
    for step in range(1, round(1 / SHARE)):
        noise = generator.standard_normal(scores.shape)
        candidates = np.sqrt(1.0 - steps**2) * scores + steps * noise
        found = _of(margin, candidates)
        accepted = found >= level
        scores = np.where(accepted[..., None], candidates, scores)
        margins = np.where(accepted, found, margins)
        all_scores.append(scores)
        all_margins.append(margins)
        rate = accepted.mean(axis=1)[:, None, None]
        steps = np.minimum(steps * np.exp((rate - ACCEPTED) / np.sqrt(step)), 1.0)
    return np.concatenate(all_scores, axis=1), np.concatenate(all_margins, axis=1)


def _of(margin: Margin, scores: Array) -> Array:
    return margin(scores.reshape(-1, scores.shape[-1])).reshape(scores.shape[:-1])
