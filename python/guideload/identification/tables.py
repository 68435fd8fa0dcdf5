"""Tables of an identify file: one model for each kind of measured data."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, PlainValidator, StrictBool, StrictStr, field_validator, model_validator

from guideload.base.config import ConfigModel, in_range, number, optional
from guideload.base.errors import ValueRefused
from guideload.base.ranges import (
    COMPONENT,
    DAMPING_RATIO,
    DEFLECTION,
    FORCE,
    FREQUENCY,
    MOMENT,
    PERIOD,
    SHARE,
    TIME,
    Range,
    noise_in,
)
from guideload.identification.modal_test import MeasuredMode, ModalTest
from guideload.identification.model import parse_load_place, parse_place
from guideload.identification.motor_force import MotorForce
from guideload.identification.response_files import is_universal, read_curves
from guideload.identification.responses import Deflection, Deflections, FrequencyResponses
from guideload.identification.sensor_log import Channel, Kind, SensorLog
from guideload.machine.machine import Machine
from guideload.machine.modes import Modes
from guideload.motion.motion import Motion
from guideload.motion.origin import stamps_from
from guideload.study.options import Reading, TraceOptions
from guideload.study.varied_parameters import PERCENT, NumberOrText
from guideload.traces.channels import STAMP_OPTIONS, Channels, read_channels

Text = Annotated[StrictStr, Field(min_length=1)]


def _share(value: object, unit: str, above: float, within: Range) -> float:
    """A plain number, or text in percent."""
    if isinstance(value, str) and (match := PERCENT.fullmatch(value)):
        value = float(match[1]) / 100.0
    return number(value, unit, above=above, within=within)


Share = Annotated[float, PlainValidator(partial(_share, unit="1", above=0.0, within=SHARE))]
Ratio = Annotated[float, PlainValidator(partial(_share, unit="1", above=0.0, within=DAMPING_RATIO))]
Frequency = Annotated[float, in_range(FREQUENCY, above=0.0)]
Component = Annotated[float, in_range(COMPONENT)]


def noise_level(value: object, unit: str) -> float | None:
    """A standard deviation of single values; None if it is left out. Raises ValueRefused."""
    return None if value is None else number(value, unit, above=0.0, within=noise_in(unit))


class ModeTable(ConfigModel):
    """A measured mode."""

    frequency: Frequency = Field(description='natural frequency, e.g. "34.9 Hz"')
    damping: Ratio | None = optional('damping ratio, e.g. "2.4 %"')
    shape: tuple[Component, ...] | None = optional(
        "real components at the places of the test, in any scale; in phase or against it"
    )
    number: Annotated[int, Field(strict=True, ge=1)] | None = optional(
        "of the computed mode that it is, from 1 by ascending frequency; by default the one that fits best"
    )


class ModalTestTable(ConfigModel):
    """A modal test, as with a hammer: natural frequencies, damping ratios and mode shapes from a modal analysis."""

    name: Text = optional("a title for reports", "hammer test")
    places: tuple[StrictStr, ...] = optional(
        'places of the shapes: points of the machine with an axis, e.g. ["tool y", "tool -z"]', ()
    )
    frequencies: Literal["natural", "damped"] = optional(
        '"natural": of the undamped vibration, as modal analysis gives; "damped": of the free vibration',
        "natural",
    )
    frequency_noise: Share | None = optional(
        'standard deviation relative to the frequency, e.g. "1 %"; estimated if left out'
    )
    damping_noise: Share | None = optional(
        'standard deviation relative to the ratio, e.g. "10 %"; estimated if left out'
    )
    shape_noise: Share | None = optional(
        'standard deviation relative to the largest component, e.g. "5 %"; estimated if left out'
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
        places = tuple(parse_place(text, machine) for text in self.places)
        if places and all(mode.shape is None for mode in self.modes):
            raise ValueRefused(
                "a mode with a shape at these places", list(self.places), "or leave places out"
            )
        computed = Modes.of(machine).frequency.size
        for i, mode in enumerate(self.modes):
            if mode.number is not None and mode.number > computed:
                raise ValueRefused(
                    f"at most {computed}, the modes of the machine", mode.number, f"number of modes[{i}]"
                )
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

    name: Text = optional("a title for reports", "frequency responses")
    file: Text = Field(
        description='columns "frequency [Hz]", "tool y re [m/N]", "tool y im [m/N]" (or m/s/N, m/s^2/N); or a .uff file'
    )
    force: StrictStr | None = optional('where the force acts, e.g. "frame y"; a .uff file has it')
    nodes: dict[str, StrictStr] = optional(
        'points by the numbers of nodes in a .uff file, e.g. { 12 = "tool" }', {}
    )
    low: Frequency | None = optional('lowest frequency that is used, e.g. "10 Hz"')
    high: Frequency | None = optional('highest frequency that is used, e.g. "200 Hz"')
    noise: Share | None = optional(
        'standard deviation of real and imaginary part over the size, e.g. "3 %"; estimated if left out'
    )
    floor: Share | None = optional(
        "standard deviation of noise everywhere over the largest value of a curve; if left out, estimated with the "
        'noise, or "0.5 %" beside a stated one'
    )
    calibration: Share | None = optional(
        'standard deviation of a factor on all values, from hammer and sensors, e.g. "2 %"'
    )

    TYPICAL: ClassVar[tuple[float, float]] = (0.05, 0.005)

    def measured(self, machine: Machine, folder: Path) -> FrequencyResponses:
        """The data for the fit. Raises ValueRefused, TraceError."""
        low, high = self.low or 0.0, self.high or np.inf
        if is_universal(self.file) and self.force is not None:
            raise ValueRefused("no force beside a universal file, which has it", self.force)
        if not is_universal(self.file) and self.nodes:
            raise ValueRefused("no nodes beside a table, whose headers name points", self.nodes)
        curves = read_curves(folder / self.file, machine, self.force, self.nodes, low, high)
        level, floor = self.noise or self.TYPICAL[0], self.floor or self.TYPICAL[1]
        known, floor_known = self.noise is not None, self.floor is not None
        calibration = self.calibration or 0.0
        return FrequencyResponses(self.name, curves, level, floor, known, floor_known, calibration)


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

    name: Text = optional("a title for reports", "static deflections")
    noise: Annotated[float, in_range(DEFLECTION, above=0.0)] | None = optional(
        'standard deviation of a displacement, e.g. "0.3 um"; estimated if left out'
    )
    values: tuple[DeflectionTable, ...] = Field(min_length=1, description="one table for each displacement")

    TYPICAL: ClassVar[float] = 0.05  # of the largest displacement

    def measured(self, machine: Machine, folder: Path) -> Deflections:
        """The data for the fit. Raises ValueRefused."""
        if machine.model_level != "linear":
            way_out = "a modal test or frequency responses are for small motions about rest"
            raise ValueRefused("a machine with linear carriages and links", machine.model_level, way_out)
        values = tuple(
            Deflection(parse_place(one.force_at, machine), one.force, parse_place(one.at, machine), one.moved)
            for one in self.values
        )
        typical = self.TYPICAL * max(abs(one.moved) for one in values)
        if self.noise is None and typical == 0.0:
            raise ValueRefused("a displacement other than 0, or the noise", 0.0)
        return Deflections(self.name, values, self.noise or typical, self.noise is not None)


# ---- records in time: motor force, and logs of sensors


Seconds = Annotated[float, in_range(PERIOD, above=0.0)]
Instant = Annotated[float, in_range(TIME)]
MOTION = "the measured trace of the motion, or planned moves that were run, e.g. "


class RecordTable(ConfigModel):
    """A record in time beside the trace of the motion that caused it."""

    trace: Text = Field(description=f'{MOTION}"trace.csv"')
    reading: Reading = optional("how the trace is read, as in a study", TraceOptions())
    file: Text | None = optional('table with the record, e.g. "log.csv"; by default that of the trace')
    time: Text | None = optional("column of the record's time stamps; else detected")
    rate: NumberOrText | None = optional("samples per second of the record, in place of a time column")
    window: Seconds | None = optional("length of the windows over which both sides are averaged; else chosen")

    def stamped(self, folder: Path, columns: dict[str, str | None], motion: Motion) -> Channels:
        """Columns of the record, in these units, with stamps on the clock of the motion if both are of one clock.

        In the file of the trace they have its stamps, unless time or rate say others. Raises TraceError.
        """
        given = {"time": self.time, "rate": self.rate}
        if self.file is None and given == {"time": None, "rate": None}:
            given = {name: getattr(self.reading, name) for name in STAMP_OPTIONS}
        read = read_channels(folder / (self.file or self.trace), columns, **given)
        time = stamps_from(read.time, read.origin, motion.origin)
        return read if time is None else replace(read, time=time)


LEAST = 1e-9  # N or N m: what no drive can measure, and what squares of the fit can still hold


class MotorForceTable(RecordTable):
    """Force of the drive on the cart or torque of the motor, recorded with the motion: mass and friction."""

    name: Text = optional("a title for reports", "motor force")
    column: Text = Field(description='column of force, torque, current or voltage, e.g. "u_V"')
    quantity: Literal["force", "torque"] = optional(
        '"force" on the cart, or "torque" of the motor; needs [drive]', "force"
    )
    per_unit: NumberOrText | None = optional(
        'force or torque per unit of the column, e.g. "35.15 N" for a column in volts; without it the '
        "header gives the unit"
    )
    friction: tuple[Literal["seal", "viscous"], ...] = optional(
        "keys of [friction] that are unknown; others keep the machine's value", ("seal", "viscous")
    )
    delay: StrictBool = optional(
        "whether the record is later or earlier than the trace by an unknown delay", False
    )
    noise: NumberOrText | None = optional(
        'standard deviation of one value, e.g. "2 N"; estimated if left out'
    )
    part: tuple[Instant, Instant] | None = optional(
        'first and last instant that is used, e.g. ["0 s", "12 s"]; else all'
    )

    @field_validator("friction")
    @classmethod
    def _once(cls, keys: tuple[str, ...]) -> tuple[str, ...]:
        if len(set(keys)) < len(keys):
            raise ValueRefused("each key once", list(keys))
        return keys

    @field_validator("part")
    @classmethod
    def _in_order(cls, part: tuple[float, float] | None) -> tuple[float, float] | None:
        if part is not None and part[0] >= part[1]:
            raise ValueRefused("a first instant before the last one", f"{part[0]:g} s, {part[1]:g} s")
        return part

    def measured(self, machine: Machine, folder: Path) -> MotorForce:
        """The data for the fit. Raises ValueRefused, ArgumentError and TraceError."""
        unit, within = ("N", FORCE) if self.quantity == "force" else ("N m", MOMENT)
        scale = 1.0 if self.per_unit is None else number(self.per_unit, unit, nonzero=True, within=within)
        level = noise_level(self.noise, unit)
        motion = self.reading.motion(folder / self.trace, machine)
        record = self.stamped(folder, {self.column: unit if self.per_unit is None else None}, motion)
        values = scale * record.values[:, 0]
        largest = float(abs(values).max(initial=0.0))
        if largest < LEAST:
            expected = f"a {self.quantity} that reaches {LEAST:g} {unit} in the column {self.column}"
            raise ValueRefused(expected, f"{largest:.3g} {unit}", "is its unit, or per_unit, right?")
        return MotorForce.of(
            machine,
            motion,
            record.time,
            values,
            name=self.name,
            torque=self.quantity == "torque",
            friction=self.friction,
            delayed=self.delay,
            level=level,
            window=self.window,
            part=self.part or (-np.inf, np.inf),
        )


class ChannelTable(ConfigModel):
    """A sensor of a log."""

    column: Text = Field(description='column of the log; its header gives the unit, e.g. "ay [m/s^2]"')
    place: Text = Field(
        description='a point of the machine and an axis, e.g. "tool y"; of a load: a carriage and a component (Fy, Fz, '
        'Mx, My, Mz), e.g. "1a Fy", or a link'
    )
    kind: Kind = optional(
        '"acceleration" (absolute), "velocity" or "displacement" from the frame of the guides, or "load": '
        "of a load cell or strain gauge",
        "acceleration",
    )
    noise: NumberOrText | None = optional(
        'standard deviation of one value, e.g. "0.05 m/s^2"; without unit if the gain is unknown; '
        "estimated if left out, or beside a trace with uncertainty"
    )
    gain_spread: Share | None = optional(
        "relative standard deviation of its sensitivity, e.g. 0.03; exact if left out"
    )
    gain: Literal["known", "unknown"] = optional(
        '"unknown": a strain gauge without calibration, whose column may have any unit and sign', "known"
    )

    @model_validator(mode="after")
    def _one_statement_of_gain(self) -> ChannelTable:
        if self.gain == "unknown" and self.gain_spread is not None:
            raise ValueRefused('no gain_spread beside gain = "unknown"', self.gain_spread)
        return self

    def channel(self, machine: Machine) -> Channel:
        """Raises ValueRefused."""
        spread = np.inf if self.gain == "unknown" else self.gain_spread or 0.0
        return channel(machine, self.place, self.kind, self.noise, spread)


def channel(
    machine: Machine, place: str, kind: Kind, noise: NumberOrText | None, gain_spread: float = 0.0
) -> Channel:
    """A sensor at a place, with this noise of one value. Raises ValueRefused."""
    at = parse_load_place(place, machine) if kind == "load" else parse_place(place, machine)
    found = Channel(at, kind, gain_spread=gain_spread)
    return replace(found, level=noise_level(noise, found.unit))


class SensorLogTable(RecordTable):
    """A log of accelerometers or other sensors on the body, or of load cells and strain gauges."""

    name: Text = optional("a title for reports", "sensor log")
    one_clock: StrictBool = optional(
        "true: the stamps of log and trace are of one clock, so that there is no delay", False
    )
    channels: tuple[ChannelTable, ...] = Field(min_length=1, description="one table for each sensor")

    def measured(self, machine: Machine, folder: Path) -> SensorLog:
        """The data for the fit. Raises ValueRefused, ArgumentError and TraceError."""
        channels = [one.channel(machine) for one in self.channels]
        units = {
            table.column: None if one.gain_spread == np.inf else one.unit
            for table, one in zip(self.channels, channels, strict=True)
        }
        if len(units) < len(channels):
            raise ValueRefused("each column once", [one.column for one in self.channels])
        motion = self.reading.motion(folder / self.trace, machine)
        record = self.stamped(folder, units, motion)
        return SensorLog.of(
            machine,
            motion,
            channels,
            record.time,
            record.values,
            name=self.name,
            one_clock=self.one_clock,
            window=self.window,
        )
