"""Tasks of an executor or a cluster: they run in another process, which unpickles the plan once."""

from __future__ import annotations

import pickle
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any

from guideload.base.errors import ArgumentError, RunError
from guideload.study.metadata import FILE, read_json
from guideload.study.plan import Plan
from guideload.study.storage import Chunk, FolderStore, Range

Client = Any  # of dask.distributed, an optional package without types


def run_chunk(packed: bytes, threads: int, start: int, stop: int) -> Chunk:
    """Run samples of a pickled plan."""
    plan = _unpacked(packed)
    values = plan.values(start, stop)
    rows, failed = plan.batch().run(values, threads)
    return Chunk(start, values, rows, {start + i: reason for i, reason in failed})


def write_chunk(packed: bytes, folder: str, threads: int, start: int, stop: int) -> Range:
    """Run samples of a pickled plan, and write them into the folder of the study, which all workers see."""
    metadata, place = _unpacked(packed).metadata, Path(folder)
    there = read_json(place)
    if there is None or there["fingerprint"] != metadata.fingerprint:
        here = f"the worker on {socket.gethostname()}"
        raise RunError(
            f"{here} finds {'no study' if there is None else 'another study'} in {place / FILE}: give an output folder "
            "that all workers and this computer see under the same path, as on a network drive"
        )
    chunk = run_chunk(packed, threads, start, stop)
    for patience in range(WRITE_TRIES - 1, -1, -1):
        try:
            FolderStore(place, metadata, scan=False).add(chunk)
            break
        except RunError:  # a worker of an interrupted run may be writing the same file
            if not patience:
                raise
            time.sleep(1.0)
    return start, stop


@lru_cache(maxsize=1)
def _unpacked(packed: bytes) -> Plan:
    plan: Plan = pickle.loads(packed)
    return plan


@contextmanager
def connected(cluster: Client | str | None) -> Iterator[Client]:
    """The Dask client, or one of the scheduler with this address, or None. Raises ArgumentError, RunError."""
    if cluster is None:
        yield None
        return
    try:
        import distributed
    except ImportError:
        raise ArgumentError("cluster: Dask is not installed: pip install 'guideload[cluster]'") from None
    if isinstance(cluster, distributed.Client):
        yield cluster
        return
    if not isinstance(cluster, str):
        raise ArgumentError(f"cluster: expected a Dask client or an address, got {type(cluster).__name__}")
    connect: Client = distributed.Client
    try:
        client = connect(cluster, timeout=CONNECT_TIME)
    except (OSError, ValueError) as error:
        raise RunError(f"no Dask scheduler answers at {cluster}: {error}") from error
    with client:
        yield client


CONNECT_TIME = 10  # s
WRITE_TRIES = 5  # a second apart: a file takes less to write
