"""What reports say is what the golden files say: each word, and each number within a unit of its last digit."""

from __future__ import annotations

import re
from decimal import Decimal

import pytest
from golden import FOLDER, REPORTS, written

NUMBER = re.compile(r"(?<![\w.])[-+]?\d[\d\u202f]*(?:\.\d+)?(?:e-?\d+)?(?![\w.]*\w)")
ROUNDING = Decimal("1e-12")  # smaller numbers are rounding errors: another processor has others


def parts(text: str) -> tuple[str, list[str]]:
    """The text with a mark for each number, without line breaks and rules of tables, whose widths follow numbers."""
    return " ".join(NUMBER.sub("#", text).replace("─", " ").split()), NUMBER.findall(text)


def alike(found: str, expected: str) -> bool:
    """Another processor may round the last digit differently; counts of one or two digits are exact."""
    if found == expected:
        return True
    values = [Decimal(text.replace("\u202f", "")) for text in (found, expected)]
    if max(map(abs, values)) < ROUNDING:
        return True
    if all(re.fullmatch(r"[-+]?\d{1,2}", text) for text in (found, expected)):
        return False
    unit = max(Decimal(1).scaleb(int(value.as_tuple().exponent)) for value in values)
    return abs(values[0] - values[1]) <= unit


@pytest.mark.parametrize("name", REPORTS)
def test_report(name: str) -> None:
    (words, numbers), (expected, golden) = map(
        parts, (written(name), (FOLDER / f"{name}.txt").read_text(encoding="utf-8"))
    )
    hint = "if the change is wanted: python tests/reports/golden.py, and read the difference"
    assert words == expected, hint
    assert [pair for pair in zip(numbers, golden, strict=True) if not alike(*pair)] == [], hint


def test_every_file_has_its_case() -> None:
    assert {path.stem for path in FOLDER.iterdir()} == {*REPORTS}


def test_numbers_are_found_and_compared() -> None:
    """The tolerance lets no name, count or wrong number through."""
    assert parts("1a 12\u202f345 -3.2e-5 N, 5 %, rail 1: 7.") == (
        "1a # # N, # %, rail #: #.",
        ["12\u202f345", "-3.2e-5", "5", "1", "7"],
    )
    assert alike("12\u202f345", "12\u202f346") and alike("0.70", "0.71") and alike("1.2e-15", "9e-16")
    assert not alike("12\u202f345", "12\u202f347") and not alike("4", "5") and not alike("1.1", "-1.1")
