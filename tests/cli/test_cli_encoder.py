"""`guideload encoder`, its report and its picture: they show the trace and its motion; no file is written unasked."""

from pathlib import Path

import numpy as np
import pytest
from command_line import MACHINE, TRACE, guideload, refused
from trace_files import has_note, write_trace
from unrendered import leave_unrendered

from guideload import Inspection, Machine, motion_from_trace, plots, read_trace
from guideload.base.number_text import digits
from guideload.motion.uncertainty import COVER
from guideload.plots.trace import density
from guideload.reports.trace import encoder_report
from guideload.smoothing.estimation import MotionEstimate

QUANTUM = 1e-5  # m
PUSH = 2.2  # m/s2
RADIANS_PER_SECOND = np.pi / 30  # of a turn per minute
TIME = np.arange(1200) * 1e-3


def moved(time: np.ndarray) -> np.ndarray:
    """Position [m]: pushed from 0.3 to 0.5 s, held back from 0.7 to 0.9 s; then at rest."""
    pushes = ((0.3, 1), (0.5, -1), (0.7, -1), (0.9, 1))
    return sum(0.5 * PUSH * sign * np.maximum(time - start, 0.0) ** 2 for start, sign in pushes)


def write_position(folder: Path, time: np.ndarray, position: np.ndarray) -> Path:
    """Positions [m] rounded to 10 um."""
    return write_trace(folder, {"time_s": np.round(time, 4), "position_m": np.round(position, 5)})


@pytest.fixture
def trace(tmp_path: Path) -> Path:
    """1.2 s of positions at 1 kHz."""
    return write_position(tmp_path, TIME, moved(TIME))


def output_of(*arguments: object) -> str:
    """The text of a call that succeeds, in one line."""
    ended = guideload(*arguments)
    assert ended.stderr == ""
    return " ".join(ended.stdout.split())


# ---- the command


def test_the_report_gives_the_estimate_and_nothing_is_written(tmp_path: Path, trace: Path) -> None:
    before = set(tmp_path.iterdir())
    text = output_of("encoder", trace)
    assert set(tmp_path.iterdir()) == before
    estimate = Inspection.of(read_trace(trace)).kinematics
    assert isinstance(estimate, MotionEstimate)
    at = np.abs(estimate.acceleration).argmax()
    half = COVER * np.sqrt(estimate.acceleration_variance[at])
    low, high = estimate.acceleration[at] - half, estimate.acceleration[at] + half
    for part in (
        "trace.csv, column position_m",
        "1.199 s, 1200 samples at 1000 Hz, a sample every 1 ms",
        "time stamps: evenly spaced",
        "quantum 1e-05 m",
        f"white noise model of derivative {estimate.order} of the position",
        f"noise {digits(estimate.noise)} m rms before rounding, "
        f"{estimate.noise / (QUANTUM / np.sqrt(12)):.3g} times the rounding noise",
        f"bandwidth at sudden changes {estimate.bandwidth:.3g} Hz; half the sampling rate is 500 Hz",
        f"largest speed {np.abs(estimate.velocity).max():.4g} m/s",
        f"largest acceleration {estimate.acceleration[at]:.4g} m/s2",
        f"95 % band {low:.4g} to {high:.4g}",
    ):
        assert part in text


@pytest.mark.parametrize("smoothing", ["auto", "differences"])
def test_the_figures_are_those_of_the_motion(smoothing: str) -> None:
    machine = Machine.from_toml(MACHINE)
    inspection = Inspection.of(read_trace(TRACE), machine, smoothing=smoothing)
    motion = motion_from_trace(read_trace(TRACE), machine.drive, smoothing=smoothing)
    np.testing.assert_array_equal(inspection.kinematics.acceleration, motion.acceleration[:, 0])
    np.testing.assert_array_equal(inspection.kinematics.velocity, motion.velocity[:, 0])
    assert inspection.kinematics.bandwidth == motion.bandwidth
    text = " ".join(encoder_report(inspection).text().split())
    assert ("95 % band" in text) == (inspection.deviation is not None)


def test_a_motor_without_a_machine_is_shown_in_motor_units() -> None:
    text = output_of("encoder", TRACE)
    drive = Machine.from_toml(MACHINE).drive
    assert drive is not None
    top = np.abs(motion_from_trace(read_trace(TRACE), drive).velocity).max()
    assert f"largest speed {top / drive.speed_per_motor_speed / RADIANS_PER_SECOND:.4g} rpm" in text
    assert "rad/s2" in text and "m/s2" not in text and " m/s " not in text
    assert "quantum 0.1 rpm" in text  # the last digit of the file
    with_machine = output_of("encoder", TRACE, "--machine", MACHINE)
    assert f"largest speed {top:.4g} m/s" in with_machine and "Modes against the trace's band" in with_machine


def test_the_ratio_stands_for_the_drive_of_a_machine() -> None:
    drive = Machine.from_toml(MACHINE).drive
    assert drive is not None
    travel = 2e3 * np.pi * drive.speed_per_motor_speed
    heads = [
        output_of("encoder", TRACE, *way).partition("No warnings")[0]
        for way in (("--machine", MACHINE), ("--ratio", f"{travel!r} mm"))
    ]
    assert heads[0] == heads[1]
    for wrong in ("33", "-1 mm", "3 kg"):
        assert "--ratio: expected a travel per turn" in refused("encoder", TRACE, "--ratio", wrong)


