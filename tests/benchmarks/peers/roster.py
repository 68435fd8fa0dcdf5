"""All peers of the chart with their settings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from guideload import Machine
from peers import compiled, cvode, diffsol, ivp, linear, lsoda, multibody, xla
from peers.problem import At, Call, Problem

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
        Peer("scipy lsim", "scipy", _exact(linear.lsim), (0.0,), only_linear=True),
        Peer("scipy lfilter per mode", "scipy", _exact(linear.lfilter), (0.0,), only_linear=True),
        Peer("Numba exact propagator", "numba", _exact(compiled.propagator), (0.0,), only_linear=True),
        Peer("Numba RK4", "numba", compiled.rk4, STEPS, fixed=True),
        Peer("solve_ivp RK45", "numba", _ivp("RK45", False), EVERY_OTHER),
        Peer("solve_ivp RK45, max_step", "numba", _ivp("RK45", True), EVERY_OTHER, from_rest=False),
    ]
    for method in ("DOP853", "Radau", "BDF", "LSODA"):
        limited, free = _ivp(method, True), _ivp(method, False)
        ends = EVERY_OTHER[:3] if method == "BDF" else EVERY_OTHER  # at 1e-10 BDF never ends beside a kink
        peers += [
            Peer(f"solve_ivp {method}, max_step", "numba", limited, ends, from_rest=False),
            Peer(f"solve_ivp {method}", "numba", free, EVERY_OTHER, charted=False),
        ]
    for solver in ("tsit45", "bdf", "tr_bdf2", "esdirk34"):
        peers.append(Peer(f"pydiffsol {solver}", "pydiffsol", diffsol.diffsol(solver), TOLERANCES))
    for solver in ("lsoda", "dop853"):
        peers.append(Peer(f"numbalsoda {solver}", "numbalsoda", lsoda.numbalsoda(solver), TOLERANCES))
    for method in ("Adams", "BDF"):
        limited, free = cvode.cvode(method, limited=True), cvode.cvode(method, limited=False)
        peers += [
            Peer(f"CVODE {method}, max_step", "sksundae", limited, EVERY_OTHER, from_rest=False),
            Peer(f"CVODE {method}", "sksundae", free, EVERY_OTHER, charted=False),
        ]
    for solver in ("Tsit5", "Dopri8", "Kvaerno5"):
        by_samples, free = xla.diffrax(solver, limit="samples"), xla.diffrax(solver, limit="none")
        peers += [
            Peer(f"diffrax {solver}, step_ts", "diffrax", by_samples, EVERY_OTHER, from_rest=False),
            Peer(f"diffrax {solver}", "diffrax", free, EVERY_OTHER, charted=False),
        ]
    by_interval = xla.diffrax("Tsit5", limit="interval")
    peers.append(Peer("diffrax Tsit5, dtmax", "diffrax", by_interval, EVERY_OTHER, from_rest=False))
    for solver in ("GeneralizedAlpha", "TrapezoidalIndex2"):
        prepare = multibody.exudyn(solver, machine)
        peers.append(Peer(f"Exudyn {solver}", "exudyn", prepare, STEPS[:3], fixed=True))
    return peers


def _exact(peer: Callable[[Problem], Call]) -> Prepare:
    """A peer that has no setting."""

    def prepare(given: Problem) -> At:
        call = peer(given)
        return lambda _: call

    return prepare


def _ivp(method: str, limited: bool) -> Prepare:
    return ivp.solve_ivp(method, limited=limited, compiled=True)
