"""What holds for a run of any machine: it balances; other methods, given instants, peaks, files and studies agree."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache, cached_property
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import reference as ref
from lives import PRODUCT, moved
from machines import having, with_carriages, with_mass
from moves import Move

from guideload import Machine, Motion, Payload, Result, Rider, Study, peak_loads, run_study, simulate
from guideload.catalogue.product import Product
from guideload.drive import drive_requirements
from guideload.drive.requirements import is_elastic
from guideload.life.arrangement import Arrangement
from guideload.life.equivalent_load import dynamic_load

MOTION = moved(Move(speed=0.4, acceleration=2.0, jerk=100.0, dwell=0.2, cruise=0.1))
TIME = MOTION.time
INERTIA = np.diag([9.0, 12.0, 15.0]).tolist()
CENTER = (0.1, -0.2, 0.3)
PART = Payload(name="part", mass=90.0, center_of_mass=CENTER, inertia=INERTIA, times=((0.3, 0.8), (1.0, 1.2)))
SLIDE = Rider(name="slide", mass=180.0, center_of_mass=CENTER, inertia=INERTIA, direction=(0.2, -0.1, 2.0))
WAVES = {"rms": ("10 um", "5 um"), "wavelengths": ("500 mm", "2 m")}
RACK = {"pinion_diameter": 0.1, "pressure_angle": "20 deg", "push_direction": (0.0, 1.0, 0.0)}
SCREW = {"name": "screw", "point": (0, 0, 0), "direction": (1, 0, 0), "stiffness": 2e7, "damping": 4e3}
TOOLS = [{"name": f"p{i}", "at": (0.4 * i, -i, 0.7 * i), "settle_window": 1e-6} for i in range(2)]

# With moments, and different factors on a load that lifts and one that presses.
EQUIVALENT = dynamic_load("iko", Product(**PRODUCT | {"lift_factor": 1.2}), Arrangement(1, 1))


@dataclass(frozen=True)
class Case:
    """A machine, a motion, and the settings of `simulate`; studies: whether a study takes them."""

    machine: Machine
    motion: Motion = MOTION
    settings: dict[str, Any] = field(default_factory=dict)
    studies: bool = True

    @cached_property
    def result(self) -> Result:
        return simulate(self.machine, self.motion, **self.settings)


def mounted(machine: Machine) -> Machine:
    """With mounting errors of all rails and of a carriage."""
    rails = [having(one, mounting_error=(3e-6 * i, 2e-6)) for i, one in enumerate(machine.rails)]
    return with_carriages(
        having(machine, rails=rails), machine.carriages[0].name, mounting_error=(-4e-6, 3e-6)
    )


def on_rails(**keys: Any) -> Machine:
    """The cart whose rails have these keys, the first one with another seed."""
    first, second = ref.cart().rails
    keys_of_first = {"waviness": WAVES | {"seed": 1}} if "waviness" in keys else keys
    return having(ref.cart(), rails=[having(first, **keys_of_first), having(second, **keys)])


def riding() -> Case:
    travel = 0.02 * np.array([np.sin(15.0 * TIME), 15.0 * np.cos(15.0 * TIME), -225.0 * np.sin(15.0 * TIME)])
    motion = Motion.along_x(TIME, travel[2], velocity=travel[1], position=travel[0])
    machine = having(ref.cart(), riders=[SLIDE])
    return Case(machine, settings={"riders": {"slide": motion}}, studies=False)


def under_way(machine: Machine) -> Case:
    motion = Motion.along_x(TIME, 2.0 * np.cos(2.0 * np.pi * TIME), velocity=0.0 * TIME)
    return Case(machine, motion, {"start": "quasi-static"})


CASES: dict[str, Callable[[], Case]] = {
    "linear": lambda: Case(ref.cart()),
    "play": lambda: Case(ref.cart_clear()),
    "preload": lambda: Case(ref.preloaded()),
    "extra links, jumps": lambda: Case(
        ref.random_machine(32, free=ref.DOFS, carriages=3),
        ref.random_motion(32, wrench=True, times="ticks", jumps=True),
    ),
    "mounting errors": lambda: Case(mounted(ref.cart())),
    "mounting errors, play": lambda: Case(mounted(ref.cart_clear())),
    "mounting errors, preload": lambda: Case(mounted(ref.preloaded())),
    "elastic base": lambda: Case(ref.on_base(mounted(ref.cart()), ref.random_base())),
    "payload": lambda: Case(having(ref.cart(), payloads=[PART])),
    "payload, preload": lambda: Case(having(ref.preloaded(), payloads=[PART])),
    "rider": riding,
    "wavy rails": lambda: Case(on_rails(waviness=WAVES | {"seed": 8}), studies=False),
    "rolled rails": lambda: Case(on_rails(roll="30 deg")),
    "points": lambda: Case(having(ref.cart(), points=TOOLS)),
    "push of a rack": lambda: Case(having(ref.cart(), drive=RACK)),
    "elastic drive": lambda: Case(having(ref.cart(), links=[SCREW], free=ref.DOFS)),
    "under way": lambda: under_way(ref.cart()),
    "under way, from rest": lambda: Case(ref.cart(), under_way(ref.cart()).motion, {"start": "rest"}),
    "gravity along travel": lambda: Case(having(ref.cart(), gravity=(-9.8, 0.0, 0.0))),
    "under way, preload": lambda: under_way(ref.preloaded()),
    "a measured trace": lambda: Case(*ref.example()),
}


@cache
def case_of(name: str) -> Case:
    return CASES[name]()


every_case = pytest.mark.parametrize("name", CASES)


def tolerance(case: Case) -> float:
    """Of loads, over the largest: exact runs differ by rounding, others by some tolerances of 1e-6."""
    return 1e-9 if case.result.method == "exact" else 1e-5


@every_case
def test_forces_and_energy_balance(name: str) -> None:
    audit = case_of(name).result.audit
    assert audit.force_balance.holds and audit.force_balance.residual < 1e-12 and not audit.doubts
    assert (audit.energy is None) == (name == "rider")
    # The power is integrated over the instants, and kinks between them count in full.
    kinks = "play" in name or "jumps" in name
    assert audit.energy is None or audit.energy.residual < (1e-5 if kinks else 1e-6)


@every_case
def test_parts_are_sums(name: str) -> None:
    """Loads are elastic and damping parts, and rails bear what their carriages bear."""
    case = case_of(name)
    data, machine = case.result.quantities, case.machine
    for load in ("force", "moment", "link_load"):
        parts = data[f"{load}_elastic"] + data[f"{load}_damping"]
        assert np.abs(data[load] - parts).max() <= 1e-14 * np.abs(data[load]).max()
    if name != "rolled rails":  # there, rails have axes of their own
        for i in range(len(machine.rails)):
            sums = data["force"][:, machine.rail_of_carriage == i].sum(axis=1)
            assert np.abs(data["rail_force"][:, i] - sums).max() <= 1e-12 * np.abs(data["force"]).max()


@every_case
def test_another_method_and_given_instants_give_the_same(name: str) -> None:
    case = case_of(name)
    data, allowed = (
        case.result.quantities,
        tolerance(case) * np.abs(case.result.quantities["link_load"]).max(),
    )
    changes = [time for payload in case.machine.payloads for span in payload.times for time in span]
    instants = np.union1d(np.unique(data["time"])[3:-3:97], changes)
    last = np.searchsorted(data["time"], instants, side="right") - 1
    times = data["time"][last]
    for method in ("implicit", "rk45", None):
        settings = {"method": method, "rtol": 1e-9} if method else {}
        found = simulate(case.machine, case.motion, times=times, **case.settings | settings)
        at_instants = found.quantities["link_load"]
        assert np.abs(at_instants - data["link_load"][last]).max() <= allowed
        assert found.audit.force_balance.holds


@every_case
def test_peaks_are_those_at_any_time(name: str) -> None:
    """At most 0.3 % above those of the instants, between which a history bows by a quarter of a percent."""
    case = case_of(name)
    found = peak_loads(case.machine, case.motion, **case.settings)
    columns, most = case.result.peak_columns, case.result.quantities["resultant"].max(axis=0)
    size = np.maximum(found.largest, -found.smallest)
    for column, of in ((6, "peak_resultant_N"), (1, "peak_Fy_N"), (5, "peak_Mz_Nm")):
        np.testing.assert_allclose(size[:, column], columns[of], rtol=1e-13, atol=1e-14 * most.max())
    np.testing.assert_allclose(found.time_of_largest[:, 6], columns["time_of_peak_s"], rtol=1e-9)
    above = 1e-3 if name == "rider" else 3e-3
    assert (size[:, 6] >= most).all() and (size[:, 6] <= (1.0 + above) * most).all()


@every_case
def test_the_largest_equivalent_load_is_that_at_any_time(name: str) -> None:
    """It is the equivalent load at its time, and no instant has a larger one."""
    case, rules = case_of(name), [EQUIVALENT.of_core] * len(case_of(name).machine.carriages)
    found = case.result.extremes(rules)
    at_instants = EQUIVALENT.without_preload(case.result.carriage_loads).max(axis=0)
    if name == "wavy rails":  # their loads are known at the instants alone
        assert found is None
        return
    assert found is not None
    largest, times = found.equivalent.T
    above = largest - at_instants
    assert (above >= -1e-12 * largest).all() and (above <= 3e-3 * largest.max()).all()
    order = np.unique(times)
    loads = simulate(case.machine, case.motion, times=order, **case.settings).carriage_loads
    then = np.diagonal(EQUIVALENT.without_preload(loads[np.searchsorted(order, times)]))
    np.testing.assert_allclose(then, largest, rtol=tolerance(case))


@every_case
def test_the_largest_drive_force_is_that_at_any_time(name: str) -> None:
    """It is the force at its time, and no instant has a larger one."""
    case = case_of(name)
    needed = drive_requirements(case.result)
    if name == "wavy rails":  # their forces are known at the instants alone
        assert needed.with_peaks is needed
        return
    time, force = needed.with_peaks.time, np.abs(needed.with_peaks.force)
    at = int(force.argmax())
    there = drive_requirements(simulate(case.machine, case.motion, times=time[[at]], **case.settings))
    np.testing.assert_allclose(np.abs(there.force), needed.peak_force, rtol=tolerance(case))
    dense = np.linspace(*np.interp([at - 2, at + 2], np.arange(time.size), time), 400)
    around = drive_requirements(simulate(case.machine, case.motion, times=dense, **case.settings))
    assert np.abs(around.force).max() <= needed.peak_force * (1.0 + tolerance(case))


@every_case
def test_the_largest_motions_of_points_are_those_at_any_time(name: str) -> None:
    """They are the motions at their times, and no instant has larger ones."""
    case = case_of(name)
    with_tools = Case(having(case.machine, points=TOOLS), case.motion, case.settings)
    peaks, time = with_tools.result.points(), with_tools.result.quantities["time"]
    if name == "wavy rails":  # their motions are known at the instants alone
        return
    for i, at in enumerate(peaks["time_of_peak_s"]):
        around = np.union1d(np.clip(at + np.linspace(-2e-3, 2e-3, 401), time[0], time[-1]), at)
        found = simulate(with_tools.machine, case.motion, times=around, **case.settings)
        place = (
            found.quantities["point_displacement"][:, i] - found.quantities["static_point_displacement"][i]
        )
        distance, largest = np.linalg.norm(place, axis=1), peaks["peak_m"].iloc[i]
        assert distance[np.searchsorted(around, at)] == pytest.approx(largest, rel=tolerance(case))
        assert distance.max() <= largest * (1.0 + tolerance(case))


# Of netCDF, which takes four times as long, the cases whose files have quantities, dimensions or instants of their own.
NETCDF = ("extra links, jumps", "payload, preload", "rider", "wavy rails", "points", "a measured trace")


@pytest.mark.parametrize(
    ("name", "ending"), [*((name, "parquet") for name in CASES), *((name, "nc") for name in NETCDF)]
)
def test_files_keep_everything(name: str, ending: str, tmp_path: Path) -> None:
    result, file = case_of(name).result, tmp_path / f"loads.{ending}"
    {"nc": result.to_netcdf, "parquet": result.to_parquet}[ending](file)
    again = Result.load(file)
    assert again.machine == result.machine and again.data.identical(result.data)
    pd.testing.assert_frame_equal(again.peaks(), result.peaks(), check_exact=True)
    pd.testing.assert_frame_equal(again.points(), result.points(), rtol=1e-3 * tolerance(case_of(name)))
    assert str(again.audit) == str(result.audit)
    rules = [EQUIVALENT.of_core] * len(result.machine.carriages)
    if found := result.extremes(rules):
        once_more = again.extremes(rules)
        assert once_more is not None
        np.testing.assert_allclose(
            once_more.equivalent, found.equivalent, rtol=1e-3 * tolerance(case_of(name))
        )
    else:
        assert again.extremes(rules) is None
    forces = [drive_requirements(one).peak_force for one in (again, result)]
    assert forces[0] == pytest.approx(forces[1], rel=1e-3 * tolerance(case_of(name)))
    for part in ("force_balance", "energy", "rotation", "sampling"):
        assert getattr(again.audit, part) == getattr(result.audit, part), part
    for array in ("contact.lost", "simpler_models.quasi_static"):
        np.testing.assert_array_equal(*(attrgetter(array)(one.audit) for one in (again, result)))


@pytest.mark.parametrize("name", [name for name, make in CASES.items() if make().studies])
def test_a_study_has_the_peaks_of_single_runs(name: str) -> None:
    case = case_of(name)
    mass = [case.machine.body.mass]
    if name != "push of a rack":  # a study keeps the push of its machine
        mass.append(1.1 * mass[0])
    study = Study(machine=case.machine, motion=case.motion, cases={"body.mass": mass}, **case.settings)
    found = run_study(study)
    for i, one in enumerate(mass):
        heavier = with_mass(case.machine, one)
        peaks = peak_loads(heavier, case.motion, **case.settings).largest[:, 6]
        if not is_elastic(case.machine):
            force = drive_requirements(simulate(heavier, case.motion, **case.settings)).peak_force
            assert found.of_all_runs("peak_drive_N")[i] == pytest.approx(force, rel=1e-2 * tolerance(case))
        names = [f"peak_resultant_N[{carriage.name}]" for carriage in case.machine.carriages]
        assert [found.of_all_runs(name)[i] for name in names] == pytest.approx(
            peaks, rel=1e-2 * tolerance(case)
        )
