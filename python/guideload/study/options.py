"""The keys of a study file: options of the study, names of files, options for reading the trace."""

from __future__ import annotations

import secrets
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args, get_type_hints

import numpy as np
from pydantic import (
    AfterValidator,
    Field,
    PlainValidator,
    StrictBool,
    StrictStr,
    ValidationInfo,
    create_model,
    model_validator,
)

from guideload.base.config import ConfigModel, in_range, optional, whole, whole_number
from guideload.base.errors import ConfigError, KeyPath, ValueRefused, refused_at
from guideload.base.methods import Method
from guideload.base.ranges import FACTOR, PERIOD, TIME, TOLERANCE
from guideload.base.toml import TomlPlace, read_toml
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.motion.moves import Moves
from guideload.simulation.start import Start
from guideload.study.factors import Correlation
from guideload.study.quantities import STATISTICS, Recorded, Statistic
from guideload.study.sampling import Sampling, Sobol
from guideload.study.varied_parameters import DistributionSpec, NumberOrText
from guideload.traces.channels import forces_beside
from guideload.traces.options import ReadingOptions, SmoothingOptions
from guideload.traces.reading import motion_from_trace, read_trace

REPLICATES = 8  # fewer have wider intervals, more leave each of them less even


def _indices(value: object) -> int | tuple[int, ...]:
    """Indices of runs, ascending; or the number of first runs."""
    index = partial(whole_number, least=0, most=2**63 - 1)
    if isinstance(value, Sequence | np.ndarray) and not isinstance(value, str):
        return tuple(sorted({index(one) for one in value}))
    return index(value)


Positive = Annotated[float, in_range(FACTOR, above=0.0)]
SMOOTHING = get_type_hints(SmoothingOptions, include_extras=True)
CHECKED: dict[Any, Any] = {  # types of options in a file, by name or by type in code; all others are text
    "window": Annotated[float, in_range(PERIOD, above=0.0)],
    float | str | None: NumberOrText,
    int | None: Annotated[int, whole(0, 62)],
    float | None: Positive,
    bool | None: StrictBool,
}
OPTIONS = {
    key: (CHECKED.get(key, CHECKED.get(kind, StrictStr)) | None, optional(description))
    for key, hint in (get_type_hints(ReadingOptions, include_extras=True) | SMOOTHING).items()
    for kind, description in [get_args(hint)]
}
if TYPE_CHECKING:
    Keys = ConfigModel
else:
    Keys = create_model("Keys", __base__=ConfigModel, **OPTIONS)


class TraceOptions(Keys):
    """Options for reading the trace, as in `guideload run`; by default they are detected."""

    def motion(self, trace: Path, machine: Machine) -> Motion:
        """The motion of the machine in a trace or a motion file (.toml). Raises TraceError, ConfigError."""
        if _is_planned(trace):
            return Moves.from_toml(trace).motion()
        options = self.model_dump(exclude_none=True)
        smoothing = {key: options.pop(key) for key in SMOOTHING.keys() & options}
        return motion_from_trace(read_trace(trace, **options), drive=machine.drive, **smoothing)


def _is_planned(motion: str | Path) -> bool:
    return Path(motion).suffix.lower() == ".toml"


def _of_a_trace(options: TraceOptions, info: ValidationInfo) -> TraceOptions:
    motion, given = info.data.get("trace") or info.data.get("motion"), options.model_dump(exclude_none=True)
    if given and isinstance(motion, str) and _is_planned(motion):
        raise ValueRefused("no reading beside planned moves", given, "they are known exactly")
    return options


Reading = Annotated[TraceOptions, AfterValidator(_of_a_trace)]  # below the key trace or motion


class ForcesOptions(ConfigModel):
    """Process forces on the body in all samples, from a table with columns such as Fx [N] and Mz [N m]."""

    file: StrictStr = Field(
        min_length=1, description='a table with its own time stamps, e.g. "forces.csv"; or that of the trace'
    )
    at: StrictStr = Field(description="name of the point of the machine file ([[points]]) where they act")
    axes: Literal["machine", "point"] = optional(
        "axes of the forces: of the machine, or the point's own", "machine"
    )
    start: Annotated[float, in_range(TIME)] | None = optional(
        'time in the motion of the zero of their time stamps, e.g. "0.35 s"'
    )

    def added_to(
        self, motion: Motion, folder: Path, machine: Machine, trace: str, reading: TraceOptions
    ) -> Motion:
        """The motion of the trace with the forces. Raises TraceError, ArgumentError."""
        point = machine.point(self.at)
        forces = forces_beside(folder / trace, reading.model_dump(exclude_none=True), folder / self.file)
        return motion.with_forces(forces, point, own_axes=self.axes == "point", start=self.start)


