"""The report of a catalogue: its products, or one of them."""

from __future__ import annotations

from guideload.base.number_text import counted, number
from guideload.catalogue.catalogue import Catalogue
from guideload.catalogue.product import Product
from guideload.reports.report import Report, Section, Table, Value


def catalogue_report(catalogue: Catalogue) -> Report:
    """A row per product, and remarks."""
    headings = [("product",), ("C", "kN", "number"), ("base", "km", "number"), ("p", "", "3 digits")]
    headings += [("C0", "kN", "number"), ("type",), ("preload classes",), ("maker",)]
    rows: list[tuple[Value, ...]] = []
    for one in catalogue.products:
        rating: tuple[Value, ...] = None, None, None
        if one.dynamic is not None:
            rating = 1e-3 * one.dynamic.value, 1e-3 * one.dynamic.base, one.dynamic.exponent
        classes = ", ".join(each.name for each in one.preload_classes)
        rows.append((one.name, *rating, one.static and 1e-3 * one.static, one.type, classes, one.maker))
    return Report(
        title="Catalogue",
        answer=[f"{counted(len(rows), 'product')}."],
        warnings=[f"Note: {'; '.join(catalogue.remarks())}."] if any(catalogue.remarks()) else [],
        sections=[Section("Products", Table.by_rows(headings, rows))],
    )


def product_report(product: Product) -> Report:
    """All values of a product, with SI units, and its source."""
    values = product.model_dump(exclude_none=True, exclude={"name", "maker", "edition", "page"})
    lines = [
        f"{key}: {_words(value)}{' (not compared with the source)' if key in product.unverified else ''}"
        for key, value in values.items()
        if value not in ((), {}, "")
    ]
    return Report(
        title=product.name,
        answer=[f"{product.name}: {product.source}"],
        sections=[Section("Values (SI units)", lines)],
    )


def _words(value: object) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{key} {_words(each)}" for key, each in value.items())
    if isinstance(value, float):
        return number(value)
    return "; ".join(map(_words, value)) if isinstance(value, tuple) else str(value)
