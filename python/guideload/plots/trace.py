"""Picture of a trace: samples and estimated motion over time, and spectra."""

from __future__ import annotations

from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from guideload.audit.figures import uniform
from guideload.base.arguments import checked
from guideload.base.arrays import Array
from guideload.base.visible_text import visible
from guideload.motion.resolution import TraceResolution
from guideload.motion.uncertainty import COVER
from guideload.plots.long_records import columns, extremes
from guideload.plots.spectra import label_modes, octave_bands, power_density, set_frequency_ticks
from guideload.plots.style import CARRIAGE_COLORS, GREY, INK, PALE, legend_above, look, new_figure
from guideload.traces.inspection import Inspection

ESTIMATE, BAND_END = CARRIAGE_COLORS[0], CARRIAGE_COLORS[1]
BAND = "#b3d4ea"  # the 95 % band around the estimate
ROUNDING_DASHES, NOT_EXCITED_DASHES = (0, (4, 3)), (0, (2, 3))
DOTS = 400  # samples up to which each is drawn as a dot
CLOSE_PERIODS, CLOSE_SAMPLES = 3.0, 40.0  # half width of the closer look, the larger counts
MARGIN = 0.12  # above and below the band, over its range
TITLE = 88  # characters in a line of the title
SMALLEST = 1e-4  # smallest amplitude in the picture, over the largest


@checked
def encoder(inspection: Inspection) -> list[Axes]:
    """A trace over time: samples, residual of the smoothing, acceleration; below, a closer look and spectra.

    Returns the five axes in that order. The 95 % band of the acceleration is drawn if the smoothing estimates it, the
    natural frequencies if the inspection has a machine.
    """
    with look():
        figure = new_figure(10.0, 10.8)
        title = f"{inspection.trace.source}, column {inspection.trace.column}"
        if inspection.machine is not None and inspection.resolution is not None:
            subject = "" if np.isinf(inspection.resolution.bandwidth) else "the trace "
            machine = f"{inspection.machine.name}: {subject}{inspection.resolution.text}"
            title = f"{title}\n{fill(machine, TITLE)}"
        figure.suptitle(visible(title), parse_math=False)
        grid = figure.add_gridspec(4, 2, height_ratios=(1.0, 0.6, 1.25, 1.35), width_ratios=(1.0, 1.8))
        first = figure.add_subplot(grid[0, :])
        axes = [first, *(figure.add_subplot(grid[row, :], sharex=first) for row in (1, 2))]
        axes += [figure.add_subplot(grid[3, column]) for column in (0, 1)]
        drawings = (_draw_samples, _draw_residual, _draw_acceleration, _draw_closely, _draw_spectrum)
        for ax, draw in zip(axes, drawings, strict=True):
            draw(ax, inspection)
        for ax in axes[:2]:
            ax.tick_params(labelbottom=False)
        for ax in axes[2:4]:
            ax.set_xlabel("time [s]")
        figure.align_ylabels(axes[:4])
    return axes


def density(time: Array, acceleration: Array) -> tuple[Array, Array]:
    """One-sided power spectral density of an acceleration (n,) m/s2 at time (n,) s, in bands of 1/12 octave.

    The whole record has one Hann window, as its ends may differ; samples that are not uniform are interpolated to the
    median step. Returns frequency (band,) [Hz] and density (band,) [(m/s2)²/Hz].
    """
    step, values = uniform(time, acceleration - acceleration.mean())
    window = np.hanning(values.size + 2)[1:-1]
    window /= np.sqrt(np.mean(window**2))
    centers, means, _ = octave_bands(*power_density(step, (values * window)[:, None]))
    return centers, means[:, 0]


def _draw(ax: Axes, time: Array, values: Array, **style: Any) -> None:
    """A line; for long histories, through the smallest and the largest value in each column of the picture."""
    shown = np.unique(extremes(values, columns(time.size)))
    ax.plot(time[shown], values[shown], **style)


def _draw_each(ax: Axes, time: Array, values: Array, width: float, **style: Any) -> None:
    """Dots for up to DOTS samples, else a line."""
    dots = {"linestyle": "", "marker": "o", "markersize": 2.5}
    _draw(ax, time, values, **style, **(dots if time.size <= DOTS else {"linewidth": width}))


def _draw_samples(ax: Axes, inspection: Inspection) -> None:
    (unit, factor), time = inspection.unit, inspection.time
    _draw_each(ax, time, factor * inspection.value, 2.4, color=GREY, alpha=0.8, label="samples")
    _draw(ax, time, factor * inspection.smoothed, color=ESTIMATE, linewidth=1.0, label="smoothed")
    ax.set_ylabel(f"{'motor speed' if inspection.of_motor else inspection.kind} [{unit}]")
    quantum = f"{factor * inspection.quantum:.3g} {unit}" if inspection.quantum else "not found"
    rate = f"{time.size} at {1 / inspection.step:.4g} Hz"
    stamps = inspection.trace.clock.replace("_", " ")
    ax.set_title(f"Samples: {rate}, time stamps: {stamps}; quantum {quantum}")
    legend_above(ax, 2)


