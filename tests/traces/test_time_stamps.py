"""Time stamps: any notation of one clock gives the same seconds; their kind is found on made clocks."""

import re

import numpy as np
import pandas as pd
import pytest
from trace_files import has_note, refuses, write_trace

from guideload.base.errors import TraceError
from guideload.traces.content.samples import decimal_quantum
from guideload.traces.quality.clocks import detect_clock, fill_standstills, on_grid
from guideload.traces.reading import read_trace

COUNT = 400
TIME = np.round(np.arange(COUNT) * 0.004, 3)
PLACE = np.round(0.03 * (1.0 - np.cos(5.0 * TIME)), 6)
MILLI = np.round(TIME * 1e3).astype(np.int64)
# From a second before midnight, at the end of a month.
STAMPS = pd.Timestamp("2024-01-31T23:59:59.500") + pd.to_timedelta(MILLI, unit="ms")
ISO = "{t:%Y-%m-%d %H:%M:%S}.{ms}"
GERMAN = "{t:%d.%m.%Y %H:%M:%S},{ms}"


def written(form: str, stamps: pd.DatetimeIndex = STAMPS) -> np.ndarray:
    """Stamps in a form of time t, day d, month m, year y and milliseconds ms."""
    cells = [
        form.format(t=t, d=t.day, m=t.month, y=t.year, ms=f"{t.microsecond // 1000:03d}") for t in stamps
    ]
    return np.array(cells, object)


@pytest.mark.parametrize(
    "form",
    [
        ISO,
        "{t:%Y-%m-%dT%H:%M:%S}.{ms}",
        "{t:%Y-%m-%dT%H:%M:%S},{ms}",
        "{t:%Y-%m-%dT%H:%M:%S}.{ms}Z",
        ISO + "+01:00",
        "{t:%Y-%m-%d %H:%M:%S},{ms}-0530",
        "{t:%Y/%m/%d %H:%M:%S}.{ms}",
        GERMAN,
        "{t:%d.%m.%Y %H:%M:%S}.{ms}",
        "{d}.{m}.{y} {t:%H:%M:%S},{ms}",
        "{t:%d/%m/%Y %H:%M:%S},{ms}",
        "{m}/{d}/{y} {t:%H:%M:%S}.{ms}",
        "{t:%m-%d-%Y %H:%M:%S},{ms}",
        "{m}/{d}/{y} {t:%I:%M:%S}.{ms} {t:%p}",
        "{t:%Y-%m-%d %I:%M:%S}.{ms} {t:%p}",
        "{t:%H:%M:%S}.{ms}",
        "{t:%H:%M:%S},{ms}",
    ],
)
def test_date_stamps_of_one_clock_give_the_same_bits(tmp_path, form):
    stamps = written(form)
    short = [stamp.rstrip("0").rstrip(".") if form == ISO else stamp for stamp in stamps]
    for column in (stamps, np.array(short, object)):
        table = {"time": column, "x_m": PLACE}
        for source in (table, write_trace(tmp_path, table, sep=";")):
            trace = read_trace(source)
            assert np.array_equal(trace.time, TIME) and trace.clock == "uniform"


def test_a_clock_of_twelve_hours_passes_noon():
    stamps = written("{t:%I:%M:%S}.{ms} {t:%p}", STAMPS - pd.Timedelta("12h"))
    assert np.array_equal(read_trace({"time": stamps, "x_m": PLACE}).time, TIME)


def test_stamps_of_data_frames_parquet_and_numpy(tmp_path):
    columns = (STAMPS, STAMPS.tz_localize("Europe/Berlin"), STAMPS - STAMPS[0], STAMPS.astype("M8[ms]"))
    sources = [pd.DataFrame({"time": column, "x_m": PLACE}) for column in columns]
    sources += [pd.DataFrame({"x_m": PLACE}, index=column) for column in columns]
    pd.DataFrame({"x_m": PLACE}, index=STAMPS.tz_localize("UTC")).to_parquet(tmp_path / "a.parquet")
    np.savez(tmp_path / "a.npz", time=STAMPS.to_numpy(), x_m=PLACE)
    for source in (*sources, tmp_path / "a.parquet", tmp_path / "a.npz"):
        assert np.array_equal(read_trace(source).time, TIME)


