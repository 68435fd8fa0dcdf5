"""What the page is about: the texts of machine and moves, the trace; with undo, saving and recovery."""

from __future__ import annotations

import json
import shlex
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import guideload
from guideload.app import document
from guideload.app.files import Folder

KEPT = ".guideload-app.json"  # in the folder: the last state, from which a page that died goes on
FORMAT = 1
MOST_STEPS = 200  # of undo


@dataclass(frozen=True)
class State:
    """All that undo goes through."""

    machine: str  # text of the machine file
    moves: str  # text of the motion file
    trace: str = ""  # name of the measured trace; empty if the moves are run


class Session:
    """The state of one page, or of several tabs of it, and the files behind it.

    folder        where the files are
    machine_name  name of the machine file, moves_name of the motion file
    state         now; saved: as in the files
    offered       a state that an earlier server left unsaved, and the time of it; None if there is none
    notice        what the user should know of files that changed; empty if nothing
    """

    def __init__(
        self, folder: Folder, machine_name: str = "machine.toml", motion_name: str = "moves.toml"
    ) -> None:
        """motion_name: of a motion file (.toml), or of a trace, beside which the moves are those of moves.toml."""
        planned = motion_name.endswith(".toml")
        moves_name = motion_name if planned else "moves.toml"
        self.folder, self.machine_name, self.moves_name = folder, machine_name, moves_name
        self.listeners: list[Callable[[], None]] = []
        self.past: list[State] = []
        self.future: list[State] = []
        self.open_step = ""  # name of the undo step to which further changes belong; "" if none is open
        self.notice = ""
        texts = {name: folder.text(name) for name in (machine_name, moves_name)}
        self.saved = State(texts[machine_name] or "", texts[moves_name] or "")
        self.state = State(
            self.saved.machine or guideload.file_template("two-rails"),
            self.saved.moves or guideload.file_template("moves"),
            "" if planned else motion_name,
        )
        self.offered = self._left_behind()

    # ---- changes

    def change(self, state: State, merge: str = "") -> None:
        """Make `state` the present one. Changes in a row with the same `merge`, as of a drag, are one step of undo."""
        if state == self.state:
            return
        if not (merge and merge == self.open_step):
            self.past = [*self.past[-MOST_STEPS:], self.state]
        self.future, self.open_step, self.state = [], merge, state
        self._tell(keep=not merge)

    def set(self, part: str, changes: dict[document.Path, Any], merge: str = "") -> None:
        """Change values of "machine" or "moves" by their paths; None removes a key. Raises GuideloadError."""
        text = document.with_values(getattr(self.state, part), changes)
        self.change(self._with(part, text), merge)

    def add(self, part: str, key: str, entry: dict[str, Any]) -> None:
        """Add a table [[key]]."""
        self.change(self._with(part, document.with_entry(getattr(self.state, part), key, entry)))

    def drop(self, part: str, key: str, index: int) -> None:
        """Remove a table [[key]]."""
        self.change(self._with(part, document.without_entry(getattr(self.state, part), key, index)))

    def start(self, kind: str) -> None:
        """Begin with the file of a kind of machine; the packaged example comes with its measured motion."""
        trace = self.state.trace
        if kind == "manipulator":
            trace = self.add_trace("manipulator.csv", guideload.file_template("trace").encode())
        self.change(replace(self.state, machine=guideload.file_template(kind), trace=trace))

    def add_trace(self, name: str, content: bytes) -> str:
        """Write a trace into the folder, under a new name if another file has this one; returns the name."""
        path = self.folder.path(name.replace("\\", "/").rpartition("/")[2])
        stem, number = path.stem, 1
        while path.exists() and path.read_bytes() != content:
            number += 1
            path = path.with_stem(f"{stem}-{number}")
        if not path.exists():
            self.folder.write_bytes(str(path), content)
        return self.folder.name(path)

    def _with(self, part: str, text: str) -> State:
        return replace(self.state, trace="" if part == "moves" else self.state.trace, **{part: text})

    def undo(self) -> None:
        """Go one step back, if there is one."""
        if self.past:
            self.future.append(self.state)
            self.state, self.open_step = self.past.pop(), ""
            self._tell()

    def redo(self) -> None:
        """Take back the last undo, if nothing changed since."""
        if self.future:
            self.past.append(self.state)
            self.state, self.open_step = self.future.pop(), ""
            self._tell()

    def keep_after_drag(self) -> None:
        """Keep the state at the end of a drag; a drag is not kept at each of its steps."""
        if self.open_step:
            self.keep()

    def _tell(self, keep: bool = True) -> None:
        if keep:
            self.keep()
        for listener in list(self.listeners):
            listener()

    # ---- files

    @property
    def motion_name(self) -> str:
        """Name of the file with the motion."""
        return self.state.trace or self.moves_name

    @property
    def unsaved(self) -> list[str]:
        """Names of the files that differ from the page."""
        names = [self.machine_name] if self.state.machine != self.saved.machine else []
        if not self.state.trace and self.state.moves != self.saved.moves:
            names.append(self.moves_name)
        return names

    def command(self, verb: str = "run", options: str = "--report report.html") -> str:
        """The command that repeats what the page shows, in its folder."""
        names = shlex.join([self.machine_name, self.motion_name])
        return f"guideload {verb} {names} {options}".rstrip()

    def save(self) -> list[str]:
        """Write machine and moves; returns the names of the files written."""
        names = self.unsaved
        texts = {self.machine_name: self.state.machine, self.moves_name: self.state.moves}
        for name in names:
            self.folder.write(name, texts[name])
        moves = self.state.moves if self.moves_name in names else self.saved.moves
        self.saved = State(self.state.machine, moves)
        self.notice = ""
        self._tell()
        return names

    def look(self) -> None:
        """Take over what another program wrote into the files; if the page has changes of its own, say so."""
        found = State(self.folder.text(self.machine_name) or "", self.folder.text(self.moves_name) or "")
        if found == self.saved:
            return
        parts = {self.machine_name: "machine", self.moves_name: "moves"}
        both = [n for n in self.unsaved if getattr(found, parts[n]) != getattr(self.saved, parts[n])]
        self.saved = found
        if both:
            self.notice = (
                f"{', '.join(both)} was changed by another program, and here: Save replaces the file, "
                "Reload takes it over (Undo brings your changes back)"
            )
            self._tell()
        else:
            self.notice = ""
            self.reload()

    def reload(self) -> None:
        """Take over the files as they are; one step of undo."""
        machine, moves = self.saved.machine or self.state.machine, self.saved.moves or self.state.moves
        self.notice = ""
        before = self.state
        self.change(replace(self.state, machine=machine, moves=moves))
        if self.state == before:
            self._tell()

    # ---- recovery

    def keep(self) -> None:
        """Write the state into the folder, whole or not at all, for the next start if this server dies."""
        kept = {
            "format": FORMAT,
            "machine_file": self.machine_name,
            "time": time.time(),
            **asdict(self.state),
        }
        self.folder.write(KEPT, json.dumps(kept))

    def _left_behind(self) -> tuple[State, float] | None:
        """The state that an earlier server kept, if the files do not have it."""
        try:
            kept = json.loads(self.folder.text(KEPT) or "")
            state = State(*(str(kept[name]) for name in ("machine", "moves", "trace")))
            known = kept["format"] == FORMAT and kept["machine_file"] == self.machine_name
            when = float(kept["time"])
        except (ValueError, KeyError, TypeError, guideload.GuideloadError):
            return None
        return (state, when) if known and state != self.state else None

    def take_offered(self, taken: bool) -> None:
        """Go on with the state that was offered, or leave it; either way it is offered no more."""
        offered, self.offered = self.offered, None
        if taken and offered is not None:
            self.change(offered[0])
        else:
            self._tell()
