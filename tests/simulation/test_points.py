"""Motion of points: kinematics, sag and settling by closed forms; stored results keep it."""

from __future__ import annotations

from pathlib import Path

import machines
import numpy as np
import pandas as pd
import pytest
from oscillator import free_vibration, step_response
from reference import cart, cart_clear, cycle, preloaded

from guideload import ArgumentError, Machine, Motion, Moves, PointOfInterest, Result, simulate
from guideload.base.errors import ReadError
from guideload.drive import drive_requirements
from guideload.machine.payloads import Payload
from guideload.machine.riders import Rider
from guideload.reports.run import result_report
from guideload.simulation.point_motion import from_rest

MASS, STIFFNESS, DAMPING = 100.0, 4e6, 1e3  # one dof: 200 rad/s, damping ratio 2.5 %
OMEGA = np.sqrt(STIFFNESS / MASS)


def with_points(base: Machine, *places: tuple[float, float, float], window: float | None = None) -> Machine:
    points = [PointOfInterest(name=f"p{i}", at=at, settle_window=window) for i, at in enumerate(places)]
    return base.model_copy(update={"points": points})


def bouncing(window: float | None = None, place: tuple[float, float, float] = (0.3, 0.2, 0.1)) -> Machine:
    """A mass that moves along y alone."""
    return with_points(machines.bouncing(MASS, STIFFNESS, DAMPING), place, window=window)


def braked(rest: float = 0.5) -> Motion:
    """1 m/s2 along y until 0.1 s, then -1 m/s2 until 0.2 s, then rest; stamps 0.1 ms apart, jumps between."""
    stamps = 1e-4 * np.arange(round(1e4 * (0.2 + rest)) + 1)
    time = np.sort(np.append(stamps, stamps[[1000, 2000]]))
    along = np.repeat([1.0, -1.0, 0.0], [1001, 1001, time.size - 2002])
    return Motion(time, np.column_stack([0.0 * time, along, 0.0 * time]))


def envelope_leaves(window: float) -> float:
    """The last instant after 0.2 s at which the mass under -a(t) of `braked` is outside the window: closed forms."""
    constants, steps = (MASS, STIFFNESS, DAMPING), ((0.0, -1.0), (0.1, 2.0))
    parts = [step_response(constants, 0.2 - start, size * MASS) for start, size in steps]
    place, speed = np.sum(parts, axis=0)  # at 0.2 s, from where on nothing pushes
    time = np.arange(0.0, 0.5, 1e-6)
    y, _ = free_vibration(constants, time, place, speed)
    return float(time[np.flatnonzero(np.abs(y) > window)[-1]])


@pytest.mark.parametrize("build", [cart, cart_clear])
def test_a_point_at_a_link_moves_by_its_deflection(build: object) -> None:
    """Elastic load of a link = law(direction . displacement of its point), at rest and in time."""
    base = build()
    links = base.link_table()
    here = with_points(base, *map(tuple, links.points))
    result = simulate(here, cycle())
    data = result.quantities
    along = np.einsum("tpa,pa->tp", data["point_displacement"], links.directions)
    scale = np.abs(data["link_load_elastic"]).max()
    for i, law in enumerate(links.laws):
        load = data["link_load_elastic"][:, i]
        assert np.abs(law.force(np.ascontiguousarray(along[:, i])) - load).max() <= 1e-9 * scale
    still = (data["static_point_displacement"] * links.directions).sum(axis=1)
    loads = [float(law.force(np.array([x]))[0]) for law, x in zip(links.laws, still, strict=True)]
    assert loads == pytest.approx(data["static_link_load"], rel=1e-9, abs=1e-9 * scale)


def test_velocity_and_acceleration_are_derivatives() -> None:
    """By central differences on instants 1 us apart; the absolute acceleration is that plus the cart's."""
    times = 0.61 + 1e-6 * np.arange(2001)
    result = simulate(with_points(cart(), (0.4, -1.0, 0.7)), cycle(), times=times)
    data = result.quantities
    place, speed, rate = (data[f"point_{name}"] for name in ("displacement", "velocity", "acceleration"))
    for history, derivative in ((place, speed), (speed, rate)):
        slope = (history[2:] - history[:-2]) / 2e-6
        assert np.abs(slope - derivative[1:-1]).max() <= 1e-5 * np.abs(derivative).max()
    absolute = data["point_absolute_acceleration"] - rate
    assert np.allclose(absolute[:, 0], data["cart_acceleration"], atol=1e-12)


