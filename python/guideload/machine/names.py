"""Names in the unchecked values of a machine: unique ones, and rails, types and products that others name."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from guideload.base.errors import MOST_PROBLEMS, KeyPath, ValueRefused, did_you_mean, shown
from guideload.machine.carriage_types import type_problems
from guideload.machine.links import NAMES
from guideload.machine.products import product_problems
from guideload.machine.unchecked import find_texts


def name_conflicts(values: Any) -> Iterator[tuple[KeyPath, ValueRefused]]:
    """Problems of unchecked values: duplicate names, unknown rails, neither carriages nor links."""
    if not isinstance(values, dict):
        return
    yield from type_problems(values)
    yield from product_problems(values)
    keys = ("rails", "carriages", "links", "riders", "points", "payloads")
    parts = {key: list(find_texts(values, key, "name")) for key in keys}
    if not values.get("carriages") and not values.get("links"):
        yield ("carriages",), ValueRefused("at least one [[carriages]] or [[links]] table", [])
    known = {name for _, name in parts["rails"]}
    expected = f"a rail's name ({shown(sorted(known))})"
    unknown = ((i, rail) for i, rail in find_texts(values, "carriages", "rail") if rail not in known)
    for number, (i, rail) in enumerate(unknown):
        candidates = sorted(known) if number < MOST_PROBLEMS else ()  # the others are counted only
        hint = did_you_mean(rail, candidates, "add a [[rails]] table with that name")
        yield ("carriages", i, "rail"), ValueRefused(expected, rail, hint)
    for key, named in parts.items():
        first: dict[str, int] = {}
        for i, name in named:
            if first.setdefault(name, i) < i:
                hint = f"{key}[{first[name]}] has it already"
                yield (key, i, "name"), ValueRefused("a unique name", name, hint)
    taken = {f"{name}:{end}" for _, name in parts["carriages"] for end in NAMES}
    for i, name in parts["links"]:
        if name in taken:
            hint = "a link of a carriage has it already"
            yield ("links", i, "name"), ValueRefused("a unique name", name, hint)
