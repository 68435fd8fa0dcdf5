"""Docstrings in plain text become reStructuredText that means the same."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "docs" / "ext"))

from docstrings import rst  # noqa: E402


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("Sum over `links` of k*d.", "Sum over ``links`` of k\\*d."),
        ("a  first\n   of two rows\nb  second", "``a``\n    first of two rows\n\n``b``\n    second"),
        (
            "rate: samples per\n    second\nunit: text",
            "``rate``\n    samples per second\n\n``unit``\n    text",
        ),
        ("shape    of all\nlongname of one", "``shape``\n    of all\n\n``longname``\n    of one"),
        ("Two rows of\none sentence.", "Two rows of one sentence."),
        ("As in:\n\n    x = 1", "As in:\n\n::\n\n    x = 1"),
        ("`a`s and |b|", "``a``\\ s and \\|b\\|"),
    ],
)
def test_plain_text_as_rst(text: str, expected: str) -> None:
    assert rst(text) == expected
