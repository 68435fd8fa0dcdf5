"""Reading of traces: what is understood, what is refused with its rows, and the motion that comes out."""

import copy
import dataclasses
import inspect
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from make_example_trace import FILE
from moves import BRISK, GENTLE
from trace_files import has_note, refuses, same, write_trace

from guideload.base.errors import ArgumentTypeError, TraceError
from guideload.machine.machine import Drive
from guideload.traces.options import ReadingOptions
from guideload.traces.reading import motion_from_trace, read_trace

COUNT = 200
TIME = np.round(np.arange(COUNT) * 0.01, 2)
PLACE = np.round(0.05 * (1.0 - np.cos(2.0 * np.pi * TIME)), 6)
SPEED = np.round(np.gradient(PLACE, TIME), 5)
TABLE = {"t_s": TIME, "x_m": PLACE}


@pytest.mark.parametrize(
    ("header", "values", "kind", "si"),
    [
        ("x_m", PLACE, "position", PLACE),
        ("q_meas_mm", PLACE * 1e3, "position", PLACE),
        ("position [mm]", PLACE * 1e3, "position", PLACE),
        ("speed (mm/s)", SPEED * 1e3, "velocity", SPEED),
        ("v_m_s", SPEED, "velocity", SPEED),
        ("v_mm_per_s", SPEED * 1e3, "velocity", SPEED),
        ("n [rpm]", SPEED * 600.0, "motor_speed", SPEED * 20.0 * np.pi),
        ("motor_speed_rad_s", SPEED, "motor_speed", SPEED),
    ],
)
@pytest.mark.parametrize(
    ("clock", "scale"), [("t_s", 1.0), ("time_ms", 1e3), ("Time [s]", 1.0), ("time", 1.0)]
)
def test_headers_give_kind_and_unit(header, values, kind, si, clock, scale):
    trace = read_trace({clock: TIME * scale, "current_A": SPEED, header: values})
    assert (trace.kind, trace.column) == (kind, header)
    assert trace.time == pytest.approx(TIME, abs=1e-9)
    assert trace.value == pytest.approx(si, abs=1e-6 * np.abs(si).max())
    assert not trace.value.flags.writeable


def test_every_form_gives_the_same_trace(tmp_path):
    frame = pd.DataFrame(TABLE)
    frame.to_parquet(tmp_path / "a.parquet")
    np.savez(tmp_path / "a.npz", **TABLE)
    np.save(tmp_path / "a.npy", np.column_stack([TIME, PLACE]))
    table = np.zeros(COUNT, dtype=[("t_s", float), ("x_m", float)])
    table["t_s"], table["x_m"] = TIME, PLACE
    first, text = read_trace(TABLE), write_trace(tmp_path, TABLE)
    for source in (text, str(text), frame, tmp_path / "a.parquet", tmp_path / "a.npz", table):
        assert same(read_trace(source), first)
    for source in (tmp_path / "a.npy", np.column_stack([TIME, PLACE])):
        assert same(read_trace(source, kind="position"), first)
    assert np.array_equal(read_trace(PLACE, kind="position", rate=100).value, PLACE)


def test_options_are_named_as_they_are_described():
    names = list(ReadingOptions.__annotations__)
    assert list(inspect.signature(read_trace).parameters) == ["table", *names]
    for name in names:
        assert f"    {name}: " in str(read_trace.__doc__)
        assert same(read_trace(TABLE, **{name: None}), read_trace(TABLE))
    with pytest.raises(TypeError, match="unexpected keyword argument 'colum'"):
        read_trace(TABLE, colum="x_m")


def test_a_file_without_header_is_addressed_by_column_numbers(tmp_path):
    np.savetxt(tmp_path / "bare.csv", np.column_stack([TIME, PLACE * 1e3]), delimiter=",")
    trace = read_trace(tmp_path / "bare.csv", time="1", column="2", unit="mm")
    assert trace.value == pytest.approx(PLACE)


def test_counts_need_the_travel_of_one():
    columns = {"t_s": TIME, "encoder_counts": np.round(PLACE / 1e-5) + 2.0**40}
    trace = read_trace(columns, unit="10 um")
    assert trace.kind == "position" and trace.quantum == pytest.approx(1e-5)
    assert trace.value - trace.value[0] == pytest.approx(PLACE - PLACE[0], abs=5.1e-6)
    assert np.array_equal(read_trace(columns, unit=1e-5).value, trace.value)