@pytest.mark.parametrize(
    ("name", "stamps"),
    [
        ("t_s", TIME),
        ("t_ms", MILLI),
        ("time [us]", MILLI * 1000),
        ("t (ns)", MILLI * 1_000_000),
        ("time", MILLI + 1_706_659_200_000),  # ms since 1970
        ("time", 1_706_659_200_000_000_000 + MILLI * 1_000_000),
        ("time_ns", 1_706_659_200_000_000_000 + MILLI * 1_000_000),
        ("timestamp", 133_500_000_000_000_000 + MILLI * 10_000),  # FILETIME
        ("t_us", (MILLI * 1000 + (1 << 32) - 500_000) % (1 << 32)),  # a 32-bit clock that runs over
    ],
)
def test_numbers_of_one_clock_give_the_same_bits(tmp_path, name, stamps):
    table = {name: stamps, "x_m": PLACE}
    for source in (table, write_trace(tmp_path, table)):
        trace = read_trace(source)
        assert np.array_equal(trace.time - trace.time[0], TIME)


def test_shifting_the_clock_changes_nothing():
    """Plain seconds stay as they are; their differences, the kind and the value do not change."""
    rng = np.random.default_rng(7)
    stamps = np.cumsum(rng.choice([12, 13, 13, 13, 15, 20], COUNT)) / 1024.0  # exact in doubles
    first = read_trace({"t_s": stamps, "x_m": PLACE})
    for shift in (-(2.0**20), 1.0, 2.0**20):
        trace = read_trace({"t_s": stamps + shift, "x_m": PLACE})
        assert np.array_equal(np.diff(trace.time), np.diff(first.time))
        assert np.array_equal(trace.value, first.value)
        assert trace.clock == first.clock == "jitter"
    for days in (0, 59, 3660):
        moved = STAMPS + pd.Timedelta(days=days)
        assert np.array_equal(read_trace({"time": moved, "x_m": PLACE}).time, TIME)


@pytest.mark.parametrize(("resolution", "rows"), [("1", "1000"), ("0.01", "10")])
def test_coarse_stamps_are_told_with_their_way_out(resolution, rows):
    time = np.arange(4000) * 1e-3
    place = 0.03 * (1.0 - np.cos(5.0 * time))
    coarse = np.floor(np.arange(4000) / int(rows)) * float(resolution)
    text = f"resolution of {resolution} s, with about {rows} rows each: .*--rate"
    refuses(text, read_trace, {"t_s": coarse, "x_m": place}, repair="clock")
    trace = read_trace({"t_s": coarse, "x_m": place}, rate="1 kHz")
    assert np.allclose(trace.time, time)


@pytest.mark.parametrize("unit", ["hh:mm:ss", "[hh:mm:ss.fff]"])
def test_dates_below_a_format_are_dates(tmp_path, unit):
    table = {"time;x": [f"{stamp};{place}" for stamp, place in zip(written(ISO), PLACE, strict=True)]}
    path = write_trace(tmp_path, table)
    path.write_text(path.read_text().replace("time;x", f"time;x\n{unit};m"), encoding="utf-8")
    assert np.array_equal(read_trace(path).time, TIME)


@pytest.mark.parametrize("form", ["time,x\n{},m", "time [{}],x_m", "time / {},x_m", "time in {},x_m"])
@pytest.mark.parametrize("unit", ["0.1 ms", "1/10 ms", "10^-4 s"])
def test_an_unknown_unit_of_time_is_refused_with_ways_out(tmp_path, unit, form):
    """Read as seconds, or in ms, every acceleration would be wrong by powers of ten."""
    path = write_trace(tmp_path, {"a": MILLI * 10, "x": PLACE})
    path.write_text(path.read_text().replace("a,x", form.format(unit), 1), encoding="utf-8")
    name = form.format(unit).split(",")[0]
    refuses(re.escape(f'column {name}: expected a unit of time, got "{unit}"'), read_trace, path)
    assert np.array_equal(read_trace(path, time=name, rate="10 kHz").time, TIME)
    refuses("is no unit", read_trace, path, time_unit=unit)


