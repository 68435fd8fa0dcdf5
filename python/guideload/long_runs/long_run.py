"""Loads of a record of any length: its motion comes in blocks, and each block leaves peaks, mean loads and a state.

A block starts in the state in which the one before ended, so that the loads are those of one run over the whole record.
Memory holds one block.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from guideload.audit.motion_plausibility import motion_warnings
from guideload.base.arguments import checked
from guideload.base.arrays import Array
from guideload.base.errors import ArgumentError, LifeError
from guideload.base.methods import Method
from guideload.catalogue.life_target import Repetition
from guideload.life.criteria import Criteria, known_criteria, require_rated_moments
from guideload.life.largest_loads import largest_of, static_rules
from guideload.life.mean_load import Travel, integrals, load_bows
from guideload.life.rating_life import failure_probability, system_life
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.simulation.peaks import RESULTANT, Peaks
from guideload.simulation.simulation import prepared_run
from guideload.simulation.start import Start

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class Block:
    """What one block leaves.

    start, end  s
    samples     of the motion, without the first one, which belongs to the block before; with it in the first block
    peaks       extremes of the loads
    powers      (rated,) N^p m, integral of P^p over the path, of each carriage with ratings
    distance    m, travel; nan if no carriage has ratings
    safeties    (rated,) smallest static safety, and `times` of it [s]
    notes       on its motion: what was detected, chosen and repaired in its rows
    warnings    of its motion
    """

    start: float
    end: float
    samples: int
    peaks: Peaks
    powers: Array
    distance: float
    safeties: Array
    times: Array
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


class LongRun:
    """Peaks, life and static safety of a machine over a record that comes in blocks.

    >>> run = LongRun(machine)
    >>> for block in motion_blocks("log.parquet", machine.drive):
    ...     run.add(block)

    machine, blocks  the machine, and what each block left: a few hundred numbers
    criteria         of the carriages whose products have ratings; without any there is no life

    method, rtol, start: as for `simulate`; the first block decides `auto`. Between two blocks, or after Ctrl-C, the
    properties give the values so far. Raises ArgumentError for a machine with riders, with payloads that change or on
    rails that are not straight, and LifeError for a moment that the rule of the life counts and that is not rated.
    """

    @checked
    def __init__(
        self, machine: Machine, method: Method = "auto", *, rtol: float = 1e-6, start: Start = "auto"
    ) -> None:
        machine.require_no_payloads("a run in blocks")
        for what, there in (
            ("riders", machine.riders),
            ("rails that are not straight", not machine.has_straight_rails),
        ):
            if there:
                raise ArgumentError(
                    f"{what}: a run in blocks does not support them; use simulate, over parts of the record"
                )
        self.machine, self.blocks = machine, list[Block]()
        self.criteria: tuple[Criteria, ...] = known_criteria(machine, machine.life)
        for one in self.criteria:
            require_rated_moments(machine, one)
        self._rules = static_rules(machine, self.criteria)
        self._method: str = method
        self._rtol = rtol
        self._start: Start | Array = start

    @checked
    def add(self, motion: Motion) -> None:
        """Run the next block; its first stamp is the last one of the block before.

        Raises ArgumentError for a block that does not follow, LifeError for a block without velocity where a life is
        computed, and what `simulate` raises. A block that raises leaves nothing.
        """
        if self.blocks and motion.time[0] != self.blocks[-1].end:
            raise ArgumentError(
                f"time[0]: expected {self.blocks[-1].end!r} s, the last stamp of the block before, got "
                f"{float(motion.time[0])!r}"
            )
        if self.criteria and motion.velocity is None:
            raise LifeError("velocity: the mean load is a mean over distance; give the motion a velocity")
        run = prepared_run(
            self.machine, motion, self._method, self._rtol, None, None, self._start, finer=True
        )
        extremes, loads = run.extremes(rules=self._rules), run.carriage_loads()
        assert extremes is not None  # at any time, as all rails are straight
        largest = largest_of(extremes, self.criteria)
        powers, distance = [], math.nan
        bows = load_bows(run) if self.criteria else np.zeros((0, 0, 6))
        for one in self.criteria:
            load, bow = loads[:, one.index], bows[:, one.index]
            power, path = integrals(Travel.of(run.motion), load, one.rule, one.rating.exponent, bow)
            powers.append(float(power.sum()))
            distance = float(path.sum())
        safeties = [one.safety_under(of.equivalent) for one, of in zip(self.criteria, largest, strict=True)]
        self._start, self._method = run.solution.end(), run.method
        new = motion.time.size - bool(self.blocks)
        self.blocks.append(
            Block(
                start=float(motion.time[0]),
                end=float(motion.time[-1]),
                samples=new,
                peaks=Peaks.of(self.machine, extremes[:4]),
                powers=np.array(powers),
                distance=distance,
                safeties=np.array(safeties),
                times=np.array([of.time for of in largest]),
                notes=tuple(motion.notes),
                warnings=tuple(motion_warnings(motion)),
            )
        )

    # ---- of all blocks so far

    @property
    def method(self) -> str:
        """The integration method."""
        return self._method

    @property
    def samples(self) -> int:
        """Number of samples."""
        return sum(block.samples for block in self.blocks)

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return self.blocks[-1].end - self.blocks[0].start if self.blocks else 0.0

    @property
    def distance(self) -> float:
        """Travel [m]; nan if no carriage has ratings."""
        return math.fsum(block.distance for block in self.blocks)

    @property
    def peaks(self) -> Peaks:
        """The extremes of the loads of every carriage. Raises ArgumentError before the first block."""
        self._require_blocks()
        whole = self.blocks[0].peaks
        for block in self.blocks[1:]:
            one = block.peaks
            lower, higher = one.smallest < whole.smallest, one.largest > whole.largest
            whole = replace(
                whole,
                smallest=np.where(lower, one.smallest, whole.smallest),
                largest=np.where(higher, one.largest, whole.largest),
                time_of_smallest=np.where(lower, one.time_of_smallest, whole.time_of_smallest),
                time_of_largest=np.where(higher, one.time_of_largest, whole.time_of_largest),
            )
        return whole

    @property
    def mean_loads(self) -> Array:
        """Mean equivalent load over the distance (rated,) [N], of each carriage with ratings; nan without travel."""
        powers = self._powers.sum(axis=0)
        exponents = np.array([one.rating.exponent for one in self.criteria])
        distance = self.distance if self.distance > 0.0 else math.nan
        return np.asarray((powers / distance) ** (1.0 / exponents))

    @property
    def lives(self) -> Array:
        """Life of each carriage with ratings (rated,) [m], if the record repeats; nan without travel."""
        return np.array(
            [one.life_under(load) for one, load in zip(self.criteria, self.mean_loads, strict=True)]
        )

    @property
    def machine_life(self) -> float:
        """The life [m] that all carriages with ratings reach together; nan without ratings or travel."""
        return float(system_life(self.lives)) if self.criteria else math.nan

    @property
    def used(self) -> float:
        """Probability that a carriage has failed by fatigue after the travel of this record; nan as the life."""
        if not self.criteria:
            return math.nan
        return float(failure_probability(self.distance, self.machine_life, self.machine.life.reliability))

    @property
    def safeties(self) -> tuple[Array, Array]:
        """Smallest static safety of each carriage with ratings (rated,), and its time [s].

        Raises ArgumentError before the first block.
        """
        self._require_blocks()
        values, times = (
            np.array([getattr(block, name) for block in self.blocks]) for name in ("safeties", "times")
        )
        at = values.argmin(axis=0), np.arange(values.shape[1])
        return values[at], times[at]

    @checked
    def hours(self, life: float) -> float:
        """Hours of operation in which the machine travels `life` [m]; nan without travel."""
        return self.repetition.hours(life)

    @property
    def repetition(self) -> Repetition:
        """The record as one cycle, which repeats at once, or `cycles_per_hour` times."""
        return self.machine.life.repetition(self.distance, self.duration)

    @property
    def wanted(self) -> float | None:
        """The required life as travel [m]; None if the machine file asks for no life, or if the cart did not travel."""
        target = self.machine.life.life
        return self.repetition.travel(target) if target is not None and self.distance > 0.0 else None

    @property
    def holds(self) -> bool:
        """Whether the carriages with ratings reach the static safety and, if the cart travelled, the life asked for.

        Raises ArgumentError before the first block.
        """
        reached = self.wanted is None or self.machine_life >= self.wanted
        return reached and bool(np.all(self.safeties[0] >= self.machine.life.least_safety))

    def table(self) -> pd.DataFrame:
        """A row per block: its time, travel, and of each carriage the largest resultant and the share of its damage."""
        import pandas as pd

        columns: dict[str, list[float] | Array] = {
            "start_s": [block.start for block in self.blocks],
            "end_s": [block.end for block in self.blocks],
            "samples": [float(block.samples) for block in self.blocks],
        }
        for i, carriage in enumerate(self.machine.carriages):
            resultants = [float(block.peaks.largest[i, RESULTANT]) for block in self.blocks]
            columns[f"{carriage.name}_peak_resultant_N"] = resultants
        if self.criteria:
            columns["distance_m"] = [block.distance for block in self.blocks]
        for one, powers in zip(self.criteria, self._powers.T, strict=True):
            columns[f"{one.name}_share_of_damage"] = powers / (powers.sum() or 1.0)
        return pd.DataFrame(columns)

    def _require_blocks(self) -> None:
        if not self.blocks:
            raise ArgumentError("LongRun: no block was added yet")

    @property
    def _powers(self) -> Array:
        """The integrals of P^p over the path of each block (block, rated) [N^p m]."""
        return np.array([block.powers for block in self.blocks]).reshape(len(self.blocks), len(self.criteria))

    def __repr__(self) -> str:
        return f"<LongRun of {self.machine.name}: {self.samples} samples in {len(self.blocks)} blocks>"
