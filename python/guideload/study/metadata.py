"""What a study was, as plain data: all that its statistics, report and pictures need besides the samples."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from guideload.machine.machine import Machine

if TYPE_CHECKING:
    from guideload.study.plan import Plan

Measure = tuple[str, int, str]  # quantity, index of the carriage, statistic


@dataclass(frozen=True)
class Varied:
    """One column of drawn values: its name, its unit ("1": a factor on the machine's value), what it sets."""

    name: str
    unit: str
    targets: tuple[str, ...]


@dataclass(frozen=True)
class StudyMetadata:
    """Machine, motion and design of a study, and what its columns are; written beside the samples as JSON.

    motion       where the trace comes from
    duration     of the motion [s], and instants, its samples
    sampling     "sobol", "latin hypercube" or "random"; "cases" where they were given, without a seed
    runs         all samples of the study, also those of a Saltelli design
    sensitivity  sample i is row i // (d + 2) of matrix i % (d + 2): A, B, A with column j of B
    varied       the d columns of drawn values, in their order
    measures     quantity, carriage and statistic of each column of results, and columns, their names
    exponent     p of the mean load
    limits       quantity without unit, e.g. "peak_resultant", and its limit, SI
    rating, life_base   dynamic rating [N] of a carriage and the travel [m] that it stands for; None: no life
    """

    machine: Machine
    motion: str
    duration: float
    instants: int
    sampling: str
    seed: int | None
    runs: int
    sensitivity: bool
    varied: tuple[Varied, ...]
    measures: tuple[Measure, ...]
    columns: tuple[str, ...]
    exponent: float
    limits: dict[str, float]
    rating: float | None = None
    life_base: float | None = None

    @classmethod
    def of(cls, plan: Plan) -> StudyMetadata:
        """What a plan is about."""
        time = plan.motion.time
        return cls(
            machine=plan.machine,
            motion=plan.motion.source,
            duration=float(time[-1] - time[0]),
            instants=int(time.size),
            sampling="cases" if plan.design is None else plan.design.sampling,
            seed=plan.seed,
            runs=plan.runs,
            sensitivity=plan.sensitivity,
            varied=tuple(Varied(one.name, one.unit, tuple(one.targets)) for one in plan.factors),
            measures=tuple(plan.measures),
            columns=tuple(plan.columns),
            exponent=plan.exponent,
            limits={limit.name: limit.value for limit in plan.limits},
            rating=None if plan.life is None else plan.life.rating,
            life_base=None if plan.life is None else plan.life.base,
        )

    @property
    def chosen(self) -> bool:
        """Whether the cases were given: no random sample, so that nothing follows for machines in general."""
        return self.sampling == "cases"

    @property
    def carriages(self) -> tuple[str, ...]:
        """Names of the carriages, in their order."""
        return tuple(carriage.name for carriage in self.machine.carriages)

    def as_json(self) -> dict[str, Any]:
        """What `from_json` reads back; of numbers, text, lists and tables only."""
        values = {key: value for key, value in self.__dict__.items() if key != "machine"}
        return {
            "machine": self.machine.model_dump(mode="json", exclude_none=True),
            **values,
            "varied": [asdict(one) for one in self.varied],
        }

    @classmethod
    def from_json(cls, values: dict[str, Any]) -> StudyMetadata:
        """The inverse of `as_json`. Raises LookupError, TypeError or GuideloadError where it is something else."""
        return cls(
            **{
                **values,
                "machine": Machine(**values["machine"]),
                "varied": tuple(
                    Varied(one["name"], one["unit"], tuple(one["targets"])) for one in values["varied"]
                ),
                "measures": tuple((quantity, index, what) for quantity, index, what in values["measures"]),
                "columns": tuple(values["columns"]),
            }
        )
