"""A run with contact changes in 50 digits: power series between the changes, whose instants are roots of these series.

It shares no code with guideload, which only tells on which segments the links rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np
import reference
from numpy.typing import NDArray
from reference import DOFS, Numbers, whole

from guideload import Machine, Motion

Whole = NDArray[Any]  # of Python's integers

DIGITS = 50
BITS = 320  # after the point; the least numbers are some 1e-10
ONE = 1 << BITS
TERMS = 60  # of a series over an interval with |A| h of about 2
LOOKS = 64  # at the deflections of an interval, between which no link comes and goes
OUTSIDE = 1e-16  # m, more than the rounding of a look


@dataclass
class _Link:
    row: Numbers  # deflection per unit of (u, phi)
    point: Numbers
    direction: Numbers
    offset: Any
    pieces: list[tuple[Any, Any]]  # F = a + k d
    edges: Numbers
    damping: Any
    in_contact: bool
    carriage: int

    def segment(self, deflection: Any) -> int:
        return sum(edge <= deflection for edge in self.edges)

    def damping_on(self, segment: int) -> Any:
        return self.damping if self.pieces[segment][1] or not self.in_contact else mpmath.mpf(0)


def _law(part: Any, axis: str, share: Any) -> tuple[list[tuple[Any, Any]], Numbers]:
    curve = getattr(part, f"curve{axis}")
    if curve is not None:
        points = [(mpmath.mpf(d), share * mpmath.mpf(force)) for d, force in curve]
        if not points[0][0]:
            points = [(-d, -force) for d, force in points[:0:-1]] + points
        pieces = []
        for (d, force), (next_d, next_force) in zip(points[:-1], points[1:], strict=True):
            slope = (next_force - force) / (next_d - d)
            pieces.append((force - slope * d, slope))
        return pieces, [d for d, _ in points[1:-1]]
    stiffness, clearance = getattr(part, f"stiffness{axis}"), mpmath.mpf(getattr(part, f"clearance{axis}"))
    sides = [getattr(stiffness, side, stiffness) for side in ("negative", "positive")]
    low, high = (share * mpmath.mpf(side) for side in sides)
    if not clearance:
        return ([(mpmath.mpf(0), low), (mpmath.mpf(0), high)], [mpmath.mpf(0)])
    return (
        [(low * clearance, low), (mpmath.mpf(0), mpmath.mpf(0)), (-high * clearance, high)],
        [-clearance, clearance],
    )


def _links(machine: Machine) -> list[_Link]:
    links = []
    axes = {"_y": [mpmath.mpf(x) for x in (0, 1, 0)], "_z": [mpmath.mpf(x) for x in (0, 0, 1)]}
    centers = reference._centers(mpmath.mp, machine)
    for i, (one, center) in enumerate(zip(machine.carriages, centers, strict=True)):
        for sign in (-1, 1):
            point = [center[0] + sign * mpmath.mpf(one.length) / 2, center[1], center[2]]
            for (axis, o), error in zip(axes.items(), one.mounting_error, strict=True):
                row = [*o, *reference._cross(point, o)]
                damping = mpmath.mpf(getattr(one, f"damping{axis}")) / 2
                law = _law(one, axis, mpmath.mpf(1) / 2)
                links.append(
                    _Link(row, point, o, mpmath.mpf(error), *law, damping, one.damping_in_contact, i)
                )
    for one in machine.links:
        o = [mpmath.mpf(x) for x in one.direction]
        length = mpmath.sqrt(mpmath.fdot(o, o))
        o, point = [x / length for x in o], [mpmath.mpf(x) for x in one.point]
        law = _law(one, "", mpmath.mpf(1))
        row = [*o, *reference._cross(point, o)]
        links.append(
            _Link(row, point, o, mpmath.mpf(0), *law, mpmath.mpf(one.damping), one.damping_in_contact, -1)
        )
    return links


class _Run:
    """The state (q, q') of the free dofs in whole numbers of 2^-BITS, and the segment of each link."""

    def __init__(self, machine: Machine, rest: Sequence[float]) -> None:
        """rest: the static position, as exactly as the segments need it."""
        self.links = _links(machine)
        self.mass, self.weight = reference._body(mpmath.mp, machine)
        self.free = [DOFS.index(dof) for dof in machine.free]
        self.inverse = mpmath.matrix([[self.mass[i][j] for j in self.free] for i in self.free]) ** -1
        self.n = len(self.free)
        near = [mpmath.mpf(float(x)) for x in rest]
        self.segments = [one.segment(mpmath.fdot(one.row, near) - one.offset) for one in self.links]
        self.rows = mpmath.matrix([[one.row[i] for i in self.free] for one in self.links])
        self.whole_rows = whole(self.rows.tolist(), BITS)
        self.known: dict[tuple[int, ...], tuple[Whole, Whole]] = {}
        stiffness, _, force = self.equations()
        start = mpmath.lu_solve(stiffness, force)
        self.state = whole([*start, *([mpmath.mpf(0)] * self.n)], BITS)

    def equations(self) -> tuple[Any, Any, Any]:
        """K, C and the force that does not depend on the motion, for the free dofs on the present segments."""
        pieces = [one.pieces[segment] for one, segment in zip(self.links, self.segments, strict=True)]
        dampers = [one.damping_on(segment) for one, segment in zip(self.links, self.segments, strict=True)]
        k, c = (self.rows.T * mpmath.diag(list(of)) * self.rows for of in ([k for _, k in pieces], dampers))
        loads = [a - k * one.offset for one, (a, k) in zip(self.links, pieces, strict=True)]
        weight = mpmath.matrix([self.weight[dof] for dof in self.free])
        return k, c, weight - self.rows.T * mpmath.matrix(loads)

    def rates(self) -> tuple[Whole, Whole]:
        """Matrix (n, 2n) from the state to the accelerations on the present segments, and their constant part (n,)."""
        segments = tuple(self.segments)
        if segments not in self.known:
            k, c, force = self.equations()
            by_place, by_speed = ((-self.inverse * of).tolist() for of in (k, c))
            of_force = [x for (x,) in (self.inverse * force).tolist()]
            self.known[segments] = (
                np.hstack([whole(by_place, BITS), whole(by_speed, BITS)]),
                whole(of_force, BITS),
            )
        return self.known[segments]

    def terms(self, inputs: Whole, h: int) -> Whole:
        """Terms (order, 2n) of the power series of the state in the fraction of a step.

        inputs: accelerations (2, n) by the motion at its start and end.
        """
        matrix, constant = self.rates()
        matrix, inputs = (
            matrix * h >> BITS,
            np.array([inputs[0] + constant, inputs[1] - inputs[0]]) * h >> BITS,
        )
        terms = [self.state]
        for order in range(TERMS):
            now = terms[-1]
            rate = matrix @ now >> BITS
            if order < 2:
                rate = rate + inputs[order]
            terms.append(np.concatenate([now[self.n :] * h >> BITS, rate]) // (order + 1))
        return np.array(terms)

    def first_change(self, terms: Whole) -> tuple[int, int, int] | None:
        """Fraction of the step, link and next segment of the first change."""
        found = None
        looks = np.linspace(0.0, 1.0, LOOKS + 1)[1:]
        paths = terms[:, : self.n] @ self.whole_rows.T >> BITS
        for index, (one, segment, path) in enumerate(zip(self.links, self.segments, paths.T, strict=True)):
            path[0] -= int(mpmath.ldexp(one.offset, BITS))
            seen = np.polynomial.polynomial.polyval(looks, path.astype(float) * 0.5**BITS)
            for beyond, sign in ((segment, 1.0), (segment - 1, -1.0)):
                if not 0 <= beyond < len(one.edges):
                    continue
                out = sign * (seen - float(one.edges[beyond])) > OUTSIDE
                if not out.any():
                    continue
                theta, edge = int(looks[int(out.argmax())] * ONE), int(mpmath.ldexp(one.edges[beyond], BITS))
                for _ in range(12):
                    value, slope = _at(path, theta)
                    theta -= (value - edge) * ONE // slope
                if found is None or theta < found[0]:
                    found = (theta, index, segment + int(sign))
        return found

    def pass_interval(self, inputs: Whole, h: int) -> None:
        done = 0
        while True:
            now = inputs[0] + (done * (inputs[1] - inputs[0]) >> BITS)
            terms = self.terms(np.array([now, inputs[1]]), (ONE - done) * h >> BITS)
            change = self.first_change(terms)
            theta = ONE if change is None else change[0]
            self.state, _ = _at(terms, theta)
            if change is None:
                return
            self.segments[change[1]] = change[2]
            done += theta * (ONE - done) >> BITS


def _at(terms: Whole, theta: int) -> tuple[Any, Any]:
    """Values and slopes of polynomials in the fraction of a step."""
    value = slope = 0 * terms[0]
    for term in terms[::-1]:
        value, slope = (value * theta >> BITS) + term, (slope * theta >> BITS) + value
    return value, slope


def precise_contacts(rest: Sequence[float], machine: Machine, motion: Motion) -> dict[str, list[Any]]:
    """Fields of `reference.Reference` as nested lists of mpmath numbers.

    rest: the static position (6,), as exactly as the segments of the links there need it.
    """
    with mpmath.workdps(DIGITS):
        run = _Run(machine, rest)
        zero = np.zeros((motion.time.size, 6))
        wrenches = zero if motion.wrench is None else motion.wrench
        outer = []  # forces on all dofs
        for acceleration, wrench in zip(motion.acceleration, wrenches, strict=True):
            a = [mpmath.mpf(float(x)) for x in acceleration]
            outer.append(
                [
                    mpmath.mpf(float(w)) - mpmath.fdot(row[:3], a)
                    for w, row in zip(wrench, run.mass, strict=True)
                ]
            )
        found = [_observed(run, outer[0], machine)]
        for k, h in enumerate(reference._intervals(mpmath.mp, motion.time)):
            ends = [list(run.inverse * mpmath.matrix([of[i] for i in run.free])) for of in outer[k : k + 2]]
            if h:
                run.pass_interval(whole(ends, BITS), int(mpmath.ldexp(h, BITS)))
            found.append(_observed(run, outer[k + 1], machine))
        return {name: [one[i] for one in found] for i, name in enumerate(reference.OBSERVED)}


def _observed(run: _Run, outer: Numbers, machine: Machine) -> tuple[Any, ...]:
    """The values of `reference.OBSERVED`."""

    def all_dofs(part: Any) -> Numbers:
        out = [mpmath.mpf(0)] * 6
        for i, value in zip(run.free, part, strict=True):
            out[i] = value
        return out

    state = [mpmath.ldexp(x, -BITS) for x in run.state]
    q, v = all_dofs(state[: run.n]), all_dofs(state[run.n :])
    loads, damping = [], []
    for one, segment in zip(run.links, run.segments, strict=True):
        a, stiffness = one.pieces[segment]
        damping.append(one.damping_on(segment) * mpmath.fdot(one.row, v))
        loads.append(a + stiffness * (mpmath.fdot(one.row, q) - one.offset) + damping[-1])
    pull = [
        run.weight[dof]
        + outer[dof]
        - mpmath.fsum(load * one.row[dof] for one, load in zip(run.links, loads, strict=True))
        for dof in run.free
    ]
    rate = all_dofs(run.inverse * mpmath.matrix(pull))
    mp = mpmath.mp
    carriages = reference._carriage_loads(mp, machine, run.links, loads)
    reaction = reference._reaction(mp, run.links, loads, run.free, run.mass, run.weight, rate, outer)
    return loads, damping, carriages, reaction, q, v, rate
