"""The loads of the carriages in parts, by their causes."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from guideload.audit.histories import Histories
from guideload.base.arrays import Array
from guideload.machine.machine import Machine
from guideload.simulation.result import Result

CAUSES = {
    "weight": "static load of the body, on straight rails",
    "payload": "static load and m a of the payloads that are on the machine then",
    "acceleration": "quasi-static load of the acceleration of the body (m a)",
    "rider": "quasi-static load of the travel of riders: of their weight at another place, and of m a along it",
    "process force": "quasi-static load of the forces on the body",
    "rail error": "quasi-static load of mounting errors and of rails that are not straight",
    "vibration": "vibration about the quasi-static load, and the effect of springs that are not linear",
    "preload": "what the preloaded row carries beyond the equivalent load",
}
ROUNDING = 1e-9  # of the forces of rails that are not straight: smaller process forces are rounding


class LoadParts(dict[str, Array]):
    """Parts of the loads by cause, in the order of `CAUSES`, each (time, carriage, 6): force [N] and moment [N m].

    Their sum is the load. Causes that the run does not have are missing. Quasi-static parts: with nominal stiffness.
    """

    @cached_property
    def quasi_static(self) -> Array:
        """Quasi-static loads on rails without errors: what catalogues put into their formulas."""
        left_out = ("vibration", "rail error")
        return np.asarray(sum(part for cause, part in self.items() if cause not in left_out))


def load_parts(result: Result) -> LoadParts:
    """The parts of the loads of a result."""
    machine, histories = result.machine, Histories(result.machine, result.quantities)
    to_carriages = _to_carriages(machine)
    shape = (histories.time.size, len(machine.carriages), 6)

    def quasi_static(excitation: Array) -> Array:
        return np.asarray((excitation @ (histories.response @ to_carriages)).reshape(shape))

    bare = machine.with_payloads(()) if machine.payloads else machine
    weight = bare.static_carriage_loads
    parts = LoadParts()
    if bare.offsets.any():
        straight = _without_errors(bare).static_carriage_loads
        parts["rail error"] = np.broadcast_to(weight - straight, shape)
        weight = straight
    parts["weight"] = np.broadcast_to(weight, shape)
    inertia = histories.excitation - histories.wrench
    if histories.rides:
        parts["rider"] = quasi_static(result.quantities["rider_wrench"])
        inertia = inertia - result.quantities["rider_wrench"]
    if machine.payloads:
        of_bare = -histories.cart_acceleration @ bare.scene.matrices()[0][0][:, :3].T
        static = [
            np.broadcast_to(
                part.machine.static_carriage_loads - bare.static_carriage_loads, (part.time.size, *shape[1:])
            )
            for part in histories.stretches
        ]
        parts["payload"] = np.concatenate(static) + quasi_static(inertia - of_bare)
        inertia = of_bare
    parts["acceleration"] = quasi_static(inertia)
    process = histories.wrench
    if histories.foot_load is not None:
        process = process - histories.rail_wrench
        process[np.abs(process) <= ROUNDING * np.abs(histories.rail_wrench).max(axis=0)] = 0.0
        moving = quasi_static(histories.rail_wrench) + (histories.foot_load @ to_carriages).reshape(shape)
        parts["rail error"] = parts.get("rail error", 0.0) + moving
    if process.any():
        parts["process force"] = quasi_static(process)
    parts["vibration"] = result.carriage_loads - sum(parts.values())
    return LoadParts({cause: parts[cause] for cause in CAUSES if cause in parts})


def _to_carriages(machine: Machine) -> Array:
    """Loads of the carriages per load of each link, (link, carriage * 6)."""
    links = machine.link_table()
    to_carriage = np.zeros((len(machine.carriages), 6, len(links.names)))
    places = zip(machine.links_of_carriages, machine.carriage_centers, machine.carriage_axes, strict=True)
    for i, (of_carriage, center, axes) in enumerate(places):
        to_carriage[i][:, of_carriage] = links.arms(of_carriage, center, axes).T
    return to_carriage.reshape(-1, len(links.names)).T


def _without_errors(machine: Machine) -> Machine:
    """The machine with straight rails in the right places."""
    none = {"mounting_error": (0.0, 0.0)}
    straight = none | {"straightness": None, "waviness": None}
    return machine.model_copy(
        update={
            "rails": [rail.model_copy(update=straight) for rail in machine.rails],
            "carriages": [carriage.model_copy(update=none) for carriage in machine.carriages],
        }
    )
