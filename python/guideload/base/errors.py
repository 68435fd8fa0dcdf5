"""All exceptions. A message names the place, the expected value, the value found, and a way out."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path

from guideload.base.visible_text import visible

KeyPath = tuple[str | int, ...]  # keys and indices that lead to a value: ("carriages", 2, "stiffness_y")
ABSENT = "nothing"  # text of a missing value
MOST_PROBLEMS = 20  # that one ConfigError describes; the others are counted


class GuideloadError(Exception):
    """Base of all errors of guideload. Control characters in its text are shown as escapes."""

    def __str__(self) -> str:
        return visible(super().__str__())


class TraceError(GuideloadError):
    """A trace or a motion cannot be used; the message names file, column and rows."""


class SceneError(GuideloadError):
    """A scene is invalid: the body is unsupported, or the body or a link is impossible."""


class RunError(GuideloadError):
    """A run failed; the message names time and step, and a way out."""


class DoubtfulResult(RunError):
    """A result that was asked for with strict=True contradicts itself or cannot be predicted; see `Audit.doubts`."""


class NotFinite(RunError):
    """A result is not a finite number, because values of the input are too large or too small together."""

    def __init__(self, place: str, value: object) -> None:
        super().__init__(place, value)
        self.place, self.value = place, value

    def __str__(self) -> str:
        return visible(
            f"{self.place}: the result is {self.value}, no finite number, so nothing is written; values of the input "
            "are too large or too small together: check the largest and the smallest ones, and their units"
        )


class LifeError(GuideloadError):
    """Life or static safety cannot be computed: a product lacks a value, or the motion has no speed."""


class WriteError(RunError, OSError):
    """A file cannot be written; `filename` and `strerror` say which one and why."""

    def __str__(self) -> str:
        return visible(f"{self.filename}: cannot be written: {self.strerror}")


class PictureError(RunError):
    """Some pictures could not be drawn; numbers and the other pictures are not affected. `failed`: error by name."""

    def __init__(self, failed: Mapping[str, Exception]) -> None:
        super().__init__(failed)
        self.failed = dict(failed)

    def __str__(self) -> str:
        reasons = (f"{name} ({type(error).__name__}: {error})" for name, error in self.failed.items())
        return visible(f"not drawn: {'; '.join(reasons)}. The numbers are not affected")


class ArgumentError(RunError, ValueError):
    """An argument of a run is invalid: method, rtol, step or times."""


class ReadError(ArgumentError):
    """A file or folder cannot be read: it is missing, damaged, or holds something else; the message names it."""


class UnreadableTrace(ReadError, TraceError):
    """The ReadError of the file of a trace or another measured table."""


class ArgumentTypeError(ArgumentError, TypeError):
    """An argument of a function is of a wrong type; the message names it and the type that is expected."""


class ValueRefused(GuideloadError, ValueError):
    """A value is invalid; its place in the input is not known here.

    Callers that know the place (key of a machine file, column of a trace) raise their own error from this one.
    """

    def __init__(self, expected: str, value: object, hint: str = "") -> None:
        super().__init__(expected, value, hint)
        self.expected = expected
        self.value = value
        self.hint = hint

    def __str__(self) -> str:
        hint = f"; {self.hint}" if self.hint else ""
        return visible(f"expected {self.expected}, got {shown(self.value)}{hint}")


class KeyRefused(ValueRefused):
    """The value of one key of a table was refused when the table was applied to a machine."""

    def __init__(self, key: str, expected: str, value: object, hint: str = "") -> None:
        super().__init__(expected, value, hint)
        self.key = key


@dataclass(frozen=True)
class Problem:
    """One invalid value of a machine or study: key path, value, expected value, and a way out."""

    path: KeyPath
    value: object
    expected: str
    hint: str = ""
    row: int | None = None
    written: str = ""  # the value as written in the file or in code

    @property
    def key(self) -> str:
        """The key path as text: `carriages[2].stiffness_y`."""
        text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in self.path)
        return text.removeprefix(".")

    def text(self, file: str | None) -> str:
        place = ", ".join(part for part in (file or "", f"row {self.row}" if self.row else "") if part)
        lead = "".join(f"{part}: " for part in (place, self.key) if part)
        return f"{lead}expected {self.expected}, got {self.written}" + (f"; {self.hint}" if self.hint else "")


class ConfigError(GuideloadError):
    """A machine or study is invalid; `key`, `value` and `row` belong to the first problem.

    problems  at most MOST_PROBLEMS of them
    others    number of further problems
    """

    def __init__(self, problems: Iterable[Problem], file: str | None = None, others: int = 0) -> None:
        problems = tuple(problems)
        self.problems = problems[:MOST_PROBLEMS]
        self.others = others + len(problems) - len(self.problems)
        super().__init__(self.problems, file, self.others)  # all arguments: pickling needs them
        first = self.problems[0]
        self.file = file
        self.key = first.key
        self.value = first.value
        self.row = first.row

    def __str__(self) -> str:
        lines, hints = [], set[str]()
        for problem in self.problems:  # each hint once
            lines.append((replace(problem, hint="") if problem.hint in hints else problem).text(self.file))
            hints.add(problem.hint)
        if self.others:
            lines.append(f"and {self.others} more problem{'s' if self.others > 1 else ''}")
        return visible("\n".join(lines))


class UnreadableConfig(ConfigError, ReadError):
    """The ReadError of a TOML file: it is missing, or no TOML."""


def problem_at(place: KeyPath, refused: ValueRefused) -> Problem:
    """The problem of a refused value at its key."""
    place = (*place, refused.key) if isinstance(refused, KeyRefused) else place
    written = ABSENT if refused.value is None else shown(refused.value)
    return Problem(place, refused.value, refused.expected, refused.hint, None, written)


def refused_at(place: KeyPath, expected: str, value: object, hint: str = "") -> ConfigError:
    """The error for a single refused value at its key."""
    return ConfigError([problem_at(place, ValueRefused(expected, value, hint))])


def no_file(path: Path) -> str:
    """`no such file`, and the file beside it whose name is nearest."""
    try:
        near = get_close_matches(path.name, [other.name for other in path.parent.iterdir()], 1)
    except OSError:
        near = []
    return f"no such file{''.join(f'; did you mean {visible(name)}?' for name in near)}"


def did_you_mean(name: str, known: Iterable[str], otherwise: str = "") -> str:
    """A hint with the known name that is nearest to a wrong one; `otherwise` if none is near."""
    near = get_close_matches(name, list(known), n=1)
    return f'did you mean "{near[0]}"?' if near else otherwise


def shown(value: object) -> str:
    """`value` as text of at most 80 characters, in the notation of TOML."""
    if value is None:
        return "None"
    try:
        text = json.dumps(value, ensure_ascii=False, default=str)
    except (TypeError, ValueError, RecursionError):  # nested too deep, a key of another type, too many digits
        text = f"a value of type {type(value).__name__}"
    return shortened(text)


def shortened(text: str, most: int = 80) -> str:
    """`text` on one line of at most `most` characters; control characters are shown as escapes."""
    line = visible(" ".join(text.split()))
    return line if len(line) <= most else f"{line[: most - 3]}..."
