"""Pictures over time and frequency: the paper's figures 7 to 11, the resultant loads and their spectrum."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.ticker import LogLocator, NullFormatter, NullLocator, StrMethodFormatter

from guideload.audit.checks import share_of_time, uniform
from guideload.base.numbers import counted, joined, load_with_unit, percent
from guideload.base.units import factor
from guideload.motion.uncertainty import COVER
from guideload.plots.style import (
    GREY,
    INK,
    PALE,
    axes_or_new,
    carriage_look,
    look,
    new_figure,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from guideload.simulation.result import Result

BANDS_PER_OCTAVE = 12
# Parts of the axes' height: a bar that marks lost contact and the gap above it, and what all bars may take.
BAR, BARS = 0.025, 0.2
BAND_ALPHA = 0.25


def motor_speed(result: Result, ax: Axes | None = None) -> Axes:
    """Measured speed of the motor in turns per minute over time (paper, figure 7).

    A motion without motor speed is shown by the cart's velocity along the rails, or else by its acceleration;
    the label says so.
    """
    data = result.data
    if "motor_speed" in data:
        title = "Motor speed"
        values, label = data["motor_speed"].values / factor("rpm", "rad/s"), "motor speed n$_M$ [1/min]"
    elif "cart_velocity" in data:
        title = "Cart velocity (the motion has no motor speed)"
        values, label = data["cart_velocity"].sel(axis="x").values, "cart velocity along x [m/s]"
    else:
        title = "Cart acceleration (the motion has neither motor speed nor velocity)"
        values, label = data["cart_acceleration"].sel(axis="x").values, "cart acceleration along x [m/s²]"
    with look():
        ax = axes_or_new(ax, 7.5, 2.6)
        ax.plot(data["time"].values, values, color=INK)
        ax.axhline(0, color=GREY, linewidth=0.7, zorder=1)
        ax.set(title=title, xlabel="time [s]", ylabel=label)
        _keep_span(ax, values)
    return ax


def load_y(result: Result, carriage: str, ax: Axes | None = None) -> Axes:
    """Force of the body on one carriage along y in newtons over time (paper, figures 8 and 10).

    A bar along the time axis marks where a link of it along y has no contact, or one row open. If the motion
    has an uncertainty, a pale fill is the 95 % band of the load at each instant.
    """
    return _load(result, carriage, "y", ax)


def load_z(result: Result, carriage: str, ax: Axes | None = None) -> Axes:
    """Force of the body on one carriage along z in newtons over time (paper, figures 9 and 11).

    A bar along the time axis marks where a link of it along z has no contact, or one row open. If the motion
    has an uncertainty, a pale fill is the 95 % band of the load at each instant.
    """
    return _load(result, carriage, "z", ax)


def paper_figures(result: Result) -> list[Axes]:
    """The paper's figures 7 to 11 on one sheet: the motor speed, below it the y and z load of each carriage.

    Returns the axes in that order: motor speed, y and z of the first carriage, y and z of the second, ...
    """
    carriages = [str(name) for name in result.data["carriage"].values]
    with look():
        figure = new_figure(12.0, 1.0 + 2.1 * (1 + len(carriages)))
        grid = figure.add_gridspec(1 + len(carriages), 2)
        sheet = [motor_speed(result, figure.add_subplot(grid[0, :]))]
        for row, carriage in enumerate(carriages, start=1):
            sheet.append(load_y(result, carriage, figure.add_subplot(grid[row, 0], sharex=sheet[0])))
            sheet.append(load_z(result, carriage, figure.add_subplot(grid[row, 1], sharex=sheet[0])))
        for ax in sheet[1:-2]:
            ax.set_xlabel("")
        figure.suptitle(_headline(result))
    return sheet


def resultant(result: Result, ax: Axes | None = None) -> Axes:
    """Resultant load sqrt(Fy² + Fz²) of every carriage in newtons over time; static levels as thin lines.

    Bars along the time axis mark where a link of a carriage has no contact, or one row open. If the motion has an
    uncertainty, pale fills are the 95 % bands of the loads at each instant.
    """
    static = result.data["static_force"].sel(axis=["y", "z"]).transpose("carriage", "axis").values
    with look():
        ax = axes_or_new(ax, 9.0, 4.4)
        ax.set_ylabel("√(F$_y$² + F$_z$²) [N]")
        _set_title(ax, result, "Resultant load of the carriages")
        at_rest = np.linalg.norm(static, axis=1)
        _draw_carriages(ax, result, result.data["resultant"].values, at_rest, "resultant_sd", "N")
    return ax


def moments(result: Result, ax: Axes | None = None) -> Axes:
    """Size of the moment about its centre of every carriage in N m over time; static levels as thin lines.

    The two ends of a long carriage take the body's pitch by opposite forces: here is the motion that the sum
    of the carriage's forces does not show. Pale fills: 95 % bands, if the motion has an uncertainty.
    """
    moment = result.data["moment"].transpose("time", "carriage", "axis").values
    static = result.data["static_moment"].transpose("carriage", "axis").values
    with look():
        ax = axes_or_new(ax, 9.0, 4.4)
        ax.set_ylabel("√(M$_x$² + M$_y$² + M$_z$²) [N m]")
        _set_title(ax, result, "Moments of the carriages about their centres")
        sizes, at_rest = np.linalg.norm(moment, axis=2), np.linalg.norm(static, axis=1)
        _draw_carriages(ax, result, sizes, at_rest, "moment_magnitude_sd", "N m")
    return ax


def spectrum(result: Result, ax: Axes | None = None) -> Axes:
    """Spectral density of the dynamic load of every carriage, in N/√Hz over Hz, with the natural frequencies.

    Drawn is the square root of `load_density`, averaged in bands of 1/12 octave: the area under its square
    between two frequencies is the mean square of the load there.
    """
    data = result.data
    if np.ptp(data["time"].values) == 0.0:
        with look():
            ax = axes_or_new(ax, 9.0, 4.6)
            _set_title(ax, result, "Spectrum of the dynamic loads")
            ax.text(0.5, 0.5, "a single instant has none", transform=ax.transAxes, ha="center", color=GREY)
        return ax
    frequency, density = load_density(result)
    frequency, density, _ = octave_bands(frequency, density)
    amplitude = np.sqrt(density)
    with look():
        ax = axes_or_new(ax, 9.0, 4.6)
        for index, name in enumerate(data["carriage"].values):
            color, dash = carriage_look(index)
            # Symmetric carriages have equal spectra: thinner and thinner lines leave covered ones visible.
            width = 1.1 + 2.4 * (1 - (index + 1) / data.sizes["carriage"])
            ax.plot(
                frequency, amplitude[:, index], color=color, linestyle=dash, linewidth=width, label=str(name)
            )
        ax.set(xscale="log", xlabel="frequency [Hz]")
        _set_title(ax, result, "Spectrum of the dynamic loads")
        ax.set_ylabel("dynamic load, y and z together [N/√Hz]")
        top = float(amplitude.max(initial=0.0))
        if top > 0:
            # Six decades below the peak nothing matters, and rounding noise would fill the picture.
            bottom = max(float(amplitude[amplitude > 0].min()), top * 1e-6)
            ax.set(yscale="log", ylim=(bottom / 2, top * 2))
        ax.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        ax.xaxis.set_minor_formatter(NullFormatter())
        ax.xaxis.set_minor_locator(LogLocator(subs=range(2, 10)))
        _mark_modes(ax, result.modes.frequency)
        ax.legend(title="carriage", loc="center left", bbox_to_anchor=(1.0, 0.5), alignment="left")
    return ax


def load_density(result: Result) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """One-sided power spectral density of the dynamic load of every carriage.

    The dynamic load is the force minus its static value; the densities of its y and z components are added,
    so that the choice of y and z does not matter. The record is taken whole and without a window: it starts
    in static equilibrium, where the dynamic load is zero (one that ends far from it leaks as 1/f). Samples
    that are not uniform are first interpolated linearly to the median step: fine enough to read peaks, but
    not exact, since it weakens the highest frequencies.

    Returns
    -------
    frequency : ndarray, shape (frequency,) [Hz], from 1/duration up
    density : ndarray, shape (frequency, carriage) [N²/Hz]; its sum times the line spacing is the variance
    """
    data = result.data
    time = data["time"].values
    force = (
        (data["force"] - data["static_force"])
        .transpose("time", "carriage", "axis")
        .sel(axis=["y", "z"])
        .values
    )
    step, force = uniform(time, force)
    count = len(force)
    transform = np.fft.rfft(force, axis=0)[1:]
    power = 2 * step / count * (transform.real**2 + transform.imag**2).sum(axis=-1)
    if count % 2 == 0:
        power[-1] /= 2  # the highest frequency of an even count has no mirror image to account for
    return np.arange(1, power.shape[0] + 1) / (count * step), np.asarray(power, dtype=np.float64)


def octave_bands(
    frequency: NDArray[np.float64], density: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Mean of a density in bands of 1/12 octave; lines further apart than that stand alone.

    Returns frequency (band,) [Hz], density (band, ...) and width (band,) [Hz]. The sum of density times
    width, the mean square of the load, is kept.
    """
    band = np.floor(BANDS_PER_OCTAVE * np.log2(frequency / frequency[0]) + 1e-9)
    starts = np.flatnonzero(np.diff(band, prepend=-1.0))
    lines = np.diff(starts, append=frequency.size)
    centers = np.add.reduceat(frequency, starts) / lines
    means = np.add.reduceat(density, starts, axis=0) / lines[:, None]
    return centers, means, lines * frequency[0]


