"""What the page is about: the texts of machine and moves, the trace; with undo, saving and recovery."""

from __future__ import annotations

import json
import shlex
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import guideload
from guideload.app import document
from guideload.app.files import Folder

KEPT = ".guideload-app.json"  # in the folder: the last state, from which a page that died goes on
FORMAT = 2
MOST_STEPS = 200  # of undo


@dataclass(frozen=True)
class State:
    """All that undo goes through."""

    machine: str  # text of the machine file
    moves: str  # text of the motion file
    trace: str = ""  # name of the measured trace; empty if the moves are run


@dataclass(frozen=True)
class Offer:
    """What an earlier server left unsaved."""

    changes: dict[str, str]  # of parts of the state
    on_disk: dict[str, str]  # texts of the files from which these parts were changed, by part
    time: float  # s since 1970


class Session:
    """The state of one page, or of several tabs of it, and the files behind it.

    A file that only another program changes is taken over, one that only the page changes is written by `save`, and
    for one that both change the user decides.

    folder    where the files are
    names     of the machine file and the motion file, by the part of the state that has their text
    on_disk   their texts when they were last read or written, by part; "" for a file that does not exist
    clashing  parts whose file another program changed while the page had changes of its own
    state     now
    offered   what an earlier server left unsaved; None if there is nothing
    """

    def __init__(
        self, folder: Folder, machine_name: str = "machine.toml", motion_name: str = "moves.toml"
    ) -> None:
        """motion_name: of a motion file (.toml), or of a trace, beside which the moves are those of moves.toml."""
        planned = motion_name.endswith(".toml")
        moves_name = motion_name if planned else "moves.toml"
        self.folder, self.machine_name, self.moves_name = folder, machine_name, moves_name
        self.names = {"machine": machine_name, "moves": moves_name}
        self.listeners: list[Callable[[], None]] = []
        self.past: list[State] = []
        self.future: list[State] = []
        self.open_step = ""  # name of the undo step to which further changes belong; "" if none is open
        self.clashing: set[str] = set()
        self.unreadable = ""  # why the files cannot be read
        self.not_kept = ""  # why the state cannot be kept
        self.on_disk = self._read()
        self.state = State(
            self.on_disk["machine"] or guideload.file_template("two-rails"),
            self.on_disk["moves"] or guideload.file_template("moves"),
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

    def _changed_here(self) -> list[str]:
        """The parts that differ from their files; beside a trace, moves that nobody changed need no file."""
        absent = {"machine": "", "moves": guideload.file_template("moves") if self.state.trace else ""}
        return [
            part for part, text in self.on_disk.items() if getattr(self.state, part) != (text or absent[part])
        ]

    @property
    def unsaved(self) -> list[str]:
        """Names of the files that differ from the page."""
        return [self.names[part] for part in self._changed_here()]

    @property
    def clashes(self) -> list[str]:
        """Names of the files that another program changed, and the page too."""
        return [self.names[part] for part in self._changed_here() if part in self.clashing]

    @property
    def notice(self) -> str:
        """What the user should know of the files; empty if nothing."""
        clashes = [
            f"{name} was changed by another program, and here: Save replaces the file, "
            "Reload takes it over (Undo brings your changes back)."
            for name in self.clashes
        ]
        return " ".join(filter(None, (self.unreadable, self.not_kept, *clashes)))

    def command(self, verb: str = "run", options: str = "--report report.html") -> str:
        """The command that repeats what the page shows, in its folder."""
        names = shlex.join([self.machine_name, self.motion_name])
        return f"guideload {verb} {names} {options}".rstrip()

    def save(self) -> list[str]:
        """Write machine and moves; returns the names of the files written.

        Raises OSError, and GuideloadError if the files cannot be read, or if another program has changed one that would
        be replaced: then the notice says so, and a second `save` replaces it.
        """
        if self.look() or self.unreadable:
            raise guideload.GuideloadError(self.notice)
        written = self._changed_here()
        try:
            for part in written:
                self.folder.write(self.names[part], getattr(self.state, part))
                self.on_disk[part] = getattr(self.state, part)
                self.clashing.discard(part)
        finally:
            self._tell()
        return [self.names[part] for part in written]

    def look(self) -> list[str]:
        """Take over each file that another program changed and the page did not.

        Returns the names of the files that the page had changed too: they stay as they are, and the notice names them.
        """
        notice = self.notice
        try:
            found, self.unreadable = self._read(), ""
        except guideload.GuideloadError as error:
            found, self.unreadable = self.on_disk, f"{error}."
        here, there = self._changed_here(), [part for part in found if found[part] != self.on_disk[part]]
        # A file that was removed, or has the text of the page now, holds nothing that could be lost.
        both = [part for part in there if part in here and found[part] not in ("", getattr(self.state, part))]
        self.on_disk = found
        self.clashing = self.clashing.difference(there).union(both)
        taken = {part: found[part] for part in there if found[part] and part not in both}
        if (state := replace(self.state, **taken)) != self.state:
            self.change(state)
        elif there or self.notice != notice:
            self._tell()
        return [self.names[part] for part in both]

    def reload(self) -> None:
        """Take over the files that another program and the page changed; one step of undo."""
        texts = {part: self.on_disk[part] for part in self.clashing}
        self.clashing = set()
        self.change(replace(self.state, **texts))

    def _read(self) -> dict[str, str]:
        """The texts of the files, by part. Raises GuideloadError."""
        return {part: self.folder.text(name) or "" for part, name in self.names.items()}

    # ---- recovery

    def keep(self) -> None:
        """Write what is not saved into the folder, whole or not at all, for the next start if this server dies."""
        files = {
            self.names[part]: (self.on_disk[part], getattr(self.state, part)) for part in self._changed_here()
        }
        kept = {
            "format": FORMAT,
            "time": time.time(),
            "moves_file": self.moves_name,
            "trace": self.state.trace,
            "files": files,  # text on the disk, and on the page
        }
        try:
            self.folder.write(KEPT, json.dumps(kept))
            self.not_kept = ""
        except (OSError, guideload.GuideloadError) as error:
            self.not_kept = f"{KEPT} cannot be written ({error}): save before the page ends."

    def _left_behind(self) -> Offer | None:
        """What an earlier server kept of these files, and they do not have."""
        try:
            kept = json.loads(self.folder.text(KEPT) or "")
            files = {part: kept["files"][name] for part, name in self.names.items() if name in kept["files"]}
            on_disk = {part: str(text) for part, (text, _) in files.items()}
            changes = {
                part: str(text) for part, (_, text) in files.items() if text != getattr(self.state, part)
            }
            if changes and kept["moves_file"] == self.moves_name and not self.state.trace:
                changes["trace"] = str(kept["trace"])
            known, when = kept["format"] == FORMAT, float(kept["time"])
        except (ValueError, KeyError, TypeError, guideload.GuideloadError):
            return None
        return Offer(changes, on_disk, when) if known and changes else None

    def take_offered(self, taken: bool) -> None:
        """Make the changes that were offered, or leave them; either way they are offered no more."""
        offered, self.offered = self.offered, None
        if taken and offered is not None:
            self.on_disk |= offered.on_disk
            self.change(replace(self.state, **offered.changes))
            self.look()  # finds what another program changed since
        else:
            self._tell()
