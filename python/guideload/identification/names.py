"""Names and units of identified numbers, as reports and comments show them."""

from __future__ import annotations

import re
from collections.abc import Sequence

from guideload.base.number_text import joined

USUAL = {"N/m": ("N/um", 1e-6), "N s/m": ("kN s/m", 1e-3), "m": ("mm", 1e3)}
OF_PART = re.compile(r'(\w+)\["?([^\]"]+)"?\]\.(.+)')


def usual_unit(unit: str) -> tuple[str, float]:
    """The unit in which machine files state a quantity, and the factor from SI to it."""
    return USUAL.get(unit, (unit, 1.0))


def short(name: str) -> str:
    """`1a stiffness_y` from "carriages[1a].stiffness_y"; other names as they are."""
    part = OF_PART.fullmatch(name)
    return f"{part[2]} {part[3]}" if part else name


def together(names: Sequence[str]) -> str:
    """`stiffness_y of carriages 1a and 1b` from "carriages[1a].stiffness_y" and "carriages[1b].stiffness_y"."""
    groups: dict[tuple[str, str], list[str]] = {}
    for name in names:
        part = OF_PART.fullmatch(name)
        groups.setdefault((part[1], part[3]) if part else ("", name), []).append(part[2] if part else name)
    return joined(
        f"{key} of {kind if len(parts) > 1 else kind.removesuffix('s')} {joined(parts)}" if kind else key
        for (kind, key), parts in groups.items()
    )
