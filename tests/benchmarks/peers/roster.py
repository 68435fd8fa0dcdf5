"""All peers of the chart with their settings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from guideload import Machine
from peers import compiled, cvode, diffsol, ivp, linear, lsoda, multibody, xla
from peers.problem import At, Problem

Prepare = Callable[[Problem], At]
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
EVERY_OTHER = (1e-4, 1e-6, 1e-8, 1e-10)
STEPS = (1.0, 1 / 2, 1 / 4, 1 / 8, 1 / 16)  # ms


@dataclass(frozen=True, eq=False)
class Peer:
    """One way to do the job."""

    name: str
    package: str  # that has to be installed
    prepare: Prepare
    settings: tuple[float, ...]  # loose to tight; (0,) where there is none
    fixed: bool = False  # settings are steps in ms, not tolerances
    only_linear: bool = False
    from_rest: bool = True  # takes part in the table of the pulse
    charted: bool = True  # takes part in the chart


def roster(machine: Machine) -> list[Peer]:
    """All peers.

    Those without a limit on their steps are in the table of the pulse, those with one in the chart; where a package
    has no such limit, or its user does well without, they are in both.
    """
    peers = [
        Peer("scipy lsim", "scipy", linear.lsim, (0.0,), only_linear=True),
        Peer("scipy lfilter per mode", "scipy", linear.lfilter, (0.0,), only_linear=True),
        Peer("Numba exact propagator", "numba", compiled.propagator, (0.0,), only_linear=True),
        Peer("Numba RK4", "numba", compiled.rk4, STEPS, fixed=True),
    ]
    for method in ("RK45", "DOP853", "Radau", "BDF", "LSODA"):
        free, limited = (
            partial(ivp.solve_ivp, method=method, limited=each, compiled=True) for each in (False, True)
        )
        ends = EVERY_OTHER[:3] if method == "BDF" else EVERY_OTHER  # at 1e-10 BDF never ends beside a kink
        peers += [
            Peer(f"solve_ivp {method}", "numba", free, EVERY_OTHER, charted=method == "RK45"),
            Peer(f"solve_ivp {method}, max_step", "numba", limited, ends, from_rest=False),
        ]
    for solver in ("tsit45", "bdf", "tr_bdf2", "esdirk34"):
        prepare = partial(diffsol.diffsol, solver=solver)
        peers.append(Peer(f"pydiffsol {solver}", "pydiffsol", prepare, TOLERANCES))
    for solver in ("lsoda", "dop853"):
        prepare = partial(lsoda.numbalsoda, solver=solver)
        peers.append(Peer(f"numbalsoda {solver}", "numbalsoda", prepare, TOLERANCES))
    for method in ("Adams", "BDF"):
        free, limited = (partial(cvode.cvode, method=method, limited=each) for each in (False, True))
        peers += [
            Peer(f"CVODE {method}, max_step", "sksundae", limited, EVERY_OTHER, from_rest=False),
            Peer(f"CVODE {method}", "sksundae", free, EVERY_OTHER, charted=False),
        ]
    for solver in ("Tsit5", "Dopri8", "Kvaerno5"):
        free, by_samples = (partial(xla.diffrax, solver=solver, limit=each) for each in ("none", "samples"))
        peers += [
            Peer(f"diffrax {solver}, step_ts", "diffrax", by_samples, EVERY_OTHER, from_rest=False),
            Peer(f"diffrax {solver}", "diffrax", free, EVERY_OTHER, charted=False),
        ]
    by_interval = partial(xla.diffrax, solver="Tsit5", limit="interval")
    peers.append(Peer("diffrax Tsit5, dtmax", "diffrax", by_interval, EVERY_OTHER, from_rest=False))
    for solver in ("GeneralizedAlpha", "TrapezoidalIndex2"):
        prepare = partial(multibody.exudyn, solver=solver, machine=machine)
        peers.append(Peer(f"Exudyn {solver}", "exudyn", prepare, STEPS[:3], fixed=True))
    return peers
