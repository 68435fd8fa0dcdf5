"""The comparison of several runs: what differs between the machines, then the figures of each run side by side."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from guideload.audit.figures import STATICS
from guideload.base.arguments import checked
from guideload.base.errors import ArgumentError, GuideloadError, LifeError, shown
from guideload.base.number_text import KINDS, load_in_table, number, signed
from guideload.catalogue.life_target import life_target
from guideload.drive.requirements import drive_requirements
from guideload.life.life import life_of
from guideload.machine.machine import Machine
from guideload.reports.life import unverified_lines
from guideload.reports.report import Column, Definitions, Report, Section, Table, warnings_by_title
from guideload.simulation.result import Result

Figure = tuple[str, str, str]

MOST_DIFFERENCES = 30  # rows of the table of differences
MOST_KEYS = 4  # of a product, in its row of this table
MM, STIFFNESS, DAMPING = ("mm", 1e3), ("N/um", 1e-6), ("kN s/m", 1e-3)
UNITS = {"mass": ("kg", 1.0), "length": MM, "width": MM, "x": MM}  # by key, with the factor from SI
UNITS |= {f"stiffness{axis}": STIFFNESS for axis in ("", "_y", "_z")}
UNITS |= {f"damping{axis}": DAMPING for axis in ("", "_y", "_z")}
DEFINITIONS = (
    "Peak: largest resultant of any carriage, and where; dynamic factor: peak over the peak of a static calculation "
    f"with {STATICS}; life: of all carriages together; S0: smallest static safety; drive: largest force "
    "of the drive; mode 1: lowest natural frequency. In brackets: change against the first row."
)


@checked
def comparison_report(results: Mapping[str, Result]) -> Report:
    """Differences of the machines, a row of figures per run, and the peaks of each carriage, by title of the run.

    Raises ArgumentError if a machine has no carriages.
    """
    require_carriages(results)
    machines: dict[str, Machine] = {}
    for title, result in results.items():
        if result.machine not in machines.values():
            machines[title] = result.machine
    products = (one for machine in machines.values() for one in machine.product_of_carriage)
    warned = warnings_by_title({title: one.audit.warnings for title, one in results.items()})
    peaks = {title: one.largest_load().size for title, one in results.items()}
    largest = ", ".join(f"{title} {load_in_table(peak)} N" for title, peak in peaks.items())
    alike = ""
    if len(machines) == 1:
        motions = {one.quantities["cart_acceleration"].tobytes() for one in results.values()}
        alike = f"The machines are the same; the motions {'differ' if len(motions) > 1 else 'are, too'}."
    return Report(
        head=next(iter(machines.values())).report.lines,
        title=f"Comparison: {', '.join(results)}",
        answer=[f"Largest loads: {largest}. {alike}".rstrip()],
        warnings=[*warned, *unverified_lines(products)],
        sections=[
            _differences_section(machines),
            Section("Figures", _figures_table(results), Definitions(DEFINITIONS)),
            Section("Peak resultants of the carriages", _peaks_table(results)),
        ],
    )


def require_carriages(results: Mapping[str, Result]) -> None:
    """Raise ArgumentError without results, or if a machine has no carriages, whose loads are compared."""
    if not results:
        raise ArgumentError("results: expected at least one result by its title, got none")
    for title, result in results.items():
        if not result.machine.carriages:
            raise ArgumentError(
                f"{title}: expected a machine with carriages, got links only; compare shows the loads of carriages, "
                "the report of a run those of links"
            )


def _differences_section(machines: Mapping[str, Machine]) -> Section:
    found = [
        (path, [None if value is None else _with_unit(path, value) for value in values])
        for path, values in differences(*machines.values())
    ]
    found += [(path, list(words)) for path, words in product_differences(*machines.values())]
    listed, rest = found[:MOST_DIFFERENCES], len(found) - MOST_DIFFERENCES
    table = Table(
        Column("key", [path for path, _ in listed]),
        *(Column(title, [words[i] for _, words in listed]) for i, title in enumerate(machines)),
    )
    return Section("Differences of the machines", table, f"and {rest} more differences" if rest > 0 else "")


def _with_unit(path: str, value: Any) -> str:
    """A value of a machine as machine files state it: `539 N/um`; numbers of other keys in SI."""
    if path == "life.life":
        return life_target(value).text
    if isinstance(value, bool) or not isinstance(value, int | float):
        return shown(value)
    unit, scale = UNITS.get(path.rpartition(".")[2], ("", 1.0))
    return f"{number(scale * value)} {unit}".rstrip()


def differences(*machines: Machine) -> Iterator[tuple[str, tuple[Any, ...]]]:
    """Keys whose values differ, with the value of each machine; None where a machine does not have the key.

    Parts with a name are matched by it: `carriages[1a].stiffness_y`. Without those of products.
    """
    flat = [
        dict(_values(machine.model_dump(mode="json", exclude={"products", "report"}))) for machine in machines
    ]
    for path in dict.fromkeys(path for values in flat for path in values):
        values = tuple(each.get(path) for each in flat)
        if any(value != values[0] for value in values):
            yield path, values


def product_differences(*machines: Machine) -> Iterator[tuple[str, tuple[str | None, ...]]]:
    """A row for each product whose records differ, with the values that do; None where a machine lacks it."""
    of_machines = [
        {one.name: dict(_values(one.model_dump(mode="json"))) for one in machine.products}
        for machine in machines
    ]
    for name in dict.fromkeys(name for products in of_machines for name in products):
        records = [products.get(name) for products in of_machines]
        known = [one for one in records if one is not None]
        keys = dict.fromkeys(key for values in known for key in values)
        differing = [key for key in keys if any(values.get(key) != known[0].get(key) for values in known)]
        if differing or None in records:
            words = (None if one is None else _short(one, differing) for one in records)
            yield f"products[{name}]", tuple(words)


def _short(values: dict[str, Any], keys: list[str]) -> str:
    """The values of some keys of a product in one line: `static 60000.0, mass none`."""
    words = (f"{key} {shown(values[key]) if key in values else 'none'}" for key in keys[:MOST_KEYS])
    more = [f"and {len(keys) - MOST_KEYS} more"] if len(keys) > MOST_KEYS else []
    return ", ".join([*words, *more]) or "has it"


def _values(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _values(inner, f"{path}.{key}" if path else key)
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for i, inner in enumerate(value):
            yield from _values(inner, f"{path}[{inner.get('name', i)}]")
    elif value is not None:
        yield path, value


def _figures_table(results: Mapping[str, Result]) -> Table:
    rows = [_figures(result) for result in results.values()]
    found = dict.fromkeys(figure for row in rows for figure in row)
    return Table(
        Column("run", [*results]),
        *(
            Column(label, [_with_change(rows, i, (label, unit, kind)) for i in range(len(rows))], unit, kind)
            for label, unit, kind in found
        ),
        Column("on", [one.largest_load().name for one in results.values()]),
    )


def _figures(result: Result) -> dict[Figure, float]:
    """The figures of a run that can be computed, by label, unit and kind of quantity."""
    largest = result.largest_load()
    factor = float(result.audit.simpler_models.dynamic_factor[largest.index])
    row: dict[Figure, float] = {
        ("peak", "N", "load"): largest.size,
        ("dynamic factor", "", "4 digits"): factor,
    }
    if any(result.machine.product_of_carriage):
        try:
            life = life_of(result)
            row |= {("life", "h", "hours"): life.hours(life.machine), ("life", "km", "life"): life.machine}
            row |= {("S0", "", "factor"): life.weakest.static.safety}
        except LifeError:
            pass  # the report of a run says why
    try:
        row["drive", "N", "load"] = drive_requirements(result).peak_force
    except GuideloadError:
        pass  # no velocity: the report of a run says so
    if result.modes.frequency.size:
        row["mode 1", "Hz", "4 digits"] = float(result.modes.frequency.min())
    return row


def _with_change(rows: Sequence[dict[Figure, float]], i: int, figure: Figure) -> str:
    """A figure of a run, and how much it differs from that of the first run."""
    value, first = rows[i].get(figure), rows[0].get(figure)
    if value is None:
        return ""
    change = f" ({signed(100.0 * (value / first - 1.0), '1 decimal')} %)" if i and first else ""
    return KINDS[figure[2]](value) + change


def _peaks_table(results: Mapping[str, Result]) -> Table | None:
    """A row per carriage; none if the runs have different carriages."""
    names = [[carriage.name for carriage in one.machine.carriages] for one in results.values()]
    if any(each != names[0] for each in names):
        return None
    peaks = ((title, one.peak_columns["peak_resultant_N"]) for title, one in results.items())
    columns = (Column(title, values, "N", "load") for title, values in peaks)
    return Table(Column("carriage", names[0]), *columns)
