"""Atomic writes of a file and of a folder of files, and exclusive locks.

A writer has a hidden draft folder, whose lock ends with the process: `.NAME.draft` beside the target, or `.draft` in a
folder that exists. `kill -9` may leave a draft folder behind; the next writer of the same target clears it.
"""

from __future__ import annotations

import errno
import os
import shutil
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from guideload.base.errors import RunError, ValueRefused, WriteError

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

LOCK = ".lock"
DRAFT = ".draft"  # ending of the name of a draft folder
COMPLETE = "complete"  # in a draft folder: complete outputs whose move into the target has begun
_held = set[Path]()  # locks of this process, which the system does not keep apart by thread
_held_guard = threading.Lock()


def with_ending(path: str | os.PathLike[str], ending: str) -> Path:
    """`path`. Raises ValueRefused if its name has another ending, by which readers know the format."""
    path = Path(path)
    if path.suffix != ending:
        raise ValueRefused(f"a file name that ends in {ending}", str(path))
    return path


def require_no_null(path: Path) -> None:
    """Raise WriteError for a path with a NUL character, which Python refuses without the name."""
    if "\0" in str(path):
        raise WriteError(errno.EINVAL, "a name of a file has no NUL character", str(path))


@contextmanager
def atomic_write(path: Path, *, durable: bool = False, replace: bool = True) -> Iterator[Path]:
    """Yield a draft of the same name that replaces `path` when the block ends without an error.

    On an error the draft is removed and the previous file stays. The draft is created at once, so that a path that
    cannot be written is refused before the computation starts.
    durable: wait until the file is on the disk, so that it survives a power failure.
    replace: whether a file that exists is replaced; if not, that is an error.
    Raises WriteError for every OSError, RunError if another writer has the same path.
    """
    require_no_null(path)
    try:
        if not path.parent.is_dir():
            raise WriteError(errno.ENOENT, f"there is no folder {path.parent}", str(path))
        if path.is_dir():
            raise WriteError(errno.EISDIR, "this is a folder: give the name of a file", str(path))
        with draft_folder(draft_path(path), path) as folder:
            draft = folder / path.name
            draft.touch()
            yield draft
            if durable:
                _sync(draft)
            draft.replace(path) if replace else _move_to_new(draft, path)
            if durable:
                _sync(path.parent)
    except WriteError:
        raise
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else str(error)  # pyarrow's text is too long
        raise WriteError(error.errno, reason, str(path)) from error


@contextmanager
def atomic_folder(
    folder: Path, check: Callable[[], None], move: Callable[[Path, Path], None]
) -> Iterator[Path]:
    """Yield a draft folder whose files are in `folder` when the block ends without an error: all of them, or none.

    A new folder appears in one step, with all files. In a folder that exists, `move(draft, folder)` moves the files; if
    the process is killed meanwhile, the next writer in this folder completes the move first.
    check: raises if `folder` cannot take the files; called under the lock, before the block and again after it.
    On an error the draft and the parent folders that were created for it are removed.
    """
    require_no_null(folder)
    folder = folder.absolute()
    missing = [parent for parent in folder.parents if not parent.exists()]
    outer_draft, inner_draft = draft_path(folder), folder / DRAFT
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        if folder.is_dir() and outer_draft.is_dir():
            # Clears what a killed process left when this folder was new.
            with draft_folder(outer_draft, folder):
                pass
        is_new = not folder.is_dir()  # the parent of a folder that exists may be read-only or on another disk
        with draft_folder(outer_draft if is_new else inner_draft, folder) as workspace:
            complete = workspace / COMPLETE
            if complete.is_dir():
                move(complete, folder)
            check()
            draft = workspace / "outputs"
            draft.mkdir()
            yield draft
            check()
            for path in (*draft.rglob("*"), draft):
                _sync(path)
            if is_new:
                draft.rename(folder)
            else:
                draft.rename(complete)
                move(complete, folder)
            _sync(folder.parent if is_new else folder)
    except BaseException:
        for parent in missing:
            if parent.is_dir() and not any(parent.iterdir()):
                parent.rmdir()
        raise


