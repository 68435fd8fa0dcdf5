"""Load-deflection curves: points of deflection and force, between which the law is linear."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from guideload.base.config import in_range, listed
from guideload.base.errors import ValueRefused
from guideload.base.ranges import DEFLECTION, FORCE, STIFFNESS

CurvePoints = tuple[tuple[float, float], ...]  # deflection [m], force [N]
CurvePoint = Annotated[
    tuple[Annotated[float, in_range(DEFLECTION)], Annotated[float, in_range(FORCE)]],
    listed("deflection", "force"),
]
MOST_POINTS = 16  # that the core takes for a curve
ROUNDING = 1e-12  # relative to the largest force of a curve: rounding of the force interpolated at 0 m


def through_zero(points: CurvePoints) -> CurvePoints:
    """Check that a curve rises through [0, 0], or starts there, where only positive deflections are given."""

    def refusal(expected: str, hint: str) -> ValueRefused:
        return ValueRefused(expected, points, hint)

    half = points[:1] == ((0.0, 0.0),)
    most = (MOST_POINTS + 1) // 2 if half else MOST_POINTS
    if not 2 <= len(points) <= most:
        mirrored = "; one that begins at [0, 0] is mirrored, which doubles its points" if half else ""
        raise refusal(f"2 to {most} points [deflection, force]", f"these are {len(points)}{mirrored}")
    deflection, force = np.array(points).T
    for values, unit, expected, wrong in (
        (deflection, "m", "deflections in ascending order, each once", np.diff(deflection) <= 0.0),
        (force, "N", "forces that never fall as the deflection grows", np.diff(force) < 0.0),
    ):
        if wrong.any():
            i = int(wrong.argmax())
            raise refusal(expected, f"[{i}] and [{i + 1}] have {values[i]:g} and {values[i + 1]:g} {unit}")
    if deflection[0] > 0.0 or deflection[-1] <= 0.0:
        reach = f"it reaches from {deflection[0]:g} to {deflection[-1]:g} m"
        way_out = "add the points of the other direction; a curve that begins at [0, 0] holds for both"
        raise refusal("points on both sides of 0 m", f"{reach}: {way_out}")
    at_zero = float(np.interp(0.0, deflection, force))
    if abs(at_zero) > ROUNDING * np.abs(force).max():
        hint = f"its force at 0 m is {at_zero:g} N: count deflections from no load"
        raise refusal("a curve through [0, 0]", hint)
    slope = np.diff(force) / np.diff(deflection)
    if slope.max() > STIFFNESS.most:
        i = int(slope.argmax())
        hint = f"from [{i}] to [{i + 1}] it is {slope[i]:g} N/m: draw the points apart"
        raise refusal(f"a slope up to {STIFFNESS.most:g} N/m", hint)
    if force[0] == force[-1]:
        raise refusal("forces that rise somewhere", "this curve never resists")
    return points


def from_zero(points: CurvePoints) -> CurvePoints:
    """Check that a curve starts at [0, 0] and rises."""
    if points[:1] != ((0.0, 0.0),):
        raise ValueRefused("points from [0, 0] on", points, "deflection and force > 0")
    return through_zero(points)
