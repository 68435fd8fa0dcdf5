"""Columns of measured values or given cases in tables beside a study, converted by the units of their headers."""

from __future__ import annotations

import re

import numpy as np

from guideload.base.arrays import Array
from guideload.base.units import factor
from guideload.traces.format.table import Table

HEADER = re.compile(r"\s*(?P<name>.*\S)\s+\[(?P<unit>[^\[\]]*)\]\s*")


def name_and_unit(header: str) -> tuple[str, str]:
    """("body.mass", "t") from "body.mass [t]"; the unit is "" if there is none."""
    match = HEADER.fullmatch(header)
    return (match["name"], match["unit"]) if match else (header.strip(), "")


def numbers_of(table: Table, header: str, unit: str) -> tuple[Array, bool]:
    """A column (n,) in SI `unit`, and False; or as shares, and True, if its header has the unit [%].

    Without a unit in the header, the row of units below applies, else SI. Raises TraceError with the rows that hold no
    number, and ValueRefused for another dimension.
    """
    numbers = table.values(header).astype(np.float64)
    bad = np.flatnonzero(~np.isfinite(numbers))
    if bad.size:
        raise table.no_number(header, bad, "remove the rows; nothing is filled in")
    written = name_and_unit(header)[1] or table.units.get(header, "")
    if written == "%":
        return numbers / 100.0, True
    return numbers * (factor(written, unit) if written else 1.0), False
