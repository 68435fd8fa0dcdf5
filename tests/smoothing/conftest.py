"""Tests of smoothing itself: every trace is smoothed anew."""

import pytest

from guideload.smoothing import smoothing
from guideload.smoothing.estimation import estimate


@pytest.fixture(autouse=True)
def anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is remembered."""
    monkeypatch.setattr(smoothing, "estimate", estimate)
