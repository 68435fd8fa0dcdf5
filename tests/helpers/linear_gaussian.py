"""The posterior of a state-space model by the textbook formula for jointly normal numbers, to check the kernels."""

from itertools import product
from math import factorial

import numpy as np
from scipy.linalg import expm

SEED = 5


def transition(states, step, oscillator=None):
    """Transition matrix and process noise of a step.

    Of derivatives by their definition: integrals of monomials over factorials. With an oscillator (frequency, damping
    ratio, index of the acceleration) by the exponential of a block matrix (Van Loan 1978).
    """
    if oscillator is not None:
        frequency, damping, at = oscillator
        rates = np.diag(np.ones(states - 1), 1)  # each number is the derivative of the one before, but for:
        rates[at + 1] = 0.0
        for drive, sign in ((at, -1.0), (at + 2, 1.0)):
            rates[at, drive] = sign * 2.0 * damping * frequency
            rates[at + 1, drive] = sign * frequency**2
        shaken = np.zeros((states, states))
        shaken[-1, -1] = 1.0
        both = expm(np.block([[-rates, shaken], [np.zeros((states, states)), rates.T]]) * step)
        phi = both[states:, states:].T
        return phi, phi @ both[:states, states:]
    phi, noise = np.zeros((2, states, states))
    for i, j in product(range(states), repeat=2):
        phi[i, j] = step ** (j - i) / factorial(j - i) if j >= i else 0.0
        a, b = states - 1 - i, states - 1 - j
        noise[i, j] = step ** (a + b + 1) / ((a + b + 1) * factorial(a) * factorial(b))
    return phi, noise


def dense(states, step, value, variance, mean, covariance, density, oscillator=None):
    """Posterior mean and covariance of all states at once, and the log likelihood (up to a constant)."""
    count = value.size
    means, blocks = [mean], [[covariance]]
    for k in range(count - 1):
        phi, noise = transition(states, step[k], oscillator)
        means.append(phi @ means[-1])
        row = [phi @ block for block in blocks[-1]]
        blocks.append([*row, row[-1] @ phi.T + density[k] * noise])
    prior = np.block(
        [[blocks[i][j] if j <= i else blocks[j][i].T for j in range(count)] for i in range(count)]
    )
    observed = np.kron(np.eye(count), np.eye(states)[:1])
    total = observed @ prior @ observed.T + np.diag(variance)
    innovation = value - observed @ np.concatenate(means)
    gain = prior @ observed.T @ np.linalg.inv(total)
    likelihood = -0.5 * (np.linalg.slogdet(total)[1] + innovation @ np.linalg.solve(total, innovation))
    return np.concatenate(means) + gain @ innovation, prior - gain @ observed @ prior, likelihood


def problem(states, count=12):
    """Samples and model as the core takes them: step, value, variance, mean, covariance, segment, density."""
    rng = np.random.default_rng(SEED)
    step = rng.uniform(0.1, 0.3, count - 1)
    value = np.cumsum(rng.standard_normal(count))
    variance = rng.uniform(0.1, 0.4, count)
    covariance = np.diag(4.0 * np.arange(1.0, states + 1.0))
    segment = (np.arange(count - 1) // 3).astype(np.uint32)
    return (
        step,
        value,
        variance,
        0.1 * np.ones(states),
        covariance,
        segment,
        np.array([1.0, 100.0, 1e-2, 30.0]),
    )
