"""The batch peers: how each runs many scenes, and how many of them give a stable figure."""

from __future__ import annotations

from dataclasses import dataclass

from harness import installed

from peers import batch_by_hand, batch_c, batch_jax, batch_single
from peers.scatter import Run


@dataclass(frozen=True)
class BatchPeer:
    """One way to run many scenes; its set-up, from draws to matrices and exponentials, is part of the run."""

    name: str
    package: str  # that has to be installed; "cc": a C compiler
    run: Run
    scenes: int  # in a call
    rough: int = 0  # the same on a motion whose every sample is a kink, if other

    def missing(self) -> str:
        """Why it cannot run, if so."""
        if self.package == "cc":
            return "" if batch_c.compiler() else f"{self.name} (no C compiler)"
        return "" if installed(self.package) else f"{self.name} ({self.package} is not installed)"


def linear_peers() -> list[BatchPeer]:
    """For scenes of linear links."""
    tsit45, rk45 = batch_single.diffsol("tsit45", 1e-6), batch_single.solve_ivp("RK45", 1e-6)
    multibody = batch_single.exudyn("TrapezoidalIndex2", 1.0)
    return [
        BatchPeer("C by hand, in lanes", "cc", batch_c.propagator, 1024),
        BatchPeer("JAX, scan of mapped scenes", "jax", batch_jax.scan, 512),
        BatchPeer("Numba exact propagator", "numba", batch_by_hand.by_numba, 256),
        BatchPeer("NumPy exact propagator, batched", "numpy", batch_by_hand.by_numpy, 256),
        BatchPeer("pydiffsol tsit45, rtol 1e-6", "pydiffsol", tsit45, 64, rough=8),
        BatchPeer("scipy.signal.lsim", "scipy", batch_single.lsim, 8),
        BatchPeer("Exudyn TrapezoidalIndex2, 1 ms", "exudyn", multibody, 3),
        BatchPeer("solve_ivp RK45, rtol 1e-6", "scipy", rk45, 2),
    ]


def clear_peers() -> list[BatchPeer]:
    """For scenes with clearance."""
    return [BatchPeer("Numba RK4, 1/4 ms", "numba", batch_single.rk4(1 / 4), 8)]
