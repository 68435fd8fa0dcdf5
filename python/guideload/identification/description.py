"""An identify file: what is unknown of a machine, and the measured data, one list of tables for each kind."""

from __future__ import annotations

from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

from pydantic import BeforeValidator, Field, StrictStr, model_validator

from guideload.base.config import ConfigModel
from guideload.base.errors import ConfigError, KeyPath, Problem, ValueRefused, problem_at
from guideload.base.toml import located, read_toml
from guideload.identification.candidates import CandidateTable
from guideload.identification.figure import Figure, FigureTable, figure_of_unknown
from guideload.identification.record_tables import MotorForceTable, SensorLogTable
from guideload.identification.result import Identification, identify
from guideload.identification.tables import (
    DeflectionsTable,
    FileName,
    FrequencyResponsesTable,
    ModalTestTable,
)
from guideload.identification.unknowns import UnknownTable, parameters_of, unknowns_of
from guideload.machine.machine import Machine

if TYPE_CHECKING:
    from guideload.identification.measured import Measured


class AlternativeTable(ConfigModel):
    """Another model of the same machine and data, for a comparison."""

    name: StrictStr = Field(min_length=1, description='a title, e.g. "all carriages alike"')
    machine: FileName | None = Field(
        default=None,
        description="another machine file, as with preload or structure in series; by default the same",
    )
    unknown: tuple[UnknownTable, ...] = Field(
        default=(), description="its own [[alternatives.unknown]] tables; by default those of the file"
    )


def _figure(value: object) -> str | FigureTable:
    """The name of an unknown, or a figure of a run. Raises ValueRefused, or ValidationError for `FigureTable`."""
    if isinstance(value, dict | FigureTable):
        return FigureTable.model_validate(value)
    if not isinstance(value, str):
        raise ValueRefused("the name of an unknown, or a table [figure]", value)
    return value


class IdentifyFile(ConfigModel):
    """An identify file. Raises ConfigError with all problems at once."""

    machine: FileName = Field(description='the machine file with nominal values, e.g. "machine.toml"')
    trace: FileName | None = Field(
        default=None,
        description="a trace or planned moves for the study file that is written; none without it",
    )
    unknown: tuple[UnknownTable, ...] = Field(
        min_length=1, description="one [[unknown]] table for each parameter, or group of them"
    )
    modal_tests: tuple[ModalTestTable, ...] = Field(default=(), description="one [[modal_tests]] table each")
    frequency_responses: tuple[FrequencyResponsesTable, ...] = Field(
        default=(), description="one [[frequency_responses]] table for each file"
    )
    deflections: tuple[DeflectionsTable, ...] = Field(
        default=(), description="one [[deflections]] table each"
    )
    motor_forces: tuple[MotorForceTable, ...] = Field(
        default=(), description="one [[motor_forces]] table each"
    )
    sensor_logs: tuple[SensorLogTable, ...] = Field(default=(), description="one [[sensor_logs]] table each")

    alternatives: tuple[AlternativeTable, ...] = Field(
        default=(),
        description="one [[alternatives]] table for each model that is compared with the one above",
    )

    candidates: tuple[CandidateTable, ...] = Field(
        default=(),
        description="one [[candidates]] table for each group of measurements that could be made next",
    )

    figure: Annotated[StrictStr | FigureTable, BeforeValidator(_figure)] | None = Field(
        default=None,
        description="what matters most, by which candidates are ranked: the name of an unknown, or a table [figure] of "
        "a peak load, mean load or life; by default all unknowns",
    )

    KINDS: ClassVar[tuple[str, ...]] = (
        "modal_tests",
        "frequency_responses",
        "deflections",
        "motor_forces",
        "sensor_logs",
    )

    @model_validator(mode="after")
    def _figure_of_candidates(self) -> IdentifyFile:
        if self.figure is not None and not self.candidates:
            raise ValueRefused("no figure without [[candidates]]", str(self.figure))
        return self

    @property
    def files(self) -> tuple[str, ...]:
        """Names of the files that it names."""
        files = [self.machine, self.trace, *(one.machine for one in self.alternatives)]
        files += [table.file for table in self.frequency_responses]
        files += [one.motion for one in self.candidates]
        files += [self.figure.motion, self.figure.duty] if isinstance(self.figure, FigureTable) else []
        for record in (*self.motor_forces, *self.sensor_logs):
            files += [record.trace, record.file]
        return tuple(dict.fromkeys(name for name in files if name is not None))

    def require_parameters(self, machine: Machine, folder: Path) -> None:
        """Raises ConfigError for unknowns that the machine does not have, or that of an alternative."""
        problems: list[Problem] = []

        def check(machine: Machine, tables: tuple[UnknownTable, ...], where: KeyPath, *, own: bool) -> None:
            try:
                unknowns_of(tables, parameters_of(machine))
            except ConfigError as error:
                problems.extend(
                    replace(one, path=(*where, *(one.path if own else ()))) for one in error.problems
                )

        check(machine, self.unknown, (), own=True)
        for i, one in enumerate(self.alternatives):
            where: KeyPath = ("alternatives", i)
            if one.unknown:
                other = machine if one.machine is None else Machine.from_toml(folder / one.machine)
                check(other, one.unknown, where, own=True)
            elif one.machine is not None:
                check(Machine.from_toml(folder / one.machine), self.unknown, (*where, "machine"), own=False)
        if problems:
            raise ConfigError(problems)

    def data(self, machine: Machine, folder: Path) -> list[Measured]:
        """The measured data of all kinds; names of files are relative to the folder.

        Raises ConfigError, ArgumentError and TraceError.
        """
        found: list[Measured] = []
        problems = []
        for kind in self.KINDS:
            for i, table in enumerate(getattr(self, kind)):
                try:
                    found.append(table.measured(machine, folder))
                except ValueRefused as refused:
                    problems.append(problem_at((kind, i), refused))
        if problems:
            raise ConfigError(problems)
        return found


