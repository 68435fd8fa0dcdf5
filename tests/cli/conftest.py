"""Tests of commands in this process: most of them read the same few traces."""

import pytest
from smoothed_once import smooth_once


@pytest.fixture(autouse=True)
def once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same trace is smoothed once."""
    smooth_once(monkeypatch)
