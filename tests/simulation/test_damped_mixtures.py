"""Every method solves what another solves, and keeps its tolerance, on damped machines of mixed laws.

The reference is exact where no link is preloaded; else rk45 at 1e-10 and implicit at 1e-11, trusted where they agree to
1e-7. An error is the largest difference of any link load at any sample, over the load scale.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from damped_mixtures import TRUSTED, scene
from numpy.typing import NDArray

from guideload import GuideloadError, Machine, Motion

Array = NDArray[np.float64]
RTOLS = 1e-3, 1e-4, 1e-6
MOST_RADIANS = 5e4  # of the fastest mode at rest, in each of which rk45 takes some steps
MOST_ERROR = 10.0  # over rtol


def loads(machine: Machine, motion: Motion, method: str, rtol: float) -> tuple[Array, float]:
    """Link loads at the samples, and the load scale."""
    inputs = motion.time, motion.acceleration, motion.wrench
    solution = machine.scene.solve(*inputs, method=method, rtol=rtol)
    return np.asarray(solution.link_loads("total")), float(solution.load_scale)


def reference(machine: Machine, motion: Motion) -> Array | None:
    """Link loads to 1e-7 of the load scale; none where the methods differ by more."""
    if machine.model_level != "smooth nonlinear":
        return loads(machine, motion, "exact", 1e-6)[0]
    truth, scale = loads(machine, motion, "rk45", 1e-10)
    other, _ = loads(machine, motion, "implicit", 1e-11)
    return truth if np.abs(truth - other).max() <= TRUSTED * scale else None


def follows(machine: Machine, motion: Motion) -> bool:
    """Whether rk45 can follow the scene in reasonable time."""
    fastest = float(np.abs(machine.scene.modes()[3]).max())
    return fastest * float(np.ptp(motion.time)) < MOST_RADIANS


def faults(seed: int) -> tuple[bool, list[str]]:
    """Whether the scene of a seed was tried, and what is wrong with it."""
    try:
        machine, motion = scene(seed)
        if not follows(machine, motion):
            return False, []
    except GuideloadError:
        return False, []  # no static equilibrium
    try:
        truth = reference(machine, motion)
    except GuideloadError as error:
        return True, [f"reference: {error}"]
    if truth is None:
        return False, []
    found = []
    for method in ("rk45", "implicit"):
        for rtol in RTOLS:
            try:
                got, scale = loads(machine, motion, method, rtol)
            except GuideloadError as error:
                found.append(f"{method} at {rtol:g}: {error}")
                continue
            off = float(np.abs(got - truth).max()) / scale / rtol
            if not off <= MOST_ERROR:
                found.append(f"{method} at {rtol:g}: off by {off:.3g} x rtol")
    return True, found


def scenes(path: Path) -> list[tuple[Machine, Motion]]:
    entries: list[dict[str, Any]] = json.loads(path.read_text())
    return [
        (Machine(**entry["machine"]), Motion(entry["time"], entry["acceleration"], wrench=entry["wrench"]))
        for entry in entries
    ]


@pytest.mark.parametrize("first", range(0, 120, 20))
def test_random_mixtures(first: int) -> None:
    found = {seed: faults(seed) for seed in range(first, first + 20)}
    assert sum(tried for tried, _ in found.values()) > 10
    assert not {seed: wrong for seed, (_, wrong) in found.items() if wrong}


def test_implicit_shortens_a_step_that_overflows(shared_data: Path) -> None:
    """An iteration that leaves the range of numbers was taken for rounding, and the run ended: "grew without bound"."""
    for machine, motion in scenes(shared_data / "implicit_refused.json"):
        truth, scale = loads(machine, motion, "rk45", 1e-9)
        for rtol in (1e-3, 1e-6):
            got, _ = loads(machine, motion, "implicit", rtol)
            assert np.abs(got - truth).max() <= MOST_ERROR * rtol * scale, rtol


@pytest.mark.parametrize("rtol", [1e-3, 1e-4, 1e-5, 1e-6])
def test_rk45_keeps_its_tolerance_over_many_contact_changes(rtol: float, shared_data: Path) -> None:
    """It was 13 times its tolerance off at 1e-3."""
    for machine, motion in scenes(shared_data / "rk45_beyond.json"):
        truth, scale = loads(machine, motion, "exact", rtol)
        got, _ = loads(machine, motion, "rk45", rtol)
        assert np.abs(got - truth).max() <= MOST_ERROR * rtol * scale
