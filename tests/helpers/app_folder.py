"""A folder as the page serves it, and products for its machine."""

from pathlib import Path

import guideload

# All four carriages as one product, as values of the machine file.
PRODUCTS = {
    ("carriages", i, key): value
    for i in range(4)
    for key, value in (("product", "HGH35CA"), ("preload_class", "ZA"))
}


def write_project(folder: Path) -> Path:
    """Write the manipulator and moves that take little time."""
    (folder / "machine.toml").write_text(guideload.file_template("manipulator"))
    (folder / "moves.toml").write_text(guideload.file_template("moves").replace("repeat = 2", "repeat = 1"))
    return folder
