"""Reading of machines and traces with the options of the command line."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from guideload.base.errors import SceneError
from guideload.cli.exit_codes import InputError
from guideload.traces.options import SmoothingOptions

if TYPE_CHECKING:
    from guideload.machine.machine import Machine
    from guideload.motion.motion import Motion
    from guideload.traces.inspection import Inspection

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


def read_machine(machine_file: Path, free: str | None = None) -> Machine:
    """The machine of a file, with the free dofs of `free` if given. Refuses a body that its links do not support."""
    from guideload.machine.machine import DOFS, Machine

    machine, source = Machine.from_toml(machine_file), str(machine_file)
    if free is not None:
        dofs = [dof.strip() for dof in free.split(",")]
        if len(set(dofs)) < len(dofs) or not set(dofs) <= set(DOFS):
            raise InputError(f'--free: expected one or more of {",".join(DOFS)}, each once, got "{free}"')
        machine, source = machine.with_free(dofs), f"{machine_file} with --free {free}"
    try:
        _ = machine.scene  # built and cached here, to report its errors
    except SceneError as error:
        raise InputError(f"{source}: {error}") from error
    return machine


def read_motion(trace_file: Path, machine: Machine, **options: Any) -> Motion:
    """The motion of a trace. options: see `options.trace_options`."""
    from guideload.traces.reading import motion_from_trace, read_trace

    reading, smoothing = _split(options)
    return motion_from_trace(read_trace(trace_file, **reading), drive=machine.drive, **smoothing)


def read_inspection(trace_file: Path, machine: Machine | None, **options: Any) -> Inspection:
    """The inspection of a trace. options: see `options.trace_options`."""
    from guideload.traces.inspection import Inspection
    from guideload.traces.reading import read_trace

    reading, smoothing = _split(options)
    return Inspection.of(read_trace(trace_file, **reading), machine, **smoothing)


def _split(options: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """The given options for `read_trace`, and those for the smoothing."""
    reading = {name: value for name, value in options.items() if value is not None}
    return reading, {name: reading.pop(name) for name in SmoothingOptions.__annotations__ if name in reading}
