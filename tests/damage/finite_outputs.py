"""Whether all numbers that a command printed or wrote are finite."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pyarrow.parquet as parquet

NOT_FINITE = re.compile(r"(?<![\w./-])[+-]?(?:nan|inf|infinity)(?![\w./-])", re.IGNORECASE)
SCRIPT = re.compile(
    r"<script[^>]*>(.*?)</script>", re.DOTALL
)  # of an HTML report: its program, or the data of a chart
TEXTS = (".txt", ".csv", ".toml", ".h", ".rs", ".svg")


def faults_of_text(text: str, name: str) -> list[str]:
    """The lines of a text that have a number that is not finite."""
    found = [line for line in text.splitlines() if NOT_FINITE.search(line)]
    return [f"{name}: {' '.join(line.split())[:200]}" for line in found[:3]]


def faults_of_json(text: str, name: str) -> list[str]:
    """What JSON does not have: NaN and Infinity."""

    def refuse(constant: str) -> None:
        raise ValueError(constant)

    try:
        json.loads(text, parse_constant=refuse)
    except ValueError as error:
        return [f"{name}: {error}"]
    return []


def faults(folder: Path) -> list[str]:
    """What is wrong in the files of a folder."""
    found: list[str] = []
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if path.name.endswith(".draft") or path.name == ".draft":
            found.append(f"{name}: a draft is left")
        if not path.is_file():
            continue
        if path.suffix == ".json":
            found += faults_of_json(path.read_text(encoding="utf-8"), name)
        elif path.suffix == ".html":
            text = path.read_text(encoding="utf-8")
            found += faults_of_text(SCRIPT.sub("", text), name)
            for script in SCRIPT.findall(text):
                found += _faults_of_chart(script, name) if script.startswith("{") else []
        elif path.suffix in TEXTS:
            found += faults_of_text(path.read_text(encoding="utf-8"), name)
        elif path.suffix == ".nc":
            found += _faults_of_hdf5(path, name)
        elif path.suffix == ".parquet":
            found += _faults_of_parquet(path, name)
    return found


def _faults_of_chart(script: str, name: str) -> list[str]:
    """Faults of the curves of a chart."""
    if wrong := faults_of_json(script, name):
        return wrong
    chart = json.loads(script)
    curves = [("time", chart["time"], "<f8")]
    curves += [(line["name"], line["values"], "<f4") for line in chart["lines"]]
    packed = ((label, np.frombuffer(base64.b64decode(text), kind)) for label, text, kind in curves)
    return [f"{name}: chart {chart['title']}: {label}" for label, one in packed if not np.isfinite(one).all()]


def _faults_of_hdf5(path: Path, name: str) -> list[str]:
    found: list[str] = []

    def look(key: str, item: Any) -> None:
        values = [(f"{key}@{each}", one) for each, one in item.attrs.items() if each != "_FillValue"]
        if isinstance(item, h5py.Dataset) and item.dtype.kind == "f":
            values.append((key, item[...]))
        for label, one in values:
            if isinstance(one, str):
                found.extend(_of_embedded(one, f"{name}: {label}"))
            elif np.asarray(one).dtype.kind == "f" and not np.isfinite(one).all():
                found.append(f"{name}: {label}")

    with h5py.File(path) as file:
        look("", file)
        file.visititems(look)
    return found


def _of_embedded(text: str, name: str) -> list[str]:
    """Faults of a text in a file of arrays: JSON, or words."""
    return faults_of_json(text, name) if text[:1] in ("{", "[") else faults_of_text(text, name)


def _faults_of_parquet(path: Path, name: str) -> list[str]:
    table = parquet.read_table(path)
    found = []
    for column in table.column_names:
        values = table[column].to_numpy()
        if values.dtype.kind == "f" and not np.isfinite(values[table[column].is_valid().to_numpy()]).all():
            found.append(f"{name}: {column}")
    for key, text in (table.schema.metadata or {}).items():
        if key != b"ARROW:schema":
            found += _of_embedded(text.decode(errors="replace"), f"{name}: @{key.decode()}")
    return found
