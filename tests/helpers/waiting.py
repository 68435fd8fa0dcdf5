"""To wait for what other processes do."""

import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")


def until(found: Callable[[], T], what: str = "what is waited for", patience: float = 20.0) -> T:
    """The first true value of `found`, which may raise meanwhile; patience: s, as other tests use the processor."""
    end, last = time.monotonic() + patience, None
    while time.monotonic() < end:
        try:
            if value := found():
                return value
        except Exception as error:  # e.g. of an element that a page has just replaced
            last = error
        time.sleep(0.05)
    raise AssertionError(f"not seen within {patience:g} s: {what}") from last
