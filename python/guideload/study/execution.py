"""`run_study`: the samples of a study, here on threads or on any executor; what is done is kept, whatever comes."""

from __future__ import annotations

import pickle
import time
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, ThreadPoolExecutor, wait
from functools import lru_cache
from itertools import islice
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from guideload.base.arrays import Array
from guideload.base.cores import cores
from guideload.base.errors import ArgumentError, GuideloadError, RunError
from guideload.study.folder import written
from guideload.study.histories import asked_for, histories
from guideload.study.store import Chunk, FolderStore, Range, SampleStore

if TYPE_CHECKING:
    from guideload.study.plan import Plan
    from guideload.study.result import StudyResult
    from guideload.study.study import Study

Progress = Callable[[int, int], None]  # called with the samples that are done and those of the whole study

CHUNK = 8192  # samples: some megabytes of results, 0.1 s of the fastest scenes on a core
SHARES = 64  # of an executor's work, or more: chunks are smaller where a study has too few samples for that
TURN = 0.2  # s: Ctrl-C is answered that often, however slow a scene is
KEEP = 10.0  # s: here, samples are written at least that often
IN_FLIGHT = 64  # chunks that an executor has at once; it keeps the results of some in memory


class StudyInterrupted(KeyboardInterrupt):
    """Ctrl-C ended a study; `result` is what is done, and running it again with resume=True goes on."""

    def __init__(self, result: StudyResult, text: str) -> None:
        super().__init__(text)
        self.result = result


def run_study(
    study: Study | Plan | str | PathLike[str],
    output: str | PathLike[str] | None = None,
    *,
    threads: int | None = None,
    chunk: int | None = None,
    executor: Executor | None = None,
    in_flight: int = IN_FLIGHT,
    resume: bool = False,
    progress: Progress | None = None,
) -> StudyResult:
    """Run all samples of a study. Sample i and its result are the same to the last bit, whatever is chosen here.

    study      or its file
    output     folder for the samples, kept as they are done; in memory if left out
    threads    here: as many as there are cores if left out; in each task of an executor: 1 if left out
    chunk      samples of a file and of a task, at most; if left out 8192, for an executor fewer in small studies
    executor   any concurrent.futures.Executor, as Dask's `client.get_executor()`, to run on in place of this process
    in_flight  chunks that the executor gets at once: at least twice its workers
    resume     go on with the study in `output`, if there is one; parts that are damaged are run again
    progress   called from time to time with the samples done and those of the whole study

    Raises ArgumentError (an argument, or a folder with another study), RunError (a full disk, a lost executor) and
    StudyInterrupted (Ctrl-C); what was done until then is kept. For a file also what Study.from_toml raises.
    """
    from guideload.study.metadata import StudyMetadata
    from guideload.study.plan import Plan
    from guideload.study.result import StudyResult
    from guideload.study.study import Study

    if isinstance(study, str | PathLike):
        study = Study.from_toml(study)
    if not isinstance(study, Study | Plan):
        kind = type(study).__name__
        raise TypeError(
            f"study: expected a Study, as of Study.from_toml(file), its plan or a file, got {kind}"
        )
    plan = study.plan() if isinstance(study, Study) else study
    threads = _whole_number("threads", threads, cores() if executor is None else 1)
    chunk = _whole_number("chunk", chunk, CHUNK if executor is None else share_of(plan.runs))
    in_flight = _whole_number("in_flight", in_flight, IN_FLIGHT)
    folder = None if output is None else Path(output)
    plan.batch()  # a machine that cannot be is refused before anything is written
    with written(plan, folder, resume) as parts:
        told = _Told(parts, progress)
        try:
            _run_histories(plan, parts)
            todo = list(parts.missing(chunk))
            told(0)
            if executor is None:
                _run_here(plan, todo, threads, parts, told)
            else:
                _run_on(executor, plan, todo, threads, in_flight, parts, told)
        except KeyboardInterrupt:
            raise StudyInterrupted(StudyResult(parts, StudyMetadata.of(plan)), _left(parts)) from None
        except RunError as error:
            raise RunError(f"{error}. {_left(parts)}") from error
    return StudyResult(parts, StudyMetadata.of(plan))


