"""The run of a result that was read from a file, from its quantities."""

from __future__ import annotations

from guideload.audit.histories import Histories
from guideload.base.quantities import Quantities
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.simulation.run import Run
from guideload.simulation.start import StartState


def stored_run(machine: Machine, data: Quantities) -> Run | None:
    """The run whose samples the quantities contain; None at given instants, and on rails not straight."""
    histories = Histories(machine, data)
    if not histories.has_motion or "motion_acceleration" in data or histories.foot_load is not None:
        return None
    start: StartState = "quasi-static" if histories.start == "quasi-static" else "rest"
    step = data.attrs.get("step_s")
    return Run(
        machine,
        Motion(histories.time, histories.cart_acceleration, wrench=data.get("wrench")),
        str(data.attrs["method"]),
        str(data.attrs["method_reason"]),
        float(data.attrs["rtol"]),
        None if step is None else float(step),
        None,
        start,
        histories.stretches_at(histories.time),
        travel=histories.travel,
    )
