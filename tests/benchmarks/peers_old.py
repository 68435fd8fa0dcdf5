"""The same job by other means: what a competent user of SciPy, Numba or pydiffsol writes for a linear scene.

Each peer takes a `Problem` and returns the call to be timed, which gives loads of shape (time, carriage, 2),
force along y and z [N], or (time, carriage, 6), force and moment about the carriage centre [N, N m]. Outside the
call lies what guideload keeps from run to run too, the assembled matrices, and what a compiler does; inside it
all that depends on matrices and motion: exponential, eigenvalues, integration, loads. All peers work, like
guideload, with the deviation from static equilibrium, else their tolerances would drown the motion in the sag.
Adaptive solvers run at rtol 1e-6 and an absolute tolerance of 1e-6 of the sag in each state. With 1e-6 of a metre,
SciPy's default, RK45 is wrong by 5 % and DOP853 by 39 % of the dynamic load on `cycle`, with "success".
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec

import numpy as np
import scipy
from numpy.typing import NDArray

from guideload import Machine, Motion

Array = NDArray[np.float64]
Call = Callable[[], Array]
RTOL = 1e-6
DOFS = ("x", "y", "z", "rx", "ry", "rz")


@dataclass(frozen=True, eq=False)
class Problem:
    """x' = a x + b u, load = rest + c x, from x = 0 on; u is linear between its samples.

    x is (q - q_rest, q') of the free dofs, u the acceleration of L along the rails.
    """

    a: Array  # (2n, 2n)
    b: Array  # (2n,)
    c: Array  # (carriage, 6, 2n)
    rest: Array  # (carriage, 6)
    size: Array  # (2n,) states of the size of the sag
    time: Array
    u: Array

    @property
    def c_yz(self) -> Array:
        """(2 carriages, 2n) y and z forces only."""
        return self.c[:, 1:3].reshape(-1, self.b.size)

    @property
    def rest_yz(self) -> Array:
        """(2 carriages,)"""
        return self.rest[:, 1:3].ravel()

    @property
    def step(self) -> float:
        """The uniform sample interval in s."""
        return float((self.time[-1] - self.time[0]) / (self.time.size - 1))

    def loads_yz(self, states: Array) -> Array:
        """(time, carriage, 2) from states (2n, time)."""
        return (self.rest_yz + states.T @ self.c_yz.T).reshape(self.time.size, -1, 2)

    def exponential(self) -> tuple[Array, Array, Array]:
        """p, g0, g1 of x(t + h) = p x + g0 u(t) + g1 u(t + h)."""
        n = self.b.size
        m = np.zeros((n + 2, n + 2))
        m[:n, :n], m[:n, n], m[n, n + 1] = self.a * self.step, self.b * self.step, 1.0
        e = scipy.linalg.expm(m)[:n]
        return e[:, :n].copy(), e[:, n] - e[:, n + 1], e[:, n + 1].copy()


Peer = Callable[[Problem], Call]


def problem(machine: Machine, motion: Motion) -> Problem:
    """Assembled here and not by guideload's core, so that agreement of the loads checks assembly as well."""
    links = machine.link_table()
    rows = np.hstack([links.directions, np.cross(links.points, links.directions)])
    stiffness, damping = rows.T * links.stiffness @ rows, rows.T * links.damping @ rows
    mass, r = machine.body.mass, np.array(machine.body.center_of_mass)
    s = np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])
    inertia = machine.body.central_inertia() - mass * s @ s
    inertia6 = np.block([[mass * np.eye(3), -mass * s], [mass * s, inertia]])
    weight = mass * np.concatenate([machine.gravity, np.cross(r, machine.gravity)])
    free = [DOFS.index(dof) for dof in machine.free]
    n, ff = len(free), np.ix_(free, free)
    by = np.linalg.inv(inertia6[ff])
    a = np.block([[np.zeros((n, n)), np.eye(n)], [-by @ stiffness[ff], -by @ damping[ff]]])
    b = np.concatenate([np.zeros(n), -by @ inertia6[free, 0]])
    sag = np.linalg.solve(stiffness[ff], weight[free])

    def carriage(i: int, factor: Array) -> Array:
        of = links.carriage == i
        arms = np.cross(links.points[of] - machine.carriage_centers[i], links.directions[of])
        return np.hstack([links.directions[of], arms]).T * factor[of] @ rows[of][:, free]

    c = np.array(
        [
            np.hstack([carriage(i, links.stiffness), carriage(i, links.damping)])
            for i in range(len(machine.carriages))
        ]
    )
    moves = np.array([dof in "xyz" for dof in machine.free])
    size = np.where(moves, np.abs(sag[moves]).max(), np.abs(sag[~moves]).max())
    slowest = np.sqrt(scipy.linalg.eigh(stiffness[ff], inertia6[ff], eigvals_only=True)[0])
    size = np.concatenate([size, slowest * size])
    u = np.ascontiguousarray(motion.acceleration[:, 0])
    return Problem(a, b, c, c[:, :, :n] @ sag, size, motion.time, u)


