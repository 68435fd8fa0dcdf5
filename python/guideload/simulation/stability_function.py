"""Stability functions: R(z), by which one step of a method multiplies a motion that decays or rings.

Of q' = λ q a step of length h makes R(h λ) q, where the exact factor is exp(h λ). Each mode of a linear scene moves
like that, with its eigenvalue λ. A method is stable where |R| <= 1; exact has R = exp and no step error.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.polynomial.polynomial import polyroots, polyval
from numpy.typing import ArrayLike, NDArray

from guideload.base.arrays import Array

Complex = NDArray[np.complex128]
MethodName = Literal["exact", "rk45", "implicit"]

# Dormand and Prince's result of order 5 by ascending powers of z: the series of exp up to z^5, and then 1/600.
RK45 = np.array([1.0, 1.0, 1.0 / 2.0, 1.0 / 6.0, 1.0 / 24.0, 1.0 / 120.0, 1.0 / 600.0])
# Radau IIA with five stages: the Padé approximation of exp with degrees 4 and 5 (Hairer & Wanner, IV.3 and IV.5).
IMPLICIT_ABOVE = np.array([1.0, 4.0 / 9.0, 1.0 / 12.0, 1.0 / 126.0, 1.0 / 3024.0])
IMPLICIT_BELOW = np.array([1.0, -5.0 / 9.0, 5.0 / 36.0, -5.0 / 252.0, 5.0 / 3024.0, -1.0 / 15120.0])

# Real parts up to this part of |λ| are rounding. Springs and dampers feed no motion, so no real part is above zero.
UNDAMPED = 1e-12


def amplification(method: MethodName, z: ArrayLike) -> Complex:
    """R(z) of a method, of the shape of z = h λ; z: complex, without unit."""
    z = np.asarray(z, dtype=np.complex128)
    if method == "exact":
        return np.asarray(np.exp(z))
    if method == "rk45":
        return np.asarray(polyval(z, RK45))
    return np.asarray(polyval(z, IMPLICIT_ABOVE) / polyval(z, IMPLICIT_BELOW))


def longest_stable_steps(eigenvalues: ArrayLike) -> Array:
    """Step of rk45 up to which every step is stable, s, for each eigenvalue, (m,) 1/s; inf for zero.

    |R(ρ e^(iθ))|² - 1 is a polynomial in ρ = h |λ|, of which this is the first zero; in the left half plane no
    longer step is stable again. Raises ValueError for a real part above zero.
    """
    values = np.atleast_1d(np.asarray(eigenvalues, dtype=np.complex128))
    return np.array([_limit(value) for value in values])


def _limit(value: complex) -> float:
    size = abs(value)
    if size == 0.0:
        return np.inf
    decay = -value.real / size  # -cos θ
    if decay < -UNDAMPED:
        raise ValueError(f"expected an eigenvalue of a passive scene, real part <= 0, got {value:g} 1/s")
    decay = 0.0 if decay <= UNDAMPED else decay
    angle = np.pi - np.arccos(min(decay, 1.0))
    terms = RK45 * np.exp(1j * angle * np.arange(RK45.size))
    squared = np.convolve(terms, terms.conj()).real
    # Up to the order of the method these are the series of exp(-2 decay ρ), here without the rounding of the sums.
    for power in range(6):
        squared[power] = squared[power - 1] * -2.0 * decay / power if power else 1.0
    squared[0] = 0.0
    lowest = int(np.flatnonzero(squared)[0])
    roots = polyroots(squared[lowest:])
    real = roots.real[(np.abs(roots.imag) <= 1e-9 * np.abs(roots)) & (roots.real > 0.0)]
    return float(real.min()) / size


def per_period(method: MethodName, steps: float, damping_ratio: float = 0.0) -> tuple[float, float]:
    """Error of a method over one period of a mode: amplitude lost and phase gained.

    steps         per period of the damped vibration
    damping_ratio below 1

    Returns the part of the amplitude that is lost (below 0: gained), and the phase in rad by which it leads.
    """
    turn = 2.0 * np.pi / steps
    z = complex(-turn * damping_ratio / np.sqrt(1.0 - damping_ratio**2), turn)
    ratio = steps * np.log(amplification(method, z) / np.exp(z))
    return float(-np.expm1(ratio.real)), float(ratio.imag)
