"""The plan of a study: everything that its results depend on; it can be pickled and run in another process."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.special import ndtr

from guideload._core import Batch, MotionDraws, VariedScene
from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError
from guideload.life.equivalent_load import PLAIN_SUM
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.parameters.parameters import Change
from guideload.parameters.parts import arguments_of
from guideload.simulation.instants import fastest_vibration, with_enough_instants
from guideload.simulation.payload_changes import with_changes
from guideload.study.distributions import Sample
from guideload.study.factors import Factor
from guideload.study.metadata import StudyMetadata
from guideload.study.sampling import Design

if TYPE_CHECKING:
    from guideload._core import PayloadOfBatch, Rule

RARE = 3.72  # standard deviations; one normal score of 10 000 is higher


@dataclass(frozen=True, eq=False)
class Plan:
    """Factors, their draws and the measures of a study; immutable, and equal after pickling.

    metadata          description of the study, with the measures of a run
    motion            nominal motion
    factors, changes  columns of values, and the numbers of the core's scene that they change
    design, cases     design of the draws, or given values (runs, factors); the other is None
    histories         indices, ascending, of the runs whose histories are stored
    draw_seed         seed of the draws of the motion, whose numbers are one more column of values; None without draws
    """

    metadata: StudyMetadata
    motion: Motion
    factors: tuple[Factor, ...]
    changes: tuple[Change, ...]
    design: Design | None
    cases: Array | None
    histories: tuple[int, ...]
    draw_seed: int | None = None

    @property
    def runs(self) -> int:
        """Number of runs of the core."""
        return self.metadata.runs

    def values(self, start: int, stop: int) -> Array:
        """(stop - start, factors) values of the runs start to stop - 1. Raises ArgumentError.

        With a drawn motion, the number of its draw is one more column.
        """
        if not 0 <= start <= stop <= self.runs:
            raise ArgumentError(f"values: expected 0 <= start <= stop <= {self.runs}, got {start} and {stop}")
        if self.design is None:
            assert self.cases is not None
            return self.cases[start:stop].copy()
        values = self._values(self.design.uniforms(start, stop))
        if self.draw_seed is None:
            return values
        return np.column_stack([values, self.design.draw_numbers(start, stop)])

    def deviation(self, run: int) -> Array:
        """(n,) m/s2, drawn deviation of the acceleration of a run from the estimate, at the stamps of the motion."""
        return self._draws(self.motion.time, 1.0).deviation(int(self.values(run, run + 1)[0, -1]))

    def _draws(self, time: Array, factor: float) -> MotionDraws:
        """The draws of the motion at instants, times a factor."""
        uncertainty = self.motion.uncertainty
        assert uncertainty is not None and self.draw_seed is not None
        model, derivative, unit, stamps = uncertainty.for_core(self.motion.time)
        return MotionDraws(model, derivative, factor * unit, stamps, time, self.draw_seed)

    def values_at(self, uniforms: Array) -> Array:
        """(n, factors) values of machines with these uniform numbers (factors, n), which are correlated in place."""
        if self.design is not None and self.design.copula is not None:
            self.design.copula.apply(uniforms)
        return self._values(uniforms)

    def _values(self, uniforms: Array) -> Array:
        marginals = [factor.marginal for factor in self.factors if factor.marginal is not None]
        return np.column_stack([marginal.values(u) for marginal, u in zip(marginals, uniforms, strict=True)])

    def batch(self) -> Batch:
        """The core's batch, made once in a process. Raises SceneError if the nominal machine has no solution.

        Between coarse stamps of the motion it has more instants: see `simulation.instants`.
        """
        return self._batch

    @cached_property
    def _batch(self) -> Batch:
        return self._batch_with(with_enough_instants(self.motion, self.fastest_vibration()))

    def fastest_vibration(self) -> float:
        """Angular frequency [rad/s] of the fastest vibration of the nominal machine and of the samples.

        Of drawn samples: of those with one normal score of `RARE` and medians else, and of the one as far from the
        medians in the direction in which the frequency rises fastest: one of some 10 000 vibrates faster.
        """
        machine = self.metadata.machine
        # Without the payloads, which only slow it.
        changes = [change for change in self.changes if not change[0][0].startswith("payload")]
        scene = VariedScene(**arguments_of(machine), changes=changes, columns=len(self.factors))
        if self.cases is not None:
            found = scene.fastest_vibrations(self.cases)
        else:
            ends = np.vstack([np.eye(len(self.factors)), -np.eye(len(self.factors))])
            single = scene.fastest_vibrations(self.values_at(ndtr(RARE * ends.T)))
            median = scene.fastest_vibrations(self.values_at(ndtr(0.0 * ends[:1].T)))
            gains = np.fmax(single - median, 0.0) @ ends
            together = RARE / (np.linalg.norm(gains) or 1.0) * gains
            found = np.append(single, scene.fastest_vibrations(self.values_at(ndtr(together[:, None]))))
        return float(np.fmax.reduce(found, initial=fastest_vibration(machine)))

    def batch_at_stamps(self) -> Batch:
        """The same with the stamps of the motion alone, for histories; its extremes are those at the stamps."""
        return self._batch_with(self.motion, at_samples=True)

    def batch_of_links(self, method: str, rtol: float, factor: float) -> Batch:
        """A batch by a method under the excitation times a factor.

        Its measures are the smallest and largest load of each link along x, y and z.
        """
        points = self.metadata.machine.link_table().points
        links = {
            "groups": list(np.arange(len(points))[:, None]),
            "centers": points,
            "changes": [change for change in self.changes if change[0][0] != "center"],  # of carriages
        }
        measures = list(product(("Fx", "Fy", "Fz"), range(len(points)), ("min", "max")))
        given: dict[str, Any] = {"measures": measures, "rules": None, "method": method, "rtol": rtol}
        return self._batch_with(self.motion, links, factor, **given, at_samples=True)

    def _batch_with(
        self, motion: Motion, scene: Mapping[str, Any] | None = None, factor: float = 1.0, **given: Any
    ) -> Batch:
        """The batch of a motion times a factor, with other arguments of the scene and of the batch."""
        machine, metadata = self.metadata.machine, self.metadata
        of_scene = arguments_of(machine) | {"changes": self.changes} | dict(scene or {})
        own = ("measures", "method", "rtol", "start", "exponent")
        settings: dict[str, Any] = {key: getattr(metadata, key) for key in own} | {"rules": self._rules()}
        if self.draw_seed is not None:
            settings["draws"] = self._draws(motion.time, factor), len(self.factors)
        return Batch(
            VariedScene(**of_scene, payloads=_payloads(machine, motion)),
            time=motion.time,
            acceleration=factor * motion.acceleration,
            wrench=None if motion.wrench is None else factor * motion.wrench,
            speed=None if motion.velocity is None else np.ascontiguousarray(motion.velocity[:, 0]),
            **settings | given,
        )

    def _rules(self) -> list[tuple[Rule, Rule]] | None:
        """Rules of the equivalent loads of each carriage; None if no carriage has a rating."""
        rated = {one.index: (one.rule.of_core, one.static_rule.of_core) for one in self.metadata.rated()}
        plain = (PLAIN_SUM.of_core, PLAIN_SUM.of_core)
        return [rated.get(i, plain) for i in range(len(self.metadata.carriages))] if rated else None

    def __getstate__(self) -> dict[str, Any]:
        return {field.name: getattr(self, field.name) for field in fields(self)}


def _payloads(machine: Machine, motion: Motion) -> list[PayloadOfBatch]:
    """The payloads of the core's batch; motion: with two stamps at each change, as `prepared_run` gives it."""
    stretches = with_changes(machine, motion)[1]
    if stretches is None:
        return []
    ends = (*stretches.first[1:], motion.time.size)
    parts = list(zip(stretches.payloads, zip(stretches.first, ends, strict=True), strict=True))
    stays = {one.name: [part for names, part in parts if one.name in names] for one in machine.payloads}
    return [
        (one.mass, one.center_of_mass, one.inertia, one.inertia_about == "L", stays[one.name])
        for one in machine.payloads
    ]


