"""Shared fixtures."""

from pathlib import Path

import pytest


@pytest.fixture
def shared_data() -> Path:
    """Return the folder of real measured traces that lies beside the checkout; skip where it is missing."""
    folder = Path(__file__).resolve().parents[2] / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"no measured traces: {folder} is missing")
    return folder
