"""Errors of records in time: neighbouring ones are alike, so a record is worth less than its number of values.

Least squares stays unbiased under such errors, but its covariance is then H^-1 S H^-1 with the long-run covariance S of
the scores (residual times derivative), in place of H^-1 ("sandwich"). S is estimated by equally weighted cosines
(Lazarus, Lewis, Stock and Watson, "HAR Inference", J. Business & Economic Statistics 36, 2018), whose intervals have
their level in short records too, as they use Student's t.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct, irfft, rfft
from scipy.stats import norm, t

from guideload.base.arrays import Array
from guideload.identification.measured import Measured

COSINES = 0.4  # times n^(2/3): as recommended in the paper, for values at least as independent as those with
WORST = 17.0 / 3.0  # correlation time of e_k = 0.7 e_{k-1} + white; other records count as fewer values
FEWEST = 4  # cosines: fewer make intervals of Student's t very wide
LEAST_LEFT = (
    0.25  # share of independent errors that a fit has not taken up; below, the record is too short to judge
)
WINDOW = 5.0  # correlation times: a sum over more has more noise than it gains
LEVEL = 0.975  # one-sided, of a 95 % interval
ROUNDING = 1e-10  # of the largest eigenvalue: directions below it are not determined


def sums_of_scores(values: Array, slopes: Array, instants: NDArray[np.intp]) -> Array:
    """(instants, k) sums of residual (m,) times derivatives (m, k) over the values of each instant (m,)."""
    sums = np.zeros((int(instants.max()) + 1, slopes.shape[1]))
    np.add.at(sums, instants, values[:, None] * slopes)
    return sums


def long_run_root(scores: Array) -> Array:
    """R (cosines, k), whose R'R is the covariance of the sum of scores (n, k) in the order of time.

    Errors may be alike over many instants. It is widened so that 1.96 standard deviations are the 95 % interval of
    Student's t, and for the errors that the fit has taken up.
    """
    used = np.flatnonzero(scores.any(axis=0))
    n, k = scores.shape[0], used.size
    longest = max((correlation_time(column) for column in scores[:, used].T), default=1.0)
    count = int(np.clip(round(COSINES * min(n, n * WORST / longest) ** (2.0 / 3.0)), FEWEST, max(n - 1, 1)))
    waves = dct(scores, norm="ortho", axis=0)[1 : count + 1]
    left = max(1.0 - k * longest / n, LEAST_LEFT)
    widened = t.ppf(LEVEL, count) / norm.ppf(LEVEL)
    return np.asarray(widened * np.sqrt(n / (count * left)) * waves)


def correlation_time(values: Array) -> float:
    """1 + 2 times the sum of the autocorrelations of values (n,), up to `WINDOW` times itself (Sokal's window).

    1 for independent values; a record of n has as much information on its mean as n over this time independent values.
    """
    n = values.size
    spectrum = np.abs(rfft(values - values.mean(), 2 * n)) ** 2
    correlation = irfft(spectrum)[:n]
    if not correlation[0] > 0.0:
        return 1.0
    times = 2.0 * np.cumsum(correlation / correlation[0]) - 1.0
    enough = np.flatnonzero(np.arange(n) >= WINDOW * times)
    return max(1.0, float(times[enough[0] if enough.size else n - 1]))


def root_of(data: Measured, values: Array, slopes: Array, level: Array) -> Array:
    """R, whose R'R is the covariance of the scores of a record: residuals (m,) times derivatives (m, k).

    level: (m,) of the noise, by which residuals and derivatives are divided already. If a model of the errors gives
    draws, no direction has less than their covariance: errors that ring as long as the record do not show in it.
    """
    assert data.instants is not None
    root = long_run_root(sums_of_scores(values, slopes, data.instants))
    if data.error_draws is None:
        return root
    count = len(data.error_draws)
    widened = t.ppf(LEVEL, count) / norm.ppf(LEVEL)
    return _larger(root, widened / np.sqrt(count) * (data.error_draws / level) @ slopes)


def _larger(first: Array, second: Array) -> Array:
    """R, whose R'R is in every direction the larger one of those of two roots."""
    whole = np.linalg.qr(np.vstack([first, second]), mode="r")
    part = second @ np.linalg.pinv(whole)
    share, directions = np.linalg.eigh(part.T @ part)  # of the second, of their sum
    largest = np.sqrt(np.clip(np.maximum(share, 1.0 - share), 0.0, 1.0))
    return np.asarray(largest[:, None] * (directions.T @ whole))


def inflation(information: Array, root: Array) -> float:
    """Variance that serial errors add: mean ratio of the covariance R'R of the scores to `information` J'J.

    Over the directions that the data determine; 1 for independent errors.
    """
    scale = 1.0 / np.sqrt(np.where(np.diag(information) > 0.0, np.diag(information), np.inf))
    values, vectors = np.linalg.eigh(information * np.outer(scale, scale))
    kept = values > ROUNDING * max(float(values.max(initial=0.0)), 0.0)
    if not kept.any():
        return 1.0
    basis = scale[:, None] * vectors[:, kept] / np.sqrt(values[kept])
    return float(np.square(root @ basis).sum() / kept.sum())
