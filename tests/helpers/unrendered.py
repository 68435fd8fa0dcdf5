"""Pictures that are drawn, but neither laid out nor rendered, which takes most of the time of many a command."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure


def leave_unrendered(monkeypatch: pytest.MonkeyPatch) -> None:
    """From now on a saved picture is an empty file, and one within an HTML report an empty element."""

    def touch(_: Figure, target: Any, **options: Any) -> None:
        """Pictures within an HTML report go into a buffer."""
        Path(target).touch() if isinstance(target, str | Path) else target.write("<svg></svg>")

    monkeypatch.setattr(Figure, "savefig", touch)
    monkeypatch.setattr(Figure, "get_layout_engine", lambda _: None)


def leave_blank(monkeypatch: pytest.MonkeyPatch) -> None:
    """From now on a saved picture is written as ever, but nothing is on it."""
    monkeypatch.setattr(Figure, "draw", lambda *_: None)
    monkeypatch.setattr(Figure, "get_layout_engine", lambda _: None)
