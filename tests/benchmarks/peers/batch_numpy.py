"""NumPy: all scenes take each step together."""

from __future__ import annotations

import numpy as np

from peers.scatter import Peaks, Scatter, systems


def propagator(of: Scatter) -> Peaks:
    """The exact propagator; the axis over scenes is the last one, along which NumPy's loops run."""
    given, u = systems(of), of.nominal.u
    p, g0, g1 = given.propagators()
    n, count = p.shape[1], len(of)
    # x and u at both ends of the step make one vector, so that a step is one contraction.
    step = np.ascontiguousarray(
        np.concatenate([p, g0[:, :, None], g1[:, :, None]], axis=2).transpose(1, 2, 0)
    )
    c, rest = np.ascontiguousarray(given.c.transpose(1, 2, 0)), np.ascontiguousarray(given.rest.T)
    x, load = np.zeros((n + 2, count)), rest.copy()
    low, high = rest.copy(), rest.copy()
    for k in range(u.size - 1):
        x[n], x[n + 1] = u[k], u[k + 1]
        x[:n] = np.einsum("ijs,js->is", step, x)
        np.einsum("ijs,js->is", c, x[:n], out=load)
        load += rest
        np.minimum(low, load, out=low)
        np.maximum(high, load, out=high)
    return np.maximum(-low, high).T
