"""What drives a figure: changes are those of machines with changed numbers; report, picture and command."""

import lives
import numpy as np
import pytest
from command_line import MACHINE, TRACE, guideload, refused
from machines import having, one_mass, with_mass
from moves import GENTLE
from reference import cart, piece, pulse

from guideload import Rider, peak_loads, plots
from guideload.base.errors import ArgumentError
from guideload.base.number_text import digits, kilometres, signed
from guideload.catalogue.product import Product
from guideload.reports.sensitivities import sensitivities_report
from guideload.sensitivity import rank_influences

MOTION = piece(pulse(), 4995, 5060)


def test_changes_are_those_of_changed_machines() -> None:
    machine = cart()
    found = rank_influences(machine, MOTION)
    peaks = peak_loads(machine, MOTION)
    worst = int(peaks.largest[:, 6].argmax())
    assert found.carriage == peaks.carriages[worst]
    assert found.value == pytest.approx(peaks.largest[worst, 6], rel=1e-12)
    assert (np.diff(np.abs(found.changes)) <= 0.0).all()
    at = {column.name: i for i, column in enumerate(found.columns)}
    heavier = peak_loads(with_mass(machine, 1.0001 * machine.body.mass), MOTION)
    change = 100.0 * (heavier.largest[worst, 6] - found.value)
    assert found.changes[at["body.mass"]] == pytest.approx(change, rel=1e-3)
    assert found.steps[at["body.mass"]] == "1 %"
    assert found.steps[at["carriages[1a].x"]] == "1 mm"
    assert not any("clearance" in name for name in at)  # of 0: no derivative


def test_report_and_picture_name_the_strongest_first() -> None:
    found = rank_influences(cart(), MOTION, to=["body.mass", "carriages.*.stiffness_y"], carriage="2a")
    lines = sensitivities_report(cart(), MOTION, found).text().splitlines()
    assert "what drives the largest load of carriage 2a" in " ".join(lines)
    rows = [
        line.split()[0] for line in lines if line.startswith((" body", " carriages", "body", "carriages"))
    ]
    assert rows[:5] == [column.name for column in found.columns]
    assert len(plots.influence(cart(), found).patches) == 5
    with pytest.raises(ArgumentError, match="carriage: expected one of 1a, 1b, 2a"):
        rank_influences(cart(), MOTION, carriage="9")
    with pytest.raises(ArgumentError, match="expected a machine with carriages, .* got links only"):
        rank_influences(one_mass(1.0, stiffness=1e6, damping=1e3), MOTION)
    with pytest.raises(ArgumentError, match="of: expected one of peak_resultant"):
        rank_influences(cart(), MOTION, "weight")


def test_a_life_is_told_in_km_and_numbers_in_the_units_of_machine_files() -> None:
    doubtful = Product(**{**lives.PRODUCT, "unverified": ("dynamic",)})
    machine, motion = having(lives.cart(), products=(doubtful,)), lives.moved(GENTLE)
    found = rank_influences(machine, motion, "life", to=["carriages.*.stiffness_y"])
    report = sensitivities_report(machine, motion, found)
    assert f"life of carriage {found.carriage}, {kilometres(found.value)} km" in report.answer[0]
    stiffness = digits(1e-6 * found.columns[0].value, 4)
    row = next(line for line in report.text().splitlines() if found.columns[0].name in line)
    assert f"{stiffness} N/um" in row and signed(found.changes[0], "life") in row
    assert any("not checked by a person: dynamic" in one for one in report.warnings)
    assert plots.influence(machine, found).get_xlabel() == "effect of the change [km]"


def test_command_prints_the_table() -> None:
    arguments = ("sensitivities", MACHINE, TRACE, "--to", "body.mass")
    assert "body.mass" in guideload(*arguments).stdout
    assert "known path" in refused(*arguments, "--to", "body.weight")


def test_a_rider_that_moves_is_refused() -> None:
    """The derivatives are those of riders at their positions."""
    keys = {"center_of_mass": (0, 0, 0), "inertia": np.eye(3).tolist(), "direction": (1, 0, 0)}
    standing, moving = (
        cart().model_copy(update={"riders": (Rider(name="slide", mass=60.0, motion=motion, **keys),)})
        for motion in (None, "slide.toml")
    )
    assert rank_influences(standing, MOTION, to=["body.mass"]).value
    with pytest.raises(ArgumentError, match='riders: a sensitivity .* "slide" has the motion'):
        rank_influences(moving, MOTION)
