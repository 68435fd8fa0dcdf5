"""The packaged catalogues: a file per maker, whose products are found by name.

All records take 75 ms to read. A name needs only its own, 4 ms: in these files the first keys of a record are `name`,
`maker` and `edition`.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from pathlib import Path

from guideload.base.arguments import checked
from guideload.base.errors import ValueRefused
from guideload.catalogue.catalogue import Catalogue, has_words
from guideload.catalogue.product import Product

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

FOLDER = Path(__file__).resolve().parents[1] / "catalogues"
HEAD = "".join(rf'{key} = "(?P<{key}>.+)"\n' for key in ("name", "maker", "edition"))
MOST_NAMES = 12  # of products in an error
ONE_OF_SEVERAL = "one packaged product"  # what is expected in place of a name that several records have
RECORD = re.compile(rf"^\[\[products\]\]\n{HEAD}", re.MULTILINE)


@dataclass(frozen=True)
class Record:
    """A product of the packaged catalogues that was not read yet."""

    name: str
    maker: str
    edition: str
    text: str  # its table in TOML

    @property
    def full_name(self) -> str:
        """Maker, name and edition, which select it among records of one name."""
        return f"{self.maker} {self.name} {self.edition}"

    def is_called(self, words: Sequence[str]) -> bool:
        """Whether its maker, its name and a part of its edition are these words, in this order."""
        begins = [*self.maker.split(), *self.name.split()]
        edition = self.edition.split()
        return list(words[: len(begins)]) == begins and all(word in edition for word in words[len(begins) :])

    def product(self, name: str) -> Product:
        """The product, under the name by which it was asked for."""
        return product_of(self.text, name)


@cache
def product_of(text: str, name: str) -> Product:
    """The product of a table in TOML; it takes a millisecond, and there are hundreds."""
    return Product(**{**tomllib.loads(text)["products"][0], "name": name})


@cache
def records() -> tuple[Record, ...]:
    """All records, in the order of the files."""
    found = []
    for file in sorted(FOLDER.glob("*.toml")):
        text = file.read_text(encoding="utf-8")
        starts = list(RECORD.finditer(text))
        ends = [*(match.start() for match in starts[1:]), len(text)]
        for match, end in zip(starts, ends, strict=True):
            found.append(Record(**match.groupdict(), text=text[match.start() : end]))
    return tuple(found)


def is_packaged(name: str) -> bool:
    """Whether `packaged_product` knows this name."""
    return len(_called(name)) == 1


def _called(name: str) -> list[Record]:
    words = name.split()
    return [one for one in records() if one.name == name or one.is_called(words)]


@checked
def packaged_product(name: str) -> Product:
    """The packaged product of a name.

    Parameters
    ----------
    name : str
        "HGH25CA", "HIWIN HGH25CA", or with words of its edition behind.

    Raises
    ------
    ValueRefused
        For an unknown name, with the names that have its words, else the nearest ones; and for a name that several
        records have, with them.
    """
    found = _called(name)
    if len(found) == 1:
        return found[0].product(name)
    if found:
        first = found[0]
        listed = ", ".join(f'"{one.full_name}"' for one in found)
        hint = f"several have it: {listed}; write the maker before and a word of the edition behind"
        raise ValueRefused(ONE_OF_SEVERAL, name, f'{hint}, as in "{first.full_name}"')
    raise ValueRefused("a packaged product", name, _way_out(name))


def _way_out(name: str) -> str:
    """What to write instead of an unknown name: a product that has its words, else the nearest."""
    names = {one.name.casefold(): one.name for one in records()}
    worded = dict.fromkeys(one.name for one in records() if has_words(name, one.maker, one.name))
    near = list(worded) or [names[one] for one in get_close_matches(name.casefold(), names, n=3, cutoff=0.8)]
    if not near:
        return "`guideload catalogue list` shows what is packaged; for another, name a catalogue file"
    quoted = [f'"{one}"' for one in near[:MOST_NAMES]]
    if len(near) > MOST_NAMES:
        quoted.append(f"one of {len(near) - MOST_NAMES} more")
    return f"did you mean {' or '.join(quoted)}?"


def product_and_class(text: str) -> tuple[Product, str | None]:
    """The packaged product and preload class of a text such as "HGH25CA ZA"; a single class may be left out.

    Raises ValueRefused.
    """
    name, _, kind = (text, "", "") if is_packaged(text) else text.rpartition(" ")
    product = packaged_product(name or text)
    if not kind and len(product.preload_classes) > 1:
        classes = ", ".join(one.name for one in product.preload_classes)
        example = f'"{product.name} {product.preload_classes[0].name}"'
        raise ValueRefused(f"a product with its preload class ({classes})", text, f"write {example}")
    found = product.class_named(kind or None)
    return product, None if found is None else found.name


def only_maker(texts: Sequence[str]) -> str | None:
    """The maker that is a word of every text, so that the records of others need not be read; None if there is none."""
    words = [set(text.casefold().split()) for text in texts]
    named = [
        name
        for name in {one.maker for one in records()}
        if words and all(name.casefold() in w for w in words)
    ]
    return named[0] if len(named) == 1 else None


@checked
def packaged_catalogue(maker: str | None = None) -> Catalogue:
    """All packaged products, by unique names.

    Parameters
    ----------
    maker : str, optional
        Only the products of this maker.

    Raises
    ------
    ValueRefused
        For an unknown maker.
    """
    makers = {one.maker.lower(): one.maker for one in records()}
    if maker is not None and maker.lower() not in makers:
        raise ValueRefused(f"a maker of packaged products ({', '.join(makers.values())})", maker)
    names = [one.name for one in records()]
    return Catalogue(
        products=tuple(
            one.product(one.name if names.count(one.name) == 1 else one.full_name)
            for one in records()
            if maker is None or one.maker.lower() == maker.lower()
        )
    )
