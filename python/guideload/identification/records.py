"""Records in time: what they share, their windows, and their errors, which are alike over time.

Windows: measured and predicted values are compared as means over short windows. A mean over a window is the same
operation on both sides, so it does not bias what is identified; it leaves out frequencies that say little and brings a
record of 100 000 samples down to some thousand values.

Serial errors: neighbouring ones are alike, so a record is worth less than its number of values. Least squares stays
unbiased under such errors, but its covariance is then H^-1 S H^-1 with the long-run covariance S of the scores
(residual times derivative), in place of H^-1 ("sandwich"). S is estimated by equally weighted cosines (Lazarus, Lewis,
Stock and Watson, "HAR Inference", J. Business & Economic Statistics 36, 2018), whose intervals have their level in
short records too, as they use Student's t.

Errors of a log that come from the trace are alike over time and channels, as the machine answers to them. The
acceleration that is estimated from a trace deviates from the true one. The sensors feel the true one, so the prediction
from the estimate is off by the response of the machine to the deviation, which rings at its modes for as long as they
are damped little. Draws of the deviation from its posterior, sent through the machine as fitted so far, have the
covariance of these errors. A vector autoregression of them and of the white noise of the sensors predicts each error
from those before, of all channels; what it cannot predict is white. Least squares of these differences are generalised
least squares, which follow from the machine what one sensor says about the error of another.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.fft import dct, irfft, rfft
from scipy.optimize import minimize
from scipy.signal import lfilter
from scipy.stats import norm, t

from guideload.base.arrays import Array, Flags, Indices
from guideload.base.errors import TraceError
from guideload.identification.measured import Measured, Residuals
from guideload.identification.model import Excitation, ModelAt
from guideload.motion.motion import Motion

# ---- windows


FEWEST_WINDOWS = 20  # windows: fewer say nothing about the errors of a record


@dataclass(frozen=True, eq=False)
class Windows:
    """Samples of a record in windows."""

    samples: Indices  # (n,) indices of the samples that are used, ascending
    first: Indices  # (m,) index in `samples` of the first sample of each window

    @classmethod
    def of(cls, time: Array, usable: Flags, length: float, source: str) -> Windows:
        """Windows of `length` seconds without any sample (n,) that is not usable. Raises TraceError if few are left."""
        number = np.floor((time - time[0]) / length) if length else np.arange(time.size)
        _, window = np.unique(number, return_inverse=True)
        whole = np.bincount(window, ~usable) == 0
        samples = np.flatnonzero(whole[window])
        first = np.flatnonzero(np.diff(window[samples], prepend=-1))
        if first.size < FEWEST_WINDOWS:
            raise TraceError(
                f"{source}: expected at least {FEWEST_WINDOWS} windows of {length:.3g} s to compare, got {first.size}: "
                "the record is too short, stands still, or does not overlap with the trace"
            )
        return cls(samples, first)

    @cached_property
    def counts(self) -> Array:
        """(m,) samples of each window."""
        return np.diff(self.first, append=self.samples.size).astype(np.float64)

    def mean(self, values: Array) -> Array:
        """Means (..., m) over the windows of values (..., n) at the used samples."""
        return np.asarray(np.add.reduceat(values, self.first, axis=-1) / self.counts)


# ---- what records share


@dataclass(frozen=True, eq=False)
class Record(Measured):
    """k channels that were recorded beside a motion, compared in m windows.

    time, values  (n,) s, stamps; (n, k)
    levels        (k,) standard deviation of the noise of one value
    """

    name: str
    excitation: Excitation
    time: Array
    values: Array
    windows: Windows
    levels: Array

    @property
    @abstractmethod
    def titles(self) -> tuple[tuple[str, str], ...]:
        """(k,) what each channel measures, and its unit."""

    @abstractmethod
    def predicted(self, model: ModelAt, nuisance: Array) -> tuple[Array, Array, Array]:
        """Means over the windows (k, m), and their derivatives (p, k, m) by unknowns, (q, k, m) by own numbers."""

    @cached_property
    def labels(self) -> tuple[str, ...]:
        return tuple(name for name, _ in self.titles for _ in self.windows.first)

    @cached_property
    def noise_index(self) -> Indices:
        return np.repeat(np.arange(self.levels.size), self.windows.first.size)

    @cached_property
    def instants(self) -> Indices:
        """(k m,) window of each value: errors may be alike for many windows."""
        return np.tile(np.arange(self.windows.first.size), self.levels.size)

    @cached_property
    def window_time(self) -> Array:
        """(m,) s, middle of each window."""
        return self.windows.mean(self.time[self.windows.samples])

    @cached_property
    def measured(self) -> Array:
        """(k, m) measured values, means over the windows."""
        return self.windows.mean(self.values[self.windows.samples].T)

    @cached_property
    def scales(self) -> Array:
        """(k m,) standard deviation of the noise of each mean."""
        return np.asarray(self.levels[:, None] / np.sqrt(self.windows.counts)).ravel()

    def residuals(self, model: ModelAt, nuisance: Array) -> Residuals:
        predicted, by_unknowns, by_nuisance = self.predicted(model, nuisance)
        parts = (predicted - self.measured)[None], by_unknowns, by_nuisance
        scales = self.scales.reshape(self.measured.shape)
        values, by_unknowns, by_nuisance = (
            self._whitened(one / scales).reshape(len(one), -1).T for one in parts
        )
        return Residuals(values[:, 0], by_unknowns, by_nuisance)

    def _whitened(self, series: Array) -> Array:
        """Residuals (..., k, m) or their derivatives, without what a model of their errors predicts."""
        return series

    @property
    def error_draws(self) -> Array | None:
        """(count, k m) draws of the errors of the residuals by this model; None without one."""
        return None


# ---- serial errors


COSINES = 0.4  # times n^(2/3): as recommended in the paper, for values at least as independent as those with
WORST = 17.0 / 3.0  # correlation time of e_k = 0.7 e_{k-1} + white; other records count as fewer values
FEWEST_COSINES = 4  # cosines: fewer make intervals of Student's t very wide
# Share of independent errors that a fit has not taken up; below, the record is too short to judge.
LEAST_LEFT = 0.25
SUMMED = 5.0  # correlation times: a sum over more has more noise than it gains
UPPER_LEVEL = 0.975  # one-sided, of a 95 % interval
ROUNDING = 1e-10  # of the largest eigenvalue: directions below it are not determined


def long_run_root(scores: Array) -> Array:
    """R (cosines, k), whose R'R is the covariance of the sum of scores (n, k) in the order of time.

    Errors may be alike over many instants. It is widened so that 1.96 standard deviations are the 95 % interval of
    Student's t, and for the errors that the fit has taken up.
    """
    used = np.flatnonzero(scores.any(axis=0))
    n, k = scores.shape[0], used.size
    longest = max((correlation_time(column) for column in scores[:, used].T), default=1.0)
    count = int(
        np.clip(round(COSINES * min(n, n * WORST / longest) ** (2.0 / 3.0)), FEWEST_COSINES, max(n - 1, 1))
    )
    waves = dct(scores, norm="ortho", axis=0)[1 : count + 1]
    left = max(1.0 - k * longest / n, LEAST_LEFT)
    return np.asarray(_widening(count) * np.sqrt(n / (count * left)) * waves)


def _widening(degrees: int) -> float:
    """Quantile of Student's t over that of a normal distribution."""
    return float(t.ppf(UPPER_LEVEL, degrees) / norm.ppf(UPPER_LEVEL))


