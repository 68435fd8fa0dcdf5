"""A watch gives what one call of `push` gives, whatever brings the samples; and what happens at a limit."""

import json
import os
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from watched import LIMIT, SETTINGS, new_monitor, run, samples, text_of, watched

from guideload.base.errors import ArgumentError, ReadError
from guideload.reports.monitor import monitor_report
from guideload.watch.inputs import GrowingFile, Input, StandardInput
from guideload.watch.lines import Lines
from guideload.watch.reaction import Command, Crossing
from guideload.watch.session import Session
from guideload.watch.status import EQUIVALENT, RESULTANT, LoadCurves, WatchState
from guideload.watch.store import Store

STAMPS, COUNTS = samples()
TEXT = text_of(STAMPS, COUNTS)


def require_same(session: Session) -> None:
    """The totals and the last loads are those of one call, to the bit."""
    monitor = new_monitor()
    _, periods, loads = monitor.push(STAMPS, COUNTS)
    assert session.monitor.totals() == monitor.totals()
    assert session.period_now == periods[-1] and np.array_equal(session.loads, loads[-1])


def send(write: Callable[[bytes], object], text: bytes = TEXT) -> threading.Thread:
    """Write the text in pieces that end within lines, in a thread."""

    def pieces() -> None:
        for start in range(0, len(text), 5003):
            write(text[start : start + 5003])
            time.sleep(0.001)

    thread = threading.Thread(target=pieces)
    thread.start()
    return thread


def until(session: Session, count: int) -> Session:
    """Run a session until it has so many samples."""
    end = time.monotonic() + 60.0
    while session.samples < count:
        assert time.monotonic() < end, session.samples
        session.step()
    return session


def test_standard_input(monkeypatch: pytest.MonkeyPatch) -> None:
    reading, writing = os.pipe()

    def write(data: bytes) -> None:
        os.write(writing, data)

    with os.fdopen(reading) as file:
        monkeypatch.setattr(sys, "stdin", file)
        session = Session(new_monitor(), StandardInput(), Lines())
        thread = send(write)
        until(session, STAMPS.size)
        os.close(writing)
        assert not session.step()
    thread.join()
    require_same(session)


def test_a_file_that_grows(tmp_path: Path) -> None:
    path = tmp_path / "samples.csv"
    with path.open("wb", buffering=0) as file:
        session = Session(new_monitor(), GrowingFile(path), Lines())
        thread = send(file.write)
        until(session, STAMPS.size)
        thread.join()
    session.close()
    require_same(session)


def test_a_file_that_is_replaced_and_then_cut(tmp_path: Path) -> None:
    """What is written to the old file after the replacement counts too; nothing is taken twice."""
    path, said = tmp_path / "samples.csv", []
    lines = TEXT.splitlines(keepends=True)
    path.write_bytes(b"stamp,count\n" + b"".join(lines[:1000]))
    source: Input = GrowingFile(path)
    session = until(Session(new_monitor(), source, Lines(), say=said.append), 1000)
    with path.open("ab") as old:
        path.rename(tmp_path / "samples.old")
        path.write_bytes(b"stamp,count\n" + b"".join(lines[1200:3000]))
        old.write(b"".join(lines[1000:1200]))
    until(session, 3000)
    with path.open("wb") as file:  # cut, as by `copytruncate`
        file.write(b"".join(lines[3000:]))
    until(session, STAMPS.size)
    session.close()
    assert "replaced" in said[0] and "cut" in said[1] and len(said) == 2
    assert session.lines.malformed == 0
    require_same(session)


def test_inputs_that_cannot_be_read_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", None)
    with pytest.raises(ArgumentError, match="standard input is closed"):
        StandardInput()
    with pytest.raises(ArgumentError, match="cannot be read"):
        GrowingFile(tmp_path / "none.csv")


