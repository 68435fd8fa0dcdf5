"""No result has a number that is not finite: the one check of JSON, of arrays in files, and of tables of reports."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from guideload.base.errors import NotFinite

if TYPE_CHECKING:
    import pandas as pd


def finite_json(content: Any, *, indent: int | None = None, ascii_only: bool = True) -> str:
    """JSON text of dicts, lists, texts and finite numbers. No value is None.

    Raises NotFinite with the place of a number that is not finite, which JSON does not have.
    """
    try:
        return json.dumps(content, indent=indent, ensure_ascii=ascii_only, allow_nan=False)
    except ValueError:
        for place, value in _numbers("", content):
            if not math.isfinite(value):
                raise NotFinite(place, value) from None
        raise


def require_finite(name: str, values: Any) -> None:
    """Raise NotFinite if an array (or a number) of a result is not finite."""
    array = np.asarray(values)
    if array.dtype.kind in "fc" and not (finite := np.isfinite(array)).all():
        raise NotFinite(name, array[~finite].flat[0] if array.ndim else array[()])


def require_finite_table(table: pd.DataFrame, optional: Iterable[str] = ()) -> None:
    """Raise NotFinite if a column of numbers is not finite. optional: columns in which nan stands for an empty cell."""
    for name, column in table.items():
        if column.dtype.kind == "f":
            values = column.to_numpy(np.float64)
            require_finite(str(name), values[~np.isnan(values)] if name in set(optional) else values)


def _numbers(place: str, content: Any) -> Iterator[tuple[str, float]]:
    """All floats in dicts and lists, with the keys and indices that lead to them."""
    if isinstance(content, float):
        yield place, content
    elif isinstance(content, Mapping):
        for key, value in content.items():
            yield from _numbers(f"{place}.{key}" if place else str(key), value)
    elif isinstance(content, list | tuple):
        for i, value in enumerate(content):
            yield from _numbers(f"{place}[{i}]", value)
