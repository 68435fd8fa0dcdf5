"""Errors of records in time: neighbouring ones are alike, so a record tells less than its number of values suggests.

Least squares stays unbiased under such errors, but its covariance is then H^-1 S H^-1 with the long-run covariance S of
the scores (residual times derivative), in place of H^-1 ("sandwich"). S is estimated by equally weighted cosines
(Lazarus, Lewis, Stock and Watson, "HAR Inference", J. Business & Economic Statistics 36, 2018), whose intervals have
their level in short records too, as they use Student's t.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct
from scipy.stats import norm, t

from guideload.base.arrays import Array

COSINES = 0.4  # times n^(2/3): as recommended in the paper
LEVEL = 0.975  # one-sided, of a 95 % interval
ROUNDING = 1e-10  # of the largest eigenvalue: directions below it are not determined


def sums_of_scores(values: Array, slopes: Array, instants: NDArray[np.intp]) -> Array:
    """(instants, k) sums of residual (m,) times derivatives (m, k) over the values of each instant (m,)."""
    sums = np.zeros((int(instants.max()) + 1, slopes.shape[1]))
    np.add.at(sums, instants, values[:, None] * slopes)
    return sums


def long_run_covariance(scores: Array) -> Array:
    """Covariance (k, k) of the sum of scores (n, k) in the order of time, whose errors may be alike over many of them.

    It is widened so that 1.96 standard deviations are the 95 % interval of Student's t.
    """
    n, k = scores.shape[0], np.count_nonzero(scores.any(axis=0))
    count = int(np.clip(round(COSINES * n ** (2.0 / 3.0)), 1, max(n - 1, 1)))
    waves = dct(scores, norm="ortho", axis=0)[1 : count + 1]
    widened = (t.ppf(LEVEL, count) / norm.ppf(LEVEL)) ** 2 * n / max(n - k, 1)
    return np.asarray(widened * n / count * waves.T @ waves)


def inflation(information: Array, spread: Array) -> float:
    """Variance that serial errors add: mean ratio of `spread`, the covariance of the scores, to `information` J^T J.

    Over the directions that the data determine; 1 for independent errors.
    """
    scale = 1.0 / np.sqrt(np.where(np.diag(information) > 0.0, np.diag(information), np.inf))
    values, vectors = np.linalg.eigh(information * np.outer(scale, scale))
    kept = values > ROUNDING * max(float(values.max(initial=0.0)), 0.0)
    if not kept.any():
        return 1.0
    basis = scale[:, None] * vectors[:, kept] / np.sqrt(values[kept])
    return float(np.trace(basis.T @ spread @ basis) / kept.sum())
