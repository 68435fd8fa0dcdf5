"""Varied parameters that a study adds: stiffnesses that no catalogue prints, which are estimated."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from guideload.base.errors import ValueRefused
from guideload.catalogue.stiffness import StiffnessEstimate
from guideload.machine.products import stiffness_estimates
from guideload.parameters.parameters import Parameters
from guideload.study.factors import parameters_by_draw
from guideload.study.varied_parameters import LognormalSpec, VariedParameter


def estimated_entries(entries: Sequence[VariedParameter], parameters: Parameters) -> Iterator[LognormalSpec]:
    """A lognormal factor on each estimated stiffness, one draw for all carriages with the same product and class.

    Its interval is that of the estimate. Stiffnesses that `entries` vary are left out, and those that cannot vary,
    because the carriage has a compliance in series or states its stiffness against rotations.
    """
    machine, taken = parameters.machine, _paths_of(entries, parameters)
    estimates: dict[str, tuple[StiffnessEstimate, list[str]]] = {}
    of_carriages = stiffness_estimates(machine.carriages, machine.product_of_carriage)
    for carriage, estimate in zip(machine.carriages, of_carriages, strict=True):
        if estimate is None:
            continue
        title = " ".join(filter(None, ("estimated stiffness of", carriage.product, carriage.preload_class)))
        paths = estimates.setdefault(title, (estimate, []))[1]
        for key in ("stiffness_y", "stiffness_z"):
            path = f"carriages[{carriage.name}].{key}"
            if (
                getattr(carriage, key) == estimate.stiffness
                and path not in taken
                and _varies(path, parameters)
            ):
                paths.append(path)
    for title, (estimate, paths) in estimates.items():
        if paths:
            yield LognormalSpec(path=tuple(paths), name=title, distribution="lognormal", sigma=estimate.sigma)


def _paths_of(entries: Sequence[VariedParameter], parameters: Parameters) -> set[str]:
    """The full paths of the parameters that these entries set; those of invalid entries are left out."""
    found: set[str] = set()
    for entry in entries:
        try:
            draws = parameters_by_draw(entry, parameters)
        except ValueRefused:  # `drawn_factors` tells it
            continue
        found |= {parameter.path for group in draws.values() for parameter in group}
    return found


def _varies(path: str, parameters: Parameters) -> bool:
    try:
        parameters.at(path)
    except ValueRefused:
        return False
    return True
