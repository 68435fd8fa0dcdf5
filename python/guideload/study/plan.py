"""The plan of a study: all that decides its results, ready to run anywhere."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, fields
from functools import cached_property
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np

from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError
from guideload.machine.machine import Machine
from guideload.motion.motion import HISTORIES, Motion
from guideload.simulation.simulation import Method
from guideload.study.distributions import Sample
from guideload.study.factors import Factor
from guideload.study.measures import Life, Limit, Measure
from guideload.study.parameters import Change
from guideload.study.sampling import Design

if TYPE_CHECKING:
    from guideload._core import Batch


@dataclass(frozen=True, eq=False)
class Plan:
    """What varies, how it is drawn, and what is kept; immutable, and the same when it comes out of a pickle.

    machine, motion   as they are where nothing varies
    factors, changes  the columns of values, and what the core sets from them
    design, cases     the design that they are drawn by, or the given values (runs, factors); the other is None
    measures, columns what is kept of a run, and the names of these columns
    exponent          of the mean load; method, rtol: as of `simulate`
    histories         the runs, ascending, whose histories are kept
    limits, life      what is asked of the results
    """

    machine: Machine
    motion: Motion
    factors: tuple[Factor, ...]
    changes: tuple[Change, ...]
    design: Design | None
    cases: Array | None
    measures: tuple[Measure, ...]
    columns: tuple[str, ...]
    exponent: float
    method: Method
    rtol: float
    histories: tuple[int, ...]
    limits: tuple[Limit, ...]
    life: Life | None

    @property
    def seed(self) -> int | None:
        """What all draws follow from; None where cases are given."""
        return self.design.seed if self.design is not None else None

    @property
    def sensitivity(self) -> bool:
        """Whether the runs are of a Saltelli design, see `sampling.Design`."""
        return self.design is not None and self.design.sensitivity

    @property
    def base(self) -> int:
        """The samples of the distribution; a Saltelli design has more runs."""
        return self.runs if self.design is None else self.design.samples

    @property
    def runs(self) -> int:
        """How often the core runs."""
        if self.design is not None:
            return self.design.runs
        assert self.cases is not None
        return len(self.cases)

    def values(self, start: int, stop: int) -> Array:
        """(stop - start, factors) of the runs start to stop - 1, the same in any range. Raises ArgumentError."""
        if not 0 <= start <= stop <= self.runs:
            raise ArgumentError(f"values: expected 0 <= start <= stop <= {self.runs}, got {start} and {stop}")
        if self.design is None:
            assert self.cases is not None
            return self.cases[start:stop].copy()
        uniforms = self.design.uniforms(start, stop)
        values = np.empty((stop - start, len(self.factors)))
        for i, factor in enumerate(self.factors):
            assert factor.marginal is not None
            values[:, i] = factor.marginal.values(uniforms[i])
        return values

    def batch(self) -> Batch:
        """The core's batch, made once in a process. Raises SceneError if the machine has no solution as it is."""
        return self._batch

    @cached_property
    def _batch(self) -> Batch:
        from guideload._core import Batch

        machine, motion, table = self.machine, self.motion, self.machine.link_table()
        body = machine.body
        return Batch(
            mass=body.mass,
            center_of_mass=body.center_of_mass,
            inertia=body.inertia,
            inertia_about_reference=body.inertia_about == "L",
            gravity=machine.gravity,
            free=machine.free,
            points=table.points,
            directions=table.directions,
            laws=table.laws,
            damping=table.damping,
            damping_in_contact=table.damping_in_contact,
            groups=machine.links_of_carriages,
            centers=machine.carriage_centers,
            time=motion.time,
            acceleration=motion.acceleration,
            wrench=motion.wrench,
            speed=None if motion.velocity is None else np.sqrt((motion.velocity**2).sum(axis=1)),
            exponent=self.exponent,
            changes=self.changes,
            measures=self.measures,
            method=self.method,
            rtol=self.rtol,
        )

    def fingerprint(self) -> str:
        """SHA-256 of all that decides the result of a run, as 64 hexadecimal digits.

        Among it are the versions of guideload, NumPy and SciPy. The number of samples is only where it decides the
        draws, in a Latin hypercube, so that a study can be resumed with more of them; histories, limits and life
        are not.
        """
        design = None
        if self.design is not None:
            design = {field.name: getattr(self.design, field.name) for field in fields(self.design)}
            design |= {} if self.design.sampling == "latin hypercube" else {"samples": None}
        told = {
            "machine": self.machine.model_dump(mode="json"),
            "motion": [_digest(getattr(self.motion, name)) for name in ("time", *HISTORIES)],
            "factors": self.factors,
            "changes": self.changes,
            "design": design,
            "cases": _digest(self.cases),
            "measures": self.measures,
            "columns": self.columns,
            "exponent": self.exponent,
            "method": [self.method, self.rtol],
            "versions": [version(name) for name in ("guideload", "numpy", "scipy")],
        }
        return hashlib.sha256(json.dumps(told, default=_plain, sort_keys=True).encode()).hexdigest()

    def __getstate__(self) -> dict[str, Any]:
        return {field.name: getattr(self, field.name) for field in fields(self)}


def _digest(array: Array | None) -> str | None:
    if array is None:
        return None
    return f"{array.shape} {hashlib.sha256(array.astype('<f8').tobytes()).hexdigest()}"


def _plain(value: Any) -> Any:
    """What JSON has no form for: a dataclass by its name and fields."""
    if isinstance(value, Sample):
        return ["Sample", _digest(value.values)]
    return [type(value).__name__, {field.name: getattr(value, field.name) for field in fields(value)}]
