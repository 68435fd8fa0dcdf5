"""The description of a study, from a TOML file or in code, and its plan."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field, InstanceOf, StrictBool, model_validator
from scipy.stats import qmc

from guideload.audit.motion_plausibility import motion_warnings
from guideload.base.arguments import checked
from guideload.base.config import optional
from guideload.base.errors import ABSENT, ArgumentError, ConfigError, Problem, ValueRefused, refused_at
from guideload.base.file_model import require_key
from guideload.base.toml import located, require_files
from guideload.machine.machine import Machine
from guideload.motion.motion import HISTORIES, Motion
from guideload.parameters.parameters import Parameters
from guideload.simulation.simulation import prepared_run
from guideload.simulation.start import start_of
from guideload.study.factors import build_copula, drawn_factors, estimated_entries, read_cases
from guideload.study.metadata import DRAWN_MOTION, ParameterMetadata, StudyMetadata
from guideload.study.options import REPLICATES, StudyFile, StudyOptions, read_study, with_hint_on_place
from guideload.study.plan import Plan, digest, with_fingerprint
from guideload.study.quantities import checked_limits, recorded_measures
from guideload.study.rated import RatedStudy, rated_study
from guideload.study.sampling import Design
from guideload.study.varied_parameters import SampleSpec


class Study(StudyOptions):
    """A Monte Carlo study of the loads of a machine whose parameters vary.

    Its creation raises ConfigError with all problems of the description, TraceError for a trace or a table, and
    SceneError for a machine that its links do not support.
    """

    machine: Machine = Field(description="the nominal machine")
    motion: InstanceOf[Motion] = Field(description="the motion of all samples")
    posterior: StrictBool = optional(
        "whether each sample has a motion of its own, drawn from the posterior of the trace", False
    )
    cases: Any = optional("in place of `vary`: a table or its file; headers are paths")
    sources: tuple[Path, ...] = optional("files of study, machine and motion", ())

    @classmethod
    @checked
    def from_toml(
        cls, file: str | PathLike[str], *, samples: int | None = None, seed: int | None = None
    ) -> Study:
        """The study described in a TOML file; errors name file, row, key and value.

        samples, seed: replace those of the file, which may lack them.
        """
        values, where = read_study(file)
        replaced = {key: value for key, value in (("samples", samples), ("seed", seed)) if value is not None}
        where = {path: place for path, place in where.items() if path[0] not in replaced}
        folder = Path(file).parent
        try:
            if "cases" not in values:
                require_key("vary", "[[vary]] tables, as a study file has", values)
            described = StudyFile(**{**values, **replaced})
            require_files(folder, described.files)
            machine = Machine.from_toml(folder / described.machine)
            motion = described.reading.motion(folder / described.trace, machine)
            sources = [Path(file), folder / described.machine, folder / described.trace]
            if described.forces is not None:
                motion = described.forces.added_to(
                    motion, folder, machine, described.trace, described.reading
                )
                sources.append(folder / described.forces.file)
            options = {key: getattr(described, key) for key in StudyOptions.model_fields}
            options["vary"] = tuple(
                entry.model_copy(update={"file": str(folder / entry.file)})
                if isinstance(entry, SampleSpec) and entry.file is not None
                else entry
                for entry in described.vary
            )
            cases = None if described.cases is None else folder / described.cases
            options["posterior"] = described.motion.posterior
            return cls(machine=machine, motion=motion, cases=cases, sources=tuple(sources), **options)
        except ConfigError as error:
            if error.file is not None:  # the machine's own file
                raise
            raise located(with_hint_on_place(error), str(file), where) from None

    @model_validator(mode="after")
    def _possible(self) -> Study:
        if self.machine.riders:
            raise ValueRefused(
                "a machine without riders",
                self.machine.riders[0].name,
                "a study knows one body: add their masses to [body]",
            )
        _ = self.machine.scene, self._plan  # computed once, and cached
        return self

    @checked
    def sample_motion(self, sample: int) -> Motion:
        """The motion of a sample: with `posterior`, the estimate plus the drawn deviation of its acceleration.

        `simulate` of the sample's machine under it, from the `start` of the plan, gives the loads of the sample.
        Raises ArgumentError for a sample that the study does not have.
        """
        plan, acceleration = self.plan(), self.motion.acceleration.copy()
        if not 0 <= sample < plan.runs:
            raise ArgumentError(f"sample: expected 0 to {plan.runs - 1}, got {sample}")
        if not self.posterior:
            return self.motion
        acceleration[:, 0] += np.interp(self.motion.time, plan.motion.time, plan.deviation(sample))
        notes = (*self.motion.notes, f"sample {sample} of a study, drawn from the posterior of the trace")
        return replace(self.motion, acceleration=acceleration, uncertainty=None, notes=notes)

    @property
    def inputs(self) -> tuple[Path, ...]:
        """All files that were read: `sources`, given cases and measured values."""
        cases = [self.cases] if isinstance(self.cases, str | Path) else []
        samples = [entry.file for entry in self.vary if isinstance(entry, SampleSpec) and entry.file]
        return (*self.sources, *map(Path, [*cases, *samples]))

    def plan(self) -> Plan:
        """The plan of all runs: values by index, the core's batch, names of all columns."""
        return self._plan

    @cached_property
    def _plan(self) -> Plan:
        self._require_one_source()
        if not self.machine.has_straight_rails:
            way_out = "mounting errors can vary; for profiles, run simulate or peak_loads with each seed of waviness"
            profiles = [rail.name for rail in self.machine.rails if rail.profiles]
            raise refused_at(
                ("machine",), "straight rails in a study", f"profiles of rails {profiles}", way_out
            )
        # The push of a rack is that of the machine as given: in a batch, all samples share one motion.
        motion = prepared_run(
            self.machine, self.motion, self.method, self.rtol, None, None, self.start
        ).motion
        if self.posterior:
            require_posterior(self.machine, motion, self.cases)
        parameters = Parameters(self.machine, motion)
        design = cases = None
        drawn: dict[str, Any] = {"sampling": "cases", "sensitivity": False}
        if self.cases is not None:
            factors, cases = read_cases(self.cases, parameters)
            runs = len(cases)
        else:
            assert self.samples is not None
            vary = (*self.vary, *estimated_entries(self.vary, parameters))
            if not vary:
                raise _missing("vary", "a [[vary]] table, or cases")
            factors = drawn_factors(vary, parameters)
            copula, correlations = build_copula(self.correlation, factors, vary)
            self._require_possible_design(len(factors), copula is not None)
            numbers = self.sampling, self.seed, self.samples, len(factors), self.sensitivity, copula
            design = Design(*numbers, self._replicates, self.posterior)
            of_design = ("sampling", "seed", "replicates", "sensitivity")
            runs, drawn = design.runs, {key: getattr(design, key) for key in of_design}
            drawn["correlations"] = correlations
        histories = self.histories
        histories = tuple(range(min(histories, runs))) if isinstance(histories, int) else histories
        if histories and histories[-1] >= runs:
            raise refused_at(("histories",), f"indices below {runs}, the number of runs", histories[-1])
        rated = RatedStudy()
        if self.quantities is None or "load" in self.quantities:
            rated = rated_study(self.machine, motion, factors, cases)
        measures = recorded_measures(
            self.machine, motion, self.quantities, self.statistics, bool(rated.criteria)
        )
        changes = parameters.changes((factor.form, factor.targets) for factor in factors)
        metadata = StudyMetadata(
            **{key: getattr(self, key) for key in ("machine", "method", "rtol")},
            start=start_of(self.machine, self.motion, self.start),
            motion=motion.source,
            motion_exact=motion.exact,
            motion_digest=digest(*(getattr(motion, name) for name in ("time", *HISTORIES))),
            duration=float(motion.time[-1] - motion.time[0]),
            instants=int(motion.time.size),
            **drawn,
            runs=runs,
            parameters=(
                *(factor.metadata for factor in factors),
                *([MOTION_PARAMETER] if self.posterior else []),
            ),
            measures=measures,
            exponent=rated.exponent,
            life_notes=rated.notes,
            motion_warnings=tuple(map(str, motion_warnings(motion, self.machine))),
            travel=rated.travel if rated.criteria else None,
            limits={},
        )
        limits = checked_limits(self.limits, measures, self.machine, rated.reason, metadata.repetition)
        metadata = metadata.model_copy(update={"limits": limits})
        posterior = [posterior_digest(motion)] if self.posterior else []
        metadata = with_fingerprint(metadata, design, factors, changes, digest(cases), *posterior)
        # 0 to 4 are the keys of samples, verification and populations.
        draws = np.random.SeedSequence(self.seed, spawn_key=(5,)).generate_state(1, np.uint64)
        seed = int(draws[0]) if self.posterior else None
        return Plan(metadata, motion, factors, changes, design, cases, histories, seed)

    def _require_one_source(self) -> None:
        """Raise ConfigError unless there are either given cases, or varied parameters and samples."""
        if self.cases is not None:
            for key in ("vary", "correlation", "samples", "sampling", "replicates", "sensitivity"):
                value = getattr(self, key)
                if value != type(self).model_fields[key].default:
                    hint = "cases are run as they are, in order: keep one of them"
                    value = len(value) if isinstance(value, tuple) else value
                    raise refused_at((key,), f"no {key} beside cases", value, hint)
            return
        if not self.samples:
            raise _missing("samples", "samples = 10_000")

    @property
    def _replicates(self) -> int:
        """Number of independent sequences. Raises ConfigError where the samples themselves are independent."""
        if self.sampling != "random":
            return REPLICATES if self.replicates is None else self.replicates
        if self.replicates is not None:
            hint = "random samples are independent, and give standard errors by themselves"
            raise refused_at(("replicates",), 'no replicates with sampling = "random"', self.replicates, hint)
        return 1

    def _require_possible_design(self, factors: int, correlated: bool) -> None:
        if self.samples is not None and (self.replicates or 0) > self.samples:
            hint = "the samples are divided among them"
            words = f"at most {self.samples}, the number of samples"
            raise refused_at(("replicates",), words, self.replicates, hint)
        if self.sensitivity and correlated:
            hint = "a Sobol index is a share of the variance, which correlated factors share"
            raise refused_at(("sensitivity",), "false where factors are correlated", True, hint)
        most = qmc.Sobol.MAXDIM // (2 if self.sensitivity else 1)
        if self.sampling == "sobol" and factors > most:
            hint = f'these entries have {factors}; "random" takes any number'
            raise refused_at(("sampling",), f'at most {most} factors with "sobol"', self.sampling, hint)


