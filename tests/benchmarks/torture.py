"""The torture set by every method of guideload and every peer: `python tests/benchmarks/torture.py`.

    --write      the tables of docs/torture.md and the atlas, docs/images/torture.png
    --only WORD  methods whose name has this word

The scenes are those of tests/helpers/torture_scenes.py, which are laws for guideload in tests/torture. Peers are in
peers/small.py and small_compiled.py; `pip install .[bench]`. Each method works in a process of its own, which is
killed after LIMIT; a call is repeated for its time if it was short, so what compiles is not counted.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import harness
import numpy as np
from harness import heading, row, write_block
from peers.small import Equations, Solve, scipy_leg, sundials_leg
from torture import RTOL, Scene
from torture_scenes import scenes

from guideload import simulate

LIMIT = 15.0  # s on the clock, of a call; compilation apart
COMPILING = 90.0  # s
SLOW = 1.0  # s of processor time; no scene takes guideload half of it
WRONG = 1e-2  # of the largest load or displacement
DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE, ATLAS = DOCS / "torture.md", DOCS / "images" / "torture.png"
PLAIN, EVENTS = "plain", "events"
Run = Callable[[Scene], float]  # to the error


@dataclass(frozen=True)
class Outcome:
    """What a method made of a scene."""

    error: float = np.inf
    seconds: float = np.inf
    refusal: str = ""

    @property
    def kind(self) -> str:
        """right, slow, refused or wrong (silently: with success)."""
        if self.refusal:
            return "slow" if self.refusal == "no end" else "refused"
        if not self.error <= WRONG:
            return "wrong"
        return "slow" if self.seconds > SLOW else "right"

    @property
    def cell(self) -> str:
        short = f"{self.error:.0e}".replace("e-0", "e-").replace("e+0", "e+").replace("inf", "no number")
        return {
            "right": short,
            "slow": f"slow {short}" if np.isfinite(self.error) else "no end",
            "refused": "refused",
            "wrong": f"**{short}**",
        }[self.kind]


def ours(method: Any, scene: Scene) -> float:
    found = simulate(scene.machine, scene.motion, method, times=scene.times, rtol=RTOL).quantities
    return scene.error(found["link_load"], found["displacement"][:, scene.axes])


def by_leg(solver: Callable[[str], Solve], name: str, mode: str, scene: Scene) -> float:
    given = Equations(scene)
    states = solver(name)(given.whole())[0] if mode == PLAIN else given.legs(solver(name))
    return given.error(states)


@cache
def equations(scene: Scene) -> Equations:
    """One for both calls, so that the second finds what the first compiled."""
    return Equations(scene)


def compiled(package: str, name: str, mode: str, scene: Scene) -> float:
    from peers import small_compiled as peers

    given = equations(scene)
    if package == "numba":
        states = given.legs(peers.rk4_leg(given))
    elif mode == PLAIN:
        states = getattr(peers, f"{package}_whole")(given, name)
    else:
        states = given.legs(getattr(peers, f"{package}_leg")(given, name))
    return given.error(states)


def methods() -> dict[str, tuple[str, Run]]:
    """Package and call of each method, by name."""
    found: dict[str, tuple[str, Run]] = {
        f"guideload {name}": ("guideload", partial(ours, name))
        for name in ("exact", "exponential", "rk45", "implicit")
    }
    for name in ("RK45", "DOP853", "Radau", "BDF", "LSODA"):
        for mode in (PLAIN, EVENTS):
            found[f"SciPy {name}, {mode}"] = ("scipy", partial(by_leg, scipy_leg, name, mode))
    for name in ("CVODE Adams", "CVODE BDF", "IDA"):
        for mode in (PLAIN, EVENTS):
            found[f"{name}, {mode}"] = ("sksundae", partial(by_leg, sundials_leg, name, mode))
    for package, module, name in (
        ("diffsol", "pydiffsol", "tsit45"),
        ("diffsol", "pydiffsol", "bdf"),
        ("diffrax", "diffrax", "Tsit5"),
        ("diffrax", "diffrax", "Kvaerno5"),
    ):
        for mode in (PLAIN, EVENTS):
            found[f"{module} {name}, {mode}"] = (module, partial(compiled, package, name, mode))
    for name in ("DOPRI5", "GeneralizedAlpha"):
        found[f"Exudyn {name}"] = ("exudyn", partial(compiled, "exudyn", name, PLAIN))
    found["Numba RK4, events"] = ("numba", partial(compiled, "numba", "RK4", EVENTS))
    return found


# ---- each method in a process of its own


def serve(method: str, pipe: Connection) -> None:
    """Answer indices of scenes with outcomes; "begun" once a call has been made that may compile."""
    warnings.simplefilter("ignore")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # of compiled code that writes to the terminal
    os.dup2(1, 2)
    run, table = methods()[method][1], scenes()
    while True:
        scene = table[pipe.recv()]
        assert scene.truth
        pipe.send("ready")
        try:
            start = time.process_time()
            error = run(scene)
            seconds = time.process_time() - start
            pipe.send("begun")
            if seconds < COMPILING:
                start = time.process_time()
                error = run(scene)
                seconds = time.process_time() - start
            pipe.send(Outcome(error, seconds))
        except Exception as error:
            text = " ".join(str(error).split()) or type(error).__name__
            pipe.send(Outcome(refusal=text))


def outcomes(method: str) -> list[Outcome]:
    """Of all scenes."""
    context = multiprocessing.get_context("spawn")
    found: list[Outcome] = []
    process: Any = None
    for index in range(len(scenes())):
        if process is None:
            pipe, other = context.Pipe()
            process = context.Process(target=serve, args=(method, other), daemon=True)
            process.start()
        pipe.send(index)
        outcome = Outcome(refusal="no end")
        for limit in (120.0, COMPILING if "diffrax" in method or "Numba" in method else LIMIT, LIMIT):
            answer = pipe.recv() if pipe.poll(limit) else outcome
            if isinstance(answer, Outcome):
                outcome = answer
                break
        if outcome.refusal == "no end":
            process.kill()
            process.join()
            process = None
        found.append(outcome)
    if process is not None:
        process.kill()
        process.join()
    return found


# ---- what is written


def tables(found: dict[str, list[Outcome]]) -> str:
    """Counts of each method, errors of each method on each scene, what refusals say."""
    kinds = ("right", "slow", "refused", "wrong")
    lines = [heading("method", "right", "slow", "refused", "**silently wrong**", "median time, ms")]
    for method, of in found.items():
        counts = [sum(one.kind == kind for one in of) for kind in kinds]
        finished = [one.seconds for one in of if np.isfinite(one.seconds)]
        time = f"{1e3 * np.median(finished):.3g}" if finished else ""
        lines.append(row(method, *(str(count or "") for count in counts), time))
    families = ("guideload", "SciPy", "CVODE IDA", "pydiffsol diffrax", "Exudyn Numba")
    for family in families:
        of = {name: one for name, one in found.items() if name.split()[0].rstrip(",") in family.split()}
        if not of:
            continue
        names = (name.removeprefix("SciPy ").removeprefix("guideload ") for name in of)
        lines += ["", heading("scene", *names)]
        for index, scene in enumerate(scenes()):
            lines.append(row(scene.name, *(one[index].cell for one in of.values())))
    lines += ["", heading("refused", "by", "what it says", words=3)]
    for method, of in found.items():
        said: dict[str, list[str]] = {}
        for scene, one in zip(scenes(), of, strict=True):
            if one.kind == "refused":
                said.setdefault(one.refusal[:110], []).append(scene.name)
        lines += [row(", ".join(names), method, text.replace("|", "/")) for text, names in said.items()]
    return "\n".join(lines)


def table_of_scenes() -> str:
    """Scene, what makes it hard, reference."""
    lines = [heading("scene", "what makes it hard", "reference", words=3)]
    for scene in scenes():
        count = sum(len(axis.events) for axis in scene.paths)
        events = f"closed form, {count} events" if count else "closed form"
        lines.append(row(scene.name, scene.hard, "quadrature of the energy" if scene.by else events))
    return "\n".join(lines)


def draw(found: dict[str, list[Outcome]]) -> None:
    """The atlas: methods over scenes, colour for the error, hatching for silent errors."""
    from matplotlib.colors import LogNorm
    from matplotlib.patches import Rectangle

    from guideload.plots.style import INK, look, new_figure

    names = [scene.name for scene in scenes()]
    errors = np.array([[one.error for one in of] for of in found.values()])
    with look():
        figure = new_figure(13.0, 10.5)
        ax = figure.subplots()
        shown = np.ma.masked_invalid(np.clip(errors, 1e-15, None))
        image = ax.imshow(shown, cmap="viridis_r", norm=LogNorm(1e-13, 1.0), aspect="auto")
        for y, of in enumerate(found.values()):
            for x, one in enumerate(of):
                corner = (x - 0.5, y - 0.5)
                if one.kind == "wrong":
                    ax.add_patch(
                        Rectangle(corner, 1, 1, fill=False, hatch="////", edgecolor="#E69F00", linewidth=0)
                    )
                elif one.kind != "right":
                    text = {"refused": "refused", "slow": "slow"}[one.kind]
                    color = "white" if np.isfinite(one.error) and one.error > 1e-4 else INK
                    ax.text(x, y, text, ha="center", va="center", fontsize=6, color=color)
        ax.set_xticks(range(len(names)), names, rotation=60, ha="right", rotation_mode="anchor")
        ax.set_yticks(range(len(found)), list(found))
        ax.set_xticks(np.arange(-0.5, len(names)), minor=True)
        ax.set_yticks(np.arange(-0.5, len(found)), minor=True)
        ax.grid(which="minor", color="white", linewidth=0.8)
        ax.tick_params(which="both", length=0)
        for spine in ax.spines.values():
            spine.set_visible(False)
        figure.colorbar(image, label="error, part of the largest load or displacement", shrink=0.6)
        ax.set_title(
            f"Where methods fail: every method at a tolerance of {RTOL:g}; hatched: wrong by more than "
            f"{100 * WRONG:g} %, and reported as success",
            loc="left",
        )
        figure.savefig(ATLAS, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--write", action="store_true", help="tables and picture of docs/torture.md")
    parser.add_argument("--only", default="", metavar="WORD", help="methods whose name has this word")
    asked = parser.parse_args()
    found: dict[str, list[Outcome]] = {}
    for method, (package, _) in methods().items():
        if asked.only in method and harness.installed(package):
            found[method] = outcomes(method)
            kinds = [one.kind for one in found[method]]
            counts = ", ".join(
                f"{kinds.count(kind)} {kind}" for kind in ("right", "slow", "refused", "wrong")
            )
            print(f"{method}: {counts}", flush=True)
            if asked.only:
                for scene, one in zip(scenes(), found[method], strict=True):
                    print(
                        f"    {scene.name:26}{one.cell:14}{1e3 * one.seconds:10.2f} ms  {one.refusal[:150]}"
                    )
    if asked.write:
        write_block(PAGE, "scenes", table_of_scenes())
        write_block(PAGE, "results", tables(found))
        write_block(PAGE, "made on", f"Made on one thread of {harness.processor()}.")
        draw(found)


if __name__ == "__main__":
    main()
