"""The form without a browser: what is typed into a field, and what the field then shows."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("nicegui", reason="the extra guideload[app] is not installed")

from nicegui import Client, ui

import guideload
from guideload.app import document
from guideload.app.document import shown, typed, value_at, with_values
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


@pytest.fixture
def session(tmp_path: Path) -> Session:
    return Session(Folder(tmp_path))


def form_of(session: Session, *sections: str) -> Form:
    form = Form(session, "machine", sections)
    session.listeners.append(form.show)
    return form


@pytest.mark.parametrize("wrong", ["l", "", 3, ["a"]])
@pytest.mark.parametrize(
    ("path", "right"),
    [
        (("body", "inertia_about"), "L"),
        (("life", "rule"), "thk"),
        (("carriages", 0, "damping_in_contact"), True),
    ],
)
def test_a_wrong_choice_stays_in_the_file_until_another_one_is_made(
    session: Session, path: document.Path, right: object, wrong: object
) -> None:
    text = with_values(session.state.machine, {path: wrong})
    with Client(ui.page("/")):
        forms = [
            form_of(session, "body", "life", "carriages")
        ]  # open while the file changes, and opened on it
        session.change(replace(session.state, machine=text))
        forms.append(form_of(session, "body", "life", "carriages"))
        for form in forms:
            form.show()
            assert session.state.machine == text
            assert (form.fields[path].value or "") == shown(wrong)
        forms[0].fields[path].value = shown(right)
        assert value_at(session.state.machine, path) == right
        assert forms[1].fields[path].value == shown(right)


@pytest.mark.parametrize("name", ['left 6" car', "C:\\x1", 'x" href="https://example.org" disable "', "a\\"])
def test_a_name_is_no_more_than_the_label_of_its_button(session: Session, name: str) -> None:
    def buttons() -> list[dict[str, Any]]:
        with Client(ui.page("/")) as client:
            form_of(session, "carriages")
        return [dict(one.props) for one in client.elements.values() if isinstance(one, ui.button)]

    before = buttons()
    old = value_at(session.state.machine, ("carriages", 0, "name"))
    session.set("machine", {("carriages", 0, "name"): name})
    for one in before:
        if one.get("aria-label") == f"Remove carriages {old}":
            one["aria-label"] = f"Remove carriages {name}"
    assert buttons() == before


@pytest.mark.parametrize(
    "wrong", ["carriage_types = 3\n", "carriage_types.A = 3\n", "carriage_types = [{name = 'A'}]\n"]
)
def test_what_is_no_carriage_type_leaves_the_rest_of_the_form(session: Session, wrong: str) -> None:
    with Client(ui.page("/")):
        before = form_of(session, "body", "carriage_types", "carriages")
        session.change(replace(session.state, machine=wrong + session.state.machine))
        after = form_of(session, "body", "carriage_types", "carriages")
    assert {path: one.value for path, one in after.fields.items()} == {
        path: one.value for path, one in before.fields.items()
    }


def test_a_carriage_that_is_added_is_the_last_one_as_it_is_now(session: Session) -> None:
    with Client(ui.page("/")):
        form = form_of(session, "carriages")
        session.set("machine", {("carriages", 3, "x"): "777 mm"})
        form._add("carriages")
    *_, last, added = document.values(session.state.machine)["carriages"]
    assert last["x"] == "777 mm" and added == last | {"name": f"{last['name']} 2"}
