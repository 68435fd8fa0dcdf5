"""The samples of a study that are done: a Parquet file per part, each there whole or not at all; or in memory."""

from __future__ import annotations

import json
import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet

from guideload.base.arrays import Array
from guideload.base.atomic import atomic_write
from guideload.base.errors import ArgumentError, RunError
from guideload.study import manifest

if TYPE_CHECKING:
    import xarray as xr

Range = tuple[int, int]  # samples start..stop-1

SAMPLES = "samples"  # the folder of the parts, beside the manifest
HISTORIES = "histories.nc"
NAME = re.compile(r"part-(\d{9,})-(\d{9,})\.parquet")
KEY = b"guideload"  # of the metadata in a part
READ_AHEAD = 2**23  # numbers: columns beside one that is asked for are read with it, up to so many
# What reading a part that is not what it should be may raise: pyarrow's own errors, and what it takes from Python.
DAMAGE = (pa.ArrowException, OSError, ValueError, KeyError)


@dataclass(frozen=True, eq=False)
class Chunk:
    """Samples start, start + 1, ... and what came of them.

    values (n, factors); rows (n, measures), NaN where a sample failed; failed: sample -> reason.
    """

    start: int
    values: Array
    rows: Array
    failed: Mapping[int, str]

    @property
    def stop(self) -> int:
        return self.start + len(self.values)


