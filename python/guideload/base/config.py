"""Base of the models of TOML files: pydantic models that raise ConfigError."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import SequenceMatcher, get_close_matches
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, get_args

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, PlainValidator, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from guideload.base.arguments import checked
from guideload.base.errors import (
    ABSENT,
    MOST_PROBLEMS,
    ConfigError,
    GuideloadError,
    KeyPath,
    Problem,
    ValueRefused,
    shown,
)
from guideload.base.ranges import Range
from guideload.base.units import quantity

if TYPE_CHECKING:
    from typing_extensions import Self


class ConfigModel(BaseModel):
    """Base of all models: immutable, unknown keys refused. Raises ConfigError with all problems at once.

    MOVED: keys of earlier versions, and where their values are now.
    """

    MOVED: ClassVar[dict[str, str]] = {}
    model_config = ConfigDict(frozen=True, extra="forbid")

    def __init__(self, /, **values: Any) -> None:
        try:
            super().__init__(**values)
        except ValidationError as error:
            items = [item for item in error.errors(include_url=False) if not _miscounted(item)]
            for item in items:  # what the model as a whole refused in an error of its own, as of a run
                own = item.get("ctx", {}).get("error")
                if not item["loc"] and isinstance(own, GuideloadError) and not isinstance(own, ValueRefused):
                    raise own from None
            problems = [_problem(item, type(self)) for item in items[:MOST_PROBLEMS]]
            raise ConfigError(problems, others=len(items) - len(problems)) from None

    @checked
    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy with the values of `update`; it is checked, and its cached properties are computed anew."""
        values = {key: getattr(self, key) for key in type(self).model_fields}
        return type(self)(**{**values, **(update or {})})

    def copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:  # type: ignore[override]
        """As `model_copy`: pydantic's own, which is deprecated, does not check the values."""
        return self.model_copy(update=update, deep=deep)

    def __eq__(self, other: object) -> bool:
        """Whether all fields are equal; cached properties are not compared: some are arrays."""
        if type(self) is not type(other):
            return NotImplemented
        return all(getattr(self, key) == getattr(other, key) for key in type(self).model_fields)

    def __getstate__(self) -> dict[Any, Any]:
        """The fields without the cached properties, which a copy computes anew: some cannot be copied."""
        state = super().__getstate__()
        state["__dict__"] = {key: state["__dict__"][key] for key in type(self).model_fields}
        return state

    # copy and deepcopy by the state, as pickle: those of pydantic copy the cached properties as well.
    __copy__ = __deepcopy__ = None  # type: ignore[assignment]

    # Pydantic's mark (as on RootModel) of an __init__ that only wraps: nested models are then validated without it,
    # so that the ConfigError of the outermost model has the problems of all.
    vars(__init__)["__pydantic_base_init__"] = True


def optional(description: str, default: Any = None, **checks: Any) -> Any:
    """The field of a key that may be left out."""
    return Field(default=default, description=description, **checks)


def not_required(*keys: str) -> ConfigDict:
    """Configuration of a model whose `keys` may be left out in a file, because another table of it gives them."""

    def change(schema: dict[str, Any]) -> None:
        schema["required"] = [key for key in schema["required"] if key not in keys]

    return ConfigDict(json_schema_extra=change)


def number(
    value: object,
    unit: str,
    above: float | None = None,
    least: float | None = None,
    nonzero: bool = False,
    within: Range | None = None,
) -> float:
    """`value` in the SI unit `unit`.

    Raises ValueRefused unless > `above`, >= `least`, if `nonzero` not 0, and in the range `within`.
    """
    result = quantity(value, unit)
    shown_unit = "" if unit == "1" else f" {unit}"
    if above is not None and not result > above:
        raise ValueRefused(f"> {above:g}{shown_unit}", value)
    if least is not None and not result >= least:
        raise ValueRefused(f">= {least:g}{shown_unit}", value)
    if nonzero and result == 0.0:
        raise ValueRefused(f"a value other than 0{shown_unit}", value)
    if within is not None:
        within.require(result, value)
    return result


def in_range(within: Range, **checks: Any) -> PlainValidator:
    """The validator of a number in a range; checks: above, least, nonzero of `number`."""
    return PlainValidator(partial(number, unit=within.unit, within=within, **checks))


def whole_number(value: object, least: int, most: int | None = None) -> int:
    """`value` as a whole number. Raises ValueRefused unless it is one from `least` to `most`, by default 2^53."""
    end = 2**53 if most is None else most
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not least <= value <= end:
        reach = f", at least {least}" if most is None else f" from {least} to {most}"
        raise ValueRefused(f"a whole number{reach}", value)
    return int(value)


def whole(least: int, most: int | None = None) -> PlainValidator:
    """The validator of a whole number by `whole_number`."""
    return PlainValidator(partial(whole_number, least=least, most=most))


