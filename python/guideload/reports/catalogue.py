"""The report of a catalogue: its products, or one of them."""

from __future__ import annotations

from rich.console import RenderableType
from rich.text import Text

from guideload.base.number_text import counted
from guideload.catalogue.catalogue import Catalogue
from guideload.catalogue.product import Product
from guideload.reports.elements import new_table, remark, section, to_text


def catalogue_report(catalogue: Catalogue, encoding: str = "utf-8") -> str:
    """A row per product, and remarks."""
    table = new_table(
        "product", "C\nkN", "base\nkm", "p\n", "C0\nkN", texts=("type", "preload classes", "maker")
    )
    for product in catalogue.products:
        rating = product.dynamic
        numbers = ["", "", ""]
        if rating is not None:
            numbers = [_kilo(rating.value), _kilo(rating.base), f"{rating.exponent:.3g}"]
        table.add_row(
            Text(product.name),
            *numbers,
            "" if product.static is None else _kilo(product.static),
            product.type,
            Text(", ".join(one.name for one in product.preload_classes)),
            Text(product.maker),
        )
    notes = [f"Note: {'; '.join(catalogue.remarks())}."] if any(catalogue.remarks()) else []
    return to_text([counted(len(catalogue.products), "product"), table, *remark(*notes)], encoding=encoding)


def product_report(product: Product, encoding: str = "utf-8") -> str:
    """All values of a product, with SI units, and its source."""
    parts: list[RenderableType] = [f"{product.name}: {product.source}"]
    parts += section("Values (SI units)")
    for key, value in product.model_dump(
        exclude_none=True, exclude={"name", "maker", "edition", "page"}
    ).items():
        if value not in ((), {}):
            mark = " (not compared with the source)" if key in product.unverified else ""
            parts.append(f"{key}: {_words(value)}{mark}")
    return to_text(parts, encoding=encoding)


def _kilo(value: float) -> str:
    return f"{1e-3 * value:.6g}"


def _words(value: object) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{key} {_words(each)}" for key, each in value.items())
    if isinstance(value, float):
        return f"{value:.6g}"
    return "; ".join(map(_words, value)) if isinstance(value, tuple) else str(value)
