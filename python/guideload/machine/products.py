"""Carriages that name a product: the keys that the product gives, and the products of a catalogue file or packaged."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from guideload.base.errors import ConfigError, KeyPath, ValueRefused, did_you_mean, refused_at
from guideload.base.number_text import joined
from guideload.catalogue.catalogue import Catalogue
from guideload.catalogue.packaged import ONE_OF_SEVERAL, is_packaged, packaged_product
from guideload.catalogue.product import Product
from guideload.catalogue.stiffness import StiffnessEstimate
from guideload.machine.carriage_types import with_types
from guideload.machine.components import Carriage
from guideload.machine.unchecked import find_tables, find_texts, find_value

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
        raise refused_at(("catalogue",), "a catalogue file", name, hint)
    if not isinstance(values.get("products", ()), list | tuple):
        return values  # the field `products` reports it
    wanted = _texts(with_types(values), "carriages", "product")
    names = _texts(values, "products", "name")
    found = [product for product in Catalogue.from_toml(path).products if product.name not in names]
    known = {*names, *(product.name for product in found)}
    if all(name in known or is_packaged(name) for name in wanted):  # else keep all, for the nearest name
        found = [product for product in found if product.name in wanted]
    return {**values, "products": (*find_tables(values, "products"), *found)}


def with_packaged(values: Any) -> Any:
    """Unchecked values of a machine with the packaged products that its carriages name, unless it has its own."""
    if not isinstance(values, dict) or not isinstance(values.get("products", ()), list | tuple):
        return values
    found = []
    for name in sorted(_texts(values, "carriages", "product") - _texts(values, "products", "name")):
        try:
            found.append(packaged_product(name))
        except ValueRefused:  # `product_problems` reports it
            continue
    return {**values, "products": (*find_tables(values, "products"), *found)} if found else values


def _texts(values: Any, tables: str, key: str) -> set[str]:
    return {text for _, text in find_texts(values, tables, key)}


def filled(values: Any) -> Any:
    """Unchecked values of a machine whose carriages have the keys of their products, unless they have their own.

    A product gives length and width, and the elastic law along each axis for which the carriage has neither stiffness
    nor curve.
    """
    products, carriages = _products(values), list(find_tables(values, "carriages"))
    if not products or not carriages:
        return values
    for i, name in find_texts(values, "carriages", "product"):
        if isinstance(carriages[i], dict | Carriage) and name in products:
            carriages[i] = _with_product(dict(carriages[i]), products[name])
    return {**values, "carriages": carriages}


def _with_product(table: dict[str, Any], product: Product) -> dict[str, Any]:
    given = {key: value for key, value in table.items() if value is not None}
    added: dict[str, Any] = {}
    try:
        laws = product.law_keys(given.get("preload_class"))
    except ValueRefused:  # an unknown preload class: `product_problems` reports it
        laws = {}
    for axis, keys in laws.items():
        if not any(f"{key}_{axis}" in given for key in LAW_KEYS):
            added |= keys
    distances = product.model_distances()
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
    products, invalid = _products(values), of_invalid_products(values)
    for i, table in enumerate(find_tables(values, "carriages")):
        if i in invalid:
            continue
        name, chosen = (find_value(table, key) for key in ("product", "preload_class"))
        if name is None:
            if chosen is not None:
                refused = ValueRefused("no preload_class without product", chosen)
                yield ("carriages", i, "preload_class"), refused
            continue
        try:
            product = _product(products, str(name), str(values.get("catalogue") or "[[products]]"))
        except ValueRefused as refused:
            yield ("carriages", i, "product"), refused
            continue
        if not isinstance(chosen, str | None):  # the field `preload_class` reports it
            continue
        try:
            laws = product.law_keys(chosen)
        except ValueRefused as refused:
            yield ("carriages", i, "preload_class"), refused
            continue
        if not laws and not all(any(find_value(table, f"{key}_{axis}") for key in LAW_KEYS) for axis in "yz"):
            missing = joined(product.missing_for_estimate(chosen))
            hint = f"add {missing} to its record, or give the carriage stiffness_y and stiffness_z"
            words = "a product whose stiffness is given or can be estimated"
            yield ("carriages", i, "product"), ValueRefused(words, name, hint)


def of_invalid_products(values: Any) -> set[int]:
    """The carriages of unchecked values whose product is invalid, by index; the field `products` reports them."""
    invalid = _texts(values, "products", "name") - _products(values).keys()
    return {i for i, name in find_texts(values, "carriages", "product") if name in invalid}


def _product(products: Mapping[str, Product], name: str, where: str) -> Product:
    """The product of a machine with this name. Raises ValueRefused with the nearest names, own ones first."""
    if name in products:
        return products[name]
    try:
        return packaged_product(name)
    except ValueRefused as refused:
        if refused.expected == ONE_OF_SEVERAL:
            raise
        hint = did_you_mean(name, products, refused.hint)
        raise ValueRefused(f"a product of {where}, or a packaged one", name, hint) from None


def _products(values: Any) -> Mapping[str, Product]:
    """The valid products of unchecked values, by name."""
    products = {}
    for table in find_tables(values, "products"):
        try:
            product = table if isinstance(table, Product) else Product(**table)
        except (ConfigError, TypeError):
            continue  # the field `products` reports its problems
        products[product.name] = product
    return products
