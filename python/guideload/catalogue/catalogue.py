"""A catalogue file: the products that machines may name."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import ClassVar

from pydantic import Field, field_validator

from guideload.base.arguments import checked
from guideload.base.errors import ArgumentError, ValueRefused, did_you_mean, shown
from guideload.base.file_model import FileModel
from guideload.base.number_text import first_names
from guideload.catalogue.product import Product
from guideload.catalogue.rating import LIFE_EXPONENT


def has_words(text: str, maker: str, name: str) -> bool:
    """Whether maker and name of a product have every word of a text, such as "HIWIN 25", in any case.

    A number is not part of a longer one: HGH25CA has "25", HGH250 has not.
    """
    product = f"{maker} {name}"
    words = [re.search(_as_part(word), product, re.IGNORECASE) for word in text.split()]
    return bool(words) and all(words)


def _as_part(word: str) -> str:
    """The pattern of a word as a part of a name, in which its numbers are whole."""
    before, after = r"(?<!\d)" if word[0].isdigit() else "", r"(?!\d)" if word[-1].isdigit() else ""
    return f"{before}{re.escape(word)}{after}"


class Catalogue(FileModel):
    """A catalogue of carriages. Raises ConfigError with all problems at once."""

    FILE: ClassVar = "catalogue.toml"
    WRITTEN_BY: ClassVar = "`guideload init --catalogue` writes one"
    REQUIRED: ClassVar = ("products", "[[products]] tables, as a catalogue has")

    products: tuple[Product, ...] = Field(min_length=1, description="one [[products]] table per product")

    @field_validator("products")
    @classmethod
    def _unique(cls, products: tuple[Product, ...]) -> tuple[Product, ...]:
        names = [product.name for product in products]
        for i, name in enumerate(names):
            if name in names[:i]:
                place = f"products[{names.index(name)}] and products[{i}] have it"
                raise ValueRefused("a unique name of each product", name, place)
        return products

    def __getitem__(self, name: str) -> Product:
        """The product of this name. Raises ValueRefused with the nearest names."""
        products = {product.name: product for product in self.products}
        if name not in products:
            hint = did_you_mean(name, products, f"it has {shown(list(products))}")
            raise ValueRefused("a product of the catalogue", name, hint)
        return products[name]

    @checked
    def selected(
        self,
        maker: str | None = None,
        series: str | None = None,
        size: str | None = None,
        kind: str | None = None,
        least: float | None = None,
        longest: float | None = None,
    ) -> tuple[Product, ...]:
        """The products that match all given arguments, by ascending dynamic load rating for 100 km; without one: last.

        kind     "ball" or "roller"
        least    N, dynamic load rating for 100 km
        longest  m, body; a product whose body length is not known is left out

        Raises ArgumentError for another kind, and for nan or a negative number.
        """
        if kind is not None and kind.casefold() not in LIFE_EXPONENT:
            raise ArgumentError(f"kind: expected one of {', '.join(LIFE_EXPONENT)}, got {shown(kind)}")
        for name, value, unit in (("least", least, "N"), ("longest", longest, "m")):
            if value is not None and not value >= 0.0:
                raise ArgumentError(f"{name}: expected >= 0 {unit}, got {value:g}")
        wanted = {"maker": maker, "series": series, "size": size, "type": kind}
        words = {key: text.casefold() for key, text in wanted.items() if text is not None}
        found = [
            one
            for one in self.products
            if all(str(getattr(one, key)).casefold() == text for key, text in words.items())
            and (least is None or least <= one.rating_for_100_km < math.inf)
            and (longest is None or (one.body_length or math.inf) <= longest)
        ]
        return tuple(sorted(found, key=lambda one: one.rating_for_100_km))

    def remarks(self) -> Iterator[str]:
        """What a reader of the catalogue should know: records without page, rating or law, unverified values."""
        for key in ("page", "dynamic", "static", "preload_classes"):
            if names := [product.name for product in self.products if not getattr(product, key)]:
                yield f"no {key}: {first_names(names)}"
        if names := [product.name for product in self.products if product.unverified]:
            yield f"values not compared with the source: {first_names(names)}"
