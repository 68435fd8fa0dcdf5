"""Laws of the smoother: it is the Gaussian posterior; adapting pays; the band tells the truth."""

import sys
from itertools import product
from math import factorial
from pathlib import Path

import make_example_trace as example
import numpy as np
import pytest
from scipy.signal import savgol_filter

from guideload import _core
from guideload.base.errors import TraceError
from guideload.motion.resolution import ramp_time, sudden_change
from guideload.smoothing.estimation import ORDERS, estimate
from guideload.smoothing.kinematics import Kind
from guideload.traces.reading import read_trace

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
from traces import FAMILIES, case

RNG_SEED = 5


def rms(x):
    return float(np.sqrt(np.mean(np.square(x))))


def free_motion(states, step):
    """Transition and noise of a step from the definition: integrals of monomials over factorials."""
    phi = np.array(
        [
            [step ** (j - i) / factorial(j - i) if j >= i else 0.0 for j in range(states)]
            for i in range(states)
        ]
    )
    noise = np.zeros((states, states))
    for i, j in product(range(states), repeat=2):
        a, b = states - 1 - i, states - 1 - j
        noise[i, j] = step ** (a + b + 1) / ((a + b + 1) * factorial(a) * factorial(b))
    return phi, noise


def dense(states, step, value, variance, mean, covariance, intensity):
    """Posterior of all states at once, by the textbook's formula for jointly normal numbers; and log likelihood."""
    count = value.size
    means, blocks = [mean], [[covariance]]
    for k in range(count - 1):
        phi, noise = free_motion(states, step[k])
        means.append(phi @ means[-1])
        row = [phi @ block for block in blocks[-1]]
        blocks.append([*row, row[-1] @ phi.T + intensity[k] * noise])
    full = np.block(
        [[blocks[i][j] if j <= i else blocks[j][i].T for j in range(count)] for i in range(count)]
    )
    seen = np.kron(np.eye(count), np.eye(states)[:1])
    total = seen @ full @ seen.T + np.diag(variance)
    rest = value - seen @ np.concatenate(means)
    gain = full @ seen.T @ np.linalg.inv(total)
    likelihood = -0.5 * (np.linalg.slogdet(total)[1] + rest @ np.linalg.solve(total, rest))
    return np.concatenate(means) + gain @ rest, full - gain @ seen @ full, likelihood


