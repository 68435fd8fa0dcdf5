"""The folder of a watch: Parquet files of samples and loads by the hour, and the record from which it goes on.

The hour in progress is a journal, to which every batch of samples is appended as soon as the monitor has taken it; a
journal that is complete, or that a killed process has left, becomes a Parquet file. The record is written after the
journal is on the disk, so the journal has all samples that the record has: those that only the journal has are pushed
again, after the samples before them, from which the monitor finds its state.
"""

from __future__ import annotations

import base64
import json
import os
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from datetime import datetime, timezone
from itertools import chain
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from guideload.base.arrays import Array, Integers
from guideload.base.atomic import atomic_write
from guideload.base.errors import ArgumentError, WriteError
from guideload.base.finite import finite_json
from guideload.monitor.monitor import Monitor

RECORD = "_record.json"  # readers of a folder of Parquet files leave out names that begin with _ or .
FORMAT = 1
COMPONENTS = ("Fy_N", "Fz_N", "Mx_Nm", "My_Nm", "Mz_Nm")
RESULTS = ("used", "early", "suspect", "bridged", "counter set", "restarted")
ROWS = 2**16  # that are converted, or pushed again, at once
PUSHED = ("sample", "stamp", "count")
FILES = 4  # Parquet files in which the samples before a kill are looked for
WARM_UP = 8  # times that the loads settle to 1 % before samples are pushed again: to 1e-16, the rounding of their state

Pushed = tuple[NDArray[np.uint32], Integers, Array]  # of `Monitor.push`


