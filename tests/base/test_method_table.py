"""The table of the integration methods against the names that users and the core know."""

from __future__ import annotations

from guideload.base.methods import CHOICES, METHODS


def test_each_choice_has_its_row() -> None:
    assert CHOICES == ("auto", *METHODS)