def problem(states, count=12):
    rng = np.random.default_rng(RNG_SEED)
    step = rng.uniform(0.1, 0.3, count - 1)
    value = np.cumsum(rng.standard_normal(count))
    variance = rng.uniform(0.1, 0.4, count)
    covariance = np.diag(4.0 * np.arange(1.0, states + 1.0))
    cell = (np.arange(count - 1) // 3).astype(np.uint32)
    intensity = np.array([1.0, 100.0, 1e-2, 30.0])
    return (step, value, variance, 0.1 * np.ones(states), covariance, cell, intensity)


@pytest.mark.parametrize("states", [2, 3, 4, 5, 6])
def test_the_kernels_are_the_posterior_of_jointly_normal_numbers(states):
    given = problem(states)
    mean, covariance, likelihood = dense(states, *given[:5], given[6][given[5]])
    found, variance, residual = _core.smooth_motion(given)
    for i in range(min(states, 3)):
        np.testing.assert_allclose(found[:, i], mean[i::states], rtol=1e-5, atol=1e-6)
        np.testing.assert_allclose(variance[:, i], np.diag(covariance)[i::states], rtol=1e-6)
    determinant, misfit = _core.motion_likelihood(given)
    assert -0.5 * (determinant + misfit) == pytest.approx(likelihood, rel=1e-9)
    # Without sample 5, the estimate of it and its variance.
    step, value, noise, *rest = given
    without, spread, _ = _core.smooth_motion(
        (step, value, np.where(np.arange(value.size) == 5, 1e12, noise), *rest)
    )
    assert residual[5, 0] / residual[5, 1] == pytest.approx(value[5] - without[5, 0], rel=1e-6)
    assert 1.0 / residual[5, 1] == pytest.approx(spread[5, 0] + noise[5], rel=1e-6)


def test_adapting_never_lowers_the_likelihood():
    step, value, _, mean, covariance, cell, intensity = problem(4, 13)
    level = 4.0  # far above the noise, and its floor: it stays
    variance = np.full(13, level)
    known = -np.inf
    for _ in range(12):
        given = step, value, variance, mean, covariance, cell, intensity
        determinant, misfit = _core.motion_likelihood(given)
        assert -(determinant + misfit) > known - 1e-9
        known = -(determinant + misfit)
        intensity, found, sites, noises, *_ = _core.adapt_motion(
            given, value, 0.0, level, (1, 0.1, 0.0, level)
        )
        # Without rounding a site is its sample.
        assert found == level and noises == pytest.approx(variance) and sites == pytest.approx(value)


def test_the_noise_before_rounding_is_found_whatever_the_quantum():
    """A slow sine: many samples in a quantum. Rounding adds quantum^2/12 to nothing here."""
    time = np.arange(4000) * 1e-3
    true = 0.01 * np.sin(2.0 * np.pi * time)
    rng = np.random.default_rng(RNG_SEED)
    for noise in (0.3, 1.0, 3.0):
        value = 1e-4 * np.round((true + noise * 1e-4 * rng.standard_normal(time.size)) / 1e-4)
        assert estimate(time, value, "position", 1e-4).noise == pytest.approx(noise * 1e-4, rel=0.1)
    assert estimate(time, 1e-4 * np.round(true / 1e-4), "position", 1e-4).noise < 0.1e-4


def test_bounds_tell_more_than_noise_of_the_same_size():
    """Creeping through a quantum in many samples: its changes tell the place far better than their number does."""
    time = np.arange(3000) * 1e-3
    true, acceleration = 1e-3 * np.sin(np.pi * time), -1e-3 * np.pi**2 * np.sin(np.pi * time)
    value = 1e-4 * np.round(true / 1e-4)
    inner = slice(200, -200)
    known = rms((estimate(time, value, "position", 1e-4).acceleration - acceleration)[inner])
    unknown = rms((estimate(time, value, "position").acceleration - acceleration)[inner])
    assert known < 0.1 * unknown and known < 0.05 * rms(acceleration)


@pytest.mark.parametrize(("kind", "power"), [("position", 2), ("velocity", 1)])
def test_what_every_order_leaves_alone_is_reproduced_on_uneven_stamps(kind: Kind, power):
    """Constant acceleration: its derivatives are nought, whatever the order."""
    time = np.sort(np.random.default_rng(RNG_SEED).uniform(0.0, 2.0, 400)) + 1e3
    poly = np.polynomial.Polynomial([0.3, -1.2, 0.7][: power + 1])
    since = time - time[0]
    found = estimate(time, poly(since), kind)
    true = poly.deriv(2 if kind == "position" else 1)(since)
    assert np.abs(found.acceleration - true).max() < 1e-4


@pytest.mark.parametrize("family", FAMILIES)
def test_better_than_the_best_filter_chosen_with_the_truth_and_the_band_covers(family):
    """Eight draws each; means, for single cases scatter (tests/benchmarks/encoder.py shows them all)."""
    rng = np.random.default_rng(RNG_SEED)
    ratios, covers = [], []
    for rate, quantum in product((250.0, 1000.0), (1e-7, 1e-6, 1e-5, 8e-5)):
        one = case(family, rate, quantum, 0.0, 0.5, rng)
        best = min(
            rms(savgol_filter(one.value, length, order, deriv=2, delta=1.0 / rate) - one.acceleration)
            for order in (2, 4, 6)
            for length in np.unique(np.geomspace(order + 1, 0.3 * rate, 20).astype(int) // 2 * 2 + 1)
            if length > order
        )
        found = estimate(one.time, one.value, "position", quantum)
        error = found.acceleration - one.acceleration
        ratios.append(rms(error) / best)
        covers.append(np.mean(np.abs(error) < 1.96 * np.sqrt(found.acceleration_variance)))
    assert np.exp(np.mean(np.log(ratios))) < 0.95
    assert 0.90 < np.mean(covers) < 0.98


def test_jumps_are_found_where_they_are_and_a_sine_has_none():
    time = np.arange(0.0, 4.0, 1e-3)
    corners = np.array([0.5, 1.0, 2.0, 2.5])
    speed = np.interp(time, corners, [0.0, 1.0, 1.0, 0.0])
    place = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * 1e-3)])
    rng = np.random.default_rng(RNG_SEED)
    found = estimate(
        time, np.round((place + 1e-6 * rng.standard_normal(time.size)) / 1e-6) * 1e-6, "position", 1e-6
    )
    assert found.order in (3, 4)
    for corner in corners:
        assert np.any((found.jumps[:, 0] <= corner + 0.01) & (found.jumps[:, 1] >= corner - 0.01))
    assert rms(found.acceleration[(time > 0.6) & (time < 0.9)] - 2.0) < 0.01
    assert rms(found.acceleration[time < 0.4]) < 0.01
    sine = np.round((np.sin(6.0 * time) + 1e-5 * rng.standard_normal(time.size)) / 1e-5) * 1e-5
    assert estimate(time, sine, "position", 1e-5).jumps.size == 0


