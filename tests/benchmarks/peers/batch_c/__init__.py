"""C, written by hand in vector lanes and compiled for this processor when it is first called."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

import numpy as np

from peers.problem import Array
from peers.scatter import Peaks, Scatter

FLAGS = ("-O3", "-march=native", "-shared", "-fPIC")
POINTER = ctypes.POINTER(ctypes.c_double)


class Known(ctypes.Structure):
    """`Known` of propagator.c."""

    _fields_ = (
        ("free", ctypes.POINTER(ctypes.c_int)),
        *((name, POINTER) for name in ("inertia", "gravity", "stiff", "damp", "elastic", "damped")),
        ("step", ctypes.c_double),
    )


def compiler() -> str | None:
    """The system's."""
    return shutil.which(os.environ.get("CC", "cc"))


@cache
def _library(dofs: int, carriages: int) -> ctypes.CDLL:
    command = compiler()
    assert command is not None
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        library = str(Path(folder) / "propagator.so")
        source = str(Path(__file__).with_name("propagator.c"))
        shape = (f"-DDOFS={dofs}", f"-DCARRIAGES={carriages}")
        subprocess.run([command, *FLAGS, *shape, source, "-o", library], check=True)
        return ctypes.CDLL(library)


def propagator(of: Scatter) -> Peaks:
    """The exact propagator; all of the set-up is in C and in lanes too."""
    geometry, u = of.geometry, of.nominal.u
    free = np.array(geometry.free, dtype=np.intc)
    known = Known(
        free.ctypes.data_as(ctypes.POINTER(ctypes.c_int)),
        *(_pointer(getattr(geometry, name)) for name, _ in Known._fields_[1:-1]),
        of.nominal.step,
    )
    peaks = np.empty((len(of), len(geometry.elastic)))
    _library(free.size, len(geometry.stiff)).peaks(
        ctypes.byref(known),
        ctypes.c_long(len(of)),
        *(_pointer(draws) for draws in (of.mass, of.center, of.stiffness, of.damping)),
        ctypes.c_long(u.size),
        _pointer(u),
        _pointer(peaks),
    )
    return peaks


def _pointer(array: Array) -> ctypes.Array[ctypes.c_double]:
    assert array.flags.c_contiguous
    return array.ctypes.data_as(POINTER)
