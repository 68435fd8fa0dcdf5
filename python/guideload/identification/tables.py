"""Tables of an identify file: one model for each kind of measured data."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, PlainValidator, StrictStr, field_validator

from guideload.base.config import ConfigModel, in_range, number
from guideload.base.errors import ValueRefused
from guideload.base.ranges import COMPONENT, DEFLECTION, FORCE, FREQUENCY, SHARE, Range
from guideload.identification.deflections import Deflection, Deflections
from guideload.identification.frequency_responses import FrequencyResponses, curves_of, is_universal
from guideload.identification.modal_test import MeasuredMode, ModalTest
from guideload.identification.places import Place, place_of
from guideload.machine.machine import Machine

FileName = Annotated[StrictStr, Field(min_length=1)]


def _share(value: object, unit: str, above: float, within: Range) -> float:
    """A plain number, or text in percent."""
    if isinstance(value, str) and (match := re.fullmatch(r"\s*(-?\d+\.?\d*|\.\d+)\s*%\s*", value)):
        value = float(match[1]) / 100.0
    return number(value, unit, above=above, within=within)


Share = Annotated[float, PlainValidator(partial(_share, unit="1", above=0.0, within=SHARE))]
Frequency = Annotated[float, in_range(FREQUENCY, above=0.0)]
Component = Annotated[float, in_range(COMPONENT)]


class ModeTable(ConfigModel):
    """A measured mode."""

    frequency: Frequency = Field(description='natural frequency, e.g. "34.9 Hz"')
    damping: Share | None = Field(default=None, description='damping ratio, e.g. "2.4 %"')
    shape: tuple[Component, ...] | None = Field(
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
        if places and all(mode.shape is None for mode in self.modes):
            raise ValueRefused(
                "a mode with a shape at these places", list(self.places), "or leave places out"
            )
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


class FrequencyResponsesTable(ConfigModel):
    """Measured frequency responses of a file: a table as `guideload response --csv` writes it, or UFF58."""

    name: StrictStr = Field(default="frequency responses", min_length=1, description="a title for reports")
    file: FileName = Field(
        description='columns "frequency [Hz]", "tool y re [m/N]", "tool y im [m/N]" (or m/s/N, m/s^2/N); or a .uff file'
    )
    force: StrictStr | None = Field(
        default=None, description='where the force acts, e.g. "frame y"; a .uff file has it'
    )
    nodes: dict[str, StrictStr] = Field(
        default={}, description='points by the numbers of nodes in a .uff file, e.g. { 12 = "tool" }'
    )
    low: Frequency | None = Field(default=None, description='lowest frequency that is used, e.g. "10 Hz"')
    high: Frequency | None = Field(default=None, description='highest frequency that is used, e.g. "200 Hz"')
    noise: Share | None = Field(
        default=None,
        description='standard deviation of real and imaginary part over the size, e.g. "3 %"; estimated if left out',
    )
    floor: Share = Field(
        default=0.005, description="noise everywhere, relative to the largest value of a curve"
    )
    calibration: Share | None = Field(
        default=None,
        description='standard deviation of a factor on all values, from hammer and sensors, e.g. "2 %"',
    )

    TYPICAL: ClassVar[float] = 0.05

    def measured(self, machine: Machine, folder: Path) -> FrequencyResponses:
        """The data for the fit. Raises ValueRefused, TraceError."""
        low, high = self.low or 0.0, self.high or np.inf
        if is_universal(self.file) and self.force is not None:
            raise ValueRefused("no force beside a universal file, which has it", self.force)
        if not is_universal(self.file) and self.nodes:
            raise ValueRefused("no nodes beside a table, whose headers name points", self.nodes)
        curves = curves_of(folder / self.file, machine, self.force, self.nodes, low, high)
        level, known = self.noise or self.TYPICAL, self.noise is not None
        return FrequencyResponses(self.name, curves, level, self.floor, known, self.calibration or 0.0)


class DeflectionTable(ConfigModel):
    """A displacement under a known force."""

    force_at: StrictStr = Field(description='where the force acts, e.g. "frame y"')
    force: Annotated[float, in_range(FORCE, nonzero=True)] = Field(description='e.g. "500 N"')
    at: StrictStr = Field(description='where the displacement is measured, e.g. "tool y"')
    moved: Annotated[float, in_range(DEFLECTION)] = Field(
        description='e.g. "4.2 um", from the place without the force'
    )


class DeflectionsTable(ConfigModel):
    """Static deflections under known forces, of a machine with linear carriages and links."""

    name: StrictStr = Field(default="static deflections", min_length=1, description="a title for reports")
    noise: Annotated[float, in_range(DEFLECTION, above=0.0)] | None = Field(
        default=None, description='standard deviation of a displacement, e.g. "0.3 um"; estimated if left out'
    )
    values: tuple[DeflectionTable, ...] = Field(min_length=1, description="one table for each displacement")

    TYPICAL: ClassVar[float] = 0.05  # of the largest displacement

    def measured(self, machine: Machine, folder: Path) -> Deflections:
        """The data for the fit. Raises ValueRefused."""
        if machine.model_level != "linear":
            way_out = "a modal test or frequency responses are for small motions about rest"
            raise ValueRefused("a machine with linear carriages and links", machine.model_level, way_out)
        values = tuple(
            Deflection(place_of(one.force_at, machine), one.force, place_of(one.at, machine), one.moved)
            for one in self.values
        )
        typical = self.TYPICAL * max(abs(one.moved) for one in values)
        if self.noise is None and typical == 0.0:
            raise ValueRefused("a displacement other than 0, or the noise", 0.0)
        return Deflections(self.name, values, self.noise or typical, self.noise is not None)


def _places(texts: Sequence[str], machine: Machine) -> Iterator[Place]:
    for text in texts:
        yield place_of(text, machine)
