"""What benchmarks share. Imported first, it holds NumPy and its like on one thread, and finds `tests/helpers`."""

from __future__ import annotations

import os
import platform
import sys
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

# Read when NumPy and the others are imported.
os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["OMP_NUM_THREADS"] = "1"
os.environ["MKL_NUM_THREADS"] = "1"
os.environ["VECLIB_MAXIMUM_THREADS"] = "1"
os.environ["RAYON_NUM_THREADS"] = "1"
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

_ALLOWED = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else []


def timed(call: Callable[[], Any]) -> float:
    """Seconds that a call takes."""
    start = time.perf_counter()
    given = call()
    seconds = time.perf_counter() - start
    del given  # freed outside
    return seconds


def by_turns(
    calls: Mapping[str, Callable[[], object]], rounds: int, clock: Callable[[], float] = time.perf_counter
) -> dict[str, list[float]]:
    """Seconds of each call, in as many rounds of all, so that what else the machine does hits them alike."""
    times: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(rounds):
        for name, call in calls.items():
            start = clock()
            call()
            times[name].append(clock() - start)
    return times


def on_cores(count: int) -> None:
    """Hold this thread, and those that it starts, on so many cores, where the system can do that."""
    if _ALLOWED:
        os.sched_setaffinity(0, _ALLOWED[:count])


def installed(package: str) -> bool:
    return find_spec(package) is not None


def processor() -> str:
    """The processor's name."""
    info = Path("/proc/cpuinfo")  # of Linux; platform knows no more than "x86_64" there
    lines = info.read_text().splitlines() if info.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def made_on(*packages: str) -> str:
    """Processor, and versions of Python, NumPy, SciPy, and these packages if they are installed."""
    versions = [f"Python {platform.python_version()}"]
    for name in ("numpy", "scipy", *packages):
        with suppress(PackageNotFoundError):
            versions.append(f"{name} {version(name)}")
    return f"One thread of {processor()}; {', '.join(versions)}."


def row(*cells: str) -> str:
    """A row of a Markdown table."""
    return f"| {' | '.join(cells)} |"


def heading(*cells: str, words: int = 1) -> str:
    """The two rows at the top of a Markdown table; its first `words` columns hold words, the others numbers."""
    return f"{row(*cells)}\n{row(*(['---'] * words + ['---:'] * (len(cells) - words)))}"


def write_block(page: Path, name: str, block: str) -> None:
    """Put a block between the lines `<!-- NAME -->` and `<!-- end of NAME -->` of a page."""
    begin, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->"
    head, _, rest = page.read_text(encoding="utf-8").partition(begin)
    text = f"{head}{begin}{block}\n{end}{rest.partition(end)[2]}"
    page.write_text(text, encoding="utf-8", newline="\n")
