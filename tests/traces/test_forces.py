"""Process forces: columns read exactly, moved to L exactly, refused where they would be lost."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from machines import machine
from reference import cart
from trace_files import refuses, write_trace

from guideload import (
    ArgumentError,
    ConfigError,
    Forces,
    Motion,
    PointOfInterest,
    motion_from_trace,
    read_forces,
    read_trace,
    simulate,
)
from guideload.traces.channels import forces_beside

TIME = np.linspace(0.0, 0.5, 51)
STILL = Motion.along_x([0.0, 1.0], [0.0, 0.0])
TOOL = PointOfInterest(name="tool", at=(0.1, -0.4, 0.2), axes=((0, 0, 2), (1, 0, 0)))


def table(**columns: Any) -> dict[str, Any]:
    return {"time [s]": TIME, **{name.replace("__", " "): values for name, values in columns.items()}}


@pytest.mark.parametrize(
    ("header", "column", "scale"),
    [("Fx [N]", 0, 1.0), ("F_y (kN)", 1, 1e3), ("Force Z [N]", 2, 1.0), ("Mx [N m]", 3, 1.0),
     ("My_Nm", 4, 1.0), ("Mz_N_m", 5, 1.0), ("Mz_kN_m", 5, 1e3), ("moment z [kN mm]", 5, 1.0), ("Fz_kN", 2, 1e3)],
)  # fmt: skip
def test_columns_are_known_by_their_headers(header: str, column: int, scale: float) -> None:
    values = np.arange(51.0)
    read = read_forces({"time [ms]": 1e3 * TIME, header: values, "spindle [rpm]": values})
    expected = np.zeros((51, 6))
    expected[:, column] = scale * values
    assert np.hstack([read.force, read.moment]) == pytest.approx(expected, rel=1e-15)
    assert read.time == pytest.approx(TIME, rel=1e-15)


def test_a_file_gives_the_same_as_the_columns(tmp_path: Path) -> None:
    columns = {"t [s]": TIME, "Fx [N]": np.sin(40 * TIME), "Mz [N m]": np.cos(40 * TIME)}
    read, memory = read_forces(write_trace(tmp_path, columns)), read_forces(columns)
    assert np.array_equal(read.force, memory.force) and np.array_equal(read.moment, memory.moment)
    assert np.array_equal(read.time, TIME) and "Fx [N], Mz [N m]" in read.notes[0]


def test_a_force_that_begins_with_a_jump_loads_a_measured_motion() -> None:
    """On the stamps of the record, which has an uncertainty of its acceleration."""
    time = 1e-3 * np.arange(1001)
    motion = motion_from_trace(read_trace({"t [s]": time, "x [mm]": 100.0 * (1.0 - np.cos(6.0 * time))}))
    steps = {"t [s]": [0.1, 0.1, 0.3, 0.3], "Fy [N]": [0.0, 100.0, 100.0, 0.0]}
    forced = motion.with_forces(read_forces(steps), TOOL)
    assert forced.time.size == motion.time.size + 2 and forced.wrench is not None
    assert np.array_equal(forced.wrench[99:104, 1], [0.0, 0.0, 100.0, 100.0, 100.0])
    assert motion.uncertainty is not None and forced.uncertainty is not None
    assert forced.uncertainty.time is not None and np.array_equal(forced.uncertainty.time, motion.time)


def test_a_turned_frame_turns_the_force() -> None:
    """In axes with x along the machine's z and y along its x, (1, 2, 3) N is 1 z + 2 x + 3 y; its moment is r x F."""
    load = np.broadcast_to([1.0, 2.0, 3.0], (51, 3))
    moved = STILL.with_forces(Forces(TIME, load, 10.0 * load), TOOL, own_axes=True)
    assert "in its own axes" in moved.notes[-1]
    plain = STILL.with_forces(
        Forces(TIME, load, load), TOOL.model_copy(update={"axes": np.eye(3)[:2].tolist()}), own_axes=True
    )
    assert "in the axes of the machine" in plain.notes[-1]
    expected = np.array([2.0, 3.0, 1.0])
    assert moved.wrench is not None
    inside = moved.wrench[moved.time < 0.5]
    assert inside[:, :3] == pytest.approx(np.broadcast_to(expected, (len(inside), 3)), rel=1e-15)
    moment = 10.0 * expected + np.cross(TOOL.at, expected)
    assert inside[:, 3:] == pytest.approx(np.broadcast_to(moment, (len(inside), 3)), rel=1e-14)
    assert np.array_equal(TOOL.rotation @ TOOL.rotation.T, np.eye(3))


def test_loads_do_not_depend_on_the_axes_in_which_a_force_is_given() -> None:
    force = np.column_stack([np.sin(60 * TIME), np.cos(60 * TIME), TIME]) * 500.0
    zero = np.zeros((51, 3))
    turned = Forces(TIME, force @ TOOL.rotation.T, zero)
    here = simulate(cart(), STILL.with_forces(Forces(TIME, force, zero), TOOL))
    there = simulate(cart(), STILL.with_forces(turned, TOOL, own_axes=True))
    scale = np.abs(here.quantities["force"]).max()
    assert np.abs(here.quantities["force"] - there.quantities["force"]).max() <= 1e-12 * scale


def test_start_shifts_the_stamps() -> None:
    load = np.ones((51, 3))
    moved = STILL.with_forces(Forces(TIME, load, 0 * load), TOOL, start=0.25)
    assert moved.time[0] == 0.0 and moved.wrench is not None
    acts = moved.time[np.any(moved.wrench != 0.0, axis=1)]
    assert (acts.min(), acts.max()) == (0.25, 0.75)


