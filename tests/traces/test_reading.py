"""Reading of traces: what is understood, what is refused with its rows, and the motion that comes out."""

import subprocess
import sys
from pathlib import Path

import make_example_trace as example
import numpy as np
import pandas as pd
import pytest

from guideload.base.errors import TraceError
from guideload.machine.machine import Drive
from guideload.traces.reading import motion_from_trace, read_trace

COUNT = 200
TIME = np.arange(COUNT) * 0.01
PLACE = np.round(0.05 * (1.0 - np.cos(2.0 * np.pi * TIME)), 6)
SPEED = np.round(np.gradient(PLACE, TIME), 5)


@pytest.fixture
def write(tmp_path: Path):
    """Write columns as a CSV file; `change` replaces cells by (row of an editor, column)."""

    def write_file(columns, change=(), sep=",", name="trace.csv"):
        names = list(columns)
        lines = [sep.join(names)]
        for i in range(len(columns[names[0]])):
            cells = [f"{columns[one][i]:.7g}" for one in names]
            for row, column, text in change:
                if row == i + 2:
                    cells[names.index(column)] = text
            lines.append(sep.join(cells))
        path = tmp_path / name
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return path

    return write_file


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
def test_headers_tell_kind_and_unit(write, header, values, kind, si, clock, scale):
    trace = read_trace(write({clock: TIME * scale, "current_A": SPEED, header: values}))
    assert (trace.kind, trace.column) == (kind, header)
    assert trace.time == pytest.approx(TIME, abs=1e-9)
    assert trace.value == pytest.approx(si, abs=1e-6 * np.abs(si).max())
    assert not trace.value.flags.writeable


@pytest.mark.parametrize("sep", [",", ";", "\t", ", "])
def test_separators(write, sep):
    assert read_trace(write({"t_s": TIME, "x_mm": PLACE * 1e3}, sep=sep)).value == pytest.approx(
        PLACE, abs=1e-9
    )


def test_every_form_gives_the_same_trace(write, tmp_path):
    columns = {"t_s": TIME, "x_m": PLACE}
    frame = pd.DataFrame(columns)
    frame.to_parquet(tmp_path / "a.parquet")
    np.savez(tmp_path / "a.npz", **columns)
    np.save(tmp_path / "a.npy", np.column_stack([TIME, PLACE]))
    table = np.zeros(COUNT, dtype=[("t_s", float), ("x_m", float)])
    table["t_s"], table["x_m"] = TIME, PLACE
    first = read_trace(columns)
    for source in (
        write(columns),
        str(write(columns)),
        frame,
        tmp_path / "a.parquet",
        tmp_path / "a.npz",
        table,
    ):
        trace = read_trace(source)
        assert np.array_equal(trace.value, first.value)
        assert trace.time == pytest.approx(first.time, abs=1e-15)  # the text holds 0.07, not 0.01 * 7
    for source in (tmp_path / "a.npy", np.column_stack([TIME, PLACE])):
        assert np.array_equal(read_trace(source, kind="position").value, PLACE)
    assert np.array_equal(read_trace(PLACE, kind="position", rate=100).value, PLACE)


def test_a_unit_that_contradicts_the_name_is_refused():
    columns = {"t_s": TIME, "X_Position": PLACE}
    with pytest.raises(TraceError, match=r"name says position, mm/s is a unit of velocity.*kind='velocity'"):
        read_trace(columns, column="X_Position", unit="mm/s")
    assert read_trace(columns, column="X_Position", unit="mm/s", kind="velocity").kind == "velocity"


def test_the_width_of_a_counter_is_for_counts():
    with pytest.raises(TraceError, match=r"column x_m: counter_bits: .* got 16.*--kind counts"):
        read_trace({"t_s": TIME, "x_m": PLACE}, counter_bits=16)


def test_a_trace_and_its_motion_are_shown_in_a_line():
    trace = read_trace({"t_s": TIME, "x_m": PLACE})
    motion = motion_from_trace(trace)
    assert f"column x_m: position, {COUNT} samples" in repr(trace) and len(repr(trace)) < 200
    assert f"{COUNT} stamps" in repr(motion) and len(repr(motion)) < 200


def test_a_file_without_header_is_addressed_by_column_numbers(tmp_path):
    np.savetxt(tmp_path / "bare.csv", np.column_stack([TIME, PLACE * 1e3]), delimiter=",")
    trace = read_trace(tmp_path / "bare.csv", time="1", column="2", unit="mm")
    assert trace.value == pytest.approx(PLACE)


