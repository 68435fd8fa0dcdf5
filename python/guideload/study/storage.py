"""Storage of samples: in memory, or in a folder with a Parquet file per chunk, written atomically.

A folder is created, resumed or removed without touching other studies or files.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet

from guideload.base.arrays import Array
from guideload.base.atomic import (
    DRAFT,
    LOCK,
    atomic_write,
    draft_folder,
    draft_path,
    exclusive_lock,
    is_draft,
)
from guideload.base.errors import ArgumentError, RunError
from guideload.base.finite import finite_json
from guideload.base.netcdf import read_netcdf, write_netcdf
from guideload.base.quantities import Quantities
from guideload.study.metadata import FILE, StudyMetadata, read_json

if TYPE_CHECKING:
    import xarray as xr

Range = tuple[int, int]  # start, stop: samples start to stop - 1

SAMPLES = "samples"  # the folder of the chunks, beside the metadata
HISTORIES = "histories.nc"
NAME = re.compile(r"(?:chunk|part)-(\d{9,})-(\d{9,})\.parquet")  # part: of guideload 0.1.0
KEY = b"guideload"  # of the metadata in a chunk
READ_AHEAD = 2**23  # numbers that are read at once: a requested column and the columns after it
# Errors of pyarrow and Python when a damaged chunk is read.
DAMAGE = (pa.ArrowException, OSError, ValueError, KeyError)


@dataclass(frozen=True, eq=False)
class Chunk:
    """Samples start, start + 1, ... with their results.

    values (n, factors); rows (n, measures), NaN where a sample failed; failed: sample -> reason.
    """

    start: int
    values: Array
    rows: Array
    failed: Mapping[int, str]

    @property
    def stop(self) -> int:
        return self.start + len(self.values)


class SampleStore:
    """The samples of a study by column, in memory; NaN if a sample failed or has not been run.

    columns   the names of all columns: parameters, then measures
    runs      samples of the whole study
    damaged   reasons by file, for files that are no complete chunk of the study
    """

    def __init__(self, metadata: StudyMetadata) -> None:
        self.metadata, self.runs = metadata, metadata.runs
        self.columns = (*(parameter.name for parameter in metadata.parameters), *metadata.columns)
        self.damaged: dict[Path, str] = {}
        self._stored: dict[Range, Any] = {}  # by samples: the table of a chunk, or its file
        self._ahead: dict[str, Array] = {}  # columns that were read together
        self._histories: xr.Dataset | None = None

    def ranges(self) -> list[Range]:
        """Ranges of finished samples, ascending, without overlap."""
        return sorted(self._stored)

    def add(self, chunk: Chunk) -> None:
        """Store a chunk of new samples, completely or not at all. Raises RunError."""
        numbers = np.vstack([chunk.values.T, chunk.rows.T])  # a contiguous row per column of the table
        samples = np.arange(chunk.start, chunk.stop)
        reasons = pa.array([chunk.failed.get(sample) for sample in samples.tolist()], pa.string())
        table = pa.table([samples, *numbers, reasons], schema=self._schema())
        self._stored[chunk.start, chunk.stop] = self._save(table, (chunk.start, chunk.stop))
        self._ahead.clear()

    def describe(self, metadata: StudyMetadata) -> None:
        """Store the metadata with what was found when all samples were done. Raises RunError."""
        self.metadata = metadata

    def histories(self) -> xr.Dataset | None:
        """The stored histories."""
        return self._histories

    def add_histories(self, data: Quantities) -> None:
        """Store histories; they replace earlier ones. Raises RunError."""
        self._histories = data.dataset()

    def _save(self, table: pa.Table, samples: Range) -> Any:
        """Save the table of these samples; returns the entry of `_stored` that `_load` reads."""
        return table

    def _load(self, samples: Range, names: Sequence[str] | None = None) -> pa.Table:
        """Some columns of a chunk, or all."""
        return self._stored[samples]

    @property
    def done(self) -> int:
        """Number of finished samples, failed ones included."""
        return sum(stop - start for start, stop in self.ranges())

    def missing(self, chunk: int) -> Iterator[Range]:
        """Ranges of samples that are not finished, split at multiples of `chunk`."""
        reached = 0
        for start, stop in [*self.ranges(), (self.runs, self.runs)]:
            while reached < start:
                end = min(start, (reached // chunk + 1) * chunk)
                yield reached, end
                reached = end
            reached = stop

    def column(self, name: str) -> Array:
        """(runs,) one parameter or measure of all samples. Raises ArgumentError for an unknown name."""
        if name not in self.columns:
            near = get_close_matches(name, self.columns) or self.columns
            raise ArgumentError(f"column: expected one of {', '.join(near)}, got {name!r}")
        if name not in self._ahead:
            at = self.columns.index(name)
            names = self.columns[at : at + max(1, READ_AHEAD // max(1, self.runs))]
            columns = {one: np.full(self.runs, np.nan) for one in names}
            for start, stop in self.ranges():
                table = self._load((start, stop), names)
                for one, column in columns.items():
                    column[start:stop] = table[one].to_numpy()
            self._ahead = columns
        return self._ahead[name].copy()

    def reasons(self) -> dict[int, str]:
        """Reasons of failed samples, by index."""
        return {
            samples[0] + i: reasons[i].as_py()
            for samples in self.ranges()
            for reasons in [self._load(samples, ["reason"])["reason"]]
            for i in np.flatnonzero(reasons.is_valid()).tolist()
        }

    def tables(self) -> Iterator[pa.Table]:
        """All chunks, ascending: sample, parameters, measures, reason (null for a sample with a result)."""
        return (self._load(samples).replace_schema_metadata(None) for samples in self.ranges())

    def _schema(self) -> pa.Schema:
        numbers = [pa.field(name, pa.float64(), nullable=False) for name in self.columns]
        return pa.schema(
            [pa.field("sample", pa.int64(), nullable=False), *numbers, pa.field("reason", pa.string())]
        )


class FolderStore(SampleStore):
    """Samples in the folder of a study; only a store of `folder.open_store` may be written.

    read_all: read all bytes of each chunk, to find damage by the disk at once.
    scan: look for the chunks that are there.
    """

    def __init__(
        self, folder: Path, metadata: StudyMetadata, *, read_all: bool = False, scan: bool = True
    ) -> None:
        super().__init__(metadata)
        self.folder, reached = folder, 0
        for (start, stop), path in sorted((_range(path), path) for path in chunks_in(folder) if scan):
            try:
                if not reached <= start < stop <= self.runs:
                    raise ValueError(f"samples {start} to {stop - 1} are in another chunk or study")
                self._stored[start, stop] = path, self._checked(path, (start, stop), read_all)
                reached = stop
            except DAMAGE as error:
                self.damaged[path] = str(error)

    @classmethod
    def open(cls, folder: Path) -> FolderStore:
        """The store of a finished or interrupted study. Raises ReadError if the folder holds none."""
        return cls(folder, StudyMetadata.read(folder))

    def _checked(self, path: Path, samples: Range, read_all: bool) -> parquet.FileMetaData:
        """The metadata of a chunk. Raises one of DAMAGE if it is damaged, RunError if it is of another study."""
        with parquet.ParquetFile(path, page_checksum_verification=True) as file:
            of_file: parquet.FileMetaData = file.metadata
            identity = json.loads((of_file.metadata or {})[KEY])
            if identity["fingerprint"] != self.metadata.fingerprint:
                raise RunError(f"{path} is a chunk of another study; move it elsewhere")
            if of_file.num_rows != samples[1] - samples[0] or tuple(identity["samples"]) != samples:
                raise ValueError(
                    f"it has {of_file.num_rows} rows, but metadata for samples {identity['samples']}"
                )
            if file.schema_arrow != self._schema():
                raise ValueError("it has other columns")
            if read_all and not np.array_equal(file.read().column("sample").to_numpy(), np.arange(*samples)):
                raise ValueError("it has other samples")
        return of_file

    def _save(self, table: pa.Table, samples: Range) -> Any:
        identity = {"fingerprint": self.metadata.fingerprint, "samples": samples}
        table = table.replace_schema_metadata({KEY: finite_json(identity)})
        path = self._path(samples)
        # Random numbers do not compress, and dictionaries of them take eight times as long to write.
        plain = {"compression": "NONE", "use_dictionary": False, "write_statistics": False}
        with atomic_write(path, durable=True) as draft:
            parquet.write_table(table, draft, write_page_checksum=True, **plain)
        return path, parquet.read_metadata(path)

    def _path(self, samples: Range) -> Path:
        return self.folder / SAMPLES / "chunk-{:09d}-{:09d}.parquet".format(*samples)

    def adopt(self, samples: Range) -> None:
        """Take over a chunk that another process has written. Raises RunError if it cannot be read here."""
        path = self._path(samples)
        try:
            self._stored[samples] = path, self._checked(path, samples, False)
        except DAMAGE as error:
            raise RunError(f"{path}: a worker wrote it, but it cannot be read here: {error}") from error
        self._ahead.clear()

    def _load(self, samples: Range, names: Sequence[str] | None = None) -> pa.Table:
        path, metadata = self._stored[samples]
        try:
            with parquet.ParquetFile(path, metadata=metadata, page_checksum_verification=True) as file:
                return file.read(columns=names and list(names))
        except DAMAGE as error:
            hint = "resuming the study runs its samples again"
            raise RunError(f"{path} is damaged ({error}); {hint}") from error

    def describe(self, metadata: StudyMetadata) -> None:
        metadata.write(self.folder)
        super().describe(metadata)

    def histories(self) -> xr.Dataset | None:
        try:
            return read_netcdf(self.folder / HISTORIES)
        except (OSError, ValueError, KeyError, RuntimeError):
            return None  # missing, or damaged: then they are computed again when the study is resumed

    def add_histories(self, data: Quantities) -> None:
        with atomic_write(self.folder / HISTORIES, durable=True) as draft:
            write_netcdf(data, draft)


def chunks_in(folder: Path) -> list[Path]:
    """All files in the folder of a study with the name of a chunk."""
    return sorted(path for path in (folder / SAMPLES).glob("*.parquet") if NAME.fullmatch(path.name))


def _range(path: Path) -> Range:
    start, stop = map(int, re.findall(r"\d+", path.name))
    return start, stop


# ---- the folder of a study


@contextmanager
def open_store(metadata: StudyMetadata, folder: Path | None, resume: bool) -> Iterator[SampleStore]:
    """A writable store of a study: in memory, or in a folder that is locked against other processes.

    A folder with a study is refused unless `resume` is true and the study is the same: then all bytes of its chunks are
    checked, and damaged chunks are removed, so that they are run again.
    """
    if folder is None:
        yield SampleStore(metadata)
        return
    _require_ours(folder, metadata, resume)
    with ExitStack() as held:
        try:
            (folder / SAMPLES).mkdir(parents=True, exist_ok=True)
            held.enter_context(exclusive_lock(folder / SAMPLES))
            _require_ours(folder, metadata, resume)  # another process may have started a study meanwhile
            store = FolderStore(folder, metadata, read_all=True)
            _remove_drafts(folder)
            for path in store.damaged:
                path.unlink(missing_ok=True)
            metadata.write(folder)  # also on resuming: runs, limits and life may have changed
        except OSError as error:
            reason = error.strerror or error
            raise RunError(f"{error.filename or folder}: cannot be written: {reason}") from error
        yield store


def _require_ours(folder: Path, metadata: StudyMetadata, resume: bool) -> None:
    there = read_json(folder)
    if there is not None and resume:
        metadata.require_resumable(folder)
    elif there is not None:
        raise ArgumentError(f"{folder} holds a study ({folder / FILE}): resume it, or give another folder")
    elif not resume and (others := [*chunks_in(folder), *folder.glob(HISTORIES)]):
        raise ArgumentError(f"{others[0]} is not of this study; give another folder")


def _remove_drafts(folder: Path) -> None:
    """Remove the drafts that a killed writer may have left.

    A draft of a chunk may also be held by a worker of an interrupted run, which ends its chunk; it stays.
    """
    for draft in (draft_path(folder / name) for name in (FILE, HISTORIES)):
        _remove_draft(draft, folder)
    for draft in (folder / SAMPLES).glob(f".chunk-*.parquet{DRAFT}"):
        with suppress(RunError):
            _remove_draft(draft, folder)


def _remove_draft(draft: Path, folder: Path) -> None:
    if draft.is_dir() and is_draft(draft):
        with draft_folder(draft, folder):
            pass


def begun_only(folder: Path) -> bool:
    """Whether a folder holds only a study that ended before its metadata was written."""
    names = {path.name for path in folder.iterdir()} if folder.is_dir() else set()
    return names <= {SAMPLES, DRAFT, draft_path(folder / FILE).name} and not chunks_in(folder)


def study_files(folder: Path) -> list[Path]:
    """The paths of the files of a study, the metadata last; some may not exist."""
    return [*chunks_in(folder), folder / HISTORIES, folder / FILE]


def remove(folder: Path) -> None:
    """Remove the files of the study in a folder, the metadata last; all other files stay.

    Raises ArgumentError if guideload did not write the metadata, RunError if another process is writing the study.
    """
    if read_json(folder) is None:
        return
    samples = folder / SAMPLES
    samples.mkdir(exist_ok=True)
    with exclusive_lock(samples):
        _remove_drafts(folder)
        for path in study_files(folder):
            path.unlink(missing_ok=True)
    (samples / LOCK).unlink(missing_ok=True)
    if not any(samples.iterdir()):
        samples.rmdir()
