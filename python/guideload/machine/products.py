"""Carriages that name a product: the keys that the product gives, and the products of a catalogue file or packaged."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from guideload.base.errors import ConfigError, KeyPath, Problem, ValueRefused
from guideload.base.number_text import joined
from guideload.catalogue.catalogue import Catalogue
from guideload.catalogue.packaged import is_packaged, packaged_product
from guideload.catalogue.product import Product
from guideload.catalogue.stiffness import StiffnessEstimate
from guideload.machine.carriage_types import with_types
from guideload.machine.components import Carriage

LAW_KEYS = ("stiffness", "curve")  # a carriage that has one of them has its own law along this axis


def with_catalogue(values: dict[str, Any], file: Path) -> dict[str, Any]:
    """The values of a machine file with the products that its carriages name, from the catalogue that it names.

    Raises ConfigError for a catalogue that does not exist or is invalid; the key path is that of the machine file.
    """
    name = values.get("catalogue")
    if not isinstance(name, str):
        return values
    path = file.parent / name
    if not path.is_file():
        hint = f"there is no {path}; the name is relative to the machine file"
        raise ConfigError([Problem(("catalogue",), name, "a catalogue file", hint, None, f'"{name}"')])
    tables = with_types(values).get("carriages", ())
    wanted = _texts("product", tables)
    own = values.get("products", ())
    if not isinstance(own, list | tuple):
        return values  # the field `products` tells it
    names = _texts("name", own)
    found = [product for product in Catalogue.from_toml(path).products if product.name not in names]
    known = {*names, *(product.name for product in found)}
    if all(name in known or is_packaged(name) for name in wanted):  # else keep all, for the nearest name
        found = [product for product in found if product.name in wanted]
    return {**values, "products": (*own, *found)}


def with_packaged(values: Any) -> Any:
    """Unchecked values of a machine with the packaged products that its carriages name, unless it has its own."""
    own = values.get("products", ()) if isinstance(values, dict) else None
    if not isinstance(own, list | tuple):
        return values
    found = []
    for name in sorted(_texts("product", values.get("carriages", ())) - _texts("name", own)):
        try:
            found.append(packaged_product(name))
        except ValueRefused:  # `product_problems` tells it
            continue
    return {**values, "products": (*own, *found)} if found else values


def _texts(key: str, tables: object) -> set[str]:
    """The texts that unchecked tables have under a key."""
    listed = tables if isinstance(tables, list | tuple) else ()
    return {text for text in (_key(table, key) for table in listed) if isinstance(text, str)}


def filled(values: Any) -> Any:
    """Unchecked values of a machine whose carriages have the keys of their products, unless they have their own.

    A product gives length and width, and the elastic law along each axis for which the carriage has neither stiffness
    nor curve; length and width that follow from static moments only together with the law along y.
    """
    products = _products(values)
    if not products:
        return values
    carriages = []
    for table in values["carriages"]:
        product = products.get(str(table.get("product"))) if isinstance(table, dict) else None
        carriages.append(table if product is None else _with_product(table, product))
    return {**values, "carriages": carriages}


def _with_product(table: dict[str, Any], product: Product) -> dict[str, Any]:
    given = {key: value for key, value in table.items() if value is not None}
    added: dict[str, Any] = {}
    try:
        laws = product.law_keys(given.get("preload_class"))
    except ValueRefused:  # an unknown preload class: `product_problems` tells it
        laws = {}
    for axis, keys in laws.items():
        if not any(f"{key}_{axis}" in given for key in LAW_KEYS):
            added |= keys
    distances = product.model_distances(with_law="stiffness_y" in added or "curve_y" in added)
    if {"stiffness_pitch", "stiffness_yaw"} <= given.keys():
        distances.pop("length", None)
    if "stiffness_roll" in given:
        distances.pop("width", None)
    added |= distances
    return {**table, **{key: value for key, value in added.items() if key not in given}}


def stiffness_estimates(
    carriages: Sequence[Carriage], products: Sequence[Product | None]
) -> list[StiffnessEstimate | None]:
    """For each carriage and its product the estimate that its stiffness along y or z is; None if both are given."""

    def estimate(carriage: Carriage, product: Product | None) -> StiffnessEstimate | None:
        found = None if product is None else product.stiffness_estimate(carriage.preload_class)
        own = carriage.stiffness_y, carriage.stiffness_z
        return found if found is not None and found.stiffness in own else None

    return list(map(estimate, carriages, products))


def product_problems(values: dict[str, Any]) -> Iterator[tuple[KeyPath, ValueRefused]]:
    """Problems of unchecked carriages: unknown products and preload classes, and products without stiffness."""
    tables, products = values.get("carriages", ()), _products(values)
    for i, table in enumerate(tables if isinstance(tables, list | tuple) else ()):
        name, chosen = (_key(table, key) for key in ("product", "preload_class"))
        if name is None:
            if chosen is not None:
                yield (
                    ("carriages", i, "preload_class"),
                    ValueRefused("no preload_class without product", chosen),
                )
            continue
        try:
            product = _product(products, str(name), str(values.get("catalogue") or "[[products]]"))
        except ValueRefused as refused:
            yield ("carriages", i, "product"), refused
            continue
        if not isinstance(chosen, str | None):  # the field `preload_class` tells it
            continue
        try:
            laws = product.law_keys(chosen)
        except ValueRefused as refused:
            yield ("carriages", i, "preload_class"), refused
            continue
        if not laws and not all(any(_key(table, f"{key}_{axis}") for key in LAW_KEYS) for axis in "yz"):
            missing = joined(product.missing_for_estimate(chosen))
            hint = f"add {missing} to its record, or give the carriage stiffness_y and stiffness_z"
            words = "a product whose stiffness is given or can be estimated"
            yield ("carriages", i, "product"), ValueRefused(words, name, hint)


def _product(products: Mapping[str, Product], name: str, where: str) -> Product:
    """The product of a machine with this name. Raises ValueRefused with the nearest names, own ones first."""
    if name in products:
        return products[name]
    try:
        return packaged_product(name)
    except ValueRefused as refused:
        near = get_close_matches(name, products, n=1)
        if name in refused.hint:  # several have it
            raise
        hint = f'did you mean "{near[0]}"?' if near else refused.hint
        raise ValueRefused(f"a product of {where}, or a packaged one", name, hint) from None


def _key(table: Any, key: str) -> Any:
    return table.get(key) if isinstance(table, dict) else getattr(table, key, None)


def _products(values: Any) -> Mapping[str, Product]:
    """The valid products of unchecked values, by name."""
    tables = values.get("products", ()) if isinstance(values, dict) else ()
    products = {}
    for table in tables if isinstance(tables, list | tuple) else ():
        try:
            product = table if isinstance(table, Product) else Product(**table)
        except (ConfigError, TypeError):
            continue  # the field `products` tells its problems
        products[product.name] = product
    return products