def test_counts_need_the_travel_of_one():
    counts = np.round(PLACE / 1e-5) + 2.0**40
    columns = {"t_s": TIME, "encoder_counts": counts}
    trace = read_trace(columns, unit="10 um")
    assert trace.kind == "position" and trace.quantum == pytest.approx(1e-5)
    assert trace.value - trace.value[0] == pytest.approx(PLACE - PLACE[0], abs=5.1e-6)
    assert np.array_equal(read_trace(columns, unit=1e-5).value, trace.value)
    with pytest.raises(TraceError, match="column encoder_counts: counts need .* unit='5e-8 m'"):
        read_trace(columns)
    with pytest.raises(TraceError, match="unit: expected a length in m"):
        read_trace(columns, unit="3 kg")


def test_the_measured_column_is_taken_if_all_others_are_wanted_values():
    trace = read_trace({"t_s": TIME, "q_ref_m": 2.0 * PLACE, "q_meas_m": PLACE})
    assert trace.column == "q_meas_m" and any("q_ref_m not" in note for note in trace.notes)
    for other in ("q_m", "q2_meas_m"):
        with pytest.raises(TraceError, match=f"2 columns could be meant: {other}, q_meas_m; .*--column NAME"):
            read_trace({"t_s": TIME, other: PLACE, "q_meas_m": PLACE})


def test_what_the_header_does_not_tell_is_asked_for():
    with pytest.raises(TraceError, match="no column tells what it is: a, b; .*--kind velocity"):
        read_trace({"t_s": TIME, "a": PLACE, "b": PLACE})
    with pytest.raises(TraceError, match="column a: the header tells no unit"):
        read_trace({"t_s": TIME, "a": PLACE}, column="a")
    with pytest.raises(TraceError, match="no column 'c'; there are t_s, a"):
        read_trace({"t_s": TIME, "a": PLACE}, column="c")
    with pytest.raises(
        TraceError, match='kind: expected one of position, counts, velocity, motor_speed, got "x"'
    ):
        read_trace({"t_s": TIME, "a": PLACE}, kind="x")
    with pytest.raises(TraceError, match="column a: unit: .*speed"):
        read_trace({"t_s": TIME, "a": PLACE}, column="a", unit="kg")
    with pytest.raises(TraceError, match='column v_m: unit: .*"m" is a length'):
        read_trace({"t_s": TIME, "v_m": PLACE}, column="v_m", kind="velocity")


def test_a_row_number_is_not_the_time(write):
    path = write({"": np.arange(COUNT), "x_m": PLACE})
    with pytest.raises(TraceError, match="mere row number, which tells no time; .*--rate 1000"):
        read_trace(path)
    assert read_trace(path, rate="0.1 kHz").time == pytest.approx(TIME)
    with pytest.raises(TraceError, match="2 columns could be the time: t_s, time; .*--time NAME"):
        read_trace({"t_s": TIME, "time": TIME, "x_m": PLACE})
    with pytest.raises(TraceError, match="either time or rate"):
        read_trace({"t_s": TIME, "x_m": PLACE}, time="t_s", rate=100)
    with pytest.raises(TraceError, match="rate: expected > 0 Hz, got -1"):
        read_trace({"x_m": PLACE}, rate=-1)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ([(17, "x_m", "")], "column x_m: .* none in row 17: the first is empty"),
        ([(17, "x_m", "n/a"), (30, "x_m", "nan")], ".* in rows 17, 30: "),
        ([(17, "x_m", "over"), (30, "x_m", "")], '.* in rows 17, 30: the first holds "over"'),
        ([(17, "x_m", '"0,5"')], '.* in row 17: the first holds "0,5"; write numbers with a decimal point'),
        ([(17, "x_m", "inf")], ".* in row 17: the first is empty or inf"),
        ([(17, "t_s", "")], "column t_s: .* in row 17"),
        ([(17, "t_s", "0.14")], "column t_s: time does not grow in row 17: 0.14 s after 0.14 s"),
        ([(17, "t_s", "0.1")], "column t_s: time does not grow in row 17: 0.1 s after 0.14 s"),
        ([(17, "x_m", "0.4")], "column x_m: jumps that motion cannot make .* in rows 17, 18: "),
    ],
)
def test_bad_cells_are_refused_with_their_rows(write, change, message):
    with pytest.raises(TraceError, match=f"trace.csv: {message}"):
        read_trace(write({"t_s": TIME, "x_m": PLACE}, change))


def test_ten_rows_are_named_and_all_are_counted(write):
    change = [(row, "x_m", "") for row in range(20, 45)]
    with pytest.raises(
        TraceError, match=r"rows 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, \.\.\. \(25 in all\)"
    ):
        read_trace(write({"t_s": TIME, "x_m": PLACE}, change))