def _load(result: Result, carriage: str, axis: str, ax: Axes | None) -> Axes:
    data = result.data
    names = [str(name) for name in data["carriage"].values]
    if carriage not in names:
        raise ValueError(f"no carriage {carriage!r}: the result has {joined(repr(name) for name in names)}")
    color = carriage_look(names.index(carriage)).color
    time = data["time"].values
    load = data["force"].sel(carriage=carriage, axis=axis).values
    static = float(data["static_force"].sel(carriage=carriage, axis=axis))
    peak = int(np.abs(load).argmax())
    with look():
        ax = axes_or_new(ax, 7.5, 2.8)
        ax.plot(time, load, color=color)
        if "force_sd" in data:
            spread = data["force_sd"].sel(carriage=carriage, axis=axis).values
            label = _band_label(spread)
            _fill_band(ax, time, load, spread, color, BAND_ALPHA, label=label)
        ax.axhline(
            static, color=INK, linewidth=0.8, linestyle=(0, (5, 4)), label=f"static {load_with_unit(static)}"
        )
        at_peak = f"peak {load_with_unit(load[peak])} at {time[peak]:.2f} s"
        ax.plot(time[peak], load[peak], "o", color=color, markersize=5, clip_on=False, label=at_peak)
        ax.set(xlabel="time [s]", ylabel=f"load F$_{axis}$ [N]")
        links = result.machine.links_of_carriages[names.index(carriage)]["yz".index(axis) :: 2]
        lost = result.audit.contact.lost_by(links)
        # Peak and static level stand above the axes: in line with a short title if there is no more, else below it.
        in_line = len(carriage) <= 6 and not lost.any() and "force_sd" not in data
        ax.set_title(f"Carriage {carriage}, {axis}", pad=6 if in_line else 22)
        _keep_span(ax, load, float(data["resultant"].max()))
        if lost.any():
            words = result.audit.contact.words(links)
            part = percent(float(share_of_time(time, lost[:, None])[0]))
            _mark_lost(ax, time, lost, color, label=f"{words} {part} of the time")
        ax.legend(
            loc="lower right",
            bbox_to_anchor=(1.0, 1.0),
            ncols=4,
            borderaxespad=0.2,
            columnspacing=1.2,
            handlelength=1.4,
        )
    return ax


