"""Statistics of a study: pure functions on columns of samples, each with a confidence interval.

NaN marks a sample without result and is left out. `replicate` is the replicate of each sample in a design of several
independent scrambles, whose scatter gives the standard errors; None: the samples are taken as independent. That is
conservative for one Sobol or Latin hypercube design, which fills the space more evenly (for a Latin hypercube the
variance of a mean is at most n/(n - 1) times that of n independent samples: Owen 1997).
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import betaincinv, ndtri, stdtrit
from scipy.stats import binom, rankdata

from guideload.base.arrays import Array, Flags, Indices
from guideload.base.errors import ValueRefused

CONFIDENCE = 0.95
CURVE = 400  # points of an exceedance curve, more than a picture resolves
# Samples on either side of a share whose scatter over replicates counts; from 8 of n samples beyond a quantile on, n
# also bound it.
FEWEST_EVENTS = 8
TOO_FEW = "too few samples to estimate what drives it"
Replicate = Indices | None


class Estimates(NamedTuple):
    """Estimated values, the ends of their intervals and their standard errors, arrays of one shape."""

    values: Array
    low: Array
    high: Array
    standard_error: Array


class Estimate(NamedTuple):
    """One estimated value, the ends of its interval and its standard error."""

    value: float
    low: float
    high: float
    standard_error: float


class Exceedance(NamedTuple):
    """Limits, increasing, and the probability that a sample reaches each of them."""

    limits: Array
    probability: Estimates


class SobolIndices(NamedTuple):
    """Shares of the variance by factor; rows (factor,): number of rows of the design with results."""

    first: Estimates
    total: Estimates
    rows: Indices


def known(values: ArrayLike) -> Array:
    """The values that are not NaN, in their order."""
    return _known_by_replicate(values, None)[0]


def mean_and_deviation(values: ArrayLike) -> tuple[float, float]:
    """Mean and standard deviation (with n - 1); NaN for too few values."""
    column = known(values)
    with np.errstate(invalid="ignore"):  # an infinite life has no deviation
        mean = float(column.mean()) if column.size else np.nan
        return mean, float(column.std(ddof=1)) if column.size > 1 else np.nan


def mean(values: ArrayLike, confidence: float = CONFIDENCE, replicate: Replicate = None) -> Estimate:
    """Mean with Student's interval; NaN for too few values, or infinite ones."""
    column, replicate = _known_by_replicate(values, replicate)
    average, tail = mean_and_deviation(column)[0], (1 - _confidence(confidence)) / 2
    with np.errstate(invalid="ignore"):
        error, freedom = _error_of_mean(column - average, replicate)
    half = float(stdtrit(freedom, 1 - tail)) * error if freedom else np.nan
    return Estimate(average, average - half, average + half, error)


def quantiles(
    values: ArrayLike,
    levels: ArrayLike,
    confidence: float = CONFIDENCE,
    replicate: Replicate = None,
) -> Estimates:
    """Quantiles with intervals between two order statistics, valid for every distribution.

    Of independent samples, the number below a quantile is binomial, which gives the ranks of the ends. The interval
    contains the true quantile with at least this confidence. Of replicates, the ranks are those of the interval of
    `probability` for a sample below the quantile (Woodruff 1952). If n samples cannot bound a quantile, the end is
    infinite: the 99 % quantile needs 368 samples for an upper end at 95 %. The quantile itself is interpolated so that
    its median is unbiased (Hyndman and Fan 1996, definition 8). The standard error is half the distance of the
    quantiles at the levels one standard error lower and higher; infinite beyond the samples.

    levels : (m,) between 0 and 1. Returns arrays (m,); NaN without samples.
    """
    parts = np.asarray(levels, dtype=np.float64)
    tail = (1 - _confidence(confidence)) / 2
    column, replicate = _known_by_replicate(values, replicate)
    ordered = np.sort(column)
    count = ordered.size
    if not count:
        return Estimates(*(np.full(parts.shape, np.nan) for _ in range(4)))
    places = np.arange(1.0, count + 1.0)
    middle = np.interp(_position(parts, count), places, ordered)
    below = np.array([counted(column <= value, replicate) for value in middle]).T
    sizes = counted(np.ones(count, dtype=np.bool_), replicate)
    error, effective = _proportion(parts, below, sizes, tail)
    ranks = _ranks(tail, count, tuple(parts.tolist()))
    if sizes.size > 1:
        from_replicates = effective != count  # elsewhere the samples are too few, and count as independent
        low, high = _clopper_pearson(parts, effective, tail)
        ends = np.floor(count * low), np.ceil(count * high)
        ranks = np.where(from_replicates, ends[0], ranks[0]), np.where(from_replicates, ends[1], ranks[1])
    bounded = np.concatenate([[-np.inf], ordered, [np.inf]])
    first, last = (bounded[np.asarray(rank, dtype=np.intp)] for rank in ranks)
    near = np.array([_position(np.clip(parts + sign * error, 0, 1), count) for sign in (-1, 1)])
    inside = (near[0] >= 1) & (near[1] <= count)
    with np.errstate(invalid="ignore"):
        lower, upper = (np.interp(one, places, ordered) for one in near)
        return Estimates(middle, first, last, np.where(inside, (upper - lower) / 2, np.inf))