def draft_path(path: Path) -> Path:
    """The draft folder of a file, or of a folder that does not exist yet."""
    return path.with_name(f".{path.name}{DRAFT}")


@contextmanager
def draft_folder(draft: Path, target: Path) -> Iterator[Path]:
    """Create and lock the draft folder of `target`, empty but for complete outputs; remove it at the end.

    Raises RunError if another process or thread holds it.
    """
    try:
        with _lock_of_draft(draft, target):
            _clear(draft)
            try:
                yield draft
            finally:
                _clear(draft)
                # While it is held: whoever has opened it meanwhile sees that it is gone.
                if sys.platform != "win32" and os.listdir(draft) == [LOCK]:
                    (draft / LOCK).unlink()
    finally:
        with suppress(OSError):  # another writer may have begun, or complete outputs could not be moved
            # Windows does not remove files that are open.
            if sys.platform == "win32" and os.listdir(draft) == [LOCK]:
                (draft / LOCK).unlink()
            draft.rmdir()


def is_draft(path: Path) -> bool:
    """Whether a path may be used as draft folder: one that a writer made, empty, or gone."""
    try:
        return not path.is_symlink() and (not (there := os.listdir(path)) or LOCK in there)
    except (FileNotFoundError, NotADirectoryError) as error:
        return error.errno == errno.ENOENT


def _move_to_new(draft: Path, path: Path) -> None:
    """Move a file to a path that must not exist. Raises FileExistsError."""
    if sys.platform == "win32":
        draft.rename(path)  # an error if the path exists, as with a link elsewhere
        return
    try:
        os.link(draft, path)
    except FileExistsError:
        raise
    except OSError:  # a disk without links
        path.touch(exist_ok=False)  # takes the name, or is the error
        draft.replace(path)


def _clear(draft: Path) -> None:
    """Remove all from a draft folder except complete outputs, which the next writer moves if this one cannot."""
    for path in draft.iterdir():
        if path.name not in (LOCK, COMPLETE):
            shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()


@contextmanager
def _lock_of_draft(draft: Path, target: Path) -> Iterator[None]:
    while True:
        with suppress(FileExistsError):
            draft.mkdir()
        if not is_draft(draft):
            raise WriteError(errno.EEXIST, f"{draft} is in the way; move it elsewhere", str(target))
        try:
            with exclusive_lock(draft, target):
                yield
            return
        except FileNotFoundError as error:  # the previous writer removed the folder meanwhile
            if error.filename != str(draft / LOCK):
                raise


@contextmanager
def exclusive_lock(folder: Path, target: Path | None = None) -> Iterator[None]:
    """Lock a folder for this process until the block or the process ends.

    target: what is written, for the message; by default the folder. Raises RunError if another process or thread
    holds the lock.
    """
    path, target = folder / LOCK, target or folder
    key = path.absolute()
    with _held_guard:
        is_free = key not in _held
        _held.add(key)
    if not is_free:
        raise _busy(target, "another thread of this process")
    try:
        while True:
            with path.open("a+") as file:
                if not _lock(file.fileno()):
                    raise _busy(target, _holder(path))
                if not _is_file(file.fileno(), path):
                    continue  # its holder removed it before it was locked here
                file.truncate(0)
                # On a full disk others are told less, and this writer fails at its own file.
                with suppress(OSError):
                    os.write(file.fileno(), b"%d\n" % os.getpid())
                yield
                return
    finally:
        with _held_guard:
            _held.discard(key)


def _busy(target: Path, who: str) -> RunError:
    return RunError(
        f"{target}: {who} is writing here; wait for it, end it first, or give another place to write"
    )


def _holder(path: Path) -> str:
    """Who holds a lock, in words."""
    # Windows does not let others read a file that is locked.
    number = "" if sys.platform == "win32" else path.read_text(encoding="utf-8")
    return f"another process (number {number.strip()})" if number.strip().isdigit() else "another process"


def _is_file(handle: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(handle), path.stat())
    except FileNotFoundError:
        return False


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


def _sync(path: Path) -> None:
    """Wait until a file or the entries of a folder are on the disk."""
    if sys.platform == "win32" and path.is_dir():  # Windows cannot synchronise folders
        return
    handle = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
