"""Exact histories of a linear machine under a motion, and their derivatives by its unknown values.

The state x = (q, q') of the free dofs obeys x' = A x + B u. With A = S diag(lambda) S^-1, every history is a sum of
the responses r of y' = lambda y + u to the inputs u, and every derivative one of r and s = dr/dlambda: a change dA
mixes two modes i and j by (r_i - r_j)/(lambda_i - lambda_j), and one mode with itself by s_i. Between stamps u is
linear, for which r and s are exact, at any instant.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import factorial

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.sensitivity.linearised import Linearised
from guideload.simulation.start import start_of

Complex = NDArray[np.complex128]
UNEVEN = 1e-3  # steps: stamps closer than this to a uniform grid are those of the grid
SAME = 1e-7  # relative distance of two eigenvalues below which they count as equal
INDEPENDENT = 1e-9  # least reciprocal condition of the modes; below, some of them are not independent
PLACES = 9  # digits of a place between two stamps, in steps
NEAR, TERMS = 0.5, 12  # |lambda step| up to which the weights are power series, and their terms: 1e-16


@dataclass(frozen=True, eq=False)
class Inputs:
    """What excites a machine, on a uniform grid of `step` seconds from `start`.

    values      (time, m) columns of cart acceleration and wrench that are not zero everywhere
    places      (9, m) to which of the three accelerations and six components of the wrench each column belongs
    under_way   whether the record begins in motion: the state before the first stamp is then that of a constant input
    """

    start: float
    step: float
    values: Array
    places: Array
    under_way: bool

    @classmethod
    def of(cls, machine: Machine, motion: Motion) -> Inputs:
        """The inputs of a motion; other stamps than uniform ones are interpolated on a grid of their median step.

        Raises ArgumentError for a machine whose motion is not linear in these inputs.
        """
        _require_linear(machine)
        steps = np.diff(motion.time)
        step = float(np.median(steps[steps > 0.0]))
        count = round((motion.time[-1] - motion.time[0]) / step) + 1
        grid = motion.time[0] + step * np.arange(count)
        wrench = np.zeros((motion.time.size, 6)) if motion.wrench is None else motion.wrench
        given = np.hstack([motion.acceleration, wrench])
        used = np.flatnonzero(given.any(axis=0)) if given.any() else np.array([0])
        if count == motion.time.size and np.abs(grid - motion.time).max() < UNEVEN * step:
            values = given[:, used]
        else:
            values = np.column_stack([np.interp(grid, motion.time, given[:, i]) for i in used])
        under_way = start_of(machine, motion, "auto") == "quasi-static"
        return cls(float(motion.time[0]), step, values, np.eye(9)[:, used], under_way)

    @property
    def time(self) -> Array:
        """(time,) s"""
        return np.asarray(self.start + self.step * np.arange(len(self.values)))


def _require_linear(machine: Machine) -> None:
    for what, way_out, there in (
        (
            f"links of the level {machine.model_level}",
            "give its stiffness as one number",
            machine.model_level != "linear",
        ),
        ("riders", "make them part of its body", machine.riders),
        ("payloads", "make them part of its body", machine.payloads),
        ("rails that are not straight", "leave out their profiles", not machine.has_straight_rails),
        ("a base", "leave out [base]", machine.base),
        (
            "a rack that pushes on its body",
            "leave out pressure_angle, helix_angle and push_direction",
            machine.drive is not None and machine.drive.push_direction is not None,
        ),
    ):
        if there:
            raise ArgumentError(
                f"{machine.name}: records in time identify a linear machine, and this one has {what}; {way_out}"
            )


@dataclass(frozen=True, eq=False)
class Output:
    """A quantity C x + D u + constant of the machine, and the derivatives of C, D and the constant by p values."""

    of_state: Array
    of_input: Array
    by_of_state: Array
    by_of_input: Array
    constant: float = 0.0
    by_constant: Array | float = 0.0


@dataclass(frozen=True, eq=False)
class Instants:
    """r and s of each input of each kept mode at some instants, the inputs u (m, time) there, and du/dt."""

    r: Complex
    s: Complex
    u: Array
    u_slope: Array


@dataclass(frozen=True, eq=False)
class History:
    """A quantity (time,), its derivatives (p, time) by the values of the machine, and (time,) by time [1/s]."""

    values: Array
    by: Array
    slope: Array


class LinearHistories:
    """Histories of a machine with p values, linearised at rest, under these inputs.

    Raises ArgumentError for a machine whose body is free to move or whose damping is critical: its modes are not
    independent.
    """

    def __init__(self, rest: Linearised, inputs: Inputs) -> None:
        self.rest, self.inputs = rest, inputs
        free = np.asarray(rest.free)
        self.n, square = free.size, np.ix_(free, free)
        inverse = np.linalg.inv(rest.mass[square])
        pushed = np.hstack([-rest.mass[free, :3], np.eye(6)[free]]) @ inputs.places
        self.of_state = -inverse @ np.hstack([rest.stiffness[square], rest.damping[square]])  # q'' from x
        self.of_input = inverse @ pushed
        d_mass, d_damping, d_stiffness = (
            each[:, free[:, None], free] for each in (rest.d_mass, rest.d_damping, rest.d_stiffness)
        )
        changed = np.concatenate([d_stiffness, d_damping], 2)
        by_pushed = (
            np.concatenate([-rest.d_mass[:, free, :3], np.zeros((len(d_mass), self.n, 6))], 2) @ inputs.places
        )
        self.by_of_state = -inverse @ (changed + d_mass @ self.of_state)
        self.by_of_input = inverse @ (by_pushed - d_mass @ self.of_input)

    # ---- quantities of the machine

    def along(self, row: Array, derivative: int) -> Output:
        """The displacement row @ q of L (0), its velocity (1) or acceleration (2), from the place at rest."""
        part = np.asarray(row)[self.rest.free]
        if derivative == 2:
            return Output(
                part @ self.of_state, part @ self.of_input, part @ self.by_of_state, part @ self.by_of_input
            )
        p, m = len(self.by_of_state), self.inputs.values.shape[1]
        of_state = np.zeros(2 * self.n)
        of_state[derivative * self.n : (derivative + 1) * self.n] = part
        return Output(of_state, np.zeros(m), np.zeros((p, 2 * self.n)), np.zeros((p, m)))

    def load(self, rows: Array, by_rows: Array) -> Output:
        """A load from its value at rest, given by `LoadRows`: (2, 6) and (p, 2, 6)."""
        p, m = len(by_rows), self.inputs.values.shape[1]
        of_state, by_of_state = rows[:, self.rest.free].ravel(), by_rows[:, :, self.rest.free].reshape(p, -1)
        return Output(of_state, np.zeros(m), by_of_state, np.zeros((p, m)))

    def reaction(self, dof: int) -> Output:
        """The force [N] of the drive on L along a held dof."""
        rest, free = self.rest, self.rest.free
        mass, by_mass = rest.mass[dof, free], rest.d_mass[:, dof, free]
        own = np.concatenate([rest.stiffness[dof, free], rest.damping[dof, free]])
        by_own = np.concatenate([rest.d_stiffness[:, dof, free], rest.d_damping[:, dof, free]], axis=1)
        ridden = np.concatenate([rest.mass[dof, :3], -np.eye(6)[dof]]) @ self.inputs.places
        by_ridden = np.pad(rest.d_mass[:, dof, :3], ((0, 0), (0, 6))) @ self.inputs.places
        sag, by_sag = rest.static_position[free], rest.d_static_position[:, free]
        return Output(
            mass @ self.of_state + own,
            mass @ self.of_input + ridden,
            by_mass @ self.of_state + mass @ self.by_of_state + by_own,
            by_mass @ self.of_input + mass @ self.by_of_input + by_ridden,
            float(own[: self.n] @ sag - rest.weight[dof]),
            by_own[:, : self.n] @ sag + by_sag @ own[: self.n] - rest.d_weight[:, dof],
        )

    def history(self, output: Output, at: Instants) -> History:
        """The history of a quantity at some instants."""
        low = np.concatenate(
            [output.of_state[self.n :] @ self.of_state, output.of_state[self.n :] @ self.of_input]
        )
        rate_of_state, rate_of_input = low[: 2 * self.n], low[2 * self.n :]
        rate_of_state[self.n :] += output.of_state[: self.n]
        both = self._from_state(np.array([output.of_state, rate_of_state]), at)
        values = both[0] + at.u.T @ output.of_input + output.constant
        slope = both[1] + at.u.T @ rate_of_input + at.u_slope.T @ output.of_input
        by = self._from_state(output.by_of_state, at) + self._from_change(output.of_state, at)
        by += output.by_of_input @ at.u + np.reshape(output.by_constant, (-1, 1))
        return History(values, by, slope)

    def at(self, time: Array | None = None) -> Instants:
        """The responses of all modes at instants (n,) [s], inside those of the inputs; by default at their stamps."""
        inputs, values = self.inputs, self._modes[0][self._kept]
        u = np.tile(inputs.values.T, (values.size, 1))  # rows: each input of each mode
        modes = np.repeat(values, inputs.values.shape[1])
        r, s = self._responses
        if time is None:
            return Instants(r, s, inputs.values.T, np.gradient(inputs.values.T, inputs.step, axis=1))
        place = (time - inputs.start) / inputs.step
        index = np.clip(np.floor(place), 0, len(inputs.values) - 2).astype(np.intp)
        # Logs of a common rate have few different places between the stamps.
        places, same = np.unique(np.round(place - index, PLACES), return_inverse=True)
        since = inputs.step * places[same]
        rate = np.diff(u, axis=1)[:, index] / inputs.step
        first, last = u[:, index], u[:, index] + rate * since
        z = modes[:, None] * inputs.step * places
        weights, by_weights = _weights_of_a_step(z)
        one, two, by_one, by_two = (each[:, same] for each in (*weights, *by_weights))
        grown, r, s = np.exp(z)[:, same], r[:, index], s[:, index]
        s = grown * (s + since * r) + since**2 * ((by_one - by_two) * first + by_two * last)
        r = grown * r + since * ((one - two) * first + two * last)
        m = inputs.values.shape[1]
        return Instants(r, s, last[:m], rate[:m])

    # ---- modes

    @cached_property
    def _modes(self) -> tuple[Complex, Complex, Complex]:
        """Eigenvalues (2 n,), the modes as columns, and their inverse."""
        values, modes = np.linalg.eig(np.vstack([np.eye(self.n, 2 * self.n, self.n), self.of_state]))
        if 1.0 / np.linalg.cond(modes) < INDEPENDENT or not abs(values).min() > SAME * abs(values).max():
            raise ArgumentError(
                "identify: the histories need independent modes, but the body is free to move or a mode has critical "
                "damping; add the stiffness that holds the body, or change the damping from which the search starts"
            )
        return values, modes, np.linalg.inv(modes)

    @cached_property
    def _kept(self) -> NDArray[np.intp]:
        """The modes of which r and s are kept: one of each conjugate pair, as only real parts are needed."""
        return np.flatnonzero(self._modes[0].imag >= 0.0)

    @cached_property
    def _responses(self) -> tuple[Complex, Complex]:
        """r and s of each input of each kept mode, as rows (time along them)."""
        values = self._modes[0][self._kept]
        rows = [_response(value, self.inputs, column) for value in values for column in self.inputs.values.T]
        return np.array([r for r, _ in rows]), np.array([s for _, s in rows])

    def _from_state(self, of_state: Array, at: Instants) -> Array:
        """of_state (k, 2 n) @ x (k, time)."""
        _, modes, inverse = self._modes
        inputs = inverse[:, self.n :] @ self.of_input  # (2 n, m)
        return self._real((of_state @ modes)[:, :, None] * inputs, at.r)

    def _from_change(self, of_state: Array, at: Instants) -> Array:
        """of_state (2 n,) @ dx (p, time), the derivatives of x by the values."""
        eigenvalues, modes, inverse = self._modes
        shares, low = of_state @ modes, inverse[:, self.n :]
        inputs, by_inputs = low @ self.of_input, low @ self.by_of_input  # (2 n, m), (p, 2 n, m)
        mixed = low @ self.by_of_state @ modes  # (p, 2 n, 2 n)
        apart = eigenvalues[:, None] - eigenvalues
        equal = abs(apart) <= SAME * abs(eigenvalues).max()
        over = np.where(equal, 0.0, mixed / np.where(equal, 1.0, apart))
        of_r = shares[:, None] * (by_inputs + over @ inputs)  # the r_i of (r_i - r_j)/(lambda_i - lambda_j)
        of_r -= (shares @ over)[:, :, None] * inputs
        of_s = shares[:, None] * (np.where(equal, mixed, 0.0) @ inputs)
        return self._real(of_r, at.r) + self._real(of_s, at.s)

    def _real(self, weights: Complex, responses: Complex) -> Array:
        """The real sum (k, time) of responses of all modes with weights (k, 2 n, m)."""
        kept = weights[:, self._kept] * np.where(self._modes[0].imag > 0.0, 2.0, 1.0)[self._kept, None]
        rows = kept.reshape(len(weights), len(responses))
        return np.asarray(rows.real @ responses.real - rows.imag @ responses.imag)


def _response(value: complex, inputs: Inputs, u: Array) -> tuple[Complex, Complex]:
    """Response r (time,) of y' = value y + u to an input (time,) that is linear between stamps, and dr/dvalue."""
    h, z = inputs.step, value * inputs.step
    (one, two), (by_one, by_two) = _weights_of_a_step(np.asarray(z))
    decay = np.array([1.0, -np.exp(z)])
    start, by_start = (-u[0] / value, u[0] / value**2) if inputs.under_way else (0.0, 0.0)
    weights, by_weights = h * np.array([two, one - two]), h * h * np.array([by_two, by_one - by_two])
    r = lfilter(weights, decay, u, zi=np.array([start - weights[0] * u[0]]))[0]
    s = lfilter(by_weights, decay, u, zi=np.array([by_start - by_weights[0] * u[0]]))[0]
    return r, s + lfilter([0.0, h * np.exp(z)], decay, r, zi=np.zeros(1, complex))[0]


def _weights_of_a_step(z: Complex) -> tuple[tuple[Complex, Complex], tuple[Complex, Complex]]:
    """phi_1 = (e^z - 1)/z and phi_2 = (phi_1 - 1)/z, and their derivatives."""
    far = abs(z) > NEAR
    near, away = np.where(far, 0.0, z), np.where(far, z, 1.0)
    one, two = _power_series(near, 1), _power_series(near, 2)
    by_two = _power_series(near, 2, 1)
    grown = np.exp(away)
    far_one = (grown - 1.0) / away
    far_two = (far_one - 1.0) / away
    far_by_one = (grown - far_one) / away
    by_one = np.where(far, far_by_one, _power_series(near, 1, 1))
    return (
        (np.where(far, far_one, one), np.where(far, far_two, two)),
        (by_one, np.where(far, (far_by_one - far_two) / away, by_two)),
    )


def _power_series(z: Complex, k: int, derivative: int = 0) -> Complex:
    """phi_k = sum of z^j/(j + k)!, or its derivative sum of (j + 1) z^j/(j + 1 + k)!."""
    total = np.zeros_like(z)
    for j in range(TERMS, -1, -1):
        total = total * z + (j + 1) ** derivative / factorial(j + k + derivative)
    return total
