"""Calls and commands in a process of their own, ended by Ctrl-C or run with little memory."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryFile

HELPERS = Path(__file__).parent
LIMIT = 300.0  # s; an interrupted call ends within a second, but not on a busy machine
INTO = 0.7  # s from the start of the call to Ctrl-C


# The program, from the moment at which it handles signals.
PROGRAM = """
import signal, sys
for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
    signal.signal(each, signal.default_int_handler if each == signal.SIGINT else signal.SIG_DFL)
from guideload.cli import signals
signals.end_at_once()
print(flush=True)
from guideload.__main__ import main
main()
"""


def signalled(
    words: Sequence[object], number: int, after: float, folder: Path | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a command of guideload in `folder`; send it a signal `after` seconds [s] from its first line on."""
    return _ended(["-c", PROGRAM, *map(str, words)], number, after, folder)


def run_process(source: str, *, interrupt: bool = False) -> subprocess.CompletedProcess[str]:
    """Run Python code that prints a line before its call; then send SIGINT if asked, and wait for the end."""
    # A process that was started in the background ignores Ctrl-C, and so do the processes that it starts.
    heard = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    return _ended(["-c", f"{heard}\n{source}"], signal.SIGINT if interrupt else None, INTO)


def _ended(
    arguments: Sequence[str], number: int | None, after: float, folder: Path | None = None
) -> subprocess.CompletedProcess[str]:
    """Run Python with these arguments; send it a signal, if one is given, `after` seconds from its first line on."""
    command = [sys.executable, *arguments]
    with (
        TemporaryFile("w+") as errors,
        subprocess.Popen(
            command, cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=errors, text=True
        ) as process,
    ):
        timer = threading.Timer(LIMIT, process.kill)
        timer.start()
        assert process.stdout is not None
        first = process.stdout.readline()
        if number is not None and first:
            time.sleep(after)
            process.send_signal(number)
        out = first + process.stdout.read()
        code = process.wait()
        timer.cancel()
        errors.seek(0)
        return subprocess.CompletedProcess(command, code, out, errors.read())
