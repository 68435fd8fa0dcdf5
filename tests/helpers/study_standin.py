"""A stand-in for the plan of a study: values and results are hashes, so that any sample lost or mixed up shows.

It is a plan in all that it tells; only what it draws and what the core computes are replaced.
"""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass, fields
from functools import lru_cache
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
from machines import with_mass
from numpy.typing import NDArray

from guideload.base.errors import GuideloadError
from guideload.cli.inputs import EXAMPLES
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.study.execution import run_study
from guideload.study.plan import Plan
from guideload.study.storage import SampleStore
from guideload.study.study import Study

Array = NDArray[np.float64]


def mixed(numbers: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """A number without pattern for each (splitmix64)."""
    z = numbers + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


def fractions(numbers: NDArray[np.uint64]) -> Array:
    """From 0 to 1, by all 53 bits."""
    return (numbers >> np.uint64(11)).astype(np.float64) * 2.0**-53


class HashedBatch:
    """As `_core.Batch`: a row depends on the values of its sample alone; every 50th or so fails.

    pause: s that each sample takes. sizes: samples of each call.
    """

    def __init__(self, measures: int, instants: int, carriages: int, pause: float) -> None:
        self.measures, self.instants, self.carriages, self.pause = measures, instants, carriages, pause
        self.sizes: list[int] = []

    def _seeds(self, values: Array) -> NDArray[np.uint64]:
        seeds = np.zeros(len(values), np.uint64)
        for column in np.ascontiguousarray(values).view(np.uint64).T:
            seeds = mixed(seeds ^ column)
        return seeds

    def _loads(self, values: Array, columns: int) -> tuple[Array, list[tuple[int, str]]]:
        seeds = self._seeds(values)
        loads = fractions(mixed(seeds[:, None] ^ np.arange(columns, dtype=np.uint64)))
        bad = np.flatnonzero(seeds % np.uint64(50) == 0)
        loads[bad] = np.nan
        return loads, [(int(i), f"no equilibrium at {values[i, 0]:.3f} kg") for i in bad]

    def run(self, values: Array, threads: int) -> tuple[Array, list[tuple[int, str]]]:
        assert threads >= 1
        self.sizes.append(len(values))
        time.sleep(self.pause * len(values) / threads)
        return self._loads(values, self.measures)

    def histories(self, values: Array) -> tuple[Array, list[tuple[int, str]]]:
        loads, failed = self._loads(values, self.instants * self.carriages * 6)
        return loads.reshape(len(values), self.instants, self.carriages, 6), failed


@dataclass(frozen=True, eq=False)
class StandIn(Plan):
    """A plan with hashed draws and results. pause: s that each sample takes."""

    pause: float = 0.0

    def values(self, start: int, stop: int) -> Array:
        assert 0 <= start <= stop <= self.runs
        samples = np.arange(start, stop, dtype=np.uint64)
        columns = mixed(np.arange(len(self.factors), dtype=np.uint64) + np.uint64(self.metadata.seed or 0))
        return fractions(mixed(samples[:, None] ^ columns)) + 0.5

    def batch(self) -> Any:
        metadata, instants = self.metadata, self.motion.time.size
        return _batch(len(metadata.measures), instants, len(metadata.carriages), self.pause, metadata.seed)

    def batch_at_stamps(self) -> Any:
        return self.batch()


@lru_cache(maxsize=8)
def _batch(measures: int, instants: int, carriages: int, pause: float, _: int | None) -> HashedBatch:
    return HashedBatch(measures, instants, carriages, pause)


def study(samples: int = 1000, seed: int = 1, histories: Sequence[int] = (), mass: float = 1250.0) -> Study:
    """A small study of the example machine on a short move."""
    machine = with_mass(Machine.from_toml(str(EXAMPLES / "manipulator.toml")), mass)
    motion = Motion.along_x(time=[0, 0.5, 0.6, 1.2, 1.3, 2], acceleration=[0, 0, 2, 2, 0, 0])
    stiffness = dict(name="k", path="carriages.*.stiffness_y", each="carriage")
    vary = [
        dict(path="body.mass", distribution="uniform", plus_minus="10 %"),
        dict(**stiffness, distribution="lognormal", sigma=0.2),
    ]
    given: dict[str, Any] = {"machine": machine, "motion": motion, "vary": vary, "histories": list(histories)}
    given |= {"quantities": ["resultant"], "statistics": ["max", "time_of_max"]}
    return Study(**given, samples=samples, seed=seed)


def plan(samples: int = 1000, seed: int = 1, *, pause: float = 0.0, **keys: Any) -> StandIn:
    """The stand-in for the plan of `study`."""
    real = study(samples, seed, **keys).plan()
    return StandIn(**{field.name: getattr(real, field.name) for field in fields(real)}, pause=pause)


def run_in_child(
    out: str, histories: Sequence[int], pool: bool, largest_file: int | None, said: Connection
) -> None:
    """What a process does that is killed, or whose files may not be larger than so many bytes."""
    os.setsid()  # so that it can be ended with the workers of its pool
    if largest_file is not None:
        import resource

        resource.setrlimit(resource.RLIMIT_FSIZE, (largest_file, largest_file))
    try:
        fork = multiprocessing.get_context("fork")  # workers that are copies of this process
        with ProcessPoolExecutor(2, fork) if pool else nullcontext() as executor:
            slow = plan(pause=2e-4, histories=histories)
            run_study(slow, out, chunk=50, resume=True, executor=executor)
    except GuideloadError as error:
        said.send(f"{type(error).__name__}: {error}")


def stops_at(samples: int) -> Callable[[int, int], None]:
    """Progress of a study that somebody interrupts when so many samples are done."""

    def progress(done: int, _: int) -> None:
        if done >= samples:
            raise KeyboardInterrupt

    return progress


def contents(store: SampleStore) -> dict[str, bytes]:
    """Every bit of a study, column by column; the reasons with them."""
    columns = {name: store.column(name).tobytes() for name in store.columns}
    return {**columns, "reasons": repr(sorted(store.reasons().items())).encode()}
