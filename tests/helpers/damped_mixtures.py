"""Random damped machines of mixed laws, and motions.

Preloads, plays and curves lie up to four decades below the loads, stamps are uneven and some are equal, the drive may
have play.
"""

from __future__ import annotations

import numpy as np
from random_machines import law_keys

from guideload import Machine, Motion

TRUSTED = 1e-7  # of the load scale: difference of two methods that makes a reference
KINDS = ("linear", "sides", "play", "curve", "preload", "preload")


def scene(seed: int, kinds: tuple[str, ...] = KINDS) -> tuple[Machine, Motion]:
    """The machine and the motion of a seed; its links have laws of these kinds."""
    rng = np.random.default_rng((seed, 41))

    def decades(low: float, high: float) -> float:
        return float(10 ** rng.uniform(low, high))

    mass, size, ratio = decades(0, 3), rng.uniform(0.3, 1.2), decades(-1.3, 0.5)
    arms = size * rng.uniform(-0.6, 0.6, (6, 3))
    arms -= arms.mean(axis=0)
    inertia = mass / 6 * (np.einsum("ij,ij", arms, arms) * np.eye(3) - arms.T @ arms)
    frequency, spread, load = decades(1.3, 3.0), rng.uniform(0.0, 2.0), mass * 9.81 / 4
    carriages = []
    for name, rail, x in (("a", "l", -0.5), ("b", "r", -0.4), ("c", "l", 0.6), ("d", "r", 0.5))[
        : rng.integers(3, 5)
    ]:
        stiffness = mass * frequency**2 / 4 * decades(-spread / 2, spread / 2)
        damping = 2 * ratio * np.sqrt(stiffness * mass / 4)
        y, z = (law_keys(rng, kinds, stiffness, load, suffix, smallest=-4.0) for suffix in ("_y", "_z"))
        keys = y | z
        if any(key.startswith("preload") for key in keys):
            keys["rolling"] = str(rng.choice(["ball", "roller"]))
        place = {"name": name, "rail": rail, "x": size * x, "length": size * rng.uniform(0.1, 0.5)}
        carriages.append(keys | place | {"damping_y": damping, "damping_z": 0.9 * damping})
    free, links = ["y", "z", "rx", "ry", "rz"], []
    if rng.random() < 0.5:
        free = ["x", *free]
        stiffness = mass * frequency**2 * decades(-1, 1)
        drive = {
            "name": "drive",
            "point": [0.0, 0.05, 0.05],
            "direction": [1.0, 0.05, 0.0],
            "stiffness": stiffness,
        }
        drive["damping"] = 2 * ratio * np.sqrt(stiffness * mass)
        if "play" in kinds and rng.random() < 0.5:
            drive["clearance"] = load / stiffness * decades(-3, 0)
        links.append(drive)
    machine = Machine(
        name="mixture",
        free=free,
        gravity=(0.0, -9.80665, 0.0),
        body={
            "mass": mass,
            "center_of_mass": (size * rng.uniform(-0.4, 0.4, 3)).tolist(),
            "inertia": inertia.tolist(),
        },
        rails=[
            {"name": "l", "position": [0.1 * size, -0.8 * size]},
            {"name": "r", "position": [0.0, 0.8 * size]},
        ],
        carriages=carriages,
        links=links,
    )
    count = int(decades(0.7, 2.0))
    steps = decades(-1.0, 1.5) / frequency * rng.uniform(0.2, 1.8, count)
    steps[3 * rng.choice(count // 3, count // 30, replace=False)] = 0.0  # two samples at one time: a jump
    acceleration = np.zeros((count, 3))
    acceleration[:, 0] = decades(-1, 1) * np.cumsum(rng.standard_normal(count)) / np.sqrt(count)
    wrench = np.zeros((count, 6))
    if rng.random() < 0.5:
        wrench[:, 1:3] = load * decades(-1, 0.5) * rng.standard_normal((count, 2))
    return machine, Motion(np.cumsum(steps), acceleration, wrench=wrench)
