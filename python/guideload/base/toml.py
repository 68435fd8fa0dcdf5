"""Reading of TOML files, with the row and the text of every value for error messages."""

from __future__ import annotations

import os
import re
import sys
from bisect import bisect
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

from guideload.base.errors import (
    ABSENT,
    ConfigError,
    KeyPath,
    Problem,
    UnreadableConfig,
    ValueRefused,
    no_file,
    problem_at,
    shortened,
    shown,
)

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


# A machine file nests 4 levels, and its longest key has 20 characters. Parsers in Python recurse into each level, and
# read digits without end in quadratic time.
DEEPEST = 20  # levels of tables and lists in each other, and parts of a key with dots
LONGEST = 1000  # characters of a key or value without quotes
IN_QUOTES = (
    'write text and values with a unit in quotes, and numbers with a decimal point, as in mass = "12.5 kg"'
)
# Beginnings of tomllib's reasons, what was expected, and the way out.
TWICE = (
    ("Cannot overwrite", "each key once", "this key was given before: keep one of the two"),
    (
        "Cannot declare",
        "each table once",
        "keep one of the two, or give both double brackets, as in [[carriages]]",
    ),
    ("Cannot mutate", "each table once", "a key or another table has this name already: keep one of the two"),
)


@dataclass(frozen=True)
class TomlPlace:
    """Place of a value, or of the header of a table, in its file.

    row          of its beginning, the first row is 1
    text         the value as written there, shortened; empty for a header
    first, last  of its characters in the file, the first is 0; last is the one after it
    """

    row: int
    text: str
    first: int
    last: int


def read_toml(
    file: str | PathLike[str], source: str = "`guideload init` writes one"
) -> tuple[dict[str, Any], dict[KeyPath, TomlPlace]]:
    """Values of a TOML file and their places. Raises UnreadableConfig if the file cannot be read.

    source: where such a file comes from, for the message if there is none.
    """
    try:
        content = Path(file).read_bytes()
    except FileNotFoundError:
        raise _unreadable(file, f"a file, {source}", "", None, no_file(Path(file))) from None
    except OSError as error:
        expected = f"a readable file, {source} ({error.strerror})"
        raise _unreadable(file, expected, "", None, "no file") from None
    except ValueError:  # of Python, without the name
        raise _unreadable(file, "the name of a file", "", None, "a name with a NUL character") from None
    return parse_toml(content, file)


def parse_toml(content: bytes, file: str | PathLike[str]) -> tuple[dict[str, Any], dict[KeyPath, TomlPlace]]:
    """Values of the text of a TOML file and their places. Raises UnreadableConfig for text that is no TOML."""
    refusal = partial(_unreadable, file)
    try:
        text = content.decode("utf-8-sig")  # editors on Windows put the byte order mark before the text
    except UnicodeDecodeError as error:
        row = content.count(b"\n", 0, error.start) + 1
        written = f"the byte 0x{content[error.start]:02x}"
        raise refusal("text in UTF-8", "save the file as UTF-8", row, written) from None
    scanner = _Scanner(text)
    if excess := scanner.excess():
        row, expected, written = excess
        raise refusal(expected, "", row, written)
    try:
        values = tomllib.loads(text)
        scanner.scan()
        return values, scanner.places
    except ValueError as error:  # TOMLDecodeError, or one of Python's own
        lines = text.removesuffix("\n").split("\n")
        at = re.search(r" \(at (?:line (\d+).*|end of document)\)", str(error))
        row = int(at[1]) if at and at[1] else len(lines)
        reason = str(error)[: at.start()] if at else str(error)
        expected, hint = next((words for start, *words in TWICE if reason.startswith(start)), ("TOML", ""))
        of_value = reason.startswith(("Invalid", "Illegal", "Expected newline"))
        if hint == "" and of_value and (quote := re.search("[“”„‘’]", lines[min(row, len(lines)) - 1])):
            hint = f'{quote[0]} is a typographic quote: write straight ones, as in mass = "12.5 kg"'
        hint = hint or (f"{reason}; {IN_QUOTES}" if of_value else reason)
        written = shortened(lines[min(row, len(lines)) - 1]) or "an empty row"
        raise refusal(expected, hint, row, written) from None


def _unreadable(
    file: str | PathLike[str], expected: str, hint: str, row: int | None, written: str
) -> ConfigError:
    return UnreadableConfig([Problem((), None, expected, hint, row, written)], str(file))


def located(error: ConfigError, file: str, places: dict[KeyPath, TomlPlace]) -> ConfigError:
    """`error` with the file, and with the row and the text of each value; problems in the order of rows.

    An error that names its file already, such as that of a machine file in a study, stays as it is.
    """
    if error.file is not None:
        return error
    problems = []
    for problem in error.problems:
        prefixes = (problem.path[:n] for n in range(len(problem.path), 0, -1))
        path = next((prefix for prefix in prefixes if prefix in places), None)
        if path is not None:
            of_the_key = problem.written in (ABSENT, shown(str(path[-1])))
            exact = path == problem.path and not of_the_key
            written = (places[path].text if exact else "") or problem.written
            problem = replace(problem, row=places[path].row, written=written)
        problems.append(problem)
    return ConfigError(sorted(problems, key=lambda problem: problem.row or 0), file, error.others)


