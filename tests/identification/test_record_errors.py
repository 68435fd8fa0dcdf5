"""Errors of records in time: serial ones widen intervals; those that a trace makes in a log are whitened."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hammer_tests import derivative_errors, unknown
from motor_records import SOFT_TABLES, from_standstill, moves, seen, shown_by, soft_axis
from scipy.signal import lfilter

from guideload.base.arrays import Array
from guideload.identification import identify, parse_place
from guideload.identification.model import Model
from guideload.identification.records import (
    _filtered,
    _filters,
    _larger,
    _levels,
    inflation,
    long_run_root,
)
from guideload.identification.sensor_log import Channel, SensorLog

# ---- serial errors


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


# ---- errors that come from the trace


def ringing(rng: np.random.Generator, count: int, m: int = 1500) -> Array:
    """(count, 2, m) errors of a resonance in two channels."""
    driven = lfilter([1.0], [1.0, -1.9, 0.95], rng.standard_normal((count, m + 500)))[:, 500:]
    return np.stack([driven, 0.5 * np.roll(driven, 3, axis=-1)], axis=1)


def test_whitened_errors_are_white_and_keep_their_density() -> None:
    """Of a process that was not seen: neighbours and channels uncorrelated. The determinant of the filters is 1."""
    rng = np.random.default_rng(1)
    filters = _filters(ringing(rng, 60), np.array([1.0, 1.0]))
    errors = ringing(rng, 60) + rng.standard_normal((60, 2, 1500))
    white = _filtered(filters, errors)[..., filters.shape[2] :]
    size = white.std(axis=(0, 2), keepdims=True)
    for lag in (0, 1, 2, 5, 20):
        now, before = white[..., lag:] / size, white[..., : white.shape[2] - lag] / size
        alike = np.einsum("cit,cjt->ij", now, before) / now[:, 0].size
        assert alike == pytest.approx(np.eye(2) * (lag == 0), abs=0.03)
    at_once = filters[:, :, 0]
    assert np.array_equal(np.diag(at_once), [1.0, 1.0]) and at_once[0, 1] == 0.0


def test_a_log_shows_that_the_band_of_its_trace_is_too_narrow() -> None:
    """The scale of the errors and the noise of the sensors from one log of 1500 values."""
    rng = np.random.default_rng(2)
    drawn = ringing(rng, 20)
    for scale in (1.0, 2.0):
        noise = np.array([[0.7], [1.5]]) * rng.standard_normal((2, 1500))
        found, white = _levels(drawn, scale * ringing(rng, 1)[0] + noise)
        assert found == pytest.approx(scale, rel=0.2)
        assert np.sqrt(white) == pytest.approx([0.7, 1.5], rel=0.1)


def test_the_larger_covariance_counts_in_every_direction() -> None:
    """Of diagonal ones the larger entries, in any basis; never less than either."""
    rng = np.random.default_rng(3)
    basis = rng.standard_normal((3, 3))
    first, second = np.diag([1.0, 3.0, 2.0]), np.diag([2.0, 1.0, 2.5])
    root = _larger(first @ basis, second @ basis)
    assert root.T @ root == pytest.approx(basis.T @ np.diag([4.0, 9.0, 6.25]) @ basis)
    one, other = rng.standard_normal((2, 5, 3))
    root = _larger(one, other)
    for each in (one, other):
        assert np.linalg.eigvalsh(root.T @ root - each.T @ each).min() > -1e-9


def test_a_log_beside_an_encoder() -> None:
    """Derivatives of whitened residuals are exact; the true values lie within 4 standard deviations."""
    machine, rng = soft_axis(), np.random.default_rng(0)
    motion = from_standstill(moves(2.0))
    truth = np.array([0.1, -0.2])
    true = soft_axis(*np.exp(truth))
    channels = [Channel(parse_place(text, machine)) for text in ("tool x", "tool y")]
    stamps = np.arange(0.1, 2.2, 1.0 / 870.0)
    exact = shown_by(true, motion, channels, stamps)
    noisy = exact + 0.05 * exact.std(axis=0) * rng.standard_normal(exact.shape)
    data = SensorLog.of(machine, seen(motion), channels, stamps, noisy, one_clock=True)
    assert replace(data, deviations=()).prepared_for(None, np.zeros(2)).whitening is None
    result = identify(machine, SOFT_TABLES, [data], starts=1)
    sigma = np.sqrt(np.diag(result.covariance))[:2]
    assert np.all(abs(result.fit.minimum.x[:2] - truth) < 4.0 * sigma) and np.all(sigma < 0.1)
    (settled,), model = result.data, Model(machine, unknown(machine, *SOFT_TABLES))
    z, nuisance = truth + 0.01, np.array([0.1, 0.2])
    residuals = settled.residuals(model.at(z), nuisance)
    assert settled.whitening is not None and not residuals.values[:20].any()
    assert derivative_errors(settled, model, z, nuisance)[0].max() < 1e-5
