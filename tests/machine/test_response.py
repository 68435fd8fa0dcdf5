"""Frequency response: one degree of freedom by its formula, reciprocity, and the machine in time."""

from __future__ import annotations

from pathlib import Path

import machines
import numpy as np
import pandas as pd
import pytest
from command_line import MACHINE, guideload, refused
from reference import cart, cart_clear
from texts import one_line

from guideload import (
    ArgumentError,
    Machine,
    Motion,
    PointOfInterest,
    frequency_response,
    plots,
    simulate,
)
from guideload.machine.modes import Modes
from guideload.machine.payloads import Payload
from guideload.reports.machine import machine_report, modes_report
from guideload.reports.response import response_report

MASS, STIFFNESS, DAMPING = 100.0, 4e6, 1e3
PLACES = ((0.3, -1.0, 0.4), (-0.2, 0.5, 0.1))


def with_points(base: Machine) -> Machine:
    points = [PointOfInterest(name=f"p{i}", at=at) for i, at in enumerate(PLACES)]
    return base.model_copy(update={"points": points})


def bouncing(**changes: object) -> Machine:
    """A mass that moves along y alone."""
    return with_points(machines.bouncing(MASS, STIFFNESS, DAMPING, **changes))


def test_one_degree_of_freedom() -> None:
    """Force: 1/(k - m w^2 + i w b); drive: -m times that, and its absolute acceleration is the transmissibility."""
    hertz = np.array([0.1, 10.0, 31.8, 32.0, 100.0, 1e4])
    omega = 2.0 * np.pi * hertz
    compliance = 1.0 / (STIFFNESS - MASS * omega**2 + 1j * omega * DAMPING)
    force = frequency_response(bouncing(), hertz, force_at="p0", direction="y")
    drive = frequency_response(bouncing(), hertz, direction=(0, 2, 0))
    for i in range(2):
        assert force.displacement[:, i, 1] == pytest.approx(compliance, rel=1e-12)
        assert drive.displacement[:, i, 1] == pytest.approx(-MASS * compliance, rel=1e-12)
    assert not force.displacement[:, :, [0, 2]].any()
    carried = (STIFFNESS + 1j * omega * DAMPING) * compliance
    assert drive.absolute_acceleration[:, 0, 1] == pytest.approx(carried, rel=1e-9)
    assert drive.absolute_acceleration[:, 0, 0] == pytest.approx(np.zeros(6), abs=1e-15)
    assert force.static[0, 1] == pytest.approx(1.0 / STIFFNESS) and drive.static[0, 1] == pytest.approx(
        -MASS / STIFFNESS
    )
    resonance = frequency_response(
        bouncing(), [np.sqrt(STIFFNESS / MASS) / (2 * np.pi)], force_at="p1", direction="y"
    )
    assert resonance.phase[0, 0, 1] == pytest.approx(-90.0, abs=1e-9)
    assert (force.unit, drive.unit) == ("m/N", "m/(m/s2)")


def test_an_undamped_resonance_is_refused_and_beside_it_the_formula_holds() -> None:
    """Among modes at one frequency too, of which only that along y is damped."""
    undamped = bouncing(damping_y=0.0)
    own = np.sqrt(STIFFNESS / MASS) / (2.0 * np.pi)
    for hertz in (None, [own], [10.0, own * (1.0 + 1e-12)]):
        with pytest.raises(ArgumentError, match=f"expected damping of the mode at {own:.4g} Hz, got none"):
            frequency_response(undamped, hertz, force_at="p0", direction="y")
    beside = own * np.array([0.9, 1.0 + 1e-6, 2.0])
    found = frequency_response(undamped, beside, force_at="p0", direction="y").displacement[:, 0, 1]
    assert found == pytest.approx(1.0 / (STIFFNESS * (1.0 - (beside / own) ** 2)), rel=1e-8)
    body = machines.body(center_of_mass=(0.0, 0.0, 0.0), inertia=np.diag([8.0, 9.0, 5.0]))
    half = with_points(machines.table(body, 1.0, 0.5, free=["y", "z"], damping_z=0.0))
    with pytest.raises(ArgumentError, match="expected damping of the mode at"):
        frequency_response(half, direction="y")


def test_what_symmetry_forbids_is_zero_in_the_report() -> None:
    """A machine whose halves z > 0 and z < 0 mirror each other does not move along z."""
    body = machines.body(center_of_mass=(0.1, 0.3, 0.0), inertia=np.diag([420.0, 310.0, 380.0]))
    points = [PointOfInterest(name="tool", at=(0.37, -0.21, 0.0))]
    mirrored = machines.table(body, 0.7, 0.31, points=points)
    response = frequency_response(mirrored)
    assert response_report(mirrored, response).text().split(" z ")[1].split()[:2] == ["0", "0"]
    assert "z" not in [
        line.get_label() for line in plots.frequency_response(mirrored, response)[0].get_lines()
    ]


def test_source_and_answer_may_be_exchanged() -> None:
    """Maxwell and Betti: p1 answers along b to a force at p0 along a as p0 does along a to one at p1 along b."""
    here = with_points(cart())
    for a in range(3):
        at_first = frequency_response(here, force_at="p0", direction="xyz"[a]).displacement
        for b in range(3):
            at_second = frequency_response(here, force_at="p1", direction="xyz"[b]).displacement
            scale = np.abs(at_first).max()
            assert np.abs(at_first[:, 1, b] - at_second[:, 0, a]).max() <= 1e-12 * scale


