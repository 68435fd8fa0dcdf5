"""Studies of machines whose payloads come and go: every sample is the single run of its own machine."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import reference as ref

from guideload import Machine, Motion, Study, peak_loads, run_study, simulate
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


def sample_of(machine: Machine, values: list[float]) -> Machine:
    """The machine with the values of `VARY`."""
    mass, y, part_mass, box_mass, x, z = values
    part, box = machine.payloads
    center = machine.body.center_of_mass
    body = machine.body.model_copy(update={"mass": mass, "center_of_mass": (center[0], y, center[2])})
    at, other = part.center_of_mass, box.center_of_mass
    part = part.model_copy(update={"mass": part_mass, "center_of_mass": (x, at[1], at[2])})
    box = box.model_copy(update={"mass": box_mass, "center_of_mass": (other[0], other[1], z)})
    return machine.model_copy(update={"body": body, "payloads": (part, box)})


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
    machine = loaded(machine)
    study = Study(
        machine=machine, motion=MOTION, vary=VARY, samples=3, seed=1, method=method, histories=2, rtol=1e-9
    )
    result = run_study(study)
    plan = study.plan()
    columns = {column: i for i, column in enumerate(plan.metadata.columns)}
    rows, failures = plan.batch_at_stamps().run(plan.values(0, 3), 1)
    histories, _ = plan.batch_at_stamps().histories(plan.values(0, 1))
    at_any_time, _ = plan.batch().run(plan.values(0, 3), 1)
    assert not failures and not result.doubts
    for row, found, values in zip(rows, at_any_time, plan.values(0, 3).tolist(), strict=True):
        own = sample_of(machine, values)
        single = simulate(own, MOTION, method, rtol=1e-9, times=plan.motion.time)
        data, time = single.quantities, single.quantities["time"]
        loads = {"Fy": data["force"][:, :, 1], "Fz": data["force"][:, :, 2], "resultant": data["resultant"]}
        size = data["resultant"].max()
        weights = np.concatenate([[0.0], np.diff(time)]) + np.concatenate([np.diff(time), [0.0]])
        rms = np.sqrt(np.einsum("t,tc->c", weights, data["resultant"] ** 2) / weights.sum())
        drive = data["reaction"][:, 0]
        peaks = peak_loads(own, MOTION, method, rtol=1e-9).largest[:, 6]
        for i, name in enumerate(data["carriage"]):
            peak = found[columns[f"max_resultant_N[{name}]"]]
            assert peak == pytest.approx(peaks[i], rel=0.0, abs=1e2 * tolerance * size)
            for load, history in loads.items():
                for statistic, of in (("min", history[:, i].min()), ("max", history[:, i].max())):
                    got = row[columns[f"{statistic}_{load}_N[{name}]"]]
                    assert got == pytest.approx(of, rel=0.0, abs=tolerance * size)
            at = row[columns[f"time_of_max_resultant_s[{name}]"]]
            largest = data["resultant"][:, i].max()
            assert np.interp(at, time, data["resultant"][:, i]) == pytest.approx(largest, rel=1e-9)
            assert row[columns[f"rms_resultant_N[{name}]"]] == pytest.approx(rms[i], rel=tolerance)
        for statistic, value in (("min", drive.min()), ("max", drive.max()), ("start", drive[0])):
            got = row[columns[f"{statistic}_drive_N"]]
            assert got == pytest.approx(value, rel=0.0, abs=tolerance * np.abs(drive).max())
        if values == plan.values(0, 1)[0].tolist():
            np.testing.assert_allclose(histories[0, :, :, :3], data["force"], rtol=0.0, atol=tolerance * size)


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
