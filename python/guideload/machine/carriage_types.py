"""Carriage types: tables with keys that several carriages share; keys at a carriage override those of its type."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Annotated, Any, cast

from pydantic import AfterValidator, Field, create_model, model_validator
from pydantic.fields import FieldInfo
from pydantic_core import InitErrorDetails

from guideload.base.config import ConfigModel
from guideload.base.errors import KeyPath, ValueRefused, did_you_mean, shown
from guideload.machine.components import Carriage, Name
from guideload.machine.unchecked import find_tables, find_texts

OWN_KEYS = ("name", "rail", "x", "type")  # that a type cannot have


class _Optional(ConfigModel):
    """Keys of a carriage, all of which may be left out."""

    @model_validator(mode="before")
    @classmethod
    def _given(cls, values: Any) -> Any:
        return _given(values) if isinstance(values, dict) else values


def _given(table: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in table.items() if value is not None}


def _optional(field: FieldInfo) -> Any:
    """Annotation and field of a key of a type: those of the carriage, or None."""
    checks = tuple(field.metadata)
    annotation: Any = Annotated[(field.annotation, *checks)] if checks else field.annotation
    return annotation | None, Field(default=None, description=field.description)


_FIELDS = {key: _optional(field) for key, field in Carriage.model_fields.items() if key not in OWN_KEYS}
CarriageType = cast(
    type[ConfigModel],
    create_model("CarriageType", __base__=_Optional, __doc__="Keys of all carriages of a type.", **_FIELDS),
)


class TypesByName(dict[str, ConfigModel]):
    """The types of a machine by name; hashable, as the machine is."""

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(frozenset(self.items()))


CarriageTypes = Annotated[dict[Name, CarriageType], AfterValidator(TypesByName)]  # type: ignore[valid-type]


def _tables(values: Any) -> dict[str, dict[str, Any]]:
    """The carriage types of unchecked values, by name, with the keys that they give."""
    types = values.get("carriage_types") if isinstance(values, dict) else None
    tables = types.items() if isinstance(types, dict) else ()
    plain = ((name, dict(table) if isinstance(table, ConfigModel) else table) for name, table in tables)
    return {name: _given(table) for name, table in plain if isinstance(table, dict)}


def with_types(values: Any) -> Any:
    """Unchecked values of a machine whose carriages have the keys of their types, unless they have their own."""
    types, carriages = _tables(values), find_tables(values, "carriages")
    if not types or not carriages:
        return values
    filled = [{**one, **_shared(one, types)} if isinstance(one, dict) else one for one in carriages]
    return {**values, "carriages": filled}


def _shared(carriage: dict[str, Any], types: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """The keys that a carriage takes from its type."""
    name = carriage.get("type")
    own = (*OWN_KEYS, *_given(carriage))
    shared = types.get(name, {}) if isinstance(name, str) else {}
    return {key: value for key, value in shared.items() if key not in own}


def type_problems(values: dict[str, Any]) -> Iterator[tuple[KeyPath, ValueRefused]]:
    """Problems of unchecked carriages: types that are unknown."""
    types = list(_tables(values))
    known = f", one of {', '.join(map(shown, types))}" if types else ""
    for i, name in find_texts(values, "carriages", "type"):
        if name not in types:
            hint = did_you_mean(name, types, f"add a table [carriage_types.{name}]")
            yield ("carriages", i, "type"), ValueRefused(f"a carriage type{known}", name, hint)


def at_types(problems: Iterable[InitErrorDetails], values: Any) -> list[InitErrorDetails]:
    """Problems of carriages at the key of their type, once: of a value from there, and of a key that they all lack.

    values: as the user gave them.
    """
    types, placed = _tables(values), []
    of_types = {problem["loc"][:3] for problem in problems if problem["loc"][:1] == ("carriage_types",)}
    for problem in problems:
        loc = problem["loc"]
        shared = _key_of_type(loc, values, types)
        if shared is None:
            placed.append(problem)
        elif shared[:3] not in of_types:
            of_types.add(shared[:3])
            placed.append(_moved(problem, shared))
    return placed


def _key_of_type(
    loc: tuple[int | str, ...], values: Any, types: dict[str, dict[str, Any]]
) -> tuple[int | str, ...] | None:
    """The place in a type from which the carriage's key at `loc` comes, or where it is missing; else None."""
    if len(loc) < 3 or loc[0] != "carriages":
        return None
    carriages, key = values["carriages"], loc[2]
    carriage = carriages[loc[1]]
    name = carriage.get("type") if isinstance(carriage, dict) else None
    if not isinstance(name, str) or name not in types or key in OWN_KEYS:
        return None
    alike = [one for one in carriages if isinstance(one, dict) and one.get("type") == name]
    missing = key not in types[name] and not any(key in one for one in alike)
    return ("carriage_types", name, *loc[2:]) if missing or key in _shared(carriage, types) else None


def _moved(problem: InitErrorDetails, loc: tuple[int | str, ...]) -> InitErrorDetails:
    refused = problem.get("ctx", {}).get("error")
    at = f"carriages[{problem['loc'][1]}] takes it from this type"
    if isinstance(refused, ValueRefused):
        hint = "; ".join(filter(None, (refused.hint, at)))
        error = ValueRefused(refused.expected, refused.value, hint)
        return cast(InitErrorDetails, {**problem, "loc": loc, "ctx": {"error": error}})
    return cast(InitErrorDetails, {**problem, "loc": loc})
