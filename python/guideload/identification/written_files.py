"""Files with identified values: the machine file, and a study file whose distributions are what is known now.

The machine file is the user's own text, in which only numbers change and comments are added.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

import numpy as np

from guideload.base.arrays import Array
from guideload.base.errors import KeyPath, RunError, ValueRefused
from guideload.base.toml import TomlPlace, read_toml
from guideload.base.units import factor
from guideload.identification.result import Identification, NuisanceEstimate, UnknownEstimate
from guideload.identification.uncertainty import NORMAL_QUANTILE
from guideload.identification.unknowns import key_path, usual_unit

# ---- the machine file


DIGITS = 6  # of a value: more than any measurement has
ROUNDING = 1e-5  # relative difference that these digits may make
FILES = ("catalogue", "straightness_file", "motion")  # keys with names of files, relative to the machine file


class _Edit(NamedTuple):
    """New text for the characters from `first` to before `last`, and a comment for the end of the row."""

    first: int
    last: int
    text: str
    comment: str


def machine_text(found: Identification, source: Path, folder: Path) -> str:
    """The text of `source` with the identified values, for a file in `folder`.

    Raises RunError for a value that is at no single place of the file.
    """
    text = source.read_bytes().decode("utf-8-sig")
    places = read_toml(source)[1]
    edits = [*_of_files(places, text, source, folder)]

    def change(path: KeyPath, value: float, unit: str, comment: str, lacking: str) -> None:
        """Add the change that sets a key. Raises RunError with the text `lacking` if the file has no place for it."""
        edit = _edit(path, value, unit, comment, places, text)
        if edit is None:
            raise RunError(lacking)
        edits.append(edit)

    for parameter, value, estimate in found.identified:
        path, unit = key_path(found.nominal, parameter), parameter.unit
        no_place = f"{parameter.path}: the machine file has no place for the"
        way_out = f"write {'.'.join(str(key) for key in path)} as a number into the machine file"
        comment = _comment(found, estimate.name, estimate, estimate.unit)
        change(path, value, unit, comment, f"{no_place} identified value; {way_out}")
        if path[:2] == ("body", "inertia") and path[2] != path[3]:
            way_out = f"write body.inertia[{path[3]}][{path[2]}] as a number into it"
            change((*path[:2], path[3], path[2]), value, unit, "", f"{no_place} mirrored value: {way_out}")
    own = [one for data in found.data for one in found.nuisance_estimates(data) if one.parameter.key]
    for one in {one.parameter.key: one for one in own}.values():  # data sets share what has a key
        number, keys = one.parameter, tuple(one.parameter.key.split("."))
        comment = _comment(found, number.name, one, number.unit)
        lacking = f"{number.key}: the machine file has no table [{keys[0]}] for the identified value: add one"
        change(keys, one.value, number.unit, comment, lacking)
    for edit in sorted(edits, reverse=True):
        text = _with_comment(text[: edit.first] + edit.text + text[edit.last :], edit)
    return text.replace("\r\n", "\n").replace("\n", "\r\n") if "\r\n" in text else text


def _with_comment(text: str, edit: _Edit) -> str:
    end = text.find("\n", edit.first + len(edit.text))
    end = len(text) if end < 0 else end - (text[end - 1] == "\r")
    return f"{text[:end]}  # {edit.comment}{text[end:]}" if edit.comment else text


def _edit(
    path: KeyPath, value: float, unit: str, comment: str, places: dict[KeyPath, TomlPlace], text: str
) -> _Edit | None:
    """The change that sets a key; None if the file has neither the key nor a table for it."""
    place = places.get(path)
    if place is not None and place.text:
        written = _in_unit_as_written(text[place.first : place.last], value, unit)
        return _Edit(place.first, place.last, written, comment)
    table = places.get(path[:-1])
    if table is None or isinstance(path[-1], int):
        return None
    row = f"{path[-1]} = {_in_unit_as_written('', value, unit)}"
    if not table.text:  # the header of a table
        return _Edit(table.last, table.last, f"\n{row}", comment)
    if text[table.first] == "{":
        return _Edit(table.first + 1, table.first + 1, f" {row},", comment)
    return None


def _in_unit_as_written(written: str, value: float, unit: str) -> str:
    """The value in the unit in which the old one is written; a plain number is in SI."""
    match = re.fullmatch(r"""["']\s*[-+\d.eE]+\s*(\S.*?)\s*["']""", written)
    if match is None:
        return f"{value:.{DIGITS}g}"
    try:
        return _quoted(f"{value / factor(match[1], unit):.{DIGITS}g} {match[1]}")
    except ValueRefused:
        return f"{value:.{DIGITS}g}"


def _comment(
    found: Identification, name: str, estimate: UnknownEstimate | NuisanceEstimate, unit: str
) -> str:
    """Interval and source of an identified value; of one that is not, what is known of it together with others."""
    source = ", ".join(each.name for each in found.data)
    if not estimate.is_identified:
        words = next((f": {one.words}" for one in found.undetermined if name in one.names), "")
        return f"NOT identified by {source}{words}"
    usual, scale = usual_unit(unit)
    reach = f"95 % interval {scale * estimate.low:.4g} to {scale * estimate.high:.4g}"
    if unit == "1":
        return f"times {estimate.value:.4g}, {reach}, from {source}"
    return f"{reach} {usual}, from {source}"


def _of_files(places: dict[KeyPath, TomlPlace], text: str, source: Path, folder: Path) -> Iterator[_Edit]:
    """Names of files that are relative to the machine file, as seen from the new folder."""
    for path, place in places.items():
        if path[-1] in FILES:
            name = text[place.first : place.last].strip("\"'")
            new = os.path.relpath(source.parent / name, folder)
            yield _Edit(place.first, place.last, _quoted(new.replace(os.sep, "/")), "")


# ---- the study file


SMALLEST = (5e-3, 1e-3, 1e-4, 0.0)  # correlations below are left out if the others are possible without them
INSIDE = 1.0 - 1e-6  # factor on all correlations: rounding must not make their matrix singular


def study_text(found: Identification, machine: str, trace: str) -> str:
    """The study file, with the identified values as medians. machine: name of the machine file with these values."""
    rows = [
        "# Loads of the machine as identified: the distributions are what is known of it after the measurement.",
        f"machine = {_quoted(machine)}",
        f"trace = {_quoted(trace)}",
        "samples = 1024",
        "seed = 1",
    ]
    for one, reach in zip(found.unknowns, found.intervals, strict=True):
        sigma = (reach.high - reach.low) / (2.0 * NORMAL_QUANTILE)
        kind, width = (
            ("normal", f'"{sigma:.6g} {one.unit}"') if one.additive else ("lognormal", f"{sigma:.6g}")
        )
        rows += [
            "",
            "[[vary]]",
            f"name = {_quoted(one.name)}",
            f"path = [{', '.join(map(_quoted, one.targets))}]",
            f"distribution = {_quoted(kind)}",
            f"sigma = {width}",
        ]
    correlation = _written(found.correlation)
    for i, j in combinations(range(len(found.unknowns)), 2):
        if value := float(correlation[i, j]):
            names = ", ".join(_quoted(found.unknowns[k].name) for k in (i, j))
            rows += ["", "[[correlation]]", f"between = [{names}]", f"value = {value!r}"]
    return "\n".join(rows) + "\n"


def _written(correlation: Array) -> Array:
    """The correlations that are written, 0 for those that are left out; the matrix stays positive definite."""
    inside = correlation * INSIDE
    for smallest in SMALLEST:
        written = np.where(abs(inside) >= smallest, inside, 0.0)
        np.fill_diagonal(written, 1.0)
        if np.linalg.eigvalsh(written)[0] > 0.1 * (1.0 - INSIDE):
            break
    return written


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
