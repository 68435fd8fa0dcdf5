"""Sample-and-hold: a log that repeats each value is read as the signal itself; creep and rest are no holds."""

import numpy as np
import pytest
from trace_files import has_note, refuses, same

from guideload.traces.quality.holds import oversampling_ratio, rows_of_new_values
from guideload.traces.reading import motion_from_trace, read_trace

RATE = 125.0
TIME = np.arange(1000) / RATE
SPEED = np.round(0.6 * np.clip(1.6 * np.sin(2.0 * TIME), -1.0, 1.0), 4)  # ramps, cruises, and rests below
SPEED[(TIME > 4.0) & (TIME < 5.0)] = 0.0
PLACE = np.round(np.cumsum(SPEED) / RATE, 6)


def logged(value: np.ndarray, ratio: float, late: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Stamps and values of a log with `ratio` rows per value, whose first value is `late` rows old."""
    rows = np.arange(int((value.size - 1) * ratio))
    return rows / (ratio * RATE), value[np.floor((rows + late) / ratio).astype(int)]


@pytest.mark.parametrize("name", ["v_m_s", "x_m"])
@pytest.mark.parametrize("ratio", [2, 3, 8, 40])
def test_a_held_log_is_read_as_its_signal(name, ratio):
    signal = SPEED if name == "v_m_s" else PLACE
    time, value = logged(signal, ratio)
    trace = read_trace({"t_s": time, name: value})
    count = trace.time.size
    skipped = signal.size - 1 - count  # the first value's first row is not seen to be it
    assert 0 <= skipped <= 1
    assert np.array_equal(trace.value, signal[skipped : skipped + count])
    assert trace.time == pytest.approx(TIME[skipped : skipped + count], abs=1e-12)
    assert has_note(trace, f"each value is held for {ratio} rows")
    signal_motion = motion_from_trace(read_trace({"t_s": trace.time, name: trace.value}))
    assert np.array_equal(motion_from_trace(trace).acceleration, signal_motion.acceleration)


@pytest.mark.parametrize("ratio", [1.9, 2.4, 16.67])
def test_rates_without_a_whole_ratio(ratio):
    """Each value once, in the first row after it is new: rows are up to one row late, evenly."""
    time, value = logged(SPEED, ratio, late=0.3)
    trace = read_trace({"t_s": time, "v_m_s": value})
    assert abs(trace.time.size - SPEED.size) <= 2
    row = np.round(trace.time * ratio * RATE).astype(int)
    held = np.floor((row + 0.3) / ratio).astype(int)
    assert np.array_equal(trace.value, SPEED[held])
    changed = np.diff(trace.value, prepend=trace.value[0]) != 0.0
    late = row + 0.3 - ratio * np.round((row - 0.2) / ratio)
    assert np.all((late[changed] > -1e-9) & (late[changed] < 1.0))
    assert np.all((late > -1.0) & (late < 2.0))  # those between are spread


def test_the_ratio_can_be_set():
    time, value = logged(SPEED, 8)
    table = {"t_s": time, "v_m_s": value}
    assert read_trace(table, hold=1).time.size == time.size
    given = read_trace(table, hold=8)
    assert same(given, read_trace(table)) and has_note(given, "as given")
    for wrong in (0.5, 1e6, np.nan):
        refuses(r"hold: expected the number of rows .* got .* \(--hold\)", read_trace, table, hold=wrong)
    refuses("hold: values that are held for 30 rows change at most", read_trace, table, hold=30)


@pytest.mark.parametrize("quantum", [1e-3, 1e-4, 1e-5])
@pytest.mark.parametrize(
    "travel",
    [
        lambda t: 0.01 * t,  # each value is held for the same number of rows
        lambda t: 0.03 * np.sin(0.5 * t),
        lambda t: 0.002 * t**2,
        lambda t: 0.0003 * np.floor(t) + 0.001 * np.clip(t % 1.0, 0.0, 0.3),
    ],
)
def test_creep_with_coarse_quanta_is_no_hold(travel, quantum):
    time = np.arange(8000) * 1e-3
    value = quantum * np.round(travel(time) / quantum)
    for step in (quantum, 0.0):
        assert oversampling_ratio(value, np.arange(value.size), step) == 1.0
    assert read_trace({"t_s": time, "x_m": value}).time.size == time.size


@pytest.mark.parametrize("ratio", [2, 5, 8])
def test_a_slow_held_signal_with_coarse_quanta_is_detected_by_its_step(ratio):
    """No change is over two quanta; creep of several steady speeds is in step with itself only."""
    value = np.round(40.0 * np.sin(0.004 * np.arange(12_000)))
    assert np.abs(np.diff(value)).max() == 1.0
    held = np.repeat(value, ratio)
    assert oversampling_ratio(held, np.arange(held.size), 1.0) == ratio
    assert oversampling_ratio(value, np.arange(value.size), 1.0) == 1.0
    for steps in ((10, 20, 40), (6, 18, 30), (10, 50)):  # rows per quantum
        creep = np.cumsum(np.concatenate([np.arange(1, 1201) % rows == 0 for rows in steps]))
        assert oversampling_ratio(creep.astype(float), np.arange(creep.size), 1.0) == 1.0


def test_rest_and_log_on_change_are_no_hold():
    assert oversampling_ratio(np.zeros(1000), np.arange(1000), 0.0) == 1.0
    moves = np.repeat(np.arange(40.0), 8)[::8]  # moving in every row
    for rest in (1, 8, 100):
        value = np.concatenate([np.concatenate([np.full(rest, start), start + moves]) for start in range(20)])
        assert oversampling_ratio(value, np.arange(value.size), 0.01) == 1.0


def test_a_wild_row_of_a_held_log_is_refused_and_can_be_left_out():
    time, value = logged(SPEED, 8)
    value[1003] = 65.535
    table = {"t_s": time, "v_m_s": value}
    refuses("jumps that motion cannot make .* in index 1003:", read_trace, table)
    repaired = read_trace(table, repair="outliers")
    value[1003] = value[1002]
    assert np.array_equal(repaired.value, read_trace(table).value)


def test_rows_left_out_shift_nothing():
    """Rows are counted by their place in the log, whichever of them are damaged."""
    time, value = logged(PLACE, 8)
    clean = read_trace({"t_s": time, "x_m": value})
    value[[1003, 2005]] = np.nan
    assert same(read_trace({"t_s": time, "x_m": value}, repair="empty"), clean)
    rows, numbers = rows_of_new_values(np.repeat([0.0, 1.0, 1.0, 3.0], 6), np.arange(24), 6.0)
    assert rows.tolist() == [0, 6, 12, 18] and numbers.tolist() == [0, 1, 2, 3]
