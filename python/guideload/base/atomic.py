"""Files that are there whole or not at all, whatever stops the program or the machine; one writer per folder."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from guideload.base.errors import RunError

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

LOCK = ".lock"


@contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """A draft beside `path` that takes its place, and is on the disk, when all is written; else nothing stays.

    After `kill -9` a draft may be left, hidden and never read; the next writer of the same file replaces it.
    Raises RunError if the disk takes no more.
    """
    draft = draft_of(path)
    try:
        yield draft
        with draft.open("rb+") as file:
            os.fsync(file.fileno())
        draft.replace(path)
        _sync_names(path.parent)
    except BaseException as error:
        draft.unlink(missing_ok=True)
        if isinstance(error, OSError):
            reason = os.strerror(error.errno) if error.errno else error
            raise RunError(f"{path}: cannot be written: {reason}") from error
        raise


def draft_of(path: Path) -> Path:
    """Where `path` is drafted."""
    return path.with_name(f".{path.name}.draft")


def _sync_names(folder: Path) -> None:
    """Names in a folder to the disk; Windows does that by itself and opens no folders."""
    if sys.platform != "win32":
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


@contextmanager
def exclusive_lock(folder: Path) -> Iterator[None]:
    """Hold the folder for this process; the system lets go of it when the process ends, however it ends.

    Raises RunError if another process holds it.
    """
    with (folder / LOCK).open("a") as file:
        if not _held(file.fileno()):
            raise RunError(f"{folder}: another process is writing this study; wait for it, or end it first")
        yield


def _held(handle: int) -> bool:
    """Whether the lock could be taken; a disk of the network that knows no locks is taken as free."""
    if sys.platform == "win32":
        try:
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
    else:
        try:
            # A record lock and not flock: worker processes that we fork must not hold it after we are gone.
            fcntl.lockf(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except (BlockingIOError, PermissionError):
            return False
        except OSError:
            return True
    return True
