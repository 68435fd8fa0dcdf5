"""The packaged example, of which README and docs show numbers and pictures: each part is computed once."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from guideload import (
    Machine,
    Motion,
    Result,
    Study,
    StudyResult,
    motion_from_trace,
    read_trace,
    run_study,
    simulate,
)
from guideload.identification import Identification, identify_file

EXAMPLES = Path(str(files("guideload"))) / "examples"


@cache
def machine() -> Machine:
    return Machine.from_toml(EXAMPLES / "manipulator.toml")


@cache
def motion() -> Motion:
    return motion_from_trace(read_trace(EXAMPLES / "manipulator.csv"), machine().drive)


@cache
def identified() -> Identification:
    return identify_file(EXAMPLES / "identify.toml")


@cache
def result() -> Result:
    return simulate(machine(), motion())


@cache
def paper() -> Result:
    return simulate(machine().with_free(("rx", "ry", "rz")), motion())


@cache
def described() -> Study:
    return Study.from_toml(EXAMPLES / "study.toml")


@cache
def study() -> StudyResult:
    """With the peak loads alone, which README and docs show: a quarter of the time of all quantities."""
    return run_study(described().model_copy(update={"quantities": ("resultant",)}))


@cache
def static_with_inertia() -> NDArray[np.float64]:
    """Force across the rails (time, carriage, 2) [N] by a static calculation with m a at every instant.

    A body that is accelerated by a is loaded as one at rest whose gravity is g - a; the example is linear.
    """

    def at_rest(a: float) -> NDArray[np.float64]:
        gx, gy, gz = machine().gravity
        tilted = machine().model_copy(update={"gravity": (gx - a, gy, gz)})
        return np.asarray(simulate(tilted, Motion.along_x([0.0, 1.0], [0.0, 0.0])).carriage_loads[0, :, 1:3])

    rest, unit = at_rest(0.0), at_rest(1.0) - at_rest(0.0)
    return np.asarray(rest + motion().acceleration[:, 0, None, None] * unit)
