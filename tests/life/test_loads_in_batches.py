"""Mean and largest equivalent loads of the samples of a batch are those of single runs, for any laws and rules."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from lives import moved
from machines import with_mass
from moves import GENTLE
from reference import cart, core_batch

from guideload import simulate
from guideload._core import Batch, largest_equivalent_load
from guideload.life.equivalent_load import EquivalentLoad, PreloadEffect
from guideload.life.mean_load import Travel, integrals, load_bows, mean_load
from guideload.machine.machine import Machine

MOTION = moved(GENTLE, 500.0)
FACTORS = np.array([[0.8, 1.1], [1.0, 1.0], [1.3, 0.9]])  # of the mass and of the acceleration
PRELOADED = {"preload_y": 8e3, "preload_z": 8e3, "rolling": "ball"}


def rules(effects: tuple[PreloadEffect, ...]) -> list[EquivalentLoad]:
    """A plain sum, and two groups with moments and a lift factor, with each of these effects of a preload."""
    plain, both = np.zeros((2, 5, 2)), np.zeros((2, 5, 2))
    plain[0, :2] = 1.0
    both[0, 0], both[1, 1], both[0, 2], both[1, 3], both[0, 4] = (1.3, 1.0), 0.9, 4.0, 7.0, 5.0
    return [EquivalentLoad(plain, 1.0), *(EquivalentLoad(both, 0.6, (), 700.0, effect) for effect in effects)]


def batch(machine: Machine, exponent: float, assigned: list[EquivalentLoad]) -> Batch:
    assert MOTION.velocity is not None
    return core_batch(
        machine,
        time=MOTION.time,
        acceleration=MOTION.acceleration,
        wrench=None,
        speed=MOTION.velocity[:, 0].copy(),
        exponent=exponent,
        changes=[(("mass", 0, 0), 0.0, [(0, machine.body.mass)]), (("acceleration", 0, 0), 0.0, [(1, 1.0)])],
        measures=[("load", i, statistic) for i in range(4) for statistic in ("mean", "max")],
        method="auto",
        rtol=1e-6,
        at_samples=True,
        rules=[(rule.of_core, assigned[i % 2].of_core) for i, rule in enumerate(assigned)],
    )


@pytest.mark.parametrize("laws", [{}, {"clearance_y": 5e-6, "clearance_z": 5e-6}, PRELOADED])
@pytest.mark.parametrize("exponent", [3.0, 10.0 / 3.0])
@pytest.mark.parametrize("effects", [("power", "linear", "ball"), ("roller", "ball", "roller")])
def test_loads_of_samples_are_those_of_single_runs(
    laws: dict[str, Any], exponent: float, effects: tuple[PreloadEffect, ...]
) -> None:
    machine, assigned = cart(**laws), rules(effects)
    samples = batch(machine, exponent, assigned)
    table, failures = samples.run(FACTORS, 1)
    assert not failures
    for width in ("four", "one"):
        again, _ = samples.run(FACTORS, 2, width)
        assert again.tobytes() == table.tobytes()
    assert MOTION.velocity is not None
    travel = Travel(MOTION.time, MOTION.velocity[:, 0], MOTION.acceleration[:, 0])
    for row, (mass, scale) in zip(table, FACTORS, strict=True):
        heavier = with_mass(machine, mass * machine.body.mass)
        motion = MOTION.along_x(MOTION.time, scale * MOTION.acceleration[:, 0])
        result = simulate(heavier, motion, times=motion.time)
        loads, bows = result.carriage_loads, load_bows(result)
        for i, rule in enumerate(assigned):
            mean = mean_load(*integrals(travel, loads[:, i], rule, exponent, bows[:, i]), exponent)
            _, largest, _ = largest_equivalent_load(loads[:, i].copy(), assigned[i % 2].of_core)
            # Step sizes on smooth laws depend on estimated errors, which change with rounding.
            rel = 1e-8 if laws is PRELOADED else 1e-12
            assert row[2 * i + 1] == pytest.approx(largest, rel=rel)
            # Means of loads are exact in a study with linear links, those of a run by Simpson's rule.
            assert row[2 * i] == pytest.approx(mean, rel=rel if laws else 1e-6)