def test_the_first_crossing_is_the_first_sample_above_the_limit() -> None:
    """Of a machine without ratings the equivalent load is |Fy| + |Fz|; the end is exact in any batch."""
    monitor = new_monitor()
    _, periods, loads = monitor.push(STAMPS, COUNTS)
    settled = periods >= monitor.constants()["settling"] + periods[periods >= 0][0]
    above = np.abs(loads[..., :2]).sum(axis=2).max(axis=1) > LIMIT
    expected = int(np.flatnonzero(above & settled)[0])
    for size in (1000, len(TEXT)):
        pieces = [TEXT[start : start + size] for start in range(0, len(TEXT), size)]
        crossings: list[Crossing] = []
        session = watched(*pieces, on_crossing=lambda one, to=crossings: to.append(one) or True)
        assert session.samples == expected + 1 == session.monitor.totals()["samples"]
        (crossing,) = crossings
        assert crossing.period == periods[expected] and crossing.time == periods[expected] * SETTINGS.period
        assert crossing.carriages == ["2b"]
        assert crossing.forces == [tuple(loads[expected, 3, :2])]
        assert session.lines.position == TEXT.index(b"\n%d," % (expected + 1)) + 1


def test_every_crossing_is_told_once() -> None:
    crossings: list[Crossing] = []
    session = watched(TEXT, on_crossing=lambda one: crossings.append(one) or False)
    require_same(session)
    exceeded = session.monitor.totals()["limit_exceeded"]
    assert len(crossings) == sum(exceeded) > 1


def test_a_break_between_streams_loses_the_line_that_was_cut() -> None:
    refused: list[object] = []
    session = watched(TEXT[:49], "gone", b"time,count\n7,7\n", on_refused=refused.append)
    complete = TEXT[:49].count(b"\n")
    assert session.samples == complete + 1 and len(refused) == session.lines.malformed == 1


def test_the_status_is_the_totals() -> None:
    session = watched(TEXT, b"bad\n")
    totals, status = session.monitor.totals(), session.status()
    assert status["time_s"] == session.period_now * 1e-3
    for index, one in enumerate(status["carriages"]):
        assert one["largest_resultant_N"] ** 2 == pytest.approx(
            totals["largest"][index][RESULTANT], rel=1e-12
        )
        assert one["time_of_largest_s"] == totals["period_of_largest"][index][RESULTANT] * 1e-3
        assert one["largest_equivalent_N"] == totals["largest"][index][EQUIVALENT]
        assert one["limit_exceeded"] == totals["limit_exceeded"][index]
        assert (one["Fy_N"], one["Fz_N"]) == tuple(session.loads[index, :2])
    assert {name: totals[name] for name in status["input"] if name != "malformed"} | {
        "malformed": 1
    } == status["input"]


