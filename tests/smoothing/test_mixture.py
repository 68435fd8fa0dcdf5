"""Laws of the mixture over the orders, and of the noise level where it hides among jumps."""

from dataclasses import replace

import numpy as np
import pytest
from made_traces import case
from signals import check_draws, rms, rounded

from guideload.base.errors import RunError, TraceError
from guideload.smoothing import estimation, selection
from guideload.smoothing.estimation import estimate
from guideload.smoothing.stationary import ScaledSamples

SEED = 8


def undecided():
    """A trace that fits two orders nearly equally well."""
    one = case("sin2", 250.0, 8e-5, 0.0, 0.25, np.random.default_rng(SEED))
    return one.time, one.value, "position", one.quantum


def test_the_mixture_has_the_mean_and_the_variance_of_its_orders(monkeypatch):
    """Each order takes part with uneven and with nearly even densities; each of them alone is an estimate too."""
    found = estimate(*undecided())
    time, value, _, quantum = undecided()
    candidates = selection.weighted(ScaledSamples.of(time, value, quantum), 0)
    weights = np.array([each.weight for each in candidates])
    assert len(found.weights) > 1 and len(candidates) > len(found.weights)
    assert weights.sum() == pytest.approx(1.0) and weights.min() > 0.0
    for order, share in found.weights.items():
        assert share == pytest.approx(sum(each.weight for each in candidates if each.order == order))
    assert found.order == max(found.weights, key=found.weights.__getitem__)
    alone = []
    for each in candidates:
        monkeypatch.setattr(estimation, "weighted", lambda *_, each=each: [replace(each, weight=1.0)])
        alone.append(estimate(*undecided()))
        assert alone[-1].weights == {each.order: 1.0} and alone[-1].order == each.order
    means = np.array([each.acceleration for each in alone])
    own = np.array([each.acceleration_variance for each in alone])
    np.testing.assert_allclose(found.acceleration, weights @ means, rtol=1e-9, atol=1e-12)
    variance = 1.0 / (weights @ (1.0 / own)) + weights @ (means - found.acceleration) ** 2
    np.testing.assert_allclose(found.acceleration_variance, variance, rtol=1e-9)
    np.testing.assert_allclose(found.position, weights @ [each.position for each in alone], rtol=1e-9)


def test_orders_that_do_not_survive_rounding_drop_out(monkeypatch):
    time, value, _, quantum = undecided()
    samples = ScaledSamples.of(time, value, quantum)
    before = selection.weighted(samples, 0)
    adapted, failing = selection._component, {before[0].order}

    def fails(samples, trial, weight):
        if trial.fit.order in failing:
            raise RunError("the result is beyond the range of numbers")
        return adapted(samples, trial, weight)

    monkeypatch.setattr(selection, "_component", fails)
    after = selection.weighted(samples, 0)
    assert sum(each.weight for each in after) == pytest.approx(1.0)
    assert not failing & {each.order for each in after}
    others = [each for each in before if each.order not in failing]
    for each, same in zip(others, after, strict=False):  # in proportion to the weights before
        assert each.order == same.order
        assert same.weight / after[0].weight == pytest.approx(each.weight / others[0].weight)
    failing |= set(selection.ORDERS)
    with pytest.raises(TraceError, match="no order survives rounding"):
        selection.weighted(samples, 0)


def test_no_oscillator_is_used_because_the_orders_without_one_fail(monkeypatch):
    """Whether the axis rings follows from likelihood, not from the range of numbers."""
    ringing = case("ringing", 250.0, 1e-6, 0.0, 1.0, np.random.default_rng(SEED))
    samples = ScaledSamples.of(ringing.time, ringing.value, ringing.quantum)
    assert all(each.model.smoother.fit.oscillator for each in selection.weighted(samples, 0))
    monkeypatch.setattr(selection, "RINGING", np.inf)
    assert not any(each.model.smoother.fit.oscillator for each in selection.weighted(samples, 0))

    def fails(*_):
        raise RunError("the result is beyond the range of numbers")

    monkeypatch.setattr(selection, "_component", fails)
    with pytest.raises(TraceError, match="no order survives rounding"):
        selection.weighted(samples, 0)


