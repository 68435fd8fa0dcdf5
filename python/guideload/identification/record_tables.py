"""The tables of an identify file for records in time: motor force, and logs of sensors."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, StrictBool, StrictStr, field_validator, model_validator

from guideload.base.config import ConfigModel, in_range, number
from guideload.base.errors import ValueRefused
from guideload.base.ranges import FORCE, MOMENT, PERIOD, SHARE, TIME, noise_in
from guideload.identification.motor_force import MotorForce
from guideload.identification.places import load_place_of, place_of
from guideload.identification.sensor_log import Channel, Kind, SensorLog
from guideload.machine.machine import Machine
from guideload.study.options import TraceOptions
from guideload.study.varied_parameters import NumberOrText
from guideload.traces.channels import Channels, read_channels

Text = Annotated[StrictStr, Field(min_length=1)]
Seconds = Annotated[float, in_range(PERIOD, above=0.0)]
Instant = Annotated[float, in_range(TIME)]
Share = Annotated[float, in_range(SHARE, above=0.0)]
MOTION = "the measured trace of the motion, or planned moves that were run, e.g. "


class RecordTable(ConfigModel):
    """A record in time beside the trace of the motion that caused it."""

    trace: Text = Field(description=f'{MOTION}"trace.csv"')
    reading: TraceOptions = Field(default=TraceOptions(), description="how the trace is read, as in a study")
    file: Text | None = Field(
        default=None, description='table with the record, e.g. "log.csv"; by default that of the trace'
    )
    time: Text | None = Field(default=None, description="column of the record's time stamps; else detected")
    rate: NumberOrText | None = Field(
        default=None, description="samples per second of the record, in place of a time column"
    )
    window: Seconds | None = Field(
        default=None, description="length of the windows over which both sides are averaged; else chosen"
    )

    def stamped(self, folder: Path, columns: dict[str, str | None]) -> Channels:
        """Columns of the record, in these units, with their stamps. Raises TraceError."""
        return read_channels(folder / (self.file or self.trace), columns, time=self.time, rate=self.rate)


class MotorForceTable(RecordTable):
    """Force of the drive on the cart or torque of the motor, recorded with the motion: mass and friction."""

    name: Text = Field(default="motor force", description="a title for reports")
    column: Text = Field(description='column of force, torque, current or voltage, e.g. "u_V"')
    quantity: Literal["force", "torque"] = Field(
        default="force", description='"force" on the cart, or "torque" of the motor; needs [drive]'
    )
    per_unit: NumberOrText | None = Field(
        default=None,
        description='force or torque per unit of the column, e.g. "35.15 N" for a column in volts; without it the '
        "header gives the unit",
    )
    friction: tuple[Literal["seal", "viscous"], ...] = Field(
        default=("seal", "viscous"),
        description="keys of [friction] that are unknown; others keep the machine's value",
    )
    delay: StrictBool = Field(
        default=False, description="whether the record is later or earlier than the trace by an unknown delay"
    )
    noise: NumberOrText | None = Field(
        default=None, description='standard deviation of one value, e.g. "2 N"; estimated if left out'
    )
    part: tuple[Instant, Instant] | None = Field(
        default=None, description='first and last instant that is used, e.g. ["0 s", "12 s"]; else all'
    )

    @field_validator("friction")
    @classmethod
    def _once(cls, keys: tuple[str, ...]) -> tuple[str, ...]:
        if len(set(keys)) < len(keys):
            raise ValueRefused("each key once", list(keys))
        return keys

    def measured(self, machine: Machine, folder: Path) -> MotorForce:
        """The data for the fit. Raises ValueRefused, ArgumentError and TraceError."""
        unit, within = ("N", FORCE) if self.quantity == "force" else ("N m", MOMENT)
        scale = 1.0 if self.per_unit is None else number(self.per_unit, unit, nonzero=True, within=within)
        level = None if self.noise is None else number(self.noise, unit, above=0.0, within=noise_in(unit))
        record = self.stamped(folder, {self.column: unit if self.per_unit is None else None})
        return MotorForce.of(
            machine,
            self.reading.motion(folder / self.trace, machine),
            record.time,
            scale * record.values[:, 0],
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
    kind: Kind = Field(
        default="acceleration",
        description='"acceleration" (absolute), "velocity" or "displacement" from the frame of the guides, or "load": '
        "of a load cell or strain gauge",
    )
    noise: NumberOrText | None = Field(
        default=None,
        description='standard deviation of one value, e.g. "0.05 m/s^2"; without unit if the gain is unknown; '
        "estimated if left out, or beside a trace with uncertainty",
    )
    gain_spread: Share | None = Field(
        default=None,
        description="relative standard deviation of its sensitivity, e.g. 0.03; exact if left out",
    )
    gain: Literal["known", "unknown"] = Field(
        default="known",
        description='"unknown": a strain gauge without calibration, whose column may have any unit and sign',
    )

    @model_validator(mode="after")
    def _one_statement_of_gain(self) -> ChannelTable:
        if self.gain == "unknown" and self.gain_spread is not None:
            raise ValueRefused('no gain_spread beside gain = "unknown"', self.gain_spread)
        return self

    def channel(self, machine: Machine) -> Channel:
        """Raises ValueRefused."""
        spread = np.inf if self.gain == "unknown" else self.gain_spread or 0.0
        place = load_place_of(self.place, machine) if self.kind == "load" else place_of(self.place, machine)
        found = Channel(place, self.kind, None, spread)
        level = (
            None
            if self.noise is None
            else number(self.noise, found.unit, above=0.0, within=noise_in(found.unit))
        )
        return replace(found, level=level)


class SensorLogTable(RecordTable):
    """A log of accelerometers or other sensors on the body, or of load cells and strain gauges."""

    name: Text = Field(default="sensor log", description="a title for reports")
    one_clock: StrictBool = Field(
        default=False,
        description="true: the stamps of log and trace are of one clock, so that there is no delay",
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
        record = self.stamped(folder, units)
        motion = self.reading.motion(folder / self.trace, machine)
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
