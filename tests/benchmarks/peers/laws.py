"""Elastic laws of the links as formulas, written once for NumPy, Numba and JAX."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Sided:
    """F = k+ (d - c)+ - k- (-d - c)+: a dead band of c to either side, each side its own stiffness."""

    positive: float  # N/m
    negative: float
    clearance: float  # m


@dataclass(frozen=True)
class Preloaded:
    """F = K [(d0 + d)+^(3/2) - (d0 - d)+^(3/2)], d0 = 3 F0/k0, K = F0/d0^(3/2): balls under preload."""

    stiffness: float  # k0, N/m
    preload: float  # F0, N

    @property
    def opening(self) -> float:
        """d0, the deflection at which one row opens, m."""
        return 3.0 * self.preload / self.stiffness

    @property
    def factor(self) -> float:
        """K, N/m^(3/2)."""
        return float(self.preload / self.opening**1.5)


Law = Sided | Preloaded
Formula = Callable[[Any], Any]


def force(law: Law, of: Any = np) -> Formula:
    """F over the deflection, with `maximum` and `sqrt` of NumPy or JAX; Numba compiles it for single numbers."""
    if isinstance(law, Sided):
        positive, negative, clearance = law.positive, law.negative, law.clearance

        def sided(d: Any) -> Any:
            return positive * of.maximum(d - clearance, 0.0) - negative * of.maximum(-d - clearance, 0.0)

        return sided
    opening, factor = law.opening, law.factor

    def preloaded(d: Any) -> Any:
        one, other = of.maximum(opening + d, 0.0), of.maximum(opening - d, 0.0)
        return factor * (one * of.sqrt(one) - other * of.sqrt(other))

    return preloaded


def tangent(law: Law) -> Formula:
    """dF/dd."""
    if isinstance(law, Sided):
        return lambda d: law.positive * (d > law.clearance) + law.negative * (d < -law.clearance)
    opening, factor = law.opening, 1.5 * law.factor
    return lambda d: factor * (np.sqrt(np.maximum(opening + d, 0.0)) + np.sqrt(np.maximum(opening - d, 0.0)))


def diffsl(law: Law, d: str) -> str:
    """F in the language of diffsol, of a tensor named `d`."""
    if isinstance(law, Sided):
        return (
            f"{law.positive!r} * max({d} - {law.clearance!r}, 0.0)"
            f" - {law.negative!r} * max(-{d} - {law.clearance!r}, 0.0)"
        )
    one, other = f"max({law.opening!r} + {d}, 0.0)", f"max({law.opening!r} - {d}, 0.0)"
    return f"{law.factor!r} * ({one} * sqrt({one}) - {other} * sqrt({other}))"
