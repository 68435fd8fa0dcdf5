"""Columns of tables beside a study, measured values and given cases, with the units of their headers."""

from __future__ import annotations

import re

import numpy as np

from guideload.base.arrays import Array
from guideload.base.units import factor
from guideload.traces.format.table import Table

HEADER = re.compile(r"\s*(?P<name>.*\S)\s+\[(?P<unit>[^\[\]]*)\]\s*")


def name_and_unit(header: str) -> tuple[str, str]:
    """ "body.mass" and "t" of "body.mass [t]": the unit is in brackets after a blank; "" if there is none."""
    match = HEADER.fullmatch(header)
    return (match["name"], match["unit"]) if match else (header.strip(), "")


def numbers_of(table: Table, header: str, unit: str) -> tuple[Array, bool]:
    """A column (n,) in SI `unit`, and False; or as shares, and True, where its header says [%].

    Without a unit in the header it is the one in a row of units below, else SI. Raises TraceError naming rows without
    a number, and ValueRefused for another dimension.
    """
    numbers = table.values(header).astype(np.float64)
    bad = np.flatnonzero(~np.isfinite(numbers))
    if bad.size:
        raise table.no_number(header, bad, "remove the rows; nothing is filled in")
    written = name_and_unit(header)[1] or table.units.get(header, "")
    if written == "%":
        return numbers / 100.0, True
    return numbers * (factor(written, unit) if written else 1.0), False
