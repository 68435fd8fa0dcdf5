"""The description of a study: a TOML file, or the same in code, and the plan that it becomes."""

from __future__ import annotations

import secrets
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cached_property, partial
from os import PathLike
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import (
    Field,
    InstanceOf,
    PlainValidator,
    StrictBool,
    StrictStr,
    model_validator,
)
from scipy.stats import qmc

from guideload.base.config import ConfigModel, number
from guideload.base.errors import ABSENT, ConfigError, KeyPath, Problem, ValueRefused, shown
from guideload.base.toml import Place, located, read_toml
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.simulation.simulation import Method
from guideload.study.cases import cases_of
from guideload.study.correlation import Correlation, copula_of
from guideload.study.factors import Vary, factors_of
from guideload.study.measures import (
    STATISTICS,
    Life,
    Quantity,
    Statistic,
    limits_of,
    measures_of,
)
from guideload.study.parameters import Parameters
from guideload.study.plan import Plan
from guideload.study.sampling import Design, Sampling, Sobol
from guideload.traces.reading import motion_from_trace, read_trace

MOST_SAMPLES = 2**Sobol.BITS


# ---- values


def _count(value: object, least: int, most: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not least <= value <= most:
        raise ValueRefused(f"a whole number from {least} to {most}", value)
    return int(value)


def _indices(value: object) -> int | tuple[int, ...]:
    """Indices of runs, ascending; or a count, the first so many."""
    count = partial(_count, least=0, most=2**63 - 1)
    if isinstance(value, Sequence | np.ndarray) and not isinstance(value, str):
        return tuple(sorted({count(index) for index in value}))
    return count(value)


def _exponent(value: object) -> float:
    """A number, or a fraction as text: "10/3"."""
    try:
        return number(float(Fraction(value)) if isinstance(value, str) else value, "1", above=0.0)
    except (ValueError, ZeroDivisionError):
        raise ValueRefused("an exponent > 0", value, '3 for balls, "10/3" for rollers') from None


def _raw(value: object) -> object:
    """A number or text, whose unit is checked when the key has told which."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueRefused("a number, or text with a unit", value)
    return value


Raw = Annotated[Any, PlainValidator(_raw)]


class Reading(ConfigModel):
    """How the trace is read, as by the options of `guideload run`; what is left out is taken from its header."""

    column: StrictStr | None = Field(default=None, description="column of the measured motion")
    unit: Raw | None = Field(
        default=None, description='of that column, e.g. "rpm"; for counts the travel of one'
    )
    kind: StrictStr | None = Field(default=None, description="position, counts, velocity or motor_speed")
    time: StrictStr | None = Field(default=None, description="column of the time stamps")
    rate: Raw | None = Field(default=None, description="samples per second, in place of a time column")
    clock: StrictStr | None = Field(
        default=None, description="kind of the time stamps: uniform, ticks, jitter or on_change"
    )
    quantum: Raw | None = Field(default=None, description='step of the value, e.g. "5e-8 m"')
    counter_bits: Annotated[int, PlainValidator(partial(_count, least=0, most=62))] | None = Field(
        default=None, description="width of a counter of counts that runs over, 0 for none"
    )
    hold: Annotated[float, PlainValidator(partial(number, unit="1", above=0.0))] | None = Field(
        default=None,
        description="rows in which each value stands, in a log faster than its signal; 1 takes all",
    )
    date_order: StrictStr | None = Field(
        default=None, description='of dates such as 03/04/2024: "dmy" or "mdy"'
    )
    max_speed: Raw | None = Field(default=None, description='greatest speed of the axis, e.g. "2 m/s"')
    allow_gaps: StrictBool | None = Field(default=None, description="whether long steps in time are accepted")
    repair: StrictStr | None = Field(
        default=None,
        description='damage to leave out: "all", or some of "empty,doubled,clock,outliers,stuck"',
    )
    cross_check: StrictBool | None = Field(
        default=None, description="whether position is compared with velocity"
    )
    smoothing: StrictStr | None = Field(
        default=None, description="auto; for comparison spline, savitzky_golay or differences"
    )
    window: Annotated[float, PlainValidator(partial(number, unit="s", above=0.0))] | None = Field(
        default=None, description="of savitzky_golay, in s"
    )

    def motion(self, trace: Path, machine: Machine) -> Motion:
        """The motion of the machine that the trace tells. Raises TraceError."""
        given = self.model_dump(exclude_none=True)
        smoothing = {key: given.pop(key) for key in ("smoothing", "window") if key in given}
        return motion_from_trace(read_trace(trace, **given), drive=machine.drive, **smoothing)


# ---- the study


class Questions(ConfigModel):
    """What a study asks, in a file as in code."""

    samples: Annotated[int, PlainValidator(partial(_count, least=1, most=MOST_SAMPLES))] | None = Field(
        default=None, description="how many are drawn, e.g. 10_000"
    )
    seed: Annotated[int, PlainValidator(partial(_count, least=0, most=2**63 - 1))] = Field(
        default_factory=lambda: secrets.randbelow(2**32), description="of all draws; drawn if left out"
    )
    sampling: Sampling = Field(default="sobol", description="how samples are spread")
    sensitivity: StrictBool = Field(
        default=False,
        description="whether Sobol indices are computed: samples times (factors + 2) runs, a Saltelli design",
    )
    histories: Annotated[int | tuple[int, ...], PlainValidator(_indices)] = Field(
        default=0, description="runs whose histories are kept, or how many of the first"
    )
    quantities: tuple[Quantity, ...] | None = Field(
        default=None,
        min_length=1,
        description="what is kept of each run; all that is not always 0 if left out",
    )
    statistics: tuple[Statistic, ...] = Field(
        default=STATISTICS, min_length=1, description="of the forces and moments"
    )
    exponent: Annotated[float, PlainValidator(_exponent)] = Field(
        default=3.0, description='of the mean load: 3 for balls, "10/3" for rollers'
    )
    method: Method = Field(default="auto", description="as of `guideload run`")
    rtol: Annotated[float, PlainValidator(partial(number, unit="1", above=0.0))] = Field(
        default=1e-6, description="error of the loads that rk45 and implicit may make"
    )
    limits: dict[str, Raw] = Field(
        default={}, description='of which the probability to pass is told, e.g. peak_resultant = "8 kN"'
    )
    life: Life | None = Field(default=None, description="the table [life]: rating and base")
    vary: tuple[Vary, ...] = Field(default=(), description="one [[vary]] table for each entry")
    correlation: tuple[Correlation, ...] = Field(default=(), description="one [[correlation]] table each")


class StudyFile(Questions):
    """A study file: machine, trace and tables by the names of files beside it."""

    machine: Annotated[StrictStr, Field(min_length=1, description='a machine file, e.g. "machine.toml"')]
    trace: Annotated[StrictStr, Field(min_length=1, description='a measured trace, e.g. "trace.csv"')]
    reading: Reading = Field(default=Reading(), description="the table [reading]: how the trace is read")
    cases: StrictStr | None = Field(
        default=None, description="a table of given cases in place of [[vary]], its headers are paths"
    )


TABLES = {"reading", "limits", "life", "vary", "correlation"}
ABOVE = StudyFile.model_fields.keys() - TABLES  # keys that stand in no table
UNKNOWN = ("a known key", "a known limit")  # what is expected in place of a key that a table does not have


class Study(Questions):
    """A study of what the loads of a machine are where its parameters scatter.

    Raises ConfigError with what is wrong, TraceError for a trace or a table, and SceneError for a machine that its
    links leave unsupported, all before anything runs.
    """

    machine: Machine = Field(description="as it is where nothing varies")
    motion: InstanceOf[Motion] = Field(description="of all samples")
    cases: Any = Field(
        default=None, description="in place of `vary`: a table, or its file, whose headers are paths"
    )
    sources: tuple[Path, ...] = Field(
        default=(), description="files that the study itself, machine and motion were read from"
    )

    @classmethod
    def from_toml(
        cls, file: str | PathLike[str], *, samples: int | None = None, seed: int | None = None
    ) -> Study:
        """The study described in a TOML file; errors name file, row, key and value.

        samples, seed: in place of the file's, which need not have them.
        """
        values, where = read_study(file)
        given = {key: value for key, value in (("samples", samples), ("seed", seed)) if value is not None}
        where = {path: place for path, place in where.items() if path[0] not in given}
        folder = Path(file).parent
        try:
            written = StudyFile(**{**values, **given})
            _require_files(written, folder)
            machine = Machine.from_toml(folder / written.machine)
            motion = written.reading.motion(folder / written.trace, machine)
            kept = {key: getattr(written, key) for key in Questions.model_fields}
            kept["vary"] = tuple(
                entry if entry.file is None else entry.model_copy(update={"file": str(folder / entry.file)})
                for entry in written.vary
            )
            cases = None if written.cases is None else folder / written.cases
            sources = (Path(file), folder / written.machine, folder / written.trace)
            return cls(machine=machine, motion=motion, cases=cases, sources=sources, **kept)
        except ConfigError as error:
            if error.file is not None:  # the machine's own file
                raise
            raise located(_misplaced(error), str(file), where) from None

    @model_validator(mode="after")
    def _possible(self) -> Study:
        _ = self.machine.scene, self._plan  # made once, and kept
        return self

    @property
    def inputs(self) -> tuple[Path, ...]:
        """All files that are known to have been read: `sources`, given cases and measured values."""
        cases = (Path(self.cases),) if isinstance(self.cases, str | Path) else ()
        return (*self.sources, *cases, *(Path(entry.file) for entry in self.vary if entry.file is not None))

    def plan(self) -> Plan:
        """What is run: values by index, the core's batch, names of all columns."""
        return self._plan

    @cached_property
    def _plan(self) -> Plan:
        self._require_one_source()
        parameters = Parameters(self.machine, self.motion)
        design = cases = None
        if self.cases is not None:
            factors, changes, cases = cases_of(self.cases, parameters)
            runs = len(cases)
        else:
            assert self.samples is not None
            factors, changes = factors_of(self.vary, parameters)
            copula = copula_of(self.correlation, factors, self.vary)
            self._require_possible_design(len(factors), copula is not None)
            design = Design(self.sampling, self.seed, self.samples, len(factors), self.sensitivity, copula)
            runs = design.runs
        of = self.histories
        histories = tuple(range(min(of, runs))) if isinstance(of, int) else of
        if histories and histories[-1] >= runs:
            raise _refused("histories", histories[-1], f"indices below {runs}, the number of runs")
        measures, columns = measures_of(self.machine, self.motion, self.quantities, self.statistics)
        if self.life is not None and not any(quantity == "load" for quantity, _, _ in measures):
            hint = (
                'add "load" to quantities'
                if self.motion.velocity is not None
                else "the motion has no velocity"
            )
            raise _refused("life", self.life.model_dump(), "a mean load to count the life from", hint)
        return Plan(
            machine=self.machine,
            motion=self.motion,
            factors=factors,
            changes=changes,
            design=design,
            cases=cases,
            measures=measures,
            columns=columns,
            exponent=self.exponent,
            method=self.method,
            rtol=self.rtol,
            histories=histories,
            limits=limits_of(self.limits, columns, self.life),
            life=self.life,
        )

    def _require_one_source(self) -> None:
        """Either draws or given cases, and all that they need."""
        if self.cases is not None:
            for key in ("vary", "correlation", "samples", "sensitivity"):
                value = getattr(self, key)
                if value:
                    hint = "cases are run as they are, in order: keep one of them"
                    shown_value = value if isinstance(value, int) else len(value)
                    raise _refused(key, shown_value, f"no {key} beside cases", hint)
            return
        for key, hint in (("samples", "samples = 10_000"), ("vary", "a [[vary]] table, or cases")):
            if not getattr(self, key):
                words = Questions.model_fields[key].description or ""
                raise ConfigError([Problem((key,), None, words, f"add {hint}", None, ABSENT)])

    def _require_possible_design(self, factors: int, correlated: bool) -> None:
        if self.sensitivity and correlated:
            hint = "a Sobol index is a share of the variance, which correlated factors have in common"
            raise _refused("sensitivity", True, "false where factors are correlated", hint)
        most = qmc.Sobol.MAXDIM // (2 if self.sensitivity else 1)
        if self.sampling == "sobol" and factors > most:
            hint = f'these entries have {factors}; "random" takes any number'
            raise _refused("sampling", self.sampling, f'at most {most} factors with "sobol"', hint)


def read_study(file: str | PathLike[str]) -> tuple[dict[str, Any], dict[KeyPath, Place]]:
    """The values of a study file and their places. Raises ConfigError if it cannot be read."""
    try:
        return read_toml(file)
    except ConfigError as error:
        problems = [
            replace(one, expected=one.expected.replace("`guideload init`", "`guideload init --study`"))
            for one in error.problems
        ]
        raise ConfigError(problems, error.file) from None


def _require_files(written: StudyFile, folder: Path) -> None:
    """Raises ConfigError with all files that a study file names and that there are not."""
    named: dict[KeyPath, str | None] = {
        (key,): getattr(written, key) for key in ("machine", "trace", "cases")
    }
    named |= {("vary", i, "file"): entry.file for i, entry in enumerate(written.vary)}
    problems = [
        Problem(key, name, "a file that exists", f"there is no {folder / name}", None, shown(name))
        for key, name in named.items()
        if name is not None and not (folder / name).exists()
    ]
    if problems:
        raise ConfigError(problems)


def _misplaced(error: ConfigError) -> ConfigError:
    """The same refusal, with a hint where a key of the whole study stands in a table."""
    hint = "it is a key of the whole study: put it above the first [table]"
    return ConfigError(
        replace(problem, hint=hint)
        if len(problem.path) > 1 and problem.path[-1] in ABOVE and problem.expected in UNKNOWN
        else problem
        for problem in error.problems
    )


def _refused(key: str, value: object, expected: str, hint: str = "") -> ConfigError:
    return ConfigError([Problem((key,), value, expected, hint, None, shown(value))])
