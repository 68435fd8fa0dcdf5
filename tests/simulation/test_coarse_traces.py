"""Peaks do not depend on how densely a motion is sampled: it is the same motion, linear between its samples."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pandas as pd
import pytest
import reference as ref
from machines import having, with_mass

from guideload import Body, Machine, Motion, Payload, Study, peak_loads, run_study
from guideload.simulation.instants import fastest_vibration
from guideload.simulation.peaks import Peaks
from guideload.study.plan import RARE

CORNERS = np.array([0.0, 0.1, 0.14, 0.5, 0.54, 1.0, 1.04, 1.4, 1.44, 2.0])  # s
ACCELERATION = np.array([0.0, 0.0, 2.2, 2.2, 0.0, 0.0, -2.2, -2.2, 0.0, 0.0])  # m/s2
DENSE = 10_000  # Hz


def sampled(rate: int) -> Motion:
    """A move there and back; all corners are samples at 100 Hz and its multiples."""
    time = np.arange(2 * rate + 1) / rate
    return Motion.along_x(time, np.interp(time, CORNERS, ACCELERATION))


def with_payload() -> Machine:
    inertia = ((9.0, 0.0, 0.0), (0.0, 9.0, 0.0), (0.0, 0.0, 9.0))
    part = Payload(
        name="part", mass=200.0, center_of_mass=(0.1, -0.2, 0.3), inertia=inertia, times=((0.3, 1.2),)
    )
    return having(ref.cart(), payloads=(part,))


def elastic_base() -> Machine:
    return ref.on_base(ref.cart(), ref.random_base())


@cache
def peaks(machine: Callable[[], Machine], rate: int) -> Peaks:
    return peak_loads(machine(), sampled(rate))


@cache
def study_table(machine: Callable[[], Machine], rate: int) -> pd.DataFrame:
    """Of samples whose stiffness scatters, and with it the fastest vibration."""
    cases = {"body.mass": [1000.0, 1400.0], "carriages[1a].stiffness_y [N/um]": [150.0, 80.0]}
    keys = {"cases": cases, "quantities": ("resultant", "drive"), "statistics": ("min", "max")}
    return run_study(Study(machine=machine(), motion=sampled(rate), **keys)).table()


every_machine = pytest.mark.parametrize(
    ("machine", "error"),
    [
        (ref.cart, 1e-10),
        (ref.cart_clear, 1e-10),
        (with_payload, 1e-10),
        (elastic_base, 1e-10),
        (ref.preloaded, 1e-5),
    ],
)


@pytest.mark.parametrize("rate", [100, 200, 500, 1000])
@every_machine
def test_peaks_at_any_rate_are_the_same(machine: Callable[[], Machine], error: float, rate: int) -> None:
    coarse, dense = (peaks(machine, each) for each in (rate, DENSE))
    for size, of in (("largest", slice(0, 8)), ("smallest", slice(0, 6))):
        mine, theirs = getattr(coarse, size)[:, of], getattr(dense, size)[:, of]
        assert np.abs(mine - theirs).max() <= error * np.abs(theirs).max()


@every_machine
def test_so_are_those_of_a_motion_given_by_its_corners(machine: Callable[[], Machine], error: float) -> None:
    """Intervals of many periods, beside short ones."""
    corners = peak_loads(machine(), Motion.along_x(CORNERS, ACCELERATION)).largest
    dense = peaks(machine, DENSE).largest
    assert np.abs(corners - dense).max() <= error * np.abs(dense).max()


@pytest.mark.parametrize("rate", [100, 500])
@every_machine
def test_so_are_those_of_studies(machine: Callable[[], Machine], error: float, rate: int) -> None:
    """Drive force and largest resultants of each sample."""
    coarse, dense = (study_table(machine, each) for each in (rate, DENSE))
    names = [name for name in coarse if name.startswith(("max_resultant", "max_drive", "min_drive"))]
    assert len(names) == 6
    for name in names:
        assert coarse[name].to_numpy() == pytest.approx(dense[name].to_numpy(), rel=error), name


# ---- samples of a study that vibrate faster than its nominal machine


@every_machine
def test_a_study_has_instants_for_its_fastest_case(machine: Callable[[], Machine], error: float) -> None:
    lighter = 0.5 * machine().body.mass
    cases = {"body.mass": [machine().body.mass, lighter]}
    plan = Study(machine=machine(), motion=sampled(100), cases=cases).plan()
    alone = fastest_vibration(with_mass(machine(), lighter))
    assert alone > fastest_vibration(machine())
    assert plan.fastest_vibration() == pytest.approx(alone, rel=1e-9)


def test_a_study_has_instants_for_one_drawn_sample_of_ten_thousand() -> None:
    """Where frequencies go as the root of stiffness over mass, which are lognormal, and as that of a rare value."""
    machine = ref.cart(1e-3)
    inertia = [f"body.inertia.{axes}" for axes in ("xx", "yy", "zz", "xy", "xz", "yz")]
    stiffness = dict(path="carriages.*.stiffness", name="k", distribution="lognormal", sigma=0.2)
    mass = dict(path=["body.mass", *inertia], name="m", distribution="lognormal", sigma=0.1)
    rare = dict(
        path="carriages.*.stiffness", name="k", distribution="sample", values=["100 %"] * 9999 + ["900 %"]
    )
    for vary, faster in (
        ([stiffness, mass], np.exp(0.5 * RARE * np.hypot(0.2, 0.1))),
        ([rare], 3.0),
    ):
        plan = Study(machine=machine, motion=sampled(100), samples=8, seed=1, vary=vary).plan()
        # The direction is that of the gains in frequency, not in its logarithm: 1 % for such a scatter.
        assert plan.fastest_vibration() == pytest.approx(faster * fastest_vibration(machine), rel=0.01)


def test_peaks_of_a_sample_far_stiffer_than_the_nominal_machine_are_its_own() -> None:
    def sided(factor: float) -> Machine:
        side = {"positive": 2.9e7 * factor, "negative": 1.16e7 * factor}
        dofs = ("y", "z", "rx", "ry", "rz")
        found = ref.on_rails((-0.2, 0.2), 0.05, dofs, 72.5, stiffness_y=2.9e7 * factor, stiffness_z=side)
        inertia = ((420.0, 0.0, 0.0), (0.0, 310.0, 0.0), (0.0, 0.0, 380.0))
        return having(found, body=Body(mass=1250.0, center_of_mass=(0.12, -0.65, 0.18), inertia=inertia))

    time = np.arange(0.0, 1.201, 0.05)
    pulses = ((0.1, 1.0), (0.35, -1.0), (0.6, -1.0), (0.85, 1.0))
    push = sum(sign * np.interp(time - start, [0.0, 0.05, 0.1], [0.0, 8.0, 0.0]) for start, sign in pulses)
    motion, stiff = Motion.along_x(time, push), sided(35.0)
    sides = stiff.carriages[0].stiffness_z
    cases = {
        "carriages.*.stiffness_y": [stiff.carriages[0].stiffness_y],
        "carriages.*.stiffness_z.positive": [sides.positive],
        "carriages.*.stiffness_z.negative": [sides.negative],
    }
    found = run_study(Study(machine=sided(1.0), motion=motion, cases=cases, quantities=["resultant"])).table()
    peaks = found[[name for name in found if name.startswith("max_resultant")]].to_numpy()[0]
    assert peaks == pytest.approx(peak_loads(stiff, motion).largest[:, 6], rel=1e-9)
