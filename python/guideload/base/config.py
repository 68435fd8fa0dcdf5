"""From a TOML file to checked values: where each value stands, and what is said when one is refused.

`read` gives a file's values and the row of each; `ConfigModel` is the base of everything described in a file.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from difflib import SequenceMatcher, get_close_matches
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from guideload.base.errors import ConfigError, KeyPath, Problem, ValueRefused, shortened, shown
from guideload.base.units import quantity

if TYPE_CHECKING:
    from typing_extensions import Self

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


@dataclass(frozen=True)
class Place:
    """Where a value stands in a file, and how it is written there."""

    row: int
    text: str


# ---- reading


def read(file: str | PathLike[str]) -> tuple[dict[str, Any], dict[KeyPath, Place]]:
    """The values of a TOML file and their places. Raises ConfigError if it cannot be read."""
    try:
        content = Path(file).read_bytes()
    except OSError as error:
        reason = f"a readable file, `guideload init` writes one ({error.strerror})"
        raise ConfigError([Problem((), None, reason, written="no file")], str(file)) from None
    try:
        text = content.decode("utf-8-sig")  # editors on Windows put the byte order mark before the text
    except UnicodeDecodeError as error:
        row = content.count(b"\n", 0, error.start) + 1
        found = f"the byte 0x{content[error.start]:02x}"
        problem = Problem((), None, "text in UTF-8", "save the file as UTF-8", row, found)
        raise ConfigError([problem], str(file)) from None
    try:
        return tomllib.loads(text), places(text)
    except tomllib.TOMLDecodeError as error:
        lines = text.splitlines() or [""]
        at = re.search(r" \(at (?:line (\d+).*|end of document)\)", str(error))
        row = int(at[1]) if at and at[1] else len(lines)
        reason = str(error)[: at.start()] if at else str(error)
        hint = f'{reason}; text and values with a unit stand in quotes, as in mass = "1250 kg"'
        written = shortened(lines[min(row, len(lines)) - 1]) or "an empty row"
        raise ConfigError([Problem((), None, "TOML", hint, row, written)], str(file)) from None


TOKEN = re.compile(
    r"""(?P<blank>[ \t\r\n]+|\#[^\n]*)
    |(?P<string>\"{3}(?:\\.|[^\\])*?\"{3,5}|'{3}.*?'{3,5}|"(?:\\.|[^"\\])*"|'[^']*')
    |(?P<mark>[\[\]{}=,.])
    |(?P<bare>[^\s\[\]{}=,."'\#]+)""",
    re.VERBOSE | re.DOTALL,
)


def places(text: str) -> dict[KeyPath, Place]:
    """The place of every table, key and array entry of a valid TOML text; Python's TOML readers tell none."""
    return _Scanner(text).places


class _Scanner:
    """One pass over the tokens of a text that tomllib has already accepted: it looks for no mistakes."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.tokens = [match for match in TOKEN.finditer(text) if match.lastgroup != "blank"]
        self.at = 0
        self.places: dict[KeyPath, Place] = {}
        table: KeyPath = ()
        tables: dict[KeyPath, int] = {}  # arrays of tables: how many entries so far
        while self.at < len(self.tokens):
            if self._sees("["):
                table = self._header(tables)
            else:
                self._pair(table)

    def _header(self, tables: dict[KeyPath, int]) -> KeyPath:
        start = self.tokens[self.at]
        depth = 0
        while self._sees("["):
            self.at += 1
            depth += 1
        path: KeyPath = ()
        keys = self._keys()
        for i, key in enumerate(keys):
            path += (key,)
            if depth == 2 and i == len(keys) - 1:
                tables[path] = tables.get(path, 0) + 1
            if path in tables:
                path += (tables[path] - 1,)
        self.at += depth
        self._note(path, start, start)
        return path

    def _pair(self, table: KeyPath) -> None:
        start = self.tokens[self.at]
        path = table + tuple(self._keys())
        self.at += 1  # =
        self._value(path, start)

    def _keys(self) -> list[str]:
        keys: list[str] = []
        while True:
            token = self.tokens[self.at]
            self.at += 1
            quoted = token.lastgroup == "string"
            keys.append(next(iter(tomllib.loads(f"{token[0]}=0"))) if quoted else token[0])
            if not self._sees("."):
                return keys
            self.at += 1

    def _value(self, path: KeyPath, start: re.Match[str]) -> None:
        first = self.tokens[self.at]
        if self._sees("["):
            self.at += 1
            index = 0
            while not self._sees("]"):
                self._value((*path, index), self.tokens[self.at])
                index += 1
                self.at += self._sees(",")
            self.at += 1
        elif self._sees("{"):
            self.at += 1
            while not self._sees("}"):
                self._pair(path)
                self.at += self._sees(",")
            self.at += 1
        else:
            self.at += 1
            # 1.5 is three tokens, a date with a blank is two: a plain value ends with its row or at , ] }
            while self.at < len(self.tokens) and first.lastgroup == "bare" and self._continues():
                self.at += 1
        self._note(path, start, first, self.tokens[self.at - 1])

    def _continues(self) -> bool:
        gap = self.text[self.tokens[self.at - 1].end() : self.tokens[self.at].start()]
        return self.tokens[self.at][0] not in (",", "]", "}", "[") and "\n" not in gap

    def _sees(self, mark: str) -> bool:
        return self.at < len(self.tokens) and self.tokens[self.at][0] == mark

    def _note(
        self, path: KeyPath, key: re.Match[str], first: re.Match[str], last: re.Match[str] | None = None
    ) -> None:
        row = self.text.count("\n", 0, key.start()) + 1
        self.places[path] = Place(row, shortened(self.text[first.start() : last.end()]) if last else "")


def located(error: ConfigError, file: str, where: dict[KeyPath, Place]) -> ConfigError:
    """The same refusal with file, rows and the values as written; the rows in ascending order."""
    problems = []
    for problem in error.problems:
        known = [problem.path[:n] for n in range(len(problem.path), 0, -1) if problem.path[:n] in where]
        row = where[known[0]].row if known else None
        exact = bool(known) and known[0] == problem.path and problem.written != ABSENT
        written = where[known[0]].text if exact else ""
        problems.append(replace(problem, row=row, written=written or problem.written))
    return ConfigError(sorted(problems, key=lambda problem: problem.row or 0), file)


# ---- checking

ABSENT = "nothing"


class ConfigModel(BaseModel):
    """Base of all that a machine file describes: immutable, no unknown keys, refusals are ConfigErrors."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    def __init__(self, /, **values: Any) -> None:
        try:
            super().__init__(**values)
        except ValidationError as error:
            raise ConfigError(problems_of(error, type(self))) from None

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """The same part with other values, checked like any; nothing computed from the old ones is kept."""
        values = {key: getattr(self, key) for key in type(self).model_fields}
        return type(self)(**{**values, **(update or {})})

    # Pydantic's own mark (as on its RootModel) for an __init__ that only wraps: parts within parts are then
    # validated without it, so that the outermost part sees the problems of all of them at once.
    vars(__init__)["__pydantic_base_init__"] = True


def number(
    value: object, unit: str, above: float | None = None, least: float | None = None, nonzero: bool = False
) -> float:
    """`value` in the SI unit `unit`, within its bounds. Raises ValueRefused."""
    result = quantity(value, unit)
    shown_unit = "" if unit == "1" else f" {unit}"
    if above is not None and not result > above:
        raise ValueRefused(f"> {above:g}{shown_unit}", value)
    if least is not None and not result >= least:
        raise ValueRefused(f">= {least:g}{shown_unit}", value)
    if nonzero and result == 0.0:
        raise ValueRefused(f"a value other than 0{shown_unit}", value)
    return result


def entries(value: object, names: tuple[str, ...]) -> object:
    """Passes a list, tuple or array with one entry per name; their checks are the entries' own."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if not isinstance(value, list | tuple) or len(value) != len(names):
        raise ValueRefused(f"[{', '.join(names)}]", value)
    return value


def problems_of(error: ValidationError, model: type[BaseModel]) -> list[Problem]:
    """Pydantic's findings in guideload's words."""
    return [_problem(item, model) for item in error.errors(include_url=False)]


EXPECTED: dict[str, Callable[[ErrorDetails], str]] = {
    "string_type": lambda item: "text in quotes",
    "string_too_short": lambda item: "a name",
    "model_type": lambda item: "a table of keys and values",
    "model_attributes_type": lambda item: "a table of keys and values",
    "tuple_type": lambda item: "a list",
    "bool_type": lambda item: "true or false",
    "too_short": lambda item: "at least one entry",
    "literal_error": lambda item: str(item["ctx"]["expected"]).replace("'", '"'),
}


def _problem(item: ErrorDetails, model: type[BaseModel]) -> Problem:
    path, value, context = item["loc"], item["input"], item.get("ctx", {})
    refused = context.get("error")
    if item["type"].startswith("union_tag"):  # the key that selects the member of a union is missing or unknown
        path = (*path, context["discriminator"].strip("'"))
    path, holder, field = _field(model, path)
    hint = field.description or "" if field else ""
    if isinstance(refused, ValueRefused):
        return Problem(path, value, refused.expected, refused.hint or hint, None, shown(value))
    if item["type"] in ("missing", "union_tag_not_found"):
        return Problem(path, None, hint, f'add the key "{path[-1]}"', None, ABSENT)
    if item["type"] == "extra_forbidden":
        keys = list(holder.model_fields)
        near = _nearest(str(path[-1]), keys)
        hint = f"did you mean {' or '.join(near)}?" if near else f"keys known here: {', '.join(keys)}"
        return Problem(path, value, "a known key", hint, None, shown(value))
    if item["type"] == "union_tag_invalid":
        names, value = context["expected_tags"].replace("'", '"'), value[path[-1]]
        near = _nearest(str(value), names.replace('"', "").split(", "))
        way_out = f"did you mean {' or '.join(near)}?" if near else hint
        return Problem(path, value, f"one of {names}", way_out, None, shown(value))
    words = EXPECTED.get(item["type"])
    return Problem(path, value, words(item) if words else item["msg"], hint, None, shown(value))


def _nearest(word: str, known: list[str]) -> list[str]:
    """The known words most like this one, in quotes; several where they are equally like it, as those of y and z."""
    likeness = {near: SequenceMatcher(None, near, word).ratio() for near in get_close_matches(word, known)}
    return [f'"{near}"' for near in sorted(likeness) if likeness[near] == max(likeness.values())]


def _field(model: type[BaseModel], path: KeyPath) -> tuple[KeyPath, type[BaseModel], FieldInfo | None]:
    """The path without the tags of unions, the part that holds its last key, and the field of that key."""
    field: FieldInfo | None = None
    members: dict[str, type[BaseModel]] = {}
    plain: list[str | int] = []
    for i, key in enumerate(path):
        if key in members and len(members) > 1:  # the tag that pydantic puts before the keys of a union's member
            model, members = members[str(key)], {}
            continue
        plain.append(key)
        if isinstance(key, str):
            field = model.model_fields.get(key)
            members = _members(field.annotation) if field else {}
            if members and any(isinstance(later, str) for later in path[i + 1 :]):
                model = next(iter(members.values()))
    return tuple(plain), model, field


def _members(annotation: Any) -> dict[str, type[BaseModel]]:
    """The parts inside an annotation such as `tuple[Carriage, ...]` or `Drive | None`, by their tags in a union."""
    inner = get_args(annotation)
    if inner:
        return {tag: part for argument in inner for tag, part in _members(argument).items()}
    if not (isinstance(annotation, type) and issubclass(annotation, BaseModel)):
        return {}
    tags = (get_args(field.annotation) for field in annotation.model_fields.values())
    return {next((one[0] for one in tags if len(one) == 1 and isinstance(one[0], str)), annotation.__name__): annotation}
