"""A record without rows at standstill: how long the pause was changes nothing but the clock."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from lives import cart
from moves import Move

from guideload import LongRun, Motion, life_of, motion_blocks, motion_from_trace, read_trace, simulate
from guideload.drive.requirements import drive_requirements, rms
from guideload.smoothing.kinematics import Kind, Kinematics, across_gaps

MOVE = Move(speed=1.6, acceleration=4.0, jerk=50.0, dwell=0.3, cruise=0.2)
SHORT, LONG = (0.5, 0.5, 0.5), (3.0, 3600.0, 64 * 3600.0)  # s, pauses; the last is a weekend
MACHINE = cart(life={"life": "4000 km"}, friction={"coefficient": 0.005})


def record(pauses: tuple[float, ...], kind: str, quantum: float) -> dict[str, np.ndarray]:
    """Moves there and back at 1 kHz, between which no rows are written for some time."""
    position, velocity, _ = MOVE.motion(MOVE.times(1000.0))
    value = np.tile(velocity if kind == "velocity" else position, len(pauses) + 1)
    steps = np.full(value.size, 1e-3)
    steps[position.size :: position.size] += pauses
    value = np.round(value / quantum) * quantum
    kept = np.diff(value, prepend=-1.0) != 0.0 if kind == "changes" else np.ones(value.size, bool)
    return {"t_s": np.cumsum(steps)[kept], "v_m_s" if kind == "velocity" else "x_m": value[kept]}


def figures(motion: Motion) -> dict[str, float]:
    """Travel [m], loads, life [m], integrals over time of squared forces of the drive, band of the excitation [Hz]."""
    result = simulate(MACHINE, motion)
    life, drive, lasts = life_of(result), drive_requirements(result), float(np.ptp(motion.time))
    assert result.quantities["time"].size < 3 * motion.time.size  # no instants are wasted on a pause
    return {
        "travel": life.distance,
        "mean load": life.carriages[0].mean_load,
        "life": life.machine,
        "peak": float(result.peaks()["peak_resultant_N"].max()),
        "force": rms(drive.time, drive.force) ** 2 * lasts,
        "friction": rms(drive.time, drive.friction) ** 2 * lasts,
        "band": result.audit.sampling.band or 0.0,
    }


@pytest.mark.parametrize(
    ("kind", "quantum"),
    [("position", 1e-6), ("position", 2e-5), ("changes", 5e-6), ("velocity", 1e-4)],
)
def test_the_length_of_pauses_changes_no_figure(kind: str, quantum: float, tmp_path: Path) -> None:
    """The tolerance is that of a smoothing which finds its parameters anew."""
    short, long = (record(pauses, kind, quantum) for pauses in (SHORT, LONG))
    motion = motion_from_trace(read_trace(long, allow_gaps=True))
    found, expected = figures(motion), figures(motion_from_trace(read_trace(short, allow_gaps=True)))
    way = 2.0 * (len(LONG) + 1) * float(np.ptp(MOVE.motion(MOVE.times(1000.0))[0]))
    assert found["travel"] == pytest.approx(way, rel=1e-4)
    assert found == pytest.approx(expected, rel=1e-3, abs=0.2)
    pd.DataFrame(long).to_parquet(tmp_path / "log.parquet")
    run = LongRun(MACHINE)
    for block in motion_blocks(tmp_path / "log.parquet", allow_gaps=True):
        run.add(block)
    assert (run.distance, run.machine_life) == pytest.approx((found["travel"], found["life"]), rel=1e-9)


@pytest.mark.parametrize("kind", ["position", "velocity"])
def test_across_a_long_gap_the_travel_is_that_of_the_positions(kind: Kind) -> None:
    """Of samples of speed, only the travel beside the gap is known."""
    time = np.delete(np.arange(6000), slice(2000, 4000)) * 1e-3
    position, velocity, acceleration = time**2, 2.0 * time, np.full(time.size, 2.0)
    exact = Kinematics(position, velocity, acceleration, np.inf, "")
    found = across_gaps(exact, time, position if kind == "position" else velocity, kind, 0.0)
    travel = float(np.diff(time) @ (0.5 * (found.velocity[1:] + found.velocity[:-1])))
    way = np.ptp(position) - (0.0 if kind == "position" else position[2000] - position[1999])
    assert travel == pytest.approx(way, abs=2.0 * velocity.max() * 1e-3)
    assert np.ptp(found.position) == pytest.approx(way, abs=2.0 * velocity.max() * 1e-3)
    assert "across 1 gap" in found.note
