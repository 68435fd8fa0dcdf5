"""Measured machines against guideload: the rows and pictures of docs/measured.md.

    python tests/benchmarks/measured.py [--files FOLDER] [--pictures] [NAME ...]

The records are not part of the project. They are read from ../shared/data or from FOLDER, into which those that are
missing are fetched; a case whose records cannot be had is skipped with the reason. The cases are in
tests/helpers/measured_cases.py.
"""

from __future__ import annotations

import argparse
import re
import shutil
import tempfile
import urllib.request
from collections.abc import Callable
from operator import attrgetter
from pathlib import Path

import harness
import measured_cases as cases
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from measured_cases import Predicted

from guideload.plots.saving import save
from guideload.plots.style import CARRIAGE_COLORS, GREY, INK, PALE, look, new_figure
from guideload.traces.channels import read_channels

ROOT = Path(__file__).resolve().parents[2]
SHARED, CACHE = ROOT.parent / "shared" / "data", Path.home() / ".cache" / "guideload" / "measured"
AT = "https://raw.githubusercontent.com/"
EMPS = f"{AT}forgi86/sysid-neural-continuous/956aa7ecd73061b0321c6f6098d74c9e4a7ce67a/examples/EMPS/data/"
RACK = f"{AT}KonradMnich/friction-identification/8b477df1747f606c68387096b613b9fae01aa8a6/input/"
SCREW = f"{AT}huangxliang/FdiTools/a8789a12dc4f09698a040d60b3095e17d7b125e8/examples/hres/"
MILL = f"{AT}ejhusom/cnc_milling_tool_wear/6ff00d2a745ab1eb9644c294209f231894173687/data/"
SOURCES = {
    cases.EMPS_SECOND: EMPS,
    "a3MR.csv": RACK,
    "a3NI.csv": RACK,
    **dict.fromkeys(cases.SCREW_RECORDS.values(), SCREW),
    **dict.fromkeys(cases.MILL_LOGS, MILL),
}
MEASURED, PREDICTED = INK, CARRIAGE_COLORS[1]
Row = tuple[str, str, str, str]  # identified, predicted, difference, share inside


def file_in(folder: Path, name: str) -> Path:
    """A record in ../shared/data or in the folder, fetched if it is missing. Raises OSError."""
    same = {f"experiment_{i}.csv": f"michigan_cnc_experiment_{i}.csv" for i in ("01", "18")}
    for place in (SHARED / name, SHARED / same.get(name, name), folder / name):
        if place.is_file():
            return place
    folder.mkdir(parents=True, exist_ok=True)
    if name not in SOURCES:
        raise OSError(f"{name} is neither in {SHARED} nor in {folder}")
    with urllib.request.urlopen(SOURCES[name] + name, timeout=60) as answer:
        (folder / name).write_bytes(answer.read())
    return folder / name


# ---- pictures


def curves(ax: Axes, result: Predicted, unit: str, part: slice = slice(None)) -> None:
    """Measured values, prediction and interval over time; no line leads over times that were left out."""
    columns = np.array([result.time, result.measured, result.value, result.half])[:, part]
    steps = np.diff(columns[0])
    breaks = np.flatnonzero(steps > 5.0 * np.median(steps)) + 1
    time, measured, value, half = np.insert(columns, breaks, np.nan, axis=1)
    ax.fill_between(time, value - half, value + half, color=PREDICTED, alpha=0.2, lw=0, label="95 % interval")
    ax.plot(time, measured, color=MEASURED, lw=0.8, label="measured")
    ax.plot(time, value, color=PREDICTED, lw=1.2, label="predicted")
    ax.set(xlabel="time, s", ylabel=unit)


def differences(ax: Axes, result: Predicted, unit: str) -> None:
    """Difference of the prediction from the measured values, and the interval."""
    ax.fill_between(result.time, -result.half, result.half, color=PREDICTED, alpha=0.25, lw=0)
    ax.plot(result.time, result.measured - result.value, ".", color=MEASURED, ms=1.5)
    ax.set(xlabel="time, s", ylabel=f"measured less predicted, {unit}")


def two(title: str) -> tuple[Figure, Axes, Axes]:
    figure = new_figure(10.0, 3.6)
    figure.suptitle(title, x=0.01, ha="left")
    left, right = figure.subplots(1, 2)
    return figure, left, right


def within(result: Predicted, low: float, high: float) -> slice:
    return slice(*np.searchsorted(result.time, [low, high]).tolist())


# ---- the cases: a row of the table, and the axes of a picture


def percent(share: float) -> str:
    return f"{100 * share:.0f} %"


