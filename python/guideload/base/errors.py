"""All exceptions. A message names the place, the expected value, the value found, and a way out."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass

KeyPath = tuple[str | int, ...]  # keys and indices that lead to a value: ("carriages", 2, "stiffness_y")
ABSENT = "nothing"  # text of a missing value


class GuideloadError(Exception):
    """Base of all errors of guideload."""


class TraceError(GuideloadError):
    """A trace or a motion cannot be used; the message names file, column and rows."""


class SceneError(GuideloadError):
    """A scene is invalid: the body is unsupported, or the body or a link is impossible."""


class RunError(GuideloadError):
    """A run failed; the message names time and step, and a way out."""


class DoubtfulResult(RunError):
    """A result that was asked for with strict=True contradicts itself or cannot be predicted; see `Audit.doubts`."""


class WriteError(RunError, OSError):
    """A file cannot be written; `filename` and `strerror` say which one and why."""

    def __str__(self) -> str:
        return f"{self.filename}: cannot be written: {self.strerror}"


class ArgumentError(RunError, ValueError):
    """An argument of a run is invalid: method, rtol, step or times."""


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
        return f"expected {self.expected}, got {shown(self.value)}" + (f"; {self.hint}" if self.hint else "")


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
    """A machine or study is invalid. `problems` has all problems; `key`, `value` and `row` belong to the first."""

    def __init__(self, problems: Iterable[Problem], file: str | None = None) -> None:
        self.problems = tuple(problems)
        super().__init__(self.problems, file)  # all arguments: pickling needs them
        first = self.problems[0]
        self.file = file
        self.key = first.key
        self.value = first.value
        self.row = first.row

    def __str__(self) -> str:
        return "\n".join(problem.text(self.file) for problem in self.problems)


def shown(value: object) -> str:
    """`value` as text of at most 80 characters, in the notation of TOML."""
    if value is None:
        return "None"
    return shortened(json.dumps(value, ensure_ascii=False, default=str))


def shortened(text: str) -> str:
    """`text` on one line of at most 80 characters."""
    line = " ".join(text.split())
    return line if len(line) <= 80 else f"{line[:77]}..."
