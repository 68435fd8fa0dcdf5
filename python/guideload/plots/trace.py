"""The picture of a trace: its samples and the motion found in them, over time and over frequency."""

from __future__ import annotations

from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.ticker import LogLocator, NullFormatter, NullLocator, StrMethodFormatter

from guideload.audit.checks import uniform
from guideload.motion.uncertainty import COVER
from guideload.plots.spectrum import octave_bands
from guideload.plots.style import CARRIAGE_COLORS, GREY, INK, PALE, look, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from guideload.traces.inspection import Inspection

    Array = NDArray[np.float64]

ESTIMATE, BAND_END = CARRIAGE_COLORS[0], CARRIAGE_COLORS[1]
BAND = "#b3d4ea"  # the 95 % band around the estimate
NOT_EXCITED = (0, (2, 3))  # dashes
STAMPS = {
    "uniform": "evenly stamped",
    "ticks": "stamped in ticks",
    "jitter": "stamps jitter",
    "on_change": "a log on change",
}
COLUMNS = 1500  # of the picture that hold samples: more of them are drawn as the range of each column
SEPARATE = 400  # up to so many samples each is a dot
CLOSE_PERIODS, CLOSE_SAMPLES = 3.0, 40.0  # to either side in the closer look: at the band's end, or samples
ROOM = 0.12  # above and below the band, of its range
TITLE = 88  # letters in a line
SMALLEST = 1e-4  # amplitude that is drawn, of the largest


def encoder(inspection: Inspection) -> list[Axes]:
    """A trace over time: its samples, what the smoothing left over, the acceleration; below a closer look, and spectra.

    Returns the five axes in that order. The 95 % band of the acceleration is drawn where the smoothing tells one, the
    natural frequencies where the inspection has a machine. Of a long trace the range in every column is drawn.
    """
    with look():
        figure = new_figure(10.0, 10.8)
        title = f"{inspection.trace.source}, column {inspection.trace.column}"
        if inspection.machine is not None and inspection.resolution is not None:
            told = f"{inspection.machine.name}: sudden changes are shown {inspection.resolution.text}"
            title = f"{title}\n{fill(told, TITLE)}"
        figure.suptitle(title, parse_math=False)
        grid = figure.add_gridspec(4, 2, height_ratios=(1.0, 0.6, 1.25, 1.35), width_ratios=(1.0, 1.8))
        first = figure.add_subplot(grid[0, :])
        axes = [first, *(figure.add_subplot(grid[row, :], sharex=first) for row in (1, 2))]
        axes += [figure.add_subplot(grid[3, column]) for column in (0, 1)]
        _draw_samples(axes[0], inspection)
        _draw_rest(axes[1], inspection)
        _draw_acceleration(axes[2], inspection)
        _draw_closely(axes[3], inspection)
        _draw_spectrum(axes[4], inspection)
        for ax in axes[:2]:
            ax.tick_params(labelbottom=False)
        for ax in axes[2:4]:
            ax.set_xlabel("time [s]")
        figure.align_ylabels(axes[:4])
    return axes


def density(time: Array, acceleration: Array) -> tuple[Array, Array]:
    """One-sided power spectral density of an acceleration (n,) m/s2 at time (n,) s, in bands of 1/12 octave.

    The record is taken whole and with a Hann window, for its ends may differ; uneven steps are interpolated to the
    median one. Returns frequency (band,) [Hz] and density (band,) [(m/s2)²/Hz].
    """
    step, values = uniform(time, acceleration - acceleration.mean())
    window = np.hanning(values.size + 2)[1:-1]
    transform = np.fft.rfft(values * window)[1:]
    power = 2.0 * step * np.abs(transform) ** 2 / float(window @ window)
    frequency = np.arange(1, power.size + 1) / (values.size * step)
    centers, means, _ = octave_bands(frequency, power[:, None])
    return centers, means[:, 0]


def thinned(time: Array, *histories: Array) -> tuple[Array, list[tuple[Array, Array]]]:
    """Histories (n,) as columns of a picture: time of each, and smallest and largest value of each history in it.

    Short histories have a column per sample.
    """
    each = -(-time.size // COLUMNS)
    starts = np.arange(0, time.size, each)
    ranges = [
        (np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)) for values in histories
    ]
    return time[starts], ranges


