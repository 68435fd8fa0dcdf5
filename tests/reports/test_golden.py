"""What reports say is what the golden files say: each word, and each number within a unit of its last digit."""

import pytest
from golden_reports import FOLDER, REPORTS, alike, differences, parts
from unrendered import leave_unrendered


@pytest.mark.parametrize("name", REPORTS)
def test_a_report_is_its_golden_file(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    leave_unrendered(monkeypatch)  # of a page its words are compared
    assert differences(name) == [], "if the change is wanted: python tests/golden.py --write"


def test_every_file_has_its_report() -> None:
    assert {path.stem for path in FOLDER.iterdir()} == {*REPORTS}


def test_numbers_are_found_and_compared() -> None:
    """The tolerance lets no name, count or wrong number through."""
    assert parts("1a 12\u202f345 -3.2e-5 N, 5 %, rail 1: 7.") == (
        "1a # # N, # %, rail #: #.",
        ["12\u202f345", "-3.2e-5", "5", "1", "7"],
    )
    assert alike("12\u202f345", "12\u202f346") and alike("0.70", "0.71") and alike("1.2e-15", "9e-16")
    assert not alike("12\u202f345", "12\u202f347") and not alike("4", "5") and not alike("1.1", "-1.1")
