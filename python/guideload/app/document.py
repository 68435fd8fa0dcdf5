"""A machine or motion file as text in which single values change; comments and layout of the user stay."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError
from tomlkit.items import AoT

import guideload

Path = tuple[str | int, ...]  # keys and indices that lead to a value: ("carriages", 2, "x")


_documents: dict[str, tomlkit.TOMLDocument] = {}  # the last two texts as parsed, which takes 20 ms


def _parsed(text: str) -> tomlkit.TOMLDocument:
    """The document of a text, which must not be changed. Raises GuideloadError for text that is no TOML."""
    if text not in _documents:
        try:
            _remember(text, tomlkit.parse(text))
        except TOMLKitError as error:
            raise guideload.GuideloadError(f"expected TOML ({error})") from None
    return _documents[text]


def _remember(text: str, document: tomlkit.TOMLDocument) -> None:
    while len(_documents) > 1:
        del _documents[next(iter(_documents))]
    _documents[text] = document


def _changeable(text: str) -> tomlkit.TOMLDocument:
    """The document of a text, which is forgotten, so that it can be changed."""
    document = _parsed(text)
    del _documents[text]
    return document


def _written(document: tomlkit.TOMLDocument) -> str:
    text = tomlkit.dumps(document)
    _remember(text, document)
    return text


def values(text: str) -> dict[str, Any]:
    """The values of a file. Raises GuideloadError for text that is no TOML."""
    return dict(_parsed(text).unwrap())


def value_at(text: str, path: Path) -> Any:
    """The value at a path; None if there is none."""
    node: Any = _parsed(text)
    for key in path:
        try:
            node = node[key]
        except (KeyError, IndexError, TypeError):
            return None
    return node.unwrap() if hasattr(node, "unwrap") else node


def with_values(text: str, changes: Mapping[Path, Any]) -> str:
    """The text with other values; None removes a key. Tables that are missing are added."""
    document = _changeable(text)
    for path, value in changes.items():
        node: Any = document
        for key in path[:-1]:
            if isinstance(node, dict) and key not in node:
                node[key] = tomlkit.table()
            node = node[key]
        if value is not None:
            _put(node, path[-1], value)
        elif path[-1] in node:
            del node[path[-1]]
    return _written(document)


def _put(node: Any, key: str | int, value: Any) -> None:
    """Set a value; of a list as long as before only what differs, so that the comments in it stay."""
    old = node.get(key) if isinstance(node, dict) else node[key]
    if isinstance(value, list) and isinstance(old, list) and len(old) == len(value):
        for i, one in enumerate(value):
            if old[i] != one:
                _put(old, i, one)
    else:
        node[key] = value


def with_entry(text: str, key: str, entry: Mapping[str, Any]) -> str:
    """The text with one more table [[key]]."""
    document = _changeable(text)
    table = tomlkit.table()
    table.update(entry)
    if key in document and not isinstance(document[key], AoT):
        raise guideload.GuideloadError(f"{key}: write it as [[{key}]] tables, so that the page can add one")
    if key not in document:
        document[key] = tomlkit.aot()
    document[key].append(table)
    return _written(document)


def without_entry(text: str, key: str, index: int) -> str:
    """The text without one of the tables [[key]]."""
    document = _changeable(text)
    entries: Any = document[key]
    del entries[index]
    if not entries:
        del document[key]
    return _written(document)


def typed(written: str, schema: Mapping[str, Any]) -> Any:
    """The value of what was typed into the field of a key: "600 mm" is text, ["1 mm", 0] a list; "" is None.

    schema: of the key. A number without unit gets that of the schema, so that the field shows how it is understood:
    700 becomes "700 m". A key that takes text, as a name does, may look like a number.
    """
    written = written.strip()
    if not written or schema.get("type") == "string":
        return written or None
    try:
        value = tomlkit.parse(f"value = {written}")["value"]
    except TOMLKitError:
        return written
    return _with_unit(value.unwrap() if hasattr(value, "unwrap") else value, schema)


def _with_unit(value: Any, schema: Mapping[str, Any]) -> Any:
    if isinstance(value, list):
        schemas = [*schema.get("prefixItems", ()), *[schema.get("items", {})] * len(value)]
        return [_with_unit(one, of) for one, of in zip(value, schemas, strict=False)]
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    unit = unit_of(schema)
    return f"{value} {unit}" if is_number and unit != "1" else value


def unit_of(schema: Mapping[str, Any]) -> str:
    """The SI unit of a key, whose value may be a list; "1" if it has none, or several as a curve does."""
    parts = (*schema.get("anyOf", ()), *schema.get("prefixItems", ()), schema.get("items", {}))
    units = {schema.get("x-unit", "1"), *map(unit_of, parts if schema else ())} - {"1"}
    return units.pop() if len(units) == 1 else "1"


def shown(value: Any) -> str:
    """A value as it is typed into a field, from which `typed` makes it again."""
    if value is None:
        return ""
    return value if isinstance(value, str) else tomlkit.item(value).as_string()
