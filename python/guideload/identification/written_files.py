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
from guideload.base.toml import Place, read_toml
from guideload.base.units import factor
from guideload.identification.result import Identification, NuisanceEstimate, UnknownEstimate
from guideload.identification.uncertainty import NORMAL_QUANTILE
from guideload.identification.unknowns import AXES, CROSS, KINDS, usual_unit
from guideload.parameters.parameters import Parameter

# ---- the machine file


DIGITS = 6  # of a value: more than any measurement has
ROUNDING = 1e-5  # relative difference that these digits may make
FILES = ("straightness_file",)  # keys of rails with names of files, relative to the machine file


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
    for parameter, value, estimate in found.identified:
        edits += _of_value(found, parameter, value, estimate, places, text)
    for one in (one for data in found.data if data.nuisance for one in found.nuisance_estimates(data)):
        if one.parameter.key:
            edits.append(_of_key(one, places, text, found))
    for edit in sorted(edits, reverse=True):
        text = _with_comment(text[: edit.first] + edit.text + text[edit.last :], edit)
    return text.replace("\r\n", "\n").replace("\n", "\r\n") if "\r\n" in text else text


def _with_comment(text: str, edit: _Edit) -> str:
    end = text.find("\n", edit.first + len(edit.text))
    end = len(text) if end < 0 else end - (text[end - 1] == "\r")
    return f"{text[:end]}  # {edit.comment}{text[end:]}" if edit.comment else text


def _of_value(
    found: Identification,
    parameter: Parameter,
    value: float,
    estimate: UnknownEstimate,
    places: dict[KeyPath, Place],
    text: str,
) -> Iterator[_Edit]:
    """The changes that set one parameter."""
    path, comment = _key_path(found, parameter), _comment(estimate, found)
    mirrored = (*path[:2], path[3], path[2]) if path[:2] == ("body", "inertia") else path
    for one in dict.fromkeys((path, mirrored)):
        if (place := places.get(one)) is not None and place.text:
            written = _in_unit_as_written(text[place.first : place.last], value, parameter.unit)
            yield _Edit(place.first, place.last, written, comment if one == path else "")
        elif len(one) == 3 and one[0] in KINDS.values() and (header := places.get(one[:2])) is not None:
            if text[header.first] != "[":  # a table within braces
                written = f" {one[2]} = {_in_unit_as_written('', value, parameter.unit)},"
                yield _Edit(header.first + 1, header.first + 1, written, comment)
            else:
                written = f"\n{one[2]} = {_in_unit_as_written('', value, parameter.unit)}"
                yield _Edit(header.last, header.last, written, comment)
        else:
            way_out = f"write {'.'.join(str(key) for key in path)} as a number into the machine file"
            raise RunError(
                f"{parameter.path}: the machine file has no place for the identified value; {way_out}"
            )


def _of_key(
    estimate: NuisanceEstimate, places: dict[KeyPath, Place], text: str, found: Identification
) -> _Edit:
    """The change that sets a key such as "friction.coefficient", which a table of the file must have."""
    nuisance, value = estimate.parameter, estimate.value
    path = tuple(nuisance.key.split("."))
    written = _in_unit_as_written("", value, nuisance.unit)
    reach = f"95 % interval {estimate.low:.4g} to {estimate.high:.4g} {nuisance.unit}"
    comment = f"{reach}, from {', '.join(each.name for each in found.data)}"
    if not estimate.is_identified:
        comment = _not_identified(nuisance.name, found)
    if (place := places.get(path)) is not None and place.text:
        return _Edit(
            place.first,
            place.last,
            _in_unit_as_written(text[place.first : place.last], value, nuisance.unit),
            comment,
        )
    if (header := places.get(path[:-1])) is not None and text[header.first] == "[":
        return _Edit(header.last, header.last, f"\n{path[-1]} = {written}", comment)
    table = ".".join(path[:-1])
    raise RunError(
        f"{nuisance.key}: the machine file has no table [{table}] for the identified value: add one"
    )


def _key_path(found: Identification, parameter: Parameter) -> KeyPath:
    """The keys of a parameter in a machine file: ("carriages", 0, "stiffness_y"), ("rails", 1, "position", 0)."""
    head, _, key = parameter.path.rpartition("].")
    names = key.split(".")
    keys: list[str | int] = [*names]
    if names[:2] == ["body", "inertia"]:
        keys = ["body", "inertia", *(AXES.index(axis) for axis in names[2])]
    elif names[-1] in AXES:
        keys[-1] = AXES.index(names[-1]) - (names[-2] in CROSS)
    if not head:
        return tuple(keys)
    kind = head.partition("[")[0]
    parts = [part.name for part in getattr(found.nominal, kind)]
    owner = next(parameter.owners[one] for one, many in KINDS.items() if many == kind)
    return (kind, parts.index(owner), *keys)


def _in_unit_as_written(written: str, value: float, unit: str) -> str:
    """The value in the unit in which the old one is written; a plain number is in SI."""
    match = re.fullmatch(r"""["']\s*[-+\d.eE]+\s*(\S.*?)\s*["']""", written)
    if match is None:
        return f"{value:.{DIGITS}g}"
    try:
        return json.dumps(f"{value / factor(match[1], unit):.{DIGITS}g} {match[1]}", ensure_ascii=False)
    except ValueRefused:
        return f"{value:.{DIGITS}g}"


def _comment(estimate: UnknownEstimate, found: Identification) -> str:
    """Interval and source of an identified value."""
    source = ", ".join(each.name for each in found.data)
    if not estimate.is_identified:
        return _not_identified(estimate.name, found)
    unit, scale = usual_unit(estimate.unit)
    low, high = f"{scale * estimate.low:.4g}", f"{scale * estimate.high:.4g}"
    if estimate.unit == "1":
        return f"times {estimate.value:.4g}, 95 % interval {low} to {high}, from {source}"
    return f"95 % interval {low} to {high} {unit}, from {source}"


def _not_identified(name: str, found: Identification) -> str:
    """That a number is not identified, and what is known of it together with others."""
    words = next((one.words for one in found.undetermined if name in one.names), "")
    return f"NOT identified by {', '.join(each.name for each in found.data)}" + (
        f": {words}" if words else ""
    )


def _of_files(places: dict[KeyPath, Place], text: str, source: Path, folder: Path) -> Iterator[_Edit]:
    """Names of files that are relative to the machine file, as seen from the new folder."""
    for path, place in places.items():
        if path == ("catalogue",) or (path[0] == "rails" and path[-1] in FILES):
            name = text[place.first : place.last].strip("\"'")
            new = os.path.relpath(source.parent / name, folder)
            yield _Edit(place.first, place.last, json.dumps(new.replace(os.sep, "/"), ensure_ascii=False), "")


# ---- the study file


SMALLEST = (5e-3, 1e-3, 1e-4, 0.0)  # correlations below are left out if the others are possible without them
INSIDE = 1.0 - 1e-6  # factor on all correlations: rounding must not make their matrix singular


def study_text(found: Identification, machine: str, trace: str, samples: int = 1024) -> str:
    """The study file; machine: the file with the identified values, which are the medians."""
    rows = [
        "# Loads of the machine as identified: the distributions are what is known of it after the measurement.",
        f"machine = {_quoted(machine)}",
        f"trace = {_quoted(trace)}",
        f"samples = {samples}",
        "seed = 1",
        vary_text(found),
    ]
    return "\n".join(rows)


def vary_text(found: Identification) -> str:
    """The tables [[vary]] and [[correlation]] of a study."""
    rows: list[str] = []
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
