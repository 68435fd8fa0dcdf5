"""Statistics of a study: pure functions on columns of samples, each with a confidence interval.

NaN marks a sample without result and is left out. Every interval holds for independent samples. A Sobol or Latin
hypercube design fills the space more evenly, so that its estimates scatter less and the interval is conservative (for
a Latin hypercube the variance of a mean is at most n/(n - 1) times that of n independent samples: Owen 1997).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import betaincinv
from scipy.stats import binom, norm, rankdata

from guideload.base.arrays import Array
from guideload.base.errors import ValueRefused

CONFIDENCE = 0.95
CURVE = 400  # points of an exceedance curve, more than a picture resolves
TOO_FEW = "too few samples to estimate what drives it"


class Estimates(NamedTuple):
    """Estimated values and the ends of their intervals, arrays of one shape."""

    values: Array
    low: Array
    high: Array


class Estimate(NamedTuple):
    """One estimated value and the ends of its interval."""

    value: float
    low: float
    high: float


class Exceedance(NamedTuple):
    """Limits, increasing, and the probability that a sample reaches each of them."""

    limits: Array
    probability: Estimates


class SobolIndices(NamedTuple):
    """Shares of the variance by factor; rows (factor,): number of rows of the design with results."""

    first: Estimates
    total: Estimates
    rows: NDArray[np.intp]


def known(values: ArrayLike) -> Array:
    """The values that are not NaN, in their order."""
    column = np.asarray(values, dtype=np.float64)
    missing = np.isnan(column)
    return column[~missing] if missing.any() else column


def mean_and_deviation(values: ArrayLike) -> tuple[float, float]:
    """Mean and standard deviation (with n - 1); NaN for too few values."""
    column = known(values)
    with np.errstate(invalid="ignore"):  # an infinite life has no deviation
        mean = float(column.mean()) if column.size else np.nan
        return mean, float(column.std(ddof=1)) if column.size > 1 else np.nan


def quantiles(values: ArrayLike, levels: Sequence[float], confidence: float = CONFIDENCE) -> Estimates:
    """Quantiles with intervals between two order statistics, valid for every distribution.

    The number of samples below a quantile is binomial, which gives the ranks of the ends. The interval contains the
    true quantile with at least this confidence. If n samples cannot bound a quantile, the end is infinite: the 99 %
    quantile needs 368 samples for an upper end at 95 %. The quantile itself is interpolated so that its median is
    unbiased (Hyndman and Fan 1996, definition 8).

    levels : (m,) between 0 and 1. Returns three arrays (m,); NaN without samples. Raises ValueRefused.
    """
    parts = np.asarray(levels, dtype=np.float64)
    if not np.all((parts > 0) & (parts < 1)):
        raise ValueRefused("levels between 0 and 1", list(levels), "e.g. 0.99 for the 99 % quantile")
    tail = (1 - _confidence(confidence)) / 2
    ordered = np.sort(known(values))
    count = ordered.size
    if not count:
        return Estimates(*(np.full(parts.shape, np.nan) for _ in range(3)))
    position = np.clip((count + 1 / 3) * parts + 1 / 3, 1, count)
    below = np.minimum(position.astype(np.intp), max(count - 1, 1))
    left, right = ordered[below - 1], ordered[np.minimum(below, count - 1)]
    share = position - below
    with np.errstate(invalid="ignore"):
        middle = np.where(left == right, left, left + share * (right - left))  # equal: both may be infinite
    bounded = np.concatenate([[-np.inf], ordered, [np.inf]])
    low = bounded[np.asarray(binom.ppf(tail, count, parts), dtype=np.intp)]
    high = bounded[np.asarray(binom.ppf(1 - tail, count, parts), dtype=np.intp) + 1]
    return Estimates(middle, low, high)


def fewest_samples(level: float, confidence: float = CONFIDENCE) -> int:
    """Least number of samples that bound the quantile of this level on both sides; 368 for 99 %."""
    tail = (1 - _confidence(confidence)) / 2
    return int(np.ceil(np.log(tail) / np.log(max(level, 1 - level))))


def probability(counts: ArrayLike, samples: int, confidence: float = CONFIDENCE) -> Estimates:
    """Probability of an event that occurred `counts` times in `samples`, with the interval of Clopper and Pearson.

    Its coverage is never below the confidence, unlike Wilson's interval for rare events. No event in n
    samples still bounds the probability: by about 3.7/n at 95 %.

    counts : any shape. Returns three arrays of this shape; NaN and [0, 1] without samples.
    """
    tail = (1 - _confidence(confidence)) / 2
    hits = np.asarray(counts, dtype=np.float64)
    if samples == 0:
        return Estimates(np.full(hits.shape, np.nan), np.zeros(hits.shape), np.ones(hits.shape))
    misses = samples - hits
    low = np.where(hits > 0, betaincinv(np.maximum(hits, 1), misses + 1, tail), 0.0)
    high = np.where(misses > 0, betaincinv(hits + 1, np.maximum(misses, 1), 1 - tail), 1.0)
    return Estimates(hits / samples, low, high)


def mean_share(shares: ArrayLike, confidence: float = CONFIDENCE) -> Estimate:
    """Mean of shares from 0 to 1, and its interval by the standard error, within 0 and 1; NaN without samples."""
    mean, deviation = mean_and_deviation(shares)
    half = norm.ppf(0.5 + _confidence(confidence) / 2) * deviation / max(known(shares).size, 1) ** 0.5
    low, high = (0.0, 1.0) if np.isnan(half) else (max(mean - half, 0.0), min(mean + half, 1.0))
    return Estimate(mean, float(low), float(high))


def exceedance(values: ArrayLike, confidence: float = CONFIDENCE) -> Exceedance:
    """The probability that a sample reaches a limit, at limits that are samples: from 1 down to 1/n.

    At most about `CURVE` of the samples are limits, denser towards both ends. The intervals of `probability` hold for
    each limit separately.
    """
    ordered = np.sort(known(values))
    count = ordered.size
    half = np.geomspace(1, max(count, 1), CURVE // 2)
    reached = np.unique(np.rint(np.concatenate([half, count + 1 - half])).astype(np.intp))[::-1]
    reached = reached[(reached >= 1) & (reached <= count)]
    limits = ordered[count - reached]
    at_or_above = count - np.searchsorted(ordered, limits, side="left")
    return Exceedance(limits, probability(at_or_above, count, confidence))


def sobol_indices(
    first: ArrayLike, second: ArrayLike, mixed: ArrayLike, confidence: float = CONFIDENCE
) -> SobolIndices:
    """First-order and total Sobol indices from a Saltelli design, by the estimators of SciPy.

    First order (Saltelli et al. 2010): share of the variance due to a factor alone; total (Jansen 1999): including its
    interactions. The factors must be independent. Intervals are asymptotic (delta method: the scatter of numerator and
    variance, row by row), for many independent rows; an estimate near zero may be slightly negative.

    first, second : (n,) results of the matrices A and B
    mixed : (n, factor) results of A with one column of B each
    A row is used for a factor if all three results exist. NaN with fewer than two rows, or for constant results.
    """
    a, b = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    columns = np.asarray(mixed, dtype=np.float64)
    score = float(norm.ppf((1 + _confidence(confidence)) / 2))
    indices = np.full((2, 3, columns.shape[1]), np.nan)
    rows = np.zeros(columns.shape[1], dtype=np.intp)
    for j, column in enumerate(columns.T):
        use = ~(np.isnan(a) | np.isnan(b) | np.isnan(column))
        rows[j] = np.count_nonzero(use)
        if rows[j] < 2:
            continue
        # The mean cancels in theory; it is subtracted because of rounding.
        middle = (a[use].mean() + b[use].mean()) / 2
        x, y, m = a[use] - middle, b[use] - middle, column[use] - middle
        squares = (x**2 + y**2) / 2
        variance = squares.mean()
        if variance <= (1e-14 * middle) ** 2:  # rounding of a constant
            continue
        for which, products in enumerate((y * (m - x), (x - m) ** 2 / 2)):
            index = products.mean() / variance
            error = score * np.std((products - index * squares) / variance, ddof=1) / np.sqrt(rows[j])
            indices[which, :, j] = index, index - error, index + error
    return SobolIndices(Estimates(*indices[0]), Estimates(*indices[1]), rows)


def rank_correlation(
    factors: Iterable[ArrayLike], values: ArrayLike, confidence: float = CONFIDENCE
) -> Estimates:
    """Spearman's rank correlation of each factor with the values; 1 if the values increase with the factor.

    Ties share their mean rank. Intervals by Fisher's transform with the variance of Bonett and Wright (2000),
    for independent samples.

    factors : columns (n,), taken one by one. Returns three arrays (factor,); NaN where either never varies.
    """
    result = np.asarray(values, dtype=np.float64)
    score = float(norm.ppf((1 + _confidence(confidence)) / 2))
    there = ~np.isnan(result)
    common = _standard_ranks(result[there])
    rows = []
    for factor in factors:
        column = np.asarray(factor, dtype=np.float64)
        use = there & ~np.isnan(column)
        ranks = common if np.array_equal(use, there) else _standard_ranks(result[use])
        count = ranks.size
        value = float(np.clip(ranks @ _standard_ranks(column[use]), -1, 1)) if count else np.nan
        low, high = -1.0, 1.0
        if count > 3 and abs(value) < 1:
            error = score * np.sqrt((1 + value**2 / 2) / (count - 3))
            low, high = np.tanh(np.arctanh(value) + np.array([-error, error]))
        elif count > 3:
            low, high = value, value
        rows.append((value, low, high) if not np.isnan(value) else (np.nan,) * 3)
    return Estimates(*np.array(rows, dtype=np.float64).reshape(-1, 3).T)


def _standard_ranks(values: Array) -> Array:
    """Ranks minus their mean, normalised to length 1; NaN for constant values."""
    if values.size < 2 or values.min() == values.max():
        return np.full(values.shape, np.nan)
    ranks: Array = rankdata(values) - (values.size + 1) / 2
    return ranks / np.linalg.norm(ranks)


def _confidence(value: float) -> float:
    if not 0 < value < 1:
        raise ValueRefused("a confidence between 0 and 1", value, "e.g. 0.95")
    return value
