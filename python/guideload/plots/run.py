"""All pictures of a run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

from matplotlib.axes import Axes

from guideload.base.arguments import checked
from guideload.plots.loads import moments, paper_figures, resultant
from guideload.plots.machine import modes, scene
from guideload.plots.point_motion import points
from guideload.plots.saving import save_each
from guideload.plots.spectra import spectrum
from guideload.simulation.result import Result

Pictures = Mapping[str, Callable[[], Axes]]


def drawings(result: Result) -> dict[str, Callable[[], Axes]]:
    """Every picture of a result by its file name; each is drawn at its first call."""
    found: dict[str, Callable[[], Axes]] = {
        "scene.png": lambda: scene(result.machine, result),
        "modes.png": lambda: modes(result.machine, result.modes)[0],
    }
    if result.machine.carriages:
        found |= {
            "figures_7_to_11.png": lambda: paper_figures(result)[0],
            "resultant.png": lambda: resultant(result),
            "moments.png": lambda: moments(result),
            "spectrum.png": lambda: spectrum(result),
        }
    if result.machine.points:
        found["points.png"] = lambda: points(result)[0]
    return {name: cache(draw) for name, draw in found.items()}


@checked
def save_all(result: Result, folder: str | Path) -> list[Path]:
    """Save every picture of a result as PNG in `folder`, created if it is missing; returns their paths.

    Raises PictureError if some cannot be drawn, after the others are saved.
    """
    return save_each(drawings(result), folder)
