"""MATLAB files: the same trace as from .npz, of every version; and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from made_files import PLACE, TIME, matlab73
from scipy import sparse
from scipy.io import savemat

from guideload import read_trace
from guideload.base.errors import ReadError, TraceError
from guideload.cli.inputs import EXAMPLES

VECTORS = {"t_s": TIME, "x_m": PLACE}


def written(path: Path, variables: dict[str, Any], **options: Any) -> Path:
    savemat(path, variables, **options)
    return path


def versions(folder: Path) -> list[Path]:
    """The vectors as each version of MATLAB and each layout has them."""
    paths = [
        written(folder / "column.mat", VECTORS, oned_as="column"),
        written(folder / "row.mat", VECTORS, oned_as="row", do_compression=True),
        written(folder / "four.mat", VECTORS, format="4"),
        written(folder / "more.mat", VECTORS | {"fs": 100.0, "note": "of a test"}),
    ]
    for name, turn in (("seven.mat", lambda one: one[:, None]), ("seven_row.mat", lambda one: one)):
        paths.append(folder / name)
        paths[-1].write_bytes(matlab73({key: turn(one) for key, one in VECTORS.items()}))
    return paths


def test_a_trace_of_every_version_is_that_of_the_npz(tmp_path: Path) -> None:
    np.savez(tmp_path / "trace.npz", **VECTORS)
    wanted = read_trace(tmp_path / "trace.npz")
    for path in versions(tmp_path):
        found = read_trace(path)
        assert (found.kind, found.column) == (wanted.kind, wanted.column), path.name
        assert np.array_equal(found.time, wanted.time) and np.array_equal(found.value, wanted.value)
    assert "not used: fs and note" in " ".join(read_trace(tmp_path / "more.mat").notes)


def test_numbers_are_read_in_the_class_of_matlab(tmp_path: Path) -> None:
    """MATLAB stores doubles that are whole as bytes; they are doubles nevertheless."""
    counts = np.round(PLACE * 1e4)
    found = read_trace(written(tmp_path / "whole.mat", {"t_s": TIME, "x_mm": counts / 10}), column="x_mm")
    assert np.allclose(found.value, 1e-4 * counts, rtol=1e-15)


def test_one_matrix_is_a_bare_array(tmp_path: Path) -> None:
    matrix = np.column_stack([TIME, PLACE])
    found = read_trace(written(tmp_path / "matrix.mat", {"a": matrix}), time="0", column="1", kind="position")
    assert np.array_equal(found.value, PLACE)


@pytest.mark.parametrize(
    ("variables", "text"),
    [
        ({"log": {"time": TIME, "x": PLACE}}, r"log \(struct\)"),
        ({"log": np.array([TIME, "a"], dtype=object)}, r"log \(cell\)"),
        ({"x_m": sparse.csc_array(np.diag(PLACE))}, r"x_m \(sparse\)"),
        ({"t_s": TIME, "x_m": np.column_stack([PLACE, PLACE])}, r"x_m of \(64, 2\)"),
        ({"x_m": PLACE.reshape(4, 4, 4)}, r"shape \(samples,\)"),
        ({"note": "a text"}, "got none"),
        ({"t_s": TIME, "x_m": PLACE[:-1]}, "equal length"),
        ({"t_s": TIME, "x_m": PLACE + 1j}, "column x_m"),
    ],
)
def test_what_is_no_table_is_refused(tmp_path: Path, variables: dict[str, Any], text: str) -> None:
    path = written(tmp_path / "log.mat", variables)
    with pytest.raises(TraceError, match=text) as refusal:
        read_trace(path, column="x_m") if "x_m" in variables else read_trace(path)
    assert str(refusal.value).startswith("log.mat: ")


def test_structs_and_cells_of_version_7_3_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.mat"
    path.write_bytes(matlab73(VECTORS))
    with h5py.File(path, "r+") as file:
        file.create_group("log").attrs["MATLAB_class"] = np.bytes_("struct")
        cell = file.create_dataset("parts", (1, 2), dtype=h5py.ref_dtype)
        cell.attrs["MATLAB_class"] = np.bytes_("cell")
    with pytest.raises(ReadError, match=r"log.mat: .*log \(struct\) and parts \(cell\); save the vectors"):
        read_trace(path)


def test_another_file_with_this_ending_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.mat"
    path.write_text((EXAMPLES / "manipulator.csv").read_text(encoding="utf-8"), encoding="utf-8")
    with pytest.raises(ReadError, match="log.mat: not a MATLAB file"):
        read_trace(path)
