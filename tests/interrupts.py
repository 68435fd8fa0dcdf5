"""Calls and commands in a process of their own, ended by Ctrl-C or run with little memory."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from tempfile import TemporaryFile

TESTS = Path(__file__).parent
LIMIT = 300.0  # s; an interrupted call ends within a second, but not on a busy machine
INTO = 0.7  # s from the start of the call to Ctrl-C


def run_process(source: str, *, interrupt: bool = False) -> subprocess.CompletedProcess[str]:
    """Run Python code that prints a line before its call; then send SIGINT if asked, and wait for the end."""
    # A process that was started in the background ignores Ctrl-C, and so do the processes that it starts.
    heard = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    lines = f"import sys; sys.path.insert(0, {str(TESTS)!r})\n{heard}\n{source}"
    with (
        TemporaryFile("w+") as errors,
        subprocess.Popen(
            [sys.executable, "-c", lines], stdout=subprocess.PIPE, stderr=errors, text=True
        ) as process,
    ):
        timer = threading.Timer(LIMIT, process.kill)
        timer.start()
        assert process.stdout is not None
        first = process.stdout.readline()
        if interrupt and first:
            time.sleep(INTO)
            process.send_signal(signal.SIGINT)
        out = first + process.stdout.read()
        code = process.wait()
        timer.cancel()
        errors.seek(0)
        return subprocess.CompletedProcess([], code, out, errors.read())
