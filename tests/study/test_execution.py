"""A study runs the same to the last bit however it is run, and loses nothing whatever ends it."""

import errno
import multiprocessing
import os
import pickle
import random
import signal
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as parquet
import pytest
import xarray as xr
from study_standin import EXAMPLES, HashedBatch, StandIn, contents, plan, run_in_child, stops_at, study

from guideload.base.errors import ArgumentError, RunError, SceneError
from guideload.study import execution
from guideload.study.execution import StudyInterrupted, executor_chunk, run_study
from guideload.study.result import StudyResult
from guideload.study.storage import FolderStore, chunks_in, open_store

RUNS = 1000


@pytest.fixture(scope="module")
def whole() -> dict[str, bytes]:
    """The study as it is when nothing comes between."""
    return contents(run_study(plan(RUNS)).store)


def processes() -> ProcessPoolExecutor:
    """Two worker processes, not forked from this one, which has threads."""
    context = multiprocessing.get_context("spawn" if sys.platform == "win32" else "forkserver")
    if sys.platform != "win32":
        context.set_forkserver_preload(["study_standin"])
    return ProcessPoolExecutor(2, context)


@pytest.fixture(scope="module")
def pool() -> Iterator[Executor]:
    with processes() as executor:
        yield executor


def test_a_file_replaces_its_study_and_other_types_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    of_file = {file: study(20) for file in (EXAMPLES / "study.toml", str(EXAMPLES / "study.toml"))}
    monkeypatch.setattr("guideload.study.study.Study.from_toml", of_file.pop)
    assert [run_study(file).runs for file in list(of_file)] == [20, 20] and not of_file
    for other in (3, None, {"samples": 2}):
        with pytest.raises(TypeError, match="study: expected a Study, as from Study.from_toml"):
            run_study(other)


# ---- the same to the last bit


@pytest.mark.parametrize(
    "options", [dict(threads=1), dict(threads=3), *(dict(chunk=n) for n in (1, 77, 5000))]
)
def test_threads_and_chunks_change_no_bit(tmp_path: Path, whole: dict[str, bytes], options: dict) -> None:
    if options.get("chunk") != 1:
        assert contents(run_study(plan(RUNS), tmp_path / "out", **options).store) == whole
        assert contents(FolderStore.open(tmp_path / "out")) == whole
    assert contents(run_study(plan(RUNS), **options).store) == whole


