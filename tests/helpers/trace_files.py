"""Trace files for tests, and questions about what was read from them."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from guideload.base.errors import TraceError
from guideload.traces.reading import Trace


def write_trace(
    folder: Path,
    columns: Mapping[str, Any],
    change: Mapping[tuple[int, str], str] | None = None,
    sep: str = ",",
) -> Path:
    """The columns as trace.csv; `change` replaces cells by (row of an editor, column)."""
    rows = [list(map(str, cells)) for cells in zip(*columns.values(), strict=True)]
    for (row, column), text in (change or {}).items():
        rows[row - 2][list(columns).index(column)] = text
    path = folder / "trace.csv"
    path.write_text("\n".join(sep.join(row) for row in [list(columns), *rows]) + "\n", encoding="utf-8")
    return path


def refuses(message: str, call: Callable[..., Any], *arguments: Any, **options: Any) -> None:
    """The call raises a TraceError whose text contains this (a regular expression)."""
    with pytest.raises(TraceError, match=message):
        call(*arguments, **options)


def has_note(trace: Trace, *parts: str) -> bool:
    """Whether one of the notes contains all of these parts."""
    return any(all(part in note for part in parts) for note in (*trace.notes, *trace.warnings))


def same(one: Trace, other: Trace) -> bool:
    """Whether both have the same time and value, to the bit."""
    return np.array_equal(one.time, other.time) and np.array_equal(one.value, other.value)
