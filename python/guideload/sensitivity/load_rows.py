"""Loads of carriages and links of a linear machine as functions of its state, with derivatives by p values.

A load is the force that the body exerts on its guide. Around rest it changes by rows[0] @ q + rows[1] @ q' for small
motions q of L (six dofs).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from guideload.base.arrays import Array
from guideload.machine.machine import Machine
from guideload.parameters.parameters import Change


class LoadRows:
    """Rows (2, 6) of loads, and their derivatives (p, 2, 6), at values (p,) of columns that make these changes."""

    def __init__(self, machine: Machine, changes: Sequence[Change], values: Array) -> None:
        self.machine, self._changes, self._values = machine, changes, values
        self._directions = machine.link_table().directions

    @cached_property
    def _numbers(self) -> tuple[dict[str, Array], dict[str, Array]]:
        """Points, stiffness and damping of the links, and centres of the carriages; their derivatives (p, ...)."""
        table = self.machine.link_table()
        now: dict[str, Array] = {
            "point": table.points.copy(),
            "law": table.stiffness[:, None].copy(),
            "damping": table.damping[:, None].copy(),
            "center": self.machine.carriage_places[:, :3].copy(),
        }
        by = {kind: np.zeros((self._values.size, *each.shape)) for kind, each in now.items()}
        for (kind, index, part), constant, terms in self._changes:
            if kind in now:
                place = index, part if isinstance(part, int) else 0
                now[kind][place] = constant + sum(factor * self._values[column] for column, factor in terms)
                for column, factor in terms:
                    by[kind][(column, *place)] += factor
        return now, by

    def of_link(self, link: int) -> tuple[Array, Array]:
        """Of the load along a link [N], given its index."""
        (now, by_now), direction = self._numbers, self._directions[link]
        row, by_row = (
            _about(direction, now["point"][link]),
            _change_about(direction, by_now["point"][:, link]),
        )
        elastic, damping = now["law"][link, 0], now["damping"][link, 0]
        by_elastic, by_damping = by_now["law"][:, link, 0], by_now["damping"][:, link, 0]
        by = [np.outer(by_elastic, row) + elastic * by_row, np.outer(by_damping, row) + damping * by_row]
        return np.array([elastic * row, damping * row]), np.stack(by, axis=1)

    def of_carriage(self, carriage: int, component: int) -> tuple[Array, Array]:
        """Of a component of the load of a carriage [N, N m], about its centre and along its own axes: 0 Fx to 5 Mz."""
        now, by_now = self._numbers
        along = np.kron(np.eye(2), self.machine.carriage_axes[carriage])[component]
        center, by_center = now["center"][carriage], by_now["center"][:, carriage]
        rows, by_rows = np.zeros((2, 6)), np.zeros((len(by_center), 2, 6))
        for link in self.machine.links_of_carriages[carriage].tolist():
            of_link, by_of_link = self.of_link(link)
            direction, arm = self._directions[link], now["point"][link] - center
            share = along @ _about(direction, arm)
            by_share = _change_about(direction, by_now["point"][:, link] - by_center) @ along
            rows += share * of_link
            by_rows += share * by_of_link + by_share[:, None, None] * of_link
        return rows, by_rows


def _about(direction: Array, arm: Array) -> Array:
    """(6,) force along a direction and its moment, for an arm (3,)."""
    return np.concatenate([direction, np.cross(arm, direction)])


def _change_about(direction: Array, by_arm: Array) -> Array:
    """(p, 6) its derivatives, from those (p, 3) of the arm."""
    return np.hstack([np.zeros((len(by_arm), 3)), np.cross(by_arm, direction)])
