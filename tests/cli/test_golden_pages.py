"""Help texts and error messages are those of the golden files, which `python tests/golden.py --write` writes."""

import pytest
from golden_pages import FOLDER, pages

PAGES = pages()


@pytest.mark.parametrize("name", PAGES)
def test_a_page_is_its_golden_file(name: str) -> None:
    """A wrong call also ends with exit code 2, prints nothing on standard output, and leaves all files as they were."""
    assert PAGES[name]() == (FOLDER / f"{name}.txt").read_text(encoding="utf-8")


def test_every_golden_file_is_of_a_page() -> None:
    files = {path.relative_to(FOLDER).with_suffix("").as_posix() for path in FOLDER.rglob("*.txt")}
    assert {name for name in files if name.startswith(("help/", "errors/"))} == PAGES.keys()
