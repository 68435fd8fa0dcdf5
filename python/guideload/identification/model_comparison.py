"""Comparison of models of a machine by what each predicts of data that it has not seen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError
from guideload.identification.result import Identification

BLOCKS = 10  # of each data set; each is left out once
CERTAIN = 2.0  # standard deviations from which on a difference counts
OVERWHELMING = 10.0  # difference of scores that counts in any case: odds of 20 000 to 1


@dataclass(frozen=True)
class ComparedModel:
    """A model in a comparison."""

    name: str  # its title
    unknowns: int  # the number of its unknowns
    score: float  # logarithm of the probability density of the left-out values, summed; larger is better
    behind: float  # score of the best model less its own
    uncertainty: float  # standard deviation of that difference
    is_best: bool = False  # whether it is the simplest one that is not certainly worse than the best


def compare(candidates: Mapping[str, Identification]) -> tuple[ComparedModel, ...]:
    """The models, fitted to the same data, the best first. Raises ArgumentError if they do not use the same values."""
    scores = {name: _scores(one) for name, one in candidates.items()}
    sizes = {name: one.fit.residuals.size for name, one in candidates.items()}
    if len(set(sizes.values())) > 1:
        counts = ", ".join(f"{name} {size}" for name, size in sizes.items())
        raise ArgumentError(
            f"alternatives: expected models that explain the same values, got {counts} values: one leaves out a "
            "measured mode that another has; remove this mode from the file"
        )
    best = max(scores, key=lambda name: float(scores[name].sum()))
    models = []
    for name, one in candidates.items():
        difference = scores[best] - scores[name]
        behind, deviation = float(difference.sum()), float(np.std(difference) * np.sqrt(difference.size))
        models.append(ComparedModel(name, len(one.unknowns), float(scores[name].sum()), behind, deviation))
    close = [one for one in models if one.behind <= min(CERTAIN * one.uncertainty, OVERWHELMING)]
    simplest = min(close, key=lambda one: (one.unknowns, one.behind))
    ranked = sorted(models, key=lambda one: one.behind)
    return tuple(replace(one, is_best=one is simplest) for one in ranked)


def _scores(found: Identification) -> Array:
    """(blocks,) log density of each block of values, given all others.

    Linearised at the best fit, so that nothing is fitted again: leaving out a block b gives its values the residuals
    (1 - H_bb)^-1 r_b and the covariance (1 - H_bb)^-1, where H = J (J'J + W^2)^-1 J'.
    """
    fit, objective = found.fit, found.fit.objective
    hat = fit.jacobian @ fit.covariance
    noise = objective.factors[objective.noise_index] * np.concatenate([each.scales for each in found.data])
    scores = []
    for place in objective.rows:
        rows = np.arange(place.start, place.stop)
        for block in np.array_split(rows, min(BLOCKS, rows.size)):
            left = np.eye(block.size) - hat[block] @ fit.jacobian[block].T
            r = fit.residuals[block]
            density = -0.5 * r @ np.linalg.solve(left, r) + 0.5 * np.linalg.slogdet(left)[1]
            scores.append(density - np.log(noise[block]).sum() - 0.5 * block.size * np.log(2.0 * np.pi))
    return np.array(scores)
