"""Helpers of the tests of smoothing and traces."""

import numpy as np
from scipy.signal import savgol_filter


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
