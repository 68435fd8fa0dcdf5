"""The number of processor cores, and threads that Ctrl-C ends."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

from guideload._core import Cancellation

Submit = Callable[[Callable[[Any], Any], Any], "Future[Any]"]


def cores() -> int:
    """Number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def threads(count: int) -> Iterator[Submit]:
    """Yield `submit(function, argument)`, which runs a function on one of `count` threads.

    Only the main thread receives Ctrl-C. If the block ends with an error, what waits is cancelled, and calls of the
    core on the threads end at once, so that leaving the block does not take long. `submit` raises MemoryError if the
    system cannot start another thread.
    """
    cancellation = Cancellation()
    with ThreadPoolExecutor(count) as pool:

        def submit(function: Callable[[Any], Any], argument: Any) -> Future[Any]:
            try:
                return pool.submit(cancellation.run, function, argument)
            except RuntimeError as error:
                if "start new thread" not in str(error):
                    raise
                raise MemoryError(f"{error}: free memory, or raise the limit on threads") from error

        try:
            yield submit
        except BaseException:
            cancellation.set()
            pool.shutdown(wait=False, cancel_futures=True)
            raise
