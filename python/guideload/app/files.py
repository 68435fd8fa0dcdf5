"""The files that the page may read and write: those below the folder in which it was started."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import guideload

OUTSIDE = "expected a file below {folder}, got {name!r}; start guideload app in a folder that holds both"


class OutsideFolder(guideload.GuideloadError):
    """A name leads out of the folder in which the page was started."""


class Folder:
    """The folder in which the page was started; names of files are relative to it."""

    def __init__(self, root: Path) -> None:
        self.root = root.resolve()

    def path(self, name: str) -> Path:
        """The path of a name. Raises OutsideFolder, also for a link that leads out."""
        found = (self.root / name).resolve()
        if not found.is_relative_to(self.root) or found == self.root:
            raise OutsideFolder(OUTSIDE.format(folder=self.root, name=name))
        return found

    def name(self, path: Path) -> str:
        """The name of a path below the folder. Raises OutsideFolder."""
        return self.path(str(path.resolve())).relative_to(self.root).as_posix()

    def text(self, name: str) -> str | None:
        """The text of a file; None if there is none. Raises OutsideFolder, GuideloadError if it is no text."""
        path = self.path(name)
        try:
            return path.read_bytes().decode("utf-8-sig")
        except FileNotFoundError:
            return None
        except (OSError, UnicodeDecodeError) as error:
            raise guideload.GuideloadError(f"{name}: expected a readable file in UTF-8 ({error})") from None

    def write(self, name: str, text: str) -> None:
        """Write a text, whole or not at all. Raises OutsideFolder, OSError."""
        self.write_bytes(name, text.encode())

    def write_bytes(self, name: str, content: bytes) -> None:
        """As `write`."""
        path = self.path(name)
        draft = path.with_name(f".{path.name}.page")
        try:
            draft.write_bytes(content)
            draft.replace(path)
        finally:  # of a full disk nothing stays
            draft.unlink(missing_ok=True)

    def named(self, values: dict[str, Any], file: Path) -> list[Path]:
        """The files that the values of a machine file name. Raises OutsideFolder."""
        rails = values.get("rails", [])
        tables = rails if isinstance(rails, list) else []
        names = [one.get("straightness_file") for one in tables if isinstance(one, dict)]
        named = (values.get("catalogue"), *names)
        return [self.path(str(file.parent / name)) for name in named if isinstance(name, str)]
