"""The chart: a panel per scene, error of the load against time."""

from __future__ import annotations

import textwrap
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from measure import ROUNDING, Job, Measured

from guideload.plots.style import CARRIAGE_COLORS, GREY, INK, look, new_figure

OURS = dict(
    zip(("guideload exact", "guideload rk45", "guideload implicit"), CARRIAGE_COLORS[:3], strict=True),
    **{"guideload exponential": CARRIAGE_COLORS[0]},  # in the place of exact, where contacts are preloaded
)
BEST = ("#CC79A7", "#E69F00", "#56B4E9")
DIM = "#c3c7cd"
FLOOR = 3e-16  # errors below it are drawn there
TIMES, ERRORS = (0.15, 9e3), (1e-16, 1.0)  # ms, part of the load: what every panel shows


def draw(scenes: list[Measured], made_on: str, file: Path) -> None:
    """Write the picture."""
    rows = (len(scenes) + 2) // 3
    with look():
        figure = new_figure(15.0, 5.0 * rows)
        panels = figure.subplots(rows, 3, sharex=True, sharey=True, squeeze=False).ravel()
        for ax, scene in zip(panels, scenes, strict=True):
            panel(ax, scene)
        for ax in panels[::3]:
            ax.set_ylabel("error of the load, part of the largest load")
        for ax in panels[-3:]:
            ax.set_xlabel("time for the loads of 7 s at 1 kHz, ms")
        figure.suptitle(
            "Speed against error: guideload (bold), the three best peers (colour), the others (grey); "
            "circles: not beaten in both by any other",
            x=0.01,
            ha="left",
        )
        figure.supxlabel("\n".join(textwrap.wrap(made_on, 200)), fontsize=8, color=GREY)
        figure.savefig(file, dpi=110)


def panel(ax: Axes, scene: Measured) -> None:
    """One scene: a line per method over its settings; of the peers in grey a line per package, its best settings."""
    ax.set(xscale="log", yscale="log", title=scene.case.title, xlim=TIMES, ylim=ERRORS)
    ax.axhspan(ERRORS[0], ROUNDING, color="#f3f4f6", zorder=0, lw=0)
    best = dict(zip(best_peers(scene), BEST, strict=False))
    lines: dict[str, list[Job]] = {}
    for job in scene.valid:
        shown = job.name in OURS or job.name in best
        lines.setdefault(job.name if shown else package(job.name), []).append(job)
    labels = []
    for name, jobs in lines.items():
        ours, color = name in OURS, (OURS | best).get(name, DIM)
        width, size, order = (2.6, 30, 5) if ours else (1.6, 18, 4) if name in best else (0.9, 7, 2)
        line = jobs if color != DIM else envelope(jobs)
        if color == DIM:
            ax.scatter(*points(jobs), s=size, color=color, zorder=order)
        ax.plot(*points(line), color=color, lw=width, zorder=order)
        ax.scatter(
            *points(line), s=size, color=color, marker="D" if ours else "o", zorder=order + 0.5, linewidths=0
        )
        labels.append((name, line, GREY if color == DIM else color, ours))
    front = [job for job in scene.valid if job.pareto_optimal]
    ax.scatter(*points(front), s=110, facecolors="none", edgecolors=INK, linewidths=0.9, zorder=7)
    place(ax, labels)


def package(name: str) -> str:
    """The package of a peer; of those that are one solver, its name."""
    first = name.partition(" ")[0]
    return name if first in ("scipy", "Numba") else first


def points(jobs: list[Job]) -> tuple[list[float], list[float]]:
    """Times in ms and errors."""
    return [job.median * 1e3 for job in jobs], [max(job.error, FLOOR) for job in jobs]


def envelope(jobs: list[Job]) -> list[Job]:
    """Of a package, the settings that its others do not beat."""
    kept: list[Job] = []
    for job in sorted(jobs, key=lambda job: job.median):
        if not kept or job.error < kept[-1].error:
            kept.append(job)
    return kept


def best_peers(scene: Measured) -> list[str]:
    """The three peers that are the quickest of the peers over most of the errors from 1e-12 to 1e-3."""
    wins: dict[str, int] = {}
    for error in 10.0 ** np.arange(-12.0, -2.9, 0.25):
        enough = [job for job in scene.valid if not job.ours and job.error <= error]
        if enough:
            name = min(enough, key=lambda job: job.median).name
            wins[name] = wins.get(name, 0) + 1
    return sorted(wins, key=lambda name: -wins[name])[:3]


def place(ax: Axes, labels: list[tuple[str, list[Job], str, bool]]) -> None:
    """Each name beside the most accurate point of its line, moved up or down where names would overlap."""
    across = np.log10(TIMES[1] / TIMES[0])
    up = np.log10(ERRORS[1] / ERRORS[0])
    taken: list[tuple[float, float, float]] = []  # from, to, height
    for name, line, color, ours in sorted(labels, key=lambda label: (label[2] == GREY, not label[3])):
        time, error = (values[-1] for values in points(sorted(line, key=lambda job: -job.error)))
        x, y = np.log10(time / TIMES[0]) / across, np.log10(error / ERRORS[0]) / up
        width = (0.0205 if ours else 0.0165) * len(name)
        start = x + 0.025 if x + width < 0.97 else x - width - 0.025
        height = next(
            y + shift
            for shift in sorted(np.arange(-1.0, 1.0, 0.005), key=abs)
            if 0.015 < y + shift < 0.98
            and all(abs(y + shift - h) > 0.037 or start > b or start + width < a for a, b, h in taken)
        )
        taken.append((start, start + width, height))
        ax.annotate(
            name,
            (time, error),
            xytext=(start, height),
            textcoords="axes fraction",
            va="center",
            fontsize=9.0 if ours else 8.0,
            fontweight="bold" if ours else "normal",
            color=color,
            arrowprops={"arrowstyle": "-", "lw": 0.5, "color": color, "shrinkA": 0, "shrinkB": 2}
            if abs(height - y) > 0.03
            else None,
            zorder=8,
        )