class MotionOptions(ConfigModel):
    """How the motion scatters."""

    posterior: StrictBool = optional(
        "whether each sample has a motion of its own, drawn from the posterior of the trace", False
    )


class StudyOptions(ConfigModel):
    """The options of a study, in a file and in code."""

    MOVED = {
        "exponent": "that of the mean load is the exponent of the carriages' product, in the machine file",
        "life": "life follows from the machine file: a product with dynamic and static rating for each carriage "
        "(catalogue, or a [[products]] table), and conditions in its table [life]",
    }
    samples: Annotated[int, whole(1, 2**Sobol.BITS)] | None = optional("number of samples, e.g. 10_000")
    seed: Annotated[int, whole(0, 2**63 - 1)] = Field(
        default_factory=lambda: secrets.randbelow(2**32), description="seed of all draws; random by default"
    )
    sampling: Sampling = optional("sequence of the samples", "sobol")
    replicates: Annotated[int, whole(1, 1024)] | None = optional(
        "independent scrambles of the sequence, among which the samples are divided; their scatter gives the standard "
        f"errors; 1: one scramble, and cautious intervals; default {REPLICATES}, for random samples none"
    )
    sensitivity: StrictBool = optional("Sobol indices, from samples times (factors + 2) runs", False)
    histories: Annotated[int | tuple[int, ...], PlainValidator(_indices)] = optional(
        "runs whose histories are stored, or the number of first runs", 0
    )
    quantities: tuple[Recorded, ...] | None = optional(
        "recorded loads; default all but Fx, and Mx only where a carriage has width or stiffness_roll",
        min_length=1,
    )
    statistics: tuple[Statistic, ...] = optional("statistics of loads over time", STATISTICS, min_length=1)
    method: Method = optional("method of integration, as in `guideload run`", "auto")
    rtol: Annotated[float, in_range(TOLERANCE, above=0.0)] = optional(
        "relative tolerance of the loads, for all methods but exact", 1e-6
    )
    start: Start = optional("state in which every run starts, as in `guideload run`", "auto")
    limits: dict[str, NumberOrText] = optional('limits for exceedance, e.g. peak_resultant = "8 kN"', {})
    vary: tuple[DistributionSpec, ...] = optional("one [[vary]] table for each varied parameter", ())
    correlation: tuple[Correlation, ...] = optional("one [[correlation]] table each", ())


class StudyFile(StudyOptions):
    """A study file: options of the study, and names of the files beside it."""

    machine: Annotated[StrictStr, Field(min_length=1, description='a machine file, e.g. "machine.toml"')]
    trace: Annotated[
        StrictStr,
        Field(
            min_length=1,
            description='a measured trace, e.g. "trace.csv", or planned moves, e.g. "moves.toml"',
        ),
    ]
    reading: Reading = optional("the table [reading]: how the trace is read", TraceOptions())
    forces: ForcesOptions | None = optional("the table [forces]: process forces beside the motion")
    motion: MotionOptions = optional("the table [motion]: how the motion scatters", MotionOptions())
    cases: StrictStr | None = optional("a table of given cases in place of [[vary]]; its headers are paths")

    @model_validator(mode="after")
    def _no_seed_beside_cases(self) -> StudyFile:
        if self.cases is not None and "seed" in self.model_fields_set:
            raise refused_at(
                ("seed",), "no seed beside cases", self.seed, "cases are run as they are, in order"
            )
        return self

    @property
    def files(self) -> dict[KeyPath, str | None]:
        """Names of the files that it names, by their keys."""
        files: dict[KeyPath, str | None] = {
            (key,): getattr(self, key) for key in ("machine", "trace", "cases")
        }
        files["forces", "file"] = None if self.forces is None else self.forces.file
        return files | {("vary", i, "file"): getattr(one, "file", None) for i, one in enumerate(self.vary)}


TABLES = {"reading", "forces", "motion", "limits", "vary", "correlation"}
TOP_KEYS = StudyFile.model_fields.keys() - TABLES  # keys outside all tables


def read_study(file: str | PathLike[str]) -> tuple[dict[str, Any], dict[KeyPath, TomlPlace]]:
    """The values of a study file and their rows. Raises ConfigError if the file cannot be read."""
    return read_toml(file, source="`guideload init --study` writes one")


def with_hint_on_place(error: ConfigError) -> ConfigError:
    """The same error, with a hint if a key of the whole study is inside a table."""
    hint = "it is a key of the whole study: put it above the first [table]"
    problems = (
        replace(problem, hint=hint)
        if len(problem.path) > 1
        and problem.path[-1] in TOP_KEYS
        and problem.expected in ("a known key", "a known limit")
        else problem
        for problem in error.problems
    )
    return ConfigError(problems, error.file, error.others)
