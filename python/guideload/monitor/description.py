"""A monitor file: the machine, the encoder and the smoother of a load monitor. `guideload monitor build` writes it."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import Field, StrictStr

from guideload.base.config import ConfigModel, in_range, optional
from guideload.base.errors import ArgumentError
from guideload.base.file_model import FileModel
from guideload.base.ranges import ACCELERATION, FORCE, LENGTH, PERIOD, SMOOTHER
from guideload.base.toml import require_files
from guideload.monitor.settings import MonitorSettings

Load = Annotated[float, in_range(FORCE, above=0.0)]


class Smoother(ConfigModel):
    """The smoother that was chosen for a typical motion."""

    order: Annotated[int, Field(ge=2, le=5)] = Field(
        description="order of the derivative of the position that is taken for white noise"
    )
    time_constant: Annotated[float, in_range(SMOOTHER, above=0.0)] = Field(description="in samples")


class MonitorFile(FileModel):
    """A monitor file. Raises ConfigError with all problems at once."""

    FILE: ClassVar = "monitor.toml"
    WRITTEN_BY: ClassVar = "`guideload monitor build` writes one"

    machine: Annotated[StrictStr, Field(min_length=1)] = Field(
        description='machine file, from the folder of this file, e.g. "machine.toml"'
    )
    period: Annotated[float, in_range(PERIOD, above=0.0)] = Field(
        description='time between two samples, e.g. "1 ms"'
    )
    travel_per_count: Annotated[float, in_range(LENGTH, nonzero=True)] = Field(
        description='travel of the cart per count, e.g. "20 um"; negative if the counter counts backwards'
    )
    lag: Annotated[int, Field(ge=0, le=200)] = Field(description="delay of the loads, in samples")
    encoder_bits: Annotated[int, Field(ge=8, le=32)] = optional("width of the counter", 32)
    ticks: Annotated[int, Field(ge=1, le=2**24)] = optional(
        "time stamps per period; 1 if the stamp is the number of the sample", 1
    )
    max_acceleration: Annotated[float, in_range(ACCELERATION, above=0.0)] = Field(
        description="largest acceleration the axis can have: a sample that asks for more is wrong"
    )
    most_missing: Annotated[int, Field(ge=0, le=64)] = optional("samples that may be missing in a row", 8)
    load_limit: Load | None = optional("limit of the equivalent load of every carriage")
    bin: Load = optional("width of a bin of the histogram of the equivalent load", 500.0)
    smoother: Smoother = Field(description="the smoother, which `guideload monitor build` chooses")

    @property
    def settings(self) -> MonitorSettings:
        """Sampling, encoder and limits. Raises ArgumentError."""
        return MonitorSettings(
            period=self.period,
            quantum=self.travel_per_count,
            lag=self.lag,
            max_acceleration=self.max_acceleration,
            counter_bits=self.encoder_bits,
            ticks=self.ticks,
            most_missing=self.most_missing,
            limit=float("inf") if self.load_limit is None else self.load_limit,
            bin=self.bin,
        )

    @classmethod
    def _of_file(cls, values: dict[str, Any], file: Path) -> MonitorFile:
        described = cls(**values)
        require_files(file.parent, {("machine",): described.machine})
        try:
            _ = described.settings
        except ArgumentError as error:
            raise ArgumentError(f"{file}: {error}") from None
        return described


def monitor_text(
    settings: MonitorSettings,
    order: int,
    time_constant: float,
    machine_file: Path,
    folder: Path,
    head: list[str],
) -> str:
    """The text of a monitor file in a folder. head: lines of comment."""
    try:
        path = Path(os.path.relpath(machine_file, folder)).as_posix()
    except ValueError:  # another disk
        path = machine_file.absolute().as_posix()
    rows = [
        ("machine", json.dumps(path, ensure_ascii=False), "from the folder of this file"),
        ("period", repr(settings.period), "s"),
        ("travel_per_count", repr(settings.quantum), "m"),
        ("lag", str(settings.lag), "samples"),
        ("encoder_bits", str(settings.counter_bits), ""),
        ("ticks", str(settings.ticks), "time stamps per period"),
        ("max_acceleration", repr(settings.max_acceleration), "m/s^2"),
        ("most_missing", str(settings.most_missing), "samples in a row"),
        ("bin", repr(settings.bin), "N, of the histogram"),
        ("smoother", f"{{ order = {order}, time_constant = {time_constant!r} }}", "chosen for the motion"),
    ]
    if settings.limit < float("inf"):
        rows.insert(-2, ("load_limit", repr(settings.limit), "N, of the equivalent load"))
    lines = [f"{key} = {value}" + (f"  # {unit}" if unit else "") for key, value, unit in rows]
    return "\n".join([*(f"# {line}" for line in head), *lines]) + "\n"
