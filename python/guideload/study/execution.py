"""`run_study`: run the samples of a study on threads of this process or on an executor, and store them."""

from __future__ import annotations

import pickle
import time
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, ThreadPoolExecutor, wait
from itertools import islice
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from guideload.base.arguments import checked, whole_number
from guideload.base.arrays import Array
from guideload.base.cores import cores
from guideload.base.errors import ArgumentError, GuideloadError, RunError, SceneError
from guideload.base.quantities import Quantities, Quantity, QuantityRow, quantities
from guideload.simulation.run import AXES
from guideload.simulation.simulation import simulate
from guideload.study.plan import Plan
from guideload.study.result import StudyResult
from guideload.study.storage import Chunk, FolderStore, Range, SampleStore, open_store
from guideload.study.study import Study, make_plan
from guideload.study.tasks import Client, connected, run_chunk, write_chunk
from guideload.study.verification import verify_study

Progress = Callable[[int, int], None]  # takes the number of finished samples and that of all samples

CHUNK = 8192  # samples: some megabytes of results, 0.1 s on one core for the fastest scenes
EXECUTOR_CHUNKS = 64  # least number of chunks for an executor, unless they have under 16 samples
CLUSTER_CHUNK = 65536  # samples of a file that a worker writes: 80 MB with all measures, few files
LEAST_IN_FLIGHT = 64
PER_THREAD = 3  # of a cluster: one chunk runs, one waits on the worker, one is on the way
SLICE_TIME = 0.2  # s between checks for Ctrl-C
STORE_TIME = 10.0  # s, longest time between writes


class StudyInterrupted(KeyboardInterrupt):
    """Ctrl-C ended a study. `result` has the finished samples; `run_study` with resume=True runs the others."""

    def __init__(self, result: StudyResult, text: str) -> None:
        super().__init__(text)
        self.result = result

    def __reduce__(self) -> tuple[type[StudyInterrupted], tuple[StudyResult, str]]:
        return StudyInterrupted, (self.result, str(self))


@checked
def run_study(
    study: Study | Plan | str | PathLike[str],
    output: str | PathLike[str] | None = None,
    *,
    threads: int | None = None,
    chunk: int | None = None,
    executor: Executor | None = None,
    in_flight: int | None = None,
    cluster: Client | str | None = None,
    resume: bool = False,
    progress: Progress | None = None,
    strict: bool = False,
) -> StudyResult:
    """Run all samples of a study. The arguments below do not change any bit of the samples and their results.

    Parameters
    ----------
    study
        A study, its plan or its file.
    output
        Folder for the samples, written during the run; None: in memory.
    threads
        Of this process, by default one per core; or of each task of an executor, by default 1.
    chunk
        Largest number of samples in a file and a task; by default 8192, with an executor less if a small study would
        otherwise give too few tasks.
    executor
        Any concurrent.futures.Executor, such as Dask's `client.get_executor()`; None: this process.
    in_flight
        Chunks that the executor or the cluster gets at once: at least twice its workers, by default 64, and three for
        each thread of a cluster.
    cluster
        A Dask client, or the address of its scheduler, "tcp://host:8786": its workers write the samples into `output`,
        a folder that they all see under this path; neither scheduler nor this process handles samples.
    resume
        Resume the study in `output`, if there is one; damaged chunks are run again.
    progress
        Called repeatedly with the number of finished samples and the number of all samples.
    strict
        Raise DoubtfulResult if the verification of some samples doubts them: see `StudyResult.doubts`.

    Raises
    ------
    ArgumentError
        For an argument, or a folder with another study.
    RunError
        For a full disk or a lost executor; the finished samples are kept.
    StudyInterrupted
        After Ctrl-C, with the finished samples.

    For a file also what `Study.from_toml` raises.
    """
    plan = make_plan(study)
    if cluster is not None and (executor is not None or output is None):
        raise ArgumentError(
            "cluster: expected an output folder that its workers see, and no executor beside it"
        )
    here = executor is None and cluster is None
    threads = whole_number("threads", (cores() if here else 1) if threads is None else threads)
    by_default = CHUNK if here else executor_chunk(plan.runs, cluster is not None)
    chunk = whole_number("chunk", by_default if chunk is None else chunk)
    flying = None if in_flight is None else whole_number("in_flight", in_flight)
    if here and in_flight is not None:
        raise ArgumentError(
            "in_flight: expected an executor or a cluster, which has chunks in flight, got neither"
        )
    plan.batch()  # an impossible machine is refused before anything is written
    place = None if output is None else Path(output)
    with connected(cluster) as client, open_store(plan.metadata, place, resume) as store:
        try:
            kept = store.histories() if plan.histories else None
            if plan.histories and (kept is None or tuple(kept["sample"].values.tolist()) != plan.histories):
                store.add_histories(histories(plan))  # first, so that an interrupted study has them
            _run(plan, store, chunk, threads, executor, client, flying, progress)
            verification = verify_study(plan, StudyResult(store, plan.metadata), threads if here else cores())
            store.describe(plan.metadata.model_copy(update={"verification": verification}))
        except KeyboardInterrupt:
            raise StudyInterrupted(StudyResult(store, store.metadata), _samples_done(store)) from None
        except RunError as error:
            raise RunError(f"{error}. {_samples_done(store)}") from error
    result = StudyResult(store, store.metadata)
    if strict:
        result.raise_if_doubtful()
    return result


