"""Packaged catalogues: every record against the facts it was made from, laws over all records, names."""

from __future__ import annotations

import re
import statistics
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from machines import machine

from guideload.base.errors import ConfigError, ValueRefused
from guideload.base.toml import tomllib
from guideload.catalogue import packaged
from guideload.catalogue.catalogue import Catalogue, has_words
from guideload.catalogue.packaged import packaged_catalogue, packaged_product
from guideload.catalogue.product import Product
from guideload.machine.components import Carriage
from guideload.machine.machine import Machine

FACTS_OF_USER = {
    "name": "p",
    "maker": "mine",
    "edition": "e",
    "type": "ball",
    "static": 1e4,
    "row_length": 0.05,
    "preload_classes": [{"name": "A", "stiffness": 1e8}],
}
PRODUCTS = packaged_catalogue().products


def values(product: Product) -> Iterator[tuple[str, object]]:
    """The values of a product in the units and under the keys of the facts."""
    for key in ("name", "maker", "series", "size", "type"):
        yield key, getattr(product, key)
    yield "edition", f"{product.edition}, {product.page}" if product.page else product.edition
    assert product.dynamic is not None and product.static is not None
    yield "dynamic_N", product.dynamic.value
    yield "dynamic_base_km", product.dynamic.base / 1e3
    yield "static_N", product.static
    for key, moments in (
        ("moments_Nm", product.static_moments),
        ("dynamic_moments_Nm", product.dynamic_moments),
    ):
        yield key, moments.model_dump(exclude_none=True) or None
    yield "L1_mm", product.body_length and 1e3 * product.body_length
    yield "length_mm", product.carriage_length and 1e3 * product.carriage_length
    yield "mass_kg", product.mass
    yield "v_max_m_s", product.max_speed
    yield "a_max_m_s2", product.max_acceleration


def classes(facts: dict[str, Any]) -> Iterator[tuple[str, str, list[float], float | None]]:
    """Name, key, interval in SI and stiffness of each preload class of the facts."""
    for one in facts["preload_classes"]:
        name = one if isinstance(one, str) else one["name"]
        stiffness = facts.get("rigidity_N_per_um", {}).get(name)
        if isinstance(one, str):
            ends = [1e-6 * end for end in facts["radial_clearance_um"][name]]
            yield name, "radial_clearance", ends, stiffness
        elif "lo_C" in one:
            yield name, "share_of_C", [one["lo_C"], one["hi_C"]], stiffness
        else:
            key = "share_of_C" if "share_of_C" in one else "share_of_C0"
            yield name, key, [one[key]] * 2, stiffness


def test_every_record_is_that_of_the_facts(shared_data: Path) -> None:
    """To the digit: the tolerance is rounding of the units."""
    facts = tomllib.loads((shared_data / "carriages.toml").read_text(encoding="utf-8"))["products"]
    assert sorted(one["name"] for one in facts) == sorted(product.name for product in PRODUCTS)
    for one in facts:
        product = packaged_product(one["name"])
        for key, value in values(product):
            expected = one.get(key)
            numeric = isinstance(expected, int | float | dict)
            assert value == (pytest.approx(expected, rel=1e-14) if numeric else expected), (product.name, key)
        friction, basis = (
            one.get("seal_friction_N", one.get("friction_N")),
            one.get("seal_friction_basis", ""),
        )
        if friction is None:
            assert product.seal_force is None
        else:
            assert product.seal_force is not None and product.seal_force.value == friction
            assert product.seal_force.per == ("end seal" if "end seal" in basis else "carriage")
        printed = list(classes(one))
        assert [kind.name for kind in product.preload_classes] == [name for name, *_ in printed]
        for name, key, ends, stiffness in printed:
            kind = product.class_named(name)
            assert kind is not None and getattr(kind, key) == pytest.approx(ends, rel=1e-14)
            assert kind.stiffness == (
                None if stiffness is None else pytest.approx(1e6 * stiffness, rel=1e-14)
            )
        for kind in one["preload_classes"]:
            if "force_N" in kind:  # rounded to 10 N or 100 N, shares to 4 digits
                low, high = product.preload_range(kind["name"]) or (0, 0)
                assert low == high == pytest.approx(kind["force_N"], abs=60)
        marked = {"dynamic", "static", "static_moments", "preload_classes", "mass"}
        assert marked <= set(product.unverified)
        assert all(getattr(product, key) for key in product.unverified)


def rail(product: Product) -> float:
    """Width of the rail in mm, or the first number of "55/85"."""
    return float(str(product.size).split("/")[0])


