"""`guideload identify` with records in time: files of a trace, of a motor and of accelerometers in; numbers out."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from command_line import guideload, refused
from machines import having, with_mass
from motor_records import MASS, OFFSET, SEAL, TOOL, VISCOUS, axis, counted, force_of, moves, shown_by
from unrendered import leave_unrendered

from guideload.base.arrays import Array
from guideload.identification.model import parse_place
from guideload.identification.sensor_log import Channel

IDENTIFY = """
machine = "machine.toml"
[[unknown]]
path = "body.mass"
[[motor_forces]]
trace = "trace.csv"
column = "current [A]"
per_unit = "25 N"
[[sensor_logs]]
name = "accelerometer"
trace = "trace.csv"
reading = { column = "x [m]" }
file = "log.csv"
channels = [{ column = "ay [m/s^2]", place = "tool y", gain_spread = 0.02 }]
"""


def written(file: Path, header: str, *columns: Array) -> None:
    np.savetxt(file, np.column_stack(columns), fmt="%.9g", delimiter=",", header=header, comments="")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files of an axis of 95 kg, whose machine file says 80 kg, and what the command wrote."""
    folder, rng = tmp_path_factory.mktemp("records"), np.random.default_rng(0)
    motion, true = moves(2.4, 2e-3), axis(points=[TOOL])
    nominal = having(true, friction={"seal": 0.5 * SEAL, "viscous": 0.5 * VISCOUS})
    with_mass(nominal, 80.0).to_toml(folder / "machine.toml")
    (folder / "identify.toml").write_text(IDENTIFY, encoding="utf-8")
    force = force_of(true, motion, motion.time) + OFFSET + 2.0 * rng.standard_normal(motion.time.size)
    written(folder / "trace.csv", "t [s],x [m],current [A]", motion.time, counted(motion), force / 25.0)
    time = np.arange(0.2, 2.2, 2e-3)
    shown = shown_by(true, motion, [Channel(parse_place("tool y", true))], time)[:, 0]
    shown = shown + 0.1 * shown.std() * rng.standard_normal(time.size)
    written(folder / "log.csv", "t [s],ay [m/s^2]", time + 7.5, shown)
    with pytest.MonkeyPatch.context() as patched:
        leave_unrendered(patched)
        guideload("identify", folder / "identify.toml", "-o", folder / "out")
    return folder


def test_mass_friction_and_delay_are_found(folder: Path) -> None:
    found = json.loads((folder / "out" / "identification.json").read_text(encoding="utf-8"))
    mass = found["estimates"][0]
    assert mass["value"] == pytest.approx(MASS, rel=0.003) and mass["high"] - mass["low"] < 0.01 * MASS
    nuisance = {one["name"]: one for one in found["own_numbers"]}
    assert nuisance["friction.seal in motor force"]["value"] == pytest.approx(10.0, rel=0.1)
    assert nuisance["delay of accelerometer"]["value"] == pytest.approx(7.5, abs=2e-3)
    words = " ".join((folder / "out" / "report.txt").read_text(encoding="utf-8").split())
    assert "Sensors: accelerometer" in words and re.search(r"the model explains (99\.\d*|100) %", words)
    assert (folder / "out" / "record_2.png").is_file()


def test_a_log_that_contradicts_the_model_is_warned_of_first(folder: Path) -> None:
    """Its header says m/s^2, its numbers are in g, or in mm/s^2."""
    time, along = np.loadtxt(folder / "log.csv", delimiter=",", skiprows=1).T
    text = IDENTIFY.replace("log.csv", "wrong_unit.csv").replace(", gain_spread = 0.02", "")
    (folder / "wrong_unit.toml").write_text(text, encoding="utf-8")
    for wrong in (1.0 / 9.80665, 1e3):
        written(folder / "wrong_unit.csv", "t [s],ay [m/s^2]", time, wrong * along)
        words = " ".join(guideload("identify", folder / "wrong_unit.toml").stdout.split())
        assert "Acceleration of tool y in accelerometer contradicts the model, which explains" in words
        factor = float(words.partition("of its variance; it is ")[2].split()[0].replace("\u202f", ""))
        assert factor < 0.5 if wrong < 1.0 else factor > 2.0
    report = (folder / "out" / "report.txt").read_text(encoding="utf-8")
    assert "contradicts" not in report and " late" not in report and " early" not in report


def test_a_force_that_is_late_is_warned_of(folder: Path) -> None:
    """By 6 ms, three stamps; its delay is not sought."""
    rows = np.loadtxt(folder / "trace.csv", delimiter=",", skiprows=1)
    rows[3:, 2] = rows[:-3, 2]
    written(folder / "late.csv", "t [s],x [m],current [A]", *rows.T)
    text = IDENTIFY.partition("[[sensor_logs]]")[0].replace("trace.csv", "late.csv")
    (folder / "late.toml").write_text(text, encoding="utf-8")
    words = " ".join(guideload("identify", folder / "late.toml").stdout.split())
    told = re.search(r"Motor force is about ([\d.]+) ms late", words)
    assert told and 3.0 < float(told[1]) < 8.0
    (folder / "sought.toml").write_text(text.replace("per_unit", "delay = true\nper_unit"), encoding="utf-8")
    assert " late" not in guideload("identify", folder / "sought.toml").stdout


def test_a_number_at_a_bound_of_its_search_is_not_identified(folder: Path) -> None:
    """The force of a motor that says nothing of the mass: a constant one."""
    rows = np.loadtxt(folder / "trace.csv", delimiter=",", skiprows=1)
    rows[:, 2] = 0.2
    written(folder / "dead.csv", "t [s],x [m],current [A]", *rows.T)
    text = IDENTIFY.partition("[[sensor_logs]]")[0].replace("trace.csv", "dead.csv")
    (folder / "dead.toml").write_text(text, encoding="utf-8")
    words = " ".join(guideload("identify", folder / "dead.toml").stdout.split())
    assert "0 of 1 number identified" in words and "Body.mass lies at a bound of its search" in words


def test_wrong_tables_name_their_place(folder: Path) -> None:
    for before, after, words in (
        ('"current [A]"', '"voltage"', "no column 'voltage'; there are t [s], x [m], current [A]"),
        ('"tool y"', '"spindle y"', "sensor_logs[0]: expected a point and an axis"),
        ('per_unit = "25 N"', 'per_unit = "25 V"', "motor_forces[0]"),
        ('per_unit = "25 N"', 'per_unit = "25e-320 N"', "a force that reaches 1e-09 N in the column"),
        ('per_unit = "25 N"', "", "column current [A]"),
        (
            "per_unit",
            'part = ["3 s", "1 s"]\nper_unit',
            "motor_forces[0].part: expected a first instant before",
        ),
        ('file = "log.csv"', 'file = "logs.csv"', "logs.csv"),
        (
            'trace = "trace.csv"\nreading',
            'trace = "moves.toml"\nreading',
            "sensor_logs[0].reading: expected no",
        ),
    ):
        (folder / "wrong.toml").write_text(IDENTIFY.replace(before, after), encoding="utf-8")
        assert words in refused("identify", folder / "wrong.toml")
