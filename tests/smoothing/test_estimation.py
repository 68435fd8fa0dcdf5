"""Laws of the state-space smoother: Gaussian posterior, gain by adapting, coverage of the credible band."""

from itertools import product

import numpy as np
import pytest
from linear_gaussian import dense, problem
from made_traces import FAMILIES, Piece, case, course
from signals import best_filter_error, check_draws, rms, rounded
from trace_files import refuses

from guideload import _core
from guideload.motion.resolution import ramp_time, sudden_change
from guideload.smoothing.estimation import estimate
from guideload.smoothing.kinematics import Kind
from guideload.traces.reading import read_trace

RNG_SEED = 5
TIME, SINE = np.arange(20.0), np.sin(np.arange(20.0))


@pytest.mark.parametrize(
    ("states", "oscillator"),
    [
        *((states, None) for states in (2, 3, 4, 5, 6)),
        *(
            (4, (3.0, 0.05, 1)),
            (5, (3.0, 0.3, 2)),
            (5, (20.0, 0.0, 1)),
            (6, (40.0, 0.02, 2)),
            (6, (0.5, 1.2, 2)),
        ),
    ],
)
def test_the_kernels_are_the_posterior_of_jointly_normal_numbers(states, oscillator):
    model = *problem(states), oscillator
    mean, covariance, likelihood = dense(states, *model[:5], model[6][model[5]], oscillator)
    found, variance, residual = _core.smooth_motion(model)
    for i in range(min(states, 3)):
        np.testing.assert_allclose(found[:, i], mean[i::states], rtol=1e-5, atol=1e-6)
        np.testing.assert_allclose(variance[:, i], np.diag(covariance)[i::states], rtol=1e-6)
    determinant, misfit = _core.motion_likelihood(model)
    assert -0.5 * (determinant + misfit) == pytest.approx(likelihood, rel=1e-9)
    # Without sample 5, the estimate of it and its variance.
    step, value, noise, *rest = model
    unknown = np.where(np.arange(value.size) == 5, 1e12, noise)
    without, spread, _ = _core.smooth_motion((step, value, unknown, *rest))
    assert residual[5, 0] / residual[5, 1] == pytest.approx(value[5] - without[5, 0], rel=1e-6)
    assert 1.0 / residual[5, 1] == pytest.approx(spread[5, 0] + noise[5], rel=1e-6)


def test_adapting_never_lowers_the_likelihood():
    step, value, _, mean, covariance, segment, density = problem(4, 13)
    level = 4.0  # far above the noise, and its floor: it stays
    variance = np.full(13, level)
    known = -np.inf
    for _ in range(12):
        model = step, value, variance, mean, covariance, segment, density, None
        determinant, misfit = _core.motion_likelihood(model)
        assert -(determinant + misfit) > known - 1e-9
        known = -(determinant + misfit)
        density, found, sites, noises, *_ = _core.adapt_motion(model, value, 0.0, level, (1, 0.1, 0.0, level))
        # Without rounding a site is its sample.
        assert found == level and noises == pytest.approx(variance) and sites == pytest.approx(value)


def test_the_noise_before_rounding_is_found_whatever_the_quantum():
    """A slow sine: many samples in a quantum. Rounding adds quantum^2/12 to nothing here."""
    time = np.arange(0.0, 2.0, 2e-3)
    true = 0.01 * np.sin(2.0 * np.pi * time)
    rng = np.random.default_rng(RNG_SEED)
    for noise in (0.3, 1.0, 3.0):
        value = rounded(true + noise * 1e-4 * rng.standard_normal(time.size), 1e-4)
        assert estimate(time, value, "position", 1e-4).noise == pytest.approx(noise * 1e-4, rel=0.1)
    assert estimate(time, rounded(true, 1e-4), "position", 1e-4).noise < 0.1e-4


def test_the_quantum_helps_where_samples_creep():
    """Where many samples share a quantum, its changes say where the axis is; noise of its size would not."""
    time = np.arange(3000) * 1e-3
    true, acceleration = 1e-3 * np.sin(np.pi * time), -1e-3 * np.pi**2 * np.sin(np.pi * time)
    value = rounded(true, 1e-4)
    inner = slice(200, -200)
    known = rms((estimate(time, value, "position", 1e-4).acceleration - acceleration)[inner])
    unknown = rms((estimate(time, value, "position").acceleration - acceleration)[inner])
    assert known < 0.1 * unknown and known < 0.05 * rms(acceleration)