def test_curves_have_the_largest_load_of_each_step() -> None:
    session = watched(*(TEXT[start : start + 777] for start in range(0, len(TEXT), 777)))
    _, periods, loads = new_monitor().push(STAMPS, COUNTS)
    resultant = np.hypot(loads[..., 0], loads[..., 1])
    points = session.curves.points
    assert len(points) == np.unique(periods[periods >= 0] // 100).size
    for when, *values in points:
        in_step = periods // 100 == round(when / 0.1)
        assert values == resultant[in_step & (periods >= 0)].max(axis=0).tolist()


@pytest.mark.parametrize("period", [1e-3, 0.9])
def test_curves_are_of_the_last_minute(period: float) -> None:
    """Also where nothing was heard for hours."""
    curves = LoadCurves(period)
    for start in (0.0, 30.0, 12 * 3600.0, 12 * 3600.0 + 50.0):
        periods = np.arange(int(start / period), int((start + 40.0) / period))
        curves.add(periods, np.ones((periods.size, 1, 5)))
        times = [point[0] for point in curves.points]
        assert times[0] >= max(times[-1] - 60.0, 12 * 3600.0 * (start > 100.0) - 2.0)
        assert times[-1] == pytest.approx(start + 40.0, abs=2.0)


def test_the_state_is_read_as_it_was_written_and_refused_if_damaged(tmp_path: Path) -> None:
    session = watched(TEXT, b"a bad line\n", store=Store(tmp_path, new_monitor()))
    session.show()
    now = WatchState.read(tmp_path)
    assert not now.ended and now.status == session.status() and now.points == session.curves.points
    session.close()
    ended = WatchState.read(tmp_path)
    assert ended.ended and ended.status == now.status and ended.written >= now.written
    whole = json.loads((tmp_path / WatchState.FILE).read_text())
    assert (
        monitor_report(ended.status).answer
        == monitor_report(session.status(), session.monitor.machine).answer
    )

    def damaged(word: str, *path: str | int, value: object = None) -> None:
        content: Any = json.loads(json.dumps(whole))
        node = content
        for key in path[:-1]:
            node = node[key]
        node[path[-1]] = value
        (tmp_path / WatchState.FILE).write_text(json.dumps(content))
        with pytest.raises(ReadError, match=f"expected the state of a watch .*{word}"):
            WatchState.read(tmp_path)

    damaged("status: .*object", "status", value=[])
    damaged("Fy_N", "status", "carriages", 0, value={"name": "1a"})
    damaged("carriages", "status", "carriages", value=5)
    damaged("carriages", "status", "carriages", value=[])
    damaged("life_used", "status", "carriages", 0, "life_used", value="much")
    damaged("samples", "status", "input", value={})
    damaged("points: expected 5 numbers", "points", 3, value=[0.1])
    damaged("points.3.2: .*number", "points", 3, value=[0.1, 1.0, "2", 3.0, 4.0])
    damaged("ended: .*boolean", "ended", value=1)
    (tmp_path / WatchState.FILE).write_text("{")
    with pytest.raises(ReadError, match=r"expected the state of a watch \(Invalid JSON"):
        WatchState.read(tmp_path)
    with pytest.raises(ReadError, match="expected the folder of a watch"):
        WatchState.read(tmp_path / "elsewhere")


CROSSING = Crossing(1234, 1.234, ["a", "b; rm"], [(1.0, -2.5), (3.0, 4.0)])


def test_a_command_runs_without_a_shell_once_in_its_pause(tmp_path: Path) -> None:
    now, said, path = [0.0], [], tmp_path / "said"
    code = (
        "import os, sys; open(sys.argv[1], 'a').write(sys.argv[2] + os.environ['GUIDELOAD_CARRIAGE'] + '\\n')"
    )
    command = Command(f'{sys.executable} -c "{code}" {path} "$HOME;"', said.append, lambda: now[0])
    for now[0] in (0.0, 1.0, 9.9, 10.1):
        command(CROSSING)
        command.close()
    assert command.started == 2 and path.read_text() == "$HOME;a,b; rm\n" * 2 and said == []
    assert CROSSING.environment == {
        "GUIDELOAD_PERIOD": "1234",
        "GUIDELOAD_TIME": "1.234",
        "GUIDELOAD_CARRIAGE": "a,b; rm",
        "GUIDELOAD_FY": "1.0,3.0",
        "GUIDELOAD_FZ": "-2.5,4.0",
    }


def test_a_command_that_cannot_run_or_fails_is_told(tmp_path: Path) -> None:
    said: list[str] = []
    with pytest.raises(ArgumentError, match="--on-limit: /no/such/command: there is no such program"):
        Command("/no/such/command x", said.append)
    failing = Command(f"{sys.executable} -c 'raise SystemExit(3)'", said.append)
    failing(CROSSING)
    end = time.monotonic() + 60.0
    while failing.is_running() and time.monotonic() < end:
        time.sleep(0.01)
    failing.close()
    assert len(said) == 1 and "exit code 3" in said[0]
    removed = tmp_path / "removed"
    removed.touch(mode=0o700)
    command = Command(str(removed), said.append)
    removed.unlink()
    command(CROSSING)
    assert "No such file" in said[1]
    for text in ("", "'"):
        with pytest.raises(ArgumentError, match="--on-limit"):
            Command(text, said.append)


def test_a_run_over_no_samples_has_no_loads() -> None:
    session = watched(b"\n")
    assert session.status()["time_s"] is None and session.curves.points == []
    assert all(one["largest_resultant_N"] is None for one in session.status()["carriages"])
    assert run(session).samples == 0
