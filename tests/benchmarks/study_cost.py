"""What a study costs, by its number of scenes, of samples and of links: `python tests/benchmarks/study_cost.py`.

    --quick           fewer and smaller points
    --picture FILE    the chart
    --drawn           only the last part: drawn motions

The yardstick's cart and its draws (monte_carlo.py), peaks of the y and z load of four carriages, run by the
core's `Batch` on one thread held on one core, in chunks of 8192 scenes, with linear links, with 5 um of
clearance in each, and with preloaded ball contacts, to a tolerance of 1e-6. Scenes: of the cycle's 7062
samples and the cart's 16 links. Samples: the cycle again and again, from the end of its first rest on. Links:
each carriage's stiffness and damping shared by ever more ends, from one on; fewer than 8 links do not hold
the body.

All points of a line take turns; times are medians. A point that would take more than a minute is left out. The
exponent e of cost ~ n^e is fitted over all points, and over the last decade: with few samples, much of a scene
is its set-up, which does not grow with them. So cost = once + each n is fitted too.

Last, the packaged machine and its trace: a study of linear and of clear scenes with one motion, and with a motion
for each scene, drawn from the posterior of the trace, by turns.
"""

from __future__ import annotations

import argparse
import statistics
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import harness
import numpy as np
from harness import timed
from machines import with_carriages
from matplotlib.axes import Axes
from numpy.typing import NDArray
from reference import cart, core_batch, cycle, example

from guideload import Study
from guideload._core import Batch, Law
from guideload.plots.style import CARRIAGE_COLORS, GREY, INK, look, new_figure

Array = NDArray[np.float64]

CHUNK = 8192
CLEARANCE, PRELOAD = 5e-6, 1200.0  # m, N of each carriage and direction
REST = 600  # samples at the cycle's beginning
LINKS, SAMPLES = 16, 7062  # where they do not vary
SPREAD = 0.06  # m, from the centre of a carriage to its ends
ROUNDS, LONG, LONGEST = 9, 1.0, 60.0  # runs of a point, s from which on one is enough, s that it may take
RECORDED: dict[str, dict[str, tuple[str, ...]]] = {
    "all": {},
    "peak resultants": {"quantities": ("resultant",), "statistics": ("max",)},
    "peaks of Fy and Fz": {"quantities": ("Fy", "Fz"), "statistics": ("min", "max")},
}
LAWS = ("linear", "5 \N{MICRO SIGN}m clearance", "preloaded")
Job = tuple[int, Batch, int]  # the count that varies, what runs, so many scenes


@dataclass(eq=False)
class Line:
    """The cost over one of the counts."""

    title: str
    law: str
    counts: list[int] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)  # of all scenes, or of one

    def exponent(self, last: float = np.inf) -> float:
        """e of cost ~ n^e, over the counts down to the largest / last."""
        kept = [i for i, count in enumerate(self.counts) if count * last >= self.counts[-1]]
        if len(kept) < 2:
            return float("nan")
        logs = np.log([[values[i] for i in kept] for values in (self.counts, self.seconds)])
        return float(np.polyfit(logs[0], logs[1], 1)[0])

    def parts(self) -> tuple[float, float]:
        """What each has to bear, and what one of the count costs, s: cost = once + each n, least relative squares."""
        weights = 1.0 / np.array(self.seconds)
        of = np.column_stack([weights, weights * np.array(self.counts)])
        once, each = np.linalg.lstsq(of, np.ones(len(weights)), rcond=None)[0]
        return float(once), float(each)

    @property
    def slope(self) -> float:
        """The exponent that counts: of the last decade, where set-up is small; over all numbers of links."""
        return self.exponent(np.inf if self.title == "links" else 10.0)


