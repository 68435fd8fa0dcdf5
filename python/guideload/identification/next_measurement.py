"""What to measure next: which further measurement shrinks the interval of the figure that matters most.

Nothing is measured for it: at the most probable machine the derivatives of what a measurement would show give how much
it would say.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError
from guideload.identification.intervals import IDENTIFIED
from guideload.identification.measured import Measured
from guideload.identification.result import Identification


@dataclass(frozen=True)
class Candidate:
    """A measurement in a ranking.

    name       of the measurement
    deviation  standard deviation of the figure after it, over the one now: 1 if it adds nothing
    identified unknowns that the data would determine then and do not determine now
    """

    name: str
    deviation: float
    identified: tuple[str, ...]


def ranked(
    found: Identification, candidates: Sequence[Measured], figure: Mapping[str, float] | None = None
) -> tuple[Candidate, ...]:
    """The candidates, the best first.

    candidates  measurements as they would be made; their measured values do not matter
    figure      derivatives of the figure that matters by the values of the unknowns [SI], by the unknowns' names, as
                `sensitivities` gives them; by default the geometric mean of all unknowns' intervals is judged

    Raises ArgumentError for a name that is no unknown and for a figure that depends on none.
    """
    p = len(found.unknowns)
    model, now = found.model, found.covariance[:p, :p]
    gradient = None if figure is None else _by_coordinates(found, figure)
    before = np.linalg.inv(now)
    rows = []
    for one in candidates:
        own = np.array([each.expected for each in one.own])
        there = one.settled(model, own).residuals(model, own)
        spreads = np.array([each.spread for each in one.own])
        after = np.linalg.inv(before + _information(there.by_unknowns, there.by_own, spreads))
        if gradient is None:
            share = float(np.exp(0.5 * (np.linalg.slogdet(after)[1] - np.linalg.slogdet(now)[1]) / p))
        else:
            share = float(np.sqrt((gradient @ after @ gradient) / (gradient @ now @ gradient)))
        identified = tuple(
            unknown.name
            for unknown, was, new in zip(
                found.unknowns, found.intervals, np.sqrt(np.diag(after)), strict=True
            )
            if not was.is_identified and new / unknown.spread <= IDENTIFIED
        )
        rows.append(Candidate(one.name, share, identified))
    # Candidates whose figures differ by rounding alone, as by symmetry, stay in the order given.
    return tuple(sorted(rows, key=lambda row: float(f"{row.deviation:.6g}")))


def _information(by_unknowns: Array, by_own: Array, spreads: Array) -> Array:
    """(p, p) that a measurement gives, whatever its own unknowns are."""
    found = by_unknowns.T @ by_unknowns
    if by_own.shape[1]:
        known = by_own.T @ by_own + np.diag(spreads**-2.0)
        mixed = by_unknowns.T @ by_own
        found = found - mixed @ np.linalg.pinv(known) @ mixed.T
    return np.asarray(found)


def _by_coordinates(found: Identification, figure: Mapping[str, float]) -> Array:
    """Derivatives (p,) of the figure by the coordinates."""
    names = [one.name for one in found.unknowns]
    if strange := [name for name in figure if name not in names]:
        raise ArgumentError(f"figure: expected names of unknowns ({', '.join(names)}), got {strange[0]!r}")
    gradient: Array = found.model.slopes * np.array([figure.get(name, 0.0) for name in names])
    if not gradient.any():
        raise ArgumentError("figure: expected one that depends on an unknown, got derivatives that are all 0")
    return gradient
