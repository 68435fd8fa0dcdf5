"""No number that is not finite is printed or stored, and every number of a file has a range."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pandas as pd
import pytest
from command_line import MACHINE, guideload, refused

from guideload import Machine, Motion, Moves, simulate
from guideload.base.errors import NotFinite
from guideload.base.finite import finite_json, require_finite, require_finite_table
from guideload.cli.file_schema import file_schema
from guideload.cli.inputs import EXAMPLES
from guideload.cli.options import FileKind
from guideload.reports.report import Column
from guideload.simulation.result import Result

MOVES = str(EXAMPLES / "moves.toml")


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_json_arrays_and_tables_refuse_it_by_its_place(value: float) -> None:
    with pytest.raises(NotFinite, match=r"^a\.b\[1\]: the result is"):
        finite_json({"a": {"b": [1.0, value]}, "c": None})
    with pytest.raises(NotFinite, match="^force: the result is"):
        require_finite("force", np.array([1.0, value]))
    with pytest.raises(NotFinite, match="^x: the result is"):
        require_finite_table(pd.DataFrame({"x": [value]}))
    assert json.loads(finite_json({"a": [1.5, None, "nan"]})) == {"a": [1.5, None, "nan"]}


def test_a_column_of_a_report_refuses_nan_and_has_a_word_for_infinity() -> None:
    with pytest.raises(NotFinite, match="^force: the result is"):
        _ = Column("force", [1.0, math.nan], "N", "3 digits").cells
    assert Column("life", [1.0, math.inf], "h", "3 digits").cells == ["1", "unlimited"]


def test_an_empty_cell_and_a_name_are_no_such_number() -> None:
    require_finite_table(pd.DataFrame({"x": [math.nan, 1.0], "name": ["nan", "inf"]}), optional=["x"])
    with pytest.raises(NotFinite):
        require_finite_table(pd.DataFrame({"x": [math.inf]}), optional=["x"])
    assert Column("carriage", ["nan", "Nancy"]).cells == ["nan", "Nancy"]


@pytest.mark.parametrize("name", ["loads.nc", "loads.parquet", "loads.csv"])
def test_a_motion_that_is_known_exactly_has_an_unlimited_band_in_every_file(
    tmp_path: Path, name: str
) -> None:
    machine, motion = Machine.from_toml(MACHINE), Moves.from_toml(MOVES).motion()
    write = {".nc": Result.to_netcdf, ".parquet": Result.to_parquet, ".csv": Result.to_csv}[Path(name).suffix]
    result = simulate(machine, motion, times=[0.1, 0.2])
    write(result, tmp_path / name)
    if not name.endswith(".csv"):
        again = Result.load(tmp_path / name)
        assert again.data.attrs["motion_bandwidth_Hz"] == "unlimited"
        assert again.audit.lines == result.audit.lines
    else:
        text = (tmp_path / "loads.json").read_text(encoding="utf-8")
        json.loads(text, parse_constant=lambda word: pytest.fail(f"{word} is no JSON"))


def test_a_result_with_such_a_number_is_not_written(tmp_path: Path) -> None:
    time = np.arange(50) * 0.01
    result = simulate(Machine.from_toml(MACHINE), Motion.along_x(time, np.sin(time)))
    result.data["force"].values = np.where(result.data["force"].values > 0, np.nan, 1.0)
    for write in (result.to_netcdf, result.to_parquet, result.to_csv):
        with pytest.raises(NotFinite, match="^force: "):
            write(tmp_path / {"to_netcdf": "a.nc", "to_parquet": "a.parquet"}.get(write.__name__, "a.csv"))
    assert not list(tmp_path.iterdir())


def _numbers(place: str, schema: Any) -> Any:
    """Numbers of a schema that have a unit, with their places."""
    if isinstance(schema, dict):
        if "x-unit" in schema:
            yield place, schema
        for key, value in schema.items():
            yield from _numbers(f"{place}.{key}", value)
    elif isinstance(schema, list):
        for value in schema:
            yield from _numbers(place, value)


@pytest.mark.parametrize("kind", get_args(FileKind))
def test_every_number_of_a_file_has_a_range(kind: FileKind) -> None:
    found = list(_numbers(kind, file_schema(kind)))
    assert found
    assert [place for place, one in found if not ("minimum" in one and "maximum" in one)] == []


def test_the_packaged_gantry_has_an_effect_of_every_number() -> None:
    shown = guideload("sensitivities", EXAMPLES / "gantry.toml", MOVES).stdout
    assert "nan" not in shown and "body.mass" in shown and "+2.66" in shown


HUGE = [("period", "1e308 s"), ("cycles", "1e300"), ("cycles", "nan"), ("period", "1e-300 s")]


@pytest.mark.parametrize(("key", "value"), HUGE)
def test_a_duty_that_nobody_runs_is_refused_at_its_key(tmp_path: Path, key: str, value: str) -> None:
    numbers = {"period": '"8 h"', "cycles": "100"} | {key: value if value == "nan" else f'"{value}"'}
    text = f'machine = "m.toml"\nperiod = {numbers["period"]}\n[[cases]]\nname = "a"\nmotion = "m.toml"\n'
    (tmp_path / "m.toml").write_text("", encoding="utf-8")
    (tmp_path / "duty.toml").write_text(f"{text}cycles = {numbers['cycles']}\n", encoding="utf-8")
    assert f"{key}: expected" in refused("duty", tmp_path / "duty.toml")


@pytest.mark.parametrize("line", ["product = {}", "product = []", "preload_class = []", "preload_class = {}"])
def test_a_name_that_is_no_text_is_refused_at_its_key(tmp_path: Path, line: str) -> None:
    text = Path(MACHINE).read_text(encoding="utf-8").replace("name =", 'catalogue = "c.toml"\nname =', 1)
    lines = line if line.startswith("product") else f'product = "HGH25CA"\n{line}'
    (tmp_path / "m.toml").write_text(text.replace('name = "1a"', f'name = "1a"\n{lines}'), encoding="utf-8")
    catalogue = (EXAMPLES / "catalogue.toml").read_text(encoding="utf-8")
    (tmp_path / "c.toml").write_text(catalogue, encoding="utf-8")
    assert f"carriages[0].{line.split()[0]}: expected" in refused("check", tmp_path / "m.toml")


IDENTIFY = [
    ("shape = [0.99,", "shape = [nan,", "shape[0]"),
    ("shape = [0.99,", "shape = [1e308,", "shape[0]"),
    ("spread = 0.5", "spread = 5e8", "spread"),
    ("spread = 0.5", "spread = nan", "spread"),
    ("spread = 0.5", "spread = 1e-200", "spread"),
    ('"4.791 Hz"', '"1e308 Hz"', "frequency"),
]


@pytest.mark.parametrize(("old", "new", "key"), IDENTIFY)
def test_measurements_that_nobody_made_are_refused_at_their_key(
    tmp_path: Path, old: str, new: str, key: str
) -> None:
    for name in ("gantry.toml", "moves.toml"):
        (tmp_path / name).write_bytes((EXAMPLES / name).read_bytes())
    text = (EXAMPLES / "identify.toml").read_text(encoding="utf-8")
    (tmp_path / "identify.toml").write_text(text.replace(old, new, 1), encoding="utf-8")
    assert f"{key}: expected" in refused("identify", tmp_path / "identify.toml")


@pytest.mark.parametrize("period", ["1e308", "1e-308", "nan", "1 us"])
def test_a_monitor_of_an_impossible_period_is_refused(tmp_path: Path, period: str) -> None:
    options = ("--travel-per-count", "20 um", "--lag", 20, "-o", tmp_path / "m.toml")
    message = refused("monitor", "build", MACHINE, MOVES, "--period", period, *options)
    assert "period: " in message or "value for '--period': " in message
