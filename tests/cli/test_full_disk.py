"""Commands on disks that are too small: success or an ordinary error. More sizes: `tests/helpers/full_disk.py`."""

import subprocess
import sys

import pytest

pytest.importorskip("resource", reason="Windows has neither small disks nor a limit on the size of files")
import full_disk

SIZES = {"run, netcdf": 8, "study": 4}  # those that write netCDF, in a process of their own for each size
GROUPS = [[*full_disk.COMMANDS][start::4] for start in range(4)]


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux mounts a disk for one process")
@pytest.mark.parametrize("names", GROUPS, ids=lambda names: names[0])
def test_a_full_disk_is_an_ordinary_error(names: list[str]) -> None:
    for name in names:
        words = full_disk.command("--sizes", str(SIZES.get(name, 2)), name)
        ended = subprocess.run(words, capture_output=True, text=True, check=False)
        assert ended.returncode == 0, (name, ended.stdout, ended.stderr[-3000:])
