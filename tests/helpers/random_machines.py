"""Random machines and motions as the values of their files: every law, extra links, any free degrees of freedom."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
FREE = (["y", "z", "rx", "ry", "rz"], ["rx", "ry", "rz"], ["x", "y", "z", "rx", "ry", "rz"])
KINDS = ("linear", "sides", "play", "curve", "preload")


def values(seed: int, kinds: tuple[str, ...] = KINDS) -> dict[str, Any]:
    """A machine with links of the given kinds, in SI numbers; its modes lie between some 10 and 1000 rad/s."""
    rng = np.random.default_rng((seed, 1))
    mass, size = 10.0 ** rng.uniform(0, 3.5), 10.0 ** rng.uniform(-0.5, 0)
    points = size * rng.uniform(-0.5, 0.5, (6, 3))  # six point masses: an inertia that a body can have
    center = points.mean(axis=0)
    arms = points - center
    inertia = mass / 6 * (np.einsum("ij,ij", arms, arms) * np.eye(3) - arms.T @ arms)
    stiffness = mass * (2 * np.pi * 10.0 ** rng.uniform(0.7, 1.3)) ** 2 / 4
    load, ratio = mass * 9.81 / 4, 10.0 ** rng.uniform(-1.5, -0.3)
    free = FREE[rng.integers(len(FREE))]
    machine: dict[str, Any] = {
        "free": free,
        "body": {"mass": mass, "center_of_mass": center.tolist(), "inertia": inertia.tolist()},
        "rails": [
            {"name": name, "position": (size * rng.uniform((-0.1, low), (0.1, low + 0.5))).tolist()}
            for name, low in (("1", -1.0), ("2", 0.5))
        ],
        "carriages": [],
        "links": [],
    }
    for rail in ("1", "2"):
        for x in (-0.5, 0.5)[: int(rng.integers(1, 3))]:
            k = stiffness * 10.0 ** rng.uniform(-0.5, 0.5)
            keys = law_keys(rng, kinds, k, load, "_y") | law_keys(rng, kinds, k, load, "_z")
            carriage = keys | {
                "name": f"{rail}{x}",
                "rail": rail,
                "x": size * x * rng.uniform(0.7, 1.3),
                "length": size * rng.uniform(0.1, 0.6),
                "damping_y": 2 * ratio * np.sqrt(k * mass / 4),
                "damping_z": 2 * ratio * np.sqrt(k * mass / 4),
            }
            if any(keys.get(f"clearance{suffix}") for suffix in ("_y", "_z")) and rng.random() < 0.5:
                carriage["damping_in_contact"] = True
            machine["carriages"].append(carriage)
    if "x" in free:
        k = stiffness * 10.0 ** rng.uniform(-0.5, 0.5)
        rack = {"name": "rack", "point": [0.0, 0.0, 0.0], "direction": [1.0, 0.2, 0.0], "stiffness": k}
        machine["links"].append(rack | {"damping": 2 * ratio * np.sqrt(k * mass)})
    return machine


def law_keys(
    rng: np.random.Generator,
    kinds: tuple[str, ...],
    k: float,
    load: float,
    suffix: str,
    smallest: float = -1.5,
) -> dict[str, Any]:
    """The keys of a law whose features lie about the deflection under `load`, so many decades below it at most."""
    travel = load / k * 10.0 ** rng.uniform(smallest, 0.5)
    match kinds[rng.integers(len(kinds))]:
        case "linear":
            return {f"stiffness{suffix}": k}
        case "sides":
            return {f"stiffness{suffix}": {"positive": k, "negative": k * 10.0 ** rng.uniform(-1, 0)}}
        case "play":
            return {f"stiffness{suffix}": k, f"clearance{suffix}": travel}
        case "curve":
            deflections = np.cumsum(rng.uniform(0.2, 1.0, 4)) * travel
            forces = np.cumsum(np.diff(deflections, prepend=0.0) * k * rng.choice([0.1, 0.5, 1.0], 4))
            return {f"curve{suffix}": [[0.0, 0.0], *np.column_stack((deflections, forces)).tolist()]}
        case _:
            keys = {f"stiffness{suffix}": k, f"preload{suffix}": load * 10.0 ** rng.uniform(smallest, 0.5)}
            return keys | {"rolling": "ball"}


def motion(seed: int, mass: float) -> tuple[Array, Array, Array | None]:
    """Stamps, accelerations and perhaps process forces: pulses, noise, uneven stamps, now and then a jump."""
    rng = np.random.default_rng((seed, 2))
    count = int(rng.integers(4, 30))
    steps = 10.0 ** rng.uniform(-3, -1.7) * np.ones(count)
    if rng.random() < 0.3:
        steps *= rng.uniform(0.3, 1.7, count)
    if rng.random() < 0.3:
        steps[count // 2] = 0.0
    acceleration = np.zeros((count, 3))
    acceleration[:, 0] = 10.0 ** rng.uniform(-0.5, 1.0) * rng.standard_normal(count)
    wrench = None
    if rng.random() < 0.4:
        wrench = mass * rng.standard_normal((count, 6)) * [1.0, 3.0, 3.0, 0.3, 0.3, 0.3]
    return np.cumsum(steps), acceleration, wrench