def _draw(ax: Axes, time: Array, values: Array, **style: Any) -> None:
    """A line, through the smallest and the largest value of each column of the picture."""
    if time.size > COLUMNS:
        columns, [(low, high)] = thinned(time, values)
        time, values = np.repeat(columns, 2), np.column_stack([low, high]).ravel()
    ax.plot(time, values, **style)


def _as_dots(inspection: Inspection, width: float) -> dict[str, Any]:
    """The style of samples: dots where they are few, else a line."""
    if inspection.time.size <= SEPARATE:
        return {"linestyle": "", "marker": "o", "markersize": 2.5}
    return {"linewidth": width}


def _draw_samples(ax: Axes, inspection: Inspection) -> None:
    (unit, factor), time = inspection.unit, inspection.time
    style = _as_dots(inspection, 2.4)
    _draw(ax, time, factor * inspection.value, color=GREY, alpha=0.8, label="samples", **style)
    _draw(ax, time, factor * inspection.smoothed, color=ESTIMATE, linewidth=1.0, label="smoothed")
    ax.set_ylabel(f"{'motor speed' if inspection.of_motor else inspection.kind} [{unit}]")
    rate = f"{time.size} at {1 / inspection.step:.4g} Hz, {STAMPS[inspection.trace.clock]}"
    quantum = (
        f"quantum {factor * inspection.quantum:.3g} {unit}" if inspection.quantum else "no quantum found"
    )
    ax.set_title(f"Samples: {rate}; {quantum}")
    _legend_above(ax, 2)


def _draw_rest(ax: Axes, inspection: Inspection) -> None:
    unit, factor = inspection.unit
    rest, told = inspection.value - inspection.smoothed, ""
    if inspection.quantum > 0.0:
        rest, unit = rest / inspection.quantum, "quanta"
        told = "; of rounding alone 0.29, between the dashed lines"
        for edge in (-0.5, 0.5):
            ax.axhline(edge, color=BAND_END, linewidth=0.9, linestyle=(0, (4, 3)), zorder=3)
    else:
        rest = factor * rest
    _draw(ax, inspection.time, rest, color=INK, **_as_dots(inspection, 0.6))
    ax.set_title(f"Samples − smoothed: {np.sqrt(np.mean(rest**2)):.2g} {unit} rms{told}")
    ax.set_ylabel(f"rest [{unit}]")


def _draw_acceleration(ax: Axes, inspection: Inspection, part: slice = slice(None)) -> None:
    """The acceleration in a part of the trace, its band, and behind it plain differences, cut to the band's range."""
    time, acceleration = inspection.time[part], inspection.found.acceleration[part]
    differences = inspection.differences[part]
    low = high = acceleration
    if inspection.deviation is not None:
        half = COVER * inspection.deviation[part]
        low, high = acceleration - half, acceleration + half
        columns, [(lower, _), (_, upper)] = thinned(time, low, high)
        ax.fill_between(columns, lower, upper, color=BAND, linewidth=0.5, label="95 % band", zorder=2)
    whole = time.size == inspection.time.size
    behind: dict[str, Any] = (
        {"linewidth": 0.8} if whole else {"linestyle": "", "marker": ".", "markersize": 3.0}
    )
    _draw(ax, time, differences, color=PALE if whole else GREY, label="plain differences", zorder=1, **behind)
    _draw(ax, time, acceleration, color=ESTIMATE, linewidth=1.0 if whole else 1.4, label="smoothed")
    room = ROOM * float(high.max() - low.min()) or 1.0
    ax.set_ylim(float(low.min()) - room, float(high.max()) + room)
    unit = _with_superscript(inspection.acceleration_unit)
    ax.set_ylabel(f"acceleration [{unit}]")
    if whole:
        ax.set_title(f"Acceleration: largest {np.abs(acceleration).max():.4g} {unit}{_band_text(inspection)}")
        _legend_above(ax, 3)