# ---- SciPy


def lsim(given: Problem) -> Call:
    """scipy.signal.lsim, first-order hold."""
    through = np.zeros((len(given.c_yz), 1))
    system = scipy.signal.StateSpace(given.a, given.b[:, None], given.c_yz, through)

    def call() -> Array:
        _, loads, _ = scipy.signal.lsim(system, given.u, given.time)
        return (given.rest_yz + loads).reshape(given.time.size, -1, 2)

    return call


def solve_ivp(method: str, *, limited: bool) -> Peer:
    """scipy.integrate.solve_ivp on np.interp; loads from its dense output at the samples.

    limited: with the sample interval as max_step. RK45 does without, because stability holds its steps to about
    3 ms; DOP853 takes longer ones, whose dense output is wrong by 2e-3 of the dynamic load.
    """

    def peer(given: Problem) -> Call:
        a, b, time, u = given.a, given.b, given.time, given.u

        def rate(t: float, x: Array) -> Array:
            return a @ x + b * np.interp(t, time, u)

        def call() -> Array:
            solution = scipy.integrate.solve_ivp(
                rate,
                (time[0], time[-1]),
                np.zeros(b.size),
                method=method,
                t_eval=time,
                rtol=RTOL,
                atol=RTOL * given.size,
                max_step=given.step if limited else np.inf,
            )
            if not solution.success:
                raise RuntimeError(f"{method}: {solution.message}")
            return given.loads_yz(solution.y)

        return call

    return peer


def lfilter(given: Problem) -> Call:
    """A complex first-order scipy.signal.lfilter for each mode; for u[0] = 0 and a that is diagonalisable."""

    def call() -> Array:
        h = given.step
        values, vectors = np.linalg.eig(given.a)
        once = values.imag >= 0.0  # of a conjugate pair, one
        shares = np.linalg.solve(vectors, given.b)[once] * np.where(values.imag > 0.0, 2.0, 1.0)[once]
        z, weights = values[once] * h, (given.c_yz @ vectors[:, once]) * shares
        decay = np.exp(z)
        late = h * (decay - 1.0 - z) / z**2
        early = h * (decay - 1.0) / z - late
        modes = np.array(
            [
                scipy.signal.lfilter([g1, g0], [1.0, -e], given.u)
                for g1, g0, e in zip(late, early, decay, strict=True)
            ]
        )
        loads = modes.real.T @ weights.real.T - modes.imag.T @ weights.imag.T
        return (given.rest_yz + loads).reshape(given.time.size, -1, 2)

    return call


# ---- optional


