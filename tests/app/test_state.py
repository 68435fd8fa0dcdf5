"""The session of the page: undo, files, and what is left after a kill. None of it needs a browser."""

from dataclasses import replace
from pathlib import Path

import pytest

pytest.importorskip("tomlkit", reason="the extra guideload[app] is not installed")

import guideload
from guideload.app import document
from guideload.app.files import Folder, OutsideFolder
from guideload.app.state import KEPT, Session

X = ("carriages", 0, "x")


@pytest.fixture
def session(tmp_path: Path) -> Session:
    (tmp_path / "machine.toml").write_text(guideload.file_template("two-rails"))
    (tmp_path / "moves.toml").write_text(guideload.file_template("moves"))
    return Session(Folder(tmp_path))


def again(session: Session) -> Session:
    """The session of a server that starts in the same folder."""
    return Session(Folder(session.folder.root))


def test_a_change_leaves_every_other_character_of_the_file(session: Session) -> None:
    before = session.state.machine.splitlines()
    session.set("machine", {X: "-310 mm"})
    after = session.state.machine.splitlines()
    changed = [(a, b) for a, b in zip(before, after, strict=True) if a != b]
    assert len(changed) == 1 and changed[0][1].startswith('x = "-310 mm"')
    assert changed[0][0].partition("#")[2] == changed[0][1].partition("#")[2]


@pytest.mark.parametrize("kind", ["two-rails", "one-rail", "gantry", "vertical", "manipulator"])
def test_a_table_that_is_added_and_dropped_leaves_the_values_as_they_were(kind: str) -> None:
    text = guideload.file_template(kind)
    entry = document.value_at(text, ("carriages", 0)) | {"name": "one more"}
    longer = document.with_entry(text, "carriages", entry)
    count = len(document.values(text)["carriages"])
    assert document.value_at(longer, ("carriages", count)) == entry
    assert document.values(document.without_entry(longer, "carriages", count)) == document.values(text)


def test_comments_in_a_list_stay_where_its_values_change() -> None:
    text = "[body]\ninertia = [\n  [1, 0, 0], # Ixx\n  [0, 2, 0], # Iyy\n  [0, 0, 3], # Izz\n]\n"
    changed = document.with_values(text, {("body", "inertia"): [[1, 0, 0], [0, 5, 0], [0, 0, 3]]})
    assert changed == text.replace("2", "5")


@pytest.mark.parametrize("value", ["600 mm", 12.5, 3, True, ["1 mm", 0.0], [[1.0, 0], [0, 2.5]], ["y", "z"]])
def test_what_a_field_shows_is_read_as_the_same_value(value: object) -> None:
    assert document.typed(document.shown(value), {}) == value


def test_a_name_that_looks_like_a_number_stays_text() -> None:
    assert document.typed("1", {"type": "string"}) == "1" and document.typed("1", {}) == 1
    assert document.typed(" ", {"type": "string"}) is None


def test_undo_and_redo_walk_through_the_same_states(session: Session) -> None:
    states = [session.state]
    for place in ("-310 mm", "-320 mm", "-330 mm"):
        session.set("machine", {X: place})
        states.append(session.state)
    for state in states[-2::-1]:
        session.undo()
        assert session.state == state
    session.undo()
    assert session.state == states[0]
    for state in states[1:]:
        session.redo()
        assert session.state == state
    session.undo()
    session.set("machine", {X: "5 mm"})
    assert not session.future


def test_a_drag_is_one_step_of_undo(session: Session) -> None:
    start = session.state
    for n in range(20):
        session.set("machine", {X: f"{-300 - n} mm"}, merge="drag 1")
    session.keep_after_drag()
    session.set("machine", {X: "-330 mm"}, merge="drag 1")
    session.set("machine", {X: "-400 mm"}, merge="drag 2")
    assert len(session.past) == 2
    session.undo()
    session.undo()
    assert session.state == start


