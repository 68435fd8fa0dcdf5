"""Damaged files: each is read or refused by its name, in bounded time, without a warning; nothing is executed."""

from __future__ import annotations

import io
import pickle
import zipfile
from pathlib import Path

import h5py
import made_files
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as parquet
import pytest
import xarray as xr
from damage_runs import FORMATS, outcomes, valid_files

from guideload.base.errors import GuideloadError, ReadError
from guideload.simulation.result import Result
from guideload.study.result import StudyResult
from guideload.traces.reading import read_trace

EACH = 7  # damaged files of each format; `python tests/damage/damage_runs.py` reads as many as asked


@pytest.fixture(scope="module")
def valid(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Valid results and a valid study."""
    folder = tmp_path_factory.mktemp("damage")
    valid_files(folder)
    return folder / "valid"


def test_damaged_files_are_read_or_refused_by_their_name(valid: Path) -> None:
    cases = [(name, seed) for name in FORMATS for seed in range(EACH)]
    found = dict(zip(cases, outcomes(valid.parent, cases), strict=True))
    assert {case: how for case, how in found.items() if how not in ("valid", "refused")} == {}
    read = {name for (name, _), how in found.items() if how == "valid"}
    refused = {name for (name, _), how in found.items() if how == "refused"}
    assert (
        len(read) > len(FORMATS) / 2 and len(refused) > len(FORMATS) / 2
    )  # the damage is neither mild nor total


def test_valid_files_are_read(valid: Path, tmp_path: Path) -> None:
    for name, content in made_files.texts().items():
        (tmp_path / f"{name}.csv").write_bytes(content)
        trace = read_trace(tmp_path / f"{name}.csv", **made_files.options_of(name))
        assert np.ptp(trace.value) == pytest.approx(np.ptp(made_files.PLACE), abs=2e-6)
    loads = Result.load(valid / "foreign.nc").carriage_loads
    for name in ("loads.nc", "loads.parquet"):
        assert np.array_equal(Result.load(valid / name).carriage_loads, loads)
    assert StudyResult.load(valid / "study").finished == 40


def test_each_changed_byte_of_a_result_is_found(valid: Path, tmp_path: Path) -> None:
    content = (valid / "loads.nc").read_bytes()
    rng = np.random.default_rng(3)
    for place in [0, 8, 40, len(content) - 1, *rng.integers(len(content), size=100).tolist()]:
        damaged = bytearray(content)
        damaged[place] ^= 1 << int(rng.integers(8))
        (tmp_path / "loads.nc").write_bytes(damaged)
        with pytest.raises(ReadError, match="loads.nc: expected a result that guideload wrote, got a file"):
            Result.load(tmp_path / "loads.nc")
    for size in [0, 7, 63, 64, *rng.integers(len(content), size=50).tolist(), len(content) - 1]:
        (tmp_path / "loads.nc").write_bytes(content[:size])
        with pytest.raises(ReadError, match=r"loads.nc: .* got a file"):
            Result.load(tmp_path / "loads.nc")


def test_a_result_that_another_program_changed_is_read(valid: Path, tmp_path: Path) -> None:
    path = tmp_path / "loads.nc"
    path.write_bytes((valid / "loads.nc").read_bytes())
    with h5py.File(path, "r+") as file:
        file["force"][0, 0, 0] = 17.0
    assert Result.load(path).carriage_loads[0, 0, 0] == 17.0
    xr.load_dataset(path).to_netcdf(tmp_path / "again.nc")
    assert Result.load(tmp_path / "again.nc").carriage_loads[0, 0, 0] == 17.0


class Attack:
    """An object whose unpickling creates a file."""

    def __init__(self, marker: Path) -> None:
        self.marker = marker

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return Path.touch, (self.marker,)


def attacks(marker: Path) -> dict[str, bytes]:
    """Files that hold a pickle, wherever their format could have one."""
    evil = pickle.dumps(Attack(marker))
    objects = np.array([Attack(marker)] * 64, dtype=object)
    records = np.zeros(64, [("t_s", float), ("x_m", object)])
    records["x_m"] = objects
    table, extension, hdf5 = io.BytesIO(), io.BytesIO(), io.BytesIO()
    metadata = {b"pandas": evil, b"guideload": evil, b"PICKLE:": evil}
    parquet.write_table(pa.table({"t_s": [evil] * 64}).replace_schema_metadata(metadata), table)
    names = {b"ARROW:extension:name": b"arrow.py_extension_type", b"ARROW:extension:metadata": evil}
    field = pa.field("x_m", pa.binary(), metadata=names)
    parquet.write_table(pa.table([pa.array([evil] * 64)], pa.schema([field])), extension)
    with h5py.File(hdf5, "w") as file:
        data = file.create_dataset("force", data=np.void(evil))
        data.attrs["machine"] = np.void(evil)
        file.attrs["machine"] = np.void(evil)
        file.create_dataset("moment", data=np.array([data.ref] * 3, dtype=h5py.ref_dtype))
    return {
        "objects.npy": made_files.saved(objects, allow_pickle=True),
        "records.npy": made_files.saved(records, allow_pickle=True),
        "pickle.npy": evil,
        "objects.npz": made_files.zipped({"t_s.npy": made_files.saved(objects, allow_pickle=True)}),
        "records.npz": made_files.zipped({"a.npy": made_files.saved(records, allow_pickle=True)}),
        "pickle.npz": evil,
        "member.npz": made_files.zipped({"t_s.npy": evil, "x_m": evil}, zipfile.ZIP_STORED),
        "metadata.parquet": table.getvalue(),
        "extension.parquet": extension.getvalue(),
        "pickle.parquet": evil,
        "pickle.csv": evil,
        "protocol0.csv": pickle.dumps(Attack(marker), 0),
        "objects.nc": hdf5.getvalue(),
        "pickle.nc": evil,
    }


def test_no_format_executes_or_unpickles_anything(valid: Path, tmp_path: Path) -> None:
    marker = tmp_path / "marker"
    pickle.loads(pickle.dumps(Attack(marker)))
    assert marker.exists()  # the attack works where something unpickles
    marker.unlink()
    pickle_of_pandas = tmp_path / "frame.csv"
    pd.DataFrame({"t_s": [0.0]}).to_pickle(pickle_of_pandas, compression=None)
    for name, content in attacks(marker).items():
        path = tmp_path / name
        path.write_bytes(content)
        path.with_suffix(".json").write_bytes(content)
        for read in (read_trace, Result.load):
            with pytest.raises(GuideloadError) as refusal:
                read(path)
            assert str(refusal.value).startswith((path.name, str(path))), name
        assert not marker.exists(), name
    for name in ("study.json", "histories.nc", "samples/chunk-000000000-000000020.parquet"):
        for content in attacks(marker).values():
            changed = valid / "study" / name
            before = changed.read_bytes()
            changed.write_bytes(content)
            try:
                StudyResult.load(valid / "study").store.histories()
            except GuideloadError:
                pass
            finally:
                changed.write_bytes(before)
            assert not marker.exists(), name
