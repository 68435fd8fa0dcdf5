"""Laws of the credible bands: the uncertainty of the acceleration, carried to loads and peaks."""

import copy
import pickle
from dataclasses import replace
from fractions import Fraction
from functools import cache
from math import factorial

import numpy as np
import pytest
import reference as ref
from linear_gaussian import dense, problem
from machines import having
from made_traces import case
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from moves import GENTLE

from guideload import Machine, Motion, Result, TraceError, _core, plots, simulate
from guideload.cli.inputs import EXAMPLES
from guideload.motion.uncertainty import COVER, Uncertainty
from guideload.reports import run as report
from guideload.simulation.bands import IN_MEMORY, bands_of
from guideload.traces.reading import motion_from_trace, read_trace

SEED = 5
DEVIATIONS = (
    *("force_sd", "moment_sd", "resultant_sd", "moment_magnitude_sd"),
    *("link_load_sd", "cart_acceleration_sd"),
)
BANDS = {*DEVIATIONS, "peak_resultant_lower", "peak_resultant_upper"}


def uncertain(
    states: int, derivative: int = 1, size: float = 0.5, oscillator: tuple[float, float, int] | None = None
) -> tuple[Uncertainty, np.ndarray]:
    """The uncertainty after 12 samples, and the covariance of the acceleration by conditioning a joint normal."""
    unit = size * np.linspace(0.7, 1.3, 12)
    step, value, variance, mean, covariance, cell, intensity = problem(states)
    _, full, _ = dense(states, step, value, variance, mean, covariance, intensity[cell], oscillator)
    found = Uncertainty(step, variance, covariance, cell, intensity, derivative, unit, oscillator=oscillator)
    return found, np.outer(unit, unit) * full[derivative::states, derivative::states]


def short(uncertainty: Uncertainty | None, scale: float = 0.02) -> Motion:
    """A push of 12 samples, 2 to 6 ms apart."""
    step = problem(2)[0]
    time = np.concatenate([[0.0], np.cumsum(step)]) * scale
    return Motion.along_x(time, np.sin(np.arange(12.0)), uncertainty=uncertainty)


def responses(machine: Machine, motion: Motion, times: np.ndarray) -> dict[str, np.ndarray]:
    """(n, ...) what a unit of acceleration at each stamp adds to the histories."""
    still = simulate(machine, Motion.along_x(motion.time, 0.0 * motion.time), times=times)
    found: dict[str, list[np.ndarray]] = {"force": [], "moment": [], "link_load": [], "cart_acceleration": []}
    for unit in np.eye(motion.time.size):
        result = simulate(machine, Motion.along_x(motion.time, unit), times=times)
        for name, rows in found.items():
            rows.append(result.data[name].values - still.data[name].values)
    return {name: np.array(rows) for name, rows in found.items()}