def test_sag_is_weight_over_stiffness() -> None:
    result = simulate(bouncing(), braked())
    row = result.points().loc["p0"]
    assert row["sag_m"] == pytest.approx(MASS * 9.80665 / STIFFNESS, rel=1e-12)
    at_instants = result.quantities["point_displacement"][:, 0, 1] + row["sag_m"]
    assert np.abs(at_instants).max() < row["peak_m"] < 1.001 * np.abs(at_instants).max()
    there = simulate(bouncing(), braked(), times=[row["time_of_peak_s"]]).quantities["point_displacement"]
    assert row["peak_m"] == pytest.approx(abs(there[0, 0, 1] + row["sag_m"]), rel=1e-12)
    assert row["peak_y_m"] == row["peak_m"] and row["peak_x_m"] == 0.0


@pytest.mark.parametrize("window", [2e-5, 1e-5, 3e-6])
def test_settling_by_the_closed_form(window: float) -> None:
    """One dof after its last acceleration, at stamps 0.1 ms apart."""
    (found,) = simulate(bouncing(window), braked()).settling()
    assert [one.end for one in found.spans] == [0.2]
    assert 0.0 <= found.time[0] - envelope_leaves(window) <= 1.01e-4
    (given,) = simulate(bouncing(), braked()).settling(f"{1e6 * window} um")
    assert given.time == found.time


def test_what_is_not_seen_to_settle_has_no_time() -> None:
    """The record ends before, or within half a period of the vibration."""
    window = 1e-5
    late = envelope_leaves(window)
    for rest in (0.5 * late, late + 0.4 * np.pi / OMEGA):
        (found,) = simulate(bouncing(window), braked(rest)).settling()
        assert np.isnan(found.time).all()
    text = " ".join(result_report(simulate(bouncing(window), braked(0.5 * late))).text().split())
    assert "p0 is not seen to settle after 1 move" in text


def test_a_lasting_force_moves_the_place_of_rest() -> None:
    """A force that rises to k times 1 mm during the move and stays: the window of 10 um lies around the new place."""
    force = np.array([[0.0, 0.0, 0.0], [0.0, 1e-3 * STIFFNESS, 0.0], [0.0, 1e-3 * STIFFNESS, 0.0]])
    pressed = braked().with_force((0, 0, 0), force, time=[0.0, 0.2, 1.0])
    (found,) = simulate(bouncing(1e-5), pressed).settling()
    assert np.isfinite(found.time).all()


def test_a_payload_that_is_gripped_at_rest_settles_at_its_own_place() -> None:
    """From the grip on, the sag m g / k of the payload decays as the free vibration of both masses."""
    mass, window, end, grip = 30.0, 1e-6, 0.2, 2.5  # the vibration of the move is gone
    part = Payload(
        name="part", mass=mass, center_of_mass=(0, 0, 0), inertia=np.eye(3).tolist(), times=[(grip, 9.0)]
    )
    machine = bouncing(window).model_copy(update={"payloads": (part,)})
    (found,) = simulate(machine, braked(5.0)).settling()
    since = np.arange(0.0, 3.0, 1e-6)
    y, _ = free_vibration((MASS + mass, STIFFNESS, DAMPING), since, mass * 9.80665 / STIFFNESS)
    expected = grip - end + since[np.flatnonzero(np.abs(y) > window)[-1]]
    assert found.spans[0].end == end and 0.0 <= found.time[0] - expected <= 1.01e-4


def test_a_payload_that_stays_all_the_time_settles_as_a_part_of_the_body() -> None:
    part = Payload(
        name="part", mass=900.0, center_of_mass=(0, 0, 0), inertia=np.eye(3).tolist(), times=[(-1.0, 9.0)]
    )
    machine = bouncing().model_copy(update={"payloads": (part,)})
    for rest in (0.03, 0.5, 1.5):  # the slow mode of both masses decides how long is long enough
        for window in (1e-2, 1e-5, 1e-6):
            one, other = (
                simulate(each, braked(rest)).settling(window)
                for each in (machine, machine.with_payloads(["part"]))
            )
            np.testing.assert_array_equal(one[0].time, other[0].time)