def entries(value: object, names: tuple[str, ...]) -> object:
    """`value` as a list or tuple. Raises ValueRefused unless it has one entry per name; entries are not checked."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if not isinstance(value, list | tuple) or len(value) != len(names):
        raise ValueRefused(f"[{', '.join(names)}]", value)
    return value


def listed(*names: str) -> BeforeValidator:
    """The validator of a list that has one entry per name."""
    return BeforeValidator(partial(entries, names=names))


def exactly(kind: type[ConfigModel]) -> BeforeValidator:
    """The validator of a model of this class, not of one below it: a payload as a body would not count as one."""

    def of_this_class(value: object) -> object:
        if isinstance(value, kind) and type(value) is not kind:
            raise ValueRefused(f"a {kind.__name__}, not a {type(value).__name__}", value)
        return value

    return BeforeValidator(of_this_class)


def interval(value: object) -> object:
    """The ends of an interval; a single value is both."""
    return entries(value, ("least", "largest")) if isinstance(value, list | tuple) else (value, value)


# Expected value by pydantic's type of error; other types have pydantic's message.
EXPECTED = {
    "string_type": "text in quotes",
    "string_too_short": "a name",
    "model_type": "a table of keys and values",
    "model_attributes_type": "a table of keys and values",
    "tuple_type": "a list",
    "bool_type": "true or false",
    "int_type": "a whole number",
    "dict_type": "a table of keys and values",
    "is_instance_of": "a {class}",
}
# Of a number, with the name of the bound in pydantic's context.
BOUNDS = {
    "greater_than_equal": ("ge", "of at least"),
    "less_than_equal": ("le", "of at most"),
    "greater_than": ("gt", "above"),
    "less_than": ("lt", "below"),
}


def _miscounted(item: ErrorDetails) -> bool:
    """Whether pydantic says that a list is too short because it does not count the entries that are refused anyway."""
    entries = item["input"]
    return (
        item["type"] == "too_short"
        and isinstance(entries, list | tuple)
        and len(entries) >= item.get("ctx", {}).get("min_length", 0)
    )


def _problem(item: ErrorDetails, model: type[BaseModel]) -> Problem:
    """The Problem that describes an error of pydantic."""
    path, value, kind, context = item["loc"], item["input"], item["type"], item.get("ctx", {})
    if kind.startswith("union_tag"):  # the key that selects the model of a union is missing or unknown
        path = (*path, context["discriminator"].strip("'"))
    path, holder, field = _field(model, path)
    expected = EXPECTED[kind].format(**context) if kind in EXPECTED else item["msg"]
    hint = (field.description if field else None) or ""
    written = None
    refused = context.get("error")
    if isinstance(refused, ValueRefused):
        expected, hint = refused.expected, refused.hint or hint
        written = ABSENT if value is None else None
    elif kind in BOUNDS:
        name, sign = BOUNDS[kind]
        expected = f"a number {sign} {context[name]}"
    elif kind == "too_short":
        least = context["min_length"]
        expected = "at least one entry" if least == 1 else f"at least {least} entries"
    elif kind == "literal_error":
        expected = str(context["expected"]).replace("'", '"')
    elif kind in ("missing", "union_tag_not_found"):
        value, expected, hint, written = None, hint, f'add the key "{path[-1]}"', ABSENT
    elif kind == "extra_forbidden":
        keys = list(holder.model_fields)
        near = _nearest(str(path[-1]), keys)
        expected, written = "a known key", shown(str(path[-1]))
        hint = f"did you mean {' or '.join(near)}?" if near else f"keys known here: {', '.join(keys)}"
        hint = getattr(holder, "MOVED", {}).get(path[-1], hint)
    elif kind == "union_tag_invalid":
        value, tags = value[path[-1]], context["expected_tags"].replace("'", "")
        near = _nearest(str(value), tags.split(", "))
        expected = "one of " + ", ".join(f'"{tag}"' for tag in tags.split(", "))
        hint = f"did you mean {' or '.join(near)}?" if near else hint
    return Problem(path, value, expected, hint, None, shown(value) if written is None else written)


def _nearest(word: str, known: list[str]) -> list[str]:
    """The known words most similar to `word`, or else begun by it, in quotes; all that tie, as `stiffness_y` may."""
    begun = [each for each in known if word and each.startswith(word)]
    similar = get_close_matches(word, known) or begun
    likeness = {near: SequenceMatcher(None, near, word).ratio() for near in similar}
    return [f'"{near}"' for near in sorted(likeness) if likeness[near] == max(likeness.values())]


def _field(model: type[BaseModel], path: KeyPath) -> tuple[KeyPath, type[BaseModel], FieldInfo | None]:
    """`path` without the tags of unions, the model that has its last key, and the field of that key."""
    field: FieldInfo | None = None
    models: dict[str, type[BaseModel]] = {}
    plain: list[str | int] = []
    for key in path:
        if isinstance(key, str) and key in models and len(models) > 1:
            models = {key: models[key]}  # pydantic inserts the tag of the model in a union
            continue
        plain.append(key)
        if isinstance(key, str):
            model = next(iter(models.values()), model)
            field = model.model_fields.get(key)
            models = _models_in(field.annotation) if field else {}
    return tuple(plain), model, field


def _models_in(annotation: Any) -> dict[str, type[BaseModel]]:
    """The models inside an annotation such as `tuple[Carriage, ...]` or `Drive | None`, by their tags in a union."""
    if inner := get_args(annotation):
        return {tag: model for argument in inner for tag, model in _models_in(argument).items()}
    if not (isinstance(annotation, type) and issubclass(annotation, BaseModel)):
        return {}
    literals = [get_args(field.annotation) for field in annotation.model_fields.values()]
    tags = [literal[0] for literal in literals if len(literal) == 1 and isinstance(literal[0], str)]
    return {tags[0] if tags else annotation.__name__: annotation}
