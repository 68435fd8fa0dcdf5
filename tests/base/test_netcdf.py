"""Writing of netCDF where memory is scarce; the files themselves are tested in `tests/simulation/test_result.py`."""

import sys

import pytest
from interrupts import run_process

# Loads h5netcdf, then allows 0 to 30 MB more than the process has, for a file of 14 MB.
SCARCE = """
import json
import resource
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from guideload.base.netcdf import write_netcdf
from guideload.base.quantities import Quantities, quantities

def data(size):
    time = ("time", ("time",), np.arange(size) * 1e-3, "s", "time")
    rows = [(f"load {i}", ("time",), np.full(size, float(i)), "N", "load") for i in range(6)]
    return Quantities(quantities([time, *rows]), {})

# The stack grows when it is used, and where it cannot, Linux ends the process: so it is large from the start.
sys.setrecursionlimit(9000)
json.loads("[" * 8000 + "]" * 8000)
large = data(250_000)
print()
with TemporaryDirectory() as folder:
    path = Path(folder) / "loads.nc"
    write_netcdf(data(3), path)
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    for spare in np.linspace(0, 30e6, 61):
        resource.setrlimit(resource.RLIMIT_AS, (used + int(spare), hard))
        try:
            write_netcdf(large, path)
            print("written")
        except MemoryError:
            print("refused")
        finally:
            resource.setrlimit(resource.RLIMIT_AS, (hard, hard))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits memory so")
def test_scarce_memory_is_an_error_and_no_crash() -> None:
    ended = run_process(SCARCE)
    assert ended.returncode == 0, ended.stderr
    outcomes = ended.stdout.split()
    assert len(outcomes) == 61 and set(outcomes) == {"written", "refused"}