def _draw_carriages(
    ax: Axes,
    result: Result,
    loads: NDArray[np.float64],
    static: NDArray[np.float64],
    spread: str,
    unit: str,
) -> None:
    """Lines of every carriage's load (time, carriage), static level (carriage,) and peak, from 0 up.

    spread: name of the loads' standard deviations, of which the result has none if its motion is certain.
    """
    time = result.data["time"].values
    carriages = result.data["carriage"].values
    for index, (name, load) in enumerate(zip(carriages, loads.T, strict=True)):
        color, dash = carriage_look(index)
        # Thinner and thinner lines leave covered ones of symmetric carriages visible.
        width = 1.2 + 1.2 * (1 - (index + 1) / len(carriages))
        label = f"{name}: peak {load_with_unit(load.max(), unit)}"
        ax.plot(time, load, color=color, linestyle=dash, linewidth=width, label=label)
        ax.axhline(static[index], color=color, linewidth=0.9, linestyle=(0, (5, 4)), zorder=1.5)
        peak = int(load.argmax())
        ax.plot(time[peak], load[peak], "o", color=color, markersize=4, clip_on=False)
        if spread in result.data:
            shade = BAND_ALPHA / np.sqrt(len(carriages))  # those of symmetric carriages lie on each other
            _fill_band(ax, time, load, result.data[spread].values[:, index], color, shade)
    if spread in result.data:
        label = _band_label(result.data[spread].values, unit)
        ax.fill_between([], [], [], color=GREY, alpha=BAND_ALPHA, linewidth=0, label=label)
    ax.plot([], [], color=GREY, linewidth=0.9, linestyle=(0, (5, 4)), label="static level")
    ax.set_xlabel("time [s]")
    _keep_span(ax, loads)
    contact, links = result.audit.contact, result.machine.links_of_carriages
    lost = [contact.lost_by(of_carriage) for of_carriage in links]
    marked = [index for index, flags in enumerate(lost) if flags.any()]
    height = min(BAR, BARS / max(len(marked), 1))
    strip = height * len(marked)
    ax.set_ylim(bottom=-strip / (1 - strip) * ax.get_ylim()[1])  # the bars stand below zero
    for place, index in enumerate(reversed(marked)):  # from the axis up, in the legend's order
        _mark_lost(ax, time, lost[index], carriage_look(index).color, place * height, height)
    if marked:
        ax.plot([], [], color=GREY, linewidth=4, label=contact.words(np.concatenate(links)))
    ax.legend(title="carriage", loc="center left", bbox_to_anchor=(1.0, 0.5), alignment="left")