@lru_cache
def _ranks(tail: float, count: int, levels: tuple[float, ...]) -> tuple[Array, Array]:
    """Ranks of the ends of the intervals of quantiles, the same for all columns of a study."""
    low, high = np.asarray(binom.ppf([[tail], [1 - tail]], count, levels))
    return low, high + 1


def _position(levels: Array, count: int) -> Array:
    """Places of quantiles among `count` ordered samples, the first of which is at 1."""
    return np.asarray((count + 1 / 3) * levels + 1 / 3)


def fewest_samples(level: float) -> int:
    """Least number of samples that bound the quantile of this level on both sides; 368 for 99 %."""
    return int(np.ceil(np.log((1 - CONFIDENCE) / 2) / np.log(max(level, 1 - level))))


def counted(event: Flags, replicate: Replicate) -> Array:
    """(replicates,) how often an event occurred in each replicate; (1,) of independent samples."""
    if replicate is None:
        return np.array([np.count_nonzero(event)], dtype=np.float64)
    return np.bincount(replicate[event], minlength=int(replicate.max(initial=0)) + 1).astype(np.float64)


def probability(counts: ArrayLike, samples: ArrayLike, confidence: float = CONFIDENCE) -> Estimates:
    """Probability of an event that occurred `counts` times in `samples`, with the interval of Clopper and Pearson.

    Its coverage is never below the confidence, unlike Wilson's interval for rare events. No event in n
    samples still bounds the probability: by about 3.7/n at 95 %. Of several replicates, the interval is that of as many
    independent samples as have the same standard error (Korn and Graubard 1998).

    counts : any shape, or with replicates (replicate, ...)
    samples : their number, or with replicates (replicate,)
    Returns arrays (...); NaN and [0, 1] without samples.
    """
    tail = (1 - _confidence(confidence)) / 2
    hits, sizes = np.asarray(counts, dtype=np.float64), np.asarray(samples, dtype=np.float64)
    if sizes.ndim == 0:
        hits, sizes = hits[None], sizes[None]
    total = sizes.sum()
    if total == 0:
        nothing = np.full(hits.shape[1:], np.nan)
        return Estimates(nothing, np.zeros_like(nothing), np.ones_like(nothing), nothing)
    share = hits.sum(axis=0) / total
    error, effective = _proportion(share, hits, sizes, tail)
    return Estimates(share, *_clopper_pearson(share, effective, tail), error)


def _proportion(share: Array, counts: Any, samples: Any, tail: float) -> tuple[Array, Array]:
    """Standard error of a share (...), and the number of independent samples whose interval it has.

    counts (replicate, ...) in `samples` (replicate,). Where fewer samples than replicates, or than `FEWEST_EVENTS`,
    have the event or have it not, their scatter says nothing, and the samples count as independent. A count is a whole
    number, so that its scatter in a replicate is at least that of rounding. The standard error of a share of 0 or 1 is
    unknown, NaN.
    """
    total, there = samples.sum(), samples > 0
    binomial = total * share * (1 - share)
    variance, effective = binomial, np.full(np.shape(share), total)
    if (replicates := int(np.count_nonzero(there))) > 1:
        sizes = samples[there].reshape(-1, *(1 for _ in np.shape(share)))
        rest = counts[there] - sizes * (counts.sum(axis=0) / total)
        scatter = replicates / (replicates - 1) * (rest**2).sum(axis=0)
        scatter = np.maximum(scatter, np.minimum(binomial, replicates / 12))
        enough = np.minimum(share, 1 - share) * total >= max(replicates, FEWEST_EVENTS)
        variance = np.where(enough, scatter, binomial)
        ratio = (ndtri(tail) / stdtrit(replicates - 1, tail)) ** 2
        with np.errstate(invalid="ignore", divide="ignore"):
            effective = np.where(enough, total * ratio * binomial / variance, effective)
    return np.where(variance > 0, np.sqrt(variance) / total, np.nan), effective


def _clopper_pearson(share: Array, samples: Array, tail: float) -> tuple[Array, Array]:
    hits, misses = share * samples, (1 - share) * samples
    low = np.where(hits > 0, betaincinv(np.where(hits > 0, hits, 1.0), misses + 1, tail), 0.0)
    high = np.where(misses > 0, betaincinv(hits + 1, np.where(misses > 0, misses, 1.0), 1 - tail), 1.0)
    return low, high