def test_arrays_are_refused_with_their_index():
    place = PLACE.copy()
    place[17] = np.nan
    with pytest.raises(TraceError, match="array: column 1: .* in index 17"):
        read_trace(np.column_stack([TIME, place]), kind="position")


def test_files_that_are_no_table(tmp_path, write):
    with pytest.raises(TraceError, match="missing.csv: no such file"):
        read_trace(tmp_path / "missing.csv")
    for name in ("empty.csv", "bad.parquet", "bad.npy", "bad.npz"):
        (tmp_path / name).write_text("")
        with pytest.raises(TraceError, match=name):
            read_trace(tmp_path / name)
    path = write({"t_s": TIME, "x_m": PLACE}, [(5, "x_m", "1,2")])
    with pytest.raises(TraceError, match="trace.csv: not a readable CSV table: .*line 5"):
        read_trace(path)
    with pytest.raises(TraceError, match="at least 8 samples, got 7: rows 2, 3"):
        read_trace(write({"t_s": TIME[:7], "x_m": PLACE[:7]}))
    with pytest.raises(TraceError, match="got 0"):
        read_trace(write({"t_s": [], "x_m": []}))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "the file is empty; expected a line of column names"),
        (b"\xef\xbb\xbf\r\n", "the file is empty"),
        (b"PK\x03\x04\x14\x00rest", "Excel workbook.*export the sheet as CSV"),
        (b"t_s,x_m\n0,\x00\n", "not a text table.*save it as UTF-8"),
        (bytes(range(256)), "not a text table.*export it as CSV"),
        (b"\x81\x8d\x8f\x90", "not a text table.*export it as CSV"),
    ],
)
def test_files_that_are_no_text_are_told_apart(tmp_path, content, message):
    path = tmp_path / "trace.csv"
    path.write_bytes(content)
    with pytest.raises(TraceError, match=f"trace.csv: .*{message}"):
        read_trace(path)


def test_a_folder_is_no_trace(tmp_path):
    with pytest.raises(TraceError, match="is a folder; give the file"):
        read_trace(tmp_path)


def test_text_of_old_programs_is_read(tmp_path):
    """Windows' Western encoding, also where the first line does not show it."""
    path = tmp_path / "trace.csv"
    rows = "".join(f"{t:.3f};{x:.6f};lauf\xe4uft\n" for t, x in zip(TIME, PLACE, strict=True))
    path.write_bytes(f"t_s;x_m;note\n{rows}".encode("cp1252"))
    assert read_trace(path).time == pytest.approx(TIME, abs=5e-4)


def test_limits_must_be_positive_numbers():
    for name, wrong in (("rate", np.nan), ("rate", 0.0), ("max_speed", -1.0), ("max_speed", np.inf)):
        with pytest.raises(TraceError, match=f"{name}: expected "):
            read_trace({"x_m": PLACE} if name == "rate" else {"t_s": TIME, "x_m": PLACE}, **{name: wrong})


def test_gaps_are_refused_or_accepted_by_name():
    keep = np.ones(COUNT, bool)
    keep[[60, 61, 120]] = False
    columns = {"t_s": TIME[keep], "x_m": PLACE[keep]}
    with pytest.raises(
        TraceError, match="2 gaps in time .* before index 60, 118; the longest is 0.03 s.*allow_gaps"
    ):
        read_trace(columns)
    trace = read_trace(columns, allow_gaps=True)
    assert trace.time.size == COUNT - 3 and any("2 gaps" in note for note in trace.notes)
    # Jitter of a clock is no gap: 12 to 20 ms at a nominal 13 ms have been measured.
    jitter = np.cumsum(np.random.default_rng(3).choice([0.012, 0.013, 0.013, 0.013, 0.02], COUNT))
    assert read_trace({"t_s": jitter, "x_m": PLACE}).time.size == COUNT


def test_jumps_are_judged_by_what_the_axis_does():
    step = np.where(np.arange(COUNT) >= 100, PLACE + 0.05, PLACE)
    with pytest.raises(TraceError, match="jumps that motion cannot make .* in index 100: .*max_speed"):
        read_trace({"t_s": TIME, "x_m": step})
    assert read_trace({"t_s": TIME, "x_m": step}, max_speed="10 m/s").time.size == COUNT
    with pytest.raises(TraceError, match="the speed goes above max_speed = 0.1 m/s in index"):
        read_trace({"t_s": TIME, "x_m": PLACE}, max_speed=0.1)
    spike = SPEED.copy()
    spike[40] += 3.0
    with pytest.raises(TraceError, match="in index 40: the first is .* m/s between"):
        read_trace({"t_s": TIME, "v_m_s": spike})


