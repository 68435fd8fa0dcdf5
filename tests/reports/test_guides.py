"""Least lengths of rails, mass of carriages, seals of products in the drive force, and the head of a report."""

from __future__ import annotations

from datetime import date
from pathlib import Path

import numpy as np
import pytest
from command_line import guideload, refused
from hypothesis import given
from hypothesis import strategies as st
from lives import PRODUCT, cart, moved
from machines import having, with_carriages
from moves import GENTLE

from guideload import Machine, Motion, Product, html_report, simulate
from guideload.base.errors import ConfigError
from guideload.base.number_text import load_in_sentence
from guideload.drive import drive_requirements
from guideload.life.life import life_of
from guideload.machine.drive import Friction
from guideload.reports.assumptions import placement_lines
from guideload.reports.guides import STEP, guides_section, rail_lengths, shortest_rail
from guideload.reports.life import life_report
from guideload.reports.machine import machine_report
from guideload.reports.run import result_report
from guideload.simulation.drive_force import has_friction

MOTION = moved(GENTLE, 500.0)
SEAL = {"value": 1.5, "per": "end seal"}  # 3 N per carriage


def with_product(**changes: object) -> Machine:
    return cart().model_copy(update={"products": [Product(**PRODUCT | changes)]})


def test_every_carriage_stays_on_the_rail() -> None:
    """The ends of a rail of this length are where the ends of the outer carriages come, and no farther."""
    result = simulate(with_product(carriage_length=0.09), MOTION)
    assert MOTION.position is not None
    machine, place = result.machine, MOTION.position[:, 0]
    found = {one.rail: one for one in rail_lengths(result)}
    assert set(found) == {"1", "2"}
    for index, rail in enumerate(machine.rails):
        centers = machine.carriage_centers[machine.rail_of_carriage == index, 0]
        ends = place[:, None, None] + centers[:, None] + np.array([-0.045, 0.045])
        assert sum(found[rail.name][1:]) == pytest.approx(np.ptp(ends), rel=1e-14)
    text = " ".join(guides_section(result).parts[0])
    assert "shortest possible 3595 mm (" in text and "90 mm of their outer halves); add reserve" in text
    unknown = simulate(with_product(carriage_length=None), MOTION)
    assert all(np.isnan(one.halves) for one in rail_lengths(unknown))
    assert "mm and the length of a carriage (" in " ".join(guides_section(unknown).parts[0])


def test_a_long_carriage_between_others_makes_no_rail_longer() -> None:
    """Of carriages of different lengths, the ends of the first and of the last count."""
    lengths = {"p1": 0.09, "p2": 0.12, "p3": 0.2}
    products = [
        Product(**PRODUCT | {"name": name, "carriage_length": long}) for name, long in lengths.items()
    ]
    machine = cart()
    first, last = machine.carriages[:2]
    middle = first.model_copy(update={"name": "1m", "x": 0.0, "product": "p3"})
    ends = (first.model_copy(update={"product": "p1"}), middle, last.model_copy(update={"product": "p2"}))
    others = (one.model_copy(update={"product": "p1"}) for one in machine.carriages[2:])
    machine = machine.model_copy(update={"products": products, "carriages": (*ends, *others)})
    one, two = rail_lengths(simulate(machine, MOTION))
    reach = [[c.x - 0.5 * lengths[c.product], c.x + 0.5 * lengths[c.product]] for c in ends]
    assert one.span + one.halves == pytest.approx(np.ptp(reach), rel=1e-14)
    assert two.halves == pytest.approx(0.09, rel=1e-14)


@given(st.integers(1, 4000), st.floats(0.0, 1.0))
def test_the_shortest_rail_is_the_least_whole_step_that_is_long_enough(steps: int, part: float) -> None:
    """A length of whole steps, however its sum was rounded, is not made longer."""
    length = STEP * (steps - part)
    assert length <= shortest_rail(length) * (1 + 1e-6) and shortest_rail(length) < length + STEP
    exact = shortest_rail(steps * STEP * (1 + 1e-15))
    assert round(exact / STEP) == steps


def test_what_is_rigid_is_said_and_what_is_given_is_named() -> None:
    plain = cart()
    base = {"compliance": (1e-9 * np.eye(6)).tolist()}
    soft = with_carriages(plain, "1a", compliance_y=1e-9)
    for machine, words in (
        (plain, "The structure, table and base, is rigid in this model"),
        (soft, "the structure at carriage 1a (compliance); all else"),
        (having(plain, base=base), "Elastic are the guides and the base ([base]); all else"),
    ):
        for report in (machine_report(machine), result_report(simulate(machine, MOTION))):
            assert words in " ".join(report.text().split())


def test_what_a_mounting_error_would_change_is_said_of_machines_without() -> None:
    plain = cart()
    (text,) = placement_lines(plain)
    wrong = with_carriages(plain, "1b", mounting_error=(0.0, 1e-5))
    change = np.linalg.norm((wrong.static_carriage_loads - plain.static_carriage_loads)[1, 1:3])
    assert f"10 um of carriage 1b along z would change its load by {load_in_sentence(change)};" in text
    assert placement_lines(wrong) == []