@pytest.mark.parametrize("family", FAMILIES)
def test_better_than_the_best_filter_and_the_band_covers(family):
    """Means of six cases, because single ones scatter (tests/benchmarks/encoder.py shows them all)."""
    rng = np.random.default_rng(RNG_SEED)
    ratios, covers = [], []
    for rate, quantum in product((250.0, 1000.0), (1e-7, 1e-5, 8e-5)):
        one = case(family, rate, quantum, 0.0, 0.5, rng)
        lengths = np.geomspace(3, 0.3 * rate, 20)
        best = best_filter_error(one.value, one.acceleration, rate, (2, 4, 6), lengths)
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
    value = rounded(place + 1e-6 * rng.standard_normal(time.size), 1e-6)
    found = estimate(time, value, "position", 1e-6)
    assert found.order in (3, 4)
    for corner in corners:
        assert np.any((found.jumps[:, 0] <= corner + 0.01) & (found.jumps[:, 1] >= corner - 0.01))
    assert rms(found.acceleration[(time > 0.6) & (time < 0.9)] - 2.0) < 0.01
    assert rms(found.acceleration[time < 0.4]) < 0.01
    sine = rounded(np.sin(6.0 * time) + 1e-5 * rng.standard_normal(time.size), 1e-5)
    assert estimate(time, sine, "position", 1e-5).jumps.size == 0


def test_a_jump_is_located_to_two_intervals():
    """Medians over moves that start between two samples: 4 kHz, 1 um, without noise, jumps by 5 m/s2."""
    widths, misses = [], []
    for seed in range(2):
        lengths = np.array([0.3, 0.2, 0.3, 0.2, 0.3]) + np.random.default_rng(seed).uniform(0.0, 2.5e-4, 5)
        heights = (0.0, 5.0, 0.0, -5.0, 0.0)
        truth = course([Piece(each, a, a) for each, a in zip(lengths, heights, strict=True)])
        time = np.arange(0.0, lengths.sum(), 2.5e-4)
        found = estimate(time, rounded(truth(time)[0], 1e-6), "position", 1e-6)
        for corner in np.cumsum(lengths)[:-1]:
            first, last = found.jumps[np.argmin(np.abs(found.jumps.mean(axis=1) - corner))]
            widths.append((last - first) / 2.5e-4)
            misses.append(max(first - corner, corner - last, 0.0) / 2.5e-4)
    assert np.median(widths) < 2.5
    assert np.median(misses) < 1.0 and max(misses) < 10.0


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