def _band_text(inspection: Inspection) -> str:
    """Half the width of the 95 % band at the largest acceleration, and as a median: most bands are thin."""
    if inspection.deviation is None:
        return ""
    half = COVER * inspection.deviation
    at = int(np.abs(inspection.found.acceleration).argmax())
    return f" ±{half[at]:.2g}, usually ±{float(np.median(half)):.2g}"


def _draw_closely(ax: Axes, inspection: Inspection) -> None:
    """The acceleration around its largest value."""
    time = inspection.time
    at = float(time[np.abs(inspection.found.acceleration).argmax()])
    finest = CLOSE_SAMPLES * inspection.step
    half = finest if np.isinf(inspection.band) else max(CLOSE_PERIODS / inspection.band, finest)
    start, stop = np.searchsorted(time, [at - half, at + half])
    _draw_acceleration(ax, inspection, slice(int(start), int(stop)))
    ax.set_title("Around the largest")


def _draw_spectrum(ax: Axes, inspection: Inspection) -> None:
    lines = (
        (inspection.differences, GREY, 1.0, "plain differences"),
        (inspection.found.acceleration, ESTIMATE, 1.6, "smoothed"),
    )
    for values, color, width, label in lines:
        frequency, power = density(inspection.time, values)
        ax.plot(frequency, np.sqrt(power), color=color, linewidth=width, label=label)
    amplitudes = np.concatenate([np.asarray(line.get_ydata(), float) for line in ax.lines])
    low, high, top = float(frequency[0]), float(frequency[-1]), float(amplitudes.max())
    if inspection.modes is not None:
        high = max(high, 1.15 * float(inspection.modes.frequency.max()))
    ax.set(xscale="log", xlabel="frequency [Hz]", xlim=(low, high), title="Spectrum")
    ax.set_ylabel(f"acceleration [{_with_superscript(inspection.acceleration_unit)}/√Hz]")
    if top > 0.0:
        bottom = float(amplitudes[amplitudes > 0.0].min())
        ax.set(yscale="log", ylim=(max(0.5 * bottom, SMALLEST * top), 3.0 * top))
    ax.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.xaxis.set_minor_locator(LogLocator(subs=range(2, 10)))
    if low < inspection.band < high:
        ax.axvspan(inspection.band, high, color=PALE, alpha=0.35, linewidth=0, zorder=0)
        ax.axvline(
            inspection.band,
            color=BAND_END,
            linewidth=1.2,
            label=f"sudden changes shown, to {inspection.band:.3g} Hz",
        )
    if inspection.resolution is not None:
        _mark_modes(ax, inspection.resolution.frequency, inspection.resolution.participating)
        ax.plot([], [], color=INK, linewidth=0.9, alpha=0.7, label="mode, excited by x")
        ax.plot([], [], color=INK, linewidth=0.9, alpha=0.7, linestyle=NOT_EXCITED, label="mode, not excited")
    ax.legend(loc="best", frameon=True, facecolor="white", edgecolor="none", framealpha=0.9)


def _mark_modes(ax: Axes, frequencies: Array, taking_part: NDArray[np.bool_]) -> None:
    """Lines at the natural frequencies, numbered on the upper edge; neighbours share a label."""
    for frequency, takes_part in zip(frequencies, taking_part, strict=True):
        style = "-" if takes_part else NOT_EXCITED
        ax.axvline(frequency, color=INK, linewidth=0.9, linestyle=style, alpha=0.7, zorder=1.5)
    low, high = ax.get_xlim()
    gap = 0.04 * np.log(high / low)
    groups = np.split(np.arange(frequencies.size), np.flatnonzero(np.diff(np.log(frequencies)) > gap) + 1)
    edge = ax.secondary_xaxis("top")
    edge.xaxis.set_minor_locator(NullLocator())
    edge.set_xticks(
        [float(np.exp(np.log(frequencies[group]).mean())) for group in groups],
        [", ".join(str(mode + 1) for mode in group) for group in groups],
    )
    edge.tick_params(length=0)
    edge.spines["top"].set_visible(False)


def _legend_above(ax: Axes, columns: int) -> None:
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=columns, borderaxespad=0.2)


def _with_superscript(unit: str) -> str:
    return unit.replace("2", "²")
