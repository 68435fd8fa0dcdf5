"""Atomic writes of a file and of a folder of files, and an exclusive lock on a folder."""

from __future__ import annotations

import errno
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from guideload.base.errors import RunError, WriteError

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

LOCK = ".lock"


@contextmanager
def atomic_write(path: Path, *, durable: bool = False) -> Iterator[Path]:
    """Yield a hidden draft beside `path` that replaces it when the block ends without an error.

    On an error the draft is removed and the previous file stays. `kill -9` may leave a draft behind; it is never
    read, and the next write of the same file replaces it. The draft is created at once, so that a path that cannot
    be written is refused before the computation starts.
    durable: wait until the file is on the disk, so that it survives a power failure.
    Raises WriteError for every OSError.
    """
    draft = draft_of(path)
    try:
        if not path.parent.is_dir():
            raise WriteError(errno.ENOENT, f"there is no folder {path.parent}", str(path))
        draft.touch()
        yield draft
        if durable:
            _sync(draft, os.O_RDWR)
        draft.replace(path)
        if durable and sys.platform != "win32":  # Windows cannot synchronise folders
            _sync(path.parent, os.O_RDONLY)
    except BaseException as error:
        if path.parent.is_dir():
            draft.unlink(missing_ok=True)
        if isinstance(error, OSError) and not isinstance(error, WriteError):
            reason = os.strerror(error.errno) if error.errno else str(error)  # pyarrow's text is too long
            raise WriteError(error.errno, reason, str(path)) from error
        raise


def draft_of(path: Path) -> Path:
    """Path of the draft of `path`; it keeps the ending, from which some writers choose the format."""
    return path.with_name(f".{path.stem}.draft{path.suffix}")


def _sync(path: Path, flags: int) -> None:
    handle = os.open(path, flags)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@contextmanager
def atomic_folder(folder: Path, publish: Callable[[Path, Path], None]) -> Iterator[Path]:
    """Yield a hidden draft folder; `publish(draft, folder)` moves its files when the block ends without an error.

    On an error the draft and the parent folders that were created for it are removed.
    """
    folder = folder.absolute()
    missing = [parent for parent in folder.parents if not parent.exists()]
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        # The draft is inside an existing folder, whose parent may be read-only or on another disk.
        home = folder if folder.is_dir() else folder.parent
        with tempfile.TemporaryDirectory(prefix=f".{folder.name}-", dir=home) as space:
            draft = Path(space) / "draft"
            draft.mkdir()
            yield draft
            publish(draft, folder)
    except BaseException:
        for parent in missing:
            if parent.is_dir() and not any(parent.iterdir()):
                parent.rmdir()
        raise


@contextmanager
def exclusive_lock(folder: Path) -> Iterator[None]:
    """Lock a folder for this process until the block or the process ends.

    Raises RunError if another process holds the lock.
    """
    with (folder / LOCK).open("a") as file:
        if not _lock(file.fileno()):
            raise RunError(
                f"{folder}: another process is writing in this folder; wait for it, or end it first"
            )
        yield


def _lock(handle: int) -> bool:
    """Whether the lock was acquired; on network disks that do not support locks always True."""
    try:
        if sys.platform == "win32":
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        else:
            # lockf, because a flock is inherited by forked worker processes and outlives this process.
            fcntl.lockf(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        return sys.platform != "win32" and not isinstance(error, BlockingIOError | PermissionError)
    return True
