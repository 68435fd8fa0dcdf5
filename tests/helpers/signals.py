"""Helpers of the tests of smoothing and traces."""

import numpy as np
import reference as ref
from scipy.signal import savgol_filter

from guideload import _core


def rms(x):
    return float(np.sqrt(np.mean(np.square(x))))


def rounded(value, quantum):
    return np.round(value / quantum) * quantum


def best_filter_error(value, acceleration, rate, orders, lengths):
    """Smallest rms error of Savitzky-Golay filters, chosen with the true acceleration."""
    return min(
        rms(savgol_filter(value, length, order, deriv=2, delta=1.0 / rate) - acceleration)
        for order in orders
        for length in np.unique(np.asarray(lengths, int) // 2 * 2 + 1)
        if length > order
    )


def check_draws(found, seed, count=600):
    """Draws scatter as the posterior of the acceleration, which is the band where this is wider, and never less."""
    posterior = found.uncertainty
    nothing = np.zeros((found.time.size, 0, 6)), [], np.zeros((0, 3))
    model = posterior.model, posterior.derivative, posterior.unit
    deviation, *_ = _core.load_spread(ref.cart().scene, *model, found.time, found.time, *nothing)
    drawn = found.draws(count, np.random.default_rng(seed)).std(axis=0)
    np.testing.assert_allclose(drawn, deviation, rtol=5.0 / np.sqrt(2.0 * count))
    band, wider = np.sqrt(found.acceleration_variance), posterior.unit > posterior.unit.min() * (1.0 + 1e-9)
    assert (deviation > band * (1.0 - 1e-6)).all()
    np.testing.assert_allclose(deviation[wider], band[wider], rtol=1e-6)
