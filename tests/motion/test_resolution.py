"""Laws of the trace resolution: hidden loads are those that runs of the machine show."""

import numpy as np
import pytest
import reference as ref

from guideload import Body, Link, Machine, Motion, Result, simulate
from guideload.base.warnings import LIMITS
from guideload.motion.resolution import (
    TraceResolution,
    ramp_time,
    sudden_change,
)
from guideload.motion.stamps import usable_bandwidth

PUSH = 2.2  # m/s2
STARTS, STOPS = 0.5, 1.0  # s


def pushed(rate: float) -> Motion:
    """A sudden push as samples at a rate [Hz] show it: linear from one sample to the next."""
    time = np.arange(int(1.5 * rate)) / rate
    return Motion.along_x(time, np.where((time >= STARTS) & (time < STOPS), PUSH, 0.0))


def lever() -> Machine:
    """A body that turns about z alone, undamped, its centre of mass above L: x excites its one mode."""
    return Machine(
        body=Body(mass=100, center_of_mass=(0, 0.3, 0), inertia=np.eye(3).tolist()),
        links=[Link(name="spring", point=(0.5, 0, 0), direction=(0, 1, 0), stiffness=1e6, damping=0.0)],
        free=("rz",),
    )


def balanced() -> Machine:
    """The cart with its centre of mass in L: an acceleration along x excites no mode."""
    body = ref.cart().body.model_copy(update={"center_of_mass": (0.0, 0.0, 0.0)})
    return ref.cart().model_copy(update={"body": body})


def of(machine: Machine, motion: Motion) -> TraceResolution:
    return TraceResolution.of_motion(machine, motion)


def dynamic_peaks(result: Result) -> np.ndarray:
    return result.peaks()["dynamic_resultant_N"].to_numpy()


# ---- usable bandwidth


def test_the_ramp_shows_half_of_what_rings_at_the_end_of_the_band() -> None:
    for band in (0.3, 4.1, 250.0):
        assert np.sinc(band * ramp_time(band)) == pytest.approx(0.5, rel=1e-12)


def test_the_band_ends_with_the_smoothing_or_at_half_the_rate() -> None:
    time = np.arange(100) * 0.01
    assert usable_bandwidth(time, 20.0) == 20.0
    assert usable_bandwidth(time, 80.0) == pytest.approx(50.0, rel=1e-12)
    assert usable_bandwidth(time, np.inf) == pytest.approx(50.0, rel=1e-12)


def test_a_profile_given_by_its_corners_is_known_exactly() -> None:
    corners = np.array([0.0, 0.5, 0.6, 1.2, 1.3, 2.0])
    assert usable_bandwidth(corners, np.inf) == np.inf
    assert usable_bandwidth(np.array([0.0, 0.5, 0.5, 1.0]), np.inf) == np.inf
    found = of(ref.cart(), Motion.along_x(corners, [0, 0, 2, 2, 0, 0]))
    assert "known exactly" in found.text and not [*found.warnings()] and not found.hidden.any()


# ---- changes that may have been sudden


@pytest.mark.parametrize("late", [0.0, 0.21, 0.5, 0.83])
def test_a_jump_is_found_through_every_rounding(late: float) -> None:
    """A ramp, a Gaussian of the same half amplitude, and second differences of sampled positions (a triangle)."""
    band, step = 10.0, 1e-3
    time = np.arange(2000) * step
    since = time - 1.0 - late * step
    ramp = ramp_time(band)
    deviation = np.sqrt(np.log(2.0) / 2.0) / (np.pi * band)
    gauss = np.cumsum(np.exp(-0.5 * (since / deviation) ** 2)) * step / (deviation * np.sqrt(2 * np.pi))
    for shown in (np.clip(since / ramp + 0.5, 0, 1), gauss):
        assert sudden_change(time, PUSH * shown, ramp) == pytest.approx(PUSH, rel=0.02)
    samples = np.arange(60) * 0.05
    position = 0.5 * PUSH * np.maximum(samples - 1.0 - 0.05 * late, 0.0) ** 2
    shown = np.append(np.pad(np.diff(position, 2), (1, 0)) / 0.05**2, PUSH)
    assert sudden_change(samples, shown, ramp_time(10.0)) == pytest.approx(PUSH, rel=0.1)


