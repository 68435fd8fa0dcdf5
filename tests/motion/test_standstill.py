"""Moves and standstills: exact for planned moves, and found beneath the noise of a measured motion."""

from __future__ import annotations

import numpy as np
import pytest
from moves import BRISK, GENTLE
from reference import example

from guideload import Moves
from guideload.motion.standstill import move_spans

LIMITS = {"speed": 1.0, "acceleration": 5.0, "jerk": 200.0}


@pytest.mark.parametrize("profile", ["jerk limited", "trapezoid", "sine squared", "polynomial 5"])
def test_planned_moves_end_with_their_last_acceleration(profile: str) -> None:
    limits = {key: value for key, value in LIMITS.items() if profile != "trapezoid" or key != "jerk"}
    moves = [{"distance": 0.4, "dwell": 0.3}, {"distance": -0.4, "dwell": 0.5}]
    motion = Moves(limits={"profile": profile, **limits}, moves=moves, repeat=2).motion()
    length = (motion.time[-1] - 1.6) / 4.0  # all four moves take the same time
    spans = move_spans(motion.time, motion.acceleration, motion.velocity)
    starts = np.cumsum([0.0, length + 0.3, length + 0.5, length + 0.3])
    assert [one.start for one in spans[1:]] == pytest.approx(starts[1:], abs=1e-9)
    assert [one.end for one in spans] == pytest.approx(starts + length, abs=1e-9)
    assert [one.until for one in spans] == pytest.approx([*starts[1:], motion.time[-1]], abs=1e-9)


@pytest.mark.parametrize("move", [GENTLE, BRISK])
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_sampled_motion_without_speed(move: object, noise: float) -> None:
    """The speed is integrated; noise hides the ends of a ramp by no more than five times its rms."""
    time = move.times(1000.0)
    _, _, along = move.motion(time)
    along = along + noise * np.random.default_rng(1).normal(size=time.size)
    corners = move.corners()[0]
    spans = move_spans(time, along[:, None])
    late = 2e-3 + 8.0 * noise / move.jerk
    assert [one.start for one in spans] == pytest.approx([corners[1], corners[9]], abs=late)
    assert [one.end for one in spans] == pytest.approx([corners[8], corners[16]], abs=late)


def test_a_measured_trace_has_the_moves_that_were_measured() -> None:
    motion = example()[1]
    spans = move_spans(motion.time, motion.acceleration, motion.velocity)
    known = BRISK.corners()[0]
    assert [one.end for one in spans] == pytest.approx([known[8], known[16]], abs=0.01)


def test_reversals_are_no_standstills() -> None:
    """Two moves without a pause: the acceleration does not vanish between them."""
    time = np.arange(0.0, 4.0, 1e-3)
    along = np.where(time < 1.0, 0.0, np.where(time < 3.0, np.sin(2 * np.pi * time), 0.0))
    spans = move_spans(time, along[:, None])
    assert len(spans) == 1 and spans[0].end == pytest.approx(3.0, abs=2e-3)


def test_no_motion_has_no_moves() -> None:
    assert move_spans(np.arange(5.0), np.zeros((5, 3))) == []
