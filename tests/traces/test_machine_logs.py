"""Logs as machines write them: the same move from every layout, without an option where the file says all."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from command_line import guideload
from trace_files import refuses

from guideload.traces.channels import read_channels
from guideload.traces.reading import Trace, read_trace

COUNT, EVERY = 1200, 3
STAMPS = np.arange(COUNT)  # ms
PHASE = np.clip(STAMPS / 1000.0 - 0.1, 0.0, 1.0)
SETPOINT = np.round(100.0 * PHASE**3 * (10.0 - 15.0 * PHASE + 6.0 * PHASE**2), 4)  # mm
ACTUAL = np.round(np.interp(STAMPS - 4.0, STAMPS, SETPOINT), 4)[::EVERY]
# rpm, of a motor that moves the cart 20 mm per turn
SPEED = np.round(np.gradient(SETPOINT, 1e-3) * 60.0 / 20.0)


def beside(row: int, cells: str) -> str:
    """The cells of the slow channel, at the top of its columns; empty below."""
    return cells if row < len(ACTUAL) else "," * cells.count(",")


def gaps() -> str:
    """One clock; the actual position only in every third row."""
    rows = [
        f"{t};{x};{ACTUAL[t // EVERY] if t % EVERY == 0 else ''}"
        for t, x in zip(STAMPS, SETPOINT, strict=True)
    ]
    return "\n".join(["time [ms];setpoint position [mm];actual position [mm]", *rows])


def two_times() -> str:
    """A time column before each of the two positions."""
    rows = [
        f"{t},{x},{beside(t, f'{EVERY * t},{ACTUAL[min(t, len(ACTUAL) - 1)]}')}"
        for t, x in zip(STAMPS, SETPOINT, strict=True)
    ]
    return "\n".join(["t [ms],setpoint position [mm],t [ms],actual position [mm]", *rows])


def keys_and_values(unit: str = "mm", same_clock: bool = False) -> str:
    """A header of pairs of key and value, of a fast and a slow channel with a time column each."""
    head = [
        "\ufeffTimestamp,2024-01-31 14:05:06,Timestamp,2024-01-31 14:05:06",
        'Interval,0.001,Interval,0.003\r\nChannel name,"Force",Channel name,"Carriage"',
        f'Unit,"V",Unit,"{unit}"',
    ]
    step = 1 if same_clock else EVERY
    rows = [
        f"{t / 1000},{np.sin(t):.5f},{beside(t, f'{step * t / 1000},{ACTUAL[min(t, len(ACTUAL) - 1)]}')}"
        for t in (STAMPS[: len(ACTUAL)] if same_clock else STAMPS)
    ]
    return "\r\n".join([*head, *rows])


def row_by_row() -> str:
    """A row for each value: name, date, time of day, value; around midnight."""

    def row(name: str, t: int, value: float) -> str:
        day, time = divmod(86_399_500 + int(t), 86_400_000)
        seconds, ms = divmod(time, 1000)
        clock = f"{seconds // 3600:02d}:{seconds // 60 % 60:02d}:{seconds % 60:02d}.{ms:03d}"
        return f"AX:{name:12s} 2024-01-{30 + day} {clock} {value}  "

    rows = [(t, row("PosSet", t, x)) for t, x in zip(STAMPS, SETPOINT, strict=True)]
    rows += [(t, row("PosAct", t, x)) for t, x in zip(STAMPS[::EVERY], ACTUAL, strict=True)]
    return "\n".join(text for _, text in sorted(rows))


def servo(step: float = 1.0) -> str:
    """Channels in one row of names; in the next one what is connected to them, and the unit of the time."""
    head = f"Axis1\nNumber of sampling data,{COUNT}\nSampling time interval(ms),{step}\n"
    head += "Time,Analog 1,Analog 2,Digital 1\nms,Servo motor speed,Torque,INP\n"
    rows = (f"{step * t:.6f},{v:.6f},-1.100000,2.500000" for t, v in zip(STAMPS, SPEED, strict=True))
    return head + "\n".join(rows) + "\n"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "log.csv"


def read(file: Path, text: str, **options: object) -> Trace:
    file.write_text(text, encoding="utf-8")
    return read_trace(file, **options)


@pytest.mark.parametrize(
    "text",
    [gaps(), two_times(), keys_and_values(), keys_and_values().replace("Force", "Carriage")],
    ids=["gaps", "two times", "keys", "keys, equal names"],
)
def test_setpoints_and_actual_values_at_different_rates(file: Path, text: str) -> None:
    """No option is needed: names, units and times are in the file."""
    trace = read(file, text)
    assert trace.time == pytest.approx(np.arange(len(ACTUAL)) * 3e-3, abs=1e-12)
    assert trace.value == pytest.approx(1e-3 * ACTUAL, abs=1e-15)


def test_an_option_does_not_pair_a_slow_channel_with_the_time_of_a_fast_one(file: Path) -> None:
    """The move would be three times as fast."""
    trace = read(file, two_times(), repair="empty")
    assert trace.time[-1] == pytest.approx((len(ACTUAL) - 1) * 3e-3)


def test_a_row_for_each_value(file: Path) -> None:
    """Names say what is measured, but no unit: the message has the option."""
    refuses("AX:PosAct, AX:PosSet; .*--unit UNIT", read, file, row_by_row())
    trace = read(file, row_by_row(), unit="mm")
    assert trace.column == "AX:PosAct"
    assert trace.time == pytest.approx(np.arange(len(ACTUAL)) * 3e-3, abs=1e-9)
    assert trace.value == pytest.approx(1e-3 * ACTUAL, abs=1e-15)


@pytest.mark.parametrize("step", [1.0, 0.666666])
def test_the_unit_of_a_time_may_stand_in_a_row_of_names(file: Path, step: float) -> None:
    """Read as seconds, the milliseconds of this log gave a thousandth of every acceleration."""
    trace = read(file, servo(step), unit="rpm")
    assert trace.kind == "motor_speed" and trace.column == "Servo motor speed"
    assert trace.time == pytest.approx(1e-3 * np.round(step * STAMPS, 6), abs=2e-9)
    assert trace.value == pytest.approx(SPEED * 2.0 * np.pi / 60.0)


def test_the_options_of_the_message_work(file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`encoder` and `run` as they are told to be called."""
    monkeypatch.chdir(tmp_path)
    file.write_text(servo(), encoding="utf-8")
    guideload("init")
    for command in (["encoder", "log.csv"], ["run", "machine.toml", "log.csv", "--no-pictures", "-o", "out"]):
        told = re.search(r"(--column.*), where UNIT", guideload(*command, code=2).output)
        assert told is not None
        guideload(*command, *shlex.split(told[1].replace("UNIT", "rpm")))