def test_draws_of_a_mixture_scatter_as_its_posterior():
    check_draws(estimate(*undecided()), SEED)


def test_more_samples_of_the_same_motion_decide():
    """The evidence adds up: a jerk that jumps, of order 4, is in doubt in a short record and sure in a long one."""
    rng = np.random.default_rng(SEED)
    found = []
    for seconds in (4, 60):
        time = np.arange(0.0, seconds, 4e-3)
        phase = time % 2.0
        ramp = np.interp(phase, [0.0, 0.4, 0.5, 0.9, 1.0, 1.4, 1.5, 1.9, 2.0], [0, 0, 1, 1, 0, 0, -1, -1, 0])
        place = np.cumsum(np.cumsum(ramp)) * 4e-3**2
        value = rounded(place + 2e-5 * rng.standard_normal(time.size), 2e-5)
        found.append(estimate(time, value, "position", 2e-5))
    assert max(found[0].weights.values()) < 0.6
    assert found[1].weights[4] > 0.9


@pytest.mark.parametrize("jitter", [0.0, 0.2])
def test_noise_is_bounded_below_where_the_motion_is_smooth(jitter):
    rng = np.random.default_rng(SEED)
    time = np.arange(600.0) + jitter * rng.uniform(-1.0, 1.0, 600)
    cubic = 1e-3 * (time - 100.0) ** 3 - time**2
    assert ScaledSamples.of(time, cubic, 0.0).noise_where_smooth() < 1e-6
    for noise in (1.0, 5.0):
        samples = ScaledSamples.of(time, cubic + noise * rng.standard_normal(600), 1.0)
        assert 0.2 * noise**2 < samples.noise_where_smooth() < noise**2


def test_noise_is_not_taken_for_jumps():
    """Few samples per second and strong jumps: a motion that follows every sample would fit as well."""
    rng = np.random.default_rng(SEED)
    time = np.arange(0.0, 4.0, 0.01)
    acceleration = np.select(
        [(time % 2 > 0.5) & (time % 2 < 0.8), (time % 2 > 1.2) & (time % 2 < 1.5)], [5.0, -5.0]
    )
    speed = np.concatenate([[0.0], np.cumsum(acceleration[:-1]) * 0.01])
    place = np.concatenate([[0.0], np.cumsum(speed[:-1] * 0.01 + 0.5 * acceleration[:-1] * 1e-4)])
    value = rounded(place + 1.5e-7 * rng.standard_normal(time.size), 5e-8)
    found = estimate(time, value, "position", 5e-8)
    assert 0.5 * 1.5e-7 < found.noise < 1.5 * 1.5e-7
    still = (time % 2 > 0.1) & (time % 2 < 0.4)
    assert rms(found.acceleration[still]) < 0.02


def test_nearly_even_densities_follow_a_vibration_near_the_resolution(monkeypatch):
    """With low densities in the dwells alone, more of the vibration would be smoothed away."""
    errors = []
    # Without an oscillator, which would follow it too.
    monkeypatch.setattr(selection, "find_oscillator", lambda *_: None)
    for tried in (selection.TRIED, -1.0):  # with -1 no order is near enough to be tried with even densities
        monkeypatch.setattr(selection, "TRIED", tried)
        for seed in range(8):
            one = case("ringing", 250.0, 8e-5, 0.0, 0.0, np.random.default_rng(seed))
            found = estimate(one.time, one.value, "position", one.quantum)
            errors.append(rms(found.acceleration - one.acceleration))
    assert np.log(errors).reshape(2, -1).mean(axis=1) @ [-1.0, 1.0] > 0.0
