"""Measured frequency responses from tables and from universal files (UFF, datasets 58 and 164)."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from guideload.base.errors import ArgumentError, TraceError, ValueRefused
from guideload.base.number_text import joined
from guideload.base.units import factor
from guideload.identification.model import SensorPlace, parse_place
from guideload.identification.responses import ResponseCurve
from guideload.machine.machine import Machine
from guideload.study.varied_parameters import column_numbers, name_and_unit
from guideload.traces.format.sources import load_table

# Unit of a response, by the number of derivatives of the displacement by time.
UNITS = ("m/N", "m/s/N", "m/s^2/N")
# Of universal files.
FREQUENCY_RESPONSE = 4  # function type
COMPLEX = (5, 6)  # types of ordinates
RESPONSES = {8: 0, 11: 1, 12: 2}  # what an ordinate is: displacement, velocity, acceleration
FORCES = (0, 9, 13)  # of a denominator: unknown, reaction force, excitation force
FREQUENCIES = (0, 18)  # of an abscissa: unknown, frequency
AXES = {1: "x", 2: "y", 3: "z"}
NO_LABEL = ("", "NONE", "NO LABEL", "-")
HERTZ = ("", "hz", "hertz")  # labels of an abscissa in Hz
GRAVITY = re.compile("^(g|gn|g_n)(?=/|$)", re.IGNORECASE)  # standard gravity, alone or per force
# A delimiter begins and ends a dataset; binary data may stand before it on its line.
DELIMITER = re.compile(rb"    -1(?:[\r\n]| {74}|\Z)")
SAME_UNIT = 1e-3  # relative difference of two factors that mean one unit


def is_universal(file: str | Path) -> bool:
    """Whether the name of a file is that of a universal file."""
    return Path(file).suffix.lower() in (".uff", ".unv", ".uf")


def read_curves(
    file: Path, machine: Machine, force: str | None, nodes: dict[str, str], low: float, high: float
) -> tuple[ResponseCurve, ...]:
    """The responses in a file, from `low` to `high` [Hz].

    force: where it acts, of a table. nodes: names of points by the number of the node, of a universal file. Raises
    ValueRefused, TraceError, ArgumentError (pyuff is not installed).
    """
    read = list(
        _of_universal(file, machine, nodes) if is_universal(file) else _of_table(file, machine, force)
    )
    curves = []
    for curve in read:
        if not np.isfinite(curve.value).all() or not np.isfinite(curve.frequency).all():
            raise ValueRefused(
                "finite numbers", "nan or inf", f"in the response of {curve.name} in {file.name}"
            )
        inside = (curve.frequency >= low) & (curve.frequency <= high) & (curve.frequency > 0.0)
        if not inside.any():
            continue
        if not curve.value[inside].any():
            raise ValueRefused("a response", "zeros alone", f"of {curve.name} in {file.name}: leave it out")
        curves.append(replace(curve, frequency=curve.frequency[inside], value=curve.value[inside]))
    if not curves:
        raise ValueRefused("frequency responses in the wanted range", file.name, "it has none there")
    return tuple(curves)


def _of_table(file: Path, machine: Machine, force: str | None) -> Iterator[ResponseCurve]:
    """Curves of a table with columns "frequency [Hz]", "tool y re [m/N]" and "tool y im [m/N]"."""
    if force is None:
        raise ValueRefused("the place of the force", None, 'add force = "tool y"')
    hit, table = parse_place(force, machine), load_table(file)
    names = {name_and_unit(header)[0]: header for header in table.names}
    if len(names) < len(table.names):
        twice = next(one for one in names if sum(name_and_unit(each)[0] == one for each in table.names) > 1)
        raise ValueRefused("each column once", twice, f"in {table.source}: leave one of them out")
    if "frequency" not in names:
        raise ValueRefused('a column "frequency [Hz]"', table.names[:4], f"{table.source} lacks it")
    frequency = column_numbers(table, names["frequency"], "Hz")[0]
    places = [name[:-3] for name in names if name.endswith(" re") and f"{name[:-3]} im" in names]
    if not places:
        words = 'columns such as "tool y re [m/N]" and "tool y im [m/N]"'
        raise ValueRefused(words, table.names[:4], "as `guideload response --csv` writes them")
    for place in places:
        header = names[f"{place} re"]
        derivatives = _derivatives(name_and_unit(header)[1], header)
        re, im = (
            column_numbers(table, names[f"{place} {part}"], UNITS[derivatives])[0] for part in ("re", "im")
        )
        yield ResponseCurve(hit, parse_place(place, machine), derivatives, frequency, re + 1j * im)


def _derivatives(unit: str, header: str) -> int:
    """The kind of a response by its unit: m/N 0, m/s/N 1, m/s^2/N or 1/kg 2."""
    for derivatives, known in enumerate(UNITS):
        if _known(unit or UNITS[0], known) is not None:
            return derivatives
    raise ValueRefused(f"a response in {joined(UNITS)}", header)


def _known(label: str, unit: str) -> float | None:
    """Factor of the unit of a label to another one; None for a label that is no such unit."""
    try:
        return factor(label, unit)
    except ValueRefused:
        return None


def _of_universal(file: Path, machine: Machine, nodes: dict[str, str]) -> Iterator[ResponseCurve]:
    """Curves of a universal file."""
    sets = _sets(file)
    units = next((one for one in sets if one.get("type") == 164), None)
    for number, one in enumerate(sets, 1):
        if one.get("type") != 58 or one.get("func_type") != FREQUENCY_RESPONSE:
            continue
        where = f"dataset {number} of {file.name}"
        kind = int(one.get("ordinate_spec_data_type", 0))
        if kind not in RESPONSES:
            raise ValueRefused(
                "responses in displacement, velocity or acceleration", f"ordinate type {kind}", where
            )
        for name, allowed, words in (
            ("orddenom_spec_data_type", FORCES, "responses per force"),
            ("abscissa_spec_data_type", FREQUENCIES, "responses over frequency"),
            ("ord_data_type", COMPLEX, "complex responses"),
        ):
            if int(one.get(name, allowed[0])) not in allowed:
                raise ValueRefused(words, f"{name} {one[name]}", where)
        value, frequency = np.asarray(one["data"], np.complex128), np.asarray(one["x"], np.float64)
        stated = int(one.get("num_pts", value.size))
        if not stated == value.size == frequency.size:
            raise ValueRefused(
                f"{stated} values, as its header says", value.size, f"{where}: it is damaged; export it again"
            )
        hit, place = (_place(one, which, machine, nodes) for which in ("ref", "rsp"))
        to_hertz, to_si = _hertz(one, where), _factor(one, RESPONSES[kind], units, where)
        yield ResponseCurve(hit, place, RESPONSES[kind], to_hertz * frequency, to_si * value)


def _sets(file: Path) -> list[dict[str, Any]]:
    """The datasets of a universal file. Raises TraceError for one that is cut off or cannot be read."""
    try:
        import pyuff
    except ImportError:
        raise ArgumentError(
            f"{file}: universal files are read by the package pyuff: pip install 'guideload[uff]', or export a CSV file"
        ) from None
    if len(DELIMITER.findall(file.read_bytes())) % 2:
        raise TraceError(f"{file}: its last dataset has no end: it is cut off; export it again")
    try:
        found = pyuff.UFF(str(file)).read_sets()
    except Exception as error:  # pyuff raises no type of its own
        raise TraceError(
            f"{file}: no readable universal file: {error}; export it again, or as a table"
        ) from None
    return found if isinstance(found, list) else [found]


def _label(one: dict[str, Any], axis: str) -> str:
    """The unit that labels an axis of a response; "" if it has none."""
    label = str(one.get(f"{axis}_axis_units_lab") or "").strip()
    return "" if label.upper() in NO_LABEL else label


def _hertz(one: dict[str, Any], where: str) -> float:
    """Factor of the frequencies of a response to Hz, of the label of their axis."""
    label = _label(one, "abscissa")
    if label.lower() in HERTZ:
        return 1.0
    for unit, in_hertz in (("Hz", 1.0), ("rad/s", 0.5 / math.pi)):
        if (known := _known(label, unit)) is not None:
            return in_hertz * known
    expected = "a label of the frequencies such as Hz or rad/s"
    raise ValueRefused(expected, label, f"{where}; correct it, or export a table")


def _factor(one: dict[str, Any], derivatives: int, units: dict[str, Any] | None, where: str) -> float:
    """Factor of the values of a response to SI per newton: of the labels of its axes, else of the units of the file.

    units: dataset 164, whose factors are file units per SI unit; without labels and units, values are in SI. Raises
    ValueRefused for a label that is no such unit, and for labels and units that contradict each other.
    """
    over, under = _label(one, "ordinate"), _label(one, "orddenom")
    given = " per ".join(label for label in (over, under) if label)
    length, force = (1.0 if units is None else 1.0 / float(units[key]) for key in ("length", "force"))
    response, plain = UNITS[derivatives].removesuffix("/N"), over.replace("(", "").replace(")", "")
    known = GRAVITY.sub("g_0", plain) if derivatives == 2 else plain
    of_labels = _known(known, UNITS[derivatives])  # the label of the ratio
    if of_labels is None:
        displacement = _known(known, response) if over else length
        newtons = _known(under, "N") if under else force
        if displacement is None or newtons is None:
            words = f"unit labels such as {response} and N"
            raise ValueRefused(words, given, f"{where}; correct them, or export a table")
        of_labels = displacement / newtons
    if units is not None and abs(of_labels * force / length - 1.0) > SAME_UNIT:
        raise ValueRefused(
            "labels of the units of the file",
            given,
            f"{where}: dataset 164 says {str(units.get('units_description')).strip()}; correct one of them",
        )
    return of_labels


def _place(one: dict[str, Any], which: str, machine: Machine, nodes: dict[str, str]) -> SensorPlace:
    node, direction = str(int(one[f"{which}_node"])), int(one[f"{which}_dir"])
    if abs(direction) not in AXES:
        raise ValueRefused("directions 1 to 3, x to z", direction, f"of node {node}")
    sign = "-" if direction < 0 else ""
    return parse_place(f"{nodes.get(node, node)} {sign}{AXES[abs(direction)]}", machine)
