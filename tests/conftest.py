"""Shared fixtures, and the profile of property tests."""

import gc
import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from guideload.__main__ import OBJECTS_BETWEEN_COLLECTIONS

# Tests that were started in the background, or by nohup, and the processes that they start would ignore these signals.
signal.signal(signal.SIGINT, signal.default_int_handler)
if hasattr(signal, "SIGHUP"):
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
# Some tests share modules with scripts; processes that tests start, in any folder, import what the tests do.
sys.path += [str(Path(__file__).parent / name) for name in ("damage", "fuzz")]
os.environ["PYTHONPATH"] = os.pathsep.join(os.path.abspath(path) for path in sys.path if path)
# As the commands do, and before numpy is imported: threads of OpenBLAS that wait for each other only cost time.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# As the commands do: else a tenth of the time of the tests is spent in looking for cycles of objects.
gc.set_threshold(OBJECTS_BETWEEN_COLLECTIONS)

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

# Seconds of each test in the last run of it, in pytest's own cache: what `--quick` leaves out.
QUICK = 0.5
KNOWN = "guideload/seconds"
seconds: dict[str, float] = {}


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--quick", action="store_true", help=f"leave out tests that last took {QUICK} s or more")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("quick"):
        known = config.cache.get(KNOWN, {}) if getattr(config, "cache", None) else {}
        left_out = [item for item in items if known.get(item.nodeid, 0.0) >= QUICK]
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if known.get(item.nodeid, 0.0) < QUICK]


def pytest_collection_finish() -> None:
    gc.freeze()  # modules and tests last as long as the process


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    seconds[report.nodeid] = seconds.get(report.nodeid, 0.0) + report.duration


def pytest_sessionfinish(session: pytest.Session) -> None:
    cache = getattr(session.config, "cache", None)  # none with `-p no:cacheprovider`
    if cache and not hasattr(session.config, "workerinput"):
        cache.set(KNOWN, cache.get(KNOWN, {}) | seconds)


@pytest.fixture(scope="session", autouse=True)
def once() -> Iterator[None]:
    """Many tests read the same few traces: in a process the same trace is smoothed once."""
    from smoothed_once import smooth_once

    with pytest.MonkeyPatch.context() as patched:
        smooth_once(patched)
        yield


@pytest.fixture
def shared_data() -> Path:
    """Return the folder of real measured traces that lies beside the checkout; skip where it is missing."""
    folder = Path(__file__).resolve().parents[2] / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"no measured traces: {folder} is missing")
    return folder
