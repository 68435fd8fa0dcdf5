"""The integration methods: what `auto`, the command line, bands, audit and charts know of each.

A new method is a name and a row here, and in the core a file, a line in `integrate/mod.rs` and a row in
`integrate/named_method.rs`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

Method = Literal["auto", "exact", "exponential", "rk45", "implicit"]


@dataclass(frozen=True)
class Integrator:
    """Properties of an integration method.

    numerator, denominator  coefficients of the stability function R(z), in ascending powers of z; none: R = exp
    exact_if_linear         no step error between contact changes where no contact is preloaded
    with_edges              whether it also runs preloaded contacts beside clearance, sides or curves; none: it runs no
                            preloaded contacts at all
    locates_changes         contact changes are located between the samples, not counted from step to step
    cost                    time of a step on preloaded contacts over that of a step of rk45, about
    rk45_steps_to_check     steps of rk45 per step of a result up to which the audit solves it again by rk45, instead of
                            by implicit
    color, marker           in charts
    """

    exact_if_linear: bool
    with_edges: bool | None
    locates_changes: bool
    cost: float
    color: str
    marker: str
    rk45_steps_to_check: float = 0.0
    numerator: tuple[float, ...] | None = None
    denominator: tuple[float, ...] = (1.0,)


METHODS: dict[str, Integrator] = {
    "exact": Integrator(
        exact_if_linear=True, with_edges=None, locates_changes=True, cost=1.0, color="#009E73", marker="D"
    ),
    # Exponential collocation of order 4; steps of preloaded contacts cost half of those of rk45.
    "exponential": Integrator(
        exact_if_linear=True,
        with_edges=False,
        locates_changes=False,
        cost=0.5,
        color="#CC79A7",
        marker="^",
        rk45_steps_to_check=1.0,
    ),
    # Dormand-Prince, order 5: the series of exp up to z^5, then 1/600.
    "rk45": Integrator(
        exact_if_linear=False,
        with_edges=True,
        locates_changes=True,
        cost=1.0,
        color="#D55E00",
        marker="s",
        numerator=(1.0, 1.0, 1.0 / 2.0, 1.0 / 6.0, 1.0 / 24.0, 1.0 / 120.0, 1.0 / 600.0),
    ),
    # Radau IIA with five stages: the Padé approximation of exp with degrees 4 and 5 (Hairer & Wanner, IV.3 and IV.5).
    "implicit": Integrator(
        exact_if_linear=False,
        with_edges=True,
        locates_changes=True,
        cost=4.0,
        color="#0072B2",
        marker="o",
        rk45_steps_to_check=20.0,
        numerator=(1.0, 4.0 / 9.0, 1.0 / 12.0, 1.0 / 126.0, 1.0 / 3024.0),
        denominator=(1.0, -5.0 / 9.0, 5.0 / 36.0, -5.0 / 252.0, 5.0 / 3024.0, -1.0 / 15120.0),
    ),
}
CHOICES: tuple[Method, ...] = get_args(Method)
