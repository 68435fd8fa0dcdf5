"""Where samples come from: standard input, or a file that grows.

`read` waits at most `timeout` [s]. It returns bytes, b"" if nothing came; a text that says so where one stream ends and
another may begin; None at the end.
"""

from __future__ import annotations

import os
import select
import sys
import time
import zlib
from pathlib import Path
from typing import IO, Any

from guideload.base.errors import ArgumentError

PIECE = 2**16  # bytes that are read at once
PAUSE = 0.05  # s between two looks at a file that has not grown
MARK = 256  # bytes before a place in a file, whose checksum shows that it is the same file


class Input:
    """A source of bytes, by default a stream that cannot be read again."""

    name: str

    def read(self, timeout: float) -> bytes | str | None:
        """The next bytes."""
        raise NotImplementedError

    def place(self, position: int) -> dict[str, Any]:
        """The place after `position` bytes, for the record; empty for a stream that cannot be read again."""
        return {}

    def find(self, place: dict[str, Any]) -> bool:
        """Go to a place of the record; False if this is not the input of the record."""
        return False

    def close(self) -> None:
        """Release what is open."""


class StandardInput(Input):
    """Bytes that another program writes into our standard input, up to its end."""

    name = "standard input"

    def __init__(self) -> None:
        if sys.stdin is None:
            raise ArgumentError("standard input is closed: give --follow")
        try:
            self.handle = sys.stdin.fileno()
        except (OSError, ValueError):  # a file in memory, as in a notebook
            self.handle = -1

    def read(self, timeout: float) -> bytes | str | None:
        if self.handle < 0:
            return sys.stdin.buffer.read(PIECE) or None
        if sys.platform != "win32" and not select.select([self.handle], [], [], timeout)[0]:
            return b""
        return os.read(self.handle, PIECE) or None


class GrowingFile(Input):
    """A file that another program appends to. When it is replaced or cut, the new content is read from its start."""

    def __init__(self, path: Path) -> None:
        self.path, self.name = path, str(path)
        self.file: IO[bytes] = _opened(path)

    def read(self, timeout: float) -> bytes | str | None:
        until = time.monotonic() + timeout
        while True:
            # First ask whether the file was replaced, then read the old one: so its last bytes are not lost.
            is_replaced = self._is_replaced()
            if data := self.file.read(PIECE):
                return data
            if is_replaced:
                self.file.close()
                self.file = _opened(self.path)
                return f"{self.name} was replaced by a new file, which is read from its start"
            if os.fstat(self.file.fileno()).st_size < self.file.tell():
                self.file.seek(0)
                return f"{self.name} was cut, and is read from its start"
            if time.monotonic() >= until:
                return b""
            time.sleep(PAUSE)

    def _is_replaced(self) -> bool:
        try:
            return not os.path.samestat(os.fstat(self.file.fileno()), self.path.stat())
        except FileNotFoundError:  # between the removal of the old file and the creation of the new one
            return False

    def place(self, position: int) -> dict[str, Any]:
        return {"file": str(self.path.absolute()), "position": position, "mark": self._mark(position)}

    def find(self, place: dict[str, Any]) -> bool:
        position = int(place.get("position", -1))
        is_here = place.get("file") == str(self.path.absolute()) and position >= 0
        if is_here and place.get("mark") == self._mark(position):
            self.file.seek(position)
            return True
        return False

    def _mark(self, position: int) -> int:
        """Checksum of the bytes before a position, which shows whether the file is the same; -1 if it is shorter.

        At the start of a file, which has no bytes before it, its number in the file system.
        """
        if not position:
            return os.fstat(self.file.fileno()).st_ino
        here = self.file.tell()
        size = min(MARK, position)
        self.file.seek(position - size)
        data = self.file.read(size)
        self.file.seek(here)
        return zlib.crc32(data) if len(data) == size else -1

    def close(self) -> None:
        self.file.close()


def _opened(path: Path) -> IO[bytes]:
    try:
        return path.open("rb", buffering=0)
    except OSError as error:
        raise ArgumentError(f"{path}: cannot be read: {error.strerror or error}") from None
