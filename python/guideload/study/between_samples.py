"""A warning where the loads of a study, which are those at the samples of the motion, miss peaks between them."""

from __future__ import annotations

import numpy as np

from guideload.base.number_text import percent
from guideload.base.warnings import LIMITS, WarningText
from guideload.simulation.run import Run


def sample_warnings(run: Run) -> list[WarningText]:
    """By the run of the machine as given: its largest loads at any time, and at the samples."""
    if run.extremes is None or not run.machine.carriages:
        return []
    loads = run.carriage_loads()
    at_samples = np.hypot(loads[:, :, 1], loads[:, :, 2]).max(axis=0)
    at_any_time = run.extremes[1][: at_samples.size, 6]
    largest = float(at_samples.max())
    rise = float((at_any_time - at_samples).max()) / largest if largest else 0.0
    if LIMITS["samples of a study"].holds(rise):
        return []
    return [
        WarningText(
            "samples of a study",
            f"Note: a study takes its loads at the samples of the motion, and those of the machine as given are up to "
            f"{percent(rise)} larger between them. Give the motion more stamps: log faster, or plan moves with a "
            'higher rate = ".. Hz"; a single run (guideload run) finds the peaks at any time.',
        )
    ]
