"""The state of a load monitor as text: while it runs, and as the summary at its end."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.console import RenderableType
from rich.table import Table

from guideload.base.number_text import counted, load_in_table
from guideload.reports.elements import new_table, to_text

UNKNOWN = "-"


def monitor_report(status: Mapping[str, Any], encoding: str = "utf-8") -> str:
    """The whole report; status: of `watch.status`."""
    return to_text(monitor_parts(status), encoding=encoding)


def monitor_parts(status: Mapping[str, Any]) -> list[RenderableType]:
    """The elements of the report."""
    return [_answer(status), "", _table(status), _input(status["input"])]


def _answer(status: Mapping[str, Any]) -> str:
    name = status["machine"]
    known = [one for one in status["carriages"] if one["largest_resultant_N"] is not None]
    if not known:
        return f"{name}: no loads yet."
    worst = max(known, key=lambda one: one["largest_resultant_N"])
    passed = sum(one["limit_exceeded"] for one in status["carriages"])
    limit = ""
    if status["limit_N"] is not None:
        limit = f" The limit of {status['limit_N']:.0f} N was passed {counted(passed, 'time')}."
    settling = " After a start the loads are still settling." if status["is_settling"] else ""
    return (
        f"{name}: the largest load so far is {worst['largest_resultant_N']:.0f} N, on carriage {worst['name']} at "
        f"{worst['time_of_largest_s']:.3f} s.{limit} Travel: {status['distance_m']:.1f} m.{settling}"
    )


def _table(status: Mapping[str, Any]) -> Table:
    """A row per carriage: loads now, the largest resultant, passing of the limit, life."""
    table = new_table(
        "carriage",
        "Fy now\nN",
        "Fz now\nN",
        "largest\nN",
        "at\ns",
        "limit\npassed",
        "above\nit, s",
        "life\nused, %",
    )
    for one in status["carriages"]:
        at, life = one["time_of_largest_s"], one["life_used"]
        table.add_row(
            one["name"],
            _load(one["Fy_N"]),
            _load(one["Fz_N"]),
            _load(one["largest_resultant_N"]),
            UNKNOWN if at is None else f"{at:.3f}",
            UNKNOWN if status["limit_N"] is None else str(one["limit_exceeded"]),
            UNKNOWN if status["limit_N"] is None else f"{one['above_limit_s']:.3f}",
            UNKNOWN if life is None else f"{100.0 * life:.3g}",
        )
    return table


def _load(value: float | None) -> str:
    return UNKNOWN if value is None else load_in_table(value)


def _input(counts: Mapping[str, int]) -> str:
    """What happened to the samples, without what did not happen."""
    names = {
        "missing": "missing and bridged",
        "early": "too early",
        "jittering": "off their time",
        "stuck": "with a counter that stands",
        "jumps": "that no motion explains",
        "counter_set": "counter set",
        "lost": "periods lost",
        "malformed": "malformed lines",
    }
    bad = [f"{words} {counts[name]}" for name, words in names.items() if counts[name]]
    good = ["all good"] if counts["samples"] else []
    starts = f"{counted(counts['restarts'], 'start')}, {counted(counts['wraps'], 'wrap')} of the counter"
    return f"{counted(counts['samples'], 'sample')}: {', '.join([*(bad or good), starts])}."