def test_cycles_of_a_counter_with_their_rate(tmp_path):
    cycles = np.arange(COUNT) * 2 + 70_000
    for name in ("cycle", "time_ticks", "n"):
        trace = read_trace({name: cycles, "x_m": PLACE}, time=name, rate="500 Hz")
        assert np.array_equal(trace.time, (cycles - cycles[0]) / 500.0)
    over = read_trace({"cycle": cycles % (1 << 16), "x_m": PLACE}, time="cycle", rate=500)
    assert np.array_equal(over.time, trace.time)
    lost = np.delete(np.arange(COUNT), [50, 51])
    refuses("1 gap in time", read_trace, {"cycle": cycles[lost], "x_m": PLACE[lost]}, time="cycle", rate=500)
    with pytest.raises(TraceError, match="column time_ticks: a clock that counts needs .*rate"):
        read_trace({"time_ticks": cycles, "x_m": PLACE})


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ("31.02.2024 00:00:00,000", 'expected a time stamp, got "31.02.2024.*in row 22'),
        ("later", 'expected a time stamp, got "later" in row 22'),
        ("", ".* none in row 22"),
    ],
)
def test_what_is_no_time_stamp_is_refused_with_its_row(tmp_path, wrong, message):
    table = {"time": written(GERMAN), "x_m": PLACE}
    path = write_trace(tmp_path, table, {(22, "time"): wrong}, sep=";")
    refuses(f"column time: {message}", read_trace, path)
    path = write_trace(tmp_path, table, {(22, "time"): ""}, sep=";")
    assert np.array_equal(read_trace(path, repair="empty").time, np.delete(TIME, 20))


@pytest.mark.parametrize(
    "wrong",
    [
        "2024-01-31T01:00:00+99:00",
        "2024-01-31T01:00:00+01:60",
        "1/31/24 1:00:00",
        "1/31/2024 13:00:00 PM",
        "1/31/2024 0:00:00 AM",
        "31/31/2024 1:00:00",
    ],
)
def test_dates_that_no_calendar_or_clock_shows_are_refused(wrong):
    with pytest.raises(TraceError, match=re.escape(f'got "{wrong}" in index 0; write ISO 8601')):
        read_trace({"time": np.array([wrong] * 9, object), "x_m": PLACE[:9]})


def test_dates_that_may_be_read_in_two_ways_are_not_guessed():
    """Within one day the order changes nothing; across midnight it is asked for."""
    january = STAMPS - pd.Timedelta(days=24)  # 7 to 8 January
    text = written("{t:%m/%d/%Y %H:%M:%S}.{ms}", january)
    with pytest.raises(TraceError, match="dates such as 01/07/2024 are ambiguous.*--date-order mdy"):
        read_trace({"time": text, "x_m": PLACE})
    for order, form in (("mdy", "{t:%m/%d/%Y %H:%M:%S}.{ms}"), ("dmy", "{t:%d/%m/%Y %H:%M:%S}.{ms}")):
        trace = read_trace({"time": written(form, january), "x_m": PLACE}, date_order=order)
        assert np.array_equal(trace.time, TIME)
    first = {"time": text[:100], "x_m": PLACE[:100]}  # all of 7 January, or of 1 July
    for order in (None, "mdy", "dmy"):
        assert np.array_equal(read_trace(first, date_order=order).time, TIME[:100])
    with pytest.raises(TraceError, match='expected a time stamp, got "01/31/2024'):
        read_trace({"time": written("{t:%m/%d/%Y %H:%M:%S}"), "x_m": PLACE}, date_order="dmy")
    refuses('date_order: expected one of dmy, mdy, got "ymd"', read_trace, first, date_order="ymd")


def test_a_date_beside_a_time_of_day(tmp_path):
    columns = {"Datum": written("{t:%d.%m.%Y}"), "Uhrzeit": written("{t:%H:%M:%S},{ms}"), "x_m": PLACE}
    path = write_trace(tmp_path, columns, sep=";")
    assert np.array_equal(read_trace(path).time, TIME)


