"""Faults at the n-th change of the file system: the process dies there, or the disk is full there.

Python reports each change as an audit event before it is made. A dead process makes no change from the n-th on, not
even those of its `finally` blocks: what is on the disk then is what `kill -9` leaves.
"""

import errno
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

CHANGES = {"os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.link", "os.fsync"}

REMOVALS = {"os.remove", "os.rmdir"}  # a full disk does not prevent them


class Killed(BaseException):
    """The process is dead."""


class _Fault:
    """The fault that is waiting; audit hooks cannot be removed, so one hook serves all tests."""

    def __init__(self) -> None:
        self.root, self.at, self.count, self.kind = "", 0, 0, ""

    def hook(self, event: str, arguments: tuple[Any, ...]) -> None:
        if not self.root or not (event in CHANGES or (event == "open" and _writes(arguments))):
            return
        if event != "os.fsync" and not os.path.abspath(str(arguments[0])).startswith(self.root):
            return
        self.count += 1
        if self.kind == "kill" and self.count >= self.at:
            raise Killed
        if self.kind == "full disk" and self.count == self.at and event not in REMOVALS:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(arguments[0]))


def _writes(arguments: tuple[Any, ...]) -> bool:
    path, mode, flags = arguments
    if not isinstance(path, str | bytes | os.PathLike):
        return False
    return (
        bool(flags & (os.O_WRONLY | os.O_RDWR))
        if isinstance(flags, int)
        else bool(set(mode or "") & set("wax+"))
    )


_FAULT = _Fault()
sys.addaudithook(_FAULT.hook)
_FSYNC = os.fsync


def _fsync(handle: int) -> None:
    _FAULT.hook("os.fsync", (handle,))  # for which Python has no event of its own
    _FSYNC(handle)


@contextmanager
def fault(root: Path, kind: str, at: int) -> Iterator[_Fault]:
    """Until the block ends, the `at`-th change below `root` meets "kill" or "full disk"."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(os, "fsync", _fsync)
        _FAULT.root, _FAULT.at, _FAULT.count, _FAULT.kind = str(root), at, 0, kind
        try:
            yield _FAULT
        finally:
            _FAULT.root = ""


def each(root: Path, kind: str, prepare: Callable[[], object], act: Callable[[], object]) -> Iterator[int]:
    """Prepare, then act with the fault at change 1, 2, ... until an action meets none; yields after each fault."""
    for at in range(1, 1000):
        prepare()
        with fault(root, kind, at) as met:
            try:
                act()
            except (Killed, Exception) as error:
                failed: BaseException | None = error
            else:
                failed = None
        if met.count < at:
            assert failed is None, failed
            assert at > 1, "no change was seen"
            return
        assert failed is not None or kind != "kill"
        yield at
    raise AssertionError("no end of changes")
