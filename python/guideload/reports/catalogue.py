"""The report of a catalogue: its products, or one of them."""

from __future__ import annotations

from guideload.base.number_text import between, counted, digits, joined, number
from guideload.catalogue.catalogue import Catalogue
from guideload.catalogue.product import Product
from guideload.reports.report import Report, Section, Table, Value


def series_report(catalogue: Catalogue) -> Report:
    """A row per maker and series: type, number of products, sizes."""
    series: dict[tuple[str, str, str], list[Product]] = {}
    for one in catalogue.products:
        series.setdefault((one.maker, one.series, one.type), []).append(one)
    headings = [("maker",), ("series",), ("type",), ("products", "", "whole"), ("sizes",)]
    rows: list[tuple[Value, ...]] = [
        (*key, len(members), ", ".join(dict.fromkeys(str(one.size) for one in members)))
        for key, members in series.items()
    ]
    return Report(
        title="Catalogue",
        answer=[f"{counted(len(catalogue.products), 'product')}."],
        sections=[Section("Makers and series", Table.by_rows(headings, rows))],
    )


def catalogue_report(catalogue: Catalogue) -> Report:
    """A row per product, and remarks."""
    headings = [("product",), ("maker",), ("type",), ("C", "kN", "number"), ("base", "km", "number")]
    headings += [("C0", "kN", "number"), ("body", "mm", "number"), ("mass", "kg", "number")]
    headings += [("preload classes",)]
    rows: list[tuple[Value, ...]] = []
    for one in catalogue.products:
        rating = (None, None) if one.dynamic is None else (1e-3 * one.dynamic.value, 1e-3 * one.dynamic.base)
        sizes = one.static and 1e-3 * one.static, one.body_length and 1e3 * one.body_length, one.mass
        classes = ", ".join(each.name for each in one.preload_classes)
        rows.append((one.name, one.maker, one.type, *rating, *sizes, classes))
    return Report(
        title="Catalogue",
        answer=[f"{counted(len(rows), 'product')}."],
        warnings=[f"Warning: {'; '.join(catalogue.remarks())}."] if any(catalogue.remarks()) else [],
        sections=[Section("Products", Table.by_rows(headings, rows))],
    )


def product_report(product: Product) -> Report:
    """All values of a product, with SI units, its source, and preload and stiffness of its classes."""
    values = product.model_dump(exclude_none=True, exclude={"name", "maker", "edition", "page", "unverified"})
    lines = [f"{key}: {_words(value)}" for key, value in values.items() if value not in ((), {}, "")]
    unverified = product.unverified
    return Report(
        title=product.name,
        answer=[f"{product.name}: {product.source}"],
        warnings=[f"Warning: not compared with the source: {joined(unverified)}."] if unverified else [],
        sections=[Section("Values (SI units)", lines), Section("Preload classes", _classes(product))],
    )


def _classes(product: Product) -> Table:
    """A row per preload class: preload, stiffness along y and where it comes from."""
    headings = [("class",), ("preload", "N", "whole"), ("stiffness", "N/um", "3 digits")]
    headings += [("source of the stiffness",)]
    rows: list[tuple[Value, ...]] = []
    for one in product.preload_classes:
        preload = product.preload_range(one.name)
        stiffness = product.law_keys(one.name).get("y", {}).get("stiffness_y")
        known = 1e-6 * stiffness if isinstance(stiffness, float) else None
        force = preload and (between(*preload) if preload[0] < preload[1] else digits(preload[0]))
        rows.append((one.name, force, known, product.stiffness_source(one.name)))
    return Table.by_rows(headings, rows)


def _words(value: object) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{key} {_words(each)}" for key, each in value.items())
    if isinstance(value, float):
        return number(value)
    return "; ".join(map(_words, value)) if isinstance(value, tuple) else str(value)