def test_a_machine_without_a_drive_is_no_reason_to_fail(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    leave_unrendered(monkeypatch)
    bare = tmp_path / "bare.toml"
    machine = Path(MACHINE).read_text(encoding="utf-8")
    start, stop = machine.index("[drive]"), machine.index("[", machine.index("[drive]") + 1)
    bare.write_text(machine[:start] + machine[stop:], encoding="utf-8")
    text = output_of("encoder", TRACE, "--machine", bare, "-o", tmp_path / "a.png")
    assert "no [drive]" in text and "rad/s2" in text and "Modes against" not in text


def test_ten_hertz_cannot_carry_what_the_modes_answer(tmp_path: Path) -> None:
    """In `encoder`, in `check`, and in the report of a run."""
    time = np.arange(0, 12) * 0.1
    slow = write_position(tmp_path, time, moved(time))
    texts = [
        output_of("encoder", slow, "--machine", MACHINE),
        output_of("check", MACHINE, slow),
        output_of("run", MACHINE, slow, "-o", tmp_path / "out", "--no-pictures"),
    ]
    for text in texts:
        assert "which makes mode" in text and "an upper bound" in text
    for text in (output_of("encoder", TRACE, "--machine", MACHINE), output_of("check", MACHINE, TRACE)):
        assert "which makes mode" not in text and "modes that the travel excites" in text


def test_a_trace_that_is_too_noisy_is_warned_of_as_a_run_does(tmp_path: Path) -> None:
    noisy = write_position(
        tmp_path, TIME, moved(TIME) + 0.02 * np.random.default_rng(1).normal(size=TIME.size)
    )
    for text in (output_of("encoder", noisy), output_of("check", MACHINE, noisy)):
        assert "Warning: the noise is" in " ".join(text.split()) and "the acceleration is cut" in text
    assert "No warnings." in output_of("encoder", write_position(tmp_path, TIME, moved(TIME)))


def test_damage_is_refused_with_its_rows_and_the_way_out(tmp_path: Path) -> None:
    position = moved(TIME)
    position[700] += 0.2
    path = write_position(tmp_path, TIME, position)
    told = refused("encoder", path, "-o", tmp_path / "a.png")
    assert "702" in told and "--repair outliers" in told and not (tmp_path / "a.png").exists()
    assert "702" in output_of("encoder", path, "--repair", "outliers")


# ---- the picture


def test_the_picture_shows_the_samples_and_their_motion(trace: Path) -> None:
    inspection = Inspection.of(read_trace(trace), Machine.from_toml(MACHINE))
    smoothed = inspection.kinematics
    samples, rest, acceleration, close, spectrum = plots.encoder(inspection)
    np.testing.assert_array_equal(samples.lines[0].get_ydata(), inspection.value)
    np.testing.assert_array_equal(samples.lines[1].get_ydata(), smoothed.position)
    drawn = {line.get_label(): line for line in acceleration.lines}
    np.testing.assert_array_equal(drawn["smoothed"].get_ydata(), smoothed.acceleration)
    np.testing.assert_array_equal(drawn["plain differences"].get_ydata(), inspection.differences)
    (band,) = acceleration.collections
    corners = band.get_paths()[0].vertices
    assert inspection.deviation is not None
    high = (smoothed.acceleration + COVER * inspection.deviation).max()
    assert corners[:, 1].max() == pytest.approx(high, rel=1e-12)
    low, top = acceleration.get_ylim()
    assert low < smoothed.acceleration.min() and high < top < 1.5 * high < inspection.differences.max()
    np.testing.assert_allclose(
        rest.lines[-1].get_ydata(), (inspection.value - inspection.smoothed) / QUANTUM, rtol=1e-9
    )
    assert close.get_xlim()[0] < inspection.time[inspection.peak] < close.get_xlim()[1]
    marks = {float(line.get_xdata()[0]) for line in spectrum.lines if len(line.get_xdata()) == 2}
    assert {inspection.bandwidth, *inspection.resolution.frequency} <= marks
    assert spectrum.get_xlim()[1] >= inspection.resolution.frequency.max()


def test_a_trace_at_standstill_has_a_picture(tmp_path: Path) -> None:
    inspection = Inspection.of(
        read_trace(write_position(tmp_path, TIME, 0 * TIME)), Machine.from_toml(MACHINE)
    )
    axes = plots.encoder(inspection)
    plots.save(axes[0], tmp_path / "a.png")
    assert not np.any(axes[0].lines[1].get_ydata()) and axes[4].get_yscale() == "linear"
    assert "no acceleration" in encoder_report(inspection).text() and has_note(inspection.trace, "no motion")


def test_density_of_white_noise_is_its_variance_over_the_band() -> None:
    """One-sided, so 2 step variance at every frequency; 3000 lines scatter by 2 %."""
    step, noise = 1e-3, np.random.default_rng(2).normal(0.0, 3.0, 6000)
    frequency, power = density(np.arange(noise.size) * step, noise)
    assert frequency[-1] <= 500.0
    high = frequency > 100.0  # where bands average many lines
    assert power[high].mean() == pytest.approx(2.0 * step * 9.0, rel=0.1)


def test_density_shows_a_tone_where_it_is() -> None:
    time = np.arange(4000) * 1e-3
    frequency, power = density(time, np.sin(2 * np.pi * 40.0 * time))
    assert frequency[power.argmax()] == pytest.approx(40.0, rel=0.06)
