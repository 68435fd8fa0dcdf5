"""Whether rk45 and implicit keep their tolerance on damped scenes of any mixture of laws that includes preloaded links.

    python tests/benchmarks/mixed_laws.py [SCENES] [FIRST_SEED]

Each seed is one scene: mass 1e-3 to 1e5 kg, damping ratio 0.05 to 10, a spread of stiffness of up to 1e6, 3 to 200
samples, some with process forces and jumps. The reference is implicit at 1e-12; it is trusted where rk45, or implicit
at 1e-11 where rk45 would take too long, agrees with it to 1e-7. The error is the largest difference of any link load
at any sample, over the load scale and rtol.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from guideload import GuideloadError
from guideload._core import Law, Scene, Solution

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))
from machines import carriage_ends

RTOLS = 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8
METHODS = "rk45", "implicit"
TRUSTED = 1e-7  # of the load scale
LONGEST_EXPLICIT = 2e5  # duration times fastest eigenvalue up to which rk45 is run: its stability limit
GOAL, USUAL, USUAL_SHARE = 10.0, 3.0, 0.95


@dataclass(frozen=True)
class Case:
    """A random scene and its excitation."""

    scene: Scene
    time: np.ndarray
    acceleration: np.ndarray
    wrench: np.ndarray | None

    @property
    def explicit(self) -> bool:
        """Whether rk45 can follow it in a reasonable time; a segment may be ten times as stiff as at rest."""
        fastest = np.abs(self.scene.modes()[3]).max()
        return bool(10 * fastest * np.ptp(self.time) < LONGEST_EXPLICIT)

    def solve(self, method: str, rtol: float) -> Solution:
        return self.scene.solve(self.time, self.acceleration, self.wrench, method=method, rtol=rtol)


def case(seed: int) -> Case:
    """The scene of a seed."""
    rng = np.random.default_rng(seed)

    def decades(low: float, high: float) -> float:
        return float(10 ** rng.uniform(low, high))

    mass, size, ratio = decades(-3, 5), decades(-1, 0), decades(np.log10(0.05), 1)
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    inertia = turn @ np.diag(mass * size**2 * rng.uniform(0.3, 0.5, 3)) @ turn.T
    inertia = 0.5 * (inertia + inertia.T)
    frequency, spread = decades(0.5, 2.5), rng.uniform(0, 6)
    load = mass * 9.81 / 4
    points, directions, laws, damping, in_contact = [], [], [], [], []
    for x, z in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
        center = size * np.array([x, 0.0, z]) * rng.uniform(0.7, 1.3, 3) + [
            0,
            rng.uniform(-0.3, 0.3) * size,
            0,
        ]
        at, along = carriage_ends(center, size * rng.uniform(0.1, 0.5))
        stiffness = mass * (2 * np.pi * frequency) ** 2 / 8 * decades(-spread / 2, spread / 2)
        for axis in range(2):
            law, contact = _law(rng, stiffness, load * decades(-1, 0.5))
            for end in range(2):
                points.append(at[axis + 2 * end])
                directions.append(along[axis + 2 * end])
                laws.append(law)
                damping.append(2 * ratio * np.sqrt(stiffness * mass / 8))
                in_contact.append(contact)
    if not any(law.kind == "preloaded" for law in laws):
        laws[0] = laws[2] = Law.preloaded(
            mass * (2 * np.pi * frequency) ** 2 / 8, load * decades(-1.5, 0.5), 1.5
        )
        in_contact[0] = in_contact[2] = False
    count = int(decades(np.log10(3), np.log10(200)))
    step = decades(-2, 0.7) / frequency
    steps = np.full(count, step)
    steps[3 * rng.choice(count // 3, count // 30, replace=False)] = 0.0  # two samples at one time: a jump
    time = np.cumsum(steps)
    acceleration = np.zeros((count, 3))
    acceleration[:, 0] = decades(-1, 1) * np.cumsum(rng.standard_normal(count)) / np.sqrt(count)
    wrench = None
    if rng.random() < 0.5:
        wrench = np.zeros((count, 6))
        wrench[:, 1:3] = load * decades(-1, 1) * np.clip(rng.standard_normal((count, 2)), -1, 1)
        wrench[:, 3:] = size * wrench[:, [1, 2, 1]] * rng.uniform(-1, 1, 3)
    scene = Scene(
        mass=mass,
        center_of_mass=tuple(size * rng.uniform(-0.3, 0.3, 3)),
        inertia=inertia.tolist(),
        gravity=(0.0, -9.80665, 0.0),
        free=["y", "z", "rx", "ry", "rz"] if rng.random() < 0.8 else ["rx", "ry", "rz"],
        points=np.array(points),
        directions=np.array(directions),
        laws=laws,
        damping=np.array(damping),
        damping_in_contact=np.array(in_contact),
    )
    return Case(scene, time, acceleration, wrench)


def _law(rng: np.random.Generator, stiffness: float, load: float) -> tuple[Law, bool]:
    """A law whose features lie about `load`, and whether its damper acts in contact only."""
    travel = load / stiffness * 10 ** rng.uniform(-3, 0.5)
    match rng.integers(7):
        case 0:
            return Law.linear(stiffness), False
        case 1:
            return Law.sided(stiffness, stiffness * 10 ** rng.uniform(-3, 0), 0.0), False
        case 2:
            return Law.sided(stiffness, stiffness, travel), bool(rng.integers(2))
        case 3:
            other = 0.0 if rng.random() < 0.3 else stiffness * 10 ** rng.uniform(-3, 0)
            sides = (stiffness, other) if rng.random() < 0.5 else (other, stiffness)
            return Law.sided(*sides, travel), bool(rng.integers(2))
        case 4:
            deflection = np.cumsum(rng.uniform(0.05, 1, 5)) * travel
            force = np.cumsum(np.diff(deflection, prepend=0) * stiffness * rng.choice([0, 0.01, 0.3, 1], 5))
            force[-1] += 0.1 * stiffness * travel
            points = np.column_stack((deflection, force))
            return Law.curve(np.vstack((-points[::-1], [[0.0, 0.0]], points))), False
        case kind:
            exponent = 1.5 if kind == 5 else 10 / 9
            return Law.preloaded(stiffness, load * 10 ** rng.uniform(-2, 0.5), exponent), False


def errors(case: Case) -> dict[tuple[str, float], float] | str:
    """Error over rtol of each run, inf for a refused one; or why there is no trusted reference."""
    methods = METHODS if case.explicit else METHODS[1:]
    try:
        found = case.solve("implicit", 1e-12)
        other = case.solve(methods[0], 1e-11)
    except GuideloadError as error:
        return f"reference refused: {error}"
    truth, scale = found.link_loads("total"), found.load_scale
    gap = np.abs(other.link_loads("total") - truth).max() / scale
    if not gap <= TRUSTED:
        return f"references differ by {gap:.1e}"
    out = {}
    for method in methods:
        for rtol in RTOLS:
            try:
                loads = case.solve(method, rtol).link_loads("total")
                out[method, rtol] = float(np.abs(loads - truth).max() / scale / rtol)
            except GuideloadError:
                out[method, rtol] = np.inf
    return out


def main() -> None:
    count, first = (int(x) for x in (sys.argv[1:] + ["200", "0"][len(sys.argv) - 1 :]))
    made, untrusted, table = 0, 0, []
    for seed in range(first, first + count):
        try:
            scene = case(seed)
        except GuideloadError:
            continue  # no static equilibrium
        made += 1
        found = errors(scene)
        if isinstance(found, str):
            untrusted += 1
            print(f"{seed}: {found}", flush=True)
            continue
        table += [(seed, method, rtol, error) for (method, rtol), error in found.items()]
        if max(found.values()) > GOAL:
            worst = ", ".join(f"{m} {r:g}: {e:.3g}" for (m, r), e in found.items() if e > GOAL)
            print(f"{seed}: error / rtol {worst}", flush=True)
    print(f"{made} scenes, {untrusted} without a trusted reference")
    for method in METHODS:
        all_errors = np.array([error for _, name, _, error in table if name == method])
        if not all_errors.size:
            continue
        ran = all_errors[np.isfinite(all_errors)]
        quantiles = ", ".join(f"{q} %: {np.percentile(ran, q):.2g}" for q in (50, 95, 99, 100))
        print(
            f"{method:9} {all_errors.size} runs, error / rtol {quantiles}; "
            f"above {USUAL:g}: {np.mean(all_errors > USUAL):.1%} (goal {1 - USUAL_SHARE:.0%}), "
            f"above {GOAL:g}: {np.sum(ran > GOAL)}, refused: {all_errors.size - ran.size}"
        )


if __name__ == "__main__":
    main()
