"""A study on a Dask cluster of this machine: `python tests/benchmarks/cluster.py [--samples 1e6] [--workers 1 2]`

A scheduler and workers, each a process of its own with one thread and at most 1 GiB, run the packaged study with the
peak resultant of each carriage; workers write the samples. The table gives samples per second, the efficiency against
one worker, processor time (which other programs on this machine disturb less) of workers per sample and of scheduler
and starting process per task, and the largest memory of each, with the growth of the scheduler over the second half.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import threading
import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import psutil
from distributed import Client, SpecCluster
from distributed.deploy.subprocess import SubprocessCluster

from guideload import Study, run_study
from guideload.cli.inputs import EXAMPLES

MEBIBYTE = 2**20


@dataclass
class Memory:
    """Resident memory [MiB] of scheduler, largest worker and this process, over the share of samples done."""

    scheduler: int
    workers: list[int]
    share: float = 0.0
    rows: list[tuple[float, float, float, float]] = field(default_factory=list)
    stop: bool = False

    def watch(self) -> None:
        while not self.stop:
            workers = max(map(resident, self.workers))
            self.rows.append((self.share, resident(self.scheduler), workers, resident(os.getpid())))
            time.sleep(0.5)


def resident(pid: int) -> float:
    try:
        return float(psutil.Process(pid).memory_info().rss) / MEBIBYTE
    except psutil.NoSuchProcess:
        return 0.0


def cluster(workers: int) -> SpecCluster:
    """A scheduler and workers, each a process of its own."""
    of_each = {"memory_limit": "1GiB", "dashboard": False}
    return SubprocessCluster(
        n_workers=workers, threads_per_worker=1, worker_kwargs=of_each, dashboard_address=None
    )


def processor_time(pids: Iterable[int]) -> float:
    """Seconds."""
    return sum(sum(psutil.Process(pid).cpu_times()[:2]) for pid in pids)


@dataclass
class Measured:
    """rate: samples/s; rows of `Memory`; processor time [s] of scheduler, all workers, this process; tasks, bytes."""

    rate: float
    rows: np.ndarray
    processor: np.ndarray
    tasks: int
    bytes: int


def measured(samples: int, workers: int, folder: Path) -> Measured:
    keys = {"quantities": ("resultant",), "statistics": ("max",), "histories": 0}
    study = Study.from_toml(EXAMPLES / "study.toml", samples=samples).model_copy(update=keys)
    with cluster(workers) as started, Client(started) as client:
        client.wait_for_workers(workers, timeout=60)
        scheduler, pids = client.run_on_scheduler(os.getpid), list(client.run(os.getpid).values())
        memory = Memory(scheduler, pids)
        watcher = threading.Thread(target=memory.watch)
        begun = [0.0, 0.0]
        groups = [scheduler], pids, [os.getpid()]
        before = [processor_time(group) for group in groups]

        def progress(done: int, runs: int) -> None:
            memory.share = done / runs
            begun[1] = time.perf_counter()
            begun[0] = begun[0] or begun[1]

        watcher.start()
        try:
            run_study(study, folder, cluster=client, progress=progress)
        finally:
            memory.stop = True
            watcher.join()
        after = [processor_time(group) for group in groups]
    sizes = [file.stat().st_size for file in (folder / "samples").glob("*.parquet")]
    rate, taken = samples / (begun[1] - begun[0]), np.subtract(after, before)
    return Measured(rate, np.array(memory.rows), taken, len(sizes), sum(sizes))


def main() -> None:
    parser = argparse.ArgumentParser(description="A study on a Dask cluster of this machine.")
    parser.add_argument("--samples", type=float, default=1e6)
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2])
    options = parser.parse_args()
    samples, runs = int(options.samples), {}
    print("| workers | samples/s | efficiency | CPU of workers, us/sample | of scheduler, ms/task ", end="")
    print("| of starter, ms/task | scheduler, MiB | its growth | worker, MiB | starter, MiB | bytes/sample |")
    print("|" + 11 * "---:|")
    for count in options.workers:
        with tempfile.TemporaryDirectory() as folder:
            found = runs[count] = measured(samples, count, Path(folder))
        first, rows = options.workers[0], found.rows
        efficiency = found.rate / runs[first].rate * first / count
        scheduler, workers, own = found.processor
        late = rows[rows[:, 0] >= 0.5, 1]
        largest = " | ".join(f"{value:.0f}" for value in rows[:, 2:].max(axis=0))
        print(
            f"| {count} | {found.rate:.0f} | {100 * efficiency:.0f} % | {1e6 * workers / samples:.0f} "
            f"| {1e3 * scheduler / found.tasks:.1f} | {1e3 * own / found.tasks:.1f} | {rows[:, 1].max():.0f} "
            f"| {late.max() - late.min():.1f} | {largest} | {found.bytes / samples:.0f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
