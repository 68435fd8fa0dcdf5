"""The batch peers: how each runs many scenes, and how many of them give a stable figure."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from peers.roster import installed
from peers.scatter import Run


@dataclass(frozen=True)
class BatchPeer:
    """One way to run many scenes; its set-up, from draws to matrices and exponentials, is part of the run."""

    name: str
    package: str  # that has to be installed; "cc": a C compiler
    load: Callable[[], Run]  # imports
    scenes: int  # in a call
    rough: int = 0  # the same on a motion whose every sample is a kink, if other

    def missing(self) -> str:
        """Why it cannot run, if so."""
        if self.package == "cc":
            from peers.batch_c import compiler

            return "" if compiler() else f"{self.name} (no C compiler)"
        return "" if installed(self.package) else f"{self.name} ({self.package} is not installed)"


def linear_peers() -> list[BatchPeer]:
    """For scenes of linear links."""
    return [
        BatchPeer("C by hand, in lanes", "cc", _c, 1024),
        BatchPeer("JAX, scan of mapped scenes", "jax", _jax, 512),
        BatchPeer("Numba exact propagator", "numba", _numba, 256),
        BatchPeer("NumPy exact propagator, batched", "numpy", _numpy, 256),
        BatchPeer(
            "pydiffsol tsit45, rtol 1e-6", "pydiffsol", lambda: _single().diffsol("tsit45", 1e-6), 64, 8
        ),
        BatchPeer("scipy.signal.lsim", "scipy", lambda: _single().lsim, 8),
        BatchPeer(
            "Exudyn TrapezoidalIndex2, 1 ms", "exudyn", lambda: _single().exudyn("TrapezoidalIndex2", 1.0), 3
        ),
        BatchPeer("solve_ivp RK45, rtol 1e-6", "scipy", lambda: _single().solve_ivp("RK45", 1e-6), 2),
    ]


def clear_peers() -> list[BatchPeer]:
    """For scenes with clearance."""

    def rk4(step: float) -> Run:
        from peers.batch_numba import rk4

        return rk4(step)

    return [
        BatchPeer("Numba RK4, 1 ms", "numba", lambda: rk4(1.0), 32),
        BatchPeer("Numba RK4, 1/4 ms", "numba", lambda: rk4(1 / 4), 8),
        BatchPeer("numbalsoda lsoda, rtol 1e-7", "numbalsoda", lambda: _single().lsoda(1e-7), 16),
    ]


def _c() -> Run:
    from peers.batch_c import propagator

    return propagator


def _jax() -> Run:
    from peers.batch_jax import scan

    return scan


def _numba() -> Run:
    from peers.batch_numba import propagator

    return propagator


def _numpy() -> Run:
    from peers.batch_numpy import propagator

    return propagator


def _single() -> Any:
    from peers import batch_single

    return batch_single
