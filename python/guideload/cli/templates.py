"""The files that `guideload init` writes, as text."""

from __future__ import annotations

from guideload.base.arguments import checked
from guideload.base.errors import ArgumentError
from guideload.base.number_text import joined
from guideload.cli.inputs import EXAMPLES, MACHINE_KINDS

FILES = {  # packaged, by kind
    "two-rails": "machine.toml",
    **{kind: f"kinds/{kind}.toml" for kind in MACHINE_KINDS},
    "manipulator": "manipulator.toml",
    "trace": "manipulator.csv",
    "moves": "moves.toml",
    "study": "study.toml",
    "catalogue": "catalogue.toml",
}


@checked
def file_template(kind: str) -> str:
    """The text of a file to start from.

    Parameters
    ----------
    kind
        A kind of machine: "two-rails", whose file explains every key, "one-rail", "gantry", "vertical"; the packaged
        example, "manipulator", and its measured "trace"; or another file: "moves", "study", "catalogue".

    Returns
    -------
    str
        As `guideload init` writes it.

    Raises
    ------
    ArgumentError
        For another kind.
    """
    if kind not in FILES:
        raise ArgumentError(f"kind: expected one of {joined(FILES)}, got {kind!r}")
    return (EXAMPLES / FILES[kind]).read_text(encoding="utf-8")