@pytest.mark.parametrize("build", [cart, preloaded])
def test_when_all_has_decayed_points_are_at_rest_with_payload_and_rider(build: object) -> None:
    """Also with laws that are not linear, and where a point turns about L."""
    heavy = {"mass": 180.0, "center_of_mass": (0.1, 0.3, -0.2), "inertia": (9.0 * np.eye(3)).tolist()}
    machine = with_points(build(), (0.4, -1.0, 0.7), window=1e-6)
    carried = machine.model_copy(update={"payloads": (Payload(name="part", **heavy, times=[(1.0, 99.0)]),)})
    ridden = machine.model_copy(update={"riders": (Rider(name="slide", **heavy, direction=(1, 0, 2)),)})
    limits = {"speed": 1.0, "acceleration": 4.0, "jerk": 200.0}
    motion = Moves(limits=limits, moves=[{"distance": 0.3, "dwell": 4.0}]).motion()
    for result in (simulate(carried, motion), simulate(ridden, motion, riders={"slide": motion})):
        data = result.quantities
        (found,) = result.settling()
        left = from_rest(machine=result.machine, data=data, spans=found.spans)[-1]
        moved = data["point_displacement"][-1] - data["static_point_displacement"]
        assert np.linalg.norm(moved) > 1e-6 and np.linalg.norm(left) <= 1e-3 * np.linalg.norm(moved)
        assert np.isfinite(found.time).all()


def test_impossible_windows_are_refused() -> None:
    result = simulate(bouncing(), braked())
    assert result.settling() == ()
    with pytest.raises(ArgumentError, match="window: expected a length above 0 m"):
        result.settling(-1e-6)
    with pytest.raises(ArgumentError, match="no instant"):
        simulate(bouncing(), braked(), times=[]).points()


def test_a_file_without_the_points_of_its_machine_is_refused(tmp_path: Path) -> None:
    result = simulate(with_points(cart(), (0, 0, 0), (0.4, -1.0, 0.7)), cycle())
    broken = result.data.drop_vars("point_velocity")
    Result(result.machine, broken).to_netcdf(tmp_path / "broken.nc")
    with pytest.raises(ReadError, match="without point_velocity"):
        Result.load(tmp_path / "broken.nc")


def test_a_longer_record_of_the_same_cycle_has_the_same_peaks() -> None:
    """Of each quantity as many maxima are searched, whatever its unit; only the first cycle begins at rest."""
    time = np.arange(0.0, 0.48, 4e-3)
    rate = np.where((time > 0.05) & (time < 0.2), 2.2, np.where((time > 0.25) & (time < 0.4), -2.2, 0.0))
    machine = with_points(cart(), (0.4, -1.0, 0.7))

    def peaks(cycles: int) -> pd.Series:
        whole = np.arange(cycles * time.size) * 4e-3
        result = simulate(machine, Motion.along_x(whole, np.tile(rate, cycles)))
        return result.points().loc["p0"].drop("time_of_peak_s")

    few, many = peaks(5), peaks(40)
    pd.testing.assert_series_equal(few, many, rtol=1e-7)


def test_a_fixed_step_has_the_peaks_of_the_others() -> None:
    """Its result reports the stamps alone, which are few."""
    time = np.array([0.0, 0.1, 0.15, 0.3, 0.35, 0.6])
    motion = Motion.along_x(time, [0.0, 0.0, 2.0, 2.0, 0.0, 0.0])
    machine = with_points(cart(), (0.4, -1.0, 0.7))
    exact, stepped = simulate(machine, motion), simulate(machine, motion, "implicit", step=1e-4)
    assert stepped.quantities["time"].size == time.size
    pd.testing.assert_frame_equal(stepped.points(), exact.points(), rtol=1e-5)
    forces = [drive_requirements(result).peak_force for result in (stepped, exact)]
    assert forces[0] == pytest.approx(forces[1], rel=1e-6)
