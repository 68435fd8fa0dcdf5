"""Load histories of the requested samples, with the labels of a single run."""

from __future__ import annotations

import numpy as np
import xarray as xr

from guideload.base.arrays import Array
from guideload.base.errors import RunError, SceneError
from guideload.base.quantities import Quantity, quantities
from guideload.simulation.run import AXES
from guideload.simulation.simulation import simulate
from guideload.study.description.plan import Plan

TOGETHER = 16  # samples between checks for Ctrl-C


def histories(plan: Plan) -> xr.Dataset:
    """force, moment and resultant (sample, time, carriage) of the samples in `plan.histories`, with their factors.

    A failed sample has NaN, and the reason in `reason`. nominal_force, nominal_moment and nominal_resultant (time,
    carriage) are those of the nominal machine, if it has a solution.
    """
    samples, metadata = list(plan.histories), plan.metadata
    values = np.concatenate([plan.values(i, i + 1) for i in samples])
    loads, reasons = [], [""] * len(samples)
    for start in range(0, len(samples), TOGETHER):
        some, failed = plan.batch().histories(values[start : start + TOGETHER])
        loads.append(some)
        for i, reason in failed:
            reasons[start + i] = reason
    variables = _loads(("sample",), np.concatenate(loads), "", "load of the carriage")
    try:
        nominal = simulate(metadata.machine, plan.motion, metadata.method, rtol=metadata.rtol).carriage_loads
        variables |= _loads((), nominal, "nominal_", "load of the carriage, nominal machine")
    except (RunError, SceneError):  # perhaps only the drawn machines have a solution
        pass
    words = {"long_name": "values of the factors, in their units"}
    variables["value"] = Quantity(("sample", "factor"), values, words)
    words = {"long_name": "reason why the sample failed, or empty"}
    variables["reason"] = Quantity(("sample",), np.array(reasons, dtype=object), words)
    coords = {
        "sample": ("sample", samples, {"long_name": "index of the sample"}),
        "time": ("time", plan.motion.time, {"units": "s", "long_name": "time"}),
        "carriage": list(metadata.carriages),
        "axis": list(AXES),
        "factor": [factor.name for factor in plan.factors],
    }
    return xr.Dataset(variables, coords=coords, attrs={"fingerprint": metadata.fingerprint})


def _loads(dims: tuple[str, ...], loads: Array, prefix: str, text: str) -> dict[str, Quantity]:
    """Labelled loads (..., time, carriage, 6)."""
    dims, resultant = (*dims, "time", "carriage"), np.hypot(loads[..., 1], loads[..., 2])
    rows = [
        ("force", (*dims, "axis"), loads[..., :3], "N", text),
        ("moment", (*dims, "axis"), loads[..., 3:], "N m", f"{text}, about its centre"),
        ("resultant", dims, resultant, "N", f"{text}, resultant in y and z"),
    ]
    return {f"{prefix}{name}": quantity for name, quantity in quantities(rows).items()}


def are_of(data: xr.Dataset | None, plan: Plan) -> bool:
    """Whether the dataset has exactly the histories that the plan requests."""
    return data is not None and tuple(data["sample"].values.tolist()) == plan.histories
