"""Measurements that could be made next: tables of an identify file, and what each would show of the fitted machine."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, StrictStr, model_validator

from guideload.base.config import ConfigModel, in_range, number
from guideload.base.errors import ValueRefused
from guideload.base.number_text import joined
from guideload.base.ranges import DEFLECTION, FORCE, noise_in
from guideload.identification.deflections import Deflection, Deflections
from guideload.identification.excitation import Excitation
from guideload.identification.frequency_responses import Curve, FrequencyResponses
from guideload.identification.measured import Measured
from guideload.identification.modal_test import ModalTest
from guideload.identification.model import ModelAt
from guideload.identification.places import load_place_of, place_of
from guideload.identification.sensor_log import Channel, Kind, SensorLog
from guideload.identification.tables import FileName, Frequency, ModalTestTable, Share
from guideload.study.options import TraceOptions
from guideload.study.varied_parameters import NumberOrText

Keys = frozenset[str]
BAND: Keys = frozenset({"force", "low", "high"})
LEVELS = ("frequency_noise", "damping_noise", "shape_noise")


class CandidateTable(ConfigModel):
    """Measurements that could be made next, one for each pair of a force or motion and a place."""

    kind: Literal["frequency response", "deflection", "modal test", "record"] = Field(
        description='"frequency response" to a hammer; "deflection" under a constant force; "modal test" with a hammer '
        'and sensors at all places; "record" of a sensor under a motion'
    )
    force: tuple[StrictStr, ...] = Field(
        default=(), description='where a force may act, e.g. ["tool y", "tool z"]; not of a record'
    )
    at: tuple[StrictStr, ...] = Field(
        min_length=1, description='where a sensor may be, e.g. ["tool y"]; of a load cell "1a Fy"'
    )
    low: Frequency = Field(default=5.0, description="lowest frequency of a response or of a mode")
    high: Frequency = Field(default=500.0, description="highest frequency")
    noise: Share = Field(
        default=0.05, description="of a response: standard deviation of real and imaginary part over the size"
    )
    frequency_noise: Share = Field(
        default=ModalTestTable.TYPICAL[0], description="of a modal test, relative to the frequency"
    )
    damping_noise: Share = Field(
        default=ModalTestTable.TYPICAL[1], description="of a modal test, relative to the damping ratio"
    )
    shape_noise: Share = Field(
        default=ModalTestTable.TYPICAL[2], description="of a modal test, relative to the largest component"
    )
    load: Annotated[float, in_range(FORCE, above=0.0)] = Field(
        default=1000.0, description="force of a deflection"
    )
    motion: FileName | None = Field(
        default=None, description='of a record: planned moves or a trace, e.g. "moves.toml"'
    )
    reading: TraceOptions = Field(default=TraceOptions(), description="how the trace is read, as in a study")
    sensor: Kind = Field(
        default="acceleration",
        description='of a record: "acceleration", "velocity", "displacement" or "load"',
    )
    accuracy: NumberOrText | None = Field(
        default=None,
        description='standard deviation of a deflection (default "1 um") or of one value of a record, e.g. "0.1 m/s^2"',
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
        return self

    def measurements(self, model: ModelAt, folder: Path) -> Iterator[Measured]:
        """Every measurement, with the values that the machine would show.

        Raises ValueRefused, and for a record TraceError and ArgumentError.
        """
        if self.kind == "record":
            yield from self._records(model, folder)
            return
        places = [place_of(text, model.machine) for text in self.at]
        hertz = np.geomspace(self.low, max(self.high, self.low * 1.01), self.COUNT)
        for force in (place_of(text, model.machine) for text in self.force):
            if self.kind == "modal test":
                levels = self.frequency_noise, self.damping_noise, self.shape_noise
                where = joined([place.name for place in places])
                name = f"modal test at {where} with a hammer at {force.name}"
                yield ModalTest.shown(name, model, places, levels, force, (self.low, self.high))
                continue
            for at in places:
                name = f"{self.kind} of {at.name} to a force at {force.name}"
                if self.kind == "deflection":
                    accuracy = number(
                        "1 um" if self.accuracy is None else self.accuracy, "m", above=0.0, within=DEFLECTION
                    )
                    yield Deflections(name, (Deflection(force, self.load, at, 0.0),), accuracy, True)
                    continue
                curve = Curve(force, at, 2, hertz, np.zeros(hertz.size, dtype=np.complex128))
                shown = replace(curve, value=curve.computed(model)[0])
                yield FrequencyResponses(name, (shown,), self.noise, 0.005, True)

    def _records(self, model: ModelAt, folder: Path) -> Iterator[Measured]:
        assert self.motion is not None and self.accuracy is not None
        motion = self.reading.motion(folder / self.motion, model.machine)
        excitation = Excitation.of(model.machine, motion)
        place = partial(load_place_of if self.sensor == "load" else place_of, machine=model.machine)
        for text in self.at:
            channel = Channel(place(text), self.sensor)
            channel = replace(
                channel, level=number(self.accuracy, channel.unit, above=0.0, within=noise_in(channel.unit))
            )
            yield SensorLog.shown(f"{channel.name} under {self.motion}", model, excitation, channel)
