"""Commands on disks that are too small: success or an ordinary error. More sizes: `tests/helpers/full_disk.py`."""

import subprocess
import sys

import pytest

pytest.importorskip("resource", reason="Windows has neither small disks nor a limit on the size of files")
import full_disk


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux mounts a disk for one process")
def test_a_full_disk_is_an_ordinary_error() -> None:
    words = full_disk.command("--quick", "--sizes", "2")
    ended = subprocess.run(words, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, (ended.stdout, ended.stderr[-3000:])
