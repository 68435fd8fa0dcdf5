"""Pictures over time: the paper's figures 7 to 11, the resultant loads, and the moments of the carriages."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from guideload.audit.figures import share_of_time
from guideload.audit.histories import Histories, payload_changes
from guideload.base.arguments import checked
from guideload.base.arrays import Array, Flags
from guideload.base.errors import ArgumentError
from guideload.base.number_text import joined, load_with_unit, percent
from guideload.base.units import factor
from guideload.motion.uncertainty import COVER
from guideload.plots.long_records import draw_history, is_long, worst_cycle
from guideload.plots.style import (
    DASHED,
    GREY,
    INK,
    carriage_look,
    drawing,
    legend_above,
    legend_beside,
    look,
    new_figure,
    plain,
    run_title,
    set_run_title,
)
from guideload.simulation.result import Result

# Over the height of the axes: a bar that marks lost contact with the gap above it, and the limit for all bars.
BAR, ALL_BARS = 0.025, 0.2
BAND_ALPHA = 0.25
LINE_ALPHA = 0.75  # other loads remain visible under the line of a vibration
# Least range of the vertical axis, over the largest value, so that a ripple does not fill the picture.
SMALLEST_SPAN = 0.02
NO_WIDTH = 1e-6  # N or N m: half a band that is rounding
ROUNDING = 1e-6  # least range of the vertical axis, over the largest resultant


@checked
def motor_speed(result: Result, ax: Axes | None = None) -> Axes:
    """Measured speed of the motor in turns per minute over time (paper, figure 7).

    Without motor speed, the velocity of the cart along the rails is drawn, or without that, its acceleration.
    """
    data = result.quantities
    if "motor_speed" in data:
        title = "Motor speed"
        values, label = data["motor_speed"] / factor("rpm", "rad/s"), "motor speed [1/min]"
    elif "cart_velocity" in data:
        title = "Cart velocity (the motion has no motor speed)"
        values, label = data["cart_velocity"][:, 0], "velocity along x [m/s]"
    else:
        title = "Cart acceleration (the motion has neither motor speed nor velocity)"
        values, label = data["cart_acceleration"][:, 0], "acceleration [m/s²]"
    with drawing(ax, 7.5, 2.6) as ax:
        draw_history(ax, data["time"], values, is_long(result), color=INK)
        ax.axhline(0, color=GREY, linewidth=0.7, zorder=1)
        ax.set(title=title, xlabel="time [s]", ylabel=label)
        _limit_zoom(ax, values)
    return ax


@checked
def load_y(result: Result, carriage: str, ax: Axes | None = None) -> Axes:
    """Force of the body on one carriage along y in newtons over time (paper, figures 8 and 10).

    A bar along the time axis marks where one of its y links has no contact, or an open row. If the motion has an
    uncertainty, a pale area is the 95 % band of the load at each instant. Of a long record the range in each column of
    the picture is drawn and, unless axes are given, the worst cycle beside it. Raises ArgumentError for an unknown
    carriage.
    """
    return _overview_and_cycle(result, carriage, "y", ax)


@checked
def load_z(result: Result, carriage: str, ax: Axes | None = None) -> Axes:
    """Force of the body on one carriage along z in newtons over time (paper, figures 9 and 11); see `load_y`."""
    return _overview_and_cycle(result, carriage, "z", ax)


@checked
def paper_figures(result: Result) -> list[Axes]:
    """The paper's figures 7 to 11 on one sheet: the motor speed, below it the y and z load of each carriage.

    Returns the axes in that order: motor speed, y and z of the first carriage, y and z of the second, ... Of a long
    record the worst cycle is drawn beside each load; these axes are the last ones.
    """
    carriages = [str(name) for name in result.quantities["carriage"]]
    parts = [None, worst_cycle(result)] if is_long(result) else [None]
    with look():
        columns, rows = 2 * len(parts), 1 + len(carriages)
        width, height = 5.0 * columns + 2.0, 1.0 + 2.1 * rows
        figure = new_figure(width, height)
        figure.set_layout_engine("none")  # places given in inches: to find them takes as long as the drawing
        gap = {"wspace": 0.9 / (width / columns - 0.9), "hspace": 0.85 / (height / rows - 0.95)}
        places = {"left": 0.8 / width, "right": 1.0 - 0.2 / width}
        places |= {"bottom": 0.5 / height, "top": 1.0 - 0.8 / height}
        grid = figure.add_gridspec(rows, columns, **places, **gap)
        overviews = [motor_speed(result, figure.add_subplot(grid[0, :]))]
        cycles: list[Axes] = []
        for row, carriage in enumerate(carriages, start=1):
            for column, axis in enumerate("yz"):
                for k, (part, drawn) in enumerate(zip(parts, (overviews, cycles), strict=False)):
                    place = grid[row, len(parts) * column + k]
                    ax = figure.add_subplot(place, sharex=drawn[0] if drawn else None)
                    drawn.append(_load(result, carriage, axis, ax, part))
        for ax in (*overviews[1:-2], *cycles[:-2]):
            ax.set_xlabel("")
            ax.tick_params(labelbottom=False)
        figure.suptitle(run_title(result), parse_math=False)
    return [*overviews, *cycles]


@checked
def resultant(result: Result, ax: Axes | None = None) -> Axes:
    """Resultant load sqrt(Fy² + Fz²) of every carriage in newtons over time.

    Dashed lines are the quasi-static resultants: statics with m a and nominal stiffness, on rails without errors. Bars
    along the time axis mark where a link of a carriage has no contact, or an open row. If the motion has an
    uncertainty, pale areas are the 95 % bands of the loads at each instant. Of a long record the range in each column
    of the picture is drawn and, unless axes are given, the worst cycle below.
    """
    histories = Histories(result.machine, result.quantities)
    static = histories.machine.resultants(histories.quasi_static)
    peaks = np.stack([result.peak_columns[name] for name in ("time_of_peak_s", "peak_resultant_N")], axis=1)
    values, name = result.quantities["resultant"], "√(Fy² + Fz²)"
    loads = _Loads(values, static, "static with m a", "resultant_sd", name, "N", peaks)
    return _carriages(result, loads, "Resultant load of the carriages", ax)


@checked
def moments(result: Result, ax: Axes | None = None) -> Axes:
    """Magnitude of the moment of every carriage about its centre in N m over time; static levels are dashed.

    The two ends of a long carriage react to pitch of the body with opposite forces, which cancel in the force of the
    carriage and add up in its moment. If the motion has an uncertainty, pale areas are the 95 % bands.
    """
    data = result.quantities
    moment, level = (np.linalg.norm(data[name], axis=-1) for name in ("moment", "static_moment"))
    static = np.broadcast_to(level, moment.shape)
    loads = _Loads(moment, static, "static level", "moment_magnitude_sd", "√(Mx² + My² + Mz²)", "N m")
    return _carriages(result, loads, "Moments of the carriages about their centres", ax)


def _overview_and_cycle(result: Result, carriage: str, axis: str, ax: Axes | None) -> Axes:
    """A load on axes; without axes those of a new figure, for a long record with the worst cycle beside them."""
    if ax is None and is_long(result):
        with look():
            ax, cycle = new_figure(13.0, 2.8).subplots(1, 2)
        _load(result, carriage, axis, cycle, worst_cycle(result))
    return _load(result, carriage, axis, ax, None)


def _load(result: Result, carriage: str, axis: str, ax: Axes | None, part: slice | None) -> Axes:
    """A load over time, of a long record as an envelope; part: instants that are drawn enlarged instead."""
    data = result.quantities
    names = [str(name) for name in data["carriage"]]
    if carriage not in names:
        raise ArgumentError(
            f"no carriage {carriage!r}: the result has {joined(repr(name) for name in names)}"
        )
    index, shown = names.index(carriage), part or slice(None)
    color = carriage_look(index).color
    component = "xyz".index(axis)
    time, load = data["time"][shown], data["force"][shown, index, component]
    static, peak = float(data["static_force"][index, component]), int(np.abs(load).argmax())
    contact = result.audit.contact
    links = result.machine.links_of_carriages[index]
    links = links[result.machine.link_table().axis[links] == component]
    lost = contact.lost_by(links)[shown]
    envelope = part is None and is_long(result)
    with drawing(ax, 7.5, 2.8) as ax:
        draw_history(ax, time, load, envelope, color=color)
        if "force_sd" in data and not envelope:
            deviation = data["force_sd"][shown, index, component]
            _draw_band(ax, time, load, deviation, color, BAND_ALPHA, _band_label(deviation))
        label = f"static {load_with_unit(static)}"
        ax.axhline(static, color=INK, linewidth=0.8, linestyle=DASHED, label=label)
        largest, highest = load[peak], np.abs(data["force"][:, index, component]).max()
        if "peak_force" in data and np.abs(largest) == highest:  # between the instants too
            largest = np.copysign(data["peak_force"][index, component], largest)
        label = f"{_peak(part)} {load_with_unit(float(largest))} at {time[peak]:.2f} s"
        ax.plot(time[peak], load[peak], "o", color=color, markersize=5, clip_on=False, label=label)
        ax.set(xlabel="time [s]", ylabel=f"load F{axis} [N]")
        title = f"Carriage {carriage}, {axis}{'' if part is None else ', worst cycle'}"
        ax.set_title(title, pad=22, parse_math=False)  # room for the legend
        _limit_zoom(ax, load, float(data["resultant"].max()))
        _mark_changes(ax, result)
        if lost.any():
            share = percent(float(share_of_time(time, lost[:, None])[0]))
            _mark_lost(ax, time, lost, color, label=f"{contact.words(links)} {share} of the time")
        legend_above(ax, 4, columnspacing=1.2, handlelength=1.4)
    return ax


class _Loads(NamedTuple):
    """Loads and static loads of the carriages, both (time, carriage) and >= 0.

    deviations: name in the result of the standard deviations of the loads; missing if the motion has no uncertainty.
    peaks: (carriage, 2) times and values of the peaks between the instants too; None: those at the instants.
    """

    values: Array
    static: Array
    static_label: str
    deviations: str
    name: str
    unit: str
    peaks: Array | None = None


def _carriages(result: Result, loads: _Loads, title: str, ax: Axes | None) -> Axes:
    """Loads of all carriages on axes; without axes, of a long record the overview above the worst cycle."""
    cycle = None
    if ax is None and is_long(result):
        with look():
            ax, cycle = new_figure(9.0, 8.4).subplots(2, 1)
    with drawing(ax, 9.0, 4.4) as ax:
        set_run_title(ax, result, title)
        _draw_carriages(ax, result, loads, None)
        if cycle is not None:
            time, at = result.quantities["time"], None
            if loads.peaks is None:
                at = float(time[loads.values.max(axis=1).argmax()])
            part = worst_cycle(result, at)
            first, *_, last = time[part]
            cycle.set_title(f"Worst cycle, {first:.2f} to {last:.2f} s")
            _draw_carriages(cycle, result, loads, part)
    return ax


def _draw_carriages(ax: Axes, result: Result, loads: _Loads, part: slice | None) -> None:
    """Loads with static loads, bands and peaks; of a long record their envelopes, or a part of it enlarged."""
    shown, envelope = part or slice(None), part is None and is_long(result)
    time, carriages = result.quantities["time"][shown], result.quantities["carriage"]
    values, static = loads.values[shown], loads.static[shown]
    known = not envelope and loads.deviations in result.quantities
    deviations = result.quantities[loads.deviations][shown] if known else None
    for index, (name, load) in enumerate(zip(carriages, values.T, strict=True)):
        color, dash = carriage_look(index)
        # Each line is thinner than the one before, so that equal loads of symmetric carriages are all visible.
        width = 0.8 + 1.4 * (1 - (index + 1) / len(carriages))
        style = {"color": color, "linestyle": dash, "linewidth": width, "alpha": LINE_ALPHA}
        at, peak = time[load.argmax()], load.max()
        if loads.peaks is not None and time[0] <= loads.peaks[index, 0] <= time[-1]:
            at, peak = loads.peaks[index]
        label = f"{plain(str(name))}: {_peak(part)} {load_with_unit(peak, loads.unit)}"
        draw_history(ax, time, load, envelope, label=label, **style)
        if not envelope:
            ax.plot(time, static[:, index], color=INK, linewidth=0.8, linestyle=DASHED, zorder=2.5)
        ax.plot(at, peak, "o", color=color, markersize=4, clip_on=False, zorder=3)
        if deviations is not None:
            alpha = BAND_ALPHA / np.sqrt(len(carriages))  # bands of symmetric carriages cover each other
            _draw_band(ax, time, load, deviations[:, index], color, alpha)
    if deviations is not None:
        label = _band_label(deviations, loads.unit)
        ax.fill_between([], [], [], color=GREY, alpha=BAND_ALPHA, linewidth=0, label=label)
    if not envelope:
        ax.plot([], [], color=INK, linewidth=0.8, linestyle=DASHED, label=loads.static_label)
    ax.set(xlabel="time [s]", ylabel=f"{loads.name} [{loads.unit}]")
    _limit_zoom(ax, values)
    _mark_changes(ax, result)
    _mark_carriages(ax, result, time, shown, from_zero=part is None)
    legend_beside(ax, "carriage")


def _mark_carriages(ax: Axes, result: Result, time: Array, shown: slice, from_zero: bool) -> None:
    """Bars along the time axis where a carriage has lost contact; from_zero: the axis begins there, above the bars."""
    contact, links = result.audit.contact, result.machine.links_of_carriages
    lost = [contact.lost_by(links_of_carriage)[shown] for links_of_carriage in links]
    marked = [index for index, flags in enumerate(lost) if flags.any()]
    height = min(BAR, ALL_BARS / max(len(marked), 1))
    strip = height * len(marked)
    low, high = (0.0, ax.get_ylim()[1]) if from_zero else ax.get_ylim()
    ax.set_ylim(bottom=low - strip / (1 - strip) * (high - low))  # the bars are below the loads
    for row, index in enumerate(reversed(marked)):  # from the axis up, in the legend's order
        _mark_lost(ax, time, lost[index], carriage_look(index).color, row * height, height)
    if marked:
        ax.plot([], [], color=GREY, linewidth=4, label=contact.words(np.concatenate(links)))


def _peak(part: slice | None) -> str:
    """What the largest load of a picture is called: of the whole record, or of the cycle that is drawn enlarged."""
    return "peak" if part is None else "peak in the cycle"


def _band_label(deviation: Array, unit: str = "N") -> str:
    """Label with the largest half width, as most bands are thinner than the line on top of them."""
    half = COVER * float(deviation.max(initial=0.0))
    if half < NO_WIDTH:
        return "no band: the motion does not excite it"
    return f"95 % band, up to ±{load_with_unit(half, unit)}"


def _draw_band(
    ax: Axes, time: Array, load: Array, deviation: Array, color: str, alpha: float, label: str = ""
) -> None:
    """The 95 % band of a load, from its standard deviation."""
    low, high = load - COVER * deviation, load + COVER * deviation
    ax.fill_between(time, low, high, color=color, alpha=alpha, linewidth=0, zorder=1.8, label=label)


def _mark_lost(
    ax: Axes,
    time: Array,
    lost: Flags,
    color: str,
    low: float = 0.0,
    height: float = BAR,
    label: str = "",
) -> None:
    """A thin bar along the time axis where contact is lost; low, height: over the axes' height, with the gap.

    The bar begins one sample early, so that a single sample without contact is visible.
    """
    shown = lost | np.append(lost[1:], False)
    edge, high = ax.get_xaxis_transform(), low + 0.7 * height
    ax.fill_between(time, low, high, where=shown, transform=edge, color=color, linewidth=0.5, label=label)


def _mark_changes(ax: Axes, result: Result) -> None:
    """A vertical line at each change of payload."""
    for number, (time, _) in enumerate(payload_changes(result.quantities)[1:]):
        label = "" if number else "change of payload"
        ax.axvline(time, color=GREY, linewidth=0.8, linestyle=":", zorder=1, label=label)


def _limit_zoom(ax: Axes, values: Array, scale: float = 0.0) -> None:
    """Widen a vertical axis that a ripple, or rounding of loads of size `scale`, would fill."""
    least = max(SMALLEST_SPAN * float(np.abs(values).max(initial=0.0)), ROUNDING * scale) or 1.0
    low, high = ax.get_ylim()
    if high - low < least:
        middle = (low + high) / 2
        ax.set_ylim(middle - least / 2, middle + least / 2)
