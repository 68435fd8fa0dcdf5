"""Studies of machines whose payloads come and go: every sample is the single run of its own machine."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import reference as ref
from samples import assert_samples_are_runs

from guideload import Machine, Motion, Study, run_study, simulate
from guideload.base.errors import ConfigError
from guideload.machine.payloads import Payload

INERTIA = ((1.5, 0.0, 0.0), (0.0, 1.2, 0.0), (0.0, 0.0, 0.9))
PARTS = (
    {"name": "part", "mass": 90.0, "center_of_mass": (0.3, 0.25, -0.1), "times": [(0.75, 1.0), (1.1, 9.0)]},
    {
        "name": "box",
        "mass": 200.0,
        "center_of_mass": (-0.2, 0.4, 0.1),
        "inertia_about": "L",
        "inertia": ((74.0, 16.0, 4.0), (16.0, 50.0, -8.0), (4.0, -8.0, 80.0)),
        "times": [(-1.0, 0.9), (1.05, 1.1)],
    },
)
VARY: tuple[dict[str, Any], ...] = (
    {"path": "body.mass", "distribution": "uniform", "plus_minus": "10 %"},
    {"path": "body.center_of_mass.y", "distribution": "uniform", "plus_minus": "5 cm"},
    {"path": "payloads.*.mass", "each": "payload", "distribution": "uniform", "plus_minus": "30 %"},
    {"path": "payloads[part].center_of_mass.x", "distribution": "uniform", "plus_minus": "10 cm"},
    {"path": "payloads[box].center_of_mass.z", "distribution": "uniform", "plus_minus": "10 cm"},
)
MOTION = ref.piece(ref.cycle(), 500, 1400)


def loaded(machine: Machine, *parts: dict[str, Any]) -> Machine:
    payloads = tuple(Payload(**({"inertia": INERTIA} | part)) for part in parts or PARTS)
    return machine.model_copy(update={"payloads": payloads})


@pytest.mark.parametrize(
    ("machine", "method", "tolerance"),
    [
        (ref.cart(), "auto", 1e-12),
        (ref.cart_clear(), "auto", 1e-12),
        (ref.cart(), "rk45", 1e-9),
        (ref.preloaded(), "rk45", 1e-9),
        (ref.preloaded(), "implicit", 1e-9),
    ],
    ids=["linear", "clearance", "linear rk45", "preloaded rk45", "preloaded implicit"],
)
def test_every_sample_is_the_run_of_its_machine(machine: Machine, method: Any, tolerance: float) -> None:
    keys: dict[str, Any] = {"samples": 3, "seed": 1, "method": method, "rtol": 1e-9}
    study = Study(machine=loaded(machine), motion=MOTION, vary=VARY, **keys)
    assert not run_study(study).doubts
    assert_samples_are_runs(study, range(3), tolerance)


def test_peaks_alone_are_those_beside_other_measures() -> None:
    """Without values at the samples, blocks that cannot have a new extreme are skipped."""
    keys: dict[str, Any] = {
        "machine": loaded(ref.cart()),
        "motion": MOTION,
        "vary": VARY,
        "samples": 9,
        "seed": 2,
    }
    all_of_them, peaks = (
        Study(**keys).plan(),
        Study(**keys, quantities=["Fy"], statistics=["min", "max"]).plan(),
    )
    values = peaks.values(0, 9)
    rows, _ = all_of_them.batch().run(values, 1)
    wanted = [all_of_them.metadata.columns.index(column) for column in peaks.metadata.columns]
    got, _ = peaks.batch().run(values, 1)
    np.testing.assert_allclose(got, rows[:, wanted], rtol=1e-13)


def test_a_sample_does_not_depend_on_others() -> None:
    plan = Study(machine=loaded(ref.cart()), motion=MOTION, vary=VARY, samples=20, seed=1).plan()
    values = plan.values(0, 20)
    together, _ = plan.batch().run(values, 2)
    for i in (0, 7, 19):
        alone, _ = plan.batch().run(values[i : i + 1], 1, "one")
        np.testing.assert_array_equal(alone[0], together[i])


def test_payloads_by_the_place_of_the_cart() -> None:
    time = np.arange(4001) / 1000.0
    place = 0.3 + 0.5 * (1.0 - np.cos(np.pi * time / 2.0))  # there and back in 4 s
    acceleration = 0.5 * (np.pi / 2.0) ** 2 * np.cos(np.pi * time / 2.0)
    motion = Motion.along_x(time, acceleration, position=place)
    where = {"picked_at": {"x": 0.4567, "travel": "+x"}, "released_at": {"x": 0.4567, "travel": "-x"}}
    machine = loaded(ref.cart(), {"name": "part", "mass": 90.0, "center_of_mass": (0.3, 0.2, 0.1)} | where)
    study = Study(machine=machine, motion=motion, vary=VARY[:1], samples=1, seed=1, histories=1)
    stamps = study.plan().motion.time
    single = simulate(study.machine, motion, times=stamps).quantities
    assert stamps.tolist() == single["time"].tolist()
    assert run_study(study).histories.sizes["time"] == time.size + 4


def test_paths_of_payloads_are_checked() -> None:
    with pytest.raises(ConfigError, match=r'its payloads are "part", "box"'):
        vary = [{"path": "payloads[crate].mass", "distribution": "uniform", "plus_minus": "10 %"}]
        Study(machine=loaded(ref.cart()), motion=MOTION, vary=vary, samples=3, seed=1)
    with pytest.raises(ConfigError, match=r"payloads\[part\].mass > 0 kg"):
        vary = [{"path": "payloads[part].mass", "distribution": "uniform", "plus_minus": "110 %"}]
        Study(machine=loaded(ref.cart()), motion=MOTION, vary=vary, samples=3, seed=1)