def make_plan(study: Study | Plan | str | PathLike[str]) -> Plan:
    """The plan of a study, or of the study in a file."""
    if isinstance(study, str | PathLike):
        study = Study.from_toml(study)
    return study.plan() if isinstance(study, Study) else study


def _missing(key: str, hint: str) -> ConfigError:
    words = StudyOptions.model_fields[key].description or ""
    return ConfigError([Problem((key,), None, words, f"add {hint}", None, ABSENT)])


# ---- motions drawn from the posterior of the trace


PLACE = ("motion", "posterior")
# The column of the numbers of the draws.
MOTION_PARAMETER = ParameterMetadata(
    name=DRAWN_MOTION, unit="1", targets=(), distribution="draws of the posterior of the trace"
)


def require_posterior(machine: Machine, motion: Motion, cases: object) -> None:
    """Raise ConfigError unless the motion has a posterior, and the samples are drawn."""
    if motion.uncertainty is None:
        reason = "its acceleration is known exactly" if motion.exact else "its acceleration came without one"
        hint = f"{reason}; a trace of encoder counts or positions has one, if its smoothing is not replaced"
        raise refused_at(PLACE, "false for a motion without uncertainty", True, hint)
    if cases is not None:
        hint = "cases are run as they are: draw the parameters by [[vary]] tables"
        raise refused_at(PLACE, "false beside cases", True, hint)
    if machine.drive is not None and machine.drive.pressure_angle is not None:
        hint = "the push of a rack follows the motion, and would stay that of the estimate"
        raise refused_at(PLACE, "false for a drive with pressure_angle", True, hint)


def posterior_digest(motion: Motion) -> str:
    """SHA-256 of all numbers on which the draws depend."""
    uncertainty = motion.uncertainty
    assert uncertainty is not None
    chain = (np.asarray(part, dtype=np.float64) for part in uncertainty.model if part is not None)
    return digest(*chain, np.array([float(uncertainty.derivative)]), uncertainty.unit, uncertainty.time)
