"""Stiffness of a carriage whose catalogue prints none, from the mechanics of its contacts.

A radial load rests on the contacts of two rows at 45 degrees. In each row as many balls as fit into its length L carry
the same load Q: Z = L/D. The static rating C0 loads each ball by the Q0 = q D^2 that presses steel by 4200 MPa
(ISO 14728-2), the preload F0 by Q0 F0/C0. Hertz gives the approach of a ball in its two contacts together,
c Q^(2/3) D^(-1/3). Of the two preloaded pairs of rows together the diameter D cancels:

    k = kappa L (F0/C0)^(1/3),  kappa = 3 q^(1/3)/c  (rollers: exponent 1/10, line contact),

which is k ~ Z^(2/3) D^(1/3) F0^(1/3) with the D and Z that C0 and L have. Measured values and their scatter are in the
validation page.
"""

from __future__ import annotations

import math
from typing import NamedTuple

# Exponent n of F ~ deflection^n of one row: Hertz point contact; line contact by the rolling bearing standards.
CONTACT_EXPONENT = {"ball": 3.0 / 2.0, "roller": 10.0 / 9.0}
# kappa [N/m per m of row]. Balls: Hertz gives 25.4e9 for grooves of 0.53 D and a row as long as the body; 24e9 has the
# least largest error over the printed values. Rollers: line contact alone gives 50e9 (Palmgren); that the legs of the
# carriage, in series, leave a third is assumed: no printed value of a roller carriage was at hand.
PER_LENGTH = {"ball": 24e9, "roller": 17e9}
# Least preload over C0: makers print a stiffness for classes without preload as well, that of a carriage under a
# small load. A half percent of C, which is 0.35 % of C0, gives those of miniature carriages.
LEAST_SHARE = 0.0035
# The 90 % interval is from stiffness/factor to stiffness times factor.
FACTOR = 1.3  # of ball carriages whose preload is known
# Of rollers, and of a class that begins at no preload, for which two editions print values that differ so much.
FACTOR_UNKNOWN = 2.0


class StiffnessEstimate(NamedTuple):
    """An estimated stiffness of a carriage along y and z, without outer load."""

    stiffness: float  # N/m
    factor: float  # the 90 % interval is from stiffness/factor to stiffness times factor

    @property
    def words(self) -> str:
        """`estimated, within 30 %`."""
        if self.factor >= 2.0:
            return f"estimated, within a factor of {self.factor:g}"
        return f"estimated, within {100.0 * (self.factor - 1.0):.0f} %"

    @property
    def sigma(self) -> float:
        """Standard deviation of the logarithm of the lognormal distribution with this interval."""
        return math.log(self.factor) / 1.6449  # quantile of 95 % of the standard normal distribution


def estimated_stiffness(
    kind: str, static: float, length: float, preload: tuple[float, float]
) -> StiffnessEstimate:
    """The stiffness of a carriage.

    Parameters
    ----------
    kind : str
        "ball" or "roller".
    static : float
        Static load rating C0 [N].
    length : float
        Length of the loaded rows [m].
    preload : (float, float)
        Least and largest preload of its class [N].
    """
    share = max(0.5 * sum(preload) / static, LEAST_SHARE)
    stiffness = PER_LENGTH[kind] * length * share ** (1.0 - 1.0 / CONTACT_EXPONENT[kind])
    known = kind == "ball" and preload[0] > 0.0
    return StiffnessEstimate(stiffness, FACTOR if known else FACTOR_UNKNOWN)


def preload_of_interference(kind: str, static: float, length: float, interference: float) -> float:
    """The preload [N] of a carriage whose radial clearance is negative, -`interference` [m]; 0 for a clearance.

    Each pair of rows is pressed by half of it, d0: F0 = k d0/(2 n), with the k above that F0 gives.
    """
    if interference <= 0.0:
        return 0.0
    n, half = CONTACT_EXPONENT[kind], 0.5 * interference
    stiffness = (PER_LENGTH[kind] * length) ** n * (half / (2.0 * n * static)) ** (n - 1.0)
    return float(stiffness * half / (2.0 * n))


def row_length_of_moment(kind: str, static: float, pitch_moment: float) -> float:
    """Length [m] of the rows that bear C0 and the static pitch moment M0 at the same load of the element most loaded.

    Under a tilt the deflection grows linearly from the middle, and the load with its n-th power: M0 = C0 L/(2 (n + 2)).
    """
    return 2.0 * (CONTACT_EXPONENT[kind] + 2.0) * pitch_moment / static
