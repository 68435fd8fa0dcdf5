"""Picture of the probability of failure by fatigue in a study."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from guideload.base.arguments import checked
from guideload.base.errors import ArgumentError
from guideload.base.number_text import number
from guideload.life.rating_life import failure_probability
from guideload.plots.drivers import set_title, short, write_no_result
from guideload.plots.style import INK, axes_or_new, carriage_look, legend_beside, look, plain
from guideload.study.quantities import LIFE
from guideload.study.result import RANKED, StudyResult
from guideload.study.statistics import known

POINTS = 120  # travels of a curve
LEAST = 1e-3  # smallest probability in the picture


@checked
def failure(result: StudyResult, ax: Axes | None = None) -> Axes:
    """Probability of a failure by fatigue before a travel, over the travel: of each carriage, and of any of them.

    A dashed line is the share of the samples in which the rating life of the machine is shorter than the travel. At
    most the first samples are used, as for rank correlations. Raises ArgumentError without ratings.
    """
    if LIFE not in result.quantities:
        raise ArgumentError(f"the study has no life: its quantities are {', '.join(result.quantities)}")
    reliability = result.metadata.machine.life.reliability
    lives = {name: known(result.column(f"{LIFE}[{name}]"))[:RANKED] for name in result.owners(LIFE)}
    machine = known(result.column(LIFE))[:RANKED]
    with look():
        ax = axes_or_new(ax, 8.4, 4.6)
        set_title(ax, result, "Probability of a failure by fatigue before a travel", machine.size)
        finite = machine[np.isfinite(machine)]
        if not finite.size:
            return write_no_result(ax)
        travel = np.geomspace(0.05 * float(np.quantile(finite, 0.01)), 8.0 * float(np.median(finite)), POINTS)
        for i, (name, values) in enumerate(lives.items() if len(lives) > 1 else ()):
            color, dash = carriage_look(i)
            ax.plot(
                travel,
                _mean(travel, values, reliability),
                color=color,
                linestyle=dash,
                linewidth=1.2,
                label=plain(short(name)),
            )
        ax.plot(travel, _mean(travel, machine, reliability), color=INK, linewidth=1.8, label="machine (any)")
        shorter = np.searchsorted(np.sort(machine), travel) / machine.size
        label = "samples with a\nshorter rating life"
        ax.plot(travel, np.where(shorter > 0.0, shorter, np.nan), "--", color=INK, linewidth=1.0, label=label)
        ax.set(xscale="log", yscale="log", ylim=(LEAST, 1.0), xlabel="travel [km]", ylabel="probability")
        ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        ax.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5), numticks=12))
        ax.xaxis.set_minor_formatter(NullFormatter())
        ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:g} %"))
        ax.margins(x=0.0)
        required, repetition = result.metadata.machine.life.life, result.metadata.repetition
        asked = None if required is None or repetition is None else 1e-3 * repetition.travel(required)
        wanted = result.limits.get(LIFE, asked)
        if wanted is not None:
            label = f"required life,\n{number(wanted)} km"
            ax.axvline(wanted, color=INK, linewidth=1.0, linestyle=(0, (1, 2)), label=label)
        legend_beside(ax, "carriage")
    return ax


def _mean(travel: np.ndarray, lives: np.ndarray, reliability: float) -> np.ndarray:
    return np.array([float(np.mean(failure_probability(one, lives, reliability))) for one in travel])
