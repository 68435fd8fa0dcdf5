"""The load monitor from Python: agreement with a simulation, choice of its smoother, source texts, and refusals."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import MACHINE, guideload, refused, write_trace
from lives import PRODUCT, cart
from machines import with_carriages
from texts import one_line

from guideload import Machine, Motion, motion_from_trace, read_trace, simulate
from guideload.base.errors import ArgumentError, ConfigError, SceneError
from guideload.catalogue.product import Product
from guideload.cli.inputs import EXAMPLES
from guideload.life.equivalent_load import EquivalentLoad
from guideload.life.life import life_of
from guideload.life.mean_load import Travel, integrals
from guideload.monitor import Design, Monitor, MonitorSettings, designed
from guideload.monitor.design import PHASES, SampledPath
from guideload.monitor.estimator import filter_taps
from guideload.monitor.source import C_PLACES, c_source, rust_source
from guideload.watch.status import status

SETTINGS = MonitorSettings(period=1e-3, travel_per_count=20e-6, lag=20, max_acceleration=20.0)


@pytest.fixture(scope="module")
def machine() -> Machine:
    return Machine.from_toml(EXAMPLES / "manipulator.toml")


@pytest.fixture(scope="module")
def motion(machine: Machine) -> Motion:
    """The first half, the way there."""
    whole, half = motion_from_trace(read_trace(EXAMPLES / "manipulator.csv"), machine.drive), slice(3500)
    assert whole.velocity is not None
    return Motion(whole.time[half], whole.acceleration[half], velocity=whole.velocity[half])


@pytest.fixture(scope="module")
def design(machine: Machine, motion: Motion) -> Design:
    return designed(machine, motion, SETTINGS)


def test_loads_and_integrals_are_those_of_a_simulation_with_the_same_acceleration(
    machine: Machine, motion: Motion
) -> None:
    result = simulate(machine, motion)
    monitor = Monitor(machine, SETTINGS, filter_taps(3, 2.0, 20))
    velocity, acceleration = motion.velocity, motion.acceleration[:, 0]
    assert velocity is not None
    loads = monitor.push_motion(np.ascontiguousarray(velocity[:, 0]), np.ascontiguousarray(acceleration))
    expected = result.carriage_loads[..., 1:]
    assert np.abs(loads - expected).max() < 1e-12 * np.abs(expected).max()
    totals = monitor.totals()
    travel = Travel(SETTINGS.period * np.arange(acceleration.size), velocity[:, 0], acceleration)
    weights = np.zeros((2, 5, 2))
    weights[0, :2] = 1.0
    rule = EquivalentLoad(weights, 1.0)  # of a machine without ratings: the sum of the forces
    for index, power in enumerate(totals["power"]):
        of_record, path = integrals(travel, result.carriage_loads[:, index], rule, 3.0)
        assert power == pytest.approx(of_record.sum(), rel=1e-9)
        assert totals["distance"] == pytest.approx(path.sum(), rel=1e-9)


def test_the_life_that_is_used_is_that_of_a_simulation() -> None:
    """Carriages with ratings, by the rule of their product; in the status of a watch too."""
    machine, time = cart(), 1e-3 * np.arange(1501)
    acceleration = 3.0 * np.sin(2.0 * np.pi * time)
    speed = np.concatenate([[0.0], np.cumsum(0.5e-3 * (acceleration[1:] + acceleration[:-1]))])
    motion = Motion.along_x(time, acceleration, velocity=speed)
    monitor = Monitor(machine, SETTINGS, filter_taps(3, 2.0, 20))
    monitor.push_motion(speed, acceleration)
    lives = life_of(simulate(machine, motion)).carriages
    expected = [float(one.damage.sum()) for one in lives]
    assert monitor.totals()["life_used"] == pytest.approx(expected, rel=1e-9) and min(expected) > 0.0
    shown = status(monitor, -1, np.zeros((4, 5)), 0, 0.0)["carriages"]
    assert [one["life_used"] for one in shown] == monitor.totals()["life_used"]


@pytest.mark.parametrize(("order", "time_constant", "lag"), [(3, 2.0, 20), (5, 3.0, 12), (3, 6.0, 0)])
def test_the_smoother_is_exact_for_a_constant_acceleration(
    order: int, time_constant: float, lag: int
) -> None:
    taps = filter_taps(order, time_constant, lag)
    instants = np.arange(len(taps) + 2) - (len(taps) + 1 - lag)  # periods after the instant of the estimate
    position = 0.3 + 0.7 * instants + 0.25 * instants**2
    second = np.diff(position, 2)
    assert second @ taps[:, 0] == pytest.approx(0.5, abs=1e-12)
    assert np.diff(position)[-1] + second @ taps[:, 1] == pytest.approx(0.7, abs=1e-4)


def test_the_chosen_smoother_is_no_worse_than_another(
    machine: Machine, motion: Motion, design: Design
) -> None:
    path = SampledPath.of(machine, motion, SETTINGS)
    for time_constant in (1.0, 2.0, 4.0):
        other = filter_taps(3, time_constant, SETTINGS.lag)
        monitors = ((Monitor(machine, SETTINGS, other), phase) for phase in PHASES)
        assert max(path.errors(each, phase)[0] for each, phase in monitors) >= design.peak_error


def test_the_stated_error_holds_where_the_encoder_rounds_otherwise(
    machine: Machine, motion: Motion, design: Design
) -> None:
    path = SampledPath.of(machine, motion, SETTINGS)
    errors = [path.errors(design.monitor(), phase) for phase in (0.05, 0.37, 0.83)]
    for peak, load in errors:
        assert peak < 1.2 * design.peak_error
        assert load < 1.05 * design.load_error


def test_a_finer_encoder_gives_smaller_errors(machine: Machine, motion: Motion, design: Design) -> None:
    fine = designed(machine, motion, SETTINGS.model_copy(update={"travel_per_count": 1e-6}))
    assert fine.peak_error < 0.02 < design.peak_error + 0.01
    assert fine.load_error < 0.6 * design.load_error


EARLY = np.zeros(2500, np.int64)
EARLY[1550] = -1
OFTEN_EARLY = np.where(np.arange(2500) % 10 == 5, -1, 0)
DRIFT = np.arange(2500) // 500  # 100 ppm


@pytest.mark.parametrize("late", [EARLY, -EARLY, OFTEN_EARLY, -OFTEN_EARLY, DRIFT])
def test_samples_that_are_late_or_early_by_a_tick_change_no_loads(machine: Machine, late: np.ndarray) -> None:
    """Of 20 ticks a period, at up to 1 m/s; each count is that of its stamp."""
    settings = SETTINGS.model_copy(update={"travel_per_count": 5e-8, "ticks": 20})
    periods, loads = np.arange(2500), []
    for moved in (0 * late, late):
        time = 1e-3 * np.maximum(periods + moved / 20 - 1000, 0.0)
        counts = np.round(0.25 * (1.0 - np.cos(4.0 * time)) / 5e-8).astype(int)
        monitor = Monitor(machine, settings, filter_taps(3, 3.0, 20))
        loads.append(monitor.push(20 * periods + moved, counts)[2][1000:, :, :2])
        totals = monitor.totals()
        assert [totals[name] for name in ("jumps", "counter_set", "missing", "early")] == [0, 0, 0, 0]
    # The grid follows by 1/64 tick for each tick of a stamp, which is 0.8 um here.
    assert np.abs(loads[1] - loads[0]).max() < 0.03 * np.ptp(loads[0], axis=0).max()


@pytest.mark.parametrize("pause", [10, 4_290, 3_600_000])
def test_a_pause_is_counted_for_stamps_in_nanoseconds(machine: Machine, pause: int) -> None:
    settings = SETTINGS.model_copy(update={"ticks": 1_000_000})
    monitor = Monitor(machine, settings, filter_taps(3, 3.0, 20))
    periods = np.concatenate([np.arange(50), 49 + pause + np.arange(50)])
    taken, numbers, _ = monitor.push(1_700_000_000_000_000_000 + 1_000_000 * periods, np.full(100, 7))
    totals = monitor.totals()
    assert (taken[50], totals["restarts"], totals["lost"], totals["early"]) == (5, 2, pause, 0)
    assert numbers[-1] == periods[-1] - settings.lag


def test_records_carry_the_totals_to_another_monitor(design: Design) -> None:
    monitor = design.monitor()
    counts = np.repeat(np.uint32(7), 3000)
    monitor.push(np.arange(3000, dtype=np.uint32), counts)
    record = monitor.save(4)
    again = design.monitor()
    assert again.restore(b"", record) == 4
    assert again.totals() == monitor.totals()
    with pytest.raises(ValueError, match="checksum"):
        again.restore(record[:-1] + b"x", record[:-1] + b"x")


def test_source_texts_have_all_constants_and_fit_their_places(design: Design) -> None:
    rust, c = rust_source(design), c_source(design)
    assert "pub static PREPARED: Constants" in rust and "guideload_machine = {" in c
    constants = design.monitor().constants()
    for name in constants:
        assert f"    {name}: " in rust and f"    .{name} = " in c
    assert "nan" not in rust.lower() and "inf" not in rust.lower().replace("f32::infinity", "")
    long = replace(
        design, settings=SETTINGS.model_copy(update={"most_missing": 64}), taps=filter_taps(3, 2.0, 100)
    )
    with pytest.raises(ArgumentError, match=f"{C_PLACES[2]} second differences"):
        c_source(long)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"period": 0.0}, "period"),
        ({"travel_per_count": 0.0}, "travel_per_count"),
        ({"lag": 500}, "lag"),
        ({"encoder_bits": 40}, "encoder_bits"),
        ({"max_acceleration": 1e10}, "max_acceleration"),
    ],
)
def test_settings_out_of_range_are_refused(change: dict[str, float], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        SETTINGS.model_copy(update=change)


def test_machines_that_a_monitor_cannot_compute_are_refused(machine: Machine, motion: Motion) -> None:
    curved = with_carriages(machine, machine.carriages[0].name, clearance_y=1e-5)
    with pytest.raises(SceneError, match="no bound"):
        designed(curved, motion, SETTINGS)
    assert machine.drive is not None
    drive = machine.drive.model_copy(update={"pressure_angle": 0.35, "push_direction": (0.0, 1.0, 0.0)})
    with pytest.raises(SceneError, match="pressure_angle"):
        designed(machine.model_copy(update={"drive": drive}), motion, SETTINGS)


def test_another_exponent_of_the_life_is_refused() -> None:
    product = {**PRODUCT, "dynamic": {**PRODUCT["dynamic"], "exponent": 3.333}}
    machine = cart().model_copy(update={"products": (Product(**product),)})
    with pytest.raises(SceneError, match="computes the life with the exponent 3 or 10/3, got 3.333"):
        Monitor(machine, SETTINGS, filter_taps(3, 2.0, 20))


def test_a_motion_without_travel_is_refused(machine: Machine) -> None:
    still = Motion.along_x(np.arange(10.0), np.zeros(10))
    with pytest.raises(ArgumentError, match="travel of 100 counts"):
        designed(machine, still, SETTINGS)


def test_the_command_writes_the_constants(tmp_path: Path) -> None:
    trace = write_trace(tmp_path / "trace.csv", 2000, 0.2)
    given = ("monitor", "build", MACHINE, trace, "--period", "1 ms", "--travel-per-count", "20 um", "-o")
    assert "peak loads are within" in one_line(guideload(*given, tmp_path / "monitor.h").stdout)
    assert "guideload_machine" in (tmp_path / "monitor.h").read_text()
    assert "exists" in refused(*given, tmp_path / "monitor.h")
    assert ".rs, .h, .toml" in one_line(refused(*given, tmp_path / "monitor.txt"))
    guideload(*given, tmp_path / "monitor.RS")
    assert "pub const" in (tmp_path / "monitor.RS").read_text()
