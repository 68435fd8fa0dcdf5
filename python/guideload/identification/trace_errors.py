"""Errors of a log that come from the trace: they are alike over time and channels, as the machine answers to them.

The acceleration that is estimated from a trace deviates from the true one. The sensors feel the true one, so the
prediction from the estimate is off by the response of the machine to the deviation, which rings at its modes for as
long as they are damped little. Draws of the deviation from its posterior, sent through the machine as fitted so far,
have the covariance of these errors. A vector autoregression of them and of the white noise of the sensors predicts
each error from those before, of all channels; what it cannot predict is white. Least squares of these differences are
generalised least squares, which follow from the machine what one sensor says about the error of another.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.fft import rfft
from scipy.optimize import minimize
from scipy.signal import lfilter

from guideload.base.arrays import Array
from guideload.identification.excitation import Excitation
from guideload.motion.motion import Motion

SAMPLES = 100_000  # of all draws together: they determine the covariance of some hundred lags
MOST_DRAWS = 32
LAGS = 40  # windows, four periods of the highest mode; slower errors are predicted by their recent course
SHORTEST = 10  # lags in a record at least
SLOWEST = 4  # line of a spectrum from which on offset and window do not show
MOST_SCALED = 10.0  # of the errors from the trace
NEAR = 0.02  # change of an unknown's coordinate within which the covariance stays as it is


def deviations_of(motion: Motion, time: Array) -> tuple[Excitation, ...]:
    """Draws of the acceleration's deviation at times (n,) [s]; none for a motion without uncertainty."""
    if motion.uncertainty is None:
        return ()
    count = int(np.clip(SAMPLES // time.size, 2, MOST_DRAWS))
    stamps = motion.time if motion.uncertainty.time is None else motion.uncertainty.time
    drawn = motion.uncertainty.draws(count, np.random.default_rng(0))
    return tuple(Excitation(Motion.along_x(time, np.interp(time, stamps, one)), "rest") for one in drawn)


@dataclass(frozen=True, eq=False)
class Whitening:
    """What is left of the residuals of k channels when each is predicted from those before.

    z        (p,) coordinates of the machine that it belongs to
    filters  (k, k, lags + 1) of channel j in channel i; their determinant is 1, so that densities stay comparable
    errors   (count, k m) draws of the errors of the residuals, whitened
    """

    z: Array
    filters: Array
    errors: Array

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
        """Whether it still fits a machine."""
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
