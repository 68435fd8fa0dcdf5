"""Covariance of the fitted coordinates, and what of it comes from the data."""

from __future__ import annotations

import numpy as np

from guideload.base.arrays import Array
from guideload.identification.fit import Fit
from guideload.identification.serial_errors import root_of


def covariance(fit: Fit) -> Array:
    """(p + q, p + q) of the coordinates after the data.

    H^-1 with H = J'J + W^2, W^2 from what was known before; with records in time H^-1 B H^-1, where B has the long-run
    covariance of their scores in place of their part of J'J.
    """
    inverse = curvature(fit)
    objective = fit.objective
    if all(each.instants is None for each in objective.data):
        return inverse
    rows = [np.diag(objective.weights)]
    for i, each in enumerate(objective.data):
        here = objective.set_of == i
        values, slopes = fit.residuals[here], fit.jacobian[here]
        level = objective.factors[objective.noise_of[here]]
        rows.append(slopes if each.instants is None else root_of(each, values, slopes, level))
    spread = np.vstack(rows) @ inverse
    return np.asarray(spread.T @ spread)


def curvature(fit: Fit) -> Array:
    """(p + q, p + q) inverse of H, half the second derivative of the sum of squares: the covariance without records."""
    triangle = np.linalg.qr(np.vstack([fit.jacobian, np.diag(fit.objective.weights)]), mode="r")
    inverse = np.linalg.inv(triangle)
    return np.asarray(inverse @ inverse.T)


def information(fit: Fit) -> Array:
    """(p, p) of the machine's unknowns from the data alone, whatever the own unknowns of the data are.

    In units of what was known before: an eigenvalue of 3 halves the spread in its direction, 1/sqrt(1 + 3).
    """
    p = fit.objective.p
    spread = 1.0 / fit.objective.weights[:p]
    machine, own = fit.jacobian[:, :p] * spread, fit.jacobian[:, p:]
    found = machine.T @ machine
    if own.size:
        known = own.T @ own + np.diag(fit.objective.weights[p:] ** 2)
        found -= machine.T @ own @ np.linalg.pinv(known) @ own.T @ machine
    return np.asarray(0.5 * (found + found.T))


def degrees_of_freedom(fit: Fit, covariance: Array) -> Array:
    """(p + q) of the t distribution of each coordinate; inf where all noise is known (Satterthwaite's formula)."""
    shares = np.zeros((len(fit.noise), covariance.shape[0]))
    for i, noise in enumerate(fit.noise):
        if not noise.known:
            rows = fit.jacobian[fit.objective.noise_of == i] @ covariance
            shares[i] = (rows**2).sum(axis=0)
    certain = fit.free_values + fit.stated_values
    with np.errstate(divide="ignore"):
        return np.asarray(np.diag(covariance) ** 2 / (shares**2 / certain[:, None]).sum(axis=0))
