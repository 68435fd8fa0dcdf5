"""A cart whose carriages name a product, and its motions."""

from __future__ import annotations

from typing import Any

from machines import carriage, machine
from moves import Move

from guideload.catalogue.product import Product
from guideload.life.life import Life
from guideload.life.mean_load import integrals, mean_load
from guideload.machine.components import Rail
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion

PRODUCT: dict[str, Any] = {
    "name": "20",
    "maker": "m",
    "edition": "e",
    "type": "ball",
    "dynamic": {"value": "40 kN", "base": "50 km"},
    "static": "60 kN",
    "static_moments": {"roll": 600.0, "pitch": 500.0, "yaw": 500.0},
    "preload_classes": [{"name": "A", "stiffness": "400 N/um"}],
    "carriage_length": "100 mm",
}


def cart(**changes: Any) -> Machine:
    """A body on two rails with two carriages each, all of one product."""
    rails = [Rail(name="1", position=(0.05, -0.35)), Rail(name="2", position=(0.05, 0.35))]
    places = [("1a", "1", -0.3), ("1b", "1", 0.3), ("2a", "2", -0.3), ("2b", "2", 0.3)]
    carriages = [carriage(name, rail=rail, x=x, length=0.05, product="20") for name, rail, x in places]
    return machine(*carriages, rails=rails, products=[Product(**PRODUCT)], **changes)


def on_lines(life: Life) -> list[float]:
    """The lives [m] of the carriages under loads on lines between the instants, which have derivatives."""
    return [
        float(one.life_under(mean_load(*integrals(life.record.travel, loads, one.rule, p), p)))
        for one in life.carriages
        for p, loads in [(one.rating.exponent, life.record.result.carriage_loads[:, one.index])]
    ]


def moved(move: Move, rate: float = 1000.0) -> Motion:
    time = move.times(rate)
    position, velocity, acceleration = move.motion(time)
    return Motion.along_x(time, acceleration, velocity=velocity, position=position)
