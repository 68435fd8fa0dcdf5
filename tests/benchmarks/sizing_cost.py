"""What sizing and the HTML report cost: `python tests/benchmarks/sizing_cost.py`.

    --profile    where the time of sizing goes

Sizing: 50 products on the yardstick's cart and cycle, 7062 samples, four carriages, linear laws. Each product has its
own ratings and stiffness. Time of the whole call in one process, on one core.

Report: `guideload run` of the packaged example with --report alone, as a whole process: time, processor time, size.
"""

from __future__ import annotations

import argparse
import cProfile
import os
import pstats
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

from clock import on_cores, processor, timed
from reference import cart, cycle

import guideload
from guideload import Catalogue, LifeConditions, Product
from guideload.motion.motion import Motion
from guideload.sizing import size

PRODUCTS, REPEATS = 50, 5
WANTED = LifeConditions(life=2e7, safety=3.0)


def product(index: int) -> Product:
    """A made-up product; ratings and stiffness grow with the index."""
    rating = 1e4 + 1e3 * index
    return Product(
        name=f"{index}",
        maker="made up",
        edition="1",
        type="ball",
        static=1.5 * rating,
        dynamic={"value": rating, "base": 1e5},
        static_moments={"roll": 500.0, "pitch": 400.0, "yaw": 400.0},
        preload_classes=[{"name": "A", "stiffness": 1e8 + 5e6 * index}],
        carriage_length=0.1,
    )


def moving() -> Motion:
    """The cycle, with its velocity and position."""
    motion = cycle()
    step = np.diff(motion.time)
    acceleration = motion.acceleration[:, 0]
    gain = 0.5 * step * (acceleration[1:] + acceleration[:-1])
    velocity = np.concatenate([[0.0], np.cumsum(gain)])
    position = np.concatenate([[0.0], np.cumsum(0.5 * step * (velocity[1:] + velocity[:-1]))])
    return Motion.along_x(motion.time, acceleration, velocity=velocity, position=position)


def report() -> tuple[float, float, int]:
    """Seconds, processor seconds and bytes of the example's report, written by a process of its own."""
    examples = Path(guideload.__file__).parent / "examples"
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "report.html"
        files = [str(examples / name) for name in ("manipulator.toml", "manipulator.csv")]
        begin, used = time.perf_counter(), os.times()
        command = [sys.executable, "-m", "guideload", "run", *files, "--report", str(page)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        seconds, now = time.perf_counter() - begin, os.times()
        work = now.children_user + now.children_system - used.children_user - used.children_system
        return seconds, work, page.stat().st_size


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--profile", action="store_true")
    arguments = parser.parse_args()
    runs = [report() for _ in range(REPEATS)]
    wall, work = (statistics.median(column) for column in list(zip(*runs, strict=True))[:2])
    print(
        f"report of the example: {1e-6 * runs[0][2]:.2f} MB; whole process median {wall:.2f} s, "
        f"on the processor {work:.2f} s"
    )
    on_cores(1)
    machine, motion = cart(), moving()
    catalogue = Catalogue(products=[product(i) for i in range(PRODUCTS)])
    begin = time.process_time()
    seconds = [timed(lambda: size(machine, motion, catalogue, conditions=WANTED)) for _ in range(REPEATS)]
    print(
        f"{PRODUCTS} products, {motion.time.size} samples, {len(machine.carriages)} carriages; {processor()}"
    )
    work = (time.process_time() - begin) / REPEATS
    print(
        f"first {seconds[0]:.2f} s, median {statistics.median(seconds):.2f} s, on the processor {work:.2f} s"
    )
    if arguments.profile:
        with cProfile.Profile() as profile:
            size(machine, motion, catalogue, conditions=WANTED)
        pstats.Stats(profile).sort_stats("cumulative").print_stats(45)


if __name__ == "__main__":
    main()