def spread(response: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Standard deviation of what is linear in the accelerations."""
    return np.sqrt(np.maximum(np.einsum("k...,kl,l...->...", response, covariance, response), 0.0))


# ---- the posterior


RINGING = 4.0, 0.1, 2  # an oscillator: frequency, damping ratio, index of the acceleration


@pytest.mark.parametrize(
    ("states", "derivative", "oscillator"),
    [(2, 1, None), (4, 2, None), (6, 2, None), (5, 2, RINGING), (6, 2, RINGING)],
)
def test_draws_have_the_posteriors_covariance(
    states: int, derivative: int, oscillator: tuple[float, float, int] | None
) -> None:
    found, true = uncertain(states, derivative, 1.0, oscillator)
    count = 40_000
    drawn = found.draws(count, np.random.default_rng(SEED))
    scale = np.sqrt(np.diag(true))
    # 5 standard deviations of a mean, and of a covariance, of that many draws.
    assert np.abs(drawn.mean(axis=0) / scale).max() < 5.0 / np.sqrt(count)
    assert np.abs((np.cov(drawn.T) - true) / np.outer(scale, scale)).max() < 5.0 * np.sqrt(2.0 / count)
    again = found.draws(7, np.random.default_rng(SEED))
    assert np.array_equal(again, drawn[:7])


def exactly(states: int, step: np.ndarray, variance: np.ndarray, intensity: np.ndarray) -> np.ndarray:
    """Posterior variance of the last number of the state, start covariance 1, in fractions: nothing is rounded."""
    count, numbers = variance.size, range(states)
    fraction = np.vectorize(Fraction, otypes=[object])
    h, q = fraction(step), fraction(intensity)
    covariance = {(0, 0): fraction(np.eye(states))}  # of the states at two samples
    for k in range(count - 1):
        phi = [
            [h[k] ** (j - i) / factorial(j - i) if j >= i else Fraction(0) for j in numbers] for i in numbers
        ]
        down = [(states - 1 - i, factorial(states - 1 - i)) for i in numbers]
        noise = [[q[k] * h[k] ** (a + b + 1) / ((a + b + 1) * c * d) for b, d in down] for a, c in down]
        for i in range(k + 1):
            covariance[k + 1, i] = np.array(phi) @ covariance[k, i]
            covariance[i, k + 1] = covariance[k + 1, i].T
        covariance[k + 1, k + 1] = covariance[k + 1, k] @ np.array(phi).T + np.array(noise)
    prior = np.array([[covariance[i, j] for j in range(count)] for i in range(count)])
    samples, last = prior[:, :, 0, 0] + np.diag(fraction(variance)), prior[:, :, 0, states - 1]
    table = np.hstack([samples, last])
    for i in range(count):  # Gauss and Jordan; the matrix is positive definite
        table[i] /= table[i, i]
        for j in set(range(count)) - {i}:
            table[j] -= table[j, i] * table[i]
    explained = (last * table[:, count:]).sum(axis=0)
    return (np.diagonal(prior[:, :, -1, -1]) - explained).astype(float)


@pytest.mark.parametrize("decades", [[-8, 12, -8, -8, 10, -10, 0], [10, 6, 2, -2, -6, -10, 10]])
def test_intensities_may_differ_by_twenty_decades(decades: list[int]) -> None:
    step = np.array([1.0, 1.5, 0.5, 1000.0, 1.0, 0.75, 1.25])
    variance = np.array([1.0, 0.5, 2.0, 1e12, 0.25, 1.0, 0.125, 2.0])
    intensity = 10.0 ** np.array(decades, float)
    chain = (step, variance, np.eye(3), np.arange(7, dtype=np.uint32), intensity, None)
    time = np.arange(8.0)
    nothing = (np.zeros((8, 0, 6)), [], np.zeros((0, 3)))
    found, *_ = _core.load_spread(ref.cart().scene, chain, 2, np.ones(8), time, time, *nothing)
    np.testing.assert_allclose(found**2, exactly(3, step, variance, intensity), rtol=1e-8)


# ---- linear scenes


@pytest.mark.parametrize(("states", "oscillator"), [(2, None), (4, None), (6, None), (5, RINGING)])
def test_histories_spread_as_impulse_responses_times_the_covariance(
    states: int, oscillator: tuple[float, float, int] | None
) -> None:
    machine = ref.cart()
    uncertainty, covariance = uncertain(states, 2 if oscillator else 1, oscillator=oscillator)
    motion = short(uncertainty)
    times = np.sort(
        np.concatenate([motion.time, np.random.default_rng(SEED).uniform(0.0, motion.time[-1], 20)])
    )
    result = simulate(machine, motion, times=times)
    for name, response in responses(machine, motion, times).items():
        wanted = spread(response, covariance)
        np.testing.assert_allclose(result.data[f"{name}_sd"], wanted, atol=1e-9 * wanted.max(), err_msg=name)
        if name in ("force", "moment"):
            load = result.data[name].values[..., 1 if name == "force" else 0 :]
            size = np.linalg.norm(load, axis=2)
            along = np.einsum("kmca,mca->kmc", response[..., -load.shape[2] :], load / size[:, :, None])
            sizes = result.data["resultant_sd" if name == "force" else "moment_magnitude_sd"]
            np.testing.assert_allclose(sizes, spread(along, covariance), atol=1e-9 * wanted.max())


def test_a_band_knows_no_more_at_few_instants_than_at_all() -> None:
    machine, motion = ref.cart(), short(uncertain(4)[0])
    whole, few = (simulate(machine, motion, times=each).data for each in (motion.time, motion.time[[3, 7]]))
    for name in DEVIATIONS:
        np.testing.assert_allclose(few[name], whole[name][[3, 7]], rtol=1e-12, err_msg=name)


def test_deviations_grow_with_the_unit_and_with_the_samples_noise() -> None:
    machine, (uncertainty, _) = ref.cart(), uncertain(4)
    one = simulate(machine, short(uncertainty)).data
    noisy = replace(
        uncertainty,
        variance=9.0 * uncertainty.variance,
        covariance=9.0 * uncertainty.covariance,
        density=9.0 * uncertainty.density,
    )
    for more in (replace(uncertainty, unit=3.0 * uncertainty.unit), noisy):
        three = simulate(machine, short(more)).data
        for name in DEVIATIONS:
            np.testing.assert_allclose(three[name], 3.0 * one[name], rtol=1e-9, atol=1e-12, err_msg=name)


def test_a_motion_that_cannot_deviate_has_no_band() -> None:
    uncertainty, _ = uncertain(3)
    sure = replace(uncertainty, covariance=0.0 * uncertainty.covariance, density=0.0 * uncertainty.density)
    result = simulate(ref.cart(), short(sure))
    for name in DEVIATIONS:
        assert not result.data[name].values.any(), name
    peaks = result.peaks()
    np.testing.assert_allclose(peaks["peak_lower_N"], peaks["peak_resultant_N"], rtol=1e-14)
    np.testing.assert_allclose(peaks["peak_upper_N"], peaks["peak_resultant_N"], rtol=1e-14)
    assert not peaks["noise_share_percent"].any()


def test_peaks_are_those_of_the_draws_run_one_by_one() -> None:
    machine, (uncertainty, _) = ref.cart(), uncertain(4)
    motion = short(uncertainty)
    result = simulate(machine, motion, times=motion.time)
    loads = np.ascontiguousarray(result.carriage_loads)
    groups = machine.links_of_carriages, machine.carriage_centers
    everywhere = np.ones(loads.shape[:2], bool)
    given = uncertainty.model, uncertainty.derivative, uncertainty.unit, motion.time, motion.time
    found = _core.draw_peaks(machine.scene, *given, loads, everywhere, *groups, 20, SEED, 1)
    again = _core.draw_peaks(machine.scene, *given, loads, everywhere, *groups, 20, SEED, 3)
    assert np.array_equal(found, again)
    drawn = uncertainty.unit * _core.draw_motion(uncertainty.model, uncertainty.derivative, 20, SEED)
    for i, deviation in enumerate(drawn):
        moved = Motion.along_x(motion.time, motion.acceleration[:, 0] + deviation)
        alone = simulate(machine, moved, times=moved.time)
        np.testing.assert_allclose(found[:, i], alone.data["resultant"].values.max(axis=0), rtol=1e-11)


def test_the_band_of_a_peak_is_that_of_brute_force() -> None:
    """Its ends lie where 300 other draws, run one by one, have them: within 4 deviations of such a quantile."""
    machine, (uncertainty, _) = ref.cart(), uncertain(3, 2, 0.2)
    motion = short(uncertainty)
    peaks = []
    for deviation in uncertainty.draws(300, np.random.default_rng(SEED)):
        drawn = Motion.along_x(motion.time, motion.acceleration[:, 0] + deviation)
        loads = simulate(machine, drawn).carriage_loads
        peaks.append(np.hypot(loads[:, :, 1], loads[:, :, 2]).max(axis=0))
    band = simulate(machine, motion).peaks()
    below = np.mean(np.array(peaks) < band["peak_lower_N"].to_numpy(), axis=0)
    above = np.mean(np.array(peaks) > band["peak_upper_N"].to_numpy(), axis=0)
    scatter = np.sqrt(0.025 * 0.975 * (1.0 / 300 + 1.0 / 200))
    assert np.abs(np.concatenate([below, above]) - 0.025).max() < 4.0 * scatter


def test_bands_cover_what_is_drawn_from_the_model_itself() -> None:
    """Motions and samples drawn from the model: 95 % of loads lie in their bands, and 2.5 % of peaks above theirs.

    Fewer may lie below: a peak that is the load at rest is that of all draws too.
    """
    rng, states, count, runs = np.random.default_rng(SEED), 3, 25, 400
    machine, time = ref.cart(), 0.004 * np.arange(count)
    step, variance, cell = np.ones(count - 1), np.full(count, 0.5), np.zeros(count - 1, np.uint32)
    covariance, intensity = np.diag([1.0, 0.5, 0.3]), np.array([0.2])
    uncertainty = Uncertainty(step, variance, covariance, cell, intensity, 2, np.ones(count))
    # With samples that tell nothing, draws are of the model before any sample: all numbers of the state.
    prior = (step, np.full(count, np.inf), covariance, cell, intensity, None)
    place, truth = (_core.draw_motion(prior, which, runs, SEED) for which in (0, 2))
    outside = {"load": 0, "above": 0, "below": 0}
    for position, acceleration in zip(place, truth, strict=True):
        samples = position + np.sqrt(variance) * rng.standard_normal(count)
        mean, _, _ = _core.smooth_motion(
            (step, samples, variance, np.zeros(states), covariance, cell, intensity, None)
        )
        estimate = Motion.along_x(time, mean[:, 2], uncertainty=uncertainty)
        found = simulate(machine, estimate, times=time)
        true = simulate(machine, Motion.along_x(time, acceleration), times=time).carriage_loads
        at = int(rng.integers(2, count)), int(rng.integers(4)), int(rng.integers(1, 3))
        assert found._run is not None
        bands = bands_of(found._run, found.carriage_loads)
        assert bands is not None
        peak = np.hypot(true[:, at[1], 1], true[:, at[1], 2]).max()
        outside["load"] += abs(found.carriage_loads[at] - true[at]) > COVER * bands.loads[at]
        outside["above"] += peak > bands.upper[at[1]] * (1.0 + 1e-9)
        outside["below"] += peak < bands.lower[at[1]] * (1.0 - 1e-9)
    one, both = (4.0 * np.sqrt(part * (1.0 - part) / runs) for part in (0.025, 0.05))  # standard deviations
    assert abs(outside["load"] / runs - 0.05) < both
    assert abs(outside["above"] / runs - 0.025) < one
    assert outside["below"] / runs < 0.025 + one


def test_a_force_with_other_stamps_does_not_change_the_band() -> None:
    machine, motion = ref.cart(), short(uncertain(4)[0])
    when = np.array([0.01, 0.02, 0.02, 0.0301])
    pushed = motion.with_force([0.1, 0.2, 0.3], 300.0 * np.ones((4, 3)), time=when)
    assert pushed.time.size > motion.time.size
    twice = pushed.with_force([0.1, 0.2, 0.3], [10.0, 0.0, 0.0], time=[0.005, 0.006])
    alone = simulate(machine, motion, times=twice.time).data
    found = simulate(machine, twice, times=twice.time).data
    for name in ("force_sd", "moment_sd", "link_load_sd", "cart_acceleration_sd"):
        np.testing.assert_allclose(found[name], alone[name], rtol=1e-9, atol=1e-9, err_msg=name)


# ---- other scenes


def straight() -> Machine:
    """The cart with curves for stiffnesses, which are straight as far as it gets, 1 mm."""
    curve = ((-2e-3, -3e5), (-1e-3, -1.2e5), (1e-3, 1.2e5), (2e-3, 3e5))
    return ref.cart(stiffness_y=None, stiffness_z=None, curve_y=curve, curve_z=curve)


def test_draws_through_a_scene_agree_with_the_covariance_where_it_is_linear_after_all() -> None:
    motion = short(uncertain(4)[0]).with_force([0.0, 0.0, 0.0], [0.0, 5.0, 0.0], time=[0.01, 0.011])
    drawn, exact = (simulate(machine, motion, times=motion.time) for machine in (straight(), ref.cart()))
    assert straight().scene.model_level == "piecewise linear"
    np.testing.assert_allclose(drawn.carriage_loads, exact.carriage_loads, rtol=1e-6, atol=1e-3)
    count = drawn.data.attrs["band_samples"]
    assert count == 40 and "40 Monte Carlo samples" in drawn.data.attrs["band_method"]
    assert "exactly" in exact.data.attrs["band_method"]
    # 5 standard deviations of a root mean square of that many draws; these are not independent over time.
    off = 5.0 / np.sqrt(2.0 * count)
    for name in ("force_sd", "link_load_sd", "cart_acceleration_sd"):
        wanted = exact.data[name].values
        np.testing.assert_allclose(drawn.data[name], wanted, rtol=off, atol=1e-6 * wanted.max(), err_msg=name)
    width = [(one.peaks()["peak_upper_N"] - one.peaks()["peak_lower_N"]).to_numpy() for one in (drawn, exact)]
    np.testing.assert_allclose(width[0], width[1], rtol=off)


@pytest.mark.parametrize("make", [ref.cart_clear, ref.preloaded])
def test_scenes_that_are_not_linear_have_bands_and_say_how(make: type) -> None:
    motion = short(uncertain(3, 2, 0.05)[0])
    result = simulate(make(), motion)
    assert set(result.data.data_vars) >= BANDS
    assert make().scene.model_level in result.data.attrs["band_method"]
    peaks = result.peaks()
    assert (peaks["peak_lower_N"] < peaks["peak_upper_N"]).all()
    # At rest all draws are alike.
    np.testing.assert_allclose(result.data["force_sd"][0], 0.0, atol=1e-6)


@pytest.mark.parametrize("make", [ref.cart, ref.cart_clear])
def test_each_drawn_motion_has_its_own_push_of_a_rack(make: type) -> None:
    """Loads under drawn motions, and their rms distance from the estimate, are those of single runs.

    These have more stamps where |F| is not linear: 0.25 % of the push.
    """
    rack = {"pinion_diameter": 0.1, "pressure_angle": "20 deg", "push_direction": (0.0, 1.0, 0.0)}
    machine, uncertainty = having(make(), drive=rack), uncertain(3)[0]
    motion = short(uncertainty)
    times = motion.time[1:]  # given instants: all runs have the same ones
    result = simulate(machine, motion, times=times)
    rng, count = np.random.default_rng(result.data.attrs["band_seed"]), result.data.attrs["band_samples"]
    draws = np.vstack([uncertainty.draws(IN_MEMORY, rng) for _ in range(count // IN_MEMORY)])
    moved = (Motion.along_x(motion.time, motion.acceleration[:, 0] + one) for one in draws)
    singles = np.array([simulate(machine, one, times=times, start="rest").carriage_loads for one in moved])
    linear = 5e-4 * np.abs(singles).max()
    np.testing.assert_allclose(list(result.drawn_loads(IN_MEMORY)), singles[:IN_MEMORY], rtol=0, atol=linear)
    rms = np.sqrt(np.mean((singles - result.carriage_loads) ** 2, axis=0))
    np.testing.assert_allclose(result.data["force_sd"], rms[:, :, :3], rtol=0, atol=1e-3 * rms.max())
    peaks = np.hypot(singles[..., 1], singles[..., 2]).max(axis=1)
    half = COVER * peaks.std(axis=0, ddof=1)
    np.testing.assert_allclose(result.data["peak_resultant_upper"], peaks.mean(axis=0) + half, rtol=5e-4)


# ---- results, files, reports, pictures


@cache
def example() -> Result:
    return simulate(*ref.example())


@pytest.mark.parametrize(
    ("quantum", "noise", "widest"),
    [(5e-8, 0.0, 0.02), (1e-6, 2e-6, 0.02), (1e-5, 5e-6, 0.021), (8e-5, 0.0, 0.02)],
)
def test_peaks_of_a_gentle_move_are_within_a_percent_and_the_band_says_so(
    quantum: float, noise: float, widest: float
) -> None:
    """A move measured by encoders over three decades, against the move itself."""
    time = GENTLE.times(1000.0)
    position, _, acceleration = GENTLE.motion(time)
    machine = ref.cart()
    shaken = position + noise * np.random.default_rng(SEED).standard_normal(time.size)
    table = {"t_s": time, "x_m": quantum * np.round(shaken / quantum)}
    measured = simulate(machine, motion_from_trace(read_trace(table, quantum=quantum))).peaks()
    true = simulate(machine, Motion.along_x(time, acceleration)).peaks()["peak_resultant_N"]
    assert (measured["peak_resultant_N"] / true - 1.0).abs().max() < 0.01
    assert (measured["peak_lower_N"] < true).all() and (true < measured["peak_upper_N"]).all()
    assert ((measured["peak_upper_N"] - measured["peak_lower_N"]) / true).max() < widest


def test_bands_hold_the_peaks_of_machines_that_ring() -> None:
    """Moves with jumps of acceleration or jerk, rounded to 1 to 50 um, of a machine with damping ratios of 1 %.

    The four carriages of a move err together: 41 of 48 allow for two moves whose bands miss, of twelve.
    """
    text = (
        (EXAMPLES / "manipulator.toml")
        .read_text()
        .replace("10.4 kN s/m", "4.2 kN s/m")
        .replace("3.1 kN s/m", "1.25 kN s/m")
    )
    machine = Machine.from_text(text)
    held = []
    for seed, quantum in enumerate(np.repeat([1e-6, 5e-6, 5e-5], 4)):
        family = ("jerk-limited", "trapezoid")[seed % 2]
        one = case(family, 1000.0, quantum, 0.0, 0.0, np.random.default_rng(seed))
        trace = read_trace({"t_s": one.time, "x_m": one.value}, quantum=quantum)
        band = simulate(machine, motion_from_trace(trace)).peaks()
        true = simulate(machine, Motion.along_x(one.time, one.acceleration)).peaks()["peak_resultant_N"]
        held += list((band["peak_lower_N"] < true) & (true < band["peak_upper_N"]))
    assert np.sum(held) >= 41


def test_only_an_uncertain_motion_has_bands() -> None:
    result = simulate(ref.cart(), short(None))
    assert not BANDS & set(result.data.data_vars)
    assert not [name for name in result.data.attrs if name.startswith("band")]
    assert not {"peak_lower_N", "peak_upper_N", "noise_share_percent"} & set(result.peaks().columns)
    assert "noise" not in report.result_report(result).text()
    assert "95 %" not in plots.resultant(result).get_legend().get_texts()[-1].get_text()


def test_bands_are_found_when_asked_for() -> None:
    result = simulate(ref.cart(), short(uncertain(4)[0]))
    assert result.audit.lines and "quantities" not in result.__dict__
    assert result.data is result.data
    for name in BANDS:
        assert result.data[name].attrs["units"] and result.data[name].attrs["long_name"]
    assert result.data.attrs["band_seed"] == 1 and result.data.attrs["band_samples"] == 200


def test_the_share_of_noise_is_that_of_the_instant_of_the_peak() -> None:
    result = example()
    data, peaks = result.data, result.peaks()
    for name, row in peaks.iterrows():
        one = data.sel(carriage=name)
        at = int(np.argmax(one["resultant"].values))
        share = 196.0 * float(one["resultant_sd"][at]) / float(one["resultant"][at])
        assert row["noise_share_percent"] == pytest.approx(share, rel=1e-12)
        assert 0.0 < share < 2.0
        assert row["peak_lower_N"] < row["peak_resultant_N"] < row["peak_upper_N"]


def filled(ax: Axes) -> list[np.ndarray]:
    return [
        np.concatenate([path.vertices for path in fill.get_paths()])
        for fill in ax.collections
        if isinstance(fill, PolyCollection) and fill.get_paths() and len(fill.get_paths()[0].vertices) > 3
    ]


def test_pictures_show_the_bands() -> None:
    result = example()
    data = result.data
    for plot, name, axis in ((plots.load_y, "1a", "y"), (plots.load_z, "2b", "z")):
        ax = plot(result, name)
        one, sd = (data[part].sel(carriage=name, axis=axis).values for part in ("force", "force_sd"))
        (band,) = filled(ax)
        assert band[:, 1].max() == pytest.approx((one + 1.96 * sd).max(), rel=1e-12)
        assert band[:, 1].min() == pytest.approx((one - 1.96 * sd).min(), rel=1e-12)
        assert any(text.get_text().startswith("95 % band, up to ±") for text in ax.get_legend().get_texts())
    for ax in (plots.resultant(result), plots.moments(result)):
        assert len(filled(ax)) == data.sizes["carriage"]
        assert any(text.get_text().startswith("95 % band, up to ±") for text in ax.get_legend().get_texts())


# ---- refusals


def test_refusals_tell_what_does_not_agree() -> None:
    uncertainty, _ = uncertain(3)
    with pytest.raises(TraceError, match="uncertainty: expected one of 3 stamps, got 12"):
        Motion.along_x([0.0, 1.0, 2.0], [0.0, 0.0, 0.0], uncertainty=uncertainty)
    wrong = replace(uncertainty, variance=np.where(np.arange(12) == 4, 0.0, 1.0))
    with pytest.raises(ValueError, match=r"variance\[4\]: expected a number > 0, got 0"):
        wrong.draws(1, np.random.default_rng(SEED))
    with pytest.raises(ValueError, match="lengths do not agree"):
        replace(uncertainty, step=np.ones(3)).draws(1, np.random.default_rng(SEED))
    with pytest.raises(ValueError, match="derivative: expected one below 3, got 3"):
        replace(uncertainty, derivative=3).draws(1, np.random.default_rng(SEED))
    time = np.arange(12.0)
    nothing = (np.zeros((12, 0, 6)), [], np.zeros((0, 3)))
    with pytest.raises(ValueError, match="links are all linear"):
        _core.load_spread(
            ref.cart_clear().scene, uncertainty.model, 1, uncertainty.unit, time, time, *nothing
        )
    with pytest.raises(ValueError, match="unit: expected 12 numbers, got 3"):
        _core.load_spread(ref.cart().scene, uncertainty.model, 1, np.ones(3), time, time, *nothing)


def test_a_copy_keeps_the_run_and_a_pickle_does_not() -> None:
    result = simulate(ref.cart(), short(uncertain(2)[0]))
    shallow = copy.copy(result)
    assert np.array_equal(next(shallow.drawn_loads(1)), next(result.drawn_loads(1)))
    assert shallow.machine is result.machine and shallow.whole_run is not None
    assert not list(pickle.loads(pickle.dumps(result)).drawn_loads(1))