class Store:
    """The folder of a watch, which no other process may use meanwhile.

    kept   whether samples and loads are kept, or the record alone
    place  in the input at which the record was written, empty at the first run; `ahead` in it: number of the samples
           after it that the monitor has already
    since  number of the first sample that the monitor has taken since it was at rest
    """

    def __init__(
        self, folder: Path, monitor: Monitor, kept: bool = True, clock: Callable[[], float] = time.time
    ) -> None:
        self.folder, self.monitor, self.kept, self.clock = folder, monitor, kept, clock
        self.row = _row(monitor.carriages)
        self.place: dict[str, Any] = {}
        self.number = self.since = 0
        self._journal: tuple[Path, IO[bytes]] | None = None
        self._worker = ThreadPoolExecutor(1)
        self._conversion: Future[None] | None = None
        self._restore()

    @property
    def samples(self) -> int:
        """Number of the samples that the monitor has taken in all runs."""
        return int(self.monitor.totals()["samples"])

    def _restore(self) -> None:
        """Go on with the record, and with the samples that came after it."""
        self._read_record()
        journals = _by_sample(self.folder.glob("_*.journal"))
        if not self._replay(journals):
            self.since = self.samples
        self.save(self.place)
        for journal in journals:
            self._convert(journal)

    def _read_record(self) -> None:
        """Give the monitor the totals of the record."""
        if (self.folder / RECORD).exists():
            try:
                values = json.loads((self.folder / RECORD).read_text(encoding="utf-8"))
                if values["format"] != FORMAT:
                    raise ValueError(f"format {values['format']}, expected {FORMAT}")
                self.number = self.monitor.restore(base64.b64decode(values["monitor"]), b"")
                self.place, self.since = values["place"], int(values.get("since", 0))
            except (OSError, ValueError, KeyError, TypeError) as error:
                raise ArgumentError(
                    f"{self.folder / RECORD}: cannot be used: {error}. Give another folder to begin anew"
                ) from None

    def _replay(self, journals: list[Path]) -> bool:
        """Push the samples of journals that the record lacks, after those before them, in which the monitor settles.

        False if there are none.
        """
        constants, known = self.monitor.constants(), self.samples
        before = WARM_UP * int(constants["settling"]) + int(constants["tap_count"])
        first = max(self.since, known - before)
        pieces = (rows[rows["sample"] >= first] for journal in journals for rows in _rows(journal))
        found = [_as_pushed(rows) for rows in pieces if rows.size]
        if not found or found[-1][0, -1] < known:
            return False
        number, stamps, counts = np.concatenate(
            [*self._kept(first, min(known, found[0][0, 0])), *found], axis=1
        )
        new = int(np.searchsorted(number, known))
        self._push(stamps[:new], counts[:new])
        self._read_record()  # its totals have those samples
        self._push(stamps[new:], counts[new:])
        self.place["ahead"] = self.place.get("ahead", 0) + number.size - new
        return True

    def _push(self, stamps: Integers, counts: Integers) -> None:
        for start in range(0, stamps.size, ROWS):
            self.monitor.push(stamps[start : start + ROWS], counts[start : start + ROWS])

    def _kept(self, first: int, end: int) -> list[Integers]:
        """The samples from `first` to before `end` that are in the last Parquet files."""
        from pyarrow import parquet

        found: list[Integers] = []
        for path in _by_sample(self.folder.glob("????-??-??T??-*.parquet"))[-FILES:]:
            wanted = [("sample", ">=", first), ("sample", "<", end)]
            with suppress(OSError, ValueError):  # a damaged file: the others must do
                found.append(_as_pushed(parquet.read_table(path, columns=list(PUSHED), filters=wanted)))
        return found

    def append(self, stamps: Integers, counts: Integers, pushed: Pushed) -> None:
        """Keep samples that the monitor has just taken."""
        if not self.kept:
            return
        taken, periods, loads = pushed
        now = self.clock()
        rows = np.zeros(stamps.size, self.row)
        first = self.samples - stamps.size
        rows["sample"] = np.arange(first, self.samples)
        rows["received"] = round(1e3 * now)
        rows["stamp"], rows["count"], rows["result"], rows["period"] = stamps, counts, taken, periods
        rows["loads"] = loads
        path = (
            self.folder / f"_{_hour(now)}-{first:012d}.journal" if self._journal is None else self._journal[0]
        )
        try:
            if self._journal is None:
                self._journal = path, path.open("ab", buffering=0)
                _write_all(self._journal[1], _heading(self.monitor))
            _write_all(self._journal[1], rows.tobytes())
        except OSError as error:
            raise WriteError(error.errno, error.strerror, str(path)) from error

    def end_hour(self, place: dict[str, Any]) -> None:
        """Turn the journal of an hour that is over into a Parquet file, in a thread: samples come in meanwhile."""
        if self._conversion is not None and self._conversion.done():
            self._finish()
        if self._journal is not None and f"_{_hour(self.clock())}-" not in self._journal[0].name:
            self.save(place)
            self._convert_journal()

    def save(self, place: dict[str, Any]) -> None:
        """Write the record; place: of the input, behind the last sample that the monitor has taken."""
        if self._journal is not None:
            os.fsync(self._journal[1].fileno())
        self.number, self.place = self.number + 1, place
        record = base64.b64encode(self.monitor.save(self.number)).decode("ascii")
        with atomic_write(self.folder / RECORD, durable=True) as draft:
            draft.write_text(
                finite_json({"format": FORMAT, "monitor": record, "place": place, "since": self.since})
            )

    def close(self, place: dict[str, Any]) -> None:
        """Write the record and the Parquet file of the hour so far."""
        self.save(place)
        self._convert_journal()
        self._finish()
        self._worker.shutdown()

    def _convert_journal(self) -> None:
        """Begin to turn the journal into a Parquet file."""
        if self._journal is not None:
            self._finish()
            path, file = self._journal
            file.close()
            self._journal, self._conversion = None, self._worker.submit(self._convert, path)

    def _finish(self) -> None:
        """Wait for the Parquet file that is being written, and raise the error that ended it."""
        conversion, self._conversion = self._conversion, None
        if conversion is not None:
            conversion.result()

    def _convert(self, journal: Path) -> None:
        """Write a Parquet file from a journal, then remove the journal; after a kill it can be called again."""
        import pyarrow as pa
        from pyarrow import parquet

        described = _described(journal)
        tables = (pa.table(_columns(rows, described["carriages"])) for rows in _rows(journal))
        first = next(tables, None)
        if first is not None:  # else the process was killed before the first sample
            schema = first.schema.with_metadata({b"guideload": finite_json(described)})
            target = self.folder / f"{journal.stem.removeprefix('_')}.parquet"
            with (
                atomic_write(target, durable=True) as draft,
                parquet.ParquetWriter(draft, schema, compression="zstd", write_page_checksum=True) as writer,
            ):
                for table in chain((first,), tables):
                    writer.write_table(table.cast(schema))
        journal.unlink()


