"""Directions among the unknowns that the data cannot determine, in words such as "k_y of 1 and 2: only their sum"."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from guideload.base.arrays import Array
from guideload.identification.intervals import NORMAL_QUANTILE
from guideload.identification.names import together, usual_unit
from guideload.identification.unknowns import Unknown

LEAST_INFORMATION = 3.0  # of a determined direction: it halves what was uncertain before
LINKED = 0.1  # share of an undetermined direction from which on unknowns belong together
SUM = "only their sum"
EQUAL = 0.1  # relative difference of coefficients that are called equal


@dataclass(frozen=True)
class Undetermined:
    """Unknowns of which the data determine fewer combinations than there are.

    names         of the unknowns
    combinations  how many the data determine
    words         in words
    """

    names: tuple[str, ...]
    combinations: int
    words: str


def undetermined(
    unknowns: Sequence[Unknown], z: Array, information: Array, covariance: Array
) -> tuple[Undetermined, ...]:
    """The groups of unknowns that the data do not separate; information, covariance: see the file of that name."""
    sizes, vectors = np.linalg.eigh(information)
    weak = vectors[:, sizes < LEAST_INFORMATION]
    shares = weak @ weak.T
    found = []
    for group in _connected(abs(shares) > LINKED):
        if shares[group, group].max() <= LINKED:
            continue
        inside = np.linalg.eigvalsh(shares[np.ix_(group, group)])
        determined = len(group) - int((inside > 0.5).sum())
        words = _words(unknowns, z, group, determined, shares)
        if words.endswith(SUM):
            words += _sum(unknowns, z, group, covariance)
        found.append(Undetermined(tuple(unknowns[i].name for i in group), determined, words))
    return tuple(found)


def _connected(linked: Array) -> list[list[int]]:
    """Groups of indices that are linked directly or through others."""
    from scipy.sparse.csgraph import connected_components

    label = connected_components(linked, directed=False)[1]
    return [np.flatnonzero(label == i).tolist() for i in range(label.max() + 1)]


def _words(unknowns: Sequence[Unknown], z: Array, group: list[int], determined: int, shares: Array) -> str:
    names = together([unknowns[i].name for i in group])
    if determined == 0:
        return f"{names}: these data say nothing about {'it' if len(group) == 1 else 'them'}"
    if determined > 1:
        return f"{names}: only {determined} combinations of these {len(group)} numbers"
    block = np.eye(len(group)) - shares[np.ix_(group, group)]
    along = np.linalg.eigh(block)[1][:, -1] / [unknowns[i].spread for i in group]  # of the coordinates z
    by_value = along / [unknowns[i].slope(z[i]) for i in group]
    one_unit = len({unknowns[i].unit for i in group}) == 1
    if one_unit and _equal(by_value):
        return f"{names}: {SUM}"
    if len(group) == 2 and one_unit and _equal(by_value * [1.0, -1.0]):
        return f"{names}: only their difference"
    if _equal(along):
        return f"{names}: only their product"
    if len(group) == 2 and _equal(along * [1.0, -1.0]):
        return f"{names}: only their ratio"
    if one_unit:
        factors = by_value / by_value[np.argmax(abs(by_value))]
        terms = (f"{f:+.2g} {together([unknowns[i].name])}" for f, i in zip(factors, group, strict=True))
        return f"{names}: only {' '.join(terms).removeprefix('+')}"
    return f"{names}: only one combination of these {len(group)} numbers"


def _sum(unknowns: Sequence[Unknown], z: Array, group: list[int], covariance: Array) -> str:
    """Value of the sum and its 95 % interval."""
    value = sum(unknowns[i].value(z[i]) for i in group)
    slopes = np.array([unknowns[i].slope(z[i]) for i in group])
    half = NORMAL_QUANTILE * float(np.sqrt(slopes @ covariance[np.ix_(group, group)] @ slopes))
    unit, scale = usual_unit(unknowns[group[0]].unit)
    return f", {scale * value:.4g} {unit} ({scale * (value - half):.4g} to {scale * (value + half):.4g})"


def _equal(numbers: Array) -> bool:
    return bool(np.ptp(numbers) <= EQUAL * abs(numbers).max())