def test_a_change_that_goes_on_was_not_sudden() -> None:
    time = np.arange(2000) * 1e-3
    ramp = ramp_time(20.0)
    slow = np.interp(time, [0.5, 0.5 + 5 * ramp], [0.0, PUSH])
    assert sudden_change(time, slow, ramp) == pytest.approx(0.0, abs=1e-12)
    assert sudden_change(time, 0.0 * time, ramp) == 0.0


# ---- hidden loads


@pytest.mark.parametrize("band", [3.0, 7.0, 12.0, 40.0])
def test_of_one_undamped_mode_the_ringing_is_hidden_that_the_ramp_does_not_excite(band: float) -> None:
    """After a jump the load overshoots by all of its static value, after a ramp by |sin(pi f T) / (pi f T)| of it."""
    time = np.arange(4000) * 1e-3
    ramp = ramp_time(band)
    motion = Motion.along_x(time, np.interp(time, [1.0, 1.0 + ramp], [0.0, PUSH]), bandwidth=band)
    found = of(lever(), motion)
    (frequency,) = found.frequency
    left = abs(np.sinc(frequency * ramp))
    static = 100 * 0.3 * PUSH / 0.5
    np.testing.assert_allclose(found.participation, 1.0, rtol=1e-12)
    np.testing.assert_allclose(found.ringing, left, rtol=1e-12)
    # Peaks are read at 32 instants per period: 0.5 % of the ringing at most.
    np.testing.assert_allclose(found.hidden, static * (1.0 - left), atol=0.01 * static)


@pytest.mark.parametrize("machine", [ref.cart, ref.cart_clear])
def test_ten_hertz_and_a_faster_mode_are_warned_of_with_what_two_runs_differ(machine) -> None:
    """The nominal machine, run by brute force under the sudden change and under its ramp."""
    found = of(machine(), pushed(10.0))
    assert found.bandwidth == pytest.approx(5.0) and found.change == pytest.approx(PUSH, rel=1e-9)
    times = np.arange(4001) * 1e-4
    ramp = ramp_time(5.0)
    jump = Motion.along_x([0.0, 0.0, 0.5], [0.0, PUSH, PUSH])
    slow = Motion.along_x([0.0, ramp, 0.5], [0.0, PUSH, PUSH])
    true, shown = (dynamic_peaks(simulate(ref.cart(), motion, times=times)) for motion in (jump, slow))
    np.testing.assert_allclose(found.hidden[:4], true - shown, rtol=0.01)
    share, load, name = found.worst
    worst = int(((true - shown) / shown).argmax())
    assert name == f"carriage {ref.cart().carriages[worst].name}"
    assert load == pytest.approx((true - shown)[worst], rel=0.01)
    assert share == pytest.approx((true / shown - 1.0)[worst], rel=0.01)
    (warning,) = found.warnings()
    assert "up to 5 Hz" in warning and "mode 2 (rz, 56 Hz" in warning and "Record at 560 Hz" in warning
    assert f"{load:.3g} N above what is shown ({100 * share:.2g} % of its dynamic load in the" in warning