def off(result: Predicted, unit: str, digits: int = 1) -> str:
    return f"{result.rms:.{digits}f} {unit} rms, {percent(result.relative)}"


def emps_halves(folder: Path) -> tuple[Row, Axes]:
    found, result = cases.emps_halves(folder)
    mass = found.estimates[0]
    _, left, right = two("Ball screw axis: force of the second half by numbers from the first")
    curves(left, result, "force, N", within(result, 18.0, 21.0))
    left.legend(loc="upper right", ncols=3)
    differences(right, result, "N")
    row = (
        f"mass {mass.value:.2f} kg ({mass.low:.2f} to {mass.high:.2f}), friction, offset",
        "drive force",
        off(result, "N"),
        percent(result.inside),
    )
    return row, left


def emps_pulses(folder: Path) -> tuple[Row, Axes]:
    found, result, after = cases.emps_pulses(folder)
    mass = found.estimates[0]
    _, left, right = two("Ball screw axis: force of a second record, with pulses, by numbers from the first")
    curves(left, result, "force, N", within(result, 2.2, 3.2))
    left.legend(loc="lower left", ncols=3)
    differences(right, result, "N")
    right.plot(
        result.time[after],
        (result.measured - result.value)[after],
        ".",
        color=CARRIAGE_COLORS[0],
        ms=2,
        label=f"within {1e3 * cases.AFTER_PULSE:.0f} ms after an edge of a pulse",
    )
    right.legend(loc="upper right", markerscale=4)
    inside = result.is_inside
    shares = f"{percent(inside[after].mean())} after pulses, {percent(inside[~after].mean())} elsewhere"
    share = f"{percent(result.inside)}: {shares}"
    row = (
        f"mass {mass.value:.2f} kg ({mass.low:.2f} to {mass.high:.2f}), friction, offset",
        "drive force of a second record",
        off(result, "N"),
        share,
    )
    return row, left


def emps_acceleration(folder: Path) -> tuple[Row, Axes]:
    band, both = cases.emps_acceleration(folder)
    _, left, right = two("Ball screw axis: acceleration from the encoder alone, against force over mass")
    curves(left, both, "acceleration, m/s²", within(both, 1.15, 1.6))
    differences(right, both, "m/s²")
    right.fill_between(
        band.time, -band.half, band.half, color=GREY, alpha=0.8, lw=0, label="band of the encoder alone"
    )
    left.legend(labels=["95 % interval", "force over mass", "from the encoder"], loc="upper right")
    right.set_ylabel("force over mass less encoder, m/s²")
    right.legend(loc="upper right")
    share = f"{percent(both.inside)} with the scatter of the force, {percent(band.inside)} without"
    return ("nothing", "acceleration, from positions", off(both, "m/s²", 3), share), left


def rack(folder: Path) -> tuple[Row, Axes]:
    mass, delay, result = cases.rack(folder)
    _, left, right = two("Rack axis: force in the load cell while braking, by numbers from speeding up")
    curves(left, result, "force, N")
    left.legend(loc="lower right")
    differences(right, result, "N")
    row = (
        f"friction; of the whole stroke mass {mass.value:.1f} kg ({mass.low:.1f} to {mass.high:.1f}), printed "
        f"{cases.RACK_MASS}; delay of the clocks {-1e3 * delay.value:.1f} ms",
        "force of braking",
        f"{off(result, 'N')}; mean {(result.value - result.measured).mean():.1f} N",
        percent(result.inside),
    )
    return row, left


def screw(folder: Path) -> tuple[Row, Axes]:
    _, *panels = two("Ball screw axis: resonance of the table on its drive, from motion below half of it")
    numbers, predictions, shares = [], [], []
    for ax, (name, file) in zip(panels, cases.SCREW_RECORDS.items(), strict=True):
        one = cases.screw(folder, file)
        value, low, high = one.natural
        ax.axvspan(cases.SCREW_LINES[0], cases.SCREW_HIGHEST, color=PALE, lw=0)
        ax.text(26, 0.2, "identified here", color=INK, ha="center")
        ax.fill_between(one.frequency, one.low, one.high, color=PREDICTED, alpha=0.25, lw=0)
        ax.loglog(one.frequency, one.measured, color=MEASURED, lw=0.9, label="measured")
        ax.loglog(one.frequency, one.value, color=PREDICTED, label="predicted, 95 % interval")
        ax.set(title=name, xlabel="frequency, Hz", ylabel="acceleration of table over motor", ylim=(1e-1, 30))
        ax.minorticks_off()
        ax.set_xticks([20, 50, 100, 200], ["20", "50", "100", "200"])
        numbers.append(f"{value:.1f} Hz ({low:.1f} to {high:.1f})")
        predictions.append(f"{one.peak:.0f} Hz, {100 * (value / one.peak - 1):+.0f} %")
        shares.append(percent(one.inside))
    panels[1].legend(loc="upper left")
    row = (
        f"stiffness and damping of the drive from {cases.SCREW_LINES[0]} to {cases.SCREW_HIGHEST} Hz",
        f"natural frequency {' and '.join(numbers)}; response up to {cases.SCREW_UP_TO} Hz",
        f"peak at {' and '.join(predictions)}",
        f"{' and '.join(shares)} of the lines from {cases.SCREW_HIGHEST} to {cases.SCREW_UP_TO} Hz",
    )
    return row, panels[0]


