"""Shared fixtures, and the profile of property tests."""

import signal
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# Tests that were started in the background, or by nohup, and the processes that they start would ignore these signals.
signal.signal(signal.SIGINT, signal.default_int_handler)
if hasattr(signal, "SIGHUP"):
    signal.signal(signal.SIGHUP, signal.SIG_DFL)

# The same examples in every run, on any machine: a failure is one of the program.
settings.register_profile(
    "guideload",
    derandomize=True,
    deadline=None,
    max_examples=60,
    database=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
# For `pytest --hypothesis-profile=long`: other examples each time, and many.
settings.register_profile("long", settings.get_profile("guideload"), derandomize=False, max_examples=1000)
settings.load_profile("guideload")

# Files in which all tests start, kill or interrupt processes, or run for long; other tests have the marker themselves.
SLOW = (
    "cli/test_cli_interrupt.py",
    "cli/test_open_files.py",
    "cli/test_signals.py",
    "damage/test_damage.py",
    "docs/test_documents.py",
    "simulation/test_interrupt.py",
    "simulation/test_limits.py",
    "study/test_dask.py",
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests of `SLOW` files."""
    folder = Path(__file__).parent
    for item in items:
        if item.path.is_relative_to(folder) and item.path.relative_to(folder).as_posix() in SLOW:
            item.add_marker("slow")


@pytest.fixture
def shared_data() -> Path:
    """Return the folder of real measured traces that lies beside the checkout; skip where it is missing."""
    folder = Path(__file__).resolve().parents[2] / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"no measured traces: {folder} is missing")
    return folder
