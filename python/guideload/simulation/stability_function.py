"""The stability function R(z) of each method: the factor by which a step multiplies a mode.

A mode of a linear scene obeys q' = λ q with its eigenvalue λ. A step of length h multiplies q by R(h λ), the exact
solution by exp(h λ). A method is stable where |R| <= 1; exact has R = exp and no step error.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.polynomial.polynomial import polyroots, polyval
from numpy.typing import ArrayLike, NDArray

from guideload.base.arrays import Array

MethodName = Literal["exact", "rk45", "implicit"]

# Dormand-Prince, order 5, in ascending powers of z: the series of exp up to z^5, then 1/600.
RK45 = np.array([1.0, 1.0, 1.0 / 2.0, 1.0 / 6.0, 1.0 / 24.0, 1.0 / 120.0, 1.0 / 600.0])
# Radau IIA with five stages: the Padé approximation of exp with degrees 4 and 5 (Hairer & Wanner, IV.3 and IV.5).
IMPLICIT_NUMERATOR = np.array([1.0, 4.0 / 9.0, 1.0 / 12.0, 1.0 / 126.0, 1.0 / 3024.0])
IMPLICIT_DENOMINATOR = np.array([1.0, -5.0 / 9.0, 5.0 / 36.0, -5.0 / 252.0, 5.0 / 3024.0, -1.0 / 15120.0])

# Real parts below this times |λ| are rounding. None is positive, because springs and dampers are passive.
UNDAMPED = 1e-12


def stability_function(method: MethodName, z: ArrayLike) -> NDArray[np.complex128]:
    """R(z) of a method, for an array z = h λ of complex numbers [1]."""
    z = np.asarray(z, dtype=np.complex128)
    if method == "exact":
        return np.asarray(np.exp(z))
    if method == "rk45":
        return np.asarray(polyval(z, RK45))
    return np.asarray(polyval(z, IMPLICIT_NUMERATOR) / polyval(z, IMPLICIT_DENOMINATOR))


def longest_stable_steps(eigenvalues: ArrayLike) -> Array:
    """The longest stable steps (m,) [s] of rk45 for eigenvalues (m,) [1/s]; inf for an eigenvalue of zero.

    |R(ρ e^(iθ))|² - 1 is a polynomial in ρ = h |λ|; its first positive zero is the longest stable step, as in the left
    half plane no longer step is stable. Raises ValueError for a real part above zero.
    """
    values = np.atleast_1d(np.asarray(eigenvalues, dtype=np.complex128))
    return np.array([_longest_stable_step(value) for value in values])


def _longest_stable_step(value: complex) -> float:
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
    # Up to the order of the method these are the terms of exp(-2 decay ρ), here without the rounding of the sums.
    for power in range(6):
        squared[power] = squared[power - 1] * -2.0 * decay / power if power else 1.0
    squared[0] = 0.0
    lowest = int(np.flatnonzero(squared)[0])
    roots = polyroots(squared[lowest:])
    real = roots.real[(np.abs(roots.imag) <= 1e-9 * np.abs(roots)) & (roots.real > 0.0)]
    return float(real.min()) / size


def error_per_period(method: MethodName, steps: float, damping_ratio: float = 0.0) -> tuple[float, float]:
    """Numerical damping and phase error of a method over one period of a mode.

    steps          per period of the damped vibration
    damping_ratio  of the mode, below 1

    Returns the relative loss of amplitude (negative: gain) and the phase lead [rad] against the exact solution.
    """
    turn = 2.0 * np.pi / steps
    z = complex(-turn * damping_ratio / np.sqrt(1.0 - damping_ratio**2), turn)
    ratio = steps * np.log(stability_function(method, z) / np.exp(z))
    return float(-np.expm1(ratio.real)), float(ratio.imag)