def correlation_time(values: Array) -> float:
    """1 + 2 times the sum of the autocorrelations of values (n,), up to `SUMMED` times itself (Sokal's window).

    1 for independent values; a record of n has as much information on its mean as n over this time independent values.
    """
    n = values.size
    spectrum = np.abs(rfft(values - values.mean(), 2 * n)) ** 2
    correlation = irfft(spectrum)[:n]
    if not correlation[0] > 0.0:
        return 1.0
    times = 2.0 * np.cumsum(correlation / correlation[0]) - 1.0
    enough = np.flatnonzero(np.arange(n) >= SUMMED * times)
    return max(1.0, float(times[enough[0] if enough.size else n - 1]))


def score_root(data: Record, values: Array, slopes: Array, level: Array) -> Array:
    """R, whose R'R is the covariance of the scores of a record: residuals (m,) times derivatives (m, k).

    level: (m,) of the noise, by which residuals and derivatives are divided already. If a model of the errors gives
    draws, no direction has less than their covariance: errors that ring as long as the record do not show in it.
    """
    scores = np.zeros((data.windows.first.size, slopes.shape[1]))  # sums over the values of each window
    np.add.at(scores, data.instants, values[:, None] * slopes)
    root = long_run_root(scores)
    if data.error_draws is None:
        return root
    count = len(data.error_draws)
    return _larger(root, _widening(count) / np.sqrt(count) * (data.error_draws / level) @ slopes)


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


# ---- errors that come from the trace


SAMPLES = 100_000  # of all draws together: they determine the covariance of some hundred lags
MOST_DRAWS = 32
LAGS = 40  # windows, four periods of the highest mode; slower errors are predicted by their recent course
SHORTEST = 10  # lags in a record at least
SLOWEST = 4  # line of a spectrum from which on offset and window do not show
MOST_SCALED = 10.0  # of the errors from the trace
NEAR = 0.02  # change of an unknown's coordinate within which the covariance stays as it is


