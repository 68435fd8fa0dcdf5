"""Pictures, a function per figure. Each returns its axes, and draws on axes of its own unless it is given some.

They are drawn without pyplot: they need no display and change no setting of the process.
`ax.figure.savefig(path)` saves one; in a notebook `ax.figure` shows it.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from guideload.base.arguments import checked
from guideload.plots.compare import comparison
from guideload.plots.life import rail_damage
from guideload.plots.loads import load_y, load_z, moments, motor_speed, paper_figures, resultant
from guideload.plots.machine import equivalent_box, modes, scene
from guideload.plots.points import points
from guideload.plots.response import frequency_response
from guideload.plots.saving import save, save_each
from guideload.plots.sensitivities import influence
from guideload.plots.spectrum import load_density, spectrum
from guideload.plots.stability_region import stability
from guideload.plots.trace import encoder
from guideload.plots.work_precision_diagram import work_precision

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes

    from guideload.plots.drivers import scatter, tornado
    from guideload.plots.identification import (
        correlation,
        identified_numbers,
        measured_responses,
        modal_test,
        next_measurements,
        save_identification,
    )
    from guideload.plots.study import band, distributions, exceedance, save_study
    from guideload.plots.study_life import failure
    from guideload.simulation.result import Result

# Pictures by their module, imported at their first use: with pandas and pyarrow those of studies take half a second.
_LAZY = {
    "band": "study",
    "correlation": "identification",
    "distributions": "study",
    "exceedance": "study",
    "failure": "study_life",
    "identified_numbers": "identification",
    "measured_responses": "identification",
    "modal_test": "identification",
    "next_measurements": "identification",
    "save_identification": "identification",
    "save_study": "study",
    "scatter": "drivers",
    "tornado": "drivers",
}

__all__ = [
    "band",
    "comparison",
    "correlation",
    "distributions",
    "encoder",
    "equivalent_box",
    "exceedance",
    "failure",
    "frequency_response",
    "identified_numbers",
    "influence",
    "load_density",
    "load_y",
    "load_z",
    "measured_responses",
    "modal_test",
    "modes",
    "next_measurements",
    "moments",
    "motor_speed",
    "paper_figures",
    "points",
    "rail_damage",
    "resultant",
    "save",
    "save_all",
    "save_identification",
    "save_study",
    "scatter",
    "scene",
    "spectrum",
    "stability",
    "tornado",
    "work_precision",
]


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        return getattr(import_module(f"guideload.plots.{_LAZY[name]}"), name)
    raise AttributeError(f"module 'guideload.plots' has no attribute {name!r}")


@checked
def save_all(result: Result, folder: str | Path) -> list[Path]:
    """Save every picture of a result as PNG in `folder`, created if it is missing; returns their paths.

    Raises PictureError if some cannot be drawn, after the others are saved.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    drawings: dict[str, Callable[[], Axes]] = {
        "scene.png": lambda: scene(result.machine, result),
        "modes.png": lambda: modes(result.machine, result.modes)[0],
    }
    if result.machine.carriages:
        drawings |= {
            "figures_7_to_11.png": lambda: paper_figures(result)[0],
            "resultant.png": lambda: resultant(result),
            "moments.png": lambda: moments(result),
            "spectrum.png": lambda: spectrum(result),
        }
    if result.machine.points:
        drawings["points.png"] = lambda: points(result)[0]
    return save_each(drawings, folder)
