"""Pictures of an identification: intervals, correlation, measured against computed modes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from scipy.signal import welch

from guideload.base.arguments import checked
from guideload.base.arrays import Array
from guideload.identification.modal_test import ModalTest
from guideload.identification.next_measurement import RankedMeasurement
from guideload.identification.records import Record
from guideload.identification.response_files import UNITS
from guideload.identification.responses import FrequencyResponses
from guideload.identification.result import Identification
from guideload.identification.unknowns import short_name, usual_unit
from guideload.plots.saving import save_each
from guideload.plots.style import (
    CARRIAGE_COLORS,
    GREY,
    INK,
    PALE,
    drawing,
    legend_above,
    look,
    name_rows,
    new_figure,
    plain,
)

MEASURED, COMPUTED = INK, CARRIAGE_COLORS[0]
MOST_CANDIDATES = 20
MOST_CURVES = 12  # of frequency responses that are drawn
MOST_MODES = 6  # whose shapes are drawn
MOST_RECORDS = 9  # in time that are drawn
MOST_CHANNELS = 4  # of a record that are drawn
PARTS = 8  # of a record, whose spectra are averaged
WRITTEN = 12  # unknowns up to which the correlations are written as numbers


@checked
def identified_numbers(found: Identification, ax: Axes | None = None) -> Axes:
    """Identified numbers with their 95 % intervals, in percent of the machine file's value.

    Grey: before the data. A number that the data do not determine has no dot.
    """
    shown = [100.0]
    with drawing(ax, 8.0, 1.6 + 0.34 * len(found.unknowns)) as ax:
        for i, (one, unknown) in enumerate(zip(found.estimates, found.unknowns, strict=True)):
            scale = 100.0 / unknown.start if unknown.start else 1.0
            before = [unknown.value(unknown.expected + side * 1.96 * unknown.spread) for side in (-1, 1)]
            ax.plot(scale * np.array(before), [i, i], color=PALE, linewidth=9.0, solid_capstyle="butt")
            words, ink = "not identified", GREY
            if one.is_identified:
                low, high = scale * one.low, scale * one.high
                shown += [low, high] if unknown.start else []
                ax.plot([low, high], [i, i], color=COMPUTED, linewidth=3.0)
                ax.plot(scale * one.value, i, "o", color=COMPUTED, markersize=5.0)
                unit, factor = ("", 1.0) if one.unit == "1" else usual_unit(one.unit)
                words, ink = f"{factor * one.low:.4g} to {factor * one.high:.4g} {unit}".rstrip(), INK
            ax.text(1.01, i, words, transform=ax.get_yaxis_transform(), va="center", color=ink)
        if len(shown) > 1:
            ax.set_xlim(min(shown) - 15.0, max(shown) + 15.0)
        ax.axvline(100.0, color=GREY, linewidth=1.0, linestyle=":")
        name_rows(ax, (short_name(one.name) for one in found.estimates))
        ax.set_xlabel("value [% of the machine file's]; grey: known before; bar: 95 % interval")
        ax.set_title(f"{found.nominal.name}: identified numbers", parse_math=False)
    return ax


@checked
def correlation(found: Identification, ax: Axes | None = None) -> Axes:
    """Correlation of the identified numbers. Dark cells: pairs that the data cannot tell apart."""
    names = [plain(short_name(one.name)) for one in found.estimates]
    count = len(names)
    with drawing(ax, 3.2 + 0.5 * count, 2.4 + 0.45 * count) as ax:
        image = ax.imshow(found.correlation, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
        ax.set_xticks(range(count), names, rotation=60, ha="right", rotation_mode="anchor")
        ax.set_yticks(range(count), names)
        ax.grid(visible=False)
        ax.spines[:].set_visible(False)
        if count <= WRITTEN:
            for i, j in np.ndindex(count, count):
                value = found.correlation[i, j]
                ink = "white" if abs(value) > 0.6 else INK
                ax.text(j, i, f"{value:.2f}", ha="center", va="center", color=ink, fontsize=7.5)
        ax.figure.colorbar(image, ax=ax, shrink=0.8)
        ax.set_title("Correlation of the identified numbers")
    return ax


@checked
def modal_test(found: Identification, test: ModalTest | None = None) -> list[Axes]:
    """Measured against computed modes: frequencies and damping ratios, and each shape at the places of the test.

    test: by default the first one of the data. Returns the axes.
    """
    test = test or next(one for one in found.data if isinstance(one, ModalTest))
    pairs = [pair for pair in test.pairs(found.model) if pair.computed is not None]
    shapes = [pair for pair in pairs if test.modes[pair.measured].shape is not None][:MOST_MODES]
    with look():
        figure = new_figure(9.0, 3.2 + 1.5 * len(shapes))
        grid = figure.add_gridspec(1 + len(shapes), 2, height_ratios=[2.6, *[1.5] * len(shapes)])
        axes = [figure.add_subplot(grid[0, i]) for i in range(2)]
        _differences(axes[0], test, found, 0)
        _differences(axes[1], test, found, 1)
        computed = test.computed_shapes(found.model)
        for row, pair in enumerate(shapes, 1):
            ax = figure.add_subplot(grid[row, :], sharex=axes[2] if len(axes) > 2 else None)
            axes.append(ax)
            measured = np.asarray(test.modes[pair.measured].shape)
            shape = computed[pair.computed or 0]
            shape = shape * (shape @ measured) / (shape @ shape) / abs(measured).max()
            places = np.arange(measured.size)
            ax.bar(places - 0.2, measured / abs(measured).max(), 0.38, color=GREY, label="measured")
            ax.bar(places + 0.2, shape, 0.38, color=COMPUTED, label="computed")
            ax.axhline(0.0, color=INK, linewidth=0.8)
            ax.set(xlim=(-0.6, places.size - 0.4), ylim=(-1.3, 1.3))
            frequency = test.modes[pair.measured].frequency
            ax.set_title(
                f"mode {pair.measured + 1}: {frequency:.4g} Hz, computed {pair.frequency:.4g} Hz, MAC {pair.mac:.3f}"
            )
            ax.grid(axis="x", visible=False)
            ax.tick_params(labelbottom=row == len(shapes))
            ax.set_xticks(places, [plain(place.name) for place in test.places])
            if row == 1:
                legend_above(ax, 2)
        figure.suptitle(f"{found.nominal.name}: {test.name}", parse_math=False)
    return axes


def _differences(ax: Axes, test: ModalTest, found: Identification, kind: int) -> None:
    """Measured over computed frequencies (kind 0) or damping ratios (1), with 95 % of the noise."""
    if kind == 1 and all(mode.damping is None for mode in test.modes):
        ax.set_axis_off()
        return
    level = 196.0 * test.levels[kind] * found.noise_factor(test, kind)
    ax.axhline(0.0, color=GREY, linewidth=1.0)
    for pair in test.pairs(found.model):
        mode = test.modes[pair.measured]
        values = ((mode.frequency, pair.frequency), (mode.damping, pair.damping))[kind]
        if values[0] is None or values[1] is None:
            continue
        differs = 100.0 * (values[0] / values[1] - 1.0)
        ax.errorbar(pair.measured + 1, differs, level, fmt="o", color=COMPUTED, capsize=3)
    ax.set_xlim(0.5, len(test.modes) + 0.5)
    ax.set_xticks(range(1, len(test.modes) + 1))
    ax.set(xlabel="measured mode", ylabel="measured over computed - 1 [%]")
    ax.set_title(("Frequencies", "Damping ratios")[kind])


@checked
def measured_responses(found: Identification, data: FrequencyResponses | None = None) -> list[Axes]:
    """Measured against computed frequency responses: the size of each curve over the frequency.

    data: by default the first of the identification. Returns the axes, one for each of the first curves.
    """
    data = data or next(one for one in found.data if isinstance(one, FrequencyResponses))
    curves = data.curves[:MOST_CURVES]
    gain = found.nuisance_values(data)[0] if data.nuisance else 1.0
    with look():
        figure = new_figure(10.0, 0.8 + 2.6 * ((len(curves) + 1) // 2))
        axes: list[Axes] = []
        for i, curve in enumerate(curves):
            ax = figure.add_subplot((len(curves) + 1) // 2, 2, i + 1, sharex=axes[0] if axes else None)
            axes.append(ax)
            computed = gain * abs(curve.computed(found.model)[0])
            ax.plot(curve.frequency, abs(curve.value), ".", color=GREY, markersize=4.0, label="measured")
            ax.plot(curve.frequency, computed, color=COMPUTED, label="computed")
            ax.set(yscale="log", ylabel=f"[{UNITS[curve.derivatives]}]")
            ax.set_title(curve.name, parse_math=False, fontsize=9.5)
            if i >= len(curves) - 2:
                ax.set_xlabel("frequency [Hz]")
        legend_above(axes[0], 2)
        figure.suptitle(f"{found.nominal.name}: {data.name}", parse_math=False)
    return axes


def _record(found: Identification, data: Record) -> Axes:
    """Measured against computed values of a record in time: histories, difference and spectra of each channel."""
    channels = found.record_channels(data)[:MOST_CHANNELS]
    count, time = len(channels), data.window_time
    with look():
        figure = new_figure(10.0, 0.8 + 3.4 * count)
        grid = figure.add_gridspec(2 * count, 2, width_ratios=[2.0, 1.0], height_ratios=[2.0, 1.0] * count)
        for i, (name, unit, measured, predicted) in enumerate(channels):
            above = figure.add_subplot(grid[2 * i, 0])
            below = figure.add_subplot(grid[2 * i + 1, 0], sharex=above)
            beside = figure.add_subplot(grid[2 * i : 2 * i + 2, 1])
            _histories(above, below, time, measured, predicted)
            _spectra(beside, time, measured, predicted)
            above.set_title(plain(f"{name} [{unit}]"), loc="left", parse_math=False)
            if i == 0:
                legend_above(beside, 2)
        below.set_xlabel("time of the record [s]")
        beside.set_xlabel("frequency [Hz]")
        figure.suptitle(f"{found.nominal.name}: {data.name}, measured and computed", parse_math=False)
    return figure.axes[0]


def _histories(above: Axes, below: Axes, time: Array, measured: Array, predicted: Array) -> None:
    gaps = np.flatnonzero(np.diff(time) > 2.0 * np.median(np.diff(time))) + 1  # windows that are left out

    def broken(values: Array) -> Array:
        return np.insert(values, gaps, np.nan)

    above.plot(broken(time), broken(measured), color=GREY, linewidth=1.6)
    above.plot(broken(time), broken(predicted), color=COMPUTED, linewidth=0.8)
    above.tick_params(labelbottom=False)
    below.plot(broken(time), broken(measured - predicted), color=INK, linewidth=0.6)
    below.axhline(0.0, color=GREY, linewidth=0.8)
    below.set_ylabel("difference")


def _spectra(ax: Axes, time: Array, measured: Array, predicted: Array) -> None:
    """Amplitude spectral densities, by Welch's method on a uniform grid."""
    step = float(np.median(np.diff(time)))
    grid = np.arange(time[0], time[-1], step)
    for values, color, width, label in (
        (measured, GREY, 2.0, "measured"),
        (predicted, COMPUTED, 1.0, "computed"),
        (measured - predicted, INK, 0.8, "difference"),
    ):
        even = np.interp(grid, time, values)
        hertz, density = welch(even, 1.0 / step, nperseg=max(grid.size // PARTS, 8))
        ax.loglog(hertz[1:], np.sqrt(density[1:]), color=color, linewidth=width, label=label)
    ax.set_ylabel("amplitude density [unit/√Hz]")


@checked
def next_measurements(
    candidates: Sequence[RankedMeasurement], ax: Axes | None = None, *, figure: str = "all unknowns"
) -> Axes:
    """What each candidate for the next measurement leaves of the interval of the target quantity, best first.

    figure: its name.
    """
    shown = candidates[:MOST_CANDIDATES]
    with drawing(ax, 8.5, 1.4 + 0.3 * len(shown)) as ax:
        shares = [100.0 * one.deviation for one in shown]
        ax.barh(range(len(shown)), shares, 0.6, color=COMPUTED)
        for i, share in enumerate(shares):
            ax.text(share + 1.0, i, f"{share:.3g} %", va="center", fontsize=8.5)
        name_rows(ax, (one.name for one in shown))
        ax.set_xlim(0.0, 112.0)
        ax.axvline(100.0, color=GREY, linewidth=1.0, linestyle=":")
        ax.set_xlabel(f"interval of {plain(figure)} after the measurement [% of the one now]")
        ax.set_title("What to measure next")
    return ax


@checked
def save_identification(
    found: Identification,
    folder: str | Path,
    candidates: Sequence[RankedMeasurement] = (),
    figure: str = "all unknowns",
) -> list[Path]:
    """Save every picture of an identification as PNG in a folder; returns their paths. Raises PictureError.

    candidates: for the next measurement, ranked by a figure with this name.
    """
    drawings: dict[str, Callable[[], Axes]] = {
        "numbers.png": lambda: identified_numbers(found),
        "correlation.png": lambda: correlation(found),
    }
    if any(isinstance(one, ModalTest) for one in found.data):
        drawings["modal_tests.png"] = lambda: modal_test(found)[0]
    if any(isinstance(one, FrequencyResponses) for one in found.data):
        drawings["frequency_responses.png"] = lambda: measured_responses(found)[0]
    in_time = [one for one in found.data if isinstance(one, Record)]
    drawings |= {
        f"record_{number}.png": partial(_record, found, one)
        for number, one in enumerate(in_time[:MOST_RECORDS], start=1)
    }
    if candidates:
        drawings["next_measurements.png"] = lambda: next_measurements(candidates, figure=figure)
    return save_each(drawings, folder)
