"""Vectors of MATLAB files: version 4 to 7 by SciPy, 7.3 (HDF5) by h5py. Nothing in them is executed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from guideload.base.errors import UnreadableTrace
from guideload.base.number_text import joined

NUMBERS = ("double", "single", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)))
WAY_OUT = 'save the vectors by themselves, as in t_s = s.time; x_m = s.x; save("trace.mat", "t_s", "x_m") of a struct s'


def read_matlab(path: Path) -> tuple[dict[str, NDArray[Any]] | NDArray[Any], tuple[str, ...]]:
    """The vectors by name, or the matrix of a file that has nothing else; and a note on what is not used.

    Vectors are rows or columns with at least two numbers. Single numbers and texts beside them are not used. Raises
    UnreadableTrace for structs, cells, objects, and matrices beside other variables.
    """
    import h5py

    found = dict(_of_hdf5(path) if h5py.is_hdf5(path) else _of_scipy(path))
    kinds = {name: value for name, value in found.items() if isinstance(value, str) and value != "text"}
    refused = [f"{name} ({kind})" for name, kind in kinds.items()]
    if refused:
        raise UnreadableTrace(
            f"{path.name}: expected vectors of numbers, got {joined(refused[:8])}; {WAY_OUT}"
        )
    arrays = {name: value for name, value in found.items() if not isinstance(value, str) and value.size > 1}
    unused = [name for name in found if name not in arrays]
    notes = (f"not used: {joined(unused)}",) if unused else ()
    vectors = {name: array.ravel() for name, array in arrays.items() if max(array.shape) == array.size}
    if len(arrays) == 1 and not vectors:
        return next(iter(arrays.values())), notes
    if len(vectors) < len(arrays) or not vectors:
        others = [f"{name} of {array.shape}" for name, array in arrays.items() if name not in vectors]
        raise UnreadableTrace(
            f"{path.name}: expected vectors of equal length, or one matrix, got {joined(others or ['none'])}; save its "
            'columns as vectors, as in t_s = a(:, 1); x_m = a(:, 2); save("trace.mat", "t_s", "x_m")'
        )
    return vectors, notes


def _of_scipy(path: Path) -> Iterator[tuple[str, NDArray[Any] | str]]:
    """Variables by name; of others than arrays of numbers what they are."""
    from scipy import sparse
    from scipy.io import loadmat, whosmat
    from scipy.io.matlab import MatlabFunction, MatlabOpaque

    classes = {name: kind for name, _, kind in whosmat(path, appendmat=False)}
    for name, value in loadmat(path, appendmat=False).items():
        if name.startswith("__"):
            continue
        if isinstance(value, MatlabOpaque | MatlabFunction):
            yield name, "object"
        elif sparse.issparse(value):
            yield name, "sparse"
        else:
            array = np.asarray(value)
            if classes.get(name) in ("double", "single") and array.dtype.kind in "iu":
                array = array.astype(np.float64)  # whole doubles are stored in fewer bytes
            kind = "struct" if array.dtype.names else {"O": "cell", "U": "text"}.get(array.dtype.kind)
            yield name, kind or array


def _of_hdf5(path: Path) -> Iterator[tuple[str, NDArray[Any] | str]]:
    """The same of version 7.3, whose arrays are transposed."""
    import h5py

    with h5py.File(path) as file:
        for name, item in file.items():
            if name.startswith("#"):  # the contents of cells and structs
                continue
            kind = item.attrs.get("MATLAB_class", b"struct")
            kind = kind.decode("ascii", "replace") if isinstance(kind, bytes) else str(kind)
            if not isinstance(item, h5py.Dataset) or "MATLAB_sparse" in item.attrs:
                yield name, "sparse" if "MATLAB_sparse" in item.attrs else "struct"
            elif kind == "char":
                yield name, "text"
            elif kind == "logical" or "MATLAB_empty" in item.attrs:
                yield name, np.zeros(0)
            elif kind in NUMBERS:
                yield name, item[...].T
            else:
                yield name, kind if kind in ("struct", "cell") else "object"
