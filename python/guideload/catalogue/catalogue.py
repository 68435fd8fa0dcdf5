"""A catalogue file: the products that machines may name."""

from __future__ import annotations

from collections.abc import Iterator
from os import PathLike

from pydantic import Field, field_validator

from guideload.base.arguments import checked
from guideload.base.config import ConfigModel
from guideload.base.errors import ConfigError, ValueRefused
from guideload.base.toml import located, read_toml
from guideload.catalogue.product import Product, product_by_name


class Catalogue(ConfigModel):
    """A catalogue of carriages. Raises ConfigError with all problems at once."""

    products: tuple[Product, ...] = Field(min_length=1, description="one [[products]] table per product")

    @classmethod
    @checked
    def from_toml(cls, file: str | PathLike[str]) -> Catalogue:
        """The catalogue of a TOML file. Raises ConfigError naming file, row, key and value."""
        values, places = read_toml(file, "`guideload init --catalogue` writes one")
        try:
            return cls(**values)
        except ConfigError as error:
            raise located(error, str(file), places) from None

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
        return product_by_name({product.name: product for product in self.products}, name, "the catalogue")

    def remarks(self) -> Iterator[str]:
        """What a reader of the catalogue should know: records without page, rating or law, unverified values."""
        for product in self.products:
            missing = [
                key for key in ("page", "dynamic", "static", "preload_classes") if not getattr(product, key)
            ]
            if missing:
                yield f"{product.name}: no {', '.join(missing)}"
            if product.unverified:
                yield f"{product.name}: not compared with the source: {', '.join(product.unverified)}"
