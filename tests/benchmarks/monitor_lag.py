"""How much lag costs a load monitor how much error: `python tests/benchmarks/monitor_lag.py` (about a minute).

Designs a monitor of the packaged example at 1 kHz for each lag and quantum, as `guideload monitor build` does, and
writes the table in docs/how-to/monitor.md and the picture docs/images/monitor-lag.png.
"""

from __future__ import annotations

from pathlib import Path

import harness

from guideload import Machine, motion_from_trace, read_trace
from guideload.cli.inputs import EXAMPLES
from guideload.monitor import Design, MonitorSettings, designed
from guideload.plots.style import CARRIAGE_COLORS, look, new_figure

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "how-to" / "monitor.md"
PICTURE = ROOT / "docs" / "images" / "monitor-lag.png"

PERIOD, MOST = 1e-3, 20.0  # s; m/s2
LAGS = (0, 5, 10, 20, 50)  # samples
QUANTA = (0.05, 1.0, 5.0, 20.0, 80.0)  # um

Designs = dict[tuple[float, int], Design]


def main() -> None:
    """Design all monitors, and write table and picture."""
    machine = Machine.from_toml(EXAMPLES / "manipulator.toml")
    motion = motion_from_trace(read_trace(EXAMPLES / "manipulator.csv"), machine.drive)
    designs: Designs = {}
    for quantum in QUANTA:
        for lag in LAGS:
            settings = MonitorSettings(
                period=PERIOD, travel_per_count=1e-6 * quantum, lag=lag, max_acceleration=MOST
            )
            designs[quantum, lag] = designed(machine, motion, settings)
    lines = table(designs)
    print(lines)
    harness.write_block(PAGE, "errors by lag", lines)
    draw(designs)


def table(designs: Designs) -> str:
    """The table of the page: error of the peaks, in brackets the rms error of the loads."""
    rows = [f"| quantum | lag {' | '.join(map(str, LAGS))} samples |", "|---" * (1 + len(LAGS)) + "|"]
    for quantum in QUANTA:
        cells = (designs[quantum, lag] for lag in LAGS)
        texts = [f"{100 * one.peak_error:.1f} % ({one.load_error:.0f} N)" for one in cells]
        rows.append(f"| {quantum:g} µm | {' | '.join(texts)} |")
    return "\n".join(rows)


def draw(designs: Designs) -> None:
    """The picture: errors over lag, a line per quantum."""
    panels = (
        ("error of the peak loads, %", lambda one: 100.0 * one.peak_error),
        ("rms error of the loads, N", lambda one: one.load_error),
    )
    with look():
        figure = new_figure(10.0, 4.0)
        for ax, (label, error) in zip(figure.subplots(1, 2), panels, strict=True):
            for quantum, color in zip(QUANTA, (*CARRIAGE_COLORS, "0.5"), strict=False):
                values = [error(designs[quantum, lag]) for lag in LAGS]
                ax.plot(range(len(LAGS)), values, "o-", color=color, label=f"{quantum:g} µm")
            ax.set(yscale="log", xlabel="lag, samples of 1 ms", ylabel=label)
            ax.set_xticks(range(len(LAGS)), map(str, LAGS))
        ax.legend(title="travel per count", loc="upper left", bbox_to_anchor=(1.02, 1.0))
        figure.savefig(PICTURE, dpi=110)


if __name__ == "__main__":
    main()
