"""An identify file: what is unknown of a machine, and the measured data, one list of tables for each kind."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, PlainValidator, StrictStr, field_validator

from guideload.base.config import ConfigModel, number
from guideload.base.errors import ConfigError, ValueRefused
from guideload.base.toml import located, read_toml
from guideload.identification.modal_test import MeasuredMode, ModalTest
from guideload.identification.places import Place, place_of
from guideload.identification.record_tables import MotorForceTable, SensorLogTable
from guideload.identification.unknowns import UnknownTable
from guideload.machine.machine import Machine
from guideload.study.description.refusals import problem_at

if TYPE_CHECKING:
    from guideload.identification.measured import Measured

FileName = Annotated[StrictStr, Field(min_length=1)]


def _share(value: object, unit: str, above: float) -> float:
    """A plain number, or text in percent."""
    if isinstance(value, str) and (match := re.fullmatch(r"\s*(-?\d+\.?\d*|\.\d+)\s*%\s*", value)):
        value = float(match[1]) / 100.0
    return number(value, unit, above=above)


Share = Annotated[float, PlainValidator(partial(_share, unit="1", above=0.0))]
Frequency = Annotated[float, PlainValidator(partial(number, unit="Hz", above=0.0))]


class ModeTable(ConfigModel):
    """A measured mode."""

    frequency: Frequency = Field(description='natural frequency, e.g. "34.9 Hz"')
    damping: Share | None = Field(default=None, description='damping ratio, e.g. "2.4 %"')
    shape: tuple[float, ...] | None = Field(
        default=None,
        description="real components at the places of the test, in any scale; in phase or against it",
    )
    number: Annotated[int, Field(strict=True, ge=1)] | None = Field(
        default=None,
        description="of the computed mode that it is, from 1 by ascending frequency; by default the one that fits best",
    )


class ModalTestTable(ConfigModel):
    """A modal test, as with a hammer: natural frequencies, damping ratios and mode shapes from a modal analysis."""

    name: StrictStr = Field(default="hammer test", min_length=1, description="a title for reports")
    places: tuple[StrictStr, ...] = Field(
        default=(),
        description='places of the shapes: points of the machine with an axis, e.g. ["tool y", "tool -z"]',
    )
    frequencies: Literal["natural", "damped"] = Field(
        default="natural",
        description='"natural": of the undamped vibration, as modal analysis gives; "damped": of the free vibration',
    )
    frequency_noise: Share | None = Field(
        default=None,
        description='standard deviation relative to the frequency, e.g. "1 %"; estimated if left out',
    )
    damping_noise: Share | None = Field(
        default=None,
        description='standard deviation relative to the ratio, e.g. "10 %"; estimated if left out',
    )
    shape_noise: Share | None = Field(
        default=None,
        description='standard deviation relative to the largest component, e.g. "5 %"; estimated if left out',
    )
    modes: tuple[ModeTable, ...] = Field(min_length=1, description="one table for each measured mode")

    # Levels where none is stated; they count as three values.
    TYPICAL: ClassVar[tuple[float, float, float]] = (0.01, 0.2, 0.05)

    @field_validator("modes")
    @classmethod
    def _numbered_once(cls, modes: tuple[ModeTable, ...]) -> tuple[ModeTable, ...]:
        numbers = [mode.number for mode in modes if mode.number is not None]
        if len(set(numbers)) < len(numbers):
            raise ValueRefused("each number once", numbers)
        return modes

    def measured(self, machine: Machine, folder: Path) -> ModalTest:
        """The data for the fit. Raises ValueRefused."""
        places = tuple(_places(self.places, machine))
        for i, mode in enumerate(self.modes):
            if mode.shape is None:
                continue
            if len(mode.shape) != len(places) or len(places) < 2 or not any(mode.shape):
                expected = (
                    f"{len(places)} components, as many as places" if len(places) > 1 else "at least 2 places"
                )
                raise ValueRefused(f"{expected}, not all 0", list(mode.shape), f"of modes[{i}]")
        frequency, damping, shape = self.frequency_noise, self.damping_noise, self.shape_noise
        stated = frequency or self.TYPICAL[0], damping or self.TYPICAL[1], shape or self.TYPICAL[2]
        modes = [
            MeasuredMode(m.frequency, m.damping, None if m.shape is None else np.array(m.shape), m.number)
            for m in self.modes
        ]
        known = frequency is not None, damping is not None, shape is not None
        return ModalTest(self.name, tuple(modes), places, stated, known, self.frequencies == "damped")


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
    motor_forces: tuple[MotorForceTable, ...] = Field(
        default=(), description="one [[motor_forces]] table each"
    )
    sensor_logs: tuple[SensorLogTable, ...] = Field(default=(), description="one [[sensor_logs]] table each")

    KINDS: ClassVar[tuple[str, ...]] = ("modal_tests", "motor_forces", "sensor_logs")

    @property
    def files(self) -> tuple[str, ...]:
        """Names of the files that it names."""
        return tuple(name for name in (self.machine, self.trace) if name is not None)

    def data(self, machine: Machine, folder: Path) -> list[Measured]:
        """The measured data of all kinds, in files of `folder`. Raises ConfigError, ArgumentError and TraceError."""
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
    values, places = read_toml(file)
    folder = Path(file).parent
    try:
        described = IdentifyFile(**values)
        for key, name in (("machine", described.machine), ("trace", described.trace)):
            if name is not None and not (folder / name).is_file():
                refused = ValueRefused("a file that exists", name, f"there is no {folder / name}")
                raise ConfigError([problem_at((key,), refused)])
        machine = Machine.from_toml(folder / described.machine)
        return described, machine, described.data(machine, folder)
    except ConfigError as error:
        if error.file is not None:  # the machine's own file
            raise
        raise located(error, str(file), places) from None


def _places(texts: Sequence[str], machine: Machine) -> Iterator[Place]:
    for text in texts:
        yield place_of(text, machine)
