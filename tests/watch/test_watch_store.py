"""What a watch keeps: every sample once in Parquet files by the hour, and a record, whenever it ends."""

import json
import random
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from pyarrow import parquet
from watched import Pieces, machine, new_monitor, run, samples, text_of

from guideload.base.errors import ArgumentError, WriteError
from guideload.monitor import Monitor
from guideload.watch.inputs import GrowingFile
from guideload.watch.lines import Lines
from guideload.watch.session import Session
from guideload.watch.status import WatchState
from guideload.watch.store import RECORD, RESULTS, Store

STAMPS, COUNTS = samples()
TEXT = text_of(STAMPS, COUNTS)
NOON = 1_800_000_000.0  # s since 1970: 2027-01-15, 08:00 UTC


def parts(size: int) -> list[bytes]:
    return [TEXT[start : start + size] for start in range(0, len(TEXT), size)]


def session_in(folder: Path, *pieces: bytes, **options: Any) -> Session:
    """A session whose inputs are these bytes, with its folder."""
    monitor = new_monitor()
    return Session(monitor, Pieces(*pieces), Lines(), Store(folder, monitor, **options))


def require_every_sample_once(folder: Path, count: int = STAMPS.size) -> pd.DataFrame:
    rows = pd.concat([pd.read_parquet(path) for path in sorted(folder.glob("*.parquet"))])
    assert rows["sample"].tolist() == list(range(count))
    assert np.array_equal(rows["stamp"], STAMPS[:count]) and np.array_equal(rows["count"], COUNTS[:count])
    return rows


def test_the_files_have_every_sample_with_the_loads_of_push_by_the_hour(tmp_path: Path) -> None:
    now = [NOON]
    session = session_in(tmp_path, *parts(5000), clock=lambda: now[0])
    while session.step():
        now[0] += 700.0
    session.close()
    rows = require_every_sample_once(tmp_path)
    taken, periods, loads = new_monitor().push(STAMPS, COUNTS)
    known = periods >= 0
    assert rows["result"].tolist() == [RESULTS[one] for one in taken]
    assert rows["period"].isna().tolist() == (~known).tolist()
    assert rows["period"].to_numpy()[known].astype(int).tolist() == periods[known].tolist()
    for index, name in enumerate(session.monitor.carriages):
        for component, label in enumerate(("Fy_N", "Fz_N", "Mx_Nm", "My_Nm", "Mz_Nm")):
            column = rows[f"{label}[{name}]"].to_numpy()
            assert np.isnan(column[~known]).all() and column.dtype == np.float32
            assert np.array_equal(column[known], loads[known, index, component].astype(np.float32))
    hours = sorted(path.name[:13] for path in tmp_path.glob("*.parquet"))
    assert hours == ["2027-01-15T08", "2027-01-15T09"]
    for path in tmp_path.glob("*.parquet"):
        received = pd.read_parquet(path)["received"]
        assert received.dt.strftime("%Y-%m-%dT%H").unique().tolist() == [path.name[:13]]
    assert json.loads(parquet.read_schema(path).metadata[b"guideload"])["machine"] == machine().name


def test_samples_come_in_while_the_file_of_an_hour_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now, written = [NOON], threading.Event()
    session = session_in(tmp_path, *parts(5000), clock=lambda: now[0])
    assert session.store is not None
    convert = session.store._convert
    monkeypatch.setattr(session.store, "_convert", lambda path: (written.wait(60.0), convert(path))[1])
    session.step()
    now[0] += 3600.0
    before = session.samples
    assert session.step() and session.samples > before and not list(tmp_path.glob("*.parquet"))
    written.set()
    run(session).close()
    require_every_sample_once(tmp_path)