def test_draws_of_the_acceleration_scatter_as_the_band_says():
    time = np.arange(0.0, 2.0, 1e-3)
    value = np.round((0.1 * np.sin(3.0 * time)) / 1e-5) * 1e-5
    found = estimate(time, value, "position", 1e-5)
    drawn = found.draws(300, np.random.default_rng(RNG_SEED))
    assert drawn.shape == (300, time.size)
    ratio = drawn.std(axis=0) / np.sqrt(found.acceleration_variance)
    assert np.abs(ratio - 1.0).max() < 5.0 / np.sqrt(600.0)  # 5 standard deviations of a scatter
    again = found.draws(1, np.random.default_rng(RNG_SEED))
    assert np.array_equal(again[0], drawn[0])


@pytest.mark.parametrize("kind", ["position", "velocity"])
def test_both_kinds_choose_an_order_and_tell_it(kind: Kind):
    time = example.times()
    position, velocity, acceleration = example.motion(time)
    value, quantum = (position, 1e-6) if kind == "position" else (velocity, 1e-4)
    found = estimate(time, np.round(value / quantum) * quantum, kind, quantum)
    assert found.order in ORDERS
    assert rms(found.acceleration - acceleration) < 0.02 * rms(acceleration)
    assert found.noise < 0.2 * quantum  # there is none but rounding
    assert str(found.order) in found.note


@pytest.mark.parametrize("edge", [0.0, 0.085])
def test_only_a_sudden_change_may_have_been_sudden(edge):
    """Noise alone limits what a trace shows, not the duration of the changes that are in it."""
    time = np.arange(0.0, 2.0, 1e-3)
    acceleration = 2.2 * np.interp(time, [0.5 - 1e-9, 0.5 + edge, 1.3 - 1e-9, 1.3 + edge], [0, 1, 1, 0])
    velocity = np.cumsum(acceleration) * 1e-3 + 2e-4 * np.random.default_rng(RNG_SEED).normal(size=time.size)
    found = estimate(time, velocity, "velocity")
    ramp = ramp_time(found.bandwidth)
    assert 1e-3 < ramp < 0.02
    sudden = sudden_change(time, found.acceleration, ramp)
    assert (sudden > 0.9 * 2.2) if edge == 0.0 else (sudden < 0.2 * 2.2)


def test_no_more_is_shown_than_half_the_samples_rate():
    time = np.arange(0.0, 6.0, 0.1)
    velocity = np.clip(time - 1.0, 0.0, 1.0) - np.clip(time - 4.0, 0.0, 1.0)
    assert estimate(time, velocity, "velocity", 1e-4).bandwidth <= 5.0


@pytest.mark.parametrize("quantum", [1e-5, 2e-5])
def test_a_log_with_long_gaps_is_smoothed(quantum):
    """Of a log on change, where orders that a gap takes beyond the range of doubles are no choice."""
    time = np.arange(0.0, 7.0, 1e-3)
    edges = np.ravel([[start, start + 0.03] for start in (0.6, 1.4, 2.4, 3.2, 3.8, 4.6, 5.6, 6.4)])
    levels = [0, 0, 2, 2, 0, 0, -2, -2, 0, 0, -2, -2, 0, 0, 2, 2, 0, 0]
    acceleration = np.interp(time, [0.0, *edges, 7.0], levels)
    velocity = np.r_[0.0, np.cumsum(acceleration[1:] + acceleration[:-1]) * 5e-4]
    place = np.r_[0.0, np.cumsum(velocity[1:] + velocity[:-1]) * 5e-4]
    rounded = np.round(place / quantum) * quantum
    changed = np.r_[True, np.diff(rounded) != 0.0]
    changed[-1] = True
    trace = read_trace({"t_s": time[changed], "x_m": rounded[changed]})
    assert trace.clock == "on_change" and np.diff(trace.time).max() > 0.3
    found = estimate(trace.time, trace.value, "position", quantum)
    assert np.isfinite(found.acceleration_variance).all()
    true = np.interp(trace.time, time, acceleration)
    assert rms(found.acceleration - true) < 0.02 * rms(true)


def test_equal_samples_have_neither_acceleration_nor_band():
    found = estimate(np.arange(20.0), np.full(20, 0.1), "position", 1e-6)
    assert not found.acceleration.any() and not found.acceleration_variance.any()
    assert np.array_equal(found.draws(2, np.random.default_rng(1)), np.zeros((2, 20)))


