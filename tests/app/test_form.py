"""The form without a browser: what is typed into a field, and what the field then shows."""

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("nicegui", reason="the extra guideload[app] is not installed")

from nicegui import Client, ui

import guideload
from guideload.app.document import typed
from guideload.app.files import Folder
from guideload.app.form import Form
from guideload.app.state import Session
from guideload.base.units import quantity


def units(node: Any) -> set[str]:
    """All units of a schema."""
    children = node.values() if isinstance(node, dict) else node if isinstance(node, list) else ()
    own = {node["x-unit"]} if isinstance(node, dict) and "x-unit" in node else set()
    return own.union(*map(units, children))


UNITS = sorted(units([guideload.file_schema(kind) for kind in ("machine", "motion")]))


@given(st.sampled_from(UNITS), st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_means_the_same_with_the_unit_that_it_gets(unit: str, number: float) -> None:
    with_unit = typed(repr(number), {"x-unit": unit})
    assert quantity(with_unit, unit) == number
    assert unit == "1" or with_unit.endswith(f" {unit}")


@pytest.mark.parametrize(
    ("part", "path", "written", "shown"),
    [
        ("moves", ("moves", 0, "distance"), "700", "700 m"),
        ("moves", ("moves", 0, "distance"), "700 mm", "700 mm"),
        ("moves", ("repeat",), "3", "3"),
        ("machine", ("body", "mass"), "900", "900 kg"),
        ("machine", ("body", "center_of_mass"), '[0, "550 mm", 0.1]', '["0 m", "550 mm", "0.1 m"]'),
        ("machine", ("body", "center_of_mass"), "[0, 1, 2, 3]", '["0 m", "1 m", "2 m", 3]'),  # none is lost
        ("machine", ("carriages", 0, "stiffness_y"), "4e8", "400000000.0 N/m"),
        ("machine", ("carriages", 0, "name"), "7", "7"),
    ],
)
def test_a_field_shows_the_unit_in_which_a_number_is_read(
    tmp_path: Path, part: str, path: tuple[str | int, ...], written: str, shown: str
) -> None:
    session = Session(Folder(tmp_path))
    with Client(ui.page("/")):
        form = Form(session, part, ("moves", "") if part == "moves" else ("body", "carriages"))
        session.listeners.append(form.show)
        field = form.fields[path]
        (change,) = [one.handler for one in field._event_listeners.values() if one.type == "change"]
        for _ in range(2):  # the second time the value is there already
            field.value = written
            change()
            assert field.value == shown


def test_what_is_being_typed_stays_when_an_answer_comes_and_undo_reaches_every_field(tmp_path: Path) -> None:
    session = Session(Folder(tmp_path))
    mass, place = ("body", "mass"), ("carriages", 0, "x")
    with Client(ui.page("/")):
        form = Form(session, "machine", ("body", "carriages"))
        session.listeners.append(form.show)
        before = {path: field.value for path, field in form.fields.items()}
        session.set("machine", {mass: "900 kg"})
        form.fields[place].value = "-3"
        form.show()  # as with every answer
        session.set("machine", {mass: "950 kg"})
        assert (form.fields[mass].value, form.fields[place].value) == ("950 kg", "-3")
        session.set("machine", {place: "-330 mm"})
        assert form.fields[place].value == "-330 mm"
        for _ in range(3):
            session.undo()
        assert {path: field.value for path, field in form.fields.items()} == before