class SampleStore(ABC):
    """The samples of a study, column by column; NaN where a sample failed or has not been run.

    columns   the names of all columns: factors, then measures
    runs      samples that the whole study has
    damaged   files that were found to be no whole part of the study, and why
    """

    def __init__(self, columns: Sequence[str], runs: int) -> None:
        self.columns = tuple(columns)
        self.runs = runs
        self.damaged: dict[Path, str] = {}

    @abstractmethod
    def ranges(self) -> list[Range]:
        """The samples that are done, ascending, without overlap."""

    @abstractmethod
    def add(self, part: Chunk) -> None:
        """Keep a part whose samples are not done yet. Raises RunError if it cannot be kept; then nothing of it is."""

    @abstractmethod
    def reasons(self) -> dict[int, str]:
        """Why samples failed, by sample."""

    @abstractmethod
    def tables(self) -> Iterator[pa.Table]:
        """All that is done, table by table, ascending: sample, factors, measures, reason (null where fine)."""

    @abstractmethod
    def histories(self) -> xr.Dataset | None:
        """The histories that were asked for, if they have been computed."""

    @abstractmethod
    def keep_histories(self, data: xr.Dataset) -> None:
        """Keep them with the samples."""

    @abstractmethod
    def _read(self, names: Sequence[str]) -> dict[str, Array]:
        """Columns, each (runs,)."""

    @property
    def done(self) -> int:
        """How many samples are done, failed ones too."""
        return sum(stop - start for start, stop in self.ranges())

    def missing(self, chunk: int) -> Iterator[Range]:
        """The samples that are not done, cut where a multiple of `chunk` is passed."""
        reached = 0
        for start, stop in [*self.ranges(), (self.runs, self.runs)]:
            while reached < start:
                end = min(start, (reached // chunk + 1) * chunk)
                yield reached, end
                reached = end
            reached = stop

    def column(self, name: str) -> Array:
        """(runs,) one factor or measure of all samples. Raises ArgumentError for a name that there is not."""
        return self._read([self._known(name)])[name]

    def _known(self, name: str) -> str:
        if name not in self.columns:
            near = get_close_matches(name, self.columns) or self.columns
            raise ArgumentError(f"column: expected one of {', '.join(near)}, got {name!r}")
        return name

    def _empty(self, names: Sequence[str]) -> dict[str, Array]:
        return {name: np.full(self.runs, np.nan) for name in names}

    def _schema(self) -> pa.Schema:
        numbers = [pa.field(name, pa.float64(), nullable=False) for name in self.columns]
        return pa.schema(
            [pa.field("sample", pa.int64(), nullable=False), *numbers, pa.field("reason", pa.string())]
        )

    def _table(self, part: Chunk) -> pa.Table:
        samples = np.arange(part.start, part.stop)
        numbers = np.vstack([part.values.T, part.rows.T])  # a contiguous row per column of the table
        reasons = [part.failed.get(sample) for sample in range(part.start, part.stop)]
        columns = [pa.array(samples), *map(pa.array, numbers), pa.array(reasons, pa.string())]
        return pa.Table.from_arrays(columns, schema=self._schema())


class MemoryStore(SampleStore):
    """SampleStore of a study without a folder."""

    def __init__(self, columns: Sequence[str], runs: int) -> None:
        super().__init__(columns, runs)
        self._parts: list[Chunk] = []
        self._histories: xr.Dataset | None = None

    def ranges(self) -> list[Range]:
        return sorted((part.start, part.stop) for part in self._parts)

    def add(self, part: Chunk) -> None:
        self._parts.append(part)

    def reasons(self) -> dict[int, str]:
        return dict(sorted(item for part in self._parts for item in part.failed.items()))

    def tables(self) -> Iterator[pa.Table]:
        for part in sorted(self._parts, key=lambda part: part.start):
            yield self._table(part)

    def histories(self) -> xr.Dataset | None:
        return self._histories

    def keep_histories(self, data: xr.Dataset) -> None:
        self._histories = data

    def _read(self, names: Sequence[str]) -> dict[str, Array]:
        columns = self._empty(names)
        for name, column in columns.items():
            at = self.columns.index(name)
            for part in self._parts:
                factors = part.values.shape[1]
                source = part.values[:, at] if at < factors else part.rows[:, at - factors]
                column[part.start : part.stop] = source
        return columns


class FolderStore(SampleStore):
    """SampleStore in the folder of a study; `folder.written` gives one that may be added to."""

    def __init__(self, folder: Path, columns: Sequence[str], runs: int, fingerprint: str) -> None:
        super().__init__(columns, runs)
        self.folder = folder
        self._fingerprint = fingerprint
        self._files: dict[Range, tuple[Path, parquet.FileMetaData]] = {}
        self._ahead: dict[str, Array] = {}

    @classmethod
    def open(cls, folder: Path) -> FolderStore:
        """Those of a study that is done or was left. Raises ArgumentError if the folder holds none."""
        there = manifest.read(folder)
        if there is None:
            raise ArgumentError(f"{folder} holds no study: there is no {folder / manifest.MANIFEST}")
        try:
            studied = there["studied"]
            columns = [*(varied["name"] for varied in studied["varied"]), *studied["columns"]]
            parts = cls(folder, columns, studied["runs"], there["fingerprint"])
        except (LookupError, TypeError) as error:
            raise ArgumentError(f"{folder / manifest.MANIFEST}: it lacks {error}") from error
        parts.find(read_all=False)
        return parts

    def find(self, *, read_all: bool) -> None:
        """Look for parts; `read_all`: read each to its end, so that what a disk has spoilt is found now."""
        found = sorted(
            ((int(name[1]), int(name[2])), path)
            for path in parts_in(self.folder)
            if (name := NAME.fullmatch(path.name))
        )
        reached = 0
        for (start, stop), path in found:
            try:
                if not reached <= start < stop <= self.runs:
                    raise ValueError(
                        f"samples {start} to {stop - 1} are in another part, or not of this study"
                    )
                self._files[start, stop] = path, self._checked(path, (start, stop), read_all)
                reached = stop
            except DAMAGE as error:
                self.damaged[path] = str(error)

    def _checked(self, path: Path, samples: Range, read_all: bool) -> parquet.FileMetaData:
        """The metadata of a part. Raises one of DAMAGE if it is not whole, RunError if it is of another study."""
        with parquet.ParquetFile(path, page_checksum_verification=True) as file:
            kept: parquet.FileMetaData = file.metadata
            said = json.loads((kept.metadata or {})[KEY])
            if said["fingerprint"] != self._fingerprint:
                raise RunError(f"{path} is a part of another study; move it elsewhere")
            if kept.num_rows != samples[1] - samples[0] or tuple(said["samples"]) != samples:
                raise ValueError(f"it has {kept.num_rows} rows and says {said['samples']}")
            if file.schema_arrow != self._schema():
                raise ValueError("it has other columns")
            if read_all and not np.array_equal(file.read().column("sample").to_numpy(), np.arange(*samples)):
                raise ValueError("it has other samples")
        return kept

    def ranges(self) -> list[Range]:
        return sorted(self._files)

    def add(self, part: Chunk) -> None:
        samples = part.start, part.stop
        said = {"fingerprint": self._fingerprint, "samples": samples}
        table = self._table(part).replace_schema_metadata({KEY: json.dumps(said)})
        path = self.folder / SAMPLES / f"part-{part.start:09d}-{part.stop:09d}.parquet"
        with atomic_write(path, durable=True) as draft:
            # Random numbers do not compress, and dictionaries of them cost eight times the writing.
            parquet.write_table(
                table,
                draft,
                compression="NONE",
                use_dictionary=False,
                write_statistics=False,
                write_page_checksum=True,
            )
        self._files[samples] = path, parquet.read_metadata(path)
        self._ahead.clear()

    def reasons(self) -> dict[int, str]:
        told: dict[int, str] = {}
        for (start, _), column in self._of_files(["reason"]):
            texts = column["reason"]
            if texts.null_count < len(texts):
                told |= {start + i: text for i, text in enumerate(texts.to_pylist()) if text is not None}
        return told

    def _read(self, names: Sequence[str]) -> dict[str, Array]:
        columns = self._empty(names)
        for (start, stop), table in self._of_files(names):
            for name in names:
                columns[name][start:stop] = table[name].to_numpy()
        return columns

    def column(self, name: str) -> Array:
        if self._known(name) not in self._ahead:
            at = self.columns.index(name)
            self._ahead = self._read(self.columns[at : at + max(1, READ_AHEAD // max(1, self.runs))])
        return self._ahead[name].copy()

    def tables(self) -> Iterator[pa.Table]:
        for _, table in self._of_files(None):
            yield table.replace_schema_metadata(None)

    def _of_files(self, names: Sequence[str] | None) -> Iterator[tuple[Range, pa.Table]]:
        """Some columns of each part, or all."""
        for samples in self.ranges():
            path, kept = self._files[samples]
            try:
                with parquet.ParquetFile(path, metadata=kept, page_checksum_verification=True) as file:
                    table = file.read(columns=None if names is None else list(names))
            except DAMAGE as error:
                raise RunError(
                    f"{path} is damaged ({error}); resuming the study runs its samples again"
                ) from error
            yield samples, table

    def histories(self) -> xr.Dataset | None:
        import xarray as xr

        path = self.folder / HISTORIES
        try:
            return xr.load_dataset(path, engine="h5netcdf") if path.exists() else None
        except (OSError, ValueError, KeyError):  # damaged: they are computed again when the study is resumed
            return None

    def keep_histories(self, data: xr.Dataset) -> None:
        with atomic_write(self.folder / HISTORIES, durable=True) as draft:
            draft.write_bytes(_netcdf(data))


def _netcdf(data: xr.Dataset) -> memoryview:
    """As a file, with checksums; made in memory, as HDF5 crashes the process on a disk that becomes full."""
    import h5netcdf
    from xarray.backends import H5NetCDFStore

    buffer = BytesIO()
    checked = {str(name): {"fletcher32": True} for name in data.data_vars if data[name].dtype.kind == "f"}
    with h5netcdf.File(buffer, "w") as file:
        data.dump_to_store(H5NetCDFStore(file), encoding=checked)
    return buffer.getbuffer()


def parts_in(folder: Path) -> list[Path]:
    """All files in the folder of a study that have the name of a part."""
    return sorted(path for path in (folder / SAMPLES).glob("part-*.parquet") if NAME.fullmatch(path.name))
