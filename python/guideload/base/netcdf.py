"""netCDF 4 files, made in memory and then written at once, with a checksum that is verified before HDF5 reads them.

In memory, because HDF5 may crash the process when the disk of an open file is full; the checksum, because HDF5 may
stall or crash on a damaged file. It follows the end of the HDF5 file, which the superblock states. Other programs
ignore it, and it is dropped when one of them changes the file.
"""

from __future__ import annotations

import io
import zlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from guideload.base.quantities import Quantities

if TYPE_CHECKING:
    import h5py
    import xarray as xr

MARK = b"\nguideload crc32 "
LENGTH = len(MARK) + 8  # and eight hexadecimal digits
MARGIN = 2**20  # bytes for labels and attributes, far more than usual
SIGNATURE = b"\x89HDF\r\n\x1a\n"
# Where the superblock states the end of the file, by its version; offsets have eight bytes in all usual files.
END_OF_FILE = {0: 40, 1: 44, 2: 28, 3: 28}


def write_netcdf(data: Quantities, path: Path) -> None:
    """Write quantities as netCDF 4, the same bytes as xarray, and a checksum behind them.

    By h5netcdf, as importing xarray takes longer than most runs. Raises OSError if the file cannot be written, and
    MemoryError if there is no memory for its content, about the size of the arrays.
    """
    with _content(data).getbuffer() as content, path.open("wb") as file:
        file.write(content)
        file.write(_mark(zlib.crc32(content)))


def _content(data: Quantities) -> io.BytesIO:
    """The netCDF file of quantities."""
    import h5netcdf
    import h5py

    content = io.BytesIO()
    with _opened(content, "w") as hdf5, h5netcdf.File(hdf5, "w") as file:
        # All memory at once, because HDF5 may crash as well if memory ends while it writes; it cuts off the rest.
        content.seek(sum(values.nbytes for _, values, _ in data.variables.values()) + MARGIN)
        content.write(b"\0")
        file.attrs.update(data.attrs)
        for dims, values, _ in data.variables.values():
            for dim, size in zip(dims, values.shape, strict=True):
                if dim not in file.dimensions:
                    file.dimensions[dim] = size
        for name, (dims, values, attrs) in data.variables.items():
            kind = h5py.string_dtype() if values.dtype.kind in "OUT" else values.dtype
            empty = np.nan if values.dtype.kind == "f" else None
            written = file.create_variable(name, dims, kind, fillvalue=empty)
            written.attrs.update(attrs)
            written[...] = values
    return content


def read_netcdf(path: Path) -> xr.Dataset:
    """The content of a netCDF 4 file. Raises ValueError if it is damaged, and the errors of xarray and HDF5."""
    import h5netcdf
    import xarray as xr
    from xarray.backends import H5NetCDFStore

    _check(path)
    options = {"phony_dims": "access", "decode_vlen_strings": True}  # as xarray opens a file itself
    with _opened(path, "r") as hdf5, h5netcdf.File(hdf5, "r", **options) as file:
        return xr.load_dataset(H5NetCDFStore(file))


def _opened(target: Path | io.BytesIO, mode: str) -> h5py.File:
    """An HDF5 file without groups, which looks up each object once: h5netcdf asks for the same few a thousand times.

    When h5netcdf creates the variable of a dimension, it deletes the object that stood for the dimension until then.
    """
    import h5py

    known: dict[str, Any] = {}

    class Opened(h5py.File):  # type: ignore[misc]
        def __getitem__(self, name: Any) -> Any:
            if not isinstance(name, str):  # a reference
                return super().__getitem__(name)
            if name == "/":
                return self
            path = f"/{name.lstrip('/')}"
            if path not in known:
                known[path] = super().__getitem__(path)
            return known[path]

        def __delitem__(self, name: str) -> None:
            known.pop(f"/{name.lstrip('/')}", None)
            super().__delitem__(name)

        def close(self) -> None:
            known.clear()
            super().close()

    return Opened(target, mode, track_order=True)


def _check(path: Path) -> None:
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
    if tail != _mark(zlib.crc32(memoryview(path.read_bytes())[:end])):
        raise ValueError("a file whose checksum is wrong: it is damaged; copy it again, or repeat the run")


def _mark(checksum: int) -> bytes:
    """The checksum as it is appended to a file."""
    return MARK + b"%08x" % checksum
