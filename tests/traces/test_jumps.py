"""Wild speeds in slow logs: found at their rows, while no real or made motion is taken for one."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from made_traces import FAMILIES, moves
from trace_files import has_note, refuses

from guideload.traces.quality.jumps import drop_outs, speed_jumps
from guideload.traces.quality.repair import outliers
from guideload.traces.reading import read_trace

RATES = (10.0, 20.0, 50.0, 100.0, 1000.0)


def made(rate: float, seed: int, quantum: float = 1e-4) -> tuple[np.ndarray, np.ndarray]:
    """Stamps and speeds of moves of drives."""
    rng = np.random.default_rng(seed)
    truth, end = moves(FAMILIES[seed % len(FAMILIES)], rng)
    time = np.arange(int(end * rate)) / rate
    return time, quantum * np.round(truth(time)[1] / quantum)


def trapezoids(rate: float, cruise: float = 1.5) -> tuple[np.ndarray, np.ndarray]:
    """Long moves to and fro at 0.8 m/s, so quick to speed that at 10 Hz no row shows a ramp."""
    time = np.arange(int(12.0 * rate)) / rate
    phase = time % (2.0 * cruise + 1.0)
    forward = (phase >= 0.25) & (phase < 0.25 + cruise)
    back = (phase >= 0.75 + cruise) & (phase < 0.75 + 2.0 * cruise)
    return time, 0.8 * forward - 0.8 * back


@pytest.mark.parametrize("rate", RATES)
def test_no_made_motion_is_taken_for_a_jump(rate):
    for seed in range(12):
        for quantum in (1e-7, 1e-4, 1e-3):
            time, speed = made(rate, seed, quantum)
            assert not speed_jumps(time, speed, False, quantum, None).any()
    for cruise in (0.3, 0.6, 1.5):
        time, speed = trapezoids(rate, cruise)
        assert not speed_jumps(time, speed, False, 1e-4, None).any()


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("run", [1, 2, 5])
def test_values_of_a_broken_line_are_found_alone_and_together(rate, run):
    """65535 mm/s, also in the first and the last row."""
    for seed in range(4):
        time, speed = made(rate, seed)
        for start in (0, speed.size // 3, speed.size - run):
            wild = speed.copy()
            wild[start : start + run] = 65.535
            assert outliers(time, wild, False, 1e-4, None).tolist() == [*range(start, start + run)]


@pytest.mark.parametrize("rate", RATES)
def test_spikes_are_found(rate):
    """20 times the speed of their row, in a row that is not slow."""
    for seed in range(8):
        time, speed = made(rate, seed)
        spots = np.flatnonzero(np.abs(speed[3:-3]) > 0.2 * np.abs(speed).max())[::11] + 3
        spots = spots[np.concatenate([[True], np.diff(spots) > 6])][:2]
        wild = speed.copy()
        wild[spots] *= 20.0
        assert outliers(time, wild, False, 1e-4, None).tolist() == spots.tolist()


@pytest.mark.parametrize("rate", RATES)
def test_drop_outs_in_long_moves_are_refused_and_left_out(rate):
    time, speed = trapezoids(rate)
    spots = [int(1.1 * rate), int(5.1 * rate)]
    lost = speed.copy()
    lost[spots] = 0.0
    assert np.all(speed[spots] != 0.0)
    table, where = {"t_s": time, "v_m_s": lost}, f"index {spots[0]}, {spots[1]}:"
    refuses(f"jumps that motion cannot make .* in {where}", read_trace, table, quantum=1e-4)
    trace = read_trace(table, quantum=1e-4, repair="outliers")
    assert np.array_equal(trace.value, np.delete(speed, spots))


def test_a_short_stop_among_others_is_noted_and_not_removed():
    """Short moves at 10 Hz: a 0 in one row may be a stop."""
    time = np.arange(200) / 10.0
    speed = 0.3 * ((np.arange(200) % 8) < 5) * ((np.arange(200) // 40) % 2)
    speed[58:63] = [0.3, 0.3, 0.0, 0.3, 0.3]
    assert drop_outs(speed, 1e-4)[60]
    for repair in (None, "all"):
        trace = read_trace({"t_s": time, "v_m_s": speed}, quantum=1e-4, repair=repair)
        assert np.array_equal(trace.value, speed)
        assert has_note(trace, "0 between rows of one speed, index", "60")


def test_findings_turn_and_scale_with_the_motion():
    time, speed = trapezoids(50.0)
    speed[[60, 260]] = 0.0
    speed[[20, 220]] = 30.0
    first = speed_jumps(time, speed, False, 2.0**-10, None)
    assert np.flatnonzero(first).tolist() == [20, 60, 220, 260]
    for scale in (-1.0, 0.25, 64.0):
        assert np.array_equal(speed_jumps(time, scale * speed, False, abs(scale) * 2.0**-10, None), first)
    assert np.array_equal(speed_jumps(-time[::-1], speed[::-1], False, 2.0**-10, None), first[::-1])


def test_real_motion_at_10_hz_is_no_jump(shared_data: Path):
    """Corners of a milling path stop an axis for less than a row: noted where the row holds a plain 0."""
    file = shared_data / "michigan_cnc_experiment_01.csv"
    table = pd.read_csv(file)
    for column in (f"{axis}1_{which}Velocity" for axis in "XYZS" for which in ("Actual", "Command")):
        trace = read_trace(table, column=column, unit="mm/s", rate=10, cross_check=False)
        assert trace.value == pytest.approx(table[column].to_numpy() * 1e-3)
    corners = read_trace(file, column="X1_CommandVelocity", unit="mm/s", rate=10, repair="all")
    assert has_note(corners, "3 samples are 0 between rows of one speed, rows")
    actual = read_trace(file, column="X1_ActualVelocity", unit="mm/s", rate=10)
    for spot in (100, 500, 900):
        wild = actual.value.copy()
        wild[spot : spot + 3] = 65.535
        found = outliers(actual.time, wild, False, actual.quantum, None)
        assert found.tolist() == [spot, spot + 1, spot + 2]


def test_the_speed_of_emps_is_no_jump(shared_data: Path):
    trace = read_trace(shared_data / "emps_bangbang_1kHz.csv")
    for every in (1, 5, 10, 50, 100):  # 1 kHz to 10 Hz
        speed = np.gradient(trace.value, trace.time)[::every]
        assert not speed_jumps(trace.time[::every], speed, False, 0.0, None).any()
