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
from reference import DOFS, Numbers

from guideload import Machine, Motion

DIGITS = 50
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
    """The state (q, q') of the free dofs, and the segment of each link."""

    def __init__(self, machine: Machine, rest: Sequence[float]) -> None:
        """rest: the static position, as exactly as the segments need it."""
        self.links = _links(machine)
        self.mass, self.weight = reference._body(mpmath.mp, machine)
        self.free = [DOFS.index(dof) for dof in machine.free]
        inverse = mpmath.matrix([[self.mass[i][j] for j in self.free] for i in self.free]) ** -1
        self.inverse = inverse.tolist()
        self.n = len(self.free)
        near = [mpmath.mpf(float(x)) for x in rest]
        self.segments = [one.segment(mpmath.fdot(one.row, near) - one.offset) for one in self.links]
        stiffness, _, force = self.equations()
        start = mpmath.lu_solve(mpmath.matrix(stiffness), mpmath.matrix(force))
        self.state: Numbers = [*start, *([mpmath.mpf(0)] * self.n)]

    def equations(self) -> tuple[Any, Any, Numbers]:
        """K, C and the force that does not depend on the motion, for the free dofs on the present segments."""
        pieces = [one.pieces[segment] for one, segment in zip(self.links, self.segments, strict=True)]
        dampers = [one.damping_on(segment) for one, segment in zip(self.links, self.segments, strict=True)]
        rows = [[one.row[i] for i in self.free] for one in self.links]
        k, c = (
            [
                [
                    mpmath.fsum(f * row[i] * row[j] for f, row in zip(of, rows, strict=True))
                    for j in range(self.n)
                ]
                for i in range(self.n)
            ]
            for of in ([k for _, k in pieces], dampers)
        )
        loads = [a - k * one.offset for one, (a, k) in zip(self.links, pieces, strict=True)]
        force = [
            self.weight[dof] - mpmath.fsum(load * row[i] for load, row in zip(loads, rows, strict=True))
            for i, dof in enumerate(self.free)
        ]
        return k, c, force

    def terms(self, inputs: Any, h: Any) -> list[Numbers]:
        """Terms of the power series of the state in the fraction of a step; inputs: at its start and end."""
        k, c, force = self.equations()
        n, terms = self.n, [self.state]
        for order in range(TERMS):
            now = terms[-1]
            outer = [mpmath.mpf(0)] * n
            if order == 0:
                outer = [f + u for f, u in zip(force, inputs[0], strict=True)]
            elif order == 1:
                outer = [end - start for start, end in zip(*inputs, strict=True)]
            pull = [outer[i] - mpmath.fdot(k[i], now[:n]) - mpmath.fdot(c[i], now[n:]) for i in range(n)]
            rate = [mpmath.fdot(row, pull) for row in self.inverse]
            terms.append([x * h / (order + 1) for x in [*now[n:], *rate]])
        return terms

    def first_change(self, terms: list[Numbers]) -> tuple[Any, int, int] | None:
        """Fraction of the step, link and next segment of the first change."""
        found = None
        looks = np.linspace(0.0, 1.0, LOOKS + 1)[1:]
        for index, (one, segment) in enumerate(zip(self.links, self.segments, strict=True)):
            row = [one.row[i] for i in self.free]
            path = [mpmath.fdot(row, term[: self.n]) for term in terms]
            path[0] -= one.offset
            seen = np.polynomial.polynomial.polyval(looks, np.array([float(x) for x in path]))
            for beyond, sign in ((segment, 1.0), (segment - 1, -1.0)):
                if not 0 <= beyond < len(one.edges):
                    continue
                out = sign * (seen - float(one.edges[beyond])) > OUTSIDE
                if not out.any():
                    continue
                theta = mpmath.mpf(looks[int(out.argmax())])
                for _ in range(12):
                    value, slope = _at(path, theta)
                    theta -= (value - one.edges[beyond]) / slope
                if found is None or theta < found[0]:
                    found = (theta, index, segment + int(sign))
        return found

    def pass_interval(self, inputs: Any, h: Any) -> None:
        done = mpmath.mpf(0)
        while True:
            now = [a + done * (b - a) for a, b in zip(*inputs, strict=True)]
            terms = self.terms((now, inputs[1]), (1 - done) * h)
            change = self.first_change(terms)
            theta = mpmath.mpf(1) if change is None else change[0]
            columns = list(zip(*terms, strict=True))
            self.state = [_at(column, theta)[0] for column in columns]
            if change is None:
                return
            self.segments[change[1]] = change[2]
            done += theta * (1 - done)


def _at(terms: Sequence[Any], theta: Any) -> tuple[Any, Any]:
    """Value and slope of a polynomial in the fraction of a step."""
    value, slope = mpmath.mpf(0), mpmath.mpf(0)
    for term in reversed(terms):
        value, slope = value * theta + term, slope * theta + value
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
            ends = [[of[i] for i in run.free] for of in outer[k : k + 2]]
            if h:
                run.pass_interval(ends, h)
            found.append(_observed(run, outer[k + 1], machine))
        return {name: [one[i] for one in found] for i, name in enumerate(reference.OBSERVED)}


def _observed(run: _Run, outer: Numbers, machine: Machine) -> tuple[Any, ...]:
    """The values of `reference.OBSERVED`."""

    def all_dofs(part: Any) -> Numbers:
        out = [mpmath.mpf(0)] * 6
        for i, value in zip(run.free, part, strict=True):
            out[i] = value
        return out

    q, v = all_dofs(run.state[: run.n]), all_dofs(run.state[run.n :])
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
    rate = all_dofs([mpmath.fdot(row, pull) for row in run.inverse])
    mp = mpmath.mp
    carriages = reference._carriage_loads(mp, machine, run.links, loads)
    reaction = reference._reaction(mp, run.links, loads, run.free, run.mass, run.weight, rate, outer)
    return loads, damping, carriages, reaction, q, v, rate