def test_refusals_tell_the_place():
    with pytest.raises(TraceError, match="at least 8 samples, got 7"):
        estimate(np.arange(7.0), np.arange(7.0))
    time = np.arange(20.0)
    time[5] = 3.0
    with pytest.raises(TraceError, match=r"time\[5\]: expected more than 4.0 s, got 3.0"):
        estimate(time, np.sin(time))
    time, value = np.arange(20.0), np.sin(np.arange(20.0))
    value[7] = np.nan
    with pytest.raises(TraceError, match=r"value\[7\]: expected a finite number, got nan \(1 such\)"):
        estimate(time, value)
    value = np.sin(time)
    with pytest.raises(TraceError, match="one value a stamp"):
        estimate(time, value[:-1])
    with pytest.raises(TraceError, match="kind: expected one of position, velocity"):
        estimate(time, value, "acceleration")  # type: ignore[arg-type]
    for quantum in (-1e-6, np.nan, np.inf, 1e-300):
        with pytest.raises(TraceError, match="quantum: expected 0"):
            estimate(time, value, "position", quantum)
    with pytest.raises(TraceError, match="step of time .*check the unit"):
        estimate(1e100 * time, value)
    with pytest.raises(TraceError, match="spread of the samples: .*check the unit"):
        estimate(time, 1e100 * value)
    with pytest.raises(ValueError, match="lengths do not agree"):
        _core.motion_likelihood(
            (*[np.ones(3)] * 3, np.zeros(3), np.eye(3), np.zeros(2, np.uint32), np.ones(1))
        )


def there_and_back(time):
    """Position and acceleration of a sine squared move of 1 m in 1.5 s from 0.5 s on."""
    done = np.clip((time - 0.5) / 1.5, 0.0, 1.0)
    moves = (done > 0.0) & (done < 1.0)
    position = done - np.sin(2.0 * np.pi * done) / (2.0 * np.pi)
    return position, 2.0 * np.pi * np.sin(2.0 * np.pi * done) / 1.5**2 * moves


@pytest.mark.parametrize("missing", [slice(1, 400), slice(700, 1000), slice(1100, 1400), slice(2000, 2900)])
def test_the_band_beside_a_gap_is_that_of_the_draws(missing):
    time = np.delete(np.arange(3000) * 1e-3, missing)
    position, acceleration = there_and_back(time)
    found = estimate(time, np.round(position / 1e-6) * 1e-6, "position", 1e-6)
    band = np.sqrt(found.acceleration_variance)
    drawn = found.draws(600, np.random.default_rng(RNG_SEED)).std(axis=0)
    np.testing.assert_allclose(band, drawn, rtol=5.0 / np.sqrt(2.0 * 600))
    assert rms(found.acceleration - acceleration) < 1e-3 * rms(acceleration)


def test_a_stamp_long_before_the_others_changes_next_to_nothing_of_them():
    time = np.arange(1000) * 1e-3
    value = np.round(np.sin(10.0 * time) / 1e-6) * 1e-6
    alone = estimate(time, value, "position", 1e-6)
    for before in (1.0, 1e3, 1e6):
        after = estimate(np.append(-before, time), np.append(value[0], value), "position", 1e-6)
        assert rms(after.acceleration[1:] - alone.acceleration) < 0.01 * rms(alone.acceleration)


@pytest.mark.parametrize("kind", ["position", "velocity"])
def test_wildly_uneven_stamps_are_borne(kind: Kind):
    rng = np.random.default_rng(RNG_SEED)
    time = np.cumsum(10.0 ** rng.uniform(-4.0, 0.0, 2000))
    time *= 2.5 / time[-1]
    position, _ = there_and_back(time)
    found = estimate(time, np.round(position / 1e-6) * 1e-6, kind, 1e-6)
    assert rms(found.position - position) < 1e-6 or kind == "velocity"
    assert np.isfinite(found.acceleration).all() and (found.acceleration_variance > 0.0).all()


@pytest.mark.parametrize("kind", ["position", "velocity"])
@pytest.mark.parametrize("size", [1e-6, 1.0])
def test_nothing_but_noise_or_nothing_but_a_line_stands_still(kind: Kind, size: float):
    time = np.arange(2000) * 1e-3
    alternating = estimate(time, size * (np.arange(2000) % 2), kind)
    assert (np.abs(alternating.acceleration) < 1.96 * np.sqrt(alternating.acceleration_variance)).all()
    assert abs(alternating.noise - 0.5 * size) < 0.01 * size
    line = estimate(time[:12], size * time[:12], kind)
    assert np.abs(line.acceleration - (size if kind == "velocity" else 0.0)).max() < 1e-6 * size


def test_units_of_time_and_value_change_nothing_else():
    time = np.arange(600) * 1e-3
    value = np.round(np.sin(12.0 * time) / 1e-5) * 1e-5
    here = estimate(time, value, "position", 1e-5)
    there = estimate(time * 2.0**20, value * 2.0**-30, "position", 2.0**-30 * 1e-5)
    assert np.array_equal(there.acceleration, here.acceleration * 2.0**-70)
    assert np.array_equal(there.acceleration_variance, here.acceleration_variance * 2.0**-140)