def require_files(
    folder: Path, names: Mapping[KeyPath, str | None], problems: Sequence[Problem] = ()
) -> None:
    """Raise ConfigError with `problems` and those of the files that do not exist; None stands for no file."""
    missing = [
        problem_at(key, ValueRefused("a file that exists", name, f"there is no {folder / name}"))
        for key, name in names.items()
        if name is not None and not os.path.exists(folder / name)  # of a name no system takes: False
    ]
    if problems or missing:
        raise ConfigError([*problems, *missing])


# A string that does not end reaches to the end of its row or, with three quotes, of the text: so each character is
# looked at once, in any text.
TOKEN = re.compile(
    r"""(?P<blank>[ \t\r\n]+|\#[^\n]*)
    |(?P<string>\"{3}(?:\\.|[^\\])*?(?:\"{3,5}|\Z)|'{3}.*?(?:'{3,5}|\Z)|"(?:\\.|[^"\\\n])*"?|'[^'\n]*'?)
    |(?P<mark>[\[\]{}=,.])
    |(?P<bare>[^\s\[\]{}=,."'\#]+)""",
    re.VERBOSE | re.DOTALL,
)


class _Scanner:
    """Places of all tables, keys and array entries of a valid TOML text; tomllib does not give them."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.tokens = [match for match in TOKEN.finditer(text) if match.lastgroup != "blank"]
        self.row_ends = [match.start() for match in re.finditer("\n", text)]
        self.at = 0
        self.places: dict[KeyPath, TomlPlace] = {}

    def excess(self) -> tuple[int, str, str] | None:
        """Row, expected and found, where a text that need not be valid is nested too deep or too long; or None."""
        depth = dots = 0
        for token in self.tokens:
            mark = token[0] if token.lastgroup == "mark" else ""
            depth = max(0, depth + (mark in ("[", "{")) - (mark in ("]", "}")))
            dots = dots + 1 if mark == "." else 0 if mark else dots
            if depth > DEEPEST or dots >= DEEPEST:
                expected = (
                    f"tables and lists in at most {DEEPEST} levels, and keys with at most that many parts"
                )
                return self._row(token), expected, "a deeper level"
            if token.lastgroup == "bare" and token.end() - token.start() > LONGEST:
                expected = f"keys and values without quotes of at most {LONGEST} characters"
                return self._row(token), expected, shortened(token[0])
        return None

    def scan(self) -> None:
        """Collect the places; the text must be valid."""
        table: KeyPath = ()
        last_entry: dict[KeyPath, int] = {}  # index of the last entry of each array of tables
        while self.at < len(self.tokens):
            if self._sees("["):
                table = self._header(last_entry)
            else:
                self._pair(table)

    def _header(self, last_entry: dict[KeyPath, int]) -> KeyPath:
        start = self.tokens[self.at]
        depth = 2 if self.tokens[self.at + 1][0] == "[" else 1
        self.at += depth
        path: KeyPath = ()
        keys = self._keys()
        for number, key in enumerate(keys, 1):
            path += (key,)
            if depth == 2 and number == len(keys):
                last_entry[path] = last_entry.get(path, -1) + 1
            if path in last_entry:
                path += (last_entry[path],)
        self.at += depth
        self.places[path] = TomlPlace(self._row(start), "", start.start(), self.tokens[self.at - 1].end())
        return path

    def _pair(self, table: KeyPath) -> None:
        start = self.tokens[self.at]
        path = table + tuple(self._keys())
        self.at += 1  # =
        self._value(path, start)

    def _keys(self) -> list[str]:
        keys: list[str] = []
        while not keys or self._sees("."):
            self.at += bool(keys)
            token = self.tokens[self.at]
            quoted = token.lastgroup == "string"
            keys.append(next(iter(tomllib.loads(f"{token[0]}=0"))) if quoted else token[0])
            self.at += 1
        return keys

    def _value(self, path: KeyPath, start: re.Match[str]) -> None:
        first = self.tokens[self.at]
        self.at += 1
        if first[0] in ("[", "{"):
            index = 0
            while not self._sees("]" if first[0] == "[" else "}"):
                if first[0] == "[":
                    self._value((*path, index), self.tokens[self.at])
                else:
                    self._pair(path)
                index += 1
                self.at += self._sees(",")
            self.at += 1
        else:
            # 1.5 is three tokens and a date with a blank two: a value without quotes ends with its row or at , ] }
            while self.at < len(self.tokens) and first.lastgroup == "bare" and self._continues():
                self.at += 1
        begin, end = first.start(), self.tokens[self.at - 1].end()
        self.places[path] = TomlPlace(self._row(start), shortened(self.text[begin:end]), begin, end)

    def _continues(self) -> bool:
        gap = self.text[self.tokens[self.at - 1].end() : self.tokens[self.at].start()]
        return self.tokens[self.at][0] not in (",", "]", "}", "[") and "\n" not in gap

    def _sees(self, mark: str) -> bool:
        return self.at < len(self.tokens) and self.tokens[self.at][0] == mark

    def _row(self, token: re.Match[str]) -> int:
        return bisect(self.row_ends, token.start()) + 1