def share_of(runs: int) -> int:
    """Samples of a chunk for an executor."""
    return min(CHUNK, max(16, runs // SHARES))


def _whole_number(name: str, given: int | None, default: int) -> int:
    if given is None:
        return default
    if not isinstance(given, int | np.integer) or isinstance(given, bool) or given < 1:
        raise ArgumentError(f"{name}: expected a whole number of at least 1, got {given!r}")
    return int(given)


def _left(parts: SampleStore) -> str:
    """What there is, and how to go on."""
    done = f"{parts.done} of {parts.runs} samples are done"
    if isinstance(parts, FolderStore):
        return f"{done} and kept in {parts.folder}: resume the study to go on (--resume, or resume=True)"
    return f"{done}; they are in memory only, as no output folder was given"


class _Told:
    """Counts samples that are done, and tells."""

    def __init__(self, parts: SampleStore, progress: Progress | None) -> None:
        self.done, self.runs, self.progress = parts.done, parts.runs, progress

    def __call__(self, more: int) -> None:
        self.done += more
        if self.progress is not None:
            self.progress(self.done, self.runs)


class _Writer:
    """Keeps parts on another thread, one at a time: the caller waits if it is ahead by more than one."""

    def __init__(self, beside: Executor, parts: SampleStore) -> None:
        self.beside, self.parts = beside, parts
        self.last: Future[None] | None = None

    def keep(self, part: Chunk) -> None:
        self.finish()
        self.last = self.beside.submit(self.parts.add, part)

    def finish(self) -> None:
        """Wait for the last part. Raises what its writing raised."""
        last, self.last = self.last, None
        if last is not None:
            last.result()


def _run_histories(plan: Plan, parts: SampleStore) -> None:
    """First of all, so that whatever comes they are there."""
    if plan.histories and not asked_for(parts.histories(), plan):
        parts.keep_histories(histories(plan))


# ---- in this process


def _run_here(plan: Plan, todo: list[Range], threads: int, parts: SampleStore, told: _Told) -> None:
    """One chunk after the other; the next is drawn and the last is written while one runs."""
    with ThreadPoolExecutor(1, "guideload-study") as beside:
        writer = _Writer(beside, parts)
        slices = _Slices(plan, threads)
        coming = deque(todo)
        drawn = beside.submit(plan.values, *coming[0]) if coming else None
        while drawn is not None:
            start, _ = coming.popleft()
            values = drawn.result()
            drawn = beside.submit(plan.values, *coming[0]) if coming else None
            slices.run(start, values, writer.keep, told)
        writer.finish()


class _Slices:
    """Runs samples in slices so short that Ctrl-C is answered; the results do not depend on them."""

    def __init__(self, plan: Plan, threads: int) -> None:
        self.batch, self.measures, self.threads = plan.batch(), len(plan.measures), threads
        self.size = 64

    def run(self, start: int, values: Array, keep: Callable[[Chunk], None], told: _Told) -> None:
        """Hand all samples to `keep`: as one part, or as several if they take long; on Ctrl-C those that are done."""
        rows, failed = np.empty((len(values), self.measures)), dict[int, str]()
        kept = done = 0

        def keep_done() -> None:
            nonlocal kept
            begin, kept = kept, done  # first, so that nothing is handed over twice if Ctrl-C comes here
            reasons = {i: reason for i, reason in failed.items() if i >= start + begin}
            keep(Chunk(start + begin, values[begin:done], rows[begin:done], reasons))

        since = time.monotonic()
        try:
            while done < len(values):
                stop, begun = min(done + self.size, len(values)), time.monotonic()
                rows[done:stop], bad = self.batch.run(values[done:stop], self.threads)
                failed |= {start + done + i: reason for i, reason in bad}
                self._adapt(stop - done, time.monotonic() - begun)
                told(stop - done)
                done = stop
                if done == len(values) or time.monotonic() - since > KEEP:
                    keep_done()
                    since = time.monotonic()
        except KeyboardInterrupt:
            if done > kept:
                keep_done()
            raise

    def _adapt(self, samples: int, seconds: float) -> None:
        """The size that would have taken one turn; it grows with care, as the first samples may be fast ones."""
        fitting = int(samples * TURN / max(seconds, 1e-9))
        self.size = max(self.threads, min(fitting, 8 * self.size))


# ---- on an executor


def _run_on(
    executor: Executor,
    plan: Plan,
    todo: list[Range],
    threads: int,
    in_flight: int,
    parts: SampleStore,
    told: _Told,
) -> None:
    """A bounded number of chunks at the executor; each is written when it comes back, in whatever order."""
    packed = pickle.dumps(plan)
    coming, running = iter(todo), set[Future[Chunk]]()
    with ThreadPoolExecutor(1, "guideload-study") as beside:
        writer = _Writer(beside, parts)

        def keep(finished: Iterable[Future[Chunk]]) -> None:
            """Keep the parts of the tasks that succeeded, then raise for one that did not."""
            lost = None
            for future in finished:
                running.discard(future)
                try:
                    part = future.result()
                except Exception as error:
                    lost = error
                else:
                    writer.keep(part)
                    told(part.stop - part.start)
            if lost is not None:
                raise _of_executor(lost) from lost

        try:
            while True:
                for samples in islice(coming, in_flight - len(running)):
                    running.add(_submitted(executor, packed, samples, threads))
                if not running:
                    break
                keep(wait(running, return_when=FIRST_COMPLETED).done)
            writer.finish()
        except (KeyboardInterrupt, RunError):
            for future in running:
                future.cancel()
            finished = [future for future in running if future.done() and not future.cancelled()]
            keep([future for future in finished if future.exception() is None])
            raise


def _submitted(executor: Executor, packed: bytes, samples: Range, threads: int) -> Future[Chunk]:
    try:
        return executor.submit(run_chunk, packed, *samples, threads)
    except Exception as error:  # whatever it is, it is the executor's
        raise _of_executor(error) from error


def _of_executor(error: Exception) -> GuideloadError:
    """What a task, or the executor itself, raised; in a task a sample's failure is no error."""
    if isinstance(error, GuideloadError):
        return error
    if isinstance(error, BrokenExecutor):
        return RunError("the executor lost a worker: it was killed, ran out of memory, or could not start")
    return RunError(f"the executor failed: {type(error).__name__}: {error}")


def run_chunk(packed: bytes, start: int, stop: int, threads: int) -> Chunk:
    """The task of an executor: samples of a pickled plan, which a process unpacks once."""
    plan = _unpacked(packed)
    values = plan.values(start, stop)
    rows, failed = plan.batch().run(values, threads)
    return Chunk(start, values, rows, {start + i: reason for i, reason in failed})


@lru_cache(maxsize=1)
def _unpacked(packed: bytes) -> Plan:
    plan: Plan = pickle.loads(packed)
    return plan
