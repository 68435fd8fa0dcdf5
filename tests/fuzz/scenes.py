"""Random machines of every mixture of laws against an independent reference.

    python tests/fuzz/scenes.py [MACHINES] [FIRST_SEED]

Each seed is one machine file and one motion. Every method that can solve it runs at each tolerance; its carriage and
link loads are compared with those of `plain_reference`. The error is the largest difference over the load scale and
over the tolerance.
"""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

import random_machines
import tomli_w
from plain_reference import NoReference, PlainMachine

from guideload import GuideloadError, Machine

RTOLS = 1e-4, 1e-6, 1e-8
METHODS = "exact", "exponential", "rk45", "implicit"
FLOOR = 1e-9  # of the load scale: what the reference itself is good for
GOAL = 10.0


def errors(seed: int, folder: Path, rtols: tuple[float, ...] = RTOLS) -> dict[tuple[str, float], float]:
    """Error of each run in units of its tolerance; raises NoReference, or GuideloadError for a refused machine."""
    values = random_machines.values(seed)
    time, acceleration, wrench = random_machines.motion(seed, values["body"]["mass"])
    links, carriages = PlainMachine(values).loads(time, acceleration, wrench)
    file = folder / "machine.toml"
    file.write_text(tomli_w.dumps(values))
    machine = Machine.from_toml(file)
    found = {}
    for method in METHODS:
        if method in ("exact", "exponential") and machine.model_level == "smooth nonlinear":
            if method == "exact" or machine.scene.has_segments:
                continue
        for rtol in rtols:
            solution = machine.scene.solve(time, acceleration, wrench, method=method, rtol=rtol)
            scale = solution.load_scale
            loads = solution.group_loads(machine.links_of_carriages, machine.carriage_centers, "total")
            arms = max(carriage.length for carriage in machine.carriages)
            gap = max(
                np.abs(solution.link_loads("total") - links).max(),
                np.abs(loads - carriages)[:, :, :3].max() / 2.0,  # a force is the sum of two links
                np.abs(loads - carriages)[:, :, 3:].max() / arms,
            )
            found[method, rtol] = float(gap / scale / max(rtol, FLOOR))
    return found


def main() -> None:
    count, first = (int(x) for x in (sys.argv[1:] + ["300", "0"][len(sys.argv) - 1 :]))
    told: Counter[str] = Counter()
    table: list[tuple[str, float, float]] = []
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, first + count):
            try:
                found = errors(seed, Path(folder))
            except NoReference as reason:
                told[f"no reference: {reason}"] += 1
                continue
            except GuideloadError as error:
                told["refused"] += 1
                print(f"{seed}: refused: {error}", flush=True)
                continue
            told["compared"] += 1
            table += [(*key, error) for key, error in found.items()]
            beyond = [f"{m} {r:g}: {e:.3g}" for (m, r), e in found.items() if not e <= GOAL]
            if beyond:
                told["failed"] += 1
                print(f"{seed}: error / rtol {', '.join(beyond)}", flush=True)
    print(", ".join(f"{number} {name}" for name, number in told.items()))
    for method in METHODS:
        for rtol in RTOLS:
            of = [error for name, at, error in table if (name, at) == (method, rtol)]
            if of:
                quantiles = ", ".join(f"{q} %: {np.percentile(of, q):.2g}" for q in (50, 95, 100))
                print(f"{method:11} {rtol:g}: {len(of)} runs, error / rtol {quantiles}")
    sys.exit(told["failed"] > 0)


if __name__ == "__main__":
    main()