def test_the_mass_of_the_carriages_is_that_of_all_of_a_product() -> None:
    text = guides_section(simulate(with_product(mass="0.51 kg"), MOTION)).parts[0]
    assert "4 carriages 20, 0.51 kg each, 2.04 kg together" in text


def test_seals_of_the_products_cost_their_force_over_the_whole_path() -> None:
    """4 carriages with 3 N each: work = 12 N times the path; the same as with [friction], which goes first."""
    free, sealed = cart(), with_product(seal_force=SEAL)
    needed = [drive_requirements(simulate(one, MOTION)) for one in (free, sealed)]
    assert MOTION.velocity is not None
    speed = MOTION.velocity[:, 0]
    added = needed[1].force - needed[0].force
    moves = np.abs(speed) > 1e-12
    # Forces of kilonewtons are rounded.
    assert added[moves] == pytest.approx(12.0 * np.sign(speed[moves]), abs=1e-9)
    assert not np.any(np.abs(added[~moves]) > 1e-9)
    work, path = (
        np.sum(0.5 * (each[1:] + each[:-1]) * np.diff(MOTION.time)) for each in (added * speed, np.abs(speed))
    )
    assert work == pytest.approx(12.0 * path, rel=1e-5)
    stated = free.model_copy(update={"friction": Friction(seal=3.0)})
    same = drive_requirements(simulate(stated, MOTION)).force
    assert same == pytest.approx(needed[1].force, rel=1e-14)
    other = sealed.model_copy(update={"friction": Friction(seal=1.0)})
    assert other.seal_forces.tolist() == [1.0] * 4
    assert sealed.model_copy(update={"friction": Friction(viscous=2.0)}).seal_forces.tolist() == [3.0] * 4


def test_the_coefficient_of_friction_of_a_product_is_that_of_its_carriages() -> None:
    """As one of [friction], which replaces it; and a study has the force of the drive without it."""
    free, rolling = with_product(), with_product(friction_coefficient=0.004)
    stated = free.model_copy(update={"friction": Friction(coefficient=0.004)})
    forces = [drive_requirements(simulate(one, MOTION)) for one in (free, rolling, stated)]
    assert forces[1].friction.max() > 1.0 and not forces[0].friction.any()
    assert forces[2].force.tobytes() == forces[1].force.tobytes()
    more = rolling.model_copy(update={"friction": Friction(viscous=2.0)})
    assert drive_requirements(simulate(more, MOTION)).friction.max() > forces[1].friction.max()
    none = rolling.model_copy(update={"friction": Friction(coefficient=0.0)})
    assert [has_friction(one) for one in (free, rolling, none)] == [False, True, False]
    said = [
        "that of the products, 0.004 of 20;" in result_report(simulate(one, MOTION)).text()
        for one in (rolling, stated)
    ]
    assert said == [True, False]


def test_seals_of_products_need_no_velocity() -> None:
    """Nobody asked for friction: a motion without velocity has none, as before."""
    motion = Motion.along_x(MOTION.time, MOTION.acceleration[:, 0])
    assert not drive_requirements(simulate(with_product(seal_force=SEAL), motion)).friction.any()


TO_SIGN = f"Checked by: {'_' * 20} Date: {'_' * 20}"
HEAD = """
[report]
project = "Gantry <12>"
customer = "A & B"
drawing = "4711 rev. B"
author = "N. N."
date = 2026-03-31
"""


def test_the_head_is_in_every_report_as_text_and_html() -> None:
    machine = cart(report={"project": "Gantry <12>", "date": date(2026, 3, 31)})
    result = simulate(machine, MOTION)
    for report in (result_report(result), machine_report(machine), life_report(life_of(result), band=False)):
        assert report.text().startswith(f"Project: Gantry <12>\nDate: 2026-03-31\n{TO_SIGN}\n\n")
        assert f"<p>{TO_SIGN}</p>" in html_report.report_page(report)
        assert "<p>Project: Gantry &lt;12&gt;</p>" in html_report.report_page(report)
    assert machine_report(cart()).text().startswith("machine: all springs")
    assert Machine.model_validate_json(machine.model_dump_json()) == machine


def test_the_head_comes_from_the_machine_file(tmp_path: Path) -> None:
    from guideload.cli.inputs import EXAMPLES

    file = tmp_path / "machine.toml"
    text = (EXAMPLES / "manipulator.toml").read_text(encoding="utf-8")
    file.write_text(text + HEAD, encoding="utf-8")
    shown = guideload("check", file).stdout
    assert shown.startswith(
        "Project: Gantry <12>\nCustomer: A & B\nDrawing: 4711 rev. B\nAuthor: N. N.\nDate: 2026-03-31\n"
    )
    file.write_text(text + '[report]\nchecked_by = "M. M."\n', encoding="utf-8")
    assert guideload("check", file).stdout.startswith(TO_SIGN.replace("by: ", "by: M. M. "))
    file.write_text(text + '[report]\ndate = "today"\n', encoding="utf-8")
    assert guideload("check", file).stdout.startswith(f"Date: {date.today().isoformat()}\n")
    file.write_text(text + "[report]\nproject = 12\n", encoding="utf-8")
    assert "report.project: expected text in quotes, got 12" in refused("check", file)
    with pytest.raises(ConfigError, match=r"report.customr: expected a known key.*\"customer\""):
        cart(report={"customr": "x"})
