"""Runs in blocks: what blocks leave is what one run over the whole record gives, wherever it is cut."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import reference
from command_line import MACHINE, guideload
from lives import cart, moved
from moves import GENTLE
from texts import one_line

from guideload import (
    LongRun,
    Machine,
    Motion,
    life_of,
    motion_blocks,
    motion_from_trace,
    peak_loads,
    read_trace,
    simulate,
)
from guideload.base.errors import ArgumentError, LifeError, TraceError
from guideload.cli.inputs import EXAMPLES
from guideload.long_runs.blocks import MARGIN
from guideload.reports.life import life_report
from guideload.reports.long_run import long_run_report

MOTION = moved(GENTLE, 500.0)


def cut(motion: Motion, *places: int) -> Iterator[Motion]:
    """The motion in blocks which share a sample at each place."""
    ends = (0, *places, motion.time.size - 1)
    for start, end in zip(ends, ends[1:], strict=False):
        part = slice(start, end + 1)
        assert motion.velocity is not None
        yield replace(
            motion,
            time=motion.time[part],
            acceleration=motion.acceleration[part],
            velocity=motion.velocity[part],
            position=None,
        )


def in_blocks(machine: Machine, *places: int, **settings: Any) -> LongRun:
    run = LongRun(machine, **settings)
    for block in cut(MOTION, *places):
        run.add(block)
    return run


@pytest.mark.parametrize(
    ("machine", "tolerance"),
    [(reference.cart(), 1e-12), (reference.cart_clear(), 1e-10), (reference.preloaded(), 1e-5)],
    ids=["linear", "play", "preload"],
)
def test_peaks_in_blocks_are_those_of_one_run(machine: Machine, tolerance: float) -> None:
    """With preload the steps of the method end at other instants, within its tolerance of 1e-6 of the load scale."""
    run, whole = in_blocks(machine, 313, 314, 1200), peak_loads(machine, MOTION)
    scale = np.abs(whole.largest).max(axis=0)
    assert np.all(np.abs(run.peaks.largest - whole.largest) <= tolerance * scale)
    assert np.all(np.abs(run.peaks.smallest - whole.smallest) <= tolerance * scale)
    assert run.samples == MOTION.time.size
    assert run.duration == np.ptp(MOTION.time)


def test_life_in_blocks_is_that_of_one_run() -> None:
    machine = cart(life={"life": "4000 km"})
    run, whole = in_blocks(machine, 200, 777), life_of(simulate(machine, MOTION))
    np.testing.assert_allclose(run.lives, [one.life for one in whole.carriages], rtol=1e-12)
    np.testing.assert_allclose(run.mean_loads, [one.mean_load for one in whole.carriages], rtol=1e-12)
    safeties, times = run.safeties
    np.testing.assert_allclose(safeties, [one.static.safety for one in whole.carriages], rtol=1e-12)
    np.testing.assert_allclose(times, [one.worst.time for one in whole.carriages])
    assert run.machine_life == pytest.approx(whole.machine, rel=1e-12)
    assert run.hours(run.machine_life) == pytest.approx(whole.hours(whole.machine), rel=1e-12)
    shares = run.table().filter(like="share_of_damage").to_numpy()
    np.testing.assert_allclose(shares.sum(axis=0), 1.0, rtol=1e-12)
    assert run.used == pytest.approx(whole.failure_probability(whole.distance), rel=1e-9)


@pytest.mark.parametrize(
    ("life", "words"),
    [
        ({"life": "1 km"}, "Life and static safety are reached."),
        ({"life": "1e6 km", "cycles_per_hour": 30.0}, "NOT REACHED: life."),
        ({"life": "1000 cycles", "safety": 1e4}, "NOT REACHED: static safety."),
        (
            {"life": "900 years", "safety": 1e4, "cycles_per_hour": 1e3},
            "NOT REACHED: life and static safety.",
        ),
        ({"hours_per_year": 4000.0}, "The static safety is reached."),
    ],
)
def test_life_and_safety_are_judged_as_in_one_run(life: dict[str, Any], words: str) -> None:
    machine = cart(life=life)
    run, whole = in_blocks(machine, 200, 777), life_of(simulate(machine, MOTION))
    assert run.repetition.hours(1.0) == pytest.approx(whole.repetition.hours(1.0), rel=1e-12)
    assert run.wanted == (None if whole.wanted is None else pytest.approx(whole.wanted, rel=1e-12))
    assert run.holds == whole.holds
    report, text = long_run_report(run), one_line(long_run_report(run).text())
    assert report.failed != whole.holds
    assert words in text and words in one_line(life_report(whole, band=False).text())
    assert ("leaves 3.6 s for the motion, which lasts" in text) == (life.get("cycles_per_hour") == 1e3)


def test_a_block_that_does_not_follow_is_refused_and_leaves_nothing() -> None:
    first, second, third = cut(MOTION, 300, 600)
    run = LongRun(cart())
    run.add(first)
    before = run.peaks.largest.copy()
    with pytest.raises(ArgumentError, match=r"time\[0\]: expected .* the last stamp of the block before"):
        run.add(third)
    with pytest.raises(LifeError, match="velocity"):
        run.add(replace(second, velocity=None))
    assert np.array_equal(run.peaks.largest, before)
    assert len(run.blocks) == 1


def test_what_a_run_in_blocks_cannot_do_is_refused() -> None:
    machine = reference.cart()
    rail = machine.rails[0].model_copy(update={"straightness": ((0.0, 0.0, 0.0), (1.0, 1e-5, 0.0))})
    with pytest.raises(ArgumentError, match="rails that are not straight"):
        LongRun(machine.model_copy(update={"rails": (rail, machine.rails[1])}))
    for name in ("peaks", "safeties"):
        with pytest.raises(ArgumentError, match="no block was added"):
            getattr(LongRun(machine), name)
    with pytest.raises(ArgumentError, match="from a Parquet file"):
        next(motion_blocks(EXAMPLES / "manipulator.csv"))
    with pytest.raises(ArgumentError, match="uniform"):
        next(motion_blocks("log.parquet", clock="uniform"))
    with pytest.raises(ArgumentError, match="rows: expected at least"):
        next(motion_blocks("log.parquet", rows=10))
    with pytest.raises(TraceError, match="no such file"):
        next(motion_blocks("missing.parquet"))


# ---- blocks of a file

STEP, ROWS = 1e-3, 2 * MARGIN
COUNT = 3 * ROWS + 1234
QUICK = {"smoothing": "differences"}  # where the acceleration does not matter


def recorded() -> tuple[np.ndarray, np.ndarray]:
    """Time and position of an axis that goes there and back."""
    time = np.arange(COUNT) * STEP
    phase = np.clip(np.abs((time / 2.0) % 2.0 - 1.0) * 1.4 - 0.2, 0.0, 1.0)
    return time, 0.4 * phase**3 * (10.0 - 15.0 * phase + 6.0 * phase**2)


def written(folder: Path, **columns: Any) -> Path:
    file = folder / "log.parquet"
    pd.DataFrame(columns).to_parquet(file, row_group_size=5000)
    return file


def log(folder: Path, time: np.ndarray, position: np.ndarray) -> Path:
    """A file of an axis whose encoder counts micrometres."""
    return written(folder, **{"t [s]": time, "x [m]": np.round(position / 1e-6) * 1e-6})


@pytest.mark.parametrize("stamps", ["seconds", "dates", "cycles", "none"])
def test_blocks_together_are_the_motion_of_the_whole_file(tmp_path: Path, stamps: str) -> None:
    """A smoothing that reaches less far than the margin is the same; and so are the stamps, however they count."""
    time, position = recorded()
    columns: dict[str, Any] = {"x [m]": np.round(position / 1e-6) * 1e-6}
    options: dict[str, Any] = {"smoothing": "savitzky_golay", "window": 0.021}
    if stamps == "seconds":
        columns["t [s]"] = time + 5.0
    elif stamps == "dates":
        columns["t"] = pd.Timestamp("2026-01-31 23:59:50") + pd.to_timedelta(np.arange(COUNT), unit="ms")
    else:
        options["rate"] = 1000.0
        if stamps == "cycles":
            columns["cycle"], options["time"] = np.arange(COUNT) + 70, "cycle"
    file = written(tmp_path, **columns)
    blocks = list(motion_blocks(file, rows=ROWS, **options))
    smoothing = {name: options.pop(name) for name in ("smoothing", "window")}
    whole = motion_from_trace(read_trace(file, **options), **smoothing)
    assert len(blocks) == 3
    for before, after in zip(blocks, blocks[1:], strict=False):
        assert before.time[-1] == after.time[0]
        assert np.array_equal(before.acceleration[-1], after.acceleration[0])
    joined = np.concatenate([blocks[0].time, *(block.time[1:] for block in blocks[1:])])
    np.testing.assert_allclose(joined, whole.time, rtol=0.0, atol=1e-9)
    for name, scale in (("acceleration", 1e-6), ("velocity", 1e-9)):
        parts = [getattr(block, name) for block in blocks]
        values = np.concatenate([parts[0], *(part[1:] for part in parts[1:])])
        np.testing.assert_allclose(values, getattr(whole, name), rtol=0.0, atol=scale)


@pytest.mark.parametrize("damage", ["empty", "wild"])
def test_damaged_stamps_where_blocks_meet_lose_no_other_sample(tmp_path: Path, damage: str) -> None:
    time, position = recorded()
    bound = np.linspace(0, COUNT, 4).astype(int)[1]
    time[bound] = np.nan if damage == "empty" else time[bound] - 3.0
    file = log(tmp_path, time, position)
    blocks = list(motion_blocks(file, rows=ROWS, repair="all", **QUICK))
    joined = np.concatenate([blocks[0].time, *(block.time[1:] for block in blocks[1:])])
    np.testing.assert_allclose(joined, np.delete(time, bound), rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("row", [3000, ROWS + 300, 2 * ROWS])
def test_a_clock_that_is_set_back_is_refused(tmp_path: Path, row: int) -> None:
    """A repair moves all later rows, which later blocks would not know."""
    time, position = recorded()
    time[row:] -= 3.0
    file = log(tmp_path, time, position)
    with pytest.raises(TraceError, match="set back within rows"):
        list(motion_blocks(file, rows=ROWS, repair="all", **QUICK))


def test_a_record_that_stands_still_for_whole_blocks(tmp_path: Path) -> None:
    time, position = (values[: 2 * ROWS] for values in recorded())
    run = LongRun(cart())
    still = np.where(time < 12.0, position[0], position)
    for block in motion_blocks(log(tmp_path, time, still), rows=ROWS):
        run.add(block)
    assert run.samples == 2 * ROWS
    assert run.blocks[0].distance == pytest.approx(0.0, abs=1e-9)
    assert np.all(np.isfinite(run.peaks.largest))


def test_without_ratings_or_travel_there_is_no_life() -> None:
    run, standing = LongRun(reference.cart()), LongRun(cart(life={"life": "4000 km"}))
    block = next(cut(MOTION))
    run.add(block)
    standing.add(
        replace(block, velocity=np.zeros_like(block.velocity), acceleration=np.zeros_like(block.acceleration))
    )
    assert run.safeties[0].size == run.lives.size == 0
    for one in (run, standing):
        assert np.isnan([one.machine_life, one.used, one.hours(1.0)]).all()


def test_the_command_prints_the_answer_and_writes_the_table(tmp_path: Path) -> None:
    time, position = recorded()
    time[2 * ROWS] = np.nan
    file = log(tmp_path, time, position)
    options = ("--rows", ROWS, "--repair", "empty", "--smoothing", "differences")
    arguments = ("long-run", MACHINE, file, *options, "-o", tmp_path / "blocks.csv")
    done = guideload(*arguments)
    assert f"{COUNT - 1} samples" in done.output
    assert f"left out, row {2 * ROWS + 1}" in done.output
    table = pd.read_csv(tmp_path / "blocks.csv")
    assert table["samples"].sum() == COUNT - 1
    assert table["end_s"].iloc[-1] == pytest.approx(time[-1])
    assert "exists" in guideload(*arguments, code=2).output
    assert f"x>={ROWS}" in guideload("long-run", MACHINE, file, "--rows", ROWS - 1, code=2).output


def test_the_values_before_a_block_that_fails_are_not_lost(tmp_path: Path) -> None:
    time, position = recorded()
    time[2 * ROWS :] -= 3.0
    file = log(tmp_path, time, position)
    table = tmp_path / "blocks.csv"
    options = ("--rows", ROWS, "--repair", "all", "--smoothing", "differences", "-o", table)
    done = guideload("long-run", MACHINE, file, *options, code=2)
    assert "The next block failed" in done.stderr and "set back within rows" in done.stderr
    assert pd.read_csv(table)["end_s"].iloc[-1] < time[2 * ROWS - 1]
