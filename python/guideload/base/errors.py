"""All exceptions. Their messages say where, what was expected, what was found, and the way out."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass

KeyPath = tuple[str | int, ...]  # keys and indices that lead to a value: ("carriages", 2, "stiffness_y")
ABSENT = "nothing"  # in place of the text of a value that is missing


class GuideloadError(Exception):
    """Root of all errors that guideload raises on purpose."""


class TraceError(GuideloadError):
    """A measured trace or a motion cannot be used; the text names file, column and rows."""


class SceneError(GuideloadError):
    """A scene has no solution: an unsupported body, an impossible body or link."""


class RunError(GuideloadError):
    """A run failed; the text names time and step, and the way out."""


class WriteError(RunError, OSError):
    """A file cannot be written; `filename` and `strerror` say which one and why."""

    def __str__(self) -> str:
        return f"{self.filename}: cannot be written: {self.strerror}"


class ArgumentError(RunError, ValueError):
    """An argument of a run is invalid: method, rtol, step or times."""


class ValueRefused(GuideloadError, ValueError):
    """A value is invalid, raised where its place is not known.

    Callers that know the place (the key in the machine file, the column of the trace) raise their own error from it.
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
    """One problem of a description: its key path, the value, what was expected, and the way out."""

    path: KeyPath
    value: object
    expected: str
    hint: str = ""
    row: int | None = None
    written: str = ""  # the value as written in the file or in code

    @property
    def key(self) -> str:
        """The key path as a designer writes it: `carriages[2].stiffness_y`."""
        text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in self.path)
        return text.removeprefix(".")

    def text(self, file: str | None) -> str:
        place = ", ".join(part for part in (file or "", f"row {self.row}" if self.row else "") if part)
        lead = "".join(f"{part}: " for part in (place, self.key) if part)
        return f"{lead}expected {self.expected}, got {self.written}" + (f"; {self.hint}" if self.hint else "")


class ConfigError(GuideloadError):
    """A description is invalid. `problems` has all problems; `key`, `value` and `row` are those of the first."""

    def __init__(self, problems: Iterable[Problem], file: str | None = None) -> None:
        self.problems = tuple(problems)
        super().__init__(self.problems, file)  # all arguments, so that the error survives pickling
        first = self.problems[0]
        self.file = file
        self.key = first.key
        self.value = first.value
        self.row = first.row

    def __str__(self) -> str:
        return "\n".join(problem.text(self.file) for problem in self.problems)


def shown(value: object) -> str:
    """A value as TOML and Python users write it, cut to a readable length."""
    if value is None:
        return "None"
    return shortened(json.dumps(value, ensure_ascii=False, default=str))


def shortened(text: str) -> str:
    """`text` on one line of at most 80 characters."""
    line = " ".join(text.split())
    return line if len(line) <= 80 else f"{line[:77]}..."