def test_the_measured_column_is_taken_if_all_others_are_commands():
    trace = read_trace({"t_s": TIME, "q_ref_m": 2.0 * PLACE, "q_meas_m": PLACE})
    assert trace.column == "q_meas_m" and has_note(trace, "q_ref_m not")
    for other in ("q_m", "q2_meas_m"):
        with pytest.raises(
            TraceError, match=f'2 columns could be meant: {other}, q_meas_m; .*--column "{other}"'
        ):
            read_trace({"t_s": TIME, other: PLACE, "q_meas_m": PLACE})


COUNTS = {"t_s": TIME, "encoder_counts": np.round(PLACE / 1e-5)}
A = {"t_s": TIME, "a": PLACE}


@pytest.mark.parametrize(
    ("columns", "options", "message"),
    [
        (A | {"b": PLACE}, {}, "no header gives a unit of motion: a, b; .*--unit UNIT"),
        (A, {"column": "a"}, "column a: the header gives no unit"),
        (A, {"column": "c"}, "no column 'c'; there are t_s, a"),
        (A, {"time": "c"}, "no column 'c'; there are t_s, a"),
        (A, {"kind": "x"}, 'kind: expected one of position, counts, velocity, motor_speed, got "x"'),
        (A, {"column": "a", "unit": "kg"}, "column a: unit: .*speed"),
        (A, {"column": "a", "unit": 1.0}, "column a: unit: expected a string such as 'mm/s', got 1.0"),
        (A | {"v_m": PLACE}, {"column": "v_m", "kind": "velocity"}, 'column v_m: unit: .*"m" is a length'),
        (
            A | {"pos": PLACE},
            {"column": "pos", "unit": "mm/s"},
            "says position, .*kind='velocity'",
        ),
        (COUNTS, {}, "column encoder_counts: counts need .* unit='5e-8 m'"),
        (COUNTS, {"unit": "3 kg"}, "unit: expected a length in m"),
        (COUNTS, {"unit": 0.0}, "unit: expected metres per count, got 0"),
        (TABLE, {"counter_bits": 16}, r"column x_m: counter_bits: .* got 16.*--kind counts"),
        (TABLE | {"time": TIME}, {}, "2 columns could be the time: t_s, time; .*--time NAME"),
        (TABLE, {"time": "t_s", "rate": 100}, "either time or rate"),
        ({"x_m": PLACE}, {"rate": -1}, "rate: expected > 0 Hz, got -1"),
        ({"x_m": PLACE}, {"rate": 0.0}, "rate: expected > 0 Hz, got 0"),
        ({"x_m": PLACE}, {"rate": np.nan}, "rate: expected "),
        (TABLE, {"max_speed": -1.0}, "max_speed: expected > 0 m/s, got -1"),
        (TABLE, {"max_speed": np.inf}, "max_speed: expected "),
        (TABLE, {"max_speed": 0.1}, "the speed goes above max_speed = 0.1 m/s in index"),
        (TABLE, {"quantum": -1.0}, "quantum: expected >= 0 m, got -1"),
        (np.where(np.eye(9, 2, -5), np.nan, 1.0), {"kind": "position"}, "array: column 1: .* in index 6: "),
        (TABLE, {"clock": "x"}, 'clock: expected one of uniform, ticks, jitter, on_change, got "x"'),
        (TABLE, {"repair": "jumps"}, 'repair: expected all or some of empty, .*, got "jumps"'),
    ],
)
def test_options_that_cannot_be_are_refused_with_the_way_out(columns, options, message):
    refuses(message, read_trace, columns, **options)


def test_a_kind_resolves_a_unit_that_contradicts_the_name():
    trace = read_trace({"t_s": TIME, "X_Position": PLACE}, column="X_Position", unit="mm/s", kind="velocity")
    assert trace.kind == "velocity"


