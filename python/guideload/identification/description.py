"""An identify file: what is unknown of a machine, the measured data, and measurements that could be made next."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, Field, PrivateAttr, StrictStr, field_validator, model_validator

from guideload.base.config import ConfigModel, in_range, number, optional
from guideload.base.errors import ConfigError, KeyPath, Problem, ValueRefused, problem_at
from guideload.base.file_model import FileModel
from guideload.base.number_text import joined
from guideload.base.ranges import DEFLECTION, FORCE
from guideload.base.toml import located, read_toml, require_files
from guideload.identification.measured import Measured
from guideload.identification.modal_test import ModalTest
from guideload.identification.model import Excitation, ModelAt, parse_place
from guideload.identification.next_measurement import TargetQuantity, TargetTable, unknown_target
from guideload.identification.responses import Deflection, Deflections, FrequencyResponses, ResponseCurve
from guideload.identification.result import Identification, identify
from guideload.identification.sensor_log import Kind, SensorLog
from guideload.identification.tables import (
    DeflectionsTable,
    Frequency,
    FrequencyResponsesTable,
    ModalTestTable,
    MotorForceTable,
    SensorLogTable,
    Share,
    Text,
    channel,
)
from guideload.identification.unknowns import UnknownTable, resolve_unknowns
from guideload.machine.machine import Machine
from guideload.study.options import Reading, TraceOptions
from guideload.study.varied_parameters import NumberOrText

# ---- measurements that could be made next, and what each would show of the fitted machine


Keys = frozenset[str]
BAND: Keys = frozenset({"force", "low", "high"})
LEVELS = ("frequency_noise", "damping_noise", "shape_noise")

OWN_MODEL = "as above"  # name of the model of the file among its alternatives


class CandidateTable(ConfigModel):
    """Measurements that could be made next, one for each pair of a force or motion and a place."""

    kind: Literal["frequency response", "deflection", "modal test", "record"] = Field(
        description='"frequency response" to a hammer; "deflection" under a constant force; "modal test" with a hammer '
        'and sensors at all places; "record" of a sensor under a motion'
    )
    force: tuple[StrictStr, ...] = optional(
        'where a force may act, e.g. ["tool y", "tool z"]; not of a record', ()
    )
    at: tuple[StrictStr, ...] = Field(
        min_length=1, description='where a sensor may be, e.g. ["tool y"]; of a load cell "1a Fy"'
    )
    low: Frequency = optional("lowest frequency of a response or of a mode", 5.0)
    high: Frequency = optional("highest frequency", 500.0)
    noise: Share = optional(
        "of a response: standard deviation of real and imaginary part over the size", 0.05
    )
    frequency_noise: Share = optional("of a modal test, relative to the frequency", ModalTestTable.TYPICAL[0])
    damping_noise: Share = optional(
        "of a modal test, relative to the damping ratio", ModalTestTable.TYPICAL[1]
    )
    shape_noise: Share = optional(
        "of a modal test, relative to the largest component", ModalTestTable.TYPICAL[2]
    )
    load: Annotated[float, in_range(FORCE, above=0.0)] = optional("force of a deflection", 1000.0)
    motion: Text | None = optional('of a record: planned moves or a trace, e.g. "moves.toml"')
    reading: Reading = optional("how the trace is read, as in a study", TraceOptions())
    sensor: Kind = optional(
        'of a record: "acceleration", "velocity", "displacement" or "load"', "acceleration"
    )
    accuracy: NumberOrText | None = optional(
        'standard deviation of a deflection (default "1 um") or of one value of a record, e.g. "0.1 m/s^2"'
    )

    OF_KIND: ClassVar[dict[str, Keys]] = {
        "frequency response": BAND | {"noise"},
        "deflection": frozenset({"force", "load", "accuracy"}),
        "modal test": BAND | set(LEVELS),
        "record": frozenset({"motion", "reading", "sensor", "accuracy"}),
    }
    NEEDED: ClassVar[dict[str, tuple[str, ...]]] = {"record": ("motion", "accuracy")}
    COUNT: ClassVar[int] = 60  # frequencies of a response

    @model_validator(mode="after")
    def _keys_of_its_kind(self) -> CandidateTable:
        known = self.OF_KIND[self.kind] | {"kind", "at"}
        if strange := self.model_fields_set - known:
            raise ValueRefused(f"no {joined(sorted(strange))} beside kind {self.kind}", self.kind)
        if missing := set(self.NEEDED.get(self.kind, ("force",))) - self.model_fields_set:
            raise ValueRefused(f"{joined(sorted(missing))} beside kind {self.kind}", self.kind)
        if not self.low < self.high:
            raise ValueRefused(
                f"low below high, {self.high:g} Hz", self.low, "both have a default: give both"
            )
        return self

    def measurements(self, model: ModelAt, folder: Path) -> Iterator[Measured]:
        """Every measurement, with the values that the machine would show.

        Raises ValueRefused, and for a record TraceError and ArgumentError.
        """
        if self.kind == "record":
            yield from self._records(model, folder)
            return
        places = [parse_place(text, model.machine) for text in self.at]
        hertz = np.geomspace(self.low, self.high, self.COUNT)
        for force in (parse_place(text, model.machine) for text in self.force):
            if self.kind == "modal test":
                levels = self.frequency_noise, self.damping_noise, self.shape_noise
                where = joined([place.name for place in places])
                name = f"modal test at {where} with a hammer at {force.name}"
                yield ModalTest.shown(name, model, places, levels, force, (self.low, self.high))
                continue
            for at in places:
                name = f"{self.kind} of {at.name} to a force at {force.name}"
                if self.kind == "deflection":
                    given = "1 um" if self.accuracy is None else self.accuracy
                    accuracy = number(given, "m", above=0.0, within=DEFLECTION)
                    yield Deflections(name, (Deflection(force, self.load, at, 0.0),), accuracy, True)
                    continue
                curve = ResponseCurve(force, at, 2, hertz, np.zeros(hertz.size, dtype=np.complex128))
                shown = replace(curve, value=curve.computed(model)[0])
                yield FrequencyResponses(name, (shown,), self.noise, 0.005, True)

    def _records(self, model: ModelAt, folder: Path) -> Iterator[Measured]:
        assert self.motion is not None and self.accuracy is not None
        motion = self.reading.motion(folder / self.motion, model.machine)
        excitation = Excitation.of(model.machine, motion)
        for text in self.at:
            sensor = channel(model.machine, text, self.sensor, self.accuracy)
            yield SensorLog.shown(f"{sensor.name} under {self.motion}", model, excitation, sensor)


# ---- the file


class AlternativeTable(ConfigModel):
    """Another model of the same machine and data, for a comparison."""

    name: StrictStr = Field(min_length=1, description='a title, e.g. "all carriages alike"')
    machine: Text | None = optional(
        "another machine file, as with preload or structure in series; by default the same"
    )
    unknown: tuple[UnknownTable, ...] = optional(
        "its own [[alternatives.unknown]] tables; by default those of the file", ()
    )


def _figure(value: object) -> str | TargetTable:
    """The name of an unknown, or a figure of a run. Raises ValueRefused, or ValidationError for `TargetTable`."""
    if isinstance(value, dict | TargetTable):
        return TargetTable.model_validate(value)
    if not isinstance(value, str):
        raise ValueRefused("the name of an unknown, or a table [figure]", value)
    return value


KINDS = ("modal_tests", "frequency_responses", "deflections", "motor_forces", "sensor_logs")
FILES = {  # keys with names of files
    "alternatives": ("machine",),
    "frequency_responses": ("file",),
    "motor_forces": ("trace", "file"),
    "sensor_logs": ("trace", "file"),
    "candidates": ("motion",),
}


class IdentifyFile(FileModel):
    """An identify file. Raises ConfigError with all problems at once."""

    FILE: ClassVar = "identify.toml"
    WRITTEN_BY: ClassVar = "`guideload schema identify` lists its keys"
    REQUIRED: ClassVar = ("unknown", "[[unknown]] tables, as an identify file has")

    machine: Text = Field(description='the machine file with nominal values, e.g. "machine.toml"')
    trace: Text | None = optional(
        "a trace or planned moves for the study file that is written; none without it"
    )
    unknown: tuple[UnknownTable, ...] = Field(
        min_length=1, description="one [[unknown]] table for each parameter, or group of them"
    )
    modal_tests: tuple[ModalTestTable, ...] = optional("one [[modal_tests]] table each", ())
    frequency_responses: tuple[FrequencyResponsesTable, ...] = optional(
        "one [[frequency_responses]] table for each file", ()
    )
    deflections: tuple[DeflectionsTable, ...] = optional("one [[deflections]] table each", ())
    motor_forces: tuple[MotorForceTable, ...] = optional("one [[motor_forces]] table each", ())
    sensor_logs: tuple[SensorLogTable, ...] = optional("one [[sensor_logs]] table each", ())

    alternatives: tuple[AlternativeTable, ...] = optional(
        "one [[alternatives]] table for each model that is compared with the one above", ()
    )

    candidates: tuple[CandidateTable, ...] = optional(
        "one [[candidates]] table for each group of measurements that could be made next", ()
    )

    figure: Annotated[StrictStr | TargetTable, BeforeValidator(_figure)] | None = optional(
        "what matters most, by which candidates are ranked: the name of an unknown, or a table [figure] of "
        "a peak load, mean load or life; by default all unknowns"
    )
    # Of a description that was read from a file, which the methods below need.
    _file: Path = PrivateAttr()
    _nominal: Machine = PrivateAttr()
    _data: list[Measured] = PrivateAttr()

    @field_validator("alternatives")
    @classmethod
    def _named_once(cls, alternatives: tuple[AlternativeTable, ...]) -> tuple[AlternativeTable, ...]:
        names = [one.name for one in alternatives]
        if OWN_MODEL in names or len(set(names)) < len(names):
            raise ValueRefused(
                f'each name once, and not "{OWN_MODEL}", which is the model of the file', names
            )
        return alternatives

    @model_validator(mode="after")
    def _figure_of_candidates(self) -> IdentifyFile:
        if self.figure is not None and not self.candidates:
            raise ValueRefused("no figure without [[candidates]]", str(self.figure))
        return self

    @property
    def files(self) -> dict[KeyPath, str | None]:
        """Names of the files that it names, by their keys."""
        files: dict[KeyPath, str | None] = {("machine",): self.machine, ("trace",): self.trace}
        for kind, keys in FILES.items():
            for i, table in enumerate(getattr(self, kind)):
                files |= {(kind, i, key): getattr(table, key) for key in keys}
        if isinstance(self.figure, TargetTable):
            files |= {("figure", key): getattr(self.figure, key) for key in ("motion", "duty")}
        return files

    @classmethod
    def _of_file(cls, values: dict[str, Any], file: Path) -> IdentifyFile:
        described = cls(**values)
        require_files(file.parent, described.files)
        described._file, described._nominal = file, Machine.from_toml(file.parent / described.machine)
        described._require_parameters()
        described._data = described._measured(described._nominal)
        return described

    def identified(self) -> Identification:
        """The numbers of the machine. Raises as `identify`."""
        return identify(self._nominal, self.unknown, self._data)

    def identified_alternatives(self, found: Identification) -> dict[str, Identification]:
        """The model of the file, as found, and its alternatives, each fitted to the same data."""
        models = {OWN_MODEL: found}
        for one in self.alternatives:
            machine, unknown = self._model(one)
            models[one.name] = identify(machine, unknown, self._measured(machine))
        return models

    def candidate_measurements(self, found: Identification) -> list[Measured]:
        """The measurements that could be made next. Raises ConfigError naming file and key."""
        measurements: list[Measured] = []
        for i, table in enumerate(self.candidates):
            try:
                measurements += table.measurements(found.model, self._file.parent)
            except ValueRefused as refused:
                error = ConfigError([problem_at(("candidates", i), refused)])
                raise located(error, str(self._file), read_toml(self._file)[1]) from None
        return measurements

    def target_quantity(self, found: Identification) -> TargetQuantity | None:
        """The figure by which candidates are ranked; None for all unknowns. Raises as `TargetTable.of`."""
        if isinstance(self.figure, TargetTable):
            return self.figure.of(found, self._file.parent)
        return None if self.figure is None else unknown_target(found, self.figure)

    def _model(self, alternative: AlternativeTable) -> tuple[Machine, tuple[UnknownTable, ...]]:
        """Machine and unknowns of an alternative: its own, else those of the file."""
        file = alternative.machine
        machine = self._nominal if file is None else Machine.from_toml(self._file.parent / file)
        return machine, alternative.unknown or self.unknown

    def _require_parameters(self) -> None:
        """Raise ConfigError for unknowns that the machine does not have, or that of an alternative."""
        problems: list[Problem] = []
        models: list[tuple[KeyPath, Machine, tuple[UnknownTable, ...]]] = [((), self._nominal, self.unknown)]
        for i, alternative in enumerate(self.alternatives):
            if alternative.machine is not None or alternative.unknown:
                models.append((("alternatives", i), *self._model(alternative)))
        for where, machine, tables in models:
            try:
                resolve_unknowns(tables, machine)
            except ConfigError as error:
                of_machine = bool(where) and tables is self.unknown
                for one in error.problems:
                    path = (*where, "machine") if of_machine else (*where, *one.path)
                    problems.append(replace(one, path=path))
        if problems:
            raise ConfigError(problems)

    def _measured(self, machine: Machine) -> list[Measured]:
        """The measured data of all kinds. Raises ConfigError, ArgumentError and TraceError."""
        found, problems = list[Measured](), []
        for kind in KINDS:
            for i, table in enumerate(getattr(self, kind)):
                try:
                    found.append(table.measured(machine, self._file.parent))
                except ValueRefused as refused:
                    problems.append(problem_at((kind, i), refused))
        if problems:
            raise ConfigError(problems)
        return found


def identify_file(file: str | PathLike[str]) -> Identification:
    """The numbers of the machine of an identify file. Raises ConfigError, TraceError, SceneError, ArgumentError."""
    return IdentifyFile.from_toml(file).identified()