def test_slices_change_no_bit(whole: dict[str, bytes], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(execution, "SLICE_TIME", 0.0)  # a sample at a time
    monkeypatch.setattr(execution, "STORE_TIME", 0.001)  # and files of a few
    assert contents(run_study(plan(200), threads=1).store) == contents(run_study(plan(200)).store)


@pytest.mark.parametrize("chunk", [None, 30])
def test_executors_change_no_bit(
    tmp_path: Path, whole: dict[str, bytes], pool: Executor, chunk: int | None
) -> None:
    assert contents(run_study(plan(RUNS), tmp_path / "out", executor=pool, chunk=chunk).store) == whole
    with ThreadPoolExecutor(3) as threads:
        assert contents(run_study(plan(RUNS), executor=threads, chunk=chunk).store) == whole


def test_resuming_changes_no_bit_and_runs_nothing_twice(tmp_path: Path, whole: dict[str, bytes]) -> None:
    out, batch = tmp_path / "out", plan(RUNS).batch()
    run_study(plan(RUNS), out, chunk=100)
    for path in chunks_in(out)[2:9:3]:
        path.unlink()
    spoilt = chunks_in(out)[0]
    spoilt.write_bytes(spoilt.read_bytes()[:-7])
    batch.sizes.clear()
    again = run_study(plan(RUNS), out, chunk=64, resume=True)
    assert sum(batch.sizes) == 400
    assert contents(again.store) == whole
    assert list(again.store.damaged) == [spoilt]
    batch.sizes.clear()
    assert contents(run_study(plan(RUNS), out, resume=True).store) == whole
    assert batch.sizes == []


def test_more_samples_keep_those_there_are(tmp_path: Path) -> None:
    run_study(plan(300), tmp_path, chunk=64)
    batch = plan(RUNS).batch()
    batch.sizes.clear()
    longer = run_study(plan(RUNS), tmp_path, resume=True)
    assert sum(batch.sizes) == RUNS - 300
    np.testing.assert_array_equal(longer.store.column("k[2b]"), plan(RUNS).values(0, RUNS)[:, 4])


def test_resume_may_begin(tmp_path: Path, whole: dict[str, bytes]) -> None:
    assert contents(run_study(plan(RUNS), tmp_path / "a" / "b", resume=True).store) == whole


def test_a_failed_sample_has_the_reason_for_its_values() -> None:
    result = run_study(plan(RUNS))
    failed, mass = result.store.reasons(), result.store.column("body.mass")
    assert 5 < len(failed) < 50 and result.store.done == RUNS
    assert all(reason == f"no equilibrium at {mass[i]:.3f} kg" for i, reason in failed.items())


# ---- the course of a run


def test_progress_counts_every_sample_once(tmp_path: Path, pool: Executor) -> None:
    for executor in (None, pool):
        told: list[tuple[int, int]] = []

        def progress(done: int, runs: int, told: list[tuple[int, int]] = told) -> None:
            told.append((done, runs))

        out = tmp_path / str(executor is None)
        run_study(plan(RUNS), out, executor=executor, chunk=100, progress=progress)
        assert (told[0], told[-1]) == ((0, RUNS), (RUNS, RUNS))
        assert told == sorted(told)
        chunks_in(out)[3].unlink()
        told.clear()
        run_study(plan(RUNS), out, executor=executor, resume=True, progress=progress)
        assert (told[0], told[-1]) == ((RUNS - 100, RUNS), (RUNS, RUNS))


def test_slow_samples_run_in_short_slices_and_are_stored_often(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(execution, "SLICE_TIME", 0.02)
    monkeypatch.setattr(execution, "STORE_TIME", 0.1)
    slow = plan(300, pause=0.002)
    slow.batch().sizes.clear()
    run_study(slow, tmp_path, threads=1, chunk=300)
    assert sorted(slow.batch().sizes)[-2] <= 20  # the first turn is of 64, as nothing is known yet
    assert len(chunks_in(tmp_path)) >= 4


def test_an_executor_gets_many_chunks_that_are_not_large() -> None:
    for runs in (1, 10, 1000, 10**4, 10**6, 10**8):
        chunk = executor_chunk(runs)
        assert 16 <= chunk <= 8192
        assert runs / chunk >= 64 or chunk == 16


def test_memory_is_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """However slow the disk is, three chunks are held at most: one that is drawn, one that runs, one to write."""
    drawn, kept, most = 0, 0, 0
    values, add = StandIn.values, FolderStore.add

    def draws(self: StandIn, start: int, stop: int) -> Any:
        nonlocal drawn, most
        drawn += 1
        most = max(most, drawn - kept)
        return values(self, start, stop)

    def keeps(self: FolderStore, part: Any) -> None:
        nonlocal kept
        time.sleep(0.005)
        add(self, part)
        kept += 1

    monkeypatch.setattr(StandIn, "values", draws)
    monkeypatch.setattr(FolderStore, "add", keeps)
    run_study(plan(RUNS), tmp_path, chunk=20)
    assert (drawn, kept) == (50, 50)
    assert most <= 4


def test_an_executor_gets_a_bounded_number_of_chunks(whole: dict[str, bytes]) -> None:
    class Counting(ThreadPoolExecutor):
        there = most = 0
        lock = threading.Lock()

        def submit(self, *task: Any, **options: Any) -> Future[Any]:
            with self.lock:
                self.there += 1
                self.most = max(self.most, self.there)
            future = super().submit(*task, **options)
            future.add_done_callback(lambda _: self.leave())
            return future

        def leave(self) -> None:
            with self.lock:
                self.there -= 1

    with Counting(2) as executor:
        assert contents(run_study(plan(RUNS), executor=executor, chunk=10, in_flight=5).store) == whole
        assert 1 < executor.most <= 5


@pytest.mark.parametrize("name", ["threads", "chunk", "in_flight"])
@pytest.mark.parametrize("value", [0, -1, 1.5, True])
def test_bad_numbers_are_refused(name: str, value: Any) -> None:
    with pytest.raises(ArgumentError, match=f"{name}: expected a whole number"):
        run_study(plan(10), **{name: value})


def test_chunks_in_flight_need_an_executor() -> None:
    with pytest.raises(ArgumentError, match="in_flight: expected an executor or a cluster"):
        run_study(plan(10), in_flight=7)


# ---- histories


def test_histories_are_stored_with_labels(tmp_path: Path) -> None:
    asked = [0, 7, 8, *range(20, 80)]
    asked_for = plan(RUNS, histories=asked)
    in_memory = run_study(asked_for).store.histories()
    run_study(asked_for, tmp_path)
    kept = FolderStore.open(tmp_path).histories()
    assert in_memory is not None and kept is not None
    xr.testing.assert_identical(kept.drop_attrs(), in_memory.drop_attrs())
    assert kept["sample"].values.tolist() == asked
    loads, failed = asked_for.batch().histories(asked_for.values(20, 21))
    assert not failed
    np.testing.assert_array_equal(kept["force"].sel(sample=20), loads[0, :, :, :3])
    np.testing.assert_array_equal(kept["moment"].sel(sample=20), loads[0, :, :, 3:])
    np.testing.assert_array_equal(kept["value"].sel(sample=20), asked_for.values(20, 21)[0])
    reasons = run_study(plan(RUNS)).store.reasons()
    assert [reasons.get(i, "") for i in asked] == kept["reason"].values.tolist()
    assert {kept[name].attrs["units"] for name in ("force", "resultant")} == {"N"}


def test_resuming_keeps_histories_that_are_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = plan(RUNS, histories=[3, 4])
    run_study(study, tmp_path)
    before = (tmp_path / "histories.nc").read_bytes()
    with monkeypatch.context() as patched:
        patched.setattr(HashedBatch, "histories", None)
        run_study(study, tmp_path, resume=True)
    (tmp_path / "histories.nc").write_bytes(before[:-300])
    run_study(study, tmp_path, resume=True)
    kept = FolderStore.open(tmp_path).histories()
    assert kept is not None and kept["sample"].values.tolist() == [3, 4]
    run_study(plan(RUNS, histories=[5]), tmp_path, resume=True)  # others are asked for of the same samples
    kept = FolderStore.open(tmp_path).histories()
    assert kept is not None and kept["sample"].values.tolist() == [5]


# ---- what ends a run


@pytest.mark.parametrize("output", [True, False])
@pytest.mark.parametrize("on_pool", [True, False])
def test_ctrl_c_leaves_a_result(
    tmp_path: Path, whole: dict[str, bytes], pool: Executor, output: bool, on_pool: bool
) -> None:
    out, executor = tmp_path / "out" if output else None, pool if on_pool else None
    with pytest.raises(StudyInterrupted) as stopped:
        run_study(plan(RUNS), out, executor=executor, chunk=50, progress=stops_at(300))
    left = stopped.value.result
    assert isinstance(left, StudyResult)
    assert 200 <= left.store.done < RUNS
    assert f"{left.store.done} of 1000 samples are done" in str(stopped.value)
    if output and not on_pool:
        again = pickle.loads(pickle.dumps(stopped.value))
        assert str(again) == str(stopped.value) and again.result.finished == left.finished
    for start, stop in left.store.ranges():
        got = left.store.column("body.mass")[start:stop]
        np.testing.assert_array_equal(got, plan(RUNS).values(start, stop)[:, 0])
    if out is not None:
        assert f"stored in {out}: resume the study" in str(stopped.value)
        assert contents(run_study(plan(RUNS), out, executor=executor, resume=True).store) == whole


@pytest.fixture
def interruptible() -> Iterator[None]:
    """Ctrl-C as on a terminal: a shell starts what runs in the background with the signal ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interruptible")
def test_a_signal_is_answered_within_a_slow_chunk(tmp_path: Path) -> None:
    slow = plan(4000, pause=0.001)
    timer = threading.Timer(0.6, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(StudyInterrupted) as stopped:
        run_study(slow, tmp_path, threads=1, chunk=4000)  # 4 s
    timer.join()
    assert 0 < stopped.value.result.store.done < 4000
    (part,) = chunks_in(tmp_path)
    assert part.name == f"chunk-000000000-{stopped.value.result.store.done:09d}.parquet"


def test_a_full_disk_is_reported_and_no_store_stays_open(
    tmp_path: Path, whole: dict[str, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    write, room = parquet.write_table, 5

    def writes(table: Any, path: Path, **options: Any) -> None:
        nonlocal room
        room -= 1
        if room < 0:
            path.write_bytes(b"PAR1 and no more")
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        write(table, path, **options)

    out = tmp_path / "out"
    with monkeypatch.context() as patched:
        patched.setattr(parquet, "write_table", writes)
        with pytest.raises(
            RunError, match=r"parquet: cannot be written: No space.* 500 of 1000 .* stored in"
        ):
            run_study(plan(RUNS), out, chunk=100)
    assert len(list((out / "samples").iterdir())) == 5 + 1  # and the lock
    assert contents(run_study(plan(RUNS), out, resume=True).store) == whole


class Child:
    """A process that runs the study of 1000 samples, and its workers if it has a pool of them."""

    def __init__(
        self, out: Path, histories: Sequence[int], pool: bool = False, largest_file: int | None = None
    ) -> None:
        context = multiprocessing.get_context("forkserver")
        context.set_forkserver_preload(["study_standin"])
        self.out = out
        self.said, says = context.Pipe(duplex=False)
        self.process = context.Process(
            target=run_in_child, args=(str(out), histories, pool, largest_file, says)
        )
        self.process.start()

    def wait_for_parts(self, number: int) -> None:
        while self.process.is_alive() and len(chunks_in(self.out)) < number:
            time.sleep(0.001)

    def end_workers(self) -> None:
        assert self.process.pid is not None
        with suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)


unix_only = pytest.mark.skipif(sys.platform == "win32", reason="no signals and limits of Unix")


@unix_only
@pytest.mark.parametrize("pool", [False, True])
def test_kill_9_at_any_moment_loses_at_most_what_runs(
    tmp_path: Path, whole: dict[str, bytes], pool: bool
) -> None:
    out, rng, before = tmp_path / "out", random.Random(1), 0
    for _ in range(2 if pool else 4):
        child = Child(out, [1, 2], pool)
        child.wait_for_parts(before + 2)
        time.sleep(rng.uniform(0, 0.015))
        child.process.kill()
        child.process.join()
        assert child.process.exitcode == -signal.SIGKILL
        left = FolderStore.open(out)
        assert not left.damaged
        before = len(left.ranges())
        assert 2 <= before < 20
        with open_store(plan(RUNS).metadata, out, resume=True):  # though workers of the pool outlive it
            pass
        child.end_workers()
    result = run_study(plan(RUNS, histories=[1, 2]), out, chunk=50, resume=True)
    assert contents(result.store) == whole
    assert not list(out.rglob(".*.draft"))


@unix_only
@pytest.mark.parametrize(
    ("largest_file", "histories", "file"),
    [
        (1000, [], "study.json"),
        (9000, [1, 2], "histories.nc"),
        (8000, [], "chunk-000000000-000000050.parquet"),
    ],
)
def test_a_write_error_is_reported_and_the_study_resumes(
    tmp_path: Path, whole: dict[str, bytes], largest_file: int, histories: list[int], file: str
) -> None:
    out = tmp_path / "out"
    child = Child(out, histories, largest_file=largest_file)
    child.process.join()
    assert child.process.exitcode == 0
    said = child.said.recv()
    assert said.startswith("RunError: ") and f"{file}: cannot be written: File too large" in said
    assert not list(out.rglob(".*.draft")) and not chunks_in(out)
    result = run_study(plan(RUNS, histories=histories), out, resume=True)
    assert contents(result.store) == whole


def test_a_killed_worker_is_reported_and_the_study_resumes(tmp_path: Path, whole: dict[str, bytes]) -> None:
    out = tmp_path / "out"
    with processes() as pool:

        def kills(done: int, _: int) -> None:
            if done >= 300:
                for process in pool._processes.values():
                    process.kill()

        with pytest.raises(RunError, match=r"lost a worker.* samples are done and stored in .*resume the"):
            run_study(plan(RUNS, pause=1e-3), out, executor=pool, chunk=50, progress=kills)
    assert 300 <= FolderStore.open(out).done < RUNS
    with processes() as pool:
        assert contents(run_study(plan(RUNS), out, executor=pool, resume=True).store) == whole


def test_an_executor_that_refuses_work_is_reported() -> None:
    pool = ThreadPoolExecutor(1)
    pool.shutdown()
    with pytest.raises(RunError, match="the executor failed: RuntimeError: cannot schedule"):
        run_study(plan(10), executor=pool)


def test_a_machine_without_solution_stays_that(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: Any) -> None:
        raise SceneError("the body is not supported")

    monkeypatch.setattr(StandIn, "batch", fails)
    with pytest.raises(SceneError, match="not supported"):
        run_study(plan(10))
    with ThreadPoolExecutor(1) as pool, pytest.raises(SceneError, match="not supported"):
        run_study(plan(10), executor=pool)