def test_a_row_number_is_not_the_time(tmp_path):
    path = write_trace(tmp_path, {"": np.arange(COUNT), "x_m": PLACE})
    refuses("holds row numbers, not time; .*--rate 1000", read_trace, path)
    assert read_trace(path, rate="0.1 kHz").time == pytest.approx(TIME)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({(17, "x_m"): ""}, "column x_m: .* none in row 17: the first is empty"),
        ({(17, "x_m"): "n/a", (30, "x_m"): "nan"}, ".* in rows 17, 30: "),
        ({(17, "x_m"): "over", (30, "x_m"): ""}, '.* in rows 17, 30: the first holds "over"'),
        ({(17, "x_m"): '"0,5"'}, '.* in row 17: the first holds "0,5"; write numbers with a decimal point'),
        ({(17, "x_m"): "inf"}, ".* in row 17: the first is empty or inf"),
        ({(17, "t_s"): ""}, "column t_s: .* in row 17"),
        ({(17, "t_s"): "0.14"}, "column t_s: time does not grow in row 17: 0.14 s after 0.14 s"),
        ({(17, "t_s"): "0.1"}, "column t_s: time does not grow in row 17: 0.1 s after 0.14 s"),
        ({(17, "x_m"): "0.4"}, "column x_m: jumps that motion cannot make .* in rows 17, 18: "),
        ({(row, "x_m"): "" for row in range(20, 45)}, r".*rows 20, 21, .* 28, 29, \.\.\. \(25 in all\)"),
        ({(5, "x_m"): "1,2"}, "not a readable CSV table: .*line 5"),
    ],
)
def test_bad_cells_are_refused_with_their_rows(tmp_path, change, message):
    refuses(f"trace.csv: {message}", read_trace, write_trace(tmp_path, TABLE, change))


@pytest.mark.parametrize("text", ["1e308", "-1e308", "1e25", "2e12"])
@pytest.mark.parametrize("column", ["t_s", "x_m"])
def test_a_number_out_of_all_proportion_is_refused_with_its_row(tmp_path, column, text):
    path = write_trace(tmp_path, TABLE, {(7, column): text})
    refuses(rf"^trace.csv: column {column}: expected at most 1e\+\d\d.* in row 7; check", read_trace, path)


def test_a_step_of_time_below_rounding_is_refused_with_its_row(tmp_path):
    path = write_trace(tmp_path, {"t_s": [0.0, 5e-324, *TIME[2:]], "x_m": PLACE})
    refuses("^trace.csv: column t_s: expected steps .* 1e-15 s or more, .* before row 3", read_trace, path)


@pytest.mark.parametrize("unit", ["nan", "inf", "m^-0", "1/0", "m" * 10_000])
def test_a_header_with_no_unit_in_its_brackets_is_no_crash(tmp_path, unit):
    refuses("no header gives a unit", read_trace, write_trace(tmp_path, {"t_s": TIME, f"x [{unit}]": PLACE}))


@pytest.mark.parametrize("cell", ['"' + "1" * 131_072 + '"', '"' + ",;" * 60_000 + '"', "A1" * 70_000])
def test_a_cell_longer_than_any_is_refused(tmp_path, cell):
    path = write_trace(tmp_path, TABLE, {(9, "x_m"): cell})
    refuses(r"^trace.csv: ", read_trace, path)


@pytest.mark.parametrize(("count", "message"), [(7, "8 samples, got 7: rows 2, 3"), (0, "8 samples, got 0$")])
def test_too_few_samples_are_refused(tmp_path, count, message):
    with pytest.raises(TraceError, match=message):
        read_trace(write_trace(tmp_path, {name: values[:count] for name, values in TABLE.items()}))
    doubled = {name: np.repeat(values[: max(count, 1)], 8) for name, values in TABLE.items()}
    refuses(f"at least 8 samples, got {max(count, 1)}", read_trace, doubled, repair="all")


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("missing.csv", None, "no such file"),
        ("bad.parquet", b"", "not a Parquet file"),
        ("bad.npy", b"", "not a NumPy file"),
        ("bad.npz", b"", "not a NumPy file"),
        ("trace.csv", b"", "the file is empty; expected a line of column names"),
        ("trace.csv", b"\xef\xbb\xbf\r\n", "the file is empty"),
        ("trace.csv", b"PK\x03\x04\x14\x00rest", "Excel workbook.*export the sheet as CSV"),
        ("trace.csv", b"t_s,x_m\n0,\x00\n", "not a text table.*save it as UTF-8"),
        ("trace.csv", bytes(range(256)), "not a text table.*export it as CSV"),
        ("trace.csv", b"\x81\x8d\x8f\x90", "not a text table.*export it as CSV"),
        ("", None, "is a folder; give the file"),
    ],
)
def test_files_that_are_no_table_are_refused(tmp_path, name, content, message):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    refuses(f"{path.name}: .*{message}", read_trace, path)


