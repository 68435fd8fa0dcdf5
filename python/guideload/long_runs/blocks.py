"""The motion of a long record in blocks, from a Parquet file of which only a block at a time is in memory.

A block is read and smoothed together with MARGIN rows on either side, and these are cut off again: so each sample is
smoothed with the samples around it, wherever a block ends.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from guideload.base.arguments import checked
from guideload.base.arrays import Array, errors_name
from guideload.base.errors import ArgumentError, TraceError, no_file
from guideload.motion.motion import HISTORIES, Motion
from guideload.smoothing.smoothing import Method
from guideload.traces.content.columns import find_columns
from guideload.traces.content.samples import time_stamps
from guideload.traces.format.sources import damage_named, table_of_frame
from guideload.traces.reading import motion_from_trace, read_trace

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from guideload.machine.drive import Drive
    from guideload.traces.format.table import Table
    from guideload.traces.options import ReadingOptions

ROWS = 1 << 16  # of a block: its motion and its loads take some 100 MB
MARGIN = 1 << 12  # rows: far more than any smoothing spans


@checked
def motion_blocks(
    file: str | PathLike[str],
    drive: Drive | None = None,
    *,
    rows: int = ROWS,
    smoothing: Method = "auto",
    window: float | None = None,
    **options: Unpack[ReadingOptions],
) -> Iterator[Motion]:
    """The motion of a record in blocks, for `LongRun.add`; each begins with the last stamp of the block before.

    The motions have no positions: on straight rails loads do not depend on them. If `quantum` is not given, it is
    detected in the first block that shows one, and kept.

    Parameters
    ----------
    file
        Parquet; its columns as for `read_trace`.
    drive, smoothing, window, options
        As for `read_trace` and `motion_from_trace`.
    rows
        Samples of a block, at least 8192.

    Raises
    ------
    TraceError
        For rows that cannot be used, which it names, and for a file that is missing or cannot be read.
    ArgumentError
        For another kind of file, for fewer rows, and for clock="uniform", which fits one grid to the whole record.
    """
    path = Path(file)
    if path.suffix.lower() != ".parquet":
        raise ArgumentError(
            f"{path}: a record is read in blocks from a Parquet file (.parquet) only; convert it with "
            f"pandas.read_csv({path.name!r}).to_parquet({path.with_suffix('.parquet').name!r}), or read it whole with "
            "read_trace (guideload run)"
        )
    if options.get("clock") == "uniform":
        raise ArgumentError(
            'clock: "uniform" fits one even grid to the whole record, which is not in memory; leave it out'
        )
    if rows < 2 * MARGIN:
        raise ArgumentError(f"rows: expected at least {2 * MARGIN} per block, got {rows}")
    return _blocks(path, drive, rows, {"smoothing": smoothing, "window": window}, options)


def _blocks(
    path: Path, drive: Drive | None, rows: int, smoothing: dict[str, Any], options: ReadingOptions
) -> Iterator[Motion]:
    given: ReadingOptions = {**options}
    shift, before, last = 0.0, np.empty(0), None
    for table, own in _tables(path, rows):
        with errors_name(path.name):
            columns = find_columns(table, given)
            given["column"] = columns.measured
            if columns.time is not None:
                given["time"] = columns.time
            stamps = time_stamps(table, columns.time, given, len(table.numbers)).time
        trace = read_trace(table, **given)
        if trace.quantum and given.get("quantum") is None:
            given["quantum"] = trace.quantum
        motion = motion_from_trace(trace, drive, **smoothing)
        shift += _shift(table, before, stamps)
        before = stamps[own.stop - MARGIN if own.stop > MARGIN else 0 :]
        if trace.time[-1] not in stamps:
            raise TraceError(
                f"{path.name}: the clock was set back within {table.rows(range(len(table.numbers)))}; a run in blocks "
                "cannot move all later rows: cut the record there, or put its time stamps right"
            )
        ends = _first_used(stamps, trace.time, own.start), _first_used(stamps, trace.time, own.stop)
        block = _between(motion, ends, shift, last)
        if block is not None:
            last = block
            yield block


def _first_used(stamps: Array, used: Array, row: int) -> float:
    """The first stamp [s] from a row on that the trace has used; inf if repairs have left out all of them."""
    kept = stamps[row:][np.isin(stamps[row:], used)]
    return float(kept[0]) if kept.size else np.inf


def _shift(table: Table, before: Array, stamps: Array) -> float:
    """Difference [s] between the time stamps of the same rows in two tables: each may count from its first row."""
    common = min(before.size, stamps.size)
    differences = before[:common] - stamps[:common]
    known = np.flatnonzero(np.isfinite(differences))
    if not common:
        return 0.0
    if not known.size:
        raise TraceError(f"{table.source}: {table.rows(range(common))}: expected time stamps, got none")
    return float(differences[known[0]])


def _between(motion: Motion, ends: tuple[float, float], shift: float, last: Motion | None) -> Motion | None:
    """The part of a motion from the first of `ends` [s] to before the second, its time moved by `shift`.

    last: the block before; its last sample becomes the first one. None if there is no stamp between the ends.
    """
    inside = np.flatnonzero((motion.time >= ends[0]) & (motion.time < ends[1]))
    time = motion.time[inside] + shift
    if last is not None:
        inside, time = inside[time > last.time[-1]], time[time > last.time[-1]]
    if inside.size < 2 - (last is not None):
        return None
    known = [name for name in HISTORIES if name != "position" and getattr(motion, name) is not None]
    histories = {"time": time} | {name: getattr(motion, name)[inside] for name in known}
    if last is not None:
        for name, values in histories.items():
            histories[name] = np.concatenate([getattr(last, name)[-1:], values])
    return replace(motion, **histories, uncertainty=None, position=None, samples=None, origin=None)


def _tables(path: Path, rows: int) -> Iterator[tuple[Table, range]]:
    """The tables of the blocks with their margins, and the rows of the block itself in its table."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    if not path.is_file():
        raise TraceError(f"{path}: {no_file(path)}")
    with damage_named(path, "Parquet"), pq.ParquetFile(path, pre_buffer=False) as file:
        count = file.metadata.num_rows
        bounds = np.linspace(0, count, max(1, round(count / rows)) + 1).astype(int).tolist()
        batches = file.iter_batches(batch_size=rows, use_threads=False)
        held, first = file.schema_arrow.empty_table(), 0
        for start, stop in pairwise(bounds):
            needed = min(count, stop + MARGIN) - first
            while held.num_rows < needed:
                held = pa.concat_tables([held, pa.Table.from_batches([next(batches)])])
            frame = held.slice(0, needed).to_pandas()
            yield table_of_frame(frame, path.name, "row", first + 1), range(start - first, stop - first)
            after = max(0, stop - MARGIN)
            held, first = held.slice(after - first), after
