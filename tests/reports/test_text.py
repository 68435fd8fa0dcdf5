"""Reports as text: nothing of a table is lost at any width, names stay beside their values, numbers are readable."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from texts import one_line

from guideload.base.errors import NotFinite
from guideload.base.number_text import (
    KINDS,
    NARROW_SPACE,
    beside,
    digits,
    fixed,
    load_in_table,
    load_with_unit,
    percent,
    signed,
)
from guideload.reports.report import Column, Definitions, Report, Section, Table

NAMES = ["left rear", "left front", "right rear"]
WORDS = st.text("abcdefgh", min_size=1, max_size=9)
SENTENCES = st.lists(WORDS, min_size=1, max_size=12).map(" ".join)


def text_of(*parts: Table | str, width: int = 80, encoding: str = "utf-8") -> str:
    return Report("title", sections=[Section("Title", *parts)]).text(width, encoding)


@given(
    numbers=st.lists(
        st.tuples(SENTENCES, st.lists(st.floats(-1e6, 1e6), min_size=3, max_size=3)), max_size=12
    ),
    texts=st.lists(st.lists(SENTENCES, min_size=3, max_size=3), max_size=2),
    width=st.sampled_from((60, 80, 120)),
)
def test_a_wide_table_is_broken_into_blocks_that_repeat_the_names(
    numbers: list[tuple[str, list[float]]], texts: list[list[str]], width: int
) -> None:
    """Every value is in the text, in a row that begins with its name, and no line is longer than the width."""
    columns = [Column(label, values, "N", "load") for label, values in numbers]
    columns += [Column(f"text {i}", each) for i, each in enumerate(texts)]
    lines = text_of(Table(Column("carriage", NAMES), *columns), width=width).splitlines()
    assert max(map(len, lines)) <= width
    for i, name in enumerate(NAMES):
        rows = "  ".join(line.removeprefix(f" {name}") for line in lines if line.startswith(f" {name}"))
        for _, values in numbers:
            assert load_in_table(values[i]) in rows.split("  ") or load_in_table(values[i]) in rows
    words = one_line("\n".join(lines))
    assert all(word in words for each in texts for cell in each for word in cell.split())


def test_what_fits_is_one_table_and_what_is_empty_is_left_out() -> None:
    names = Column("carriage", NAMES)
    assert text_of(Table(names, Column("peak", [1.0, None, 3.0], "N", "load"))).count("left rear") == 1
    empty = text_of(Table(names, Column("noise", [None] * 3, "N", "load")), Table(Column("none", [])))
    assert "noise" not in empty and "none" not in empty and "nothing" not in text_of("nothing"[:0])
    nothing = Report("title", answer=["yes"], sections=[Section("Empty", "", None, Definitions(""))])
    assert nothing.text() == "yes\n\nNo warnings.\n"


@given(st.floats(1e-8, 1e-2), st.sampled_from((-1.0, 1.0)), st.floats(0.1, 9e3))
def test_a_figure_and_its_limit_that_differ_are_written_differently(
    difference: float, side: float, limit: float
) -> None:
    """By more than rounding, and on the right side."""
    ratio = 1.0 + side * difference
    written = [float(text.removesuffix(" %")) for text in (percent(ratio), beside(ratio, 1.0))]
    assert np.sign(written[0] - 100.0) == np.sign(written[1] - 1.0) == side
    assert beside(ratio * limit, limit) != digits(limit)
    assert percent(1.0 + 1e-10) == "100 %" and beside(1.0 + 1e-10, 1.0) == "1"


def test_a_number_is_never_broken_at_its_thousands_nor_cut() -> None:
    words = " ".join(["up to 1234567 N".replace("1234567", fixed(1234567.0))] * 40)
    for width in range(40, 60):
        assert text_of(words, width=width).count(fixed(1234567.0)) == 40
        table = Table(Column("name-with-hyphens-that-is-long", ["a"]), Column("N", [1234567.0], "N", "load"))
        assert load_in_table(1234567.0) in text_of(table, width=width)


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp1252", "cp437", "utf-8"])
def test_characters_that_the_encoding_lacks_are_replaced(encoding: str) -> None:
    """Numbers and rules of tables stay readable; control characters in names are shown as escapes."""
    table = Table(Column("name", ["Prüfstand\x1b[31m"]), Column("load", [12345.0], "N", "load"))
    text = text_of(table, encoding=encoding)
    assert text.encode(encoding).decode(encoding) == text and r"\x1b[31m" in text
    space = NARROW_SPACE if encoding == "utf-8" else " "
    assert f"12{space}345" in text and ("───" in text) == (encoding in ("utf-8", "cp437"))


# ---- numbers


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_not_finite_is_never_printed(kind: str) -> None:
    """An infinite life is unlimited; what is no number is an error in a table, and a word in a sentence."""
    assert KINDS[kind](math.inf).lstrip("+") == "unlimited" and KINDS[kind](math.nan).lstrip("+") == "unknown"
    assert "unlimited" in text_of(Table(Column("", ["a"]), Column("value", [math.inf], "", kind)))
    with pytest.raises(NotFinite, match="value"):
        Table(Column("", ["a"]), Column("value", [math.nan], "", kind))


@given(st.floats(-1e9, 1e9).filter(lambda value: abs(value) > 1e-9), st.integers(1, 7))
def test_digits_are_those_of_the_number(value: float, count: int) -> None:
    """Within half a unit of the last significant digit, or of the last digit before the point; never -0."""
    text = digits(value, count).replace(NARROW_SPACE, "")
    unit = 10.0 ** min(math.floor(math.log10(abs(value))) - count + 1, 0 if abs(value) < 1e7 else 99)
    assert abs(float(text) - value) <= 0.5000001 * unit
    assert len(text.lstrip("-").partition("e")[0].replace(".", "").strip("0")) <= max(count, 7)


@given(st.floats(-1e7, 1e7), st.integers(0, 4))
def test_decimals_and_thousands(value: float, decimals: int) -> None:
    """Groups of three digits from 10 000 on, none below; never -0.0."""
    text = fixed(value, decimals)
    assert float(text.replace(NARROW_SPACE, "")) == pytest.approx(value, abs=0.5000001 * 10.0**-decimals)
    assert not text.startswith("-") or float(text.replace(NARROW_SPACE, "")) < 0.0
    first, *groups = text.partition(".")[0].lstrip("-").split(NARROW_SPACE)
    assert all(len(group) == 3 for group in groups) and len(first) <= (3 if groups else 4)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (12258.31, "12\u202f258"),
        (-441.3, "-441"),
        (8.25, "8.2"),
        (-0.04, "0.0"),
        (1e-15, "0.0"),
        (-99.94, "-99.9"),
    ],
)
def test_loads(value: float, text: str) -> None:
    assert load_in_table(value) == text
    assert signed(value, "load").lstrip("+") == text if value < -0.05 else True


@pytest.mark.parametrize(
    ("value", "text"),
    [(-12258.3, "−12\u202f258 N"), (99.94, "99.9 N"), (0.1234, "0.123 N"), (1e-15, "0 N"), (0.0, "0 N")],
)
def test_loads_of_pictures(value: float, text: str) -> None:
    assert load_with_unit(value) == text


def test_columns_take_arrays_and_texts() -> None:
    column = Column("peak", [*np.array([1.0, 2.5]), "none", None], "N", "load")
    assert column.cells == ["1.0", "2.5", "none", ""]
    with pytest.raises(KeyError):
        _ = Column("peak", [1.0], "N", "weight").cells
