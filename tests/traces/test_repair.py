"""Damage put into clean traces: found at its rows, repaired only by choice, and nothing else touched."""

import numpy as np
import pytest
from command_line import MACHINE, guideload
from texts import one_line
from trace_files import has_note, refuses, write_trace

from guideload.base.errors import TraceError
from guideload.traces.quality.repair import REPAIRS, doubled_samples, outliers, repaired_clock, stuck_samples
from guideload.traces.reading import read_trace

COUNT = 600
TIME = np.arange(COUNT) / 512.0  # exact in doubles
PLACE = np.round(0.2 * (1.0 - np.cos(4.0 * TIME)), 6)
SPEED = np.round(0.8 * np.sin(4.0 * TIME), 5)
CLEAN = {"t_s": TIME, "x_m": PLACE}
SPOTS = (37, 210, 211, 402, 590)  # a slow start, quick motion, two side by side, and nearly the end


def without(samples) -> dict[str, np.ndarray]:
    return {name: np.delete(values, samples) for name, values in CLEAN.items()}


def agrees(columns, expected, **choice) -> tuple[str, ...]:
    """Reading the damaged columns gives exactly the expected ones; returns the notes."""
    trace = read_trace(columns, **choice)
    assert np.array_equal(trace.time, expected["t_s"])
    assert np.array_equal(trace.value, expected["x_m"])
    return (*trace.notes, *trace.warnings)


@pytest.mark.parametrize("kind", [*REPAIRS, "all"])
def test_a_clean_trace_stays_as_it_is(kind):
    jitter = TIME + np.random.default_rng(1).uniform(-2e-4, 2e-4, COUNT)
    for time, name, values in ((TIME, "x_m", PLACE), (jitter, "x_m", PLACE), (TIME, "v_m_s", SPEED)):
        trace = read_trace({"t_s": time, name: values}, repair=kind)
        assert np.array_equal(trace.time, time) and np.array_equal(trace.value, values)
        assert not has_note(trace, "repair")


@pytest.mark.parametrize("size", [0.01, -0.3, 25.0])
def test_outliers_are_left_out_and_nothing_else(size):
    place = PLACE.copy()
    place[list(SPOTS)] += size
    columns = {"t_s": TIME, "x_m": place}
    refuses("jumps that motion cannot make .* in index .*repair='outliers'", read_trace, columns)
    notes = agrees(columns, without(SPOTS), repair="outliers")
    assert "repair: 5 outliers left out, index 37, 210, 211, 402, 590" in notes
    speed = SPEED.copy()
    speed[[100, 300]] += 9.0
    trace = read_trace({"t_s": TIME, "v_m_s": speed}, repair="outliers")
    assert np.array_equal(trace.value, np.delete(SPEED, [100, 300]))


def test_a_jump_that_stays_is_no_outlier():
    columns = {"t_s": TIME, "x_m": np.where(np.arange(COUNT) >= 300, PLACE + 0.5, PLACE)}
    refuses("jumps that motion cannot make .* in index 300:", read_trace, columns, repair="all")


def test_doubled_samples_are_left_out():
    order = np.sort(np.concatenate([np.arange(COUNT), SPOTS]))
    columns = {name: values[order] for name, values in CLEAN.items()}
    refuses("time does not grow in index 38, 212, 214, 406, 595: .*--repair", read_trace, columns)
    notes = agrees(columns, CLEAN, repair="doubled")
    assert "repair: 5 doubled samples left out, index 38, 212, 214, 406, 595" in notes
    pasted = np.concatenate([np.arange(300), np.arange(260, COUNT)])  # a block stands twice
    notes = agrees({name: values[pasted] for name, values in CLEAN.items()}, CLEAN, repair="doubled")
    assert any("repair: 40 doubled samples left out, index 300, 301" in note for note in notes)


@pytest.mark.parametrize("wrong", [-5.0, -0.01, 0.01, 1e9])
def test_wild_stamps_are_left_out(wrong):
    time = TIME.copy()
    time[[37, 210, 402]] += wrong
    columns = {"t_s": time, "x_m": PLACE}
    refuses("time does not grow in index", read_trace, columns)
    notes = agrees(columns, without([37, 210, 402]), repair="clock")
    assert "repair: 3 samples with a wild time stamp left out, index 37, 210, 402" in notes


@pytest.mark.parametrize("back", [0.25, 3600.0])
def test_a_clock_that_was_set_back_goes_on(back):
    time = np.where(np.arange(COUNT) >= 300, TIME - back, TIME)
    notes = agrees({"t_s": time, "x_m": PLACE}, CLEAN, repair="clock")
    (note,) = [note for note in notes if "the clock was set back before index 300" in note]
    assert f"moved by {back:g} s" in note


def test_cells_without_a_number_are_left_out():
    place = PLACE.copy()
    place[list(SPOTS)] = np.nan
    with pytest.raises(TraceError, match="expected finite numbers, got none in index 37, .*repair='empty'"):
        read_trace({"t_s": TIME, "x_m": place})
    notes = agrees({"t_s": TIME, "x_m": place}, without(SPOTS), repair="empty")
    assert any("5 samples without a number left out, index 37, 210, 211, 402, 590" in note for note in notes)
    by_rate = read_trace({"x_m": place}, rate=512, repair="empty")  # the samples after keep their time
    assert np.array_equal(by_rate.time, np.delete(TIME, SPOTS))


