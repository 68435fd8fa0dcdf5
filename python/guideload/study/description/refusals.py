"""Errors in the keys of a study."""

from __future__ import annotations

from guideload.base.errors import ConfigError, KeyPath, Problem, ValueRefused, shown


class KeyRefused(ValueRefused):
    """The value of a key was refused when a table of the study was applied to a machine."""

    def __init__(self, key: str, expected: str, value: object, hint: str = "") -> None:
        super().__init__(expected, value, hint)
        self.key = key


def problem_at(place: KeyPath, refused: ValueRefused) -> Problem:
    """The problem of a refused value at its key."""
    place = (*place, refused.key) if isinstance(refused, KeyRefused) else place
    return Problem(place, refused.value, refused.expected, refused.hint, None, shown(refused.value))


def refused_at(place: KeyPath, expected: str, value: object, hint: str = "") -> ConfigError:
    """The error for a single refused value at its key."""
    return ConfigError([problem_at(place, ValueRefused(expected, value, hint))])
