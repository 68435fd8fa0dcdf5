"""Checksum of netCDF files, verified before HDF5 reads them: HDF5 may stall or crash on a damaged file.

It follows the end of the HDF5 file, which the superblock states. Other programs ignore it, and it is dropped when one
of them changes the file.
"""

from __future__ import annotations

import zlib
from pathlib import Path

MARK = b"\nguideload crc32 "
LENGTH = len(MARK) + 8  # and eight hexadecimal digits
PIECE = 2**20  # bytes that are read at once
SIGNATURE = b"\x89HDF\r\n\x1a\n"
# Where the superblock states the end of the file, by its version; offsets have eight bytes in all usual files.
END_OF_FILE = {0: 40, 1: 44, 2: 28, 3: 28}


def append_checksum(path: Path) -> None:
    """Append the checksum to a complete HDF5 file."""
    size = path.stat().st_size
    with path.open("ab") as file:
        file.write(_text(path, size))


def check_hdf5(path: Path) -> None:
    """Raise ValueError unless an HDF5 file is complete and, if it has a checksum, undamaged.

    A file without checksum, as other programs write, must begin with the signature and be as long as it states.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(64)
        file.seek(max(0, size - LENGTH))
        tail = file.read()
    if not head.startswith(SIGNATURE) or len(head) < 64:
        raise ValueError("a file that is no netCDF 4 file, or whose beginning is damaged")
    version = head[8]
    has_usual_offsets = head[13 if version < 2 else 9] == 8
    if version not in END_OF_FILE or not has_usual_offsets:
        raise ValueError("a file whose beginning is damaged")
    end = int.from_bytes(head[END_OF_FILE[version] :][:8], "little")
    if size == end:
        return
    if size != end + LENGTH or not tail.startswith(MARK):
        raise ValueError(f"a file of {size} bytes that states {end}: it is cut off or damaged; copy it again")
    if tail != _text(path, end):
        raise ValueError("a file whose checksum is wrong: it is damaged; copy it again, or repeat the run")


def _text(path: Path, size: int) -> bytes:
    """The checksum of the first `size` bytes of a file, as it is appended."""
    checksum = 0
    with path.open("rb") as file:
        while size and (piece := file.read(min(size, PIECE))):
            checksum = zlib.crc32(piece, checksum)
            size -= len(piece)
    return MARK + b"%08x" % checksum
