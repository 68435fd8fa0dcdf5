"""Time of the cart with one more feature of the machine, over that of the cart without it, alternated in one process.

    python tests/benchmarks/machine_cost.py

Prints processor times in ms and ratios of medians, for `peak_loads`, for `simulate`, and for its result with all
quantities. Features: rows that resist roll, rails turned by 45 degrees, a point, an elastic base, ten changes of
payload. `riders.py` has moving riders.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

from reference import cart, cycle

from guideload import Machine, Motion, peak_loads, simulate

ROUNDS = 25
CRATE: dict[str, Any] = {
    "name": "crate",
    "mass": 90.0,
    "center_of_mass": (0.3, 0.25, -0.1),
    "inertia": ((1.5, 0.0, 0.0), (0.0, 1.2, 0.0), (0.0, 0.0, 0.9)),
    "times": [(start, start + 0.5) for start in (0.7, 1.7, 2.7, 3.7, 4.7)],
}
TOOL = {"name": "tool", "at": (0.0, -0.4, 0.1)}


def machines() -> dict[str, Machine]:
    """The cart, and the cart with each feature."""
    plain = cart()

    def changed(**keys: Any) -> Machine:
        return Machine(**{**{key: getattr(plain, key) for key in type(plain).model_fields}, **keys})

    def each(parts: tuple[Any, ...], **keys: Any) -> list[Any]:
        return [part.model_copy(update=keys) for part in parts]

    wide = each(plain.carriages, width=0.03)
    compliance = [[1e-10 if i == j else 0.0 for j in range(6)] for i in range(6)]
    return {
        "as it is": plain,
        "rows": changed(carriages=wide),
        "rows, turned rails, a point": changed(
            carriages=wide, rails=each(plain.rails, roll=0.785), points=[TOOL]
        ),
        "elastic base": changed(base={"compliance": compliance}),
        "ten changes of payload": changed(payloads=[CRATE]),
    }


CALLS: dict[str, Callable[[Machine, Motion], object]] = {
    "peak_loads": peak_loads,
    "simulate": lambda machine, motion: simulate(machine, motion).carriage_loads,
    "simulate, all quantities": lambda machine, motion: simulate(machine, motion).quantities,
}


def main() -> None:
    motion, kinds = cycle(), machines()
    for name, call in CALLS.items():
        times: dict[str, list[float]] = {kind: [] for kind in kinds}
        for round_ in range(ROUNDS + 1):  # the first one warms up
            for kind, machine in kinds.items():
                begin = time.process_time()
                call(machine, motion)
                if round_:
                    times[kind].append(time.process_time() - begin)
        median = {kind: statistics.median(each) for kind, each in times.items()}
        print(name)
        for kind, seconds in median.items():
            print(f"  {kind:28} {1e3 * seconds:7.2f} ms   {seconds / median['as it is']:5.2f} x")


if __name__ == "__main__":
    main()
