"""What to do next in a folder: `guideload` without a command."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from pathlib import Path

from guideload.base.errors import ConfigError, GuideloadError
from guideload.base.number_text import first_names
from guideload.cli.inputs import RECORDS

MOST_FILES = 200  # of a folder that are looked at


def next_steps(folder: Path) -> list[str]:
    """Lines that say what a folder holds, and the commands that come next."""
    from guideload.base.file_model import KINDS

    found: dict[str, list[str]] = {}
    for file in sorted(folder.iterdir())[:MOST_FILES]:
        if kind := _kind(file):
            found.setdefault(kind, []).append(shlex.quote(file.name))
    held = ", ".join(
        f"{first_names(names)} ({kind})"
        for kind in (*KINDS.values(), "record", "unreadable")
        if (names := found.get(kind))
    )
    lines = [f"Here: {held}." if held else "Here is neither a machine file nor a record.", ""]
    for text, command in _steps(folder, found):
        lines += [text, f"  guideload {command}"]
    return [*lines, "", "All commands: guideload --help"]


def _kind(file: Path) -> str | None:
    """The kind of a file, None for one of another program."""
    from guideload.base.file_model import kind_of_file
    from guideload.base.toml import read_toml

    if file.suffix.lower() in RECORDS:
        return "record"
    if file.suffix.lower() != ".toml" or not file.is_file():
        return None
    try:
        return kind_of_file(read_toml(file)[0])
    except ConfigError:
        return "unreadable"


def _steps(folder: Path, found: dict[str, list[str]]) -> Iterator[tuple[str, str]]:
    """What to do, and the command that does it."""
    for name in found.get("unreadable", ()):
        yield f"{name} is no valid TOML; this says where:", f"check {name}"
    if "machine" not in found:
        yield "Describe a machine:", "init --kind vertical   (or gantry, one-rail, two-rails)"
        yield "See an example:", "demo"
        return
    from guideload.machine.machine import Machine

    name = found["machine"][0]
    try:
        machine = Machine.from_toml(folder / shlex.split(name)[0])
        _ = machine.scene
    except GuideloadError:
        yield "Mend the machine; this lists what is wrong:", f"check {name}"
        return
    yield "Look at the machine:", f"check {name}"
    motion = next((names[0] for kind in ("motion", "record") if (names := found.get(kind))), None)
    if motion is None:
        yield "Give a motion: put a record (CSV, Parquet) here, or plan moves:", "init --moves"
        return
    if "motion" not in found:
        yield "See what the record is worth:", f"encoder {motion}"
    yield "Loads, drive and a report:", f"run {name} {motion} -o out --report report.html"
    if not any(machine.product_of_carriage):
        yield (
            "No life yet: name the product of each carriage in the machine file, as in\n"
            'product = "HGH25CA" with its preload_class. The smallest that lasts:',
            f'size {name} {motion} --life "20000 h" --product HIWIN',
        )
        yield "All packaged products:", "catalogue list"
        return
    target = "" if machine.life.life is not None else ' --life "20000 h"'
    yield "Life and its causes:", f"life {name} {motion}{target}"
    yield "How fast it may go:", f"limit {name} {motion}{target}"
