"""Reading of machines, traces and motion files with the options of the command line."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from guideload.base.errors import ConfigError, SceneError
from guideload.cli.exit_codes import InputError
from guideload.cli.options import option_name
from guideload.traces.options import SmoothingOptions

if TYPE_CHECKING:
    from guideload.catalogue.conditions import LifeConditions
    from guideload.machine.machine import Machine
    from guideload.motion.motion import Motion
    from guideload.motion.moves import Moves
    from guideload.traces.inspection import Inspection

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
RECORDS = (".csv", ".parquet", ".mat", ".npz")  # endings of files of traces
MACHINE_KINDS = ("one-rail", "gantry", "vertical")  # of short machine files, in examples/kinds


def read_machine(machine_file: Path, free: str | None = None) -> Machine:
    """The machine of a file, with the free dofs of `free` if given. Refuses a body that its links do not support."""
    from guideload.machine.machine import DOFS, Machine

    try:
        machine, source = Machine.from_toml(machine_file), str(machine_file)
    except ConfigError as error:
        if machine_file.suffix.lower() not in RECORDS or not machine_file.is_file():
            raise
        first = "the machine comes first, then the trace: guideload run machine.toml trace.csv"
        raise InputError(f"{machine_file}: expected a machine file (.toml); {first}") from error
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


def requirements(machine: Machine, given: dict[str, Any]) -> LifeConditions:
    """The conditions of the machine with those of `options.requirement_options`, which are taken out of `given`."""
    changes = {key: given.pop(key) for key in ("rule", "reliability", "life", "safety")}
    return machine.life.model_copy(update={key: value for key, value in changes.items() if value is not None})


def paths(*inputs: object) -> tuple[Path, ...]:
    """The files among the inputs of a command; moves of the option --move are in no file."""
    return tuple(one for one in inputs if isinstance(one, Path))


def read_moves(trace_file: Path | Moves, **options: Any) -> Moves | None:
    """The moves of a motion file (.toml) or of --move; None for a trace. options: they are refused beside moves."""
    if isinstance(trace_file, Path) and trace_file.suffix.lower() != ".toml":
        return None
    from guideload.motion.moves import Moves

    _refuse(options, "is for traces; planned moves are known exactly, and nothing is read or smoothed")
    return Moves.from_toml(trace_file) if isinstance(trace_file, Path) else trace_file


def is_motion_file(file: Path) -> bool:
    """Whether a file is a TOML file with moves."""
    from guideload.base.toml import read_toml

    try:
        return file.suffix.lower() == ".toml" and "moves" in read_toml(file)[0]
    except ConfigError:
        return False  # its reader gives the message


def read_motion(
    trace_file: Path | Moves,
    machine: Machine,
    *,
    forces: Path | None = None,
    forces_at: str | None = None,
    forces_axes: str | None = None,
    forces_start: float | None = None,
    **options: Any,
) -> Motion:
    """The motion of a trace, of a motion file or of --move, with process forces.

    forces...: see `options.force_options`; options: see `options.trace_options`.
    """
    moves = read_moves(trace_file, **options)
    if moves is not None:
        motion = moves.motion()
    else:
        from guideload.traces.reading import motion_from_trace, read_trace

        assert isinstance(trace_file, Path)
        reading, smoothing = _split(options)
        motion = motion_from_trace(read_trace(trace_file, **reading), drive=machine.drive, **smoothing)
    if forces is None and forces_at is None and forces_axes is None and forces_start is None:
        return motion
    if forces_at is None:
        raise InputError("--forces: where do they act? Give a point of the machine file: --forces-at NAME")
    from guideload.traces.channels import forces_beside, read_forces

    if isinstance(trace_file, Path) and moves is None:
        read = forces_beside(trace_file, options, forces)
    elif forces is not None:
        read = read_forces(forces)
    else:
        raise InputError(
            "--forces-at: planned moves have no columns of forces; give their file with --forces FILE"
        )
    point = machine.point(forces_at)
    return motion.with_forces(read, point, own_axes=forces_axes == "point", start=forces_start)


def read_optional_motion(trace_file: Path | Moves | None, machine: Machine, **options: Any) -> Motion | None:
    """The motion, None without a trace; options for a trace are then refused."""
    if trace_file is not None:
        return read_motion(trace_file, machine, **options)
    _refuse(options, "needs a trace or a motion")
    return None


def _refuse(options: dict[str, Any], why: str) -> None:
    """Raise InputError for the first of `options` that is given."""
    if given := [name for name, value in options.items() if value is not None]:
        raise InputError(f"{option_name(given[0])} {why}")


def read_riders(machine: Machine, machine_file: Path, given: Sequence[str]) -> dict[str, Motion] | None:
    """The motions of the machine's riders: of their key motion, relative to the machine file, or of --rider NAME=FILE.

    None for a machine without riders. Traces are read without options; they need not have any columns but time and one
    position or velocity.
    """
    files = {rider.name: machine_file.parent / rider.motion for rider in machine.riders if rider.motion}
    for text in given:
        name, equals, file = text.partition("=")
        if not equals or name not in {rider.name for rider in machine.riders}:
            known = ", ".join(rider.name for rider in machine.riders) or "none"
            raise InputError(
                f'--rider: expected NAME=FILE with a rider of {machine_file} ({known}), got "{text}"'
            )
        files[name] = Path(file)
    if not machine.riders:
        return None
    plain = machine.model_copy(update={"drive": None})  # the drive of the cart does not move a rider
    return {name: read_motion(file, plain) for name, file in files.items()}


def read_inspection(
    trace_file: Path, machine: Machine | None, ratio: Any = None, **options: Any
) -> Inspection:
    """The inspection of a trace. ratio: travel per turn of the motor, as text; options: see `options.trace_options`."""
    from guideload.machine.drive import Drive
    from guideload.traces.inspection import Inspection
    from guideload.traces.reading import read_trace

    if is_motion_file(trace_file):
        reason = "its moves are known exactly: there are no samples to judge or to smooth"
        raise InputError(f"{trace_file}: is a motion file; {reason}. For its loads: guideload run")
    reading, smoothing = _split(options)
    try:
        drive = None if ratio is None else Drive(screw_lead=ratio)
    except ConfigError as error:
        raise InputError(
            f'--ratio: expected a travel per turn of the motor, as in "33.3 mm"; {error}'
        ) from None
    return Inspection.of(read_trace(trace_file, **reading), machine, drive=drive, **smoothing)


def _split(options: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """The given options for `read_trace`, and those for the smoothing."""
    reading = {name: value for name, value in options.items() if value is not None}
    return reading, {name: reading.pop(name) for name in SmoothingOptions.__annotations__ if name in reading}