@cache
def _numba_kernel(n: int, m: int) -> Callable[..., None]:
    """The loop over the samples, for sizes known to the compiler; matrices by columns, so that it vectorises."""
    import numba

    @numba.njit(fastmath=True)
    def kernel(p: Array, g0: Array, g1: Array, c: Array, rest: Array, u: Array, loads: Array) -> None:
        x, new = np.zeros(n), np.empty(n)
        for i in range(m):
            loads[0, i] = rest[i]
        for k in range(u.size - 1):
            for i in range(n):
                new[i] = g0[i] * u[k] + g1[i] * u[k + 1]
            for j in range(n):
                for i in range(n):
                    new[i] += p[j, i] * x[j]
            for i in range(n):
                x[i] = new[i]
            for i in range(m):
                load = rest[i]
                for j in range(n):
                    load += c[j, i] * x[j]
                loads[k + 1, i] = load

    return kernel


def numba_propagator(given: Problem) -> Call:
    """The exact propagator written by hand: all six components of each carriage, as guideload gives them."""
    n = given.b.size
    by_columns, rest = np.ascontiguousarray(given.c.reshape(-1, n).T), given.rest.ravel()
    kernel = _numba_kernel(n, rest.size)

    def call() -> Array:
        p, g0, g1 = given.exponential()
        loads = np.empty((given.time.size, rest.size))
        kernel(np.ascontiguousarray(p.T), g0, g1, by_columns, rest, given.u, loads)
        return loads.reshape(given.time.size, -1, 6)

    return call


def diffsol_tsit5(given: Problem) -> Call:
    """pydiffsol's Tsitouras 5(4): equations compiled by LLVM, once per motion because its table is part of them.

    Its one absolute tolerance needs states in units of their size. A sum over j takes in all terms of its line,
    hence `Au` on a line of its own.
    """
    import pydiffsol

    def listed(values: Iterable[float]) -> str:
        return ", ".join(repr(float(value)) for value in values)

    a, b = given.a * given.size / given.size[:, None], given.b / given.size
    entries = ", ".join(f"({i}, {j}): {float(a[i, j])!r}" for i, j in np.argwhere(a))
    code = f"""
        time_k {{ {listed(given.time)} }}
        given_k {{ {listed(given.u)} }}
        A_ij {{ {entries} }}
        b_i {{ {listed(b)} }}
        u_i {{ (0:{b.size}): 0.0 }}
        input {{ interp1d(time_k, given_k, t) }}
        Au_i {{ A_ij * u_j }}
        F_i {{ Au_i + b_i * input }}
    """
    ode = pydiffsol.Ode(code, matrix_type=pydiffsol.nalgebra_dense, ode_solver=pydiffsol.tsit45)
    ode.rtol = ode.atol = RTOL
    nothing, c = np.empty(0), given.c_yz * given.size

    def call() -> Array:
        states = ode.solve_dense(nothing, given.time).ys
        return (given.rest_yz + states.T @ c.T).reshape(given.time.size, -1, 2)

    return call


LSIM = "scipy.signal.lsim"
RK45 = ("solve_ivp RK45", "solve_ivp RK45, max_step 1 ms")

SCIPY: dict[str, Peer] = {
    LSIM: lsim,
    RK45[0]: solve_ivp("RK45", limited=False),
    RK45[1]: solve_ivp("RK45", limited=True),
    "solve_ivp DOP853, max_step 1 ms": solve_ivp("DOP853", limited=True),
    "scipy.signal.lfilter per mode": lfilter,
}
OPTIONAL: dict[str, tuple[str, Peer]] = {
    "numba": ("Numba, exact, by hand", numba_propagator),
    "pydiffsol": ("pydiffsol Tsit5", diffsol_tsit5),
}


def found_peers() -> tuple[dict[str, Peer], list[str]]:
    """All peers by name, and the packages that are not installed."""
    missing = [package for package in OPTIONAL if find_spec(package) is None]
    return SCIPY | {name: peer for key, (name, peer) in OPTIONAL.items() if key not in missing}, missing
