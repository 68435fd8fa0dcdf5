"""The elastic base under all links of a machine."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import Field, field_validator

from guideload.base.config import ConfigModel, in_range, listed
from guideload.base.errors import ValueRefused
from guideload.base.ranges import ENTRY

LEAST = 1e-30  # of a diagonal entry other than 0: far below the inverse of any stiffness
ROUNDING = 1e-6  # relative to the diagonal: six printed digits of a finite element program

Number = Annotated[float, in_range(ENTRY)]
DIRECTIONS = ("ux", "uy", "uz", "rx", "ry", "rz")
Row = Annotated[tuple[Number, Number, Number, Number, Number, Number], listed(*DIRECTIONS)]
Compliance = Annotated[tuple[Row, Row, Row, Row, Row, Row], listed(*(f"row {name}" for name in DIRECTIONS))]


class Base(ConfigModel):
    """A base that gives way under the loads of all links together."""

    compliance: Compliance = Field(
        description="6 x 6 in SI: displacement [m] and rotation [rad] at L by a force [N] and a moment [N m] about L"
    )

    @field_validator("compliance")
    @classmethod
    def _possible(cls, rows: Any) -> Any:
        """Check symmetry and definiteness; return the exactly symmetric matrix."""
        matrix = np.array(rows)
        size = np.abs(np.diag(matrix))
        scale = 1.0 / np.sqrt(np.where(size > LEAST, size, max(np.abs(matrix).max(), LEAST)))
        scaled = scale[:, None] * matrix * scale
        skew = np.abs(scaled - scaled.T)
        if skew.max() > ROUNDING:
            i, j = (int(k) for k in np.unravel_index(skew.argmax(), skew.shape))
            found = f"[{i}][{j}] and [{j}][{i}] are {matrix[i, j]:g} and {matrix[j, i]:g}"
            raise ValueRefused("a symmetric matrix", rows, found)
        smallest = float(np.linalg.eigvalsh(0.5 * (scaled + scaled.T))[0])
        if smallest < -ROUNDING:
            hint = f"with a diagonal of ones its smallest eigenvalue is {smallest:.3g}: it would give energy"
            raise ValueRefused("a positive semidefinite matrix", rows, hint)
        return tuple(map(tuple, (0.5 * (matrix + matrix.T)).tolist()))