def mean_share(shares: ArrayLike, confidence: float = CONFIDENCE, replicate: Replicate = None) -> Estimate:
    """Mean of shares from 0 to 1, and its interval by the standard error, within 0 and 1; NaN without samples."""
    value, low, high, error = mean(shares, confidence, replicate)
    low, high = (0.0, 1.0) if np.isnan(low) else (max(low, 0.0), min(high, 1.0))
    return Estimate(value, low, high, error)


def _known_by_replicate(values: ArrayLike, replicate: Replicate) -> tuple[Array, Replicate]:
    """The values that are not NaN, and their replicates."""
    column = np.asarray(values, dtype=np.float64)
    missing = np.isnan(column)
    if not missing.any():
        return column, replicate
    return column[~missing], None if replicate is None else replicate[~missing]


def _error_of_mean(residuals: Array, replicate: Replicate) -> tuple[float, int]:
    """Standard error of a mean, from the differences of the samples from it; and its degrees of freedom."""
    sums = residuals if replicate is None else np.bincount(replicate, residuals)
    groups = residuals.size if replicate is None else int(np.count_nonzero(np.bincount(replicate)))
    if groups < 2:
        return np.nan, 0
    return float(np.sqrt(groups / (groups - 1) * (sums @ sums)) / residuals.size), groups - 1


def exceedance(values: ArrayLike, confidence: float = CONFIDENCE, replicate: Replicate = None) -> Exceedance:
    """The probability that a sample reaches a limit, at limits that are samples: from 1 down to 1/n.

    At most about `CURVE` of the samples are limits, denser towards both ends. The intervals of `probability` hold for
    each limit separately.
    """
    column, replicate = _known_by_replicate(values, replicate)
    ordered = np.sort(column)
    count = ordered.size
    half = np.geomspace(1, max(count, 1), CURVE // 2)
    reached = np.unique(np.rint(np.concatenate([half, count + 1 - half])).astype(np.intp))[::-1]
    reached = reached[(reached >= 1) & (reached <= count)]
    limits = ordered[count - reached]
    parts = [ordered]
    if replicate is not None:
        parts = [np.sort(column[replicate == i]) for i in range(int(replicate.max(initial=0)) + 1)]
    at_or_above = [part.size - np.searchsorted(part, limits, side="left") for part in parts]
    return Exceedance(limits, probability(at_or_above, [part.size for part in parts], confidence))


def sobol_indices(
    first: ArrayLike,
    second: ArrayLike,
    mixed: ArrayLike,
    confidence: float = CONFIDENCE,
    replicate: Replicate = None,
) -> SobolIndices:
    """First-order and total Sobol indices from a Saltelli design, by the estimators of SciPy.

    First order (Saltelli et al. 2010): share of the variance due to a factor alone; total (Jansen 1999): including its
    interactions. The factors must be independent. Intervals are asymptotic (delta method: the scatter of numerator and
    variance, row by row), for many independent rows; an estimate near zero may be slightly negative.

    first, second : (n,) results of the matrices A and B
    mixed : (n, factor) results of A with one column of B each
    replicate : (n,) of the rows
    A row is used for a factor if all three results exist. NaN with fewer than two rows, or for constant results.
    """
    a, b = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    columns = np.asarray(mixed, dtype=np.float64)
    upper = (1 + _confidence(confidence)) / 2
    indices = np.full((2, 4, columns.shape[1]), np.nan)
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
            error, freedom = _error_of_mean(
                (products - index * squares) / variance, None if replicate is None else replicate[use]
            )
            half = stdtrit(freedom, upper) * error
            indices[which, :, j] = index, index - half, index + half, error
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
    score = float(ndtri((1 + _confidence(confidence)) / 2))
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
        error = np.sqrt((1 + value**2 / 2) / (count - 3)) if count > 3 else np.nan  # of the transform
        if count > 3 and abs(value) < 1:
            low, high = np.tanh(np.arctanh(value) + score * np.array([-error, error]))
        elif count > 3:
            low, high = value, value
        rows.append((value, low, high, (1 - value**2) * error) if not np.isnan(value) else (np.nan,) * 4)
    return Estimates(*np.array(rows, dtype=np.float64).reshape(-1, 4).T)


def _standard_ranks(values: Array) -> Array:
    """Ranks minus their mean, normalised to length 1; NaN for constant values."""
    if values.size < 2 or values.min() == values.max():
        return np.full(values.shape, np.nan)
    ranks: Array = rankdata(values) - (values.size + 1) / 2
    return ranks / np.linalg.norm(ranks)


def _confidence(value: float) -> float:
    if not 1e-9 <= value < 1:
        raise ValueRefused("a confidence between 0 and 1", value, "e.g. 0.95")
    return value