def test_save_writes_what_the_page_has_and_only_that(session: Session) -> None:
    root = session.folder.root
    moves = (root / "moves.toml").stat().st_mtime_ns
    session.set("machine", {X: "-310 mm"})
    assert session.unsaved == ["machine.toml"] and session.save() == ["machine.toml"]
    assert (root / "machine.toml").read_text() == session.state.machine and not session.unsaved
    assert (root / "moves.toml").stat().st_mtime_ns == moves and session.save() == []
    assert guideload.Machine.from_toml(root / "machine.toml").carriages[0].x == -0.31


def test_a_file_that_another_program_changed_is_taken_over_and_can_be_undone(session: Session) -> None:
    before = session.state
    text = before.machine.replace('"1250 kg"', '"900 kg"').replace('mass = "', 'mass = "1')
    (session.folder.root / "machine.toml").write_text(text)
    session.look()
    assert session.state.machine == text and not session.unsaved and not session.notice
    session.undo()
    assert session.state == before and session.unsaved == ["machine.toml"]


def test_a_file_that_changed_there_and_here_is_not_taken_over_unasked(session: Session) -> None:
    session.set("machine", {X: "-310 mm"})
    own = session.state
    (session.folder.root / "machine.toml").write_text(guideload.file_template("gantry"))
    session.look()
    assert session.state == own and "machine.toml was changed by another program" in session.notice
    session.reload()
    assert session.state.machine == guideload.file_template("gantry") and not session.notice
    session.undo()
    assert session.state == own


OTHER = "\n# another program\n"


@pytest.mark.parametrize("here", [(), ("machine",), ("moves",), ("machine", "moves")])
@pytest.mark.parametrize("there", [(), ("machine",), ("moves",), ("machine", "moves")])
def test_each_file_has_the_newest_text_and_no_change_is_lost_unasked(
    session: Session, here: tuple[str, ...], there: tuple[str, ...]
) -> None:
    files = {part: session.folder.root / f"{part}.toml" for part in ("machine", "moves")}
    for part in here:
        session.set(part, {("name",): "mine"})
    page = session.state
    for part in there:
        files[part].write_text(files[part].read_text() + OTHER)
    both = [f"{part}.toml" for part in here if part in there]
    assert session.look() == both == session.clashes
    assert all(name in session.notice for name in both) and bool(session.notice) == bool(both)
    for part in files:
        text = getattr(session.state, part)
        assert text == getattr(page, part) if part in here else text.endswith(OTHER) == (part in there)
    assert session.unsaved == [f"{part}.toml" for part in here]
    assert session.save() == [f"{part}.toml" for part in here] and not session.notice
    assert [file.read_text() for file in files.values()] == [session.state.machine, session.state.moves]


def test_reload_takes_over_the_files_that_clash_alone(session: Session) -> None:
    machine = session.folder.root / "machine.toml"
    session.set("machine", {X: "-310 mm"})
    session.set("moves", {("name",): "mine"})
    moves = session.state.moves
    machine.write_text(machine.read_text() + OTHER)
    session.look()
    session.reload()
    assert session.state.machine == machine.read_text() and session.state.moves == moves


def test_save_replaces_a_file_of_another_program_only_where_the_notice_named_it(session: Session) -> None:
    machine = session.folder.root / "machine.toml"
    session.set("machine", {X: "-310 mm"})
    for words in (OTHER, OTHER + OTHER):  # also where it changes once more after the notice
        machine.write_text(guideload.file_template("gantry") + words)
        with pytest.raises(guideload.GuideloadError, match="machine.toml was changed by another program"):
            session.save()
        assert machine.read_text().endswith(words)
    assert session.save() == ["machine.toml"] and machine.read_text() == session.state.machine


def test_a_save_that_fails_at_the_second_file_has_saved_the_first(session: Session) -> None:
    session.set("machine", {X: "-310 mm"})
    session.set("moves", {("name",): "mine"})
    (session.folder.root / ".moves.toml.page").mkdir()  # the draft cannot be written
    with pytest.raises(OSError):
        session.save()
    assert session.unsaved == ["moves.toml"]
    assert session.look() == [] and not session.notice


