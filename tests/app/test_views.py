"""The views without a browser: the parts of the picture and their steps, the study, and the report."""

import asyncio
from dataclasses import replace
from pathlib import Path

import pytest

pytest.importorskip("nicegui", reason="the extra guideload[app] is not installed")

from app_folder import write_project
from nicegui import Client, ui

import guideload
from guideload.app import document
from guideload.app.answer import Answer
from guideload.app.decide_view import DecideView
from guideload.app.files import Folder
from guideload.app.hub import Hub
from guideload.app.keep_view import KeepView
from guideload.app.machine_view import CENTER, MachineView
from guideload.app.state import Session

PLACE = ("body", "center_of_mass")
RIDER = {
    "name": "slide",
    "mass": "400 kg",
    "center_of_mass": ["0 mm", "500 mm", "500 mm"],
    "inertia": [[9, 0, 0], [0, 9, 0], [0, 0, 9]],
    "direction": [0, 0, 1],
}


@pytest.fixture
def hub(tmp_path: Path) -> Hub:
    return Hub(Session(Folder(write_project(tmp_path))))


def answered(hub: Hub) -> Answer:
    answer = hub.solver.answer(hub.session.state, lambda name: None)
    assert isinstance(answer, Answer)
    hub.answer = hub.last_valid = answer
    return answer


def test_the_centre_of_mass_stays_where_it_is_dropped(hub: Hub) -> None:
    """Of the body: its riders have centres of their own."""
    hub.session.add("machine", "riders", RIDER)
    answered(hub)
    with Client(ui.page("/")):
        view = MachineView(hub)
        view.show_answer()
        ball = view.scene.center
        dropped = ball.x + 0.01, ball.y, ball.z - 0.02
        view._dragged(CENTER, dropped, ended=True)
        body = answered(hub).machine.body.center_of_mass
        view.show_answer()
    assert (ball.x, ball.y, ball.z) == body == pytest.approx(dropped, abs=0.5e-3)


def test_a_step_moves_a_part_along_its_axis_alone(hub: Hub) -> None:
    hub.session.set("machine", {PLACE: ["12.4 mm", "350.55 mm", "1.5 in"], ("carriages", 1, "x"): "0.3456 m"})
    answer = answered(hub)
    with Client(ui.page("/")):
        view = MachineView(hub)
        view.show_answer()
        view.step.value = 1e-3
        view._stepped(0, 1)
        view._stepped(1, -1)
        view.part.value = answer.machine.carriages[1].name
        view._stepped(0, 1)
    text = hub.session.state.machine
    assert document.value_at(text, PLACE) == ["13.4 mm", "349.55 mm", "1.5 in"]
    assert document.value_at(text, ("carriages", 1, "x")) == "346.6 mm"


@pytest.mark.parametrize("catalogue", ["own.toml", "../own.toml"])
def test_a_step_reads_the_machine_as_its_run_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, catalogue: str
) -> None:
    root = tmp_path / "inside"
    (root / "axis").mkdir(parents=True)
    write_project(root / "axis")
    for folder in (root, root / "axis"):
        (folder / "own.toml").write_text(guideload.file_template("catalogue"))
    hub = Hub(Session(Folder(root), "axis/machine.toml", "axis/moves.toml"))
    shown: list[str] = []
    monkeypatch.setattr(ui, "notify", lambda words, **_: shown.append(words))
    with Client(ui.page("/")):
        view = MachineView(hub)
        hub.session.change(
            replace(hub.session.state, machine=f'catalogue = "{catalogue}"\n' + hub.session.state.machine)
        )
        before = hub.session.state
        view._stepped(0, 1)
        assert hub.session.state != before and not shown
        hub.session.set("machine", {("catalogue",): "../../own.toml"})
        before = hub.session.state
        view._stepped(0, 1)
    assert hub.session.state == before and "expected a file below" in shown[0]


@pytest.mark.parametrize(
    ("limit", "machines", "place"),
    [("1.2.3", 16, "limits.peak_resultant"), ("", None, "samples")],
)
def test_what_no_study_can_be_made_of_is_refused_with_its_field(
    hub: Hub, limit: str, machines: int | None, place: str
) -> None:
    answer = answered(hub)
    with Client(ui.page("/")):
        view = DecideView(hub)
        view.least.value, view.samples.value = limit, machines
        with pytest.raises(guideload.GuideloadError, match=place):
            asyncio.run(view._study(answer))


def test_the_command_of_a_report_names_its_file(hub: Hub, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guideload.html_report, "save", lambda result, path: path.write_text("a report"))
    answer = answered(hub)

    async def written() -> str:
        with Client(ui.page("/")):
            view = KeepView(hub)
            view.name.value = "my axis.html"
            await view._write(answer)
            return view.done.text

    command = "guideload run machine.toml moves.toml --report 'my axis.html'"
    assert asyncio.run(written()) == f"Wrote my axis.html, the report of `{command}`."