@pytest.mark.parametrize("count", [36, 210, 366])
def test_a_line_with_a_gap_of_a_million_steps_is_smoothed(count):
    """The best orders do not survive rounding when they smooth all samples; the others do."""
    time = np.arange(float(count))
    time[count // 2 :] += 1e6
    found = estimate(time, 0.3 * time + 0.1, "position")
    assert (np.abs(found.acceleration) < 1.96 * np.sqrt(found.acceleration_variance)).all()
    assert sum(found.weights.values()) == pytest.approx(1.0)


@pytest.mark.parametrize("quantum", [1e-5, 2e-5])
def test_a_log_with_long_gaps_is_smoothed(quantum):
    """Of a log on change, where orders that a gap takes beyond the range of doubles are no choice."""
    time = np.arange(0.0, 7.0, 1e-3)
    edges = np.ravel([[start, start + 0.03] for start in (0.6, 1.4, 2.4, 3.2, 3.8, 4.6, 5.6, 6.4)])
    levels = [0, 0, 2, 2, 0, 0, -2, -2, 0, 0, -2, -2, 0, 0, 2, 2, 0, 0]
    acceleration = np.interp(time, [0.0, *edges, 7.0], levels)
    velocity = np.r_[0.0, np.cumsum(acceleration[1:] + acceleration[:-1]) * 5e-4]
    place = np.r_[0.0, np.cumsum(velocity[1:] + velocity[:-1]) * 5e-4]
    value = rounded(place, quantum)
    changed = np.r_[True, np.diff(value) != 0.0]
    changed[-1] = True
    trace = read_trace({"t_s": time[changed], "x_m": value[changed]})
    assert trace.clock == "on_change" and np.diff(trace.time).max() > 0.3
    found = estimate(trace.time, trace.value, "position", quantum)
    assert np.isfinite(found.acceleration_variance).all()
    true = np.interp(trace.time, time, acceleration)
    assert rms(found.acceleration - true) < 0.02 * rms(true)


@pytest.mark.parametrize(
    ("time", "value", "options", "message"),
    [
        (TIME[:7], SINE[:7], (), "at least 8 samples, got 7"),
        (np.where(TIME == 5.0, 3.0, TIME), SINE, (), r"time\[5\]: expected more than 4.0 s, got 3.0"),
        (
            TIME,
            np.where(TIME == 7.0, np.nan, SINE),
            (),
            r"value\[7\]: .* finite number, got nan \(1 not finite\)",
        ),
        (TIME, SINE[:-1], (), "one value per stamp"),
        (TIME, SINE, ("acceleration",), "kind: expected one of position, velocity"),
        *((TIME, SINE, ("position", q), "quantum: expected 0") for q in (-1e-6, np.nan, np.inf, 1e-300)),
        (1e100 * TIME, SINE, (), "step of time .*check the unit"),
        (TIME, 1e100 * SINE, (), "spread of the samples: .*check the unit"),
    ],
)
def test_refusals_name_the_place(time, value, options, message):
    refuses(message, estimate, time, value, *options)


def test_the_kernels_refuse_lengths_that_do_not_agree():
    model = (*[np.ones(3)] * 3, np.zeros(3), np.eye(3), np.zeros(2, np.uint32), np.ones(1), None)
    with pytest.raises(ValueError, match="lengths do not agree"):
        _core.motion_likelihood(model)


def there_and_back(time):
    """Position and acceleration of a sine squared move of 1 m in 1.5 s from 0.5 s on."""
    done = np.clip((time - 0.5) / 1.5, 0.0, 1.0)
    moves = (done > 0.0) & (done < 1.0)
    position = done - np.sin(2.0 * np.pi * done) / (2.0 * np.pi)
    return position, 2.0 * np.pi * np.sin(2.0 * np.pi * done) / 1.5**2 * moves


@pytest.mark.parametrize(
    "missing", [slice(0), slice(1, 400), slice(700, 1000), slice(1100, 1400), slice(2000, 2900)]
)
def test_draws_scatter_as_the_posterior_also_beside_a_gap(missing):
    time = np.delete(np.arange(3000) * 1e-3, missing)
    position, acceleration = there_and_back(time)
    found = estimate(time, rounded(position, 1e-6), "position", 1e-6)
    check_draws(found, RNG_SEED)
    assert rms(found.acceleration - acceleration) < 1e-3 * rms(acceleration)


@pytest.mark.parametrize("seed", [1, 7])
def test_a_long_rest_does_not_blur_the_move(seed: int) -> None:
    """The order of the model is chosen on excerpts of a long trace, and most of this one is at rest."""
    one = case("jerk-limited", 1000.0, 2e-5, 0.0, 0.0, np.random.default_rng(seed))
    count, errors = one.time.size, []
    for rest in (0, 30_000):
        value = np.pad(one.value, rest, mode="edge")
        found = estimate(np.arange(value.size) * 1e-3, value, "position", 2e-5)
        errors.append(rms(found.acceleration[rest : rest + count] - one.acceleration))
    assert errors[1] < 1.3 * errors[0]


def test_a_stamp_long_before_the_others_changes_next_to_nothing_of_them():
    time = np.arange(400) * 2.5e-3
    value = rounded(np.sin(10.0 * time), 1e-6)
    alone = estimate(time, value, "position", 1e-6)
    for before in (1.0, 1e3, 1e6):
        after = estimate(np.append(-before, time), np.append(value[0], value), "position", 1e-6)
        assert rms(after.acceleration[1:] - alone.acceleration) < 0.01 * rms(alone.acceleration)


@pytest.mark.parametrize("kind", ["position", "velocity"])
def test_wildly_uneven_stamps_are_smoothed(kind: Kind):
    rng = np.random.default_rng(RNG_SEED)
    time = np.cumsum(10.0 ** rng.uniform(-4.0, 0.0, 2000))
    time *= 2.5 / time[-1]
    position, _ = there_and_back(time)
    found = estimate(time, rounded(position, 1e-6), kind, 1e-6)
    assert rms((found.position if kind == "position" else found.velocity) - position) < 1e-6
    assert np.isfinite(found.acceleration).all() and (found.acceleration_variance > 0.0).all()


@pytest.mark.parametrize("kind", ["position", "velocity"])
@pytest.mark.parametrize("size", [1e-6, 1.0])
def test_pure_noise_and_a_straight_line_have_no_acceleration(kind: Kind, size: float):
    time = np.arange(2000) * 1e-3
    alternating = estimate(time, size * (np.arange(2000) % 2), kind)
    assert (np.abs(alternating.acceleration) < 1.96 * np.sqrt(alternating.acceleration_variance)).all()
    assert abs(alternating.noise - 0.5 * size) < 0.01 * size
    line = estimate(time[:12], size * time[:12], kind)
    assert np.abs(line.acceleration - (size if kind == "velocity" else 0.0)).max() < 1e-6 * size


def test_units_of_time_and_value_change_nothing_else():
    time = np.arange(600) * 1e-3
    value = rounded(np.sin(12.0 * time), 1e-5)
    here = estimate(time, value, "position", 1e-5)
    there = estimate(time * 2.0**20, value * 2.0**-30, "position", 2.0**-30 * 1e-5)
    assert np.array_equal(there.acceleration, here.acceleration * 2.0**-70)
    assert np.array_equal(there.acceleration_variance, here.acceleration_variance * 2.0**-140)
    assert there.bandwidth == here.bandwidth * 2.0**-20
