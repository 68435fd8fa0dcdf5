"""Catalogue files: what is refused, and what a product gives to the carriages that name it."""

from __future__ import annotations

import pickle
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from machines import machine

from guideload import packaged_catalogue
from guideload.base.errors import ArgumentError, ArgumentTypeError, ConfigError
from guideload.catalogue.catalogue import Catalogue
from guideload.catalogue.product import Product
from guideload.machine.machine import Machine
from guideload.reports.catalogue import product_report

EXAMPLES = Path(str(files("guideload"))) / "examples"
PLAIN = {"name": "p", "maker": "m", "edition": "e", "type": "ball"}
SIDES = {"press": 5e8, "lift": 4e8, "side": 3e8}
RISING = [["0 um", 0], ["10 um", "4 kN"], ["30 um", "15 kN"]]
CARRIAGE = {"name": "1", "rail": "1", "x": 0.0, "damping_y": 1e4, "damping_z": 1e4, "product": "p"}


def carriage_of(keys: dict[str, Any] | None = None, **product: Any) -> Any:
    """The carriage with a product whose only preload class has these keys."""
    values = {**PLAIN, "row_length": "60 mm", **product}
    if keys is not None:
        values["preload_classes"] = [{"name": "A", **keys}]
    return machine(CARRIAGE, products=[values], free=["y", "z"]).carriages[0]


def test_the_packaged_examples_cite_their_source_and_mark_what_was_not_checked() -> None:
    catalogue = Catalogue.from_toml(EXAMPLES / "catalogue.toml")
    for product in catalogue.products:
        assert product.maker and product.edition and product.dynamic is not None
        assert "page not known" in product_report(product).text().replace("\n", " ") or product.page
    assert set(catalogue["HGH25CA"].unverified) >= {"dynamic", "static", "static_moments"}
    assert "values not compared with the source: HGH25CA" in "\n".join(catalogue.remarks())


@pytest.mark.parametrize(
    ("changes", "key", "words"),
    [
        ({"dynamic": {"value": "27 kN"}}, "products[0].dynamic.base", 'add the key "base"'),
        ({"dynamic": "27 kN"}, "products[0].dynamic", "a table of keys and values"),
        ({"dynamic": {"value": "27 kN", "base": "50 kN"}}, "products[0].dynamic.base", "a length in m"),
        (
            {"dynamic": {"value": "27 kN", "base": 100}},
            "products[0].dynamic.base",
            "A number without a unit is in m",
        ),
        ({"dynamic": {"value": 1, "base": 1e5, "exponent": "10:3"}}, "products[0].dynamic.exponent", "10/3"),
        ({"type": "needle"}, "products[0].type", '"ball" or "roller"'),
        ({"seal_force": {"value": 2}}, "products[0].seal_force.per", '"carriage" or "end seal"'),
        ({"unverified": ["statics"]}, "products[0].unverified", '"statics" is none'),
        (
            {
                "preload_classes": [
                    {"name": "A", "stiffness": 1, "curve": dict.fromkeys(("press", "lift", "side"), RISING)}
                ]
            },
            "products[0].preload_classes[0]",
            "at most one of stiffness and curve",
        ),
        (
            {"preload_classes": [{"name": "A", "stiffness": SIDES, "preload": 1}]},
            "products[0].preload_classes[0]",
            "no preload beside a stiffness that differs by side",
        ),
        (
            {"preload_classes": [{"name": "A", "stiffness": 1}, {"name": "A", "stiffness": 2}]},
            "products[0].preload_classes",
            "a unique name",
        ),
        (
            {
                "preload_classes": [
                    {"name": "A", "curve": {"press": RISING, "lift": RISING, "side": RISING[1:]}}
                ]
            },
            "products[0].preload_classes[0].curve.side",
            "from [0, 0] on",
        ),
    ],
    ids=str,
)
def test_refusals_name_key_and_way_out(changes: dict[str, Any], key: str, words: str) -> None:
    with pytest.raises(ConfigError) as caught:
        Catalogue(products=[{**PLAIN, **changes}])
    assert caught.value.key == key and words in str(caught.value)