def _by_sample(paths: Iterable[Path]) -> list[Path]:
    """Files in the order of their first sample, which ends their names: the clock of their hours may be set back."""
    return sorted(paths, key=lambda path: path.stem.rpartition("-")[2])


def _hour(now: float) -> str:
    """The hour of an instant, UTC."""
    return datetime.fromtimestamp(now, timezone.utc).strftime("%Y-%m-%dT%H")


def _row(carriages: list[str]) -> np.dtype[Any]:
    """A row of a journal."""
    return np.dtype(
        [
            ("sample", "<i8"),
            ("received", "<i8"),  # ms since 1970, UTC
            ("stamp", "<i8"),
            ("count", "<i8"),
            ("result", "u1"),
            ("period", "<i8"),
            ("loads", "<f4", (len(carriages), len(COMPONENTS))),
        ]
    )


def _heading(monitor: Monitor) -> bytes:
    """The first line of a journal."""
    settings = monitor.settings
    described = {
        "machine": monitor.machine.name,
        "carriages": monitor.carriages,
        "period_s": settings.period,
        "travel_per_count_m": settings.travel_per_count,
        "lag": settings.lag,
    }
    return finite_json(described).encode("ascii") + b"\n"


def _described(journal: Path) -> dict[str, Any]:
    """The first line of a journal; no carriages if the process was killed while it wrote this line."""
    with journal.open("rb") as file:
        line = file.readline()
    return dict(json.loads(line)) if line.endswith(b"\n") else {"carriages": []}


def _rows(journal: Path) -> Iterator[NDArray[Any]]:
    """The complete rows of a journal, up to one whose number is not the next, as of bytes that were never written."""
    row, number = _row(_described(journal)["carriages"]), int(journal.stem.rpartition("-")[2])
    with journal.open("rb") as file:
        file.readline()
        while data := file.read(ROWS * row.itemsize):
            rows = np.frombuffer(data[: len(data) - len(data) % row.itemsize], row)
            follows = rows["sample"] == number + np.arange(rows.size)
            size = rows.size if follows.all() else int(follows.argmin())
            if size:
                yield rows[:size]
            if size < rows.size:
                return
            number += size


def _as_pushed(rows: Any) -> Integers:
    """Number, stamp and count of samples: three rows."""
    return np.stack([np.asarray(rows[name]) for name in PUSHED])


def _write_all(file: IO[bytes], data: bytes) -> None:
    """Write all bytes: a raw file may take a part of them."""
    rest = memoryview(data)
    while rest:
        rest = rest[file.write(rest) :]


def _columns(rows: NDArray[Any], carriages: list[str]) -> dict[str, Any]:
    """The columns of a Parquet file; period and loads are null before the monitor knows them."""
    import pyarrow as pa

    unknown = rows["period"] < 0
    columns: dict[str, Any] = {
        "sample": rows["sample"],
        "received": pa.array(rows["received"], pa.timestamp("ms", tz="UTC")),
        "stamp": rows["stamp"],
        "count": rows["count"],
        "result": pa.DictionaryArray.from_arrays(rows["result"].astype(np.int8), list(RESULTS)),
        "period": pa.array(rows["period"], mask=unknown),
    }
    for index, name in enumerate(carriages):
        for component, label in enumerate(COMPONENTS):
            values = np.ascontiguousarray(rows["loads"][:, index, component])
            columns[f"{label}[{name}]"] = pa.array(values, mask=unknown)
    return columns
