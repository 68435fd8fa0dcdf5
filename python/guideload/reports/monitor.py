"""The state of a load monitor as text: while it runs, and as the summary at its end."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from guideload.base.number_text import counted, fixed, seconds
from guideload.machine.machine import Machine
from guideload.reports.report import Column, Definitions, Report, Section, Table

UNKNOWN = "-"
DEFINITION = (
    "Largest resultant: of Fy and Fz. Limit passed, above it: how often the equivalent load rose above its limit, and "
    "how long it was above."
)


def monitor_report(status: Mapping[str, Any], machine: Machine | None = None) -> Report:
    """The whole report; status: of a `WatchState`. machine: for its head and free dofs, where it is known."""
    parts: dict[str, Any] = {
        "answer": [_answer(status)],
        "warnings": [*_warnings(status)],
        "sections": [
            Section("Carriages", _table(status), Definitions(DEFINITION)),
            Section("Samples", _input(status["input"])),
        ],
    }
    if machine is None:
        return Report(f"{status['machine']}: load monitor", **parts)
    return Report.of(machine, "load monitor", **parts)


def _answer(status: Mapping[str, Any]) -> str:
    name = status["machine"]
    known = [one for one in status["carriages"] if one["largest_resultant_N"] is not None]
    if not known:
        return f"{name}: no loads yet."
    worst = max(known, key=lambda one: one["largest_resultant_N"])
    settling = " After a start the loads are still settling." if status["is_settling"] else ""
    return (
        f"{name}: the largest resultant so far is {fixed(worst['largest_resultant_N'])} N, on carriage {worst['name']} "
        f"at {seconds(worst['time_of_largest_s'])} s. Travel: {fixed(status['distance_m'], 1)} m.{settling}"
    )


def _warnings(status: Mapping[str, Any]) -> Iterator[str]:
    """Of the limit of the load, and of samples that are not good."""
    passed = sum(one["limit_exceeded"] for one in status["carriages"])
    if passed:
        limit = f"{fixed(status['limit_N'])} N {counted(passed, 'time')}"
        yield f"Warning: the equivalent load passed its limit of {limit}; each rise above it counts."
    if bad := _bad(status["input"]):
        yield f"Warning: samples: {', '.join(bad)}."


def _table(status: Mapping[str, Any]) -> Table:
    """A row per carriage: loads now, the largest resultant, passing of the limit, life."""
    carriages = status["carriages"]
    limited = status["limit_N"] is not None

    def column(label: str, key: str, unit: str, kind: str, known: bool = True) -> Column:
        values = (one[key] if known else None for one in carriages)
        return Column(label, [UNKNOWN if value is None else value for value in values], unit, kind)

    return Table(
        Column("carriage", [one["name"] for one in carriages]),
        column("Fy now", "Fy_N", "N", "load"),
        column("Fz now", "Fz_N", "N", "load"),
        column("largest resultant", "largest_resultant_N", "N", "load"),
        column("at", "time_of_largest_s", "s", "3 decimals"),
        column("limit passed", "limit_exceeded", "times", "whole", limited),
        column("above it", "above_limit_s", "s", "3 decimals", limited),
        column("life used", "life_used", "", "percent"),
    )


def _bad(counts: Mapping[str, int]) -> list[str]:
    """What happened to the samples, without what did not happen."""
    words = {
        "missing": f"{counts['missing']} missing and bridged",
        "early": f"{counts['early']} too early",
        "jittering": f"{counts['jittering']} off their time",
        "stuck": f"{counts['stuck']} with a counter that stands",
        "jumps": f"{counts['jumps']} that no motion explains",
        "counter_set": f"counter set {counted(counts['counter_set'], 'time')}",
        "lost": f"{counted(counts['lost'], 'period')} lost",
        "malformed": counted(counts["malformed"], "malformed line"),
    }
    return [text for name, text in words.items() if counts[name]]


def _input(counts: Mapping[str, int]) -> str:
    """The number of samples, and of what happened to them."""
    good = ["all good"] if counts["samples"] else []
    starts = f"{counted(counts['restarts'], 'start')}, {counted(counts['wraps'], 'wrap')} of the counter"
    return f"{counted(counts['samples'], 'sample')}: {', '.join([*(_bad(counts) or good), starts])}."