def with_fingerprint(metadata: StudyMetadata, design: Design | None, *exact: Any) -> StudyMetadata:
    """The metadata of a study with its fingerprint.

    It contains the versions of guideload, NumPy and SciPy, but not histories and limits, and of the products and
    conditions of life only what the recorded loads depend on: the rules. It contains the number of samples for a Latin
    hypercube only, whose draws depend on it: other studies can be resumed with more samples.
    """
    names = ["motion", "motion_exact", "duration", "instants", "travel", "limits", "life_notes"]
    names += ["motion_warnings", "verification"]
    if design is not None and design.sampling != "latin hypercube":
        names.append("runs")
    free: dict[str, Any] = dict.fromkeys(names, True)
    free["machine"] = dict.fromkeys(("catalogue", "products", "life", "report"), True)
    rules = [rule for one in metadata.rated() for rule in (one.rule, one.static_rule)]
    rules_text = [(digest(rule.weights), rule.minor, rule.preload, rule.effect) for rule in rules]
    exact = (*exact, None if design is None else design.copula, rules_text)
    text = json.dumps([metadata.model_dump(mode="json", exclude=free), exact], default=_plain, sort_keys=True)
    return metadata.model_copy(update={"fingerprint": hashlib.sha256(text.encode()).hexdigest()})


def digest(*arrays: Array | None) -> str:
    """SHA-256 of the shapes and numbers of arrays."""
    digest = hashlib.sha256()
    for array in arrays:
        digest.update(b"-" if array is None else str(array.shape).encode() + array.astype("<f8").tobytes())
    return digest.hexdigest()


def _plain(value: Any) -> Any:
    """A dataclass in JSON: its name and fields."""
    if isinstance(value, Sample):
        return ["Sample", digest(value.values)]
    return [type(value).__name__, {field.name: getattr(value, field.name) for field in fields(value)}]