def test_a_file_that_cannot_be_read_is_named_until_it_can(session: Session) -> None:
    machine = session.folder.root / "machine.toml"
    text = machine.read_text()
    machine.write_bytes(b"\xe9")
    session.look()
    assert "machine.toml: expected a readable file" in session.notice
    session.set("machine", {X: "-310 mm"})
    with pytest.raises(guideload.GuideloadError, match="expected a readable file"):
        session.save()
    machine.write_text(text)
    session.look()
    assert not session.notice and session.save() == ["machine.toml"]


def test_a_state_that_cannot_be_kept_is_shown_and_said(session: Session) -> None:
    seen: list[str] = []
    session.listeners.append(lambda: seen.append(session.notice))
    blocked = session.folder.root / f".{KEPT}.page"
    blocked.mkdir()
    session.set("machine", {X: "-310 mm"})
    assert len(seen) == 1 and f"{KEPT} cannot be written" in seen[0]
    blocked.rmdir()
    session.set("machine", {X: "-320 mm"})
    assert seen[1:] == [""]


def test_moves_are_saved_beside_a_trace_if_they_were_changed(session: Session, tmp_path: Path) -> None:
    session.set("moves", {("repeat",): 7})
    session.change(replace(session.state, trace="measured.csv"))
    assert session.save() == ["moves.toml"]
    (tmp_path / "bare").mkdir()
    assert Session(Folder(tmp_path / "bare"), motion_name="measured.csv").unsaved == ["machine.toml"]


def test_what_was_saved_is_not_offered_again(session: Session) -> None:
    session.set("machine", {X: "-310 mm"})
    session.save()
    (session.folder.root / "machine.toml").write_text(guideload.file_template("gantry"))
    assert again(session).offered is None


def test_changes_are_offered_for_the_file_of_which_they_are(session: Session) -> None:
    session.set("machine", {X: "-310 mm"})
    session.set("moves", {("repeat",): 7})
    (session.folder.root / "machine.toml").write_text(session.on_disk["machine"] + OTHER)
    other = Session(session.folder, "machine.toml", "other.toml")
    before = other.state
    other.take_offered(True)
    assert other.state == replace(before, machine=session.state.machine)
    assert other.clashes == ["machine.toml"]  # which another program changed meanwhile


def test_the_state_of_a_server_that_died_is_offered_at_the_next_start(session: Session) -> None:
    session.set("machine", {X: "-310 mm"})
    second = again(session)
    assert second.state != session.state and second.offered is not None
    assert second.offered.changes == {"machine": session.state.machine, "trace": ""}
    second.take_offered(True)
    assert second.state == session.state and second.offered is None
    second.save()
    assert again(second).offered is None


@pytest.mark.parametrize("damaged", ["", "{", "[]", '{"format": 99}', '{"format": 1, "machine_file": 3}'])
def test_a_damaged_state_is_left_aside(session: Session, damaged: str) -> None:
    (session.folder.root / KEPT).write_text(damaged)
    assert again(session).offered is None


def test_no_name_leads_out_of_the_folder(tmp_path: Path) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    (tmp_path / "secret.toml").write_text("x = 1")
    (inside / "link.toml").symlink_to(tmp_path / "secret.toml")
    folder = Folder(inside)
    for name in ("../secret.toml", str(tmp_path / "secret.toml"), "link.toml", ".", "a/../../secret.toml"):
        with pytest.raises(OutsideFolder, match="expected a file below"):
            folder.path(name)
        with pytest.raises(OutsideFolder):
            folder.write(name, "")
    for values in ({"catalogue": "../secret.toml"}, {"rails": [{"straightness_file": "../secret.csv"}]}):
        with pytest.raises(OutsideFolder):
            folder.named(values, inside / "machine.toml")
    named = folder.named({"catalogue": "own.toml", "rails": 3}, inside / "machine.toml")
    assert named == [inside / "own.toml"]


def test_the_command_repeats_what_the_page_shows(session: Session) -> None:
    assert session.command() == "guideload run machine.toml moves.toml --report report.html"


def test_a_file_that_cannot_be_written_leaves_no_draft(session: Session) -> None:
    folder = session.folder
    (folder.root / "taken.toml").mkdir()
    with pytest.raises(OSError):
        folder.write("taken.toml", "name = 'x'")
    assert not list(folder.root.glob(".taken*"))
