"""SIGTERM and SIGHUP end a command with their exit code, and leave nothing behind."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from command_line import MACHINE, write_trace

pytestmark = pytest.mark.skipif(
    sys.platform == "win32", reason="Windows has no such signals between processes"
)

# The command waits where it would compute, so that the signal comes while the draft is there.
WAITING = """
import sys, time
from pathlib import Path
import guideload.simulation.simulation as simulation
from guideload.cli.main import main
def waits(*_, **__):
    Path(sys.argv[1]).touch()
    time.sleep(60)
simulation.simulate = waits
main(sys.argv[2:])
"""


@pytest.mark.parametrize(("name", "code"), [("SIGTERM", 143), ("SIGHUP", 129)])
def test_a_signal_ends_a_run_in_order(tmp_path: Path, name: str, code: int) -> None:
    reached, home = tmp_path / "reached", tmp_path / "home"
    home.mkdir()
    words = [MACHINE, write_trace(tmp_path / "trace.csv", 1200, 0.5), "-o", str(home / "new" / "out")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    process = subprocess.Popen(
        [sys.executable, "-c", WAITING, str(reached), "run", *words], env=environment, stderr=subprocess.PIPE
    )
    while not reached.exists():
        assert process.poll() is None
        time.sleep(0.01)
    assert list(home.rglob(".*.draft"))
    process.send_signal(getattr(signal, name))
    _, said = process.communicate(timeout=60)
    assert process.returncode == code and b"Traceback" not in said
    assert not list(home.iterdir())


def test_a_command_leaves_the_handlers_of_its_caller(tmp_path: Path) -> None:
    from command_line import guideload

    before = signal.getsignal(signal.SIGTERM)
    guideload("check", MACHINE)
    assert signal.getsignal(signal.SIGTERM) is before
