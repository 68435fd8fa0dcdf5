"""The report of a catalogue: its products, or one of them."""

from __future__ import annotations

from collections.abc import Callable

from guideload.base.number_text import counted, number
from guideload.catalogue.catalogue import Catalogue
from guideload.catalogue.product import Product
from guideload.catalogue.rating import Rating
from guideload.reports.report import Column, Report, Table, section


def catalogue_report(catalogue: Catalogue) -> Report:
    """A row per product, and remarks."""
    products = catalogue.products

    def rating(read: Callable[[Rating], float]) -> list[float | None]:
        return [None if one.dynamic is None else read(one.dynamic) for one in products]

    return Report(
        title="Catalogue",
        answer=[f"{counted(len(products), 'product')}."],
        warnings=[f"Note: {'; '.join(catalogue.remarks())}."] if any(catalogue.remarks()) else [],
        sections=[
            section(
                "Products",
                Table(
                    Column("product", [one.name for one in products]),
                    Column("C", rating(lambda one: 1e-3 * one.value), "kN", "number"),
                    Column("base", rating(lambda one: 1e-3 * one.base), "km", "number"),
                    Column("p", rating(lambda one: one.exponent), kind="3 digits"),
                    Column("C0", [one.static and 1e-3 * one.static for one in products], "kN", "number"),
                    Column("type", [one.type for one in products]),
                    Column(
                        "preload classes",
                        [", ".join(each.name for each in one.preload_classes) for one in products],
                    ),
                    Column("maker", [one.maker for one in products]),
                ),
            )
        ],
    )


def product_report(product: Product) -> Report:
    """All values of a product, with SI units, and its source."""
    values = product.model_dump(exclude_none=True, exclude={"name", "maker", "edition", "page"})
    lines = [
        f"{key}: {_words(value)}{' (not compared with the source)' if key in product.unverified else ''}"
        for key, value in values.items()
        if value not in ((), {})
    ]
    return Report(
        title=product.name,
        answer=[f"{product.name}: {product.source}"],
        sections=[section("Values (SI units)", lines)],
    )


def _words(value: object) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{key} {_words(each)}" for key, each in value.items())
    if isinstance(value, float):
        return number(value)
    return "; ".join(map(_words, value)) if isinstance(value, tuple) else str(value)
