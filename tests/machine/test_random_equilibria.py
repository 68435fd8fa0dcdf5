"""Whether every machine that can rest is accepted and every other is refused, against a linear program.

Each seed is one scene of random links: linear, sided, with play, curves that end flat, preloaded. It has an equilibrium
if and only if forces within what each law can bear balance the weight, because the elastic energy is convex. Scenes
within 1e-6 of the limit may be accepted or refused. Accepted scenes must also be in balance.
"""

import numpy as np
import pytest
from machines import carriage_ends
from scipy.optimize import linprog

from guideload import GuideloadError
from guideload._core import Law, Scene

DOFS = ["x", "y", "z", "rx", "ry", "rz"]
LIMIT = 1e-6  # of the weight, the largest entry of forces and of moments over the size of the machine
LEVERAGE = 100.0  # largest link load over the weight with which a refused scene might have rested
BALANCE = 1e-6  # of weight and loads: rounding where soft links let the body rest far away


def scene(seed: int) -> tuple[dict, np.ndarray]:
    """Arguments of the scene of a seed, and the least and largest force (links, 2) that each law can bear [N]."""
    rng = np.random.default_rng(seed)
    mass = float(10 ** rng.uniform(-3, 5))
    size = float(10 ** rng.uniform(-1, 0))
    stiffness = mass * (2 * np.pi * 10 ** rng.uniform(0.5, 2.5)) ** 2
    spread = rng.uniform(0, 3)
    if rng.random() < 0.5:
        points, directions = [], []
        for _ in range(rng.integers(2, 5)):
            center = size * rng.uniform(-1, 1, 3) * [1, 0.2, 1]
            at, along = carriage_ends(center, size * 10 ** rng.uniform(-1.5, 0))
            points.extend(at)
            directions.extend(along)
        points, directions = np.array(points), np.array(directions)
        free = DOFS[1:]
    else:
        count = rng.integers(6, 16)
        points = size * rng.uniform(-1, 1, (count, 3))
        directions = rng.standard_normal((count, 3))
        if rng.random() < 0.3:
            directions = np.eye(3)[rng.integers(3, size=count)]
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        free = [dof for dof in DOFS if rng.random() < 0.8] or ["y"]
    share = rng.uniform(0, 1)
    weight = mass * 9.80665
    made = [_law(rng, stiffness * 10 ** rng.uniform(-spread, spread), weight, share) for _ in points]
    laws, bearing = [law for law, _ in made], np.array([limits for _, limits in made])
    arguments = dict(
        mass=mass,
        center_of_mass=tuple(size * 10 ** rng.uniform(-1, 0.5) * rng.uniform(-1, 1, 3)),
        inertia=(mass * size**2 * np.diag(rng.uniform(0.3, 0.5, 3))).tolist(),
        gravity=(0.0, -9.80665, 0.0) if rng.random() < 0.7 else tuple(5 * rng.standard_normal(3)),
        free=free,
        points=points,
        directions=directions,
        laws=laws,
        damping=np.ones(len(laws)),
        damping_in_contact=np.zeros(len(laws), bool),
    )
    return arguments, bearing


