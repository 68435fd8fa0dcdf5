"""Spectrum of the dynamic loads, and the frequency axis with natural frequencies that all spectra share."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullFormatter, NullLocator

from guideload.audit.figures import uniform, without_pauses
from guideload.base.arguments import checked
from guideload.base.arrays import Array, Indices, median_step
from guideload.base.errors import ArgumentError
from guideload.base.number_text import digits
from guideload.base.quantities import Quantities
from guideload.plots.style import (
    PALE,
    carriage_look,
    drawing,
    legend_beside,
    plain,
    set_run_title,
    write_instead,
)
from guideload.simulation.result import Result

BANDS_PER_OCTAVE = 12
MOST_EVEN = 1_000_000  # instants of a spectrum
DYNAMIC_RANGE = 1e-6  # smallest amplitude in the picture over the peak: smaller ones are rounding
LABEL_HEIGHT, LABEL_WIDTH = 0.022, 0.04  # of a mode's label, over the length of the frequency axis


@checked
def spectrum(result: Result, ax: Axes | None = None) -> Axes:
    """Spectral density of the dynamic load of every carriage, in N/√Hz over Hz, with the natural frequencies.

    The lines are the square root of `load_density`, averaged in bands of 1/12 octave: the integral of the square of a
    line over a range of frequencies is the mean square of the load in that range.
    """
    data = result.quantities
    with drawing(ax, 9.0, 4.6) as ax:
        set_run_title(ax, result, "Spectrum of the dynamic loads")
        if np.ptp(data["time"]) == 0.0:
            return write_instead(ax, "a single instant has no spectrum")
        frequency, density, _ = octave_bands(*load_density(result))
        amplitude = np.sqrt(density)
        for index, name in enumerate(data["carriage"]):
            color, dash = carriage_look(index)
            # Each line is thinner than the one before, so that equal spectra of symmetric carriages are all visible.
            width = 1.1 + 2.4 * (1 - (index + 1) / data["carriage"].size)
            line = {"color": color, "linestyle": dash, "linewidth": width}
            ax.plot(frequency, amplitude[:, index], label=plain(str(name)), **line)
        ax.set(xscale="log", xlabel="frequency [Hz]", ylabel="dynamic load, y and z together [N/√Hz]")
        top = float(amplitude.max(initial=0.0))
        if top > 0:
            bottom = max(float(amplitude[amplitude > 0].min()), top * DYNAMIC_RANGE)
            ax.set(yscale="log", ylim=(bottom / 2, top * 2))
        set_frequency_ticks(ax)
        label_hertz(ax, mark_modes(ax, result.modes.frequency))
        legend_beside(ax, "carriage")
    return ax


def load_density(result: Result) -> tuple[Array, Array]:
    """One-sided power spectral density of the dynamic load of every carriage.

    The dynamic load is the force minus its static value; the densities of its y and z components are added,
    so that the choice of y and z does not matter. No window is used: the record starts in static equilibrium,
    where the dynamic load is zero (a record that ends far from it leaks as 1/f). Instants that are not uniform are
    first interpolated linearly to the step of `even_step`, which weakens the highest frequencies.

    Returns
    -------
    frequency : ndarray, shape (frequency,) [Hz], from 1/duration up
    density : ndarray, shape (frequency, carriage) [N²/Hz]; its sum times the line spacing is the variance
    """
    data = result.quantities
    if (count := data["time"].size) < 2:
        raise ArgumentError(f"times: expected at least 2 instants for a spectrum, got {count}")
    dynamic = data["force"] - data["static_force"]
    step, force = uniform(data["time"], dynamic[:, :, 1:], even_step(data))
    frequency, density = power_density(step, force)
    return frequency, density.sum(axis=-1)


def even_step(data: Quantities) -> float:
    """The step [s] of even instants that show what the histories of a result do.

    The median one; where instants were put between the samples, the shortest mean of two in a row, so that no vibration
    has another frequency. A single short one is beside a zero of the force of a rack.
    """
    time = data["time"]
    if data.attrs.get("instants") == "given" or data.attrs.get("motion_samples", time.size) >= time.size:
        return median_step(time)
    steps = np.diff(time)
    means = np.convolve(steps[steps > 0.0], (0.5, 0.5), "valid")
    return max(float(means.min()), float(np.ptp(without_pauses(time))) / MOST_EVEN)


def power_density(step: float, values: Array) -> tuple[Array, Array]:
    """Frequencies (frequency,) [Hz] and one-sided power spectral density of values (n, ...) at a uniform step [s]."""
    count = len(values)
    transform = np.fft.rfft(values, axis=0)[1:]
    power = 2 * step / count * (transform.real**2 + transform.imag**2)
    if count % 2 == 0:
        power[-1] /= 2  # the highest frequency of an even count has no negative counterpart
    return np.arange(1, power.shape[0] + 1) / (count * step), np.asarray(power, dtype=np.float64)


def octave_bands(frequency: Array, density: Array) -> tuple[Array, Array, Array]:
    """Mean of a density in bands of 1/12 octave; where lines are sparser, each line is a band.

    Returns frequency (band,) [Hz], density (band, ...) and width (band,) [Hz]. The sum of density times width, the
    mean square of the load, does not change.
    """
    band = np.floor(BANDS_PER_OCTAVE * np.log2(frequency / frequency[0]) + 1e-9)
    starts = np.flatnonzero(np.diff(band, prepend=-1.0))
    lines = np.diff(starts, append=frequency.size)
    centers = np.add.reduceat(frequency, starts) / lines
    means = np.add.reduceat(density, starts, axis=0) / lines[:, None]
    return centers, means, lines * frequency[0]


def set_frequency_ticks(ax: Axes) -> None:
    """Plain numbers at the decades of logarithmic axes, and ticks between them along the frequencies."""
    ax.xaxis.set_minor_locator(LogLocator(subs=range(2, 10)))
    ax.yaxis.set_minor_locator(NullLocator())
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_minor_formatter(NullFormatter())
        if axis.get_scale() == "log":
            axis.set_major_formatter("{x:g}")


def mark_modes(ax: Axes, frequencies: Array) -> Array:
    """Pale lines at the natural frequencies within the axes; returns these, ascending."""
    low, high = ax.get_xlim()
    natural = np.sort(frequencies[(frequencies > low) & (frequencies < high)])
    for value in natural:
        ax.axvline(value, color=PALE, linewidth=1.0, zorder=1)
    return natural


def label_hertz(ax: Axes, natural: Array) -> None:
    """Label ascending natural frequencies with their values."""
    label_modes(ax, natural, lambda group: ", ".join(map(digits, natural[group])) + " Hz", 90)


def label_modes(ax: Axes, frequencies: Array, text: Callable[[Indices], str], rotation: float = 0.0) -> None:
    """Label ascending natural frequencies on the upper edge; text: label for the indices of close neighbours."""
    low, high = ax.get_xlim()
    near = (LABEL_HEIGHT if rotation else LABEL_WIDTH) * np.log(high / low)
    starts = np.flatnonzero(np.diff(np.log(frequencies)) > near) + 1
    groups = np.split(np.arange(frequencies.size), starts) if frequencies.size else []
    places = [float(np.exp(np.log(frequencies[group]).mean())) for group in groups]
    edge = ax.secondary_xaxis("top")
    edge.xaxis.set_minor_locator(NullLocator())
    edge.set_xticks(places, [text(group) for group in groups], rotation=rotation)
    edge.tick_params(length=0)
    edge.spines["top"].set_visible(False)
