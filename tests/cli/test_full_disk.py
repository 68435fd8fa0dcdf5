"""Commands on disks that are too small: success or an ordinary error. More sizes: `tests/helpers/full_disk.py`."""

import subprocess
import sys

import pytest

pytest.importorskip("resource", reason="Windows has neither small disks nor a limit on the size of files")
import full_disk

# Numbers of sizes, and commands.
OTHERS = [line for line in full_disk.COMMANDS if line not in full_disk.FRESH]
GROUPS = {"netCDF": (6, [*full_disk.FRESH]), "others": (2, OTHERS)}


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux mounts a disk for one process")
@pytest.mark.parametrize("group", GROUPS)
def test_a_full_disk_is_an_ordinary_error(group: str) -> None:
    sizes, lines = GROUPS[group]
    words = full_disk.command("--quick", "--sizes", str(sizes), *lines)
    ended = subprocess.run(words, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, (ended.stdout, ended.stderr[-3000:])