def test_position_and_velocity_of_one_axis_are_compared():
    columns = {"t_s": TIME, "x_position_m": PLACE, "x_velocity_m_s": SPEED}
    assert any("same motion" in note for note in read_trace(columns, column="x_velocity_m_s").notes)
    cut = {name: np.delete(values, slice(60, 75)) for name, values in columns.items()}
    cut["t_s"] = TIME[:-15]  # rows lost, and the clock does not show it
    for column in ("x_position_m", "x_velocity_m_s"):
        with pytest.raises(TraceError, match=f"column {column}: .*contradict each other in index 60: "):
            read_trace(cut, column=column)
    assert read_trace(cut, column="x_velocity_m_s", cross_check=False).time.size == COUNT - 15
    columns["x_position_m"] = np.where(TIME == 0.5, np.nan, PLACE)
    trace = read_trace(columns, column="x_velocity_m_s")
    assert any("x_position_m not compared" in note for note in trace.notes)


@pytest.mark.parametrize("quantum", [1e-7, 1e-5, 1e-3])
def test_true_motion_is_never_taken_for_a_jump(quantum):
    for rate in (20.0, 100.0, 1000.0):
        time = np.arange(0.0, 7.06, 1.0 / rate)
        place, speed, _ = example.motion(time)
        read_trace({"t_s": time, "x_m": np.round(place / quantum) * quantum})
        read_trace({"t_s": time, "v_m_s": np.round(speed / quantum) * quantum})
    bang = np.cumsum(np.repeat([0.0, 1.0, 0.0, -1.0, 0.0], 40)) * 0.01
    read_trace({"t_s": TIME, "v_m_s": bang})


def test_an_axis_that_stands_still_is_allowed():
    trace = read_trace({"t_s": TIME, "x_m": np.full(COUNT, 0.3)})
    assert any("no motion" in note for note in trace.notes)
    assert np.all(motion_from_trace(trace).acceleration == 0.0)


def test_motor_speed_needs_the_drive():
    trace = read_trace({"t_s": TIME, "n_rpm": SPEED * 1e4})
    with pytest.raises(TraceError, match=r"column n_rpm is a motor speed: the machine needs a \[drive\]"):
        motion_from_trace(trace)
    drive = Drive(gear_ratio=12.0, pinion_diameter="127.3 mm")
    motion = motion_from_trace(trace, drive)
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
            assert any("tells the same motion" in note for note in trace.notes)
            with pytest.raises(
                TraceError, match=r"contradict each other in rows \d+, .*\(\d+ in all\).*cut the"
            ):
                read_trace(bad, **choice)
        with pytest.raises(TraceError, match="jumps that motion cannot make .* in rows"):
            read_trace(bad, **position, cross_check=False)
    with pytest.raises(TraceError, match="column 1.* mere row number"):
        read_trace(good, column="X1_ActualVelocity", unit="mm/s")
    with pytest.raises(TraceError, match="X1_ActualPosition, X1_ActualVelocity"):
        read_trace(good, rate=10)
    # The first bad row is a jump in the file itself, as an editor numbers its lines.
    lines = bad.read_text().splitlines()
    with pytest.raises(TraceError, match="in rows 22, ") as caught:
        read_trace(bad, column="X1_ActualPosition", unit="mm", rate=10)
    assert "jump of -17 mm" in str(caught.value)
    assert float(lines[21].split(",")[1]) - float(lines[20].split(",")[1]) == -17.0


def test_the_example_gives_the_true_acceleration():
    """The packaged trace, from counts of a real encoder, against the move it was made from."""
    trace = read_trace(example.FILE)
    assert trace.kind == "motor_speed" and example.FILE.stat().st_size < 200_000
    motion = motion_from_trace(trace, Drive(gear_ratio=12.0, pinion_diameter="127.3 mm"))
    true = example.motion(motion.time)[2]
    error = motion.acceleration[:, 0] - true
    assert np.sqrt(np.mean(error**2)) < 0.002  # of 2.2 m/s2; plain differences: 0.17
    assert np.abs(error).max() < 0.04
    assert motion.acceleration[:, 0].max() == pytest.approx(2.2, rel=0.002)
    assert motion.position is not None
    assert np.abs(motion.position[:, 0] - example.motion(motion.time)[0]).max() < 1e-4


def test_reading_is_imported_without_the_heavy_libraries():
    code = (
        "import sys, guideload.traces.reading; "
        "print([name for name in ('pandas', 'pyarrow', 'scipy.linalg', 'xarray') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
