"""A study on Dask: a worker is killed mid-run, workers write the samples, and nothing differs."""

import importlib
import os
import pickle
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from study_standin import contents, plan, stops_at, study

from guideload.base.errors import ArgumentError, RunError
from guideload.study.execution import StudyInterrupted, run_study
from guideload.study.storage import SAMPLES, FolderStore
from guideload.study.tasks import write_chunk

distributed = pytest.importorskip("distributed", reason="needs the extra: pip install guideload[cluster]")

dask = pytest.importorskip("dask")

RUNS = 1000


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    if sys.platform != "win32":  # workers are forked from one process that has imported all they need
        dask.config.set({"distributed.worker.multiprocessing-method": "forkserver"})
        distributed.utils.get_mp_context().set_forkserver_preload(["distributed", "study_standin"])
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


def test_workers_write_the_same_bits_into_the_shared_folder(client: Any, tmp_path: Path) -> None:
    """The samples do not pass through this process; and pandas, Polars and DuckDB read them where they are."""
    described, folder = study(600), tmp_path / "out"
    result = run_study(described, folder, cluster=client, chunk=64, resume=True)
    assert result.store.done == 600 and not result.store.damaged
    assert contents(result.store) == contents(run_study(described).store)
    table = pd.read_parquet(folder / SAMPLES)
    assert table["sample"].tolist() == list(range(600))
    np.testing.assert_array_equal(table["max_resultant_N[2b]"], result.column("max_resultant_N[2b]"))
    total = float(table["max_resultant_N[2b]"].sum())
    if polars := importable("polars"):
        assert polars.scan_parquet(folder / SAMPLES / "*.parquet").collect()[
            "max_resultant_N[2b]"
        ].sum() == pytest.approx(total)
    if duckdb := importable("duckdb"):
        query = f"""select sum("max_resultant_N[2b]") from '{folder / SAMPLES}/*.parquet'"""
        assert duckdb.sql(query).fetchall()[0][0] == pytest.approx(total)


def test_an_interrupted_study_is_resumed_on_a_cluster(client: Any, tmp_path: Path) -> None:
    with pytest.raises(StudyInterrupted, match="of 500 samples are done"):
        run_study(plan(500, pause=1e-3), tmp_path, cluster=client, chunk=20, progress=stops_at(200))
    result = run_study(plan(500), tmp_path, cluster=client.scheduler.address, chunk=20, resume=True)
    assert contents(result.store) == contents(run_study(plan(500)).store)


def test_a_cluster_that_cannot_help_is_refused(
    client: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(ArgumentError, match="output folder that its workers see"):
        run_study(study(10), cluster=client)
    with pytest.raises(ArgumentError, match="no executor beside it"):
        run_study(study(10), tmp_path, cluster=client, executor=client.get_executor())
    with pytest.raises(ArgumentError, match="a Dask client or an address, got int"):
        run_study(study(10), tmp_path / "a", cluster=8786)
    monkeypatch.setattr("guideload.study.tasks.CONNECT_TIME", 0.2)
    with pytest.raises(RunError, match=r"no Dask scheduler answers at tcp://127\.0\.0\.1:9"):
        run_study(study(10), tmp_path / "b", cluster="tcp://127.0.0.1:9")
    packed = pickle.dumps(plan(10))
    with pytest.raises(RunError, match="finds no study in .*under the same path"):
        write_chunk(packed, str(tmp_path / "nowhere"), 1, 0, 10)
    plan(10, seed=2).metadata.write(tmp_path)
    with pytest.raises(RunError, match="finds another study"):
        write_chunk(packed, str(tmp_path), 1, 0, 10)


def importable(name: str) -> Any:
    """A package that reads Parquet, if it is installed."""
    try:
        return importlib.import_module(name)
    except ImportError:
        return None