def test_a_lasting_vibration_has_this_amplitude_and_phase() -> None:
    """Under a(t) = cos(w t) for long enough, each point moves as Re(H exp(i w t)) of the response."""
    here, hertz = with_points(cart()), 40.0
    time = np.arange(0.0, 3.0, 1e-4)
    motion = Motion.along_x(time, np.cos(2 * np.pi * hertz * time))
    data = simulate(here, motion).quantities
    moving = (data["point_displacement"] - data["static_point_displacement"])[time > 2.5]
    response = frequency_response(here, [hertz]).displacement[0]
    expected = (response * np.exp(2j * np.pi * hertz * time[time > 2.5])[:, None, None]).real
    assert np.abs(moving - expected).max() <= 2e-4 * np.abs(expected).max()


def test_nonlinear_links_have_their_slope_at_rest() -> None:
    """The mass presses on the softer side; within a clearance that the weight closes, damping acts."""
    sided = {
        "stiffness_y": {"positive": 9e6, "negative": STIFFNESS},
        "clearance_y": 1e-5,
        "damping_in_contact": True,
    }
    plain, bent = bouncing(), bouncing(**sided)
    hertz = np.array([5.0, 31.0, 200.0])
    expected = frequency_response(plain, hertz, direction="y").displacement
    assert frequency_response(bent, hertz, direction="y").displacement == pytest.approx(expected, rel=1e-9)
    lifted = bent.model_copy(update={"gravity": (0.0, 9.80665, 0.0)})
    stiff = 1.0 / (9e6 - MASS * (2 * np.pi * hertz) ** 2 + 2j * np.pi * hertz * DAMPING)
    assert frequency_response(lifted, hertz, direction="y").displacement[:, 0, 1] == pytest.approx(
        -MASS * stiff, rel=1e-9
    )


def test_default_frequencies_show_each_resonance() -> None:
    """The largest value is within 1 per mille of that on a grid a hundred times finer."""
    here = with_points(cart_clear())
    response = frequency_response(here)
    ends = response.frequency[[0, -1]]
    found, fine = (
        one.magnitude.max(axis=0) for one in (response, frequency_response(here, np.geomspace(*ends, 40_000)))
    )
    assert found == pytest.approx(fine, rel=1e-3, abs=1e-6 * fine.max())


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"force_at": "p7"}, "got 'p7'; it has p0, p1"),
        ({"direction": "w"}, "direction: expected x, y, z or a finite vector"),
        ({"direction": (0, 0, 0)}, "x, y, z or a finite vector other than zero"),
        ({"frequency": [0.0, 1.0]}, "frequencies above 0 Hz"),
        ({"frequency": "all"}, "frequency: expected an array of real numbers, got texts"),
    ],
)
def test_impossible_questions_are_refused(options: dict[str, object], words: str) -> None:
    with pytest.raises(ArgumentError, match=words):
        frequency_response(with_points(cart()), **options)
    with pytest.raises(ArgumentError, match=r"expected \[\[points\]\]"):
        frequency_response(cart())


def test_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert "expected [[points]]" in refused("response", MACHINE)
    for direction in ("1,0", "a,0,0", "w"):
        message = refused("response", MACHINE, "--direction", direction)
        assert f"expected x, y, z or three numbers such as 1,0,0.5, got '{direction}'" in message
    point = '\n[[points]]\nname = "tool"\nat = ["100 mm", "-800 mm", "200 mm"]\n'
    Path("machine.toml").write_text(Path(MACHINE).read_text(encoding="utf-8") + point, encoding="utf-8")
    options = ["--force-at", "tool", "--direction", "0,1,0", "-o", "out.png", "--csv", "out.csv"]
    text = guideload("response", "machine.toml", *options).stdout
    assert "response to a force at tool along y, in um per N" in text and Path("out.png").exists()
    table, found = (
        pd.read_csv("out.csv"),
        frequency_response(Machine.from_toml("machine.toml"), force_at="tool", direction="y"),
    )
    assert table["tool y re [m/N]"].to_numpy() == pytest.approx(found.displacement[:, 0, 1].real, rel=1e-12)
    assert "exists; give another name" in refused("response", "machine.toml", "--csv", "out.csv")
    refused("response", "machine.toml", "--direction", "1,x")


def test_reports_without_payloads_say_so() -> None:
    """Modes, response and check are those of the machine without payloads; what carries them is named."""
    inertia = ((9.0, 0.0, 0.0), (0.0, 9.0, 0.0), (0.0, 0.0, 9.0))
    keys = {"center_of_mass": (0, 0, 0), "inertia": inertia, "times": [(0.0, 1.0)]}
    payloads = tuple(Payload(name=name, mass=mass, **keys) for name, mass in (("a", 90.0), ("b", 1500.0)))
    bare = with_points(cart())
    machine = bare.model_copy(update={"payloads": payloads})
    words = 'Without payload a (90 kg) and b (1500 kg); machine.with_payloads(["a"]) in Python is the machine that'
    for report in (
        lambda one: modes_report(one, Modes.of(one)),
        lambda one: response_report(one, frequency_response(one)),
        machine_report,
    ):
        assert words in one_line(report(machine).text())
        assert "Without payload" not in report(bare).text()
    assert np.array_equal(Modes.of(machine).frequency, Modes.of(machine.with_payloads([])).frequency)


def test_picture_has_every_point() -> None:
    here = with_points(cart())
    response = frequency_response(here)
    axes = plots.frequency_response(here, response)
    assert [ax.get_title("left") for ax in axes[::2]] == ["p0", "p1"]
    for i, ax in enumerate(axes[::2]):
        for line in ax.get_lines()[:3]:
            drawn = 1e6 * response.magnitude[:, i, "xyz".index(str(line.get_label()))]
            assert np.array_equal(line.get_ydata(), drawn)
