"""A monitor file: the machine, the encoder and the smoother of a load monitor. `guideload monitor build` writes it."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import Field, StrictStr

from guideload.base.config import ConfigModel, in_range, whole
from guideload.base.file_model import FileModel
from guideload.base.ranges import SMOOTHER
from guideload.base.toml import require_files
from guideload.monitor.settings import MonitorSettings


class Smoother(ConfigModel):
    """The smoother that was chosen for a typical motion."""

    order: Annotated[int, whole(2, 5)] = Field(
        description="order of the derivative of the position that is taken for white noise"
    )
    time_constant: Annotated[float, in_range(SMOOTHER, above=0.0)] = Field(description="in samples")


class MonitorFile(FileModel, MonitorSettings):
    """A monitor file. Raises ConfigError with all problems at once."""

    FILE: ClassVar = "monitor.toml"
    WRITTEN_BY: ClassVar = "`guideload monitor build` writes one"
    REQUIRED: ClassVar = ("smoother", "a smoother, as a monitor file has")

    machine: Annotated[StrictStr, Field(min_length=1)] = Field(
        description='machine file, from the folder of this file, e.g. "machine.toml"'
    )
    smoother: Smoother = Field(description="the smoother, which `guideload monitor build` chooses")

    @property
    def settings(self) -> MonitorSettings:
        """Sampling, encoder and limits."""
        return MonitorSettings(**{key: getattr(self, key) for key in MonitorSettings.model_fields})

    @classmethod
    def _of_file(cls, values: dict[str, Any], file: Path) -> MonitorFile:
        described = cls(**values)
        require_files(file.parent, {("machine",): described.machine})
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
        ("travel_per_count", repr(settings.travel_per_count), "m"),
        ("lag", str(settings.lag), "samples"),
        ("encoder_bits", str(settings.encoder_bits), ""),
        ("ticks", str(settings.ticks), "time stamps per period"),
        ("max_acceleration", repr(settings.max_acceleration), "m/s^2"),
        ("most_missing", str(settings.most_missing), "samples in a row"),
        ("bin", repr(settings.bin), "N, of the histogram"),
        ("smoother", f"{{ order = {order}, time_constant = {time_constant!r} }}", "chosen for the motion"),
    ]
    if settings.load_limit is not None:
        rows.insert(-2, ("load_limit", repr(settings.load_limit), "N, of the equivalent load"))
    lines = [f"{key} = {value}" + (f"  # {unit}" if unit else "") for key, value, unit in rows]
    return "\n".join([*(f"# {line}" for line in head), *lines]) + "\n"