def mill(folder: Path) -> tuple[Row, Axes]:
    by_axis = {name: cases.mill(folder, name) for name in ("X", "Y")}
    _, left, right = two("CNC mill, axis Y: current by friction from the first half of log 1")
    for ax, result, title in zip(
        (left, right), by_axis["Y"], ("second half of log 1", "log 18, worn tool"), strict=True
    ):
        curves(ax, result, "current, A", slice(60, 160))
        ax.set_title(title)
    left.legend(loc="upper right", ncols=3)
    errors, shares = (
        [f"{name} {' and '.join(percent(of(one)) for one in pair)}" for name, pair in by_axis.items()]
        for of in (attrgetter("relative"), attrgetter("inside"))
    )
    row = (
        "friction",
        "current of the second half, and of log 18",
        ", ".join(errors),
        ", ".join(shares),
    )
    return row, left


def mill_logs(folder: Path) -> tuple[Row, Axes]:
    """How many logs are refused; the picture shows positions of one against the integral of its speed."""
    counts = {}
    for name in cases.MILL_LOGS:
        text = cases.refusal(folder / name)
        found = re.search(r"\((\d+) in all\)", text)
        counts[name] = int(found[1]) if found else 0
    log = read_channels(
        folder / cases.MILL_LOGS[1], {"X1_ActualPosition": None, "X1_ActualVelocity": None}, rate=10
    )
    part = log.time < 40.0
    _, left, right = two("CNC mill: why 17 of 18 logs are refused")
    place, speed = log.values[part].T
    left.plot(log.time[part], place, ".", color=MEASURED, ms=3, label="position as logged")
    travel = place[0] + np.concatenate([[0.0], np.cumsum(0.05 * (speed[1:] + speed[:-1]))])
    left.plot(log.time[part], travel, color=PREDICTED, label="integral of the logged speed")
    left.set(title="log 2", xlabel="time, s", ylabel="X, mm")
    left.legend()
    right.bar(range(1, 19), counts.values(), color=PREDICTED)
    right.set(xlabel="log", ylabel="rows where position and speed contradict", xticks=range(1, 19))
    bad = sum(count > 0 for count in counts.values())
    row = ("nothing", "whether position and speed agree", f"{bad} of {len(counts)} logs refused", "")
    return row, left


CASES: dict[str, tuple[Callable[[Path], tuple[Row, Axes]], tuple[str, ...]]] = {
    "emps-halves": (emps_halves, (cases.EMPS_FIRST,)),
    "emps-pulses": (emps_pulses, (cases.EMPS_FIRST, cases.EMPS_SECOND)),
    "emps-acceleration": (emps_acceleration, (cases.EMPS_FIRST,)),
    "rack": (rack, ("a3MR.csv", "a3NI.csv")),
    "screw": (screw, tuple(cases.SCREW_RECORDS.values())),
    "mill": (mill, ("michigan_cnc_experiment_01.csv", "michigan_cnc_experiment_18.csv")),
    "mill-logs": (mill_logs, cases.MILL_LOGS),
}


def run() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--files", type=Path, default=CACHE, help="folder of the records (%(default)s)")
    parser.add_argument("--pictures", action="store_true", help="write docs/images/measured-NAME.png")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"cases: {', '.join(CASES)}")
    asked = parser.parse_args()
    print(harness.heading("case", "identified", "predicted", "difference", "inside 95 %", words=5))
    for name in asked.names or CASES:
        case, files = CASES[name]
        with tempfile.TemporaryDirectory() as folder, look():
            try:
                for file in files:
                    shutil.copy(file_in(asked.files, file), Path(folder) / file)
            except OSError as error:
                print(harness.row(name, f"skipped: {error}", "", "", ""))
                continue
            row, ax = case(Path(folder))
            print(harness.row(name, *row), flush=True)
            if asked.pictures:
                save(ax, ROOT / "docs" / "images" / f"measured-{name}.png")


if __name__ == "__main__":
    run()