def test_a_file_of_an_hour_that_cannot_be_written_ends_the_watch(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [NOON]
    session = session_in(tmp_path, *parts(5000), clock=lambda: now[0])

    def fail(path: Path) -> None:
        raise WriteError(28, "No space", str(path))

    assert session.store is not None
    monkeypatch.setattr(session.store, "_convert", fail)
    session.step()
    now[0] += 3600.0
    with pytest.raises(WriteError, match="No space"):
        run(session).close()
    kill(session)
    Store(tmp_path, new_monitor())
    require_every_sample_once(tmp_path, session.samples)


def test_a_folder_is_one_table_for_readers_of_parquet(tmp_path: Path) -> None:
    """The record and a journal beside the files do not disturb them."""
    run(session_in(tmp_path, *parts(20_000)[:1])).close()
    unfinished = session_in(tmp_path, *parts(20_000)[1:])
    unfinished.step()
    assert list(tmp_path.glob("_*.journal"))
    assert len(pd.read_parquet(tmp_path)) == TEXT[:20_000].count(b"\n")
    kill(unfinished)


@pytest.mark.parametrize("seed", range(3))
def test_killed_anywhere_and_started_again(seed: int, tmp_path: Path) -> None:
    """A killed process leaves its files as they are; the next one has every sample of the file once."""
    random_of = random.Random(seed)
    source, out = tmp_path / "samples.csv", tmp_path / "out"
    out.mkdir()
    session, written, is_first = None, 0, True
    while written < len(TEXT):
        size = random_of.randrange(1, 6000)
        with source.open("ab") as file:
            file.write(TEXT[written : written + size])
        written += size
        session = session or in_file(source, out)
        # Now and then it is time for a record, before the next samples.
        session._saved -= 20.0 * (random_of.random() < 0.3)
        session.step()
        if is_first or random_of.random() < 0.4:
            is_first = False
            kill(session) if random_of.random() < 0.8 else session.close()
            session = None
    session = run_to_end(session or in_file(source, out))
    session.close()
    require_every_sample_once(out)
    assert session.monitor.totals()["samples"] == STAMPS.size
    assert not list(out.glob("_*.journal"))


@pytest.mark.parametrize("pause", [0, 5000])
def test_a_kill_changes_no_totals(pause: int, tmp_path: Path) -> None:
    """Three kills after a start from rest: at once, in the hour after a record, and with a pause at the record."""
    lines = text_of(STAMPS + pause * (STAMPS >= 2000), COUNTS).splitlines(keepends=True)
    folders, now = [tmp_path / "whole", tmp_path / "killed"], [NOON]
    for folder in folders:
        folder.mkdir()
        run(session_in(folder, b"".join(lines[:1000]))).close()
    whole = run(session_in(folders[0], b"".join(lines[1000:])))
    whole.close()
    for begin, record, end in ((1000, 1000, 1600), (1600, 2000, 2800), (2800, 3200, 4000)):
        pieces = (b"".join(lines[begin:record]), b"".join(lines[record:end]))
        session = session_in(folders[1], *pieces, clock=lambda: now[0])
        session.step()
        session._save()
        now[0] += 3600.0
        session.step()
        kill(session)
        assert session.store is not None
        session.store._worker.shutdown()
    again = Store(folders[1], new_monitor())
    assert again.monitor.totals() == whole.monitor.totals()
    assert again.samples == STAMPS.size


def test_killed_while_a_journal_becomes_a_file(tmp_path: Path) -> None:
    """Between the file and the end of the journal: it becomes the same file again."""
    session = run(session_in(tmp_path, TEXT))
    assert session.store is not None and session.store._journal is not None
    journal = session.store._journal[0]
    data = journal.read_bytes()
    session.close()
    journal.write_bytes(data)
    run(session_in(tmp_path)).close()
    require_every_sample_once(tmp_path)
    assert not journal.exists()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no full disk here")
def test_after_a_full_disk_every_sample_is_there_once(tmp_path: Path) -> None:
    source, out = tmp_path / "samples.csv", tmp_path / "out"
    out.mkdir()
    source.write_bytes(TEXT[:9000])
    session = in_file(source, out)
    session.step()
    assert session.store is not None and session.store._journal is not None
    path, file = session.store._journal
    file.close()
    with source.open("ab") as more, open("/dev/full", "ab", buffering=0) as full:
        more.write(TEXT[9000:])
        more.flush()
        session.store._journal = path, full
        with pytest.raises(WriteError, match=f"{path.name}: cannot be written: No space"):
            session.step()
    kill(session)
    again = run_to_end(in_file(source, out))
    again.close()
    require_every_sample_once(out)
    assert again.monitor.totals()["samples"] == STAMPS.size


def run_to_end(session: Session) -> Session:
    """Take all that is in a file that grows no more."""
    while session.lines.position < len(TEXT):
        session.step()
    return session


def kill(session: Session) -> None:
    """End a session as the system does: its files are closed, and nothing else is done."""
    session.source.close()
    assert session.store is not None
    if session.store._journal is not None:
        session.store._journal[1].close()


def in_file(source: Path, out: Path) -> Session:
    monitor = new_monitor()
    return Session(monitor, GrowingFile(source), Lines(), Store(out, monitor))


def test_a_row_that_was_cut_off_is_no_sample(tmp_path: Path) -> None:
    """At any byte of a journal there is a whole number of rows, and of a journal without a head there are none."""
    first = tmp_path / "first"
    first.mkdir()
    session = run(session_in(first, TEXT))
    assert session.store is not None and session.store._journal is not None
    path, _ = session.store._journal
    kill(session)
    data = path.read_bytes()
    head, size = data.index(b"\n") + 1, session.store.row.itemsize
    for length in (0, head - 1, head, head + size - 1, head + 5 * size, head + 6 * size - 1):
        folder = tmp_path / f"cut-{length}"
        folder.mkdir()
        (folder / path.name).write_bytes(data[:length])
        count = max(0, length - head) // size
        assert Store(folder, new_monitor()).samples == count
        assert len(list(folder.glob("*.parquet"))) == (count > 0) and not list(folder.glob("_*.journal"))
        if count:
            require_every_sample_once(folder, count)


def test_the_record_alone_carries_the_totals(tmp_path: Path) -> None:
    first = run(session_in(tmp_path, TEXT, kept=False))
    first.close()
    assert {path.name for path in tmp_path.iterdir()} == {RECORD, WatchState.FILE}
    again = session_in(tmp_path)
    assert (
        again.monitor.totals() == first.monitor.totals() and again.monitor.totals()["samples"] == STAMPS.size
    )


def test_totals_go_on_over_a_start(tmp_path: Path) -> None:
    """After a start the monitor settles anew: counts of samples add up, peaks do not fall."""
    half = TEXT.index(b"\n2500,") + 1
    first = run(session_in(tmp_path, TEXT[:half]))
    first.close()
    second = run(session_in(tmp_path, TEXT[half:]))
    second.close()
    before, after = first.monitor.totals(), second.monitor.totals()
    assert after["samples"] == STAMPS.size and after["restarts"] == 2
    assert np.all(np.array(after["largest"]) >= np.array(before["largest"]))
    assert after["distance"] > before["distance"] > 0.0
    require_every_sample_once(tmp_path)


def test_another_machine_or_a_damaged_record_is_refused(tmp_path: Path) -> None:
    run(session_in(tmp_path, TEXT)).close()
    monitor = new_monitor()
    other = Monitor(
        machine().model_copy(update={"gravity": (0.0, -9.0, 0.0)}), monitor.settings, monitor.taps
    )
    with pytest.raises(ArgumentError, match=f"{RECORD}.*other constants.*another folder"):
        Store(tmp_path, other)
    text = (tmp_path / RECORD).read_text()
    for damaged in (text[:-30], text.replace('"format": 1', '"format": 2'), "[]"):
        (tmp_path / RECORD).write_text(damaged)
        with pytest.raises(ArgumentError, match=f"{RECORD}: cannot be used"):
            Store(tmp_path, new_monitor())


def test_a_file_that_is_not_the_one_of_the_record_is_read_from_its_start(tmp_path: Path) -> None:
    source, out, said = tmp_path / "samples.csv", tmp_path / "out", []
    out.mkdir()
    source.write_bytes(TEXT[:9000])
    session = in_file(source, out)
    session.step()
    session.close()
    source.write_bytes(b"# another day\n" + TEXT[:12_000])
    monitor = new_monitor()
    again = Session(monitor, GrowingFile(source), Lines(), Store(out, monitor), say=said.append)
    again.step()
    again.close()
    assert "read from its start" in said[0]
    assert monitor.totals()["samples"] == TEXT[:9000].count(b"\n") + TEXT[:12_000].count(b"\n")


@pytest.mark.parametrize("is_saved", [False, True])
def test_killed_soon_after_a_start_no_sample_of_a_new_file_is_lost(is_saved: bool, tmp_path: Path) -> None:
    """Also between the first samples and the record of their place."""
    source, out = tmp_path / "samples.csv", tmp_path / "out"
    out.mkdir()
    source.write_bytes(TEXT[:9000])
    session = in_file(source, out)
    record = (out / RECORD).read_bytes()
    session.step()
    kill(session)
    if not is_saved:
        (out / RECORD).write_bytes(record)
    source.rename(tmp_path / "samples.csv.1")
    source.write_bytes(TEXT[9000:])
    session = in_file(source, out)
    while session.lines.position < len(TEXT) - 9000:
        session.step()
    session.close()
    assert session.samples == TEXT[9000:].count(b"\n")
    assert session.monitor.totals()["samples"] == TEXT[:9000].count(b"\n") + session.samples


def test_a_clock_that_is_set_back_changes_no_totals(tmp_path: Path) -> None:
    """The names of the files then do not sort by time; after a kill the samples before it are found all the same."""
    lines, now = TEXT.splitlines(keepends=True), [NOON]
    pieces = [b"".join(lines[start : start + 800]) for start in range(0, 4000, 800)]
    session = session_in(tmp_path, *pieces, clock=lambda: now[0])
    for hour in (5, 6, 1, 2, 3):
        now[0] = NOON + 3600.0 * hour
        session.step()
    kill(session)
    assert session.store is not None
    session.store._finish()
    expected = new_monitor()
    expected.push(STAMPS, COUNTS)
    assert Store(tmp_path, new_monitor()).monitor.totals() == expected.totals()


def test_a_tail_of_zeros_is_no_sample(tmp_path: Path) -> None:
    """As of a file system that has grown a file whose bytes it did not write before the power failed."""
    session = run(session_in(tmp_path, TEXT))
    assert session.store is not None and session.store._journal is not None
    session.store._journal[1].write(bytes(100_000))
    kill(session)
    assert Store(tmp_path, new_monitor()).samples == STAMPS.size
    require_every_sample_once(tmp_path)