@pytest.mark.parametrize(
    ("kind", "stamps", "tick", "jitter"),  # tick and rms difference of a step from the usual one [s]
    [
        ("uniform", lambda even, rng: even + rng.normal(0.0, 2e-8, even.size), 0.0, 2e-8 * 2.0**0.5),
        # Steps of 14 or 15 ticks, in the ratio that makes 1/700 s.
        ("ticks", lambda even, _: np.round(even, 4), 1e-4, 1e-4 * (1e4 / 700.0 - 14.0) ** 0.5),
        ("jitter", lambda even, rng: even + rng.uniform(-1.5e-4, 1.5e-4, even.size), 0.0, 1.5e-4 * (2 / 3) ** 0.5),
    ],
)  # fmt: skip
@pytest.mark.parametrize("seed", range(5))
def test_kind_tick_and_jitter_of_made_clocks_are_found(kind, stamps, tick, jitter, seed):
    time = stamps(np.arange(3000) / 700.0, np.random.default_rng(seed))
    for scale, shift in ((1.0, 0.0), (4.0, 100.0)):
        clock = detect_clock(scale * time + shift, np.sin(time), True, 0.0)
        assert clock.kind == kind and clock.gaps.size == 0
        assert clock.step == pytest.approx(scale / 700.0, rel=0.05)
        assert clock.tick == pytest.approx(scale * tick, rel=1e-6)
        assert clock.jitter * clock.step == pytest.approx(
            scale * jitter, rel=0.01 if kind == "ticks" else 0.05
        )
    trace = read_trace({"t_s": scale * time + shift, "x_m": np.sin(time)})
    assert (trace.clock, trace.tick, trace.jitter) == (kind, clock.tick, clock.jitter * clock.step)


