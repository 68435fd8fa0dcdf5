"""Load histories of the requested samples, with the labels of a single run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from guideload.base.arrays import Array
from guideload.base.errors import RunError, SceneError
from guideload.base.quantities import Quantities, Quantity, quantities
from guideload.simulation.run import AXES
from guideload.simulation.simulation import simulate
from guideload.study.description.plan import Plan

if TYPE_CHECKING:
    import xarray as xr

TOGETHER = 16  # samples whose loads are computed at a time
COPIES = 4  # of the loads: themselves, with resultants, the file made in memory, and what HDF5 needs for it


def histories(plan: Plan) -> Quantities:
    """force, moment and resultant (sample, time, carriage) of the samples in `plan.histories`, with their factors.

    A failed sample has NaN, and the reason in `reason`. nominal_force, nominal_moment and nominal_resultant (time,
    carriage) are those of the nominal machine, if it has a solution.
    """
    samples, metadata = list(plan.histories), plan.metadata
    loads, reasons = _room(len(samples), plan.motion.time.size, len(metadata.carriages)), [""] * len(samples)
    values = np.concatenate([plan.values(i, i + 1) for i in samples])
    for start in range(0, len(samples), TOGETHER):
        loads[start : start + TOGETHER], failed = plan.batch().histories(values[start : start + TOGETHER])
        for i, reason in failed:
            reasons[start + i] = reason
    variables = _loads(("sample",), loads, "", "load of the carriage")
    try:
        nominal = simulate(
            metadata.machine, plan.motion, metadata.method, rtol=metadata.rtol, start=metadata.start
        ).carriage_loads
        variables |= _loads((), nominal, "nominal_", "load of the carriage, nominal machine")
    except (RunError, SceneError):  # perhaps only the drawn machines have a solution
        pass
    words = {"long_name": "values of the factors, in their units"}
    variables["value"] = Quantity(("sample", "factor"), values, words)
    words = {"long_name": "reason why the sample failed, or empty"}
    variables["reason"] = Quantity(("sample",), np.array(reasons, dtype=object), words)
    variables["sample"] = Quantity(("sample",), np.array(samples), {"long_name": "index of the sample"})
    variables["time"] = Quantity(("time",), plan.motion.time, {"units": "s", "long_name": "time"})
    labels = {
        "carriage": metadata.carriages,
        "axis": AXES,
        "factor": [one.name for one in metadata.parameters],
    }
    variables |= {name: Quantity((name,), np.array(list(each)), {}) for name, each in labels.items()}
    return Quantities(variables, {"fingerprint": metadata.fingerprint})


def _room(samples: int, times: int, carriages: int) -> Array:
    """Room for the loads. MemoryError, before the first sample runs, if the file made of them would not fit either."""
    shape = samples, times, carriages, 6
    try:
        np.empty((COPIES, *shape), dtype=np.float64)  # virtual memory only, and given back at once
        return np.empty(shape)
    except (MemoryError, ValueError):  # ValueError: more bytes than an address has
        size = 8e-9 * COPIES * float(np.prod(shape, dtype=np.float64))
        raise MemoryError(
            f"the histories of {samples} samples need {size:.3g} GB; request fewer, or run each with `simulate`"
        ) from None


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
