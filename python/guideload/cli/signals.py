"""Signals that ask a command to end: it removes its drafts first."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

NAMES = ("SIGTERM", "SIGHUP")  # Ctrl-C is SIGINT, for which Python raises KeyboardInterrupt


@contextmanager
def orderly_end() -> Iterator[None]:
    """Until the block ends, SIGTERM and SIGHUP raise SystemExit with 128 and the number of the signal: 143 and 129.

    A second signal ends the process at once.
    """
    if threading.current_thread() is not threading.main_thread():  # only the main thread may set handlers
        yield
        return
    found = [number for name in NAMES if (number := getattr(signal, name, None)) is not None]
    former = {number: signal.getsignal(number) for number in found}
    ours = [number for number in found if former[number] is signal.SIG_DFL]  # nohup has SIGHUP ignored
    for number in ours:
        signal.signal(number, _end)
    try:
        yield
    finally:
        for number in ours:
            signal.signal(number, former[number])


def _end(number: int, _: FrameType | None) -> None:
    signal.signal(number, signal.SIG_DFL)
    sys.exit(128 + number)
