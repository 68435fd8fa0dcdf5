"""Every method solves what another solves, and keeps its tolerance, on damped machines of mixed laws."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from damped_mixtures import MOST_ERROR, faults, loads

from guideload import Machine, Motion


def scenes(path: Path) -> list[tuple[Machine, Motion]]:
    entries: list[dict[str, Any]] = json.loads(path.read_text())
    return [
        (Machine(**entry["machine"]), Motion(entry["time"], entry["acceleration"], wrench=entry["wrench"]))
        for entry in entries
    ]


@pytest.mark.parametrize("first", range(0, 120, 20))
def test_random_mixtures(first: int) -> None:
    """`python tests/helpers/damped_mixtures.py` tries 3,000."""
    found = {seed: faults(seed) for seed in range(first, first + 20)}
    assert sum(tried for tried, _ in found.values()) > 10
    assert not {seed: wrong for seed, (_, wrong) in found.items() if wrong}


@pytest.mark.parametrize("rtol", [1e-3, 1e-6])
def test_implicit_shortens_a_step_that_overflows(rtol: float, shared_data: Path) -> None:
    """An iteration that leaves the range of numbers was taken for rounding, and the run ended: "grew without bound"."""
    for machine, motion in scenes(shared_data / "implicit_refused.json"):
        truth, scale = loads(machine, motion, "rk45", 1e-9)
        got, _ = loads(machine, motion, "implicit", rtol)
        assert np.abs(got - truth).max() <= MOST_ERROR * rtol * scale


@pytest.mark.parametrize("rtol", [1e-3, 1e-4, 1e-5, 1e-6])
def test_rk45_keeps_its_tolerance_over_many_contact_changes(rtol: float, shared_data: Path) -> None:
    """It was 13 times its tolerance off at 1e-3."""
    for machine, motion in scenes(shared_data / "rk45_beyond.json"):
        truth, scale = loads(machine, motion, "exact", rtol)
        got, _ = loads(machine, motion, "rk45", rtol)
        assert np.abs(got - truth).max() <= MOST_ERROR * rtol * scale