def _band_label(spread: NDArray[np.float64], unit: str = "N") -> str:
    """With its widest place, for most bands are thinner than the line that they lie under."""
    return f"95 % band, up to ±{load_with_unit(COVER * float(spread.max(initial=0.0)), unit)}"


def _fill_band(
    ax: Axes,
    time: NDArray[np.float64],
    load: NDArray[np.float64],
    spread: NDArray[np.float64],
    color: str,
    alpha: float,
    label: str = "",
) -> None:
    """A pale band of 1.96 standard deviations to either side of a load."""
    half = COVER * spread
    ax.fill_between(
        time, load - half, load + half, color=color, alpha=alpha, linewidth=0, zorder=1.8, label=label
    )


def _mark_lost(
    ax: Axes,
    time: NDArray[np.float64],
    lost: NDArray[np.bool_],
    color: str,
    low: float = 0.0,
    height: float = BAR,
    label: str = "",
) -> None:
    """A thin bar along the time axis where contact is lost; low, height: parts of the axes' height, gap included.

    It begins a sample early, so that one that is lost alone shows.
    """
    shown = lost | np.append(lost[1:], False)
    edge, high = ax.get_xaxis_transform(), low + 0.7 * height
    ax.fill_between(time, low, high, where=shown, transform=edge, color=color, linewidth=0.5, label=label)


def _keep_span(ax: Axes, values: NDArray[np.float64], scale: float = 0.0) -> None:
    """Keep a ripple below 2 % of the values, or 1e-6 of the scale, from filling the picture's height."""
    least = max(0.02 * float(np.abs(values).max(initial=0.0)), 1e-6 * scale) or 1.0
    low, high = ax.get_ylim()
    if high - low < least:
        middle = (low + high) / 2
        ax.set_ylim(middle - least / 2, middle + least / 2)


def _mark_modes(ax: Axes, frequencies: NDArray[np.float64]) -> None:
    """Thin lines at the natural frequencies, named on the upper edge; neighbours share a label."""
    low, high = ax.get_xlim()
    shown = np.sort(frequencies[(frequencies > low) & (frequencies < high)])
    for frequency in shown:
        ax.axvline(frequency, color=PALE, linewidth=1.0, zorder=1)
    gap = 0.022 * np.log(high / low)
    groups = np.split(shown, np.flatnonzero(np.diff(np.log(shown)) > gap) + 1) if shown.size else []
    edge = ax.secondary_xaxis("top")
    edge.xaxis.set_minor_locator(NullLocator())
    edge.set_xticks(
        [float(np.exp(np.log(group).mean())) for group in groups],
        [", ".join(f"{frequency:.3g}" for frequency in group) + " Hz" for group in groups],
        rotation=90,
    )
    edge.tick_params(length=0)
    edge.spines["top"].set_visible(False)


def _headline(result: Result) -> str:
    warnings = len(result.audit.warnings)
    audit = f"; audit: {counted(warnings, 'warning')}, see the report" if warnings else ""
    return f"{result.machine.name}: free {', '.join(result.machine.free)}{audit}"


def _set_title(ax: Axes, result: Result, title: str) -> None:
    """A title above the machine and its free dofs, which tell runs of one machine apart."""
    ax.set_title(f"{title}\n{_headline(result)}", parse_math=False)  # a name may hold dollar signs
