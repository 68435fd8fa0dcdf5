"""The comparison of runs: what differs, and figures that are those of the single runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from command_line import MACHINE, TRACE, guideload, refused
from machines import carriage, machine
from reference import example

from guideload import Link, Machine, plots, simulate
from guideload.base.errors import ArgumentError
from guideload.catalogue.product import Product
from guideload.reports.compare import comparison_report, differences, product_differences


def test_differences_are_matched_by_name() -> None:
    """Only what differs is listed; a carriage that moved in the list is the same carriage."""
    one, two = carriage("a", x=-0.5), carriage("b", x=0.5)
    left = machine(one, two)
    right = machine(two, one.model_copy(update={"length": 0.7}))
    assert list(differences(left, right)) == [("carriages[a].length", (0.6, 0.7))]
    assert list(differences(left, left)) == []
    fewer = machine(one)
    assert ("carriages[b].x", (0.5, None)) in list(differences(left, fewer))


def test_a_product_has_one_row() -> None:
    """It gives the values that differ, or says that one machine does not have the product."""
    record: dict[str, Any] = {"name": "20", "maker": "m", "edition": "e", "type": "ball", "static": 6e4}
    changed = record | {"static": 5e4, "mass": 0.5, "dynamic": {"value": "30 kN", "base": "50 km"}}
    machines = [
        machine(carriage("a", x=-0.5), carriage("b", x=0.5), products=[Product(**one), *others])
        for one, others in ((record, []), (changed, [Product(**record | {"name": "25"})]))
    ]
    assert not list(differences(*machines))
    rows = dict(product_differences(*machines))
    assert list(rows) == ["products[20]", "products[25]"] and rows["products[25]"] == (None, "has it")
    before, after = rows["products[20]"]
    assert before is not None and "static 60000" in before and "dynamic.value none" in before
    assert after is not None and "dynamic.value 30000" in after and after.endswith("and 1 more")


def test_figures_are_those_of_the_runs() -> None:
    """The peaks in the table are those of the results, and the change is against the first row."""
    given, motion = example()
    heavy = given.model_copy(update={"body": given.body.model_copy(update={"mass": 1.1 * given.body.mass})})
    results = {"given": simulate(given, motion), "heavy": simulate(heavy, motion)}
    text = comparison_report(results)
    first, second = (float(one.peak_columns["peak_resultant_N"].max()) for one in results.values())
    assert f"{first:.4g}" in text and f"{second:.4g} ({100 * (second / first - 1):+.1f} %)" in text
    assert "body.mass" in text
    for result in results.values():
        assert all(f"{peak:.0f}" in text for peak in result.peak_columns["peak_resultant_N"])
    same = comparison_report({"a": results["given"], "b": results["given"]})
    assert "The machines are the same" in same and "(+0.0 %)" in same


def test_a_machine_without_carriages_is_refused() -> None:
    given, motion = example()
    links = [
        Link(name=f"{axis}{x}{z}", point=(x, 0, z), direction=axis, stiffness=1e8, damping=1e4)
        for x in (-1, 1)
        for z in (-1, 1)
        for axis in ((0, 1, 0), (0, 0, 1))
    ]
    bare = simulate(Machine(name="bare", body=given.body, links=links, free=given.free), motion)
    for refusing in (comparison_report, plots.comparison):
        with pytest.raises(ArgumentError, match="bare: expected a machine with carriages"):
            refusing({"given": simulate(given, motion), "bare": bare})


def test_the_command(tmp_path: Path) -> None:
    other = tmp_path / "other.toml"
    other.write_text(
        Path(MACHINE).read_text(encoding="utf-8").replace('mass = "1250 kg"', 'mass = "1300 kg"'), "utf-8"
    )
    picture = tmp_path / "c.png"
    text = guideload("compare", MACHINE, other, TRACE, "-o", picture).stdout
    assert "body.mass" in text and "1300" in text and picture.stat().st_size > 10_000
    assert "at least two runs" in refused("compare", MACHINE, TRACE)
    copy = tmp_path / Path(MACHINE).name
    copy.write_bytes(Path(MACHINE).read_bytes())
    assert "the same name" in refused("compare", MACHINE, copy, TRACE)
