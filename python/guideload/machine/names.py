"""Names in the unchecked values of a machine: unique ones, and rails, types and products that others name."""

from __future__ import annotations

from collections.abc import Iterator
from difflib import get_close_matches
from typing import Any

from guideload.base.errors import MOST_PROBLEMS, KeyPath, ValueRefused, shown
from guideload.machine.carriage_types import type_problems
from guideload.machine.links import NAMES
from guideload.machine.products import product_problems


def name_conflicts(values: Any) -> Iterator[tuple[KeyPath, ValueRefused]]:
    """Problems of unchecked values: duplicate names, unknown rails, neither carriages nor links."""
    if not isinstance(values, dict):
        return
    yield from type_problems(values)
    yield from product_problems(values)
    keys = ("rails", "carriages", "links", "riders", "points", "payloads")
    parts = {key: _names(values, key, "name") for key in keys}
    if not values.get("carriages") and not values.get("links"):
        yield ("carriages",), ValueRefused("at least one [[carriages]] or [[links]] table", [])
    known = {name for _, name in parts["rails"]}
    expected = f"a rail's name ({shown(sorted(known))})"
    unknown = ((i, rail) for i, rail in _names(values, "carriages", "rail") if rail not in known)
    for number, (i, rail) in enumerate(unknown):
        near = get_close_matches(rail, sorted(known), n=1) if number < MOST_PROBLEMS else []
        hint = f'did you mean "{near[0]}"?' if near else "add a [[rails]] table with that name"
        yield ("carriages", i, "rail"), ValueRefused(expected, rail, hint)
    for key, named in parts.items():
        first: dict[str, int] = {}
        for i, name in named:
            if first.setdefault(name, i) < i:
                yield (
                    (key, i, "name"),
                    ValueRefused("a unique name", name, f"{key}[{first[name]}] has it already"),
                )
    taken = {f"{name}:{end}" for _, name in parts["carriages"] for end in NAMES}
    for i, name in parts["links"]:
        if name in taken:
            yield (
                ("links", i, "name"),
                ValueRefused("a unique name", name, "a link of a carriage has it already"),
            )


def _names(values: dict[str, Any], key: str, name: str) -> list[tuple[int, str]]:
    """(index, text) of the key `name` of each entry of `values[key]`; entries without this text are left out."""
    tables = values.get(key, ())
    if not isinstance(tables, list | tuple):
        return []
    texts = [table.get(name) if isinstance(table, dict) else getattr(table, name, None) for table in tables]
    return [(i, text) for i, text in enumerate(texts) if isinstance(text, str)]
