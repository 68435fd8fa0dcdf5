"""Models that one TOML file describes."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import PrivateAttr

from guideload.base.arguments import checked
from guideload.base.config import ConfigModel
from guideload.base.errors import ConfigError, KeyPath, refused_at
from guideload.base.toml import TomlPlace, located, parse_toml, read_toml

if TYPE_CHECKING:
    from typing_extensions import Self

# Kinds of files by a key that each must have. A machine may have products, but a catalogue no body.
KINDS = {
    "body": "machine",
    "moves": "motion",
    "products": "catalogue",
    "vary": "study",
    "cases": "duty",
    "unknown": "identify",
}


class FileModel(ConfigModel):
    """Base of models that are read from a file, or from its text before it is saved.

    FILE: usual name of the file. WRITTEN_BY: where such a file comes from, for the message if there is none.
    REQUIRED: a key that each such file has, and what is expected of it, for the message if the file is of another kind.
    """

    FILE: ClassVar[str]
    WRITTEN_BY: ClassVar[str]
    REQUIRED: ClassVar[tuple[str, str]]
    _folder: Path | None = PrivateAttr(None)  # of the file, to which names of files in it are relative

    @checked
    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        copy = super().model_copy(update=update, deep=deep)
        copy._folder = self._folder
        return copy

    @classmethod
    @checked
    def from_toml(cls, file: str | PathLike[str]) -> Self:
        """What a TOML file describes. Raises ConfigError naming file, row, key and value."""
        return cls._located(*read_toml(file, cls.WRITTEN_BY), file)

    @classmethod
    @checked
    def from_text(cls, text: str, file: str | PathLike[str] | None = None) -> Self:
        """What the text of a file describes, before it is saved.

        Parameters
        ----------
        text
            The content of the file.
        file
            Its name, for messages, by default the usual one; names of files in the text are relative to its folder.

        Returns
        -------
        As `from_toml` reads it from the saved file.

        Raises
        ------
        ConfigError
            Naming file, row, key and value.
        """
        file = cls.FILE if file is None else file
        return cls._located(*parse_toml(text.encode(), file), file)

    @classmethod
    def _located(
        cls, values: dict[str, Any], places: dict[KeyPath, TomlPlace], file: str | PathLike[str]
    ) -> Self:
        try:
            require_key(*cls.REQUIRED, values)
            model = cls._of_file(values, Path(file))
        except ConfigError as error:
            raise located(error, str(file), places) from None
        model._folder = Path(file).parent.absolute()
        return model

    @classmethod
    def _of_file(cls, values: dict[str, Any], file: Path) -> Self:
        """The model of the values of a file. Raises ConfigError."""
        return cls(**values)


def require_key(key: str, expected: str, values: dict[str, Any]) -> None:
    """Raise ConfigError, in one sentence, if the values of a file lack a key and are those of another kind of file."""
    kind = kind_of_file(values)
    if key not in values and kind:
        article = "an" if kind == "identify" else "a"
        raise refused_at((key,), expected, None, f"this is {article} {kind} file")


def kind_of_file(values: dict[str, Any]) -> str | None:
    """The kind of a file with these values, None for one of another program."""
    # The cases of a study are the name of a table.
    return next(
        (kind for key, kind in KINDS.items() if key in values and not isinstance(values[key], str)), None
    )