def test_gaps_are_refused_or_accepted_by_name():
    columns = {name: np.delete(values, [60, 61, 120]) for name, values in TABLE.items()}
    refuses("2 gaps in time .* before index 60, 118; the longest is 0.03 s.*allow_gaps", read_trace, columns)
    trace = read_trace(columns, allow_gaps=True)
    assert trace.time.size == COUNT - 3 and has_note(trace, "2 gaps")
    # Jitter of a clock is no gap: 12 to 20 ms at a nominal 13 ms have been measured.
    jitter = np.cumsum(np.random.default_rng(3).choice([0.012, 0.013, 0.013, 0.013, 0.02], COUNT))
    assert read_trace({"t_s": jitter, "x_m": PLACE}).time.size == COUNT


def test_jumps_are_judged_by_what_the_axis_does():
    columns = TABLE | {"x_m": np.where(np.arange(COUNT) >= 100, PLACE + 0.05, PLACE)}
    refuses("jumps that motion cannot make .* in index 100: .*max_speed", read_trace, columns)
    assert np.array_equal(read_trace(columns, max_speed="10 m/s").value, columns["x_m"])
    spike = SPEED.copy()
    spike[40] += 3.0
    refuses("in index 40: the first is .* m/s between", read_trace, {"t_s": TIME, "v_m_s": spike})


def test_position_and_velocity_of_one_axis_are_compared():
    columns = {"t_s": TIME, "x_position_m": PLACE, "x_velocity_m_s": SPEED}
    assert has_note(read_trace(columns, column="x_velocity_m_s"), "same motion")
    cut = {name: np.delete(values, slice(60, 75)) for name, values in columns.items()}
    cut["t_s"] = TIME[:-15]  # rows lost, and the clock does not show it
    for column in ("x_position_m", "x_velocity_m_s"):
        refuses(f"column {column}: .*contradict each other in index 60: ", read_trace, cut, column=column)
    assert read_trace(cut, column="x_velocity_m_s", cross_check=False).time.size == COUNT - 15
    columns["x_position_m"] = np.where(TIME == 0.5, np.nan, PLACE)
    assert has_note(read_trace(columns, column="x_velocity_m_s"), "x_position_m not compared")


