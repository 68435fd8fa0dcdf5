"""Laws of all smoothing methods: exact on polynomials, close to the best filter, quiet at rest."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from moves import GENTLE
from signals import best_filter_error, rms, rounded

from guideload.base.errors import TraceError
from guideload.smoothing.estimation import MotionEstimate
from guideload.smoothing.smoothing import Kind, Method, find_quantum, smooth

RNG_SEED = 7
HISTORIES = ("position", "velocity", "acceleration")


def cycle(rate, seconds=7.06):
    time = np.arange(0.0, seconds, 1.0 / rate)
    return time, *GENTLE.motion(time)


@pytest.mark.parametrize(("kind", "power"), [("position", 3), ("velocity", 2)])
def test_cubic_positions_are_reproduced_on_uneven_stamps(kind: Kind, power: int):
    """White snap does not change them, whatever its density."""
    time = np.sort(np.random.default_rng(RNG_SEED).uniform(0.0, 2.0, 400)) + 1e5
    poly = np.polynomial.Polynomial([0.3, -1.2, 0.7, 0.4][: power + 1])
    since = time - time[0]
    found = smooth(time, poly(since), kind)
    true = [poly(since), poly.deriv()(since), poly.deriv(2)(since)]
    if kind == "velocity":
        true = [poly.integ()(since), *true]
    # Stamps of 1e5 s are known to 1.5e-11 s; on steps of 5 ms that is 3e-9 per difference, and rounding grows
    # with each derivative.
    for name, wanted, tolerance in zip(HISTORIES, true, (1e-7, 1e-6, 1e-3), strict=False):
        assert np.abs(getattr(found, name) - wanted).max() < tolerance


def test_at_four_kilohertz_the_error_is_near_that_of_the_best_filter():
    """Slower samples, finer and coarser quanta are in test_estimation.py."""
    time, position, _, acceleration = cycle(4000.0, 3.5)  # there, without the way back
    value = rounded(position, 1e-5)
    best = best_filter_error(value, acceleration, 4000.0, (4,), np.geomspace(100, 1000, 8))
    found = smooth(time, value, "position", quantum=find_quantum(value))
    assert rms(found.acceleration - acceleration) < 1.25 * best


def test_uneven_stamps_cost_little():
    """With the true stamps, which jitter by 12 %, the error is at most a quarter larger than with even stamps."""
    time, position, _, acceleration = cycle(1000.0)
    even = smooth(time, rounded(position, 1e-6), "position", quantum=1e-6)
    shaken = time + 1.2e-4 * np.random.default_rng(RNG_SEED).uniform(-1.0, 1.0, time.size)
    true = GENTLE.motion(np.clip(shaken, 0.0, None))
    uneven = smooth(shaken, rounded(true[0], 1e-6), "position", quantum=1e-6)
    assert rms(uneven.acceleration - true[2]) < 1.25 * rms(even.acceleration - acceleration)


@pytest.mark.parametrize(("kind", "quantum"), [("position", 1e-5), ("velocity", 1e-3)])
def test_rest_is_quiet_and_the_ends_are_sane(kind: Kind, quantum: float):
    time, position, velocity, acceleration = cycle(1000.0)
    noise = 0.0 if kind == "position" else 0.3 * quantum
    value = position if kind == "position" else velocity
    value = rounded(value + noise * np.random.default_rng(RNG_SEED).standard_normal(time.size), quantum)
    found = smooth(time, value, kind, quantum=quantum)
    assert rms(found.acceleration[time < 0.5]) < 0.01 * 2.2
    assert rms(found.acceleration - acceleration) < 0.02 * rms(acceleration)
    assert np.abs(found.acceleration[[0, -1]]).max() < 0.05 * 2.2
    assert np.abs(found.acceleration).max() < 1.05 * 2.2


def test_velocity_and_position_agree():
    """The acceleration is the derivative of the velocity, and that of the position, in both kinds."""
    time, position, velocity, _ = cycle(1000.0, 3.5)
    for kind, value in (("position", rounded(position, 1e-6)), ("velocity", rounded(velocity, 1e-4))):
        found = smooth(time, value, kind)
        middle = 0.5 * (time[1:] + time[:-1])
        # The trapezoidal rule is off by step/12 times the change of jerk in a step, at most 50 m/s3 here.
        for low, high in ((found.position, found.velocity), (found.velocity, found.acceleration)):
            slope = np.diff(low) / np.diff(time)
            assert np.abs(slope - np.interp(middle, time, high)).max() < 1e-3 / 12.0 * 50.0
    assert found.position[0] == 0.0


def test_emps_acceleration_agrees_with_the_force(shared_data: Path):
    """The force over the mass gives an acceleration that no differentiation has touched (data/README)."""
    data = pd.read_csv(shared_data / "emps_bangbang_1kHz.csv")
    found = smooth(data.t_s, data.q_meas_m, "position", quantum=find_quantum(data.q_meas_m))
    velocity = found.velocity
    force = 35.15065 * data.u_V.to_numpy()
    expected = (force - 203.5 * velocity - 20.39 * np.sign(velocity) + 3.165) / 95.11
    moving = np.abs(velocity) > 0.01
    # Reached: 0.0229; the best hand-tuned filter 0.0221.
    assert rms((found.acceleration - expected)[moving]) < 0.0235
    columns = np.column_stack([found.acceleration, velocity, np.sign(velocity), np.ones(velocity.size)])
    mass = np.linalg.lstsq(columns[moving], force[moving], rcond=None)[0][0]
    assert mass == pytest.approx(95.11, rel=0.005)


def test_the_quantum_is_found():
    time, position, _, _ = cycle(1000.0)
    for quantum in (1e-6, 8.4e-5):
        assert find_quantum(rounded(position, quantum)) == pytest.approx(quantum, rel=1e-9)
    assert find_quantum(np.sin(5.0 * time)) == 0.0
    assert find_quantum(np.full(20, 0.3)) == 0.0


def test_a_log_too_coarse_for_its_moves_is_followed_and_not_flattened(shared_data: Path):
    """At 10 Hz the machine tool starts and stops within one row: no noise, although a likelihood says so."""
    data = pd.read_csv(shared_data / "michigan_cnc_experiment_01.csv")
    speed = 1e-3 * data.X1_ActualVelocity.to_numpy()
    found = smooth(0.1 * np.arange(speed.size), speed, "velocity")
    assert rms(found.velocity - speed) < 0.02 * np.ptp(speed)
    assert np.abs(found.acceleration).max() > 0.5 * np.abs(np.diff(speed) / 0.1).max()


@pytest.mark.parametrize("kind", ["position", "velocity"])
@pytest.mark.parametrize("method", ["auto", "differences"])
def test_equal_samples_give_no_acceleration(kind: Kind, method: Method):
    time = np.arange(20) * 0.01
    found = smooth(time, np.full(20, 0.1), kind, method)
    assert np.abs(found.acceleration).max() < 1e-14
    if isinstance(found, MotionEstimate):
        assert not found.acceleration_variance.any() and not found.draws(2, np.random.default_rng(1)).any()
    assert found.velocity == pytest.approx(0.1 if kind == "velocity" else 0.0)
    assert found.position[-1] == pytest.approx(0.1 if kind == "position" else 0.1 * time[-1])


def test_a_gap_of_1e5_steps_is_bridged():
    time = np.concatenate([np.arange(0.0, 1.0, 1e-3), np.arange(100.0, 101.0, 1e-3)])
    found = smooth(time, rounded(0.01 * np.cos(2.0 * np.pi * time), 1e-6), "position", quantum=1e-6)
    true = -0.01 * (2.0 * np.pi) ** 2 * np.cos(2.0 * np.pi * time)
    assert np.abs(found.acceleration - true).max() < 0.02 * np.abs(true).max()


def test_comparison_methods_are_exact_where_they_should_be():
    time = np.arange(60) * 0.01
    for method, options in (("savitzky_golay", {"window": 0.11}), ("differences", {})):
        found = smooth(time, 1.5 * time**2, "position", method, **options)
        assert np.abs(found.acceleration - 3.0).max() < 1e-9
        found = smooth(time, 3.0 * time, "velocity", method, **options)
        assert np.abs(found.acceleration - 3.0).max() < 1e-9
        assert np.abs(found.position - 1.5 * time**2).max() < 1e-9


@pytest.mark.parametrize(
    ("method", "window", "jitter", "message"),
    [
        ("kalman", None, 0.0, "auto, savitzky_golay, differences"),
        ("auto", 0.1, 0.0, '"auto" takes no window'),
        ("savitzky_golay", None, 0.0, "window=0.05"),
        ("savitzky_golay", 0.02, 0.0, "expected 5 to 50"),
        ("savitzky_golay", 0.1, 1e-3, "uniform time stamps"),
    ],
)
def test_refusals_name_the_way_out(method: Method, window: float | None, jitter: float, message: str):
    time = np.arange(50) * 0.01
    with pytest.raises(TraceError, match=message):
        smooth(time + jitter * np.sin(time * 77), np.sin(time), "position", method, window=window)


@pytest.mark.parametrize("kind", ["position", "velocity"])
@pytest.mark.parametrize("window", [0.021, 0.11])
def test_half_of_a_tone_at_its_bandwidth_passes_a_savitzky_golay_filter(kind: Kind, window: float):
    time = np.arange(4000) * 1e-3
    bandwidth = smooth(time, np.sin(time), kind, "savitzky_golay", window=window).bandwidth
    turn = 2 * np.pi * bandwidth
    found = smooth(time, np.sin(turn * time), kind, "savitzky_golay", window=window).acceleration[200:-200]
    true = turn ** (2 if kind == "position" else 1)
    # Interpolated, and some periods are cut.
    assert rms(found) * np.sqrt(2) / true == pytest.approx(0.5, rel=0.01)