def read_identify(file: str | PathLike[str]) -> tuple[IdentifyFile, Machine, list[Measured]]:
    """The description, the nominal machine and the data. Raises ConfigError naming file, row and key."""
    values, places = read_toml(file, "`guideload schema identify` lists its keys")
    folder = Path(file).parent
    try:
        described = IdentifyFile(**values)
        files: dict[KeyPath, str | None] = {("machine",): described.machine, ("trace",): described.trace}
        files |= {("alternatives", i, "machine"): one.machine for i, one in enumerate(described.alternatives)}
        files |= {("candidates", i, "motion"): one.motion for i, one in enumerate(described.candidates)}
        if isinstance(described.figure, FigureTable):
            files |= {("figure", key): getattr(described.figure, key) for key in ("motion", "duty")}
        for key, name in files.items():
            if name is not None and not (folder / name).is_file():
                refused = ValueRefused("a file that exists", name, f"there is no {folder / name}")
                raise ConfigError([problem_at(key, refused)])
        machine = Machine.from_toml(folder / described.machine)
        described.require_parameters(machine, folder)
        return described, machine, described.data(machine, folder)
    except ConfigError as error:
        if error.file is not None:  # the machine's own file
            raise
        raise located(error, str(file), places) from None


def identify_file(file: str | PathLike[str]) -> Identification:
    """The numbers of the machine of an identify file. Raises ConfigError, TraceError, SceneError, ArgumentError."""
    described, machine, data = read_identify(file)
    return identify(machine, described.unknown, data)


def identified_alternatives(
    described: IdentifyFile, file: str | PathLike[str], found: Identification
) -> dict[str, Identification]:
    """The model of the file, as found, and its alternatives, each fitted to the same data."""
    models, folder = {"as above": found}, Path(file).parent
    for one in described.alternatives:
        machine = found.nominal if one.machine is None else Machine.from_toml(folder / one.machine)
        models[one.name] = identify(
            machine, one.unknown or described.unknown, described.data(machine, folder)
        )
    return models


def candidates_of(
    described: IdentifyFile, file: str | PathLike[str], found: Identification
) -> list[Measured]:
    """The measurements that could be made next. Raises ConfigError naming file and key."""
    measurements: list[Measured] = []
    for i, table in enumerate(described.candidates):
        try:
            measurements += table.measurements(found.model, Path(file).parent)
        except ValueRefused as refused:
            raise located(
                ConfigError([problem_at(("candidates", i), refused)]), str(file), read_toml(file)[1]
            ) from None
    return measurements


def figure_that_matters(
    described: IdentifyFile, file: str | PathLike[str], found: Identification
) -> Figure | None:
    """The figure by which candidates are ranked; None for all unknowns. Raises as `FigureTable.of`."""
    if isinstance(described.figure, FigureTable):
        return described.figure.of(found, Path(file).parent)
    return None if described.figure is None else figure_of_unknown(found, described.figure)
