"""A run with contact changes in 50 digits: power series between the changes, whose instants are roots of these series.

It shares no code with guideload, which only tells on which segments the links rest.
"""

from __future__ import annotations

from collections.abc import Sequence
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


class _Run:
    """The state (q, q') of the free dofs in whole numbers of 2^-BITS, and the segment of each link."""

    def __init__(self, machine: Machine, rest: Sequence[float]) -> None:
        """rest: the static position, as exactly as the segments need it."""
        self.links = reference.links_of(mpmath.mp, machine)
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
        return {name: [one[name] for one in found] for name in reference.OBSERVED}


def _observed(run: _Run, outer: Numbers, machine: Machine) -> dict[str, Any]:
    """The values of `reference.OBSERVED`."""
    mp, state = mpmath.mp, [mpmath.ldexp(x, -BITS) for x in run.state]
    place, speed = (reference.all_dofs(mp, run.free, part) for part in (state[: run.n], state[run.n :]))
    loads, damping = reference.loads_of(mp, run.links, run.segments, place, speed)
    pull = [
        run.weight[dof]
        + outer[dof]
        - mpmath.fsum(load * one.row[dof] for one, load in zip(run.links, loads, strict=True))
        for dof in run.free
    ]
    rate = reference.all_dofs(mp, run.free, run.inverse * mpmath.matrix(pull))
    instant = place, speed, rate, outer
    return reference.observe(mp, machine, run.links, (loads, damping), (run.mass, run.weight), instant)
