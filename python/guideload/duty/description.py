"""A duty file: load cases, each a machine state, a motion and the number of its cycles in a period."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, PlainValidator, StrictStr, field_validator

from guideload.base.config import ConfigModel, number
from guideload.base.errors import ConfigError, KeyPath, Problem, ValueRefused, shown
from guideload.base.ranges import CYCLES, PERIOD
from guideload.base.toml import located, read_toml
from guideload.catalogue.life_target import HOUR
from guideload.machine.machine import Machine
from guideload.machine.products import with_catalogue
from guideload.study.options import TraceOptions

FileName = Annotated[StrictStr, Field(min_length=1)]


class CaseFile(ConfigModel):
    """A load case."""

    name: FileName = Field(description='a unique name, e.g. "with workpiece"')
    motion: FileName = Field(
        description='one cycle: a measured trace, e.g. "trace.csv", or planned moves, e.g. "moves.toml"'
    )
    cycles: Annotated[float, PlainValidator(partial(number, unit="1", above=0.0, within=CYCLES))] = Field(
        description="repetitions of the motion in each period"
    )
    machine: FileName | None = Field(
        default=None, description="a machine file, instead of that of the duty cycle"
    )
    change: dict[str, Any] = Field(
        default={},
        description='keys of the machine file with other values, e.g. { body = { mass = "1400 kg" } }',
    )
    reading: TraceOptions = Field(
        default=TraceOptions(), description="how the trace is read, as in the table [reading] of a study"
    )


class DutyFile(ConfigModel):
    """A duty file. Raises ConfigError with all problems at once."""

    machine: FileName | None = Field(
        default=None, description='machine file of all cases that have none, e.g. "machine.toml"'
    )
    period: Annotated[float, PlainValidator(partial(number, unit="s", above=0.0, within=PERIOD))] = Field(
        default=HOUR, description='time in which each case runs its cycles, e.g. "1 h" or a shift, "8 h"'
    )
    cases: tuple[CaseFile, ...] = Field(min_length=1, description="one [[cases]] table for each load case")

    @field_validator("cases")
    @classmethod
    def _unique(cls, cases: tuple[CaseFile, ...]) -> tuple[CaseFile, ...]:
        names = [case.name for case in cases]
        if len(set(names)) < len(names):
            raise ValueRefused("a unique name of each case", names)
        return cases


def read_duty(file: str | PathLike[str]) -> tuple[DutyFile, tuple[Machine, ...]]:
    """The description of a duty file and the machine of each case. Raises ConfigError naming file, row and key."""
    values, places = read_toml(file, "`guideload schema duty` lists its keys")
    folder = Path(file).parent
    try:
        described = DutyFile(**values)
        files = [
            folder / name if name else None
            for name in (c.machine or described.machine for c in described.cases)
        ]
        problems: list[Problem] = []
        for i, (case, machine_file) in enumerate(zip(described.cases, files, strict=True)):
            if machine_file is None:
                words = "a machine file, at the case or above all cases"
                problems.append(
                    Problem(("cases", i), None, words, 'add machine = "machine.toml"', None, "no machine")
                )
            for key, path in (("machine", machine_file), ("motion", folder / case.motion)):
                if path is not None and not path.is_file():
                    place: KeyPath = ("cases", i, key)
                    hint = f"there is no {path}"
                    problems.append(
                        Problem(place, path.name, "a file that exists", hint, None, shown(path.name))
                    )
        if problems:
            raise ConfigError(problems)
        machines = [
            _machine(path, i, case)
            for i, (path, case) in enumerate(zip(files, described.cases, strict=True))
            if path
        ]
    except ConfigError as error:
        if error.file is not None:  # the machine's own file
            raise
        raise located(error, str(file), places) from None
    return described, tuple(machines)


def _machine(file: Path, index: int, case: CaseFile) -> Machine:
    """The machine of a case, with the changes of the case."""
    machine = Machine.from_toml(file)
    if not case.change:
        return machine
    try:
        return Machine(**with_catalogue(_merged(read_toml(file)[0], case.change), file))
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