def main() -> None:
    """Measure all, print all."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="fewer and smaller points")
    parser.add_argument("--picture", type=Path, metavar="FILE", help="where to write the chart")
    parser.add_argument("--drawn", action="store_true", help="only what drawn motions cost")
    asked = parser.parse_args()
    harness.on_cores(1)
    if asked.drawn:
        print(*drawn_motions(asked.quick), sep="\n")
        return
    panels = measure(asked.quick)
    for lines in panels:
        for line in lines:
            print_line(line)
    print(*drawn_motions(asked.quick), sep="\n")
    made_on = f"One thread of {harness.processor()}."
    print(made_on)
    if asked.picture:
        draw(panels, made_on, asked.picture)


# ---- measure


def measure(quick: bool) -> list[list[Line]]:
    """For scenes, samples and links a line of each law."""
    scenes = [10**power for power in range(2, 5 if quick else 7)]
    samples = [1000, 3000, 10_000, 30_000] if quick else [1000, 2000, 5000, 10_000, 20_000, 50_000, 100_000]
    links = [8, 32, 128] if quick else [8, 16, 32, 64, 128, 256]
    rounds = 2 if quick else ROUNDS
    panels: list[list[Line]] = [[], [], []]
    for law, several in zip(LAWS, (128, 16, 8) if quick else (1024, 64, 32), strict=True):
        usual = batch(law, SAMPLES, LINKS)
        jobs: dict[str, list[Job]] = {
            "scenes": [(count, usual, count) for count in scenes],
            "samples": [(count, batch(law, count, LINKS), several) for count in samples],
            "links": [(count, batch(law, SAMPLES, count), several) for count in links],
        }
        for panel, (title, of) in zip(panels, jobs.items(), strict=True):
            panel.append(measured(title, law, of, rounds))
    return panels


def measured(title: str, law: str, jobs: list[Job], rounds: int) -> Line:
    """The jobs by turns, as far as none takes too long."""
    times: list[list[float]] = []
    for i, (_, one, scenes) in enumerate(jobs):
        if i and times[-1][0] * scenes / jobs[i - 1][2] > LONGEST:
            break
        times.append([run(one, scenes)])
    done = list(zip(jobs, times, strict=False))
    for _ in range(rounds - 1):
        for (_, one, scenes), known in done:
            if known[0] < LONG:
                known.append(run(one, scenes))
    of_all = title == "scenes"
    costs = [statistics.median(known) / (1 if of_all else scenes) for (_, _, scenes), known in done]
    return Line(title, law, [count for (count, _, _), _ in done], costs)


def drawn_motions(quick: bool) -> list[str]:
    """What a motion for each scene costs, by what is recorded, in the packaged study."""
    machine, motion = example()
    clear = with_carriages(machine, clearance_y=CLEARANCE, clearance_z=CLEARANCE)
    vary = [{"path": "body.mass", "distribution": "uniform", "plus_minus": "10 %"}]
    found = []
    for law, one, scenes in (*((LAWS[0], machine, 1024),) * len(RECORDED), (LAWS[1], clear, 32)):
        recorded = list(RECORDED)[len(found) % len(RECORDED)]
        jobs = []
        for posterior in (False, True):
            options: dict[str, Any] = {"vary": vary, "samples": scenes, "seed": 1, "posterior": posterior}
            plan = Study(machine=one, motion=motion, **options, **RECORDED[recorded]).plan()
            jobs.append(partial(plan.batch().run, plan.values(0, scenes), 1))
        times = np.array([[timed(job) for job in jobs] for _ in range(3 if quick else ROUNDS)])
        plain, drawn = np.median(times, axis=0) / scenes
        ratio = float(np.median(times[:, 1] / times[:, 0]))
        what = f"{law}, {recorded}: {plain * 1e6:.4g} us a scene, with a motion of its own {drawn * 1e6:.4g}"
        found.append(f"{what:80} {ratio:.2f} x")
    return found


def run(one: Batch, scenes: int) -> float:
    """Seconds of so many scenes on one thread."""
    rng = np.random.default_rng(1)
    seconds = 0.0
    for start in range(0, scenes, CHUNK):
        values = draws(rng, min(CHUNK, scenes - start))

        def chunk(values: Array = values) -> None:
            _, failures = one.run(values, 1)
            assert not failures

        seconds += timed(chunk)
    return seconds


def draws(rng: np.random.Generator, count: int) -> Array:
    """(count, 12) mass, centre of mass, factors of stiffness and of damping of each carriage."""
    body = cart().body
    mass = body.mass * rng.uniform(0.9, 1.1, (count, 1))
    center = np.array(body.center_of_mass) + rng.uniform(-0.05, 0.05, (count, 3))
    return np.hstack([mass, center, np.exp(rng.normal(0.0, 0.2, (count, 8)))])


def batch(law: str, samples: int, links: int) -> Batch:
    """The cart with so many links, over so many samples of its cycle."""
    machine = cart()
    body, centers = machine.body, machine.carriage_centers
    carriages, ends = len(centers), links // (2 * len(centers))
    along = np.linspace(-SPREAD, SPREAD, ends) if ends > 1 else np.zeros(1)
    points = np.repeat(centers, 2 * ends, axis=0)
    points[:, 0] += np.tile(np.repeat(along, 2), carriages)
    directions = np.tile(np.eye(3)[1:], (carriages * ends, 1))
    one = machine.carriages[0]
    k, b = one.stiffness_y / ends, one.damping_y / ends
    laws = (Law.linear(k), Law.sided(k, k, CLEARANCE), Law.preloaded(k, PRELOAD / ends, 1.5))
    motion = cycle().acceleration[REST:]
    of = np.repeat(np.arange(carriages), 2 * ends).tolist()
    return core_batch(
        mass=body.mass,
        center_of_mass=body.center_of_mass,
        inertia=body.inertia,
        inertia_about_reference=False,
        gravity=machine.gravity,
        free=machine.free,
        points=points,
        directions=directions,
        laws=[laws[LAWS.index(law)]] * links,
        damping=np.full(links, b),
        damping_in_contact=np.zeros(links, dtype=np.bool_),
        groups=list(np.arange(links).reshape(carriages, -1)),
        centers=centers,
        time=np.arange(samples) / 1000.0,
        acceleration=np.resize(motion, (samples, 3)),
        wrench=None,
        speed=None,
        exponent=3.0,
        changes=[
            (("mass", 0, 0), 0.0, [(0, 1.0)]),
            *((("center_of_mass", axis, 0), 0.0, [(1 + axis, 1.0)]) for axis in range(3)),
            *((("law", link, "scale"), 0.0, [(4 + carriage, 1.0)]) for link, carriage in enumerate(of)),
            *((("damping", link, 0), 0.0, [(8 + carriage, b)]) for link, carriage in enumerate(of)),
        ],
        measures=[
            (load, i, end) for i in range(carriages) for load in ("Fy", "Fz") for end in ("min", "max")
        ],
        method="auto",
        rtol=1e-6,
    )


# ---- print and draw


def print_line(of: Line) -> None:
    """A point per row, then the exponents."""
    print(f"{of.law}, by number of {of.title}")
    for count, seconds in zip(of.counts, of.seconds, strict=True):
        print(f"  {count:>9,} {of.title:8}{seconds * 1e3:>12.4g} ms")
    once, each = of.parts()
    print(f"  {once * 1e6:.3g} us and {each * 1e6:.3g} us for each of the {of.title}")
    print(f"  exponent {of.exponent():.3f}, over the last decade {of.exponent(10.0):.3f}\n")


def draw(panels: list[list[Line]], made_on: str, file: Path) -> None:
    """Write the picture: a panel for each count."""
    labels = (
        ("s for all scenes", f"{SAMPLES} samples, {LINKS} links", 1.0),
        ("ms for a scene", f"{LINKS} links", 1e3),
        ("ms for a scene", f"{SAMPLES} samples, four carriages", 1e3),
    )
    with look():
        figure = new_figure(11.0, 4.2)
        axes = figure.subplots(1, 3)
        for ax, lines, (unit, rest, scale) in zip(axes, panels, labels, strict=True):
            panel(ax, lines, scale)
            ax.set(xlabel=f"number of {lines[0].title}", ylabel=unit, title=f"by {lines[0].title}")
            ax.text(0.97, 0.03, rest, transform=ax.transAxes, ha="right", fontsize=8.5, color=GREY)
        limits = [ax.get_ylim() for ax in axes[1:]]
        for ax in axes[1:]:
            ax.set_ylim(min(low for low, _ in limits), max(high for _, high in limits))
        axes[2].set_xticks(panels[2][0].counts, [str(count) for count in panels[2][0].counts])
        axes[2].minorticks_off()
        figure.suptitle("What a study costs, by the number of scenes, samples and links", x=0.01, ha="left")
        slopes = "Slopes are of the last decade, those of links of all points."
        figure.supxlabel(f"{made_on} {slopes}", fontsize=8, color=GREY)
        figure.savefig(file, dpi=110)


def panel(ax: Axes, lines: list[Line], scale: float) -> None:
    """A line per law; dashed beside each, what is linear: up to its last point, of links from the first on."""
    ax.set(xscale="log", yscale="log")
    ax.margins(0.06, 0.2)
    dashed = {"color": GREY, "lw": 0.9, "ls": (0, (4, 2)), "zorder": 1}
    for of, color in zip(lines, CARRIAGE_COLORS, strict=False):
        counts, costs = np.array(of.counts), scale * np.array(of.seconds)
        ax.plot(
            counts, costs, color=color, lw=1.8, marker="o", ms=4.5, label=f"{of.law}: slope {of.slope:.2f}"
        )
        at = 0 if of.title == "links" else -1
        ax.plot(counts, costs[at] * counts / counts[at], **dashed)
    ax.plot([], [], label="slope 1", **dashed)
    ax.legend(loc="upper left", labelcolor=INK)


if __name__ == "__main__":
    main()
