"""Smoothing that is done once for the same samples: commands that are tested often read the same trace again."""

from __future__ import annotations

import pytest

from guideload.base.arrays import Array
from guideload.smoothing import smoothing
from guideload.smoothing.estimation import MotionEstimate, estimate
from guideload.smoothing.kinematics import Kind

LONGEST = 100_000  # samples that are remembered; a test of a longer trace is alone with it
KNOWN: dict[tuple[bytes, bytes, Kind, float], MotionEstimate] = {}


def remembered(time: Array, value: Array, kind: Kind = "position", quantum: float = 0.0) -> MotionEstimate:
    """The estimate of these samples, from the first time that it was asked for."""
    if time.size > LONGEST:
        return estimate(time, value, kind, quantum)
    key = (time.tobytes(), value.tobytes(), kind, quantum)
    if key not in KNOWN:
        KNOWN[key] = estimate(time, value, kind, quantum)
    return KNOWN[key]


def smooth_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """From now on the same samples are smoothed once in this process."""
    monkeypatch.setattr(smoothing, "estimate", remembered)
