"""A duty file: load cases, each a machine state, a motion and the number of its cycles in a period."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import Field, PrivateAttr, StrictStr, WithJsonSchema, field_validator

from guideload.base.config import ConfigModel, in_range, optional
from guideload.base.errors import ConfigError, KeyPath, Problem, refused_at
from guideload.base.file_model import FileModel
from guideload.base.ranges import CYCLES, PERIOD
from guideload.base.toml import read_toml, require_files
from guideload.catalogue.life_target import HOUR
from guideload.machine.machine import Machine
from guideload.machine.products import with_catalogue
from guideload.machine.straightness import with_straightness
from guideload.study.options import Reading, TraceOptions

FileName = Annotated[StrictStr, Field(min_length=1)]
MACHINE_KEYS = WithJsonSchema({"type": "object", "propertyNames": {"enum": [*Machine.model_fields]}})


class CaseFile(ConfigModel):
    """A load case."""

    name: FileName = Field(description='a unique name, e.g. "with workpiece"')
    motion: FileName = Field(
        description='one cycle: a measured trace, e.g. "trace.csv", or planned moves, e.g. "moves.toml"'
    )
    cycles: Annotated[float, in_range(CYCLES, above=0.0)] = Field(
        description="repetitions of the motion in each period"
    )
    machine: FileName | None = optional("a machine file, instead of that of the duty cycle")
    change: Annotated[dict[str, Any], MACHINE_KEYS] = optional(
        'keys of the machine file with other values, e.g. { body = { mass = "1400 kg" } }', {}
    )
    reading: Reading = optional("how the trace is read, as in the table [reading] of a study", TraceOptions())


class DutyFile(FileModel):
    """A duty file. Raises ConfigError with all problems at once."""

    FILE: ClassVar = "duty.toml"
    WRITTEN_BY: ClassVar = "`guideload schema duty` lists its keys"
    REQUIRED: ClassVar = ("cases", "[[cases]] tables, as a duty file has")

    machine: FileName | None = optional('machine file of all cases that have none, e.g. "machine.toml"')
    period: Annotated[float, in_range(PERIOD, above=0.0)] = optional(
        'time in which each case runs its cycles, e.g. "1 h" or a shift, "8 h"', HOUR
    )
    cases: tuple[CaseFile, ...] = Field(min_length=1, description="one [[cases]] table for each load case")
    _machines: tuple[Machine, ...] = PrivateAttr(())

    @field_validator("cases")
    @classmethod
    def _unique(cls, cases: tuple[CaseFile, ...]) -> tuple[CaseFile, ...]:
        first: dict[str, int] = {}
        for i, case in enumerate(cases):
            if first.setdefault(case.name, i) < i:
                hint = f"cases[{first[case.name]}] has it already"
                raise refused_at(("cases", i, "name"), "a unique name", case.name, hint)
        return cases

    @classmethod
    def _of_file(cls, values: dict[str, Any], file: Path) -> DutyFile:
        described = cls(**values)
        machine_files = [case.machine or described.machine for case in described.cases]
        names: dict[KeyPath, str | None] = {}
        for i, (case, machine_file) in enumerate(zip(described.cases, machine_files, strict=True)):
            names |= {("cases", i, "machine"): machine_file, ("cases", i, "motion"): case.motion}
        expected, hint = "a machine file, at the case or above all cases", 'add machine = "machine.toml"'
        problems = [
            Problem(("cases", i), None, expected, hint, None, "no machine")
            for i, machine_file in enumerate(machine_files)
            if machine_file is None
        ]
        require_files(file.parent, names, problems)
        described._machines = tuple(
            _machine(file.parent / str(machine_file), i, case)
            for i, (machine_file, case) in enumerate(zip(machine_files, described.cases, strict=True))
        )
        return described

    @property
    def machines(self) -> tuple[Machine, ...]:
        """The machine of each case; only of a description that was read from a file."""
        return self._machines


def _machine(file: Path, index: int, case: CaseFile) -> Machine:
    """The machine of a case, with the changes of the case."""
    machine = Machine.from_toml(file)
    if not case.change:
        return machine
    try:
        values = with_straightness(_merged(read_toml(file)[0], case.change), file.parent)
        return Machine(**with_catalogue(values, file))
    except ConfigError as error:
        place = ("cases", index, "change")
        problems = [replace(problem, path=(*place, *problem.path)) for problem in error.problems]
        raise ConfigError(problems, None, error.others) from None


def _merged(values: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """The values with the changes; a table is merged key by key, everything else replaced."""
    merged = dict(values)
    for key, value in changes.items():
        before = merged.get(key)
        merged[key] = (
            _merged(before, value) if isinstance(before, dict) and isinstance(value, dict) else value
        )
    return merged
