"""What the loads really are: references that share nothing with guideload, and a check of each by other means."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import scipy

from peers.laws import Sided
from peers.problem import Array, Problem

QUARTERS = 2  # halvings of a sample interval that are always made
HALVINGS = 18  # of a sample interval, down to 4e-9 s at 1 kHz


@dataclass(eq=False)
class Contacts:
    """x, 1, u and u' as one linear system for each set of touching links (-1, 0, 1 for each), with its exponentials."""

    given: Problem
    law: Sided
    exponentials: dict[tuple[bytes, int], Array] = field(default_factory=dict)
    systems: dict[bytes, Array] = field(default_factory=dict)
    changes: int = 0

    def touching(self, x: Array) -> Array:
        d = self.given.at_rest + self.given.rows @ x
        return (d > self.law.clearance).astype(np.int8) - (d < -self.law.clearance)

    def system(self, touch: Array) -> Array:
        key = touch.tobytes()
        if key not in self.systems:
            given, n = self.given, self.given.b.size
            k = np.where(touch > 0, self.law.positive, self.law.negative) * np.abs(touch)
            z = np.zeros((n + 3, n + 3))
            z[:n, :n] = given.a - given.by * k @ given.rows
            z[:n, n] = given.constant - given.by @ (k * (given.at_rest - self.law.clearance * touch))
            z[:n, n + 1] = given.b
            z[n + 1, n + 2] = 1.0
            self.systems[key] = z
        return self.systems[key]

    def after(self, touch: Array, level: int) -> Array:
        """The exponential over the sample interval / 2^level."""
        key = (touch.tobytes(), level)
        if key not in self.exponentials:
            self.exponentials[key] = scipy.linalg.expm(self.system(touch) * self.given.step / 2**level)
        return self.exponentials[key]

    def advance(self, z: Array, touch: Array, level: int = 0) -> tuple[Array, Array]:
        """State and touching links after the interval / 2^level.

        At once where no contact can change in it, else in halves; where they cannot be halved further, with the
        crossing by the secant. Over a quarter of a sample interval, 0.3 rad of the fastest mode, no second derivative
        grows beyond twice its larger end.
        """
        n, given = self.given.b.size, self.given
        end = self.after(touch, level) @ z
        edges = np.where(touch == 0, 0.0, self.law.clearance)
        bend = [given.rows[:, : n // 2] @ (self.system(touch) @ at)[n // 2 : n] for at in (z, end)]
        second = 2.0 * np.maximum(np.abs(bend[0]), np.abs(bend[1])) + 1.0  # m/s2, of d; 1: never quite zero
        reach = second * (given.step / 2**level) ** 2 / 8.0
        room = []
        for at in (z, end):
            d = given.at_rest + given.rows @ at[:n]
            room.append(np.where(touch == 0, self.law.clearance - np.abs(d), touch * d - edges))
        # Of a function with |f''| <= s, the least value between its ends is at least the smaller end's less s h2/8.
        if level >= QUARTERS and (np.minimum(room[0], room[1]) > reach).all():
            return end, touch
        if level < HALVINGS:
            middle, touch = self.advance(z, touch, level + 1)
            return self.advance(middle, touch, level + 1)
        crossed = np.flatnonzero(room[1] < 0.0)
        if crossed.size:
            share = room[0][crossed] / (room[0][crossed] - room[1][crossed])
            first = float(np.clip(share.min(), 0.0, 1.0)) * given.step / 2**level
            at = scipy.linalg.expm(self.system(touch) * first) @ z
            touch = self.touching(end[:n])
            self.changes += 1
            end = scipy.linalg.expm(self.system(touch) * (given.step / 2**level - first)) @ at
        return end, touch


def between_events(given: Problem) -> tuple[Array, int]:
    """Loads (time, carriage, 2) of links with clearance, and the number of contact changes."""
    assert isinstance(given.law, Sided)
    n, contacts = given.b.size, Contacts(given, given.law)
    states = np.zeros((n, given.time.size))
    z = np.zeros(n + 3)
    z[n] = 1.0
    touch = contacts.touching(z[:n])
    for k in range(given.time.size - 1):
        z[n + 1], z[n + 2] = given.u[k], (given.u[k + 1] - given.u[k]) / given.step
        z, touch = contacts.advance(z, touch)
        states[:, k + 1] = z[:n]
    return given.loads_yz(states), contacts.changes
