"""The compiled module: what it asks of the system on which it runs."""

import platform
import re
import sys
from pathlib import Path

import pytest

from guideload import _core

NEWEST = 28  # glibc 2.28, of RHEL 8: see rust/py/src/old_glibc.rs


@pytest.mark.skipif(
    sys.platform != "linux" or platform.machine() != "x86_64",
    reason="old names are for Linux on x86-64 alone",
)
def test_it_asks_for_no_newer_glibc_than_the_wheel_says() -> None:
    versions = {int(minor) for minor in re.findall(rb"GLIBC_2\.(\d+)", Path(_core.__file__).read_bytes())}
    assert 2 in versions and max(versions) <= NEWEST