def test_rows_left_out_at_a_standstill_are_not_put_back():
    """A trace with damage taken out is no log on change."""
    place = np.where(TIME < 0.5, 0.0, PLACE - PLACE[256])
    holes = place.copy()
    holes[[50, 51, 52, 400]] = np.nan
    trace = read_trace({"t_s": TIME, "x_m": holes}, repair="all")
    assert trace.clock == "uniform" and np.array_equal(trace.time, np.delete(TIME, [50, 51, 52, 400]))
    even = read_trace({"t_s": TIME, "x_m": holes}, repair="all", clock="uniform")
    assert even.time == pytest.approx(trace.time, abs=1e-12)


def test_stuck_values_are_noted_and_left_out_if_chosen():
    place = PLACE.copy()
    stuck = [*range(101, 104), *range(250, 258)]
    place[101:104], place[250:258] = place[100], place[249]
    columns = {"t_s": TIME, "x_m": place}
    notes = agrees(columns, columns, max_speed="20 m/s")
    assert any("11 samples repeat the value before while the axis moves, index 101, 102" in n for n in notes)
    notes = agrees(columns, without(stuck), repair="stuck")
    assert any(note.startswith("repair: 11 samples with a stuck value left out") for note in notes)


def test_standstill_and_slow_motion_are_not_stuck():
    for quantum in (1e-6, 1e-4, 5e-3):
        place = np.round(np.clip(PLACE, 0.05, 0.3) / quantum) * quantum
        assert stuck_samples(TIME, place, quantum).size == 0


def test_all_damage_at_once():
    """Each kind at places of its own; what remains is the clean trace without the damaged rows."""
    time, place = TIME.copy(), PLACE.copy()
    time[60] -= 2.0
    place[120] = np.nan
    place[180] += 4.0
    place[300:304] = place[299]
    order = np.sort(np.append(np.arange(COUNT), 450))
    columns = {"t_s": time[order], "x_m": place[order]}
    notes = agrees(columns, without([60, 120, 180, 300, 301, 302, 303]), repair="all")
    assert sum(note.startswith("repair: ") for note in notes) == 5
    assert notes == agrees(columns, without([60, 120, 180, 300, 301, 302, 303]), repair=", ".join(REPAIRS))
    dropped = {name: np.delete(values, [500, 501]) for name, values in columns.items()}
    refuses("1 gap in time .* before index 500; .*allow_gaps", read_trace, dropped, repair=REPAIRS)
    assert has_note(read_trace(dropped, repair="all"), "1 gap in time", "bridged")


def test_too_much_damage_is_refused():
    rng = np.random.default_rng(4)
    place = PLACE.copy()
    place[rng.choice(COUNT, 150, replace=False)] = np.nan
    with pytest.raises(TraceError, match="150 of 600 samples would be left out, expected at most 10 %"):
        read_trace({"t_s": TIME, "x_m": place}, repair="all")
    refuses("time does not grow", read_trace, {"t_s": rng.permutation(TIME), "x_m": PLACE}, repair="all")
    reverse = {"t_s": TIME[::-1], "x_m": PLACE[::-1]}
    for options in ({}, {"repair": "all"}):
        refuses(
            "time runs backwards from index 0 to index 599: reverse the order", read_trace, reverse, **options
        )


def test_the_command_line_reads_as_the_library_does(tmp_path):
    """Rows of a file are named as an editor counts them."""
    path = write_trace(tmp_path, CLEAN, {(102, "x_m"): "2.5"})
    call = ("check", MACHINE, path)
    refused = guideload(*call, code=2)
    assert "rows 102, 103" in refused.output and "--repair outliers" in refused.output
    choice = {"repair": "outliers", "clock": "jitter", "quantum": "2 um", "allow_gaps": True}
    options = [f"--{name.replace('_', '-')}={value}" for name, value in choice.items() if value is not True]
    text = one_line(guideload(*call, *options, "--allow-gaps", "--no-cross-check").output)
    notes = read_trace(path, **choice, cross_check=False).notes
    assert "repair: 1 outlier left out, row 102" in notes
    assert all(note in text for note in notes)


def test_findings_move_with_the_samples():
    """Detection looks at differences: a shift of clock or value changes nothing, nor does a scale of both."""
    place, time = PLACE.copy(), TIME.copy()
    place[180] += 4.0
    place[300:304] = place[299]
    time[60] -= 2.0
    for shift, scale in ((0.0, 1.0), (64.0, 4.0), (-1024.0, 0.25)):
        moved, stamps = scale * place + shift, scale * time + shift
        assert repaired_clock(stamps)[0].tolist() == [60]
        assert doubled_samples(stamps, moved).size == 0
        assert outliers(scale * TIME + shift, moved, True, 1e-6 * scale, None).tolist() == [180]
        assert stuck_samples(scale * TIME + shift, moved, 1e-6 * scale).tolist() == [300, 301, 302, 303]
