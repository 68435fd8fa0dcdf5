"""Serial errors: the long-run covariance of sums, and intervals that hold for correlated errors."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from guideload.identification.records import inflation, long_run_root

N, MEMORY, SEEDS = 1000, 0.8, 600


def test_interval_of_a_mean_under_correlated_errors() -> None:
    """Errors e_k = 0.8 e_{k-1} + white: the sum of n has nine times the standard deviation of independent ones."""
    white = np.random.default_rng(0).standard_normal((SEEDS, N + 100))
    errors = lfilter([1.0 - MEMORY], [1.0, -MEMORY], white)[:, 100:]
    spreads = np.array([np.linalg.norm(long_run_root(one[:, None])) for one in errors])
    inside = np.mean(abs(errors.sum(axis=1)) < 1.96 * spreads)
    # 0.95 +- 2.6 standard errors of a share of 600, less 0.01 for the n finite.
    assert 0.918 < inside < 0.973
    assert np.median(spreads) == pytest.approx(np.sqrt(N), rel=0.05)


def test_independent_errors_are_not_inflated() -> None:
    rng = np.random.default_rng(1)
    slopes = rng.standard_normal((20_000, 3)) * [1.0, 1e4, 1e-3]
    scores = slopes * rng.standard_normal((20_000, 1))
    assert inflation(slopes.T @ slopes, long_run_root(scores)) == pytest.approx(1.0, abs=0.1)


def test_directions_without_information_do_not_count() -> None:
    rng = np.random.default_rng(2)
    slopes = rng.standard_normal((20_000, 1)) * [[1.0, 1.0, 0.0]]  # the sum of two, never the third
    scores = 2.0 * slopes * rng.standard_normal((20_000, 1))
    # 3 standard errors of the estimated covariance.
    assert inflation(slopes.T @ slopes, long_run_root(scores)) == pytest.approx(4.0, rel=0.25)
