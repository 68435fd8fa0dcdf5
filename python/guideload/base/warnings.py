"""Warnings: the limits beyond which a machine, a motion or a result is warned of, and the texts that count them.

The limits are rows of `limits.csv`.
"""

from __future__ import annotations

import csv
from collections.abc import Collection
from math import inf, isinf
from pathlib import Path
from typing import NamedTuple

from guideload.base.number_text import counted, number


class Limit(NamedTuple):
    """The range of a figure without a warning, ends included; without ends, any occurrence is warned of."""

    figure: str
    reason: str
    least: float = -inf
    most: float = inf
    unit: str = ""

    def holds(self, value: float) -> bool:
        """Whether there is no warning; NaN is warned of."""
        return self.least <= value <= self.most

    @property
    def text(self) -> str:
        """The range in words."""
        unit = f" {self.unit}" if self.unit else ""
        if isinf(self.least) and isinf(self.most):
            return "none"
        if isinf(self.least):
            return f"up to {number(self.most)}{unit}"
        if isinf(self.most):
            return f"from {number(self.least)}{unit}"
        return f"{number(self.least)} to {number(self.most)}{unit}"


# By key of the warning, in the order of the table in docs/methods.md, which is made from these rows.
with Path(__file__).with_name("limits.csv").open(encoding="utf-8", newline="") as _file:
    LIMITS = {
        row["warning"]: Limit(
            row["figure"], row["reason"], float(row["least"] or -inf), float(row["most"] or inf), row["unit"]
        )
        for row in csv.DictReader(_file)
    }


class WarningText(str):
    """The sentence of a warning, with the key of its row in `LIMITS`."""

    key: str

    def __new__(cls, key: str, text: str) -> WarningText:
        """Raises KeyError for a key without a limit."""
        if key not in LIMITS:
            raise KeyError(key)
        self = super().__new__(cls, text)
        self.key = key
        return self

    def __getnewargs__(self) -> tuple[str, str]:  # type: ignore[override]
        return self.key, str(self)


def verdict(warnings: Collection[str]) -> str:
    """The number of warnings, for the head of a report."""
    return f"{counted(len(warnings), 'warning')}:" if warnings else "No warnings."