def draw_deviations(motion: Motion, time: Array) -> tuple[Excitation, ...]:
    """Draws of the acceleration's deviation at times (n,) [s]; none for a motion without uncertainty."""
    if motion.uncertainty is None:
        return ()
    count = int(np.clip(SAMPLES // time.size, 2, MOST_DRAWS))
    stamps = motion.uncertainty.stamps(motion.time)
    drawn = motion.uncertainty.draws(count, np.random.default_rng(0))
    return tuple(Excitation(Motion.along_x(time, np.interp(time, stamps, one)), "rest") for one in drawn)


@dataclass(frozen=True, eq=False)
class Whitening:
    """What is left of the residuals of k channels when each is predicted from those before."""

    z: Array  # (p,) coordinates of the machine that it belongs to
    # (k, k, lags + 1) of channel j in channel i; their determinant is 1, so that densities stay comparable
    filters: Array
    errors: Array  # (count, k m) draws of the errors of the residuals, whitened

    @classmethod
    def of(cls, z: Array, errors: Array, residuals: Array) -> Whitening:
        """errors: draws (count, k, m) of the errors from the trace; residuals: (k, m) of the log."""
        scale, white = _levels(errors, residuals)
        errors = scale * errors
        filters = _filters(errors, white)
        noise = np.random.default_rng(1).standard_normal(errors.shape)
        drawn = _filtered(filters, errors + np.sqrt(white)[:, None] * noise)
        return cls(z.copy(), filters, drawn.reshape(len(drawn), -1))

    def is_near(self, z: Array) -> bool:
        """Whether it is still valid at coordinates (p,) of the machine."""
        return bool(np.all(abs(z - self.z) <= NEAR))

    def __call__(self, series: Array) -> Array:
        """The whitened series (..., k, m)."""
        return _filtered(self.filters, series)


def _levels(errors: Array, residuals: Array) -> tuple[float, Array]:
    """The scale of the errors from the trace, at least 1, and the variance (k,) of the white noise of the channels.

    The most likely ones for the spectra of the residuals (Whittle's likelihood): a band of the trace that is too narrow
    shows in the log.
    """
    window = np.hanning(residuals.shape[1])
    window /= np.linalg.norm(window)
    measured, drawn = (abs(rfft(window * one)) ** 2 for one in (residuals, errors))
    measured, of_trace = measured[:, SLOWEST:], drawn.mean(axis=0)[:, SLOWEST:]
    high = measured[:, -measured.shape[1] // 4 :]

    def minus_log_likelihood(logs: Array) -> tuple[float, Array]:
        scale, white = np.exp(logs[0]), np.exp(logs[1:, None])
        density = scale * of_trace + white
        slope = (1.0 - measured / density) / density
        gradient = np.append((slope * scale * of_trace).sum(), (slope * white).sum(axis=1))
        return float((np.log(density) + measured / density).sum()), gradient

    start = np.append(0.0, np.log(np.median(high, axis=1)))
    bounds = [(0.0, 2.0 * np.log(MOST_SCALED)), *((one - 10.0, one + 10.0) for one in start[1:].tolist())]
    found = minimize(minus_log_likelihood, start, jac=True, bounds=bounds, method="L-BFGS-B")
    return float(np.exp(0.5 * found.x[0])), np.exp(found.x[1:])


def _filters(errors: Array, white: Array) -> Array:
    """The filters (k, k, lags + 1) of a vector autoregression of draws (count, k, m) of errors and white noise (k,)."""
    count, k, m = errors.shape
    lags = min(LAGS, m // SHORTEST)
    products = np.diag(np.repeat(white, lags + 1)) * count * (m - lags)
    for one in errors:  # each value beside those before: rows channel, then time ascending
        recent = sliding_window_view(one, lags + 1, axis=1).transpose(1, 0, 2).reshape(m - lags, -1)
        products += recent.T @ recent
    now = np.arange(lags, k * (lags + 1), lags + 1)
    past = np.setdiff1d(np.arange(k * (lags + 1)), now)
    weights = np.linalg.solve(products[np.ix_(past, past)], products[np.ix_(past, now)]).T
    left = products[np.ix_(now, now)] - weights @ products[np.ix_(past, now)]
    root = np.linalg.cholesky(left)
    mix = np.linalg.inv(root / np.diag(root))
    before = weights.reshape(k, k, lags)[:, :, ::-1]
    return np.asarray(np.einsum("ij,jkl->ikl", mix, np.concatenate([np.eye(k)[:, :, None], -before], axis=2)))


def _filtered(filters: Array, series: Array) -> Array:
    """The filtered series (..., k, m); the first values, which have too few before them, are 0."""
    out = np.zeros_like(series)
    for i, row in enumerate(filters):
        for j, taps in enumerate(row):
            out[..., i, :] += lfilter(taps, [1.0], series[..., j, :], axis=-1)
    out[..., : filters.shape[2] - 1] = 0.0
    return out
