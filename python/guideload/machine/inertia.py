"""Inertia tensors: about another point, and whether a body can have them."""

from __future__ import annotations

import numpy as np

from guideload.base.arrays import Array
from guideload.base.errors import ValueRefused
from guideload.base.ranges import SMALLEST_MOMENT

# Tolerance relative to the largest entry: CAD systems print six digits, so entries are rounded by up to 5e-6, and the
# tensor of a flat plate is on the limit of the triangle rule.
PRINTED_DIGITS = 1e-5
# Tolerance relative to the largest entry: rounding where a tensor is shifted to another point.
ROUNDING = 1e-12


def central(inertia: Array, mass: float, center: tuple[float, float, float], about: str) -> Array:
    """The inertia tensor about the centre of mass, of one about it or about L."""
    return inertia if about == "center_of_mass" else inertia - point_inertia(mass, np.array(center))


def point_inertia(mass: float, r: Array) -> Array:
    """Inertia tensor (3, 3) [kg m^2] of a point mass at r (3,) [m] (Steiner)."""
    return np.asarray(mass * (r @ r * np.eye(3) - np.outer(r, r)))


def require_physical(about_center: Array, rows: object, scale: float) -> None:
    """Raise ValueRefused unless each principal moment is positive and at most the sum of the other two."""
    small, middle, large = (float(moment) for moment in np.linalg.eigvalsh(about_center))
    found = f"principal moments about the centre of mass are {small:g}, {middle:g}, {large:g} kg m^2"
    way_out = "check inertia_about, the units and the signs (entries of the tensor: Jxy = -sum m x y)"
    if small <= ROUNDING * scale:
        raise ValueRefused(
            "a positive definite tensor", rows, f"its {found}: the smallest is not above 0; {way_out}"
        )
    if small < SMALLEST_MOMENT:
        least = f"principal moments of at least {SMALLEST_MOMENT:g} kg m^2"
        raise ValueRefused(least, rows, f"its {found}; {way_out}")
    excess = large - (small + middle)
    if excess > PRINTED_DIGITS * scale:
        raise ValueRefused(
            "a tensor that a body can have (triangle rule: no principal moment above the sum of the others)",
            rows,
            f"its {found}: the largest is {excess:g} kg m^2 too large, {excess / large:.2%} of it; {way_out}",
        )