LAWS: dict[str, tuple[float, Callable[[Any], float]]] = {
    "C0/C": (1.3, lambda p: p.static / p.dynamic.value),
    "pitch moment/(C0 length)": (1.4, lambda p: p.static_moments.pitch / p.static / p.loaded_length),
    "yaw moment/pitch moment": (1.1, lambda p: p.static_moments.yaw / p.static_moments.pitch),
    "roll moment/(C0 size)": (1.35, lambda p: p.static_moments.roll / p.static / rail(p)),
    "C0/(length size)": (1.3, lambda p: p.static / p.loaded_length / rail(p)),
    # Blocks and flanges of all sizes are in one series.
    "mass/(length size^2)": (1.75, lambda p: p.mass / p.loaded_length / rail(p) ** 2),
}
ODD = {("RGH15CA", "roll moment/(C0 size)")}  # printed so; the head of the file says it


@pytest.mark.parametrize("law", LAWS)
def test_records_of_a_series_follow_one_law(law: str) -> None:
    """A digit lost or a column mixed up would be beyond the limit, which is a factor on the median of the series."""
    limit, ratio = LAWS[law]
    series: dict[tuple[str, str], list[Product]] = {}
    for product in PRODUCTS:
        series.setdefault((product.maker, product.series.split()[0]), []).append(product)
    odd = {
        (product.name, law)
        for members in series.values()
        for product in members
        if not 1 / limit <= ratio(product) / statistics.median(map(ratio, members)) <= limit
    }
    assert odd == {one for one in ODD if one[1] == law}


def test_static_ratings_below_dynamic_ones_are_those_told_in_the_files() -> None:
    below = {p.name for p in PRODUCTS if p.static and p.dynamic and p.static < p.dynamic.value}
    assert below == {"QHW20CC", "QHW20HC", "MEC20", "MEC25", "MEC30", "MEC35", "ME45"}
    heads = "".join(
        file.read_text(encoding="utf-8").split("[[")[0] for file in packaged.FOLDER.glob("*.toml")
    )
    assert all(name in heads for name in (*below, *(name for name, _ in ODD)))


def test_files_are_those_of_a_user() -> None:
    """Read as a user's own file they have the same records, in the same order."""
    files = sorted(packaged.FOLDER.glob("*.toml"))
    assert PRODUCTS == tuple(one for file in files for one in Catalogue.from_toml(file).products)
    assert len(PRODUCTS) >= 250


