"""The stability function R(z) of each method: the factor by which a step multiplies a mode.

A mode of a linear scene obeys q' = λ q with its eigenvalue λ. A step of length h multiplies q by R(h λ), the exact
solution by exp(h λ). A method is stable where |R| <= 1; exact and exponential have R = exp and no step error.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial.polynomial import polyval
from numpy.typing import ArrayLike

from guideload.base.arrays import Array, Complex
from guideload.base.methods import METHODS

RK45 = np.array(METHODS["rk45"].numerator)

# Real parts below this times |λ| are rounding. None is positive, because springs and dampers are passive.
UNDAMPED = 1e-12


def stability_function(method: str, z: ArrayLike) -> Complex:
    """R(z) of a method, for an array z = h λ of complex numbers [1]."""
    z = np.asarray(z, dtype=np.complex128)
    of = METHODS[method]
    if of.numerator is None:
        return np.asarray(np.exp(z))
    return np.asarray(polyval(z, of.numerator) / polyval(z, of.denominator))


def longest_stable_steps(eigenvalues: ArrayLike) -> Array:
    """The longest stable steps (m,) [s] of rk45 for eigenvalues (m,) [1/s]; inf for an eigenvalue of zero.

    |R(ρ e^(iθ))|² - 1 is a polynomial in ρ = h |λ|; its first positive zero is the longest stable step, as in the left
    half plane no longer step is stable. Raises ValueError for a real part above zero.
    """
    values = np.atleast_1d(np.asarray(eigenvalues, dtype=np.complex128))
    longest, moving = np.full(values.shape, np.inf), values != 0.0
    sizes = np.abs(values[moving])
    decays = -values[moving].real / sizes  # -cos θ
    if np.any(decays < -UNDAMPED):
        value = values[moving][decays.argmin()]
        raise ValueError(f"expected an eigenvalue of a passive scene, real part <= 0, got {value:g} 1/s")
    decays = np.minimum(np.where(decays <= UNDAMPED, 0.0, decays), 1.0)
    turned = np.exp(1j * np.multiply.outer(np.pi - np.arccos(decays), np.arange(RK45.size)))
    squared = np.array([np.convolve(one, one.conj()).real for one in RK45 * turned]).reshape(sizes.size, -1)
    # Up to the order of the method these are the terms of exp(-2 decay ρ), here without the rounding of the sums.
    squared[:, 0] = 1.0
    for power in range(1, 6):
        squared[:, power] = squared[:, power - 1] * -2.0 * decays / power
    found = np.empty(sizes.shape)
    for undamped in (False, True):  # then the first five powers have no share
        rows = (decays == 0.0) == undamped
        found[rows] = _first_positive_zero(squared[rows, 6 if undamped else 1 :])
    longest[moving] = found / sizes
    return longest


def _first_positive_zero(coefficients: Array) -> Array:
    """The first positive zero of polynomials (m, n) in ascending powers: eigenvalues of their companion matrices."""
    order = coefficients.shape[1] - 1
    companions = np.zeros((len(coefficients), order, order))
    companions[:, 1:, :-1] = np.eye(order - 1)
    companions[:, :, -1] = -coefficients[:, :-1] / coefficients[:, -1:]
    zeros = np.linalg.eigvals(companions[:, ::-1, ::-1])  # in this order they are more accurate
    real = (np.abs(zeros.imag) <= 1e-9 * np.abs(zeros)) & (zeros.real > 0.0)
    return np.asarray(np.min(zeros.real, axis=1, where=real, initial=np.inf))


def error_per_period(method: str, steps: float, damping_ratio: float = 0.0) -> tuple[float, float]:
    """Numerical damping and phase error of a method over one period of a mode.

    steps          per period of the damped vibration
    damping_ratio  of the mode, below 1

    Returns the relative loss of amplitude (negative: gain) and the phase lead [rad] against the exact solution.
    """
    turn = 2.0 * np.pi / steps
    z = complex(-turn * damping_ratio / np.sqrt(1.0 - damping_ratio**2), turn)
    ratio = steps * np.log(stability_function(method, z) / np.exp(z))
    return float(-np.expm1(ratio.real)), float(ratio.imag)