def test_forces_outside_the_motion_are_refused_unless_zero() -> None:
    load = np.where(TIME[:, None] > 0.3, 0.0, np.ones((51, 3)))
    STILL.with_forces(Forces(TIME, load, 0 * load), TOOL, start=0.7)
    refuses(
        r"got some at 10 stamps, the first at 1\.01 s",
        STILL.with_forces,
        Forces(TIME, load, 0 * load),
        TOOL,
        start=0.8,
    )


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"v [m/s]": TIME}, r"expected columns of forces such as Fx \[N\]"),
        ({"Fx": TIME}, r'column Fx: the header gives no unit; write it into the header, as in "Fx \[N\]"'),
        ({"Fx [mm]": TIME}, r"column Fx \[mm\]: expected a force in N"),
        ({"Fx [N]": TIME, "F_x [kN]": TIME}, r"expected one column of Fx, got Fx \[N\] and F_x \[kN\]"),
        ({"Fx [N]": TIME, "Fx [N].1": TIME}, r"expected one column of Fx, got Fx \[N\] and Fx \[N\].1"),
        ({"Fx [N]": np.where(TIME == 0.25, np.nan, 1.0)}, r"Fx \[N\]: expected finite numbers, got none in index 25"),
        ({"time [s]": -TIME, "Fx [N]": TIME}, "time of the forces goes back"),
        ({"Fx [N]": 1e15 * TIME}, "expected a force up to"),
    ],
)  # fmt: skip
def test_unusable_columns_are_refused(columns: dict[str, Any], message: str) -> None:
    def read() -> None:
        STILL.with_forces(read_forces(table() | columns), TOOL)

    refuses(message, read)


def test_stamps_without_a_known_zero_need_a_start() -> None:
    """Dates and counted cycles count from the first row: where that is in the motion is not known."""
    dates = np.datetime64("2026-01-31T14:05:06") + (1e9 * TIME).astype("m8[ns]")
    for columns, options in (({"time": dates, "Fx [N]": TIME}, {}), ({"Fx [N]": TIME}, {"rate": "100 Hz"})):
        forces = read_forces(columns, **options)
        refuses("give the time of the first", STILL.with_forces, forces, TOOL)
        assert STILL.with_forces(forces, TOOL, start=0.0).wrench is not None


def clocks(stamps: Any) -> list[Any]:
    """One clock in several notations; stamps in ms."""
    dates = np.datetime64("2026-01-31T23:59:59.500") + stamps.astype("m8[ms]").astype("m8[ns]")
    since_1970 = dates.astype(np.int64)
    text = np.char.replace(dates.astype(str), "T", " ").astype(object)
    return [
        dates,
        text,
        since_1970,
        since_1970 // 1000,
        since_1970 / 1e9,
        since_1970 // 100 + 116_444_736_000_000_000,
    ]


@pytest.mark.parametrize("kind", range(6))
def test_forces_and_trace_share_their_clock(tmp_path: Path, kind: int) -> None:
    """Dates, and numbers since an epoch: in files of their own, and with a time column each in one file."""
    time, later = np.arange(400), np.arange(400) + 150
    place, force = np.round(0.03 * (1.0 - np.cos(0.005 * time)), 6), np.where(time < 200, 1.0 * time, 0.0)
    motion = motion_from_trace(read_trace({"t_s": time / 1e3, "x_m": place}))
    wanted = motion.with_forces(read_forces({"t_s": later / 1e3, "Fx [N]": force}), TOOL)

    def agrees(one: Motion) -> bool:
        """At any time, to what the resolution of the stamps allows: 0.2 us in a fall of 200 N in 1 ms."""
        at = np.linspace(0.0, 0.39, 777)
        found, right = (np.interp(at, each.time, each.wrench[:, 0]) for each in (one, wanted))
        return bool(np.abs(found - right).max() <= 0.1)

    dated = motion_from_trace(read_trace({"time": clocks(time)[kind], "x_m": place}))
    for other in (kind, 0):
        assert agrees(dated.with_forces(read_forces({"time": clocks(later)[other], "Fx [N]": force}), TOOL))
    rows = zip(
        *(map(str, each) for each in (clocks(time)[kind], place, clocks(later)[kind], force)), strict=True
    )
    file = tmp_path / "both.csv"
    lines = [",".join(row if i < 350 else [*row[:2], "", ""]) for i, row in enumerate(rows)]
    file.write_text("\n".join(["time,x_m,time,Fx [N]", *lines]), encoding="utf-8")
    assert agrees(motion_from_trace(read_trace(file)).with_forces(forces_beside(file, {}, None), TOOL))


def test_channels_of_different_dates_are_no_one_clock(tmp_path: Path) -> None:
    first, second = (clocks(np.arange(20) + start)[1] for start in (0, 5))
    lines = [f"{a},{i},{b},{i}" for i, (a, b) in enumerate(zip(first, second, strict=True))]
    file = tmp_path / "both.csv"
    file.write_text("\n".join(["time,Fx [N],time,Mz [N m]", *lines]), encoding="utf-8")
    refuses("expected the forces on one clock, got time, time.1", read_forces, file)


def test_points_are_named_and_square() -> None:
    with pytest.raises(ConfigError, match=r"points\[1\]\.name: expected a unique name"):
        machine(points=[TOOL, TOOL])
    with pytest.raises(ConfigError, match="two directions at right angles.*an angle of 45 deg"):
        PointOfInterest(name="tool", at=(0, 0, 0), axes=((1, 0, 0), (1, 1, 0)))
    with pytest.raises(ArgumentError, match=r"got 'tol'; it has tool"):
        machine(points=[TOOL]).point("tol")


@pytest.mark.parametrize("values", [[], [1.0]])
def test_forces_of_too_few_rows_are_refused(values: list[float]) -> None:
    refuses("table: time: expected at least 2 stamps", read_forces, {"t [s]": values, "Fx [N]": values})
