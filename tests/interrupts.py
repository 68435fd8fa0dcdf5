"""Calls and commands in a process of their own, ended by Ctrl-C or run with little memory."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

TESTS = Path(__file__).parent
LIMIT = 300.0  # s; an interrupted call ends within a second, but not on a busy machine
INTO = 0.7  # s from the start of the call to Ctrl-C


def run_process(code: str, *, interrupt: bool = False) -> subprocess.CompletedProcess[str]:
    """Run Python code that prints a line before its call; then send SIGINT if asked, and wait for the end."""
    lines = f"import sys; sys.path.insert(0, {str(TESTS)!r})\n{code}"
    process = subprocess.Popen(
        [sys.executable, "-c", lines], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        assert process.stdout is not None
        first = process.stdout.readline()
        if interrupt and first:
            time.sleep(INTO)
            process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=LIMIT)
    finally:
        process.kill()
    return subprocess.CompletedProcess([], process.returncode, first + out, err)
