"""Laws of an axis that rings: its oscillator is found, and only where there is one."""

import numpy as np
import pytest
from made_traces import case, ringing
from signals import check_draws, rms, rounded

from guideload.cli.inputs import EXAMPLES
from guideload.smoothing import selection
from guideload.smoothing.estimation import estimate

SEED = 11
# Accelerations of the drive: two moves there and back, with jumps.
HEIGHTS = np.array([0.0, 5.0, 0.0, -5.0, 0.0, -4.0, 0.0, 4.0, 0.0])
LENGTHS = np.array([0.4, 0.15, 0.2, 0.15, 0.5, 0.15, 0.25, 0.15, 0.5])


def axis(frequency, damping, soft=False, step=1e-3):
    """Time, position, velocity and acceleration of an axis that follows such a drive; `soft`: with limited jerk."""
    corners, heights = [0.0], []
    for height, length in zip(HEIGHTS, LENGTHS, strict=True):
        ramps = [(0.0, height), (height, height), (height, 0.0)] if soft and height else [(height, height)]
        for share, pair in zip((0.3, 0.4, 0.3) if len(ramps) == 3 else (1.0,), ramps, strict=True):
            corners.append(corners[-1] + share * length)
            heights.append(pair)
    time = np.arange(0.0, corners[-1], step)
    return time, *ringing(np.array(corners), np.array(heights), frequency, damping)(time)


@pytest.mark.parametrize(
    ("frequency", "damping", "soft", "kind"),
    [
        (8.0, 0.04, False, "position"),
        (20.0, 0.12, False, "velocity"),
        (14.0, 0.03, True, "position"),
        (14.0, 0.03, True, "velocity"),
    ],
)
def test_frequency_and_damping_are_found_and_halve_the_error(frequency, damping, soft, kind, monkeypatch):
    rng = np.random.default_rng(SEED)
    time, position, velocity, acceleration = axis(frequency, damping, soft)
    sampled, noise = (position, 5e-7) if kind == "position" else (velocity, 1e-4)
    value = sampled + noise * rng.standard_normal(time.size)
    found = estimate(time, value, kind)
    assert found.oscillation is not None and f"an oscillator of {found.oscillation}" in found.note
    assert found.oscillation.natural_frequency == pytest.approx(frequency, rel=0.01)
    assert found.oscillation.damping_ratio == pytest.approx(damping, rel=0.15)
    monkeypatch.setattr(selection, "find_oscillator", lambda *_: None)
    without = estimate(time, value, kind)
    assert without.oscillation is None
    assert rms(found.acceleration - acceleration) < 0.5 * rms(without.acceleration - acceleration)


@pytest.mark.parametrize(("frequency", "damping"), [(50.0, 0.1), (60.0, 0.1), (90.0, 0.05)])
def test_fast_ringing_that_dies_away_within_two_periods_is_found(frequency, damping):
    """Its few samples can be driven in every model: only the likelihood, which counts each driven segment, tells."""
    time, position, *_ = axis(frequency, damping)
    value = rounded(position + 1e-8 * np.random.default_rng(SEED).standard_normal(time.size), 1e-7)
    found = estimate(time, value, "position", 1e-7).oscillation
    assert found is not None
    assert found.natural_frequency == pytest.approx(frequency, rel=0.01)
    assert found.damping_ratio == pytest.approx(damping, rel=0.15)


def test_corners_of_a_short_ramp_are_not_ringing():
    """The example has ramps of 8 ms and no oscillator; one at the upper limit of the search would round them off."""
    time, speed = np.loadtxt(EXAMPLES / "manipulator.csv", delimiter=",", skiprows=1).T
    assert estimate(time, speed, "velocity", 0.1).oscillation is None


@pytest.mark.parametrize("family", ["jerk-limited", "trapezoid"])
def test_what_does_not_ring_has_no_oscillator(family):
    for seed in range(2):
        one = case(family, 1000.0, 1e-6, 0.0, 0.5, np.random.default_rng(seed))
        assert estimate(one.time, one.value, "position", one.quantum).oscillation is None
    pure = np.random.default_rng(SEED).standard_normal(2000)
    assert estimate(np.arange(2000) * 1e-3, pure, "position").oscillation is None


def test_a_unit_of_time_changes_the_frequency_alone():
    time, position, *_ = axis(10.0, 0.06, step=4e-3)
    value = rounded(position, 1e-5)
    one, other = (estimate(scale * time, value, "position", 1e-5) for scale in (1.0, 1024.0))
    assert one.oscillation is not None and other.oscillation is not None
    assert 1024.0 * other.oscillation.natural_frequency == pytest.approx(
        one.oscillation.natural_frequency, rel=1e-9
    )
    np.testing.assert_allclose(1024.0**2 * other.acceleration, one.acceleration, rtol=1e-7, atol=1e-7)


def test_draws_of_a_ringing_axis_scatter_as_its_posterior():
    time, position, *_ = axis(10.0, 0.06, step=4e-3)
    found = estimate(time, rounded(position, 1e-5), "position", 1e-5)
    assert found.uncertainty is not None and found.uncertainty.oscillator is not None
    check_draws(found, SEED)


@pytest.mark.parametrize("count", [8, 9, 20, 70])
def test_short_records_are_smoothed(count):
    time, position, *_ = axis(10.0, 0.06, step=0.01)
    part = slice(40, 40 + count)
    assert np.isfinite(
        estimate(time[part], rounded(position, 1e-5)[part], "position", 1e-5).acceleration
    ).all()


def test_a_motion_that_is_driven_to_vibrate_is_not_an_axis_that_rings(monkeypatch):
    rng = np.random.default_rng(SEED)
    time = np.arange(0.0, 4.0, 2e-3)
    value = rounded(1e-3 * np.sin(60.0 * time) + 1e-6 * rng.standard_normal(time.size), 1e-6)
    found = estimate(time, value, "position", 1e-6)
    assert found.oscillation is None
    monkeypatch.setattr(selection, "find_oscillator", lambda *_: None)
    assert (found.acceleration == estimate(time, value, "position", 1e-6).acceleration).all()


@pytest.mark.parametrize("length", [30, 300])
def test_a_straight_line_with_a_gap_has_no_oscillator(length):
    time = np.arange(float(length))
    time[length // 2 :] += 1e3
    value = 0.3 * time + 1e-3 * np.random.default_rng(SEED).standard_normal(length)
    found = estimate(time, value, "position")
    assert found.oscillation is None and np.isfinite(found.acceleration).all()


@pytest.mark.parametrize("burst", [2, 5])
def test_bursts_of_samples_are_smoothed(burst):
    """Means of samples that reach over gaps are left out of the search; here they may be all."""
    rng = np.random.default_rng(SEED)
    time = (np.arange(600 * burst) % burst) * 1e-3 + np.repeat(0.05 * np.arange(600.0), burst)
    value = np.sin(3.0 * time) + 1e-5 * rng.standard_normal(time.size)
    found = estimate(time, value, "position")
    assert rms(found.acceleration + 9.0 * np.sin(3.0 * time)) < 0.1