def test_a_file_tells_the_row(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    text = (EXAMPLES / "catalogue.toml").read_text(encoding="utf-8")
    file.write_text(text.replace(', base = "100 km" }', " }", 1), encoding="utf-8")
    row = text[: text.index("14.4 kN")].count("\n") + 1
    with pytest.raises(ConfigError, match=rf"mine.toml, row {row}: products\[0\].dynamic.base"):
        Catalogue.from_toml(file)
    with pytest.raises(ConfigError, match="a unique name"):
        Catalogue(products=[PLAIN, PLAIN])


def test_the_exponent_follows_from_the_type_unless_it_is_given() -> None:
    rating = {"value": 1.0, "base": 1e5}
    for keys, exponent in (({"type": "ball"}, 3.0), ({"type": "roller"}, 10 / 3)):
        assert Product(**{**PLAIN, **keys, "dynamic": rating}).dynamic.exponent == exponent
    dry = Product(**{**PLAIN, "dynamic": {**rating, "exponent": 1.57}}).dynamic
    assert dry is not None and dry.exponent == 1.57


def test_lift_is_the_positive_side_and_press_the_negative_one() -> None:
    """A load is the force of the body on its guide: weight, which presses, makes y negative."""
    along_y, along_z = carriage_of({"stiffness": SIDES}).laws
    assert along_y.force(np.array([-1e-6, 1e-6])).tolist() == pytest.approx([-500.0, 400.0])
    assert along_z.force(np.array([1e-6])).tolist() == pytest.approx([300.0])
    lifted = [[0, 0], ["10 um", "2 kN"]]
    along_y, along_z = carriage_of({"curve": {"press": RISING, "lift": lifted, "side": lifted}}).laws
    assert along_y.force(np.array([-30e-6, -5e-6, 5e-6])).tolist() == pytest.approx([-15e3, -2e3, 1e3])
    assert along_z.force(np.array([-5e-6])).tolist() == pytest.approx([-1e3])


def test_a_preload_gives_the_law_of_two_rows() -> None:
    found = carriage_of({"stiffness": "539 N/um", "preload": "2.09 kN"})
    law = found.laws[0]
    assert found.rolling == "ball" and law.kind == "preloaded"
    assert law.edges[-1] == pytest.approx(
        11.7e-6, abs=0.1e-6
    )  # both figures by domain knowledge: 5.9 kN, 11.7 um
    assert float(law.force(law.edges[-1:])[0]) == pytest.approx(5.9e3, abs=50)


def test_keys_at_the_carriage_override_those_of_the_product() -> None:
    keys = {**CARRIAGE, "length": "85 mm", "stiffness_z": "50 N/um"}
    product = {**PLAIN, "row_length": "60 mm", "preload_classes": [{"name": "A", "stiffness": SIDES}]}
    built = machine(keys, products=[product], free=["y", "z"]).carriages[0]
    assert built.length == 0.085 and built.stiffness_z == 5e7
    assert built.laws[0].force(np.array([-1e-6])).tolist() == pytest.approx([-500.0])
    assert carriage_of({"stiffness": SIDES}).length == pytest.approx(0.06 / 3**0.5)


def test_a_machine_file_with_a_catalogue(tmp_path: Path) -> None:
    text = (EXAMPLES / "manipulator.toml").read_text(encoding="utf-8")
    named = text.replace('name = "Cl', 'catalogue = "mine.toml"\nname = "Cl')
    named = named.replace('stiffness_y = "55 N/um"', 'product = "HGH25CA"\npreload_class = "ZA"')
    (tmp_path / "mine.toml").write_bytes((EXAMPLES / "catalogue.toml").read_bytes())
    file = tmp_path / "machine.toml"

    def read(changed: str) -> Machine:
        file.write_text(changed, encoding="utf-8")
        return Machine.from_toml(file)

    built = read(named)
    assert [product and product.name for product in built.product_of_carriage] == ["HGH25CA"] * 4
    assert len(built.products) == 1 and built.carriages[0].stiffness_y == 539e6
    for copy in (Machine.model_validate_json(built.model_dump_json()), pickle.loads(pickle.dumps(built))):
        assert copy == built and hash(copy) == hash(built)
    for old, new, words in (
        (
            "HGH25CA",
            "HGH26CA",
            r'toml, row \d+: .*product: .*of mine.toml, or a packaged one, got "HGH26CA"; did you mean "HGH25CA"',
        ),
        ('"ZA"', '"ZC"', r"row \d+: carriages\[0\].preload_class: .*of HGH25CA \(Z0, ZA, ZB\)"),
        ('preload_class = "ZA"', "", 'add the key "preload_class"'),
        ('"mine.toml"', '"theirs.toml"', "row .*: catalogue: expected a catalogue file.*there is no"),
    ):
        with pytest.raises(ConfigError, match=words) as caught:
            read(named.replace(old, new))
        assert len(caught.value.problems) <= 4  # one for each carriage: nothing follows from the first error


def test_a_selection_that_can_find_nothing_is_refused() -> None:
    catalogue = packaged_catalogue()
    assert catalogue.selected(kind="Ball") == catalogue.selected(kind="ball")
    with pytest.raises(ArgumentError, match='kind: expected one of ball, roller, got "balls"'):
        catalogue.selected(kind="balls")
    for wrong in ({"least": np.nan}, {"longest": -1.0}):
        with pytest.raises(ArgumentError, match="expected >= 0"):
            catalogue.selected(**wrong)
    with pytest.raises(ArgumentTypeError, match="size: expected text or None, got 25"):
        catalogue.selected(size=25)  # type: ignore[arg-type]