def _law(rng: np.random.Generator, k: float, weight: float, share: float) -> tuple[Law, list[float]]:
    """A law, one-sided in the given share of cases, and the least and largest force that it can bear."""
    play = 0.0 if rng.random() < 0.3 else weight / k * 10 ** rng.uniform(-4, 1)
    if rng.random() < share:
        up = rng.random() < 0.5
        if rng.random() < 0.7:
            return Law.sided(k * up, k * (not up), play), [0.0, np.inf] if up else [-np.inf, 0.0]
        deflection = np.cumsum(rng.uniform(0.1, 1, 4)) * weight / k
        force = k * np.cumsum(
            np.diff(deflection, prepend=0) * [1.0, rng.uniform(0, 1), rng.uniform(0, 0.1), 0.0]
        )
        both = rng.random() < 0.5
        points = np.vstack(([[-1.0, 0.0], [0.0, 0.0]], np.column_stack((deflection, force))))
        if both:
            points = np.vstack((-np.column_stack((deflection, force))[::-1], points[1:]))
        points = points if up else -points[::-1]
        return Law.curve(np.ascontiguousarray(points)), [points[0, 1], points[-1, 1]]
    free = [-np.inf, np.inf]
    kind = rng.integers(5)
    if kind == 0:
        return Law.sided(k, k * 10 ** rng.uniform(-3, 0), play), free
    if kind == 1:
        return Law.preloaded(
            k, weight * 10 ** rng.uniform(-3, 0.5), 1.5 if rng.random() < 0.5 else 10 / 9
        ), free
    if kind == 2:
        return Law.sided(k, k, play), free
    return Law.linear(k), free


def rows(arguments: dict) -> tuple[np.ndarray, np.ndarray]:
    """Deflection of each link per unit of each free dof, with lengths in units of the machine; and the weight so."""
    points, directions = arguments["points"], arguments["directions"]
    size = np.abs(points).max()
    free = [DOFS.index(dof) for dof in arguments["free"]]
    link = np.hstack((directions, np.cross(points, directions) / size))
    force = arguments["mass"] * np.array(arguments["gravity"])
    weight = np.concatenate((force, np.cross(arguments["center_of_mass"], force) / size))
    return link[:, free], weight[free]


def not_borne(link: np.ndarray, weight: np.ndarray, bearing: np.ndarray) -> float:
    """Smallest force that must help the links to bear the weight, over the weight; 0 if there is an equilibrium."""
    n, size = len(weight), np.abs(weight).max()
    bounds = [*(bearing / size), *[(0, None)] * (2 * n)]
    cost = np.r_[np.zeros(len(link)), np.ones(2 * n)]
    help_ = linprog(cost, A_eq=np.hstack((link.T, np.eye(n), -np.eye(n))), b_eq=weight / size, bounds=bounds)
    return float(help_.fun)


def is_borne_with_margin(link: np.ndarray, weight: np.ndarray, bearing: np.ndarray) -> bool:
    """Whether the links bear the weight, and a little more in any direction, with loads that are not far larger."""
    bearing = np.clip(bearing, *(np.array([-LEVERAGE, LEVERAGE]) * np.abs(weight).max()))
    ways = np.vstack((np.eye(len(weight)), -np.eye(len(weight)))) * LIMIT * np.abs(weight).max()
    return all(not_borne(link, weight + more, bearing) < 0.01 * LIMIT for more in ways)


def judge(seed: int) -> str:
    """What became of a scene: not supported, rests, refused, or what is wrong."""
    arguments, bearing = scene(seed)
    link, weight = rows(arguments)
    if not weight.any():
        return "weightless"
    try:
        made = Scene(**arguments)
    except GuideloadError as error:
        text = str(error)
        if "not supported" in text:
            return "not supported"
        if "near the machine" in text:
            return "rests too far away"
        if "no static equilibrium" not in text:
            return f"wrong: {text}"
        return "wrong: refused" if is_borne_with_margin(link, weight, bearing) else "refused"
    missing = not_borne(link, weight, bearing)
    if missing > LIMIT:
        return f"wrong: accepted, but {missing:.1e} of the weight is not borne"
    loads = made.static_link_loads()
    gap = np.abs(link.T @ loads - weight).max() / (np.abs(weight).max() + np.abs(loads).max())
    return "rests" if gap < BALANCE else f"wrong: out of balance by {gap:.1e}"


@pytest.mark.parametrize("first", range(0, 200, 50))
def test_a_machine_rests_if_and_only_if_its_links_can_bear_the_weight(first):
    found = {seed: judge(seed) for seed in range(first, first + 50)}
    assert not {seed: text for seed, text in found.items() if text.startswith("wrong")}
    assert {"rests", "refused"} <= set(found.values())