@pytest.mark.parametrize("quantum", [1e-7, 1e-5, 1e-3])
@pytest.mark.parametrize("rate", [20.0, 100.0, 1000.0])
def test_true_motion_is_read_as_it_is(quantum, rate):
    """No jump is seen in it, no row repeats a held value, and no row is put back."""
    time = np.arange(0.0, 7.06, 1.0 / rate)
    place, speed, _ = GENTLE.motion(time)
    bang = np.cumsum(np.repeat([0.0, 1.0, 0.0, -1.0, 0.0], time.size // 5 + 1)[: time.size]) / rate
    for name, values in (("x_m", place), ("v_m_s", speed), ("v_m_s", bang)):
        rounded = np.round(values / quantum) * quantum
        trace = read_trace({"t_s": time, name: rounded})
        assert np.array_equal(trace.value, rounded) and np.array_equal(trace.time, time)
        assert trace.clock == "uniform"


def test_motor_speed_needs_the_drive():
    trace = read_trace({"t_s": TIME, "n_rpm": SPEED * 1e4})
    refuses(r"column n_rpm is a motor speed: the machine needs a \[drive\]", motion_from_trace, trace)
    motion = motion_from_trace(trace, Drive(gear_ratio=12.0, pinion_diameter="127.3 mm"))
    ratio = 0.5 * 0.1273 / 12.0
    cart = read_trace({"t_s": TIME, "v_m_s": trace.value * ratio}, quantum=trace.quantum * ratio)
    # Only the rounding of the factor differs.
    assert motion.acceleration == pytest.approx(motion_from_trace(cart).acceleration, abs=1e-5)
    assert np.array_equal(motion.motor_speed, trace.value)
    assert motion_from_trace(cart).motor_speed is None
    turned = motion_from_trace(trace, Drive(gear_ratio=-12.0, pinion_diameter="127.3 mm"))
    assert turned.acceleration == pytest.approx(-motion.acceleration, abs=1e-9)


def test_emps_runs(shared_data: Path):
    trace = read_trace(shared_data / "emps_bangbang_1kHz.csv")
    assert (trace.kind, trace.column, trace.time.size) == ("position", "q_meas_m", 24841)
    assert trace.quantum == pytest.approx(5e-8, rel=1e-6)
    assert trace.clock == "uniform" and has_note(trace, "time stamps: evenly spaced, every")
    motion = motion_from_trace(trace)
    assert np.array_equal(motion.time, trace.time)
    assert motion.position is not None and np.abs(motion.position[:, 0] - trace.value).max() < 3e-7
    assert 0.8 < np.abs(motion.acceleration).max() < 1.6  # reference 0.842 m/s2 bang-bang, with its overshoot


def test_michigan_01_runs_and_18_is_refused(shared_data: Path):
    good, bad = (shared_data / f"michigan_cnc_experiment_{number}.csv" for number in ("01", "18"))
    for axis in "XYZ":
        velocity = {"column": f"{axis}1_ActualVelocity", "unit": "mm/s", "rate": 10}
        position = {"column": f"{axis}1_ActualPosition", "unit": "mm", "rate": 10}
        for choice in (velocity, position):
            trace = read_trace(good, **choice)
            assert trace.time[-1] == pytest.approx(105.4)
            assert has_note(trace, "shows the same motion")
            refuses(r"contradict each other in rows \d+, .*\(\d+ in all\)", read_trace, bad, **choice)
        refuses("jumps that motion cannot make .* in rows", read_trace, bad, **position, cross_check=False)
    refuses("column 1.* holds row numbers", read_trace, good, column="X1_ActualVelocity", unit="mm/s")
    refuses("X1_ActualPosition, X1_ActualVelocity", read_trace, good, rate=10)
    # The first bad row is a jump in the file itself, as an editor numbers its lines.
    lines = bad.read_text().splitlines()
    refuses("in rows 22, .*jump of -17 mm", read_trace, bad, column="X1_ActualPosition", unit="mm", rate=10)
    assert float(lines[21].split(",")[1]) - float(lines[20].split(",")[1]) == -17.0


def test_the_example_gives_the_true_acceleration():
    """The packaged trace, from counts of a real encoder, against the move it was made from."""
    trace = read_trace(FILE)
    assert trace.kind == "motor_speed" and FILE.stat().st_size < 200_000
    motion = motion_from_trace(trace, Drive(gear_ratio=12.0, pinion_diameter="127.3 mm"))
    position, _, acceleration = BRISK.motion(motion.time)
    error = motion.acceleration[:, 0] - acceleration
    assert np.sqrt(np.mean(error**2)) < 0.01  # of 4 m/s2; plain differences: 0.17
    assert np.abs(error).max() < 0.22  # in the corners of ramps of 8 ms
    assert motion.acceleration[:, 0].max() == pytest.approx(4.0, rel=0.005)
    assert motion.position is not None
    assert np.abs(motion.position[:, 0] - position).max() < 2e-5


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("kind", "positon", 'kind: expected one of position, velocity, motor_speed, got "positon"'),
        ("clock", "sundial", "clock: expected one of uniform, ticks, jitter, on_change"),
        ("quantum", np.nan, "quantum: expected a finite number >= 0, 0 if it is unknown, got nan"),
        ("quantum", -1.0, "quantum: expected a finite number >= 0"),
        ("value", PLACE[:9], r"value: expected shape \(200,\), got \(9,\)"),
        ("value", PLACE * np.nan, r"value\[0\]: expected a finite number"),
        ("time", TIME[::-1], r"time\[1\]: expected more than the stamp before it"),
        ("time", TIME * 0.0, r"time\[1\]: expected more than the stamp before it"),
    ],
)
def test_a_trace_made_by_hand_is_checked(field, value, message):
    refuses(message, dataclasses.replace, read_trace(TABLE), **{field: value})


def test_the_arrays_of_a_trace_are_read_only_copies():
    place = PLACE.copy()
    trace = dataclasses.replace(read_trace(TABLE), value=place)
    place[0] = 9.0
    assert trace.value[0] == PLACE[0]
    for one in (trace, copy.deepcopy(trace)):
        assert not one.time.flags.writeable and not one.value.flags.writeable
    uncertainty = copy.deepcopy(motion_from_trace(read_trace(TABLE)).uncertainty)
    assert uncertainty is not None and not uncertainty.step.flags.writeable
    few = {name: values[:7] for name, values in TABLE.items()}
    refuses("at least 8", lambda: dataclasses.replace(trace, time=few["t_s"], value=few["x_m"]))
    with pytest.raises(ArgumentTypeError, match="^tick: expected a number, got None"):
        dataclasses.replace(trace, tick=None)


@pytest.mark.parametrize("cells", [PLACE > 0.05, (PLACE > 0.05).astype(object)])
def test_flags_are_no_numbers(cells):
    refuses("expected finite numbers, got none in", read_trace, {"t_s": TIME, "x_m": cells})