@pytest.mark.parametrize("band", [8.0, 20.0, 45.0])
def test_the_truth_lies_within_the_bound(band: float) -> None:
    """A true sudden push, and what a trace of this band shows of it: the difference is at most the hidden load."""
    corners = np.array([0.0, STARTS, STARTS, STOPS, STOPS, 1.5])
    truth = Motion.along_x(corners, [0, 0, PUSH, PUSH, 0, 0])
    ramp = ramp_time(band)
    time = np.arange(1501) * 1e-3
    edges = np.array([STARTS, STARTS + ramp, STOPS, STOPS + ramp])
    trace = Motion.along_x(time, np.interp(time, edges, [0, PUSH, PUSH, 0]), bandwidth=band)
    found = of(ref.cart(), trace)
    times = np.arange(7501) * 2e-4
    true, shown = (dynamic_peaks(simulate(ref.cart(), motion, times=times)) for motion in (truth, trace))
    assert np.all(true - shown <= found.hidden[:4] + 0.01 * true)
    assert np.all(true > shown)


def test_faster_samples_hide_less_and_at_four_kilohertz_nothing() -> None:
    found = [of(ref.cart(), pushed(rate)) for rate in (20.0, 100.0, 400.0, 4000.0)]
    shares = [each.worst[0] for each in found]
    assert np.all(np.diff(shares) < 0.0) and shares[0] > LIMITS["hidden load"].most and shares[-1] < 1e-3
    assert np.all(found[-1].frequency < found[-1].bandwidth) and "all 3 modes" in found[-1].text
    assert not [*found[-1].warnings()]


def test_modes_that_x_does_not_excite_make_no_warning() -> None:
    found = of(balanced(), pushed(10.0))
    assert not found.participating.any() and not found.hidden.any() and not [*found.warnings()]
    assert "the travel excites no mode" in found.text
    assert not ref.warnings_of(simulate(balanced(), pushed(10.0), times=np.arange(1000) * 1e-3).audit)


def test_loads_scale_with_the_motion_and_shares_do_not() -> None:
    one = of(ref.cart(), pushed(25.0))
    motion = pushed(25.0)
    other = of(ref.cart(), Motion(time=motion.time, acceleration=-3.0 * motion.acceleration))
    np.testing.assert_allclose(other.hidden, 3.0 * one.hidden, rtol=1e-9)
    assert other.worst[0] == pytest.approx(one.worst[0], rel=1e-9) and other.worst[2] == one.worst[2]
    assert one.participation.sum() == pytest.approx(1.0, rel=1e-12)


def test_a_moment_that_no_carriage_force_shows_is_shown_by_its_links() -> None:
    """Two long carriages and held y and z: the pitch is carried within each, by forces that cancel in its sum."""
    found = of(ref.paper(), pushed(10.0))
    assert found.worst[2].startswith("link ") and [*found.warnings()]


# ---- in the audit


def test_the_band_stays_with_a_result_and_files_of_before_have_half_the_rate() -> None:
    time = np.arange(1500) * 1e-3
    motion = Motion.along_x(time, np.clip((time - 0.5) / 0.1, 0, 1) * PUSH, bandwidth=6.0)
    result = simulate(ref.cart(), motion)
    assert result.audit.resolution is not None and result.audit.resolution.bandwidth == 6.0
    np.testing.assert_allclose(result.audit.resolution.hidden, of(ref.cart(), motion).hidden, rtol=1e-12)
    (warning,) = ref.warnings_of(result.audit)
    assert "Noise limits the bandwidth" in warning
    before = result.data.copy()
    del before.attrs["motion_bandwidth_Hz"]
    older = Result(ref.cart(), before).audit
    assert older.resolution is not None and older.resolution.bandwidth == pytest.approx(500.0)
    assert not ref.warnings_of(older)


def test_without_the_samples_there_is_no_resolution() -> None:
    audit = simulate(ref.cart(), pushed(1000.0), times=np.arange(100) * 0.01).audit
    assert audit.resolution is None
    assert any(line.startswith("trace") and "unknown" in line for line in audit.lines)


def test_the_example_is_carried_by_its_trace() -> None:
    found = of(*ref.example())
    assert found.worst[0] < 0.5 * LIMITS["hidden load"].most and not [*found.warnings()]
