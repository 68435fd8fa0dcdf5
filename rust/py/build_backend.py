"""Builds for pip and `python -m build`: maturin's own functions, with settings that pyproject.toml cannot hold.

The compiled library gets no path of the machine that built it (into the messages of panics), and the wheel the oldest
tag of manylinux that its functions of the C library allow.
"""

from __future__ import annotations

import importlib
import os
import platform
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
SEPARATOR = "\x1f"  # of cargo, between flags


def __getattr__(name: str) -> Any:
    """The functions of a build backend are maturin's."""
    backend = importlib.import_module("maturin")
    function = getattr(backend, name)
    os.environ.update(without_paths())
    if sys.platform == "linux":
        features = "--features any-processor" if lacks_avx2() else ""
        os.environ.setdefault("MATURIN_PEP517_ARGS", f"--compatibility pypi {features}")
    return function


def lacks_avx2() -> bool:
    """Whether this is an x86-64 processor without AVX2, as far as Linux says."""
    try:
        processor = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return False
    return platform.machine() == "x86_64" and "avx2" not in processor


def without_paths() -> dict[str, str]:
    """What makes the compiler write short names for the folders of this machine."""
    given = os.environ.get("CARGO_ENCODED_RUSTFLAGS", "").split(SEPARATOR)
    flags = [flag for flag in given if flag] or os.environ.get("RUSTFLAGS", "").split()
    # The last that fits holds: the most special ones last.
    names = {Path.home(): "~", cargo_home(): "cargo", sysroot(): "rust", ROOT: "guideload"}
    more = (f"--remap-path-prefix={folder}={name}" for folder, name in names.items())
    return {
        "CARGO_ENCODED_RUSTFLAGS": SEPARATOR.join([*flags, *(flag for flag in more if flag not in flags)])
    }


def cargo_home() -> Path:
    """Where cargo keeps the sources of what a build needs."""
    return Path(os.environ.get("CARGO_HOME", Path.home() / ".cargo")).resolve()


def sysroot() -> Path:
    """Where the compiler is installed; without one, the root of the project, which changes nothing."""
    try:
        return Path(subprocess.check_output(["rustc", "--print", "sysroot"], text=True, cwd=ROOT).strip())
    except OSError:
        return ROOT
