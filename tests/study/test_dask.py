"""A study on Dask: a worker is killed mid-run, and nothing differs."""

import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from study_standin import contents, plan

from guideload.study.execution import run_study
from guideload.study.storage.store import FolderStore

distributed = pytest.importorskip("distributed", reason="needs the extra: pip install guideload[cluster]")

RUNS = 1000


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    with (
        distributed.LocalCluster(
            n_workers=2, processes=True, threads_per_worker=1, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


def test_a_killed_worker_changes_no_bit(client: Any, tmp_path: Path) -> None:
    pids = client.run(os.getpid)
    assert len(pids) == 2
    killed: list[int] = []

    def kills(done: int, runs: int) -> None:
        if done >= runs // 4 and not killed:
            killed.append(next(iter(pids.values())))
            os.kill(killed[0], signal.SIGTERM if os.name == "nt" else signal.SIGKILL)

    slow = plan(RUNS, pause=1e-3)
    result = run_study(slow, tmp_path, executor=client.get_executor(), chunk=20, progress=kills)
    assert killed
    assert result.store.done == RUNS
    alone = contents(run_study(plan(RUNS)).store)
    assert contents(result.store) == alone
    assert contents(FolderStore.open(tmp_path)) == alone
    client.wait_for_workers(2, timeout=30)
    assert killed[0] not in client.run(os.getpid).values()
