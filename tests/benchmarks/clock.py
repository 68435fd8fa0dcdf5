"""The clock of the benchmarks, and what it runs on."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

_ALLOWED = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else []


def timed(call: Callable[[], Any]) -> float:
    """Seconds that a call takes."""
    start = time.perf_counter()
    given = call()
    seconds = time.perf_counter() - start
    del given  # freed outside
    return seconds


def processor() -> str:
    """The processor's name."""
    info = Path("/proc/cpuinfo")  # of Linux; platform knows no more than "x86_64" there
    lines = info.read_text().splitlines() if info.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def cores() -> int:
    """How many this process may use."""
    return len(_ALLOWED) or os.cpu_count() or 1


def on_cores(count: int) -> None:
    """Hold this thread, and those that it starts, on so many cores, where the system can do that."""
    if _ALLOWED:
        os.sched_setaffinity(0, _ALLOWED[:count])