def on_change(quantum: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A move with dwells sampled at 1 kHz: the even stamps, the rounded position, and the rows that change."""
    time = np.arange(3000) * 1e-3
    place = 0.1 * np.clip(np.sin(2.5 * time), -0.7, 0.7)
    place = np.round(place / quantum) * quantum
    return time, place, np.flatnonzero(np.concatenate([[True], np.diff(place) != 0.0]))


@pytest.mark.parametrize("quantum", [1e-6, 1e-5])
def test_a_log_on_change_is_that_of_all_rows(quantum):
    time, place, kept = on_change(quantum)
    trace = read_trace({"t_s": time[kept], "x_m": place[kept]})
    assert trace.clock == "on_change"
    assert has_note(trace, "rows inserted at standstill")
    row = np.round(trace.time * 1e3).astype(int)
    assert trace.time == pytest.approx(time[row], abs=1e-9)
    assert np.array_equal(trace.value, place[row])  # what was put back is what was left out
    assert np.all(np.diff(trace.time) > 0.5e-3)
    with pytest.raises(TraceError, match="gaps in time .* the axis stands still across all of them"):
        read_trace({"t_s": time[kept], "x_m": place[kept]}, clock="uniform")


@pytest.mark.parametrize("quantum", [5e-8, 8.4e-5, 1e-3])
@pytest.mark.parametrize("heartbeat", [1_000_000, 40])
def test_logs_on_change_of_a_pc_with_coarse_counts(quantum, heartbeat):
    """Stamps of 12 to 20 ms, moves and dwells of any length; some logs write a row now and then all the same."""
    for seed in range(3):
        rng = np.random.default_rng(seed)
        time = np.cumsum(rng.choice([12, 13, 13, 13, 13, 14, 20], 1500)) * 1e-3
        speed = np.zeros(time.size)
        start = 60
        while start < 1300:
            count = int(rng.integers(40, 160))
            top = rng.uniform(0.05, 1.0)
            speed[start : start + count] = top * np.sin(np.pi * np.arange(count) / count) ** 2
            start += count + int(rng.integers(60, 200))
        place = np.round(np.cumsum(speed * np.gradient(time)) / quantum) * quantum
        kept = np.concatenate([[True], np.diff(place) != 0.0]) | (np.arange(time.size) % heartbeat == 0)
        trace = read_trace({"t_s": time[kept], "x_m": place[kept]})
        assert trace.clock == "on_change"
        true = np.interp(trace.time, time, place)
        # Rows are put back at the usual step, not at the jittering one.
        assert np.abs(trace.value - true).max() <= 3.0 * quantum + 1e-3


def test_rows_lost_in_motion_are_no_log_on_change():
    time, place, kept = on_change(1e-6)
    lost = np.setdiff1d(kept, np.arange(100, 130))
    for clock in (None, "on_change"):
        refuses("rows may be missing", read_trace, {"t_s": time[lost], "x_m": place[lost]}, clock=clock)


@pytest.mark.parametrize("rate", [10.0, 20.0, 50.0, 1000.0])
@pytest.mark.parametrize("jump", [0.3, 3600.0])
@pytest.mark.parametrize("slow", [1, 2])
def test_a_clock_that_jumps_while_the_axis_moves_is_a_gap(rate, jump, slow):
    """Whatever the rate, and whether the axis is at full speed, slows down or gains speed. No rows are inserted."""
    time = np.arange(0.0, 20.0, 1.0 / rate)
    place = np.round(0.12 * np.sin(0.8 * np.pi * time + 0.3), 7)
    speed = np.gradient(place, time)
    for at in np.flatnonzero(np.abs(speed) > np.abs(speed).max() / slow)[20:-20:37]:
        stamps = np.round(time + np.where(time >= time[at], jump, 0.0), 6)
        for options in ({}, {"max_speed": 1.0}):
            with pytest.raises(TraceError, match="1 gap in time .* or the clock has jumped: cut") as refused:
                read_trace({"t_s": stamps, "x_m": place}, **options)
            assert "stands still" not in str(refused.value) and "on_change" not in str(refused.value)


def test_held_rows_fill_a_gap_evenly():
    time = np.array([0.0, 1.0, 2.0, 7.0, 8.0])
    filled, value, count = fill_standstills(time, np.array([0.0, 1.0, 2.0, 3.0, 4.0]), np.array([3]), 1.0)
    assert filled.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0] and count == 4
    assert value.tolist() == [0.0, 1.0, 2.0, 2.0, 2.0, 2.0, 2.0, 3.0, 4.0]
    long = fill_standstills(np.array([0.0, 1.0, 1e6]), np.zeros(3), np.array([2]), 1.0)
    assert long[2] == 200 and np.all(np.diff(long[0]) >= 1.0)


def test_an_even_grid_is_found_under_jitter():
    rng = np.random.default_rng(3)
    even = 5.0 + np.arange(2000) * 0.002
    stamps = even + rng.normal(0.0, 1e-4, even.size)
    found, distance = on_grid(stamps, np.empty(0, np.intp))
    # Mean and slope of n stamps are known to sigma/sqrt(n) and sigma sqrt(12/n): 4 sigma at the ends.
    assert np.abs(found - even).max() < 4.0 * 2.0 * 1e-4 / np.sqrt(even.size)
    assert distance == pytest.approx(1e-4, rel=0.1)
    lost = np.delete(np.arange(even.size), np.arange(700, 710))
    gap = np.array([700])
    assert np.abs(on_grid(stamps[lost], gap)[0] - even[lost]).max() < 4.0 * 2.0 * 1e-4 / np.sqrt(even.size)
    trace = read_trace({"t_s": stamps, "x_m": np.sin(even)}, clock="uniform")
    assert np.ptp(np.diff(trace.time)) < 1e-12 and has_note(trace, "even grid")


def test_quantum_and_clock_can_be_set():
    trace = read_trace({"t_s": TIME, "x_m": PLACE}, quantum="2 um", clock="jitter")
    assert (trace.quantum, trace.clock) == (2e-6, "jitter")
    assert read_trace({"t_s": TIME, "x_m": PLACE}).quantum == pytest.approx(1e-6)
    even = read_trace({"t_s": TIME, "x_m": PLACE}, clock="on_change")  # no row is missing
    assert np.array_equal(even.time, TIME) and has_note(even, "0 rows inserted")


@pytest.mark.parametrize("quantum", [1e-6, 5e-7, 8.4e-5, 1e-3])
def test_the_step_of_decimals_is_found_in_fast_motion(quantum):
    """No two samples within 300 steps of each other."""
    place = np.round((0.5 + 900.0 * quantum * np.arange(COUNT) ** 1.1) / quantum) * quantum
    for unit, scale in (("m", 1.0), ("mm", 1e3)):
        trace = read_trace({"t_s": TIME, f"x_{unit}": np.round(place * scale, 8)})
        assert trace.quantum == pytest.approx(quantum, rel=1e-9)
    assert read_trace({"t_s": TIME, "x_m": np.sin(TIME)}).quantum == 0.0
    digits = np.array([float(f"{value:.3g}") for value in 80.0 * (1.5 + np.sin(5.0 * TIME))])
    assert decimal_quantum(digits) == 0.0  # 0.1 below 100, 1 above