def _draw_residual(ax: Axes, inspection: Inspection) -> None:
    unit, factor = inspection.unit
    residual, rounding = inspection.value - inspection.smoothed, ""
    if inspection.quantum == 0.0:
        residual = factor * residual
    else:
        residual, unit = residual / inspection.quantum, "quanta"
        rounding = "; rounding alone: 0.29, between the dashed lines"
        for edge in (-0.5, 0.5):
            ax.axhline(edge, color=BAND_END, linewidth=0.9, linestyle=ROUNDING_DASHES, zorder=3)
    _draw_each(ax, inspection.time, residual, 0.6, color=INK)
    ax.set_title(f"Residual, samples − smoothed: {np.sqrt(np.mean(residual**2)):.2g} {unit} rms{rounding}")
    ax.set_ylabel(f"residual [{unit}]")


def _draw_acceleration(ax: Axes, inspection: Inspection, samples: slice = slice(None)) -> None:
    """The acceleration with its band, and behind it plain differences; the vertical axis fits the band."""
    time, acceleration = inspection.time[samples], inspection.kinematics.acceleration[samples]
    low, high, half_width = acceleration, acceleration, ""
    if inspection.deviation is not None:
        half = COVER * inspection.deviation[samples]
        low, high = acceleration - half, acceleration + half
        at = int(np.abs(acceleration).argmax())
        half_width = f" ±{half[at]:.2g}, usually ±{float(np.median(half)):.2g}"  # most bands are thin
        starts = columns(time.size)
        lower, upper = np.minimum.reduceat(low, starts), np.maximum.reduceat(high, starts)
        ax.fill_between(time[starts], lower, upper, color=BAND, linewidth=0.5, label="95 % band", zorder=2)
    is_all = time.size == inspection.time.size
    dots: dict[str, Any] = {"color": GREY, "linestyle": "", "marker": ".", "markersize": 3.0}
    differences = {"color": PALE, "linewidth": 0.8} if is_all else dots
    _draw(ax, time, inspection.differences[samples], label="plain differences", zorder=1, **differences)
    _draw(ax, time, acceleration, color=ESTIMATE, linewidth=1.0 if is_all else 1.4, label="smoothed")
    margin = MARGIN * float(high.max() - low.min()) or 1.0
    ax.set_ylim(float(low.min()) - margin, float(high.max()) + margin)
    unit = inspection.acceleration_unit.replace("2", "²")
    ax.set_ylabel(f"acceleration [{unit}]")
    if is_all:
        ax.set_title(f"Acceleration: largest {np.abs(acceleration).max():.4g} {unit}{half_width}")
        legend_above(ax, 3)


def _draw_closely(ax: Axes, inspection: Inspection) -> None:
    """The acceleration around its largest value."""
    at = float(inspection.time[inspection.peak])
    # 3 periods of an infinite bandwidth are 0 s.
    half = max(CLOSE_PERIODS / inspection.bandwidth, CLOSE_SAMPLES * inspection.step)
    _draw_acceleration(ax, inspection, slice(*np.searchsorted(inspection.time, [at - half, at + half])))
    ax.set_title("Around the largest acceleration")


def _draw_spectrum(ax: Axes, inspection: Inspection) -> None:
    lines = (
        (inspection.differences, GREY, 1.0, "plain differences"),
        (inspection.kinematics.acceleration, ESTIMATE, 1.6, "smoothed"),
    )
    amplitudes = []
    for values, color, width, label in lines:
        frequency, power = density(inspection.time, values)
        amplitudes.append(np.sqrt(power))
        ax.plot(frequency, amplitudes[-1], color=color, linewidth=width, label=label)
    low, high, top = float(frequency[0]), float(frequency[-1]), float(np.max(amplitudes))
    if inspection.resolution is not None:
        high = max(high, 1.15 * float(inspection.resolution.frequency.max()))
    ax.set(xscale="log", xlabel="frequency [Hz]", xlim=(low, high), title="Spectrum of the acceleration")
    ax.set_ylabel(f"acceleration [{inspection.acceleration_unit.replace('2', '²')}/√Hz]")
    if top > 0.0:
        bottom = float(np.min(amplitudes, where=np.greater(amplitudes, 0.0), initial=top))
        ax.set(yscale="log", ylim=(max(0.5 * bottom, SMALLEST * top), 3.0 * top))
    set_frequency_ticks(ax)
    if low < inspection.bandwidth < high:
        ax.axvspan(inspection.bandwidth, high, color=PALE, alpha=0.35, linewidth=0, zorder=0)
        label = f"usable bandwidth, {inspection.bandwidth:.3g} Hz"
        ax.axvline(inspection.bandwidth, color=BAND_END, linewidth=1.2, label=label)
    if inspection.resolution is not None:
        _mark_modes(ax, inspection.resolution)
    ax.legend(loc="best", frameon=True, facecolor="white", edgecolor="none", framealpha=0.9)


def _mark_modes(ax: Axes, resolution: TraceResolution) -> None:
    """Lines at the natural frequencies, with the numbers of the modes on the upper edge; neighbours share a label."""
    for text, dashes, is_excited in (("excited by x", "-", True), ("not excited", NOT_EXCITED_DASHES, False)):
        style: dict[str, Any] = {"color": INK, "linewidth": 0.9, "linestyle": dashes, "alpha": 0.7}
        for frequency in resolution.frequency[resolution.participating == is_excited]:
            ax.axvline(frequency, zorder=1.5, **style)
        ax.plot([], [], label=f"mode, {text}", **style)
    label_modes(ax, resolution.frequency, lambda group: ", ".join(str(mode + 1) for mode in group))
