"""Values of a machine before they are checked: anything may stand at any key."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any


def find_tables(values: Any, key: str) -> Sequence[Any]:
    """The list under a key; empty if there is none, which the field of this key reports."""
    listed = values.get(key) if isinstance(values, dict) else None
    return listed if isinstance(listed, list | tuple) else ()


def find_value(table: Any, key: str) -> Any:
    """What a table or a model has under a key; None without it."""
    return table.get(key) if isinstance(table, dict) else getattr(table, key, None)


def find_texts(values: Any, tables: str, key: str) -> Iterator[tuple[int, str]]:
    """(index, text) of each of the tables under a key of `values` that has a text under a key of its own."""
    for i, table in enumerate(find_tables(values, tables)):
        if isinstance(text := find_value(table, key), str):
            yield i, text
