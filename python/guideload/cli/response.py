"""The command `guideload response`: frequency response of the machine's points."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import click

from guideload.cli import options
from guideload.cli.inputs import read_machine
from guideload.cli.outputs import require_file, write_table
from guideload.cli.reporting import Shown, draws_report

if TYPE_CHECKING:
    import pandas as pd

    from guideload.machine.response import FrequencyResponse


class Direction(click.ParamType[str | tuple[float, ...]]):
    """x, y, z, or three numbers separated by commas."""

    name = "direction"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> str | tuple[float, ...]:
        if isinstance(value, tuple) or value in ("x", "y", "z"):
            return cast("str | tuple[float, ...]", value)
        try:
            x, y, z = map(float, str(value).split(","))
        except ValueError:
            self.fail(f"expected x, y, z or three numbers such as 1,0,0.5, got {value!r}", param, ctx)
        return x, y, z


@click.command()
@draws_report
@options.machine_argument
@click.option(
    "--force-at", metavar="POINT", help="Point where a force acts; without it the drive accelerates."
)
@click.option(
    "--direction",
    type=Direction(),
    default="x",
    show_default=True,
    help="Direction of the force or acceleration.",
)
@click.option("--csv", "table", type=options.FilePath, help="Table to write (.csv).")
@options.overwrite_picture_option
def response(
    machine_file: Path, force_at: str | None, direction: Any, table: Path | None, overwrite: bool
) -> Shown:
    """Show the frequency response of the points of a machine.

    It is the response to a vibration of the drive, or to a force at one of the points: magnitude and phase over the
    frequency. The machine is linearised at rest. The points are the [[points]] of the machine file.
    """
    from guideload.machine.response import frequency_response
    from guideload.reports.response import response_report

    if table is not None:
        require_file(table, [".csv"], overwrite, machine_file)
    machine = read_machine(machine_file)
    found = frequency_response(machine, force_at=force_at, direction=direction)
    if table is not None:
        write_table(_table(found), table, overwrite)
    return Shown(response_report(machine, found), lambda plots: plots.frequency_response(machine, found)[0])


def _table(found: FrequencyResponse) -> pd.DataFrame:
    """The response as a table: frequency, then real and imaginary part of each point along x, y and z."""
    import pandas as pd

    parts = (("re", found.displacement.real), ("im", found.displacement.imag))
    columns = {"frequency [Hz]": found.frequency}
    for i, name in enumerate(found.points):
        for axis in range(3):
            columns |= {
                f"{name} {'xyz'[axis]} {part} [{found.unit}]": values[:, i, axis] for part, values in parts
            }
    return pd.DataFrame(columns)