def test_a_name_reads_its_own_record_only(monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[str] = []

    def counted(text: str) -> dict[str, Any]:
        read.append(text)
        return loads(text)

    loads = tomllib.loads
    monkeypatch.setattr(packaged.tomllib, "loads", counted)
    packaged.product_of.cache_clear()
    assert packaged_product("HGH25CA").static == 52820.0
    assert len(read) == 1 and read[0].count("[[products]]") == 1


def test_a_name_of_several_records_needs_maker_and_edition(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def record(maker: str, edition: str, static: str) -> str:
        head = f'[[products]]\nname = "A1"\nmaker = "{maker}"\nedition = "{edition}"\n'
        return f'{head}type = "ball"\nstatic = "{static}"\n\n'

    text = (
        record("M N", "catalogue 2013", "1 kN")
        + record("M N", "catalogue 2020", "2 kN")
        + record("K", "e", "3 kN")
    )
    (tmp_path / "all.toml").write_text(text, encoding="utf-8")
    monkeypatch.setattr(packaged, "FOLDER", tmp_path)
    packaged.records.cache_clear()
    try:
        with pytest.raises(ValueRefused) as caught:
            packaged_product("A1")
        assert '"M N A1 catalogue 2013", "M N A1 catalogue 2020", "K A1 e"' in caught.value.hint
        for name, static in (("M N A1 2013", 1e3), ("M N A1 2020", 2e3), ("K A1", 3e3)):
            found = packaged_product(name)
            assert (found.name, found.static) == (name, static)
        for name in ("M N A1", "N A1", "M N A1 2021"):
            with pytest.raises(ValueRefused):
                packaged_product(name)
        names = [product.name for product in packaged_catalogue().products]
        assert [packaged_product(name).static for name in names] == [1e3, 2e3, 3e3]
        assert len(packaged_catalogue("k").products) == 1
    finally:
        packaged.records.cache_clear()


def test_unknown_names_tell_a_near_one() -> None:
    for name, words in (("HGH25C", "HGH25CA"), ("qq", "catalogue list")):
        with pytest.raises(ValueRefused) as caught:
            packaged_product(name)
        assert words in caught.value.hint
    with pytest.raises(ValueRefused, match="Bosch Rexroth"):
        packaged_catalogue("SKF")


# ---- machines that name packaged products

TABLE: dict[str, Any] = {"rail": "1", "damping_y": 1e4, "damping_z": 1e4}


def named(product: str, preload_class: str | None = None, **keys: object) -> Machine:
    """A machine on two carriages of one rail, which name a product."""
    table = TABLE | {"product": product, "preload_class": preload_class} | keys
    return machine(*(table | {"name": name, "x": x} for name, x in (("a", -0.2), ("b", 0.2))))


def alone(product: str, preload_class: str | None = None, products: Any = (), **keys: object) -> Carriage:
    """A carriage that names a product, on a machine that cannot rotate."""
    table = TABLE | {"name": "a", "x": 0.0, "product": product, "preload_class": preload_class} | keys
    return machine(table, products=products, free=["y", "z"]).carriages[0]


def test_a_machine_takes_law_length_and_width_from_a_packaged_product() -> None:
    """Also on one rail: the width that follows from the static roll moment resists roll."""
    for name, preload_class, stiffness in (("HGH25CA", "ZA", 539e6), ("HIWIN HGH25CA", "ZB", 705e6)):
        built = named(name, preload_class)
        carriage = built.carriages[0]
        assert (carriage.stiffness_y, carriage.stiffness_z) == (stiffness, stiffness)
        assert carriage.length == pytest.approx(0.058 / 3**0.5) and carriage.width == pytest.approx(
            2 * 420 / 52820
        )
        assert [product.name for product in built.products] == [name]
        assert Machine.model_validate_json(built.model_dump_json()) == built
        assert built.model_copy(update={"name": "other"}).products == built.products
        assert built.scene.static_link_loads().size == 12


def test_every_packaged_product_carries_a_machine() -> None:
    for product in PRODUCTS:
        for one in product.preload_classes:
            carriage = named(product.name, one.name).carriages[0]
            assert isinstance(carriage.stiffness_y, float) and 5e6 < carriage.stiffness_y < 1e10
            assert product.stiffness_source(one.name)


def test_an_unknown_name_is_refused_with_the_names_that_have_its_words() -> None:
    """Those that `guideload size --product` runs for the same words."""
    for words in ("hgh25", "HIWIN 25", "25 thk", "iko", "hgh 25 ca"):
        with pytest.raises(ValueRefused) as caught:
            packaged_product(words)
        named = re.findall('"(.+?)"', caught.value.hint)
        more = re.search(r"one of (\d+) more", caught.value.hint)
        expected = dict.fromkeys(
            one.name for one in packaged.records() if has_words(words, one.maker, one.name)
        )
        assert named == list(expected)[:12] and len(expected) == len(named) + int(more[1] if more else 0)


def test_products_of_the_machine_are_the_nearest_names() -> None:
    with pytest.raises(ConfigError, match='did you mean "HGH25X"'):
        alone("HGH25", products=[{**FACTS_OF_USER, "name": "HGH25X"}])


def test_own_values_win() -> None:
    own = {**FACTS_OF_USER, "name": "HGH25CA"}
    assert alone("HGH25CA", products=[own], width=0.02).stiffness_y == 1e8
    carriage = named("HGW25CC", "ZA", stiffness_y="50 N/um", width="30 mm").carriages[0]
    assert (carriage.stiffness_y, carriage.width) == (5e7, 0.03)
    estimate = packaged_product("HGW25CC").stiffness_estimate("ZA")
    assert estimate is not None and carriage.stiffness_z == estimate.stiffness
    assert (
        named("HGW25CC", "ZA", stiffness_y="50 N/um", stiffness_roll="1 kN m/rad").carriages[0].width is None
    )


def test_the_stiffness_of_the_product_written_in_the_file_changes_nothing() -> None:
    """Also where length and width follow from static moments, and where a `Carriage` names the product."""
    moments = {"row_length": None, "static_moments": {"roll": 100.0, "pitch": 80.0}}
    more: dict[str, Any] = {"products": [{**FACTS_OF_USER, **moments}]}
    filled = alone("p", **more)
    assert filled.width == pytest.approx(0.02)
    assert alone("p", stiffness_y=1e8, **more) == filled
    of_python = Carriage(**{key: value for key, value in filled if key != "width"})
    assert machine(of_python, free=["y", "z"], **more).carriages == (filled,)


@pytest.mark.parametrize(
    ("product", "preload_class", "key", "words"),
    [
        ("HGH26CA", None, "product", "did you mean"),
        ("HGH25CA", None, "preload_class", "Z0, ZA, ZB"),
        ("HGH25CA", "ZC", "preload_class", "Z0, ZA, ZB"),
    ],
)
def test_refusals_of_machines(product: str, preload_class: str | None, key: str, words: str) -> None:
    with pytest.raises(ConfigError) as caught:
        named(product, preload_class)
    assert {problem.path[-1] for problem in caught.value.problems} == {key} and words in str(caught.value)


def test_a_product_without_stiffness_names_what_an_estimate_lacks() -> None:
    mine = {key: value for key, value in FACTS_OF_USER.items() if key != "preload_classes"}
    for classes_, words in (([], "preload_classes"), ([{"name": "A"}], "share_of_C of A")):
        with pytest.raises(ConfigError) as caught:
            alone("p", products=[{**mine, "preload_classes": classes_}])
        assert len(caught.value.problems) == 1 and f"add {words} to its record" in str(caught.value)