def test_channels_of_equal_clocks_are_one_log(file: Path) -> None:
    """As of a sensor log with a time column for each sensor; with different times they are refused."""
    file.write_text(keys_and_values("V", same_clock=True), encoding="utf-8")
    log = read_channels(file, {"Force": None, "Carriage": None})
    assert log.values[:, 1] == pytest.approx(ACTUAL) and log.time[1] == 1e-3
    file.write_text(keys_and_values("V"), encoding="utf-8")
    refuses(
        "on one clock, got time of Carriage, time of Force",
        read_channels,
        file,
        {"Force": None, "Carriage": None},
    )


@pytest.mark.parametrize("unit", ["[ms]", "ms"])
def test_a_unit_below_the_name_of_the_time_counts(tmp_path: Path, unit: str) -> None:
    """Names in two rows: the first names the time, the second has its unit beside names of quantities."""
    rows = [f"{k};{0.01 * k:.4f};{0.01 * k:.4f}".replace(".", ",") for k in range(60)]
    head = ["Zeit;Achse X;Achse X", f"{unit};Istposition [mm];Sollposition [mm]"]
    path = tmp_path / "plc.csv"
    path.write_text("\n".join([*head, *rows]), encoding="utf-8")
    trace = read_trace(path, column="Istposition [mm]")
    assert trace.time[-1] == pytest.approx(0.059)