def _run(
    plan: Plan,
    store: SampleStore,
    chunk: int,
    threads: int,
    executor: Executor | None,
    client: Client,
    in_flight: int | None,
    progress: Progress | None,
) -> None:
    """Run and store the samples that are missing: in this process, on the executor, or on the cluster of a client."""
    missing = list(store.missing(chunk))
    with ThreadPoolExecutor(1, "guideload-study") as thread:
        writer = _Writer(thread, store, progress)
        writer.count(0)
        if executor is not None:
            task: tuple[Any, ...] = run_chunk, pickle.dumps(plan), threads
            _run_on(executor, task, missing, in_flight or LEAST_IN_FLIGHT, writer)
        elif client is not None and isinstance(store, FolderStore):
            # On all workers, as an argument of tasks, which then do not carry the plan through the scheduler.
            packed = client.scatter(pickle.dumps(plan), broadcast=True, hash=False)
            task = write_chunk, packed, str(store.folder.resolve()), threads
            in_flight = in_flight or max(LEAST_IN_FLIGHT, PER_THREAD * sum(client.nthreads().values()))
            _run_on(client.get_executor(pure=False), task, missing, in_flight, writer)
        else:
            _run_here(plan, missing, threads, writer)
        writer.finish()


def executor_chunk(runs: int, cluster: bool = False) -> int:
    """Default number of samples in a chunk for an executor or a cluster."""
    return min(CLUSTER_CHUNK if cluster else CHUNK, max(16, runs // EXECUTOR_CHUNKS))


def _samples_done(store: SampleStore) -> str:
    """Text: how many samples are done, and how to resume."""
    where = "; they are in memory only, as no output folder was given"
    if isinstance(store, FolderStore):
        where = f" and stored in {store.folder}: resume the study (--resume, or resume=True)"
    return f"{store.done} of {store.runs} samples are done{where}"


class _Writer:
    """Stores chunks on another thread, one at a time, and reports progress; `add` waits for the previous chunk."""

    def __init__(self, thread: Executor, store: SampleStore, progress: Progress | None) -> None:
        self.thread, self.store, self.progress = thread, store, progress
        self.done = store.done  # number of finished samples, stored or not
        self.last: Future[None] | None = None

    def add(self, chunk: Chunk | Range) -> int:
        """Store a chunk, or take over one that a worker has written; returns its number of samples."""
        self.finish()
        if isinstance(chunk, Chunk):
            self.last = self.thread.submit(self.store.add, chunk)
            return chunk.stop - chunk.start
        assert isinstance(self.store, FolderStore)
        self.last = self.thread.submit(self.store.adopt, chunk)
        return chunk[1] - chunk[0]

    def finish(self) -> None:
        """Wait until the last chunk is written; raises the error of writing it."""
        last, self.last = self.last, None
        if last is not None:
            last.result()

    def count(self, samples: int) -> None:
        """Report that more samples are done."""
        self.done += samples
        if self.progress is not None:
            self.progress(self.done, self.store.runs)


# ---- in this process


def _run_here(plan: Plan, missing: list[Range], threads: int, writer: _Writer) -> None:
    """Run one chunk after the other; meanwhile draw the next one and write the previous one."""
    slices, thread, following = _Slices(plan, threads, writer), writer.thread, None
    for i, samples in enumerate(missing):
        values = (following or thread.submit(plan.values, *samples)).result()
        following = thread.submit(plan.values, *missing[i + 1]) if i + 1 < len(missing) else None
        slices.run(samples[0], values)


class _Slices:
    """Runs samples in slices of SLICE_TIME, between which Ctrl-C is checked; results do not depend on them."""

    def __init__(self, plan: Plan, threads: int, writer: _Writer) -> None:
        self.batch, self.measures, self.threads = plan.batch(), len(plan.metadata.measures), threads
        self.writer, self.size = writer, 64

    def run(self, start: int, values: Array) -> None:
        """Run and store all samples, as one chunk or, if they take long, as several; on Ctrl-C the finished ones."""
        rows, failed = np.empty((len(values), self.measures)), dict[int, str]()
        stored = done = 0

        def store_done() -> None:
            nonlocal stored
            begin, stored = stored, done  # first, so that nothing is stored twice if Ctrl-C comes here
            reasons = {i: reason for i, reason in failed.items() if i >= start + begin}
            self.writer.add(Chunk(start + begin, values[begin:done], rows[begin:done], reasons))

        since = time.monotonic()
        try:
            while done < len(values):
                stop, begun = min(done + self.size, len(values)), time.monotonic()
                rows[done:stop], bad = self.batch.run(values[done:stop], self.threads)
                failed |= {start + done + i: reason for i, reason in bad}
                # The size that would have taken SLICE_TIME, at most 8 times the last, as the first samples may be fast.
                fitting = int((stop - done) * SLICE_TIME / max(time.monotonic() - begun, 1e-9))
                self.size = max(self.threads, min(fitting, 8 * self.size))
                self.writer.count(stop - done)
                done = stop
                if done == len(values) or time.monotonic() - since > STORE_TIME:
                    store_done()
                    since = time.monotonic()
        except (KeyboardInterrupt, SystemExit):  # Ctrl-C, SIGTERM
            if done > stored:
                store_done()
            raise


# ---- on an executor or a cluster


def _run_on(
    executor: Any, task: tuple[Any, ...], missing: list[Range], in_flight: int, writer: _Writer
) -> None:
    """Give the executor `in_flight` chunks at a time, and store each when it is finished, in any order.

    task: a function that returns a chunk or the range that it has written, and its arguments before start and stop.
    """
    queue, running = iter(missing), set[Future[Any]]()

    def collect(finished: Iterable[Future[Any]]) -> None:
        """Store the chunks of the tasks that succeeded, then raise for one that did not."""
        lost = None
        for future in finished:
            running.discard(future)
            try:
                chunk = future.result()
            except Exception as error:
                lost = error
            else:
                writer.count(writer.add(chunk))
        if lost is not None:
            raise _executor_error(lost) from lost

    try:
        while True:
            for start, stop in islice(queue, in_flight - len(running)):
                try:
                    running.add(executor.submit(*task, start, stop))
                except Exception as error:  # any error here is one of the executor
                    raise _executor_error(error) from error
            if not running:
                break
            collect(wait(running, return_when=FIRST_COMPLETED).done)
    except (KeyboardInterrupt, SystemExit, RunError):
        for future in running:
            future.cancel()
        finished = [future for future in running if future.done() and not future.cancelled()]
        collect([future for future in finished if future.exception() is None])
        raise


def _executor_error(error: Exception) -> GuideloadError:
    """The error to raise for a failed task or executor; a failed sample does not fail its task."""
    if isinstance(error, GuideloadError):
        return error
    if isinstance(error, BrokenExecutor):
        return RunError("the executor lost a worker: it was killed, ran out of memory, or could not start")
    return RunError(f"the executor failed: {type(error).__name__}: {error}")


# ---- histories of the requested samples, with the labels of a single run


TOGETHER = 16  # samples whose loads are computed at a time
COPIES = 4  # of the loads: themselves, with resultants, the file made in memory, and what HDF5 needs for it


def histories(plan: Plan) -> Quantities:
    """force, moment and resultant (sample, time, carriage) of the samples in `plan.histories`, with their factors.

    A failed sample has NaN, and the reason in `reason`. nominal_force, nominal_moment and nominal_resultant (time,
    carriage) are those of the nominal machine, if it has a solution.
    """
    samples, metadata = list(plan.histories), plan.metadata
    loads, reasons = _room(len(samples), plan.motion.time.size, len(metadata.carriages)), [""] * len(samples)
    values, batch = np.concatenate([plan.values(i, i + 1) for i in samples]), plan.batch_at_stamps()
    for start in range(0, len(samples), TOGETHER):
        loads[start : start + TOGETHER], failed = batch.histories(values[start : start + TOGETHER])
        for i, reason in failed:
            reasons[start + i] = reason
    rows = _rows(("sample", "time", "carriage"), loads, "", "load of the carriage")
    given: dict[str, Any] = {"rtol": metadata.rtol, "times": plan.motion.time, "start": metadata.start}
    try:
        nominal = simulate(metadata.machine, plan.motion, metadata.method, **given).carriage_loads
        rows += _rows(("time", "carriage"), nominal, "nominal_", "load of the carriage, nominal machine")
    except (RunError, SceneError):  # perhaps only the drawn machines have a solution
        pass
    rows.append(("time", ("time",), plan.motion.time, "s", "time"))
    factors = np.array([one.name for one in metadata.parameters])
    # Without units: dimensions, values, meaning.
    others: dict[str, tuple[tuple[str, ...], NDArray[Any], str]] = {
        "value": (("sample", "factor"), values, "values of the factors, in their units"),
        "reason": (("sample",), np.array(reasons, dtype=object), "reason why the sample failed, or empty"),
        "sample": (("sample",), np.array(samples), "index of the sample"),
        "carriage": (("carriage",), np.array(metadata.carriages), ""),
        "axis": (("axis",), np.array(AXES), ""),
        "factor": (("factor",), factors, ""),
    }
    variables = quantities(rows)
    for name, (dims, array, text) in others.items():
        variables[name] = Quantity(dims, array, {"long_name": text} if text else {})
    return Quantities(variables, {"fingerprint": metadata.fingerprint})


def _room(samples: int, times: int, carriages: int) -> Array:
    """Room for the loads. MemoryError, before the first sample runs, if the file made of them would not fit either."""
    shape = samples, times, carriages, 6
    try:
        np.empty((COPIES, *shape), dtype=np.float64)  # virtual memory only, and given back at once
        return np.empty(shape)
    except (MemoryError, ValueError):  # ValueError: more bytes than an address has
        size = 8e-9 * COPIES * float(np.prod(shape, dtype=np.float64))
        raise MemoryError(
            f"the histories of {samples} samples need {size:.3g} GB; request fewer, or run each with `simulate`"
        ) from None


def _rows(dims: tuple[str, ...], loads: Array, prefix: str, text: str) -> list[QuantityRow]:
    """Rows of `quantities` for loads (..., time, carriage, 6)."""
    resultant = np.hypot(loads[..., 1], loads[..., 2])
    return [
        (f"{prefix}force", (*dims, "axis"), loads[..., :3], "N", text),
        (f"{prefix}moment", (*dims, "axis"), loads[..., 3:], "N m", f"{text}, about its centre"),
        (f"{prefix}resultant", dims, resultant, "N", f"{text}, resultant in y and z"),
    ]
