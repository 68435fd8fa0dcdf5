"""The pictures show the data of the result, with units, and leave the process as it was."""

from pathlib import Path

import matplotlib
import numpy as np
import pytest
import reference as ref
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from guideload import plots
from guideload.base.numbers import load_with_unit
from guideload.cli.inputs import EXAMPLES
from guideload.cli.outputs import PICTURES
from guideload.machine.components import Carriage
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.plots.histories import octave_bands
from guideload.plots.style import LOOK, carriage_look
from guideload.simulation.result import Result
from guideload.simulation.simulation import simulate

TIME = np.linspace(0.0, 2.0, 2001)
MOVE = np.where((TIME > 0.3) & (TIME < 0.8), 2.2, 0.0) - np.where((TIME > 1.1) & (TIME < 1.6), 2.2, 0.0)


def along_x(values: np.ndarray) -> np.ndarray:
    return np.stack([values, 0 * values, 0 * values], axis=1)


@pytest.fixture(scope="module")
def machine() -> Machine:
    return Machine.from_toml(str(EXAMPLES / "manipulator.toml"))


@pytest.fixture(scope="module")
def result(machine: Machine) -> Result:
    velocity = np.cumsum(MOVE) * (TIME[1] - TIME[0])
    motor_speed = velocity / machine.drive.speed_per_motor_speed
    motion = Motion(TIME, along_x(MOVE), velocity=along_x(velocity), motor_speed=motor_speed)
    return simulate(machine, motion)


def legend_text(ax: matplotlib.axes.Axes) -> str:
    return "\n".join(text.get_text() for text in ax.get_legend().get_texts())


def test_motor_speed_is_drawn_in_turns_per_minute(result: Result) -> None:
    ax = plots.motor_speed(result)
    np.testing.assert_array_equal(ax.lines[0].get_xdata(), TIME)
    np.testing.assert_allclose(
        ax.lines[0].get_ydata() * 2 * np.pi / 60, result.data["motor_speed"], rtol=1e-14
    )
    assert ax.get_xlabel() == "time [s]"
    assert ax.get_ylabel().endswith("[1/min]")


def test_without_motor_speed_the_cart_velocity_is_shown_and_said(machine: Machine) -> None:
    velocity = along_x(np.cumsum(MOVE) * 1e-3)
    ax = plots.motor_speed(simulate(machine, Motion(TIME, along_x(MOVE), velocity=velocity)))
    np.testing.assert_array_equal(ax.lines[0].get_ydata(), velocity[:, 0])
    assert "velocity" in ax.get_ylabel() and ax.get_ylabel().endswith("[m/s]")
    assert "no motor speed" in ax.get_title(loc="left")


def test_without_any_speed_the_acceleration_is_shown_and_said(machine: Machine) -> None:
    ax = plots.motor_speed(simulate(machine, Motion(TIME, along_x(MOVE))))
    np.testing.assert_array_equal(ax.lines[0].get_ydata(), MOVE)
    assert ax.get_ylabel().endswith("[m/s²]")


@pytest.mark.parametrize("axis", ["y", "z"])
@pytest.mark.parametrize("carriage", ["1a", "2b"])
def test_load_of_a_carriage(result: Result, carriage: str, axis: str) -> None:
    ax = {"y": plots.load_y, "z": plots.load_z}[axis](result, carriage)
    load, static, peak = ax.lines
    drawn = result.data["force"].sel(carriage=carriage, axis=axis).values
    np.testing.assert_array_equal(load.get_ydata(), drawn)
    assert set(static.get_ydata()) == {float(result.data["static_force"].sel(carriage=carriage, axis=axis))}
    assert abs(peak.get_ydata()[0]) == np.abs(drawn).max()
    assert drawn[TIME == peak.get_xdata()[0]] == peak.get_ydata()[0]
    assert load_with_unit(peak.get_ydata()[0]) in legend_text(ax)
    assert ax.get_xlabel() == "time [s]" and ax.get_ylabel().endswith("[N]")
    assert carriage in ax.get_title(loc="left")


def test_unknown_carriage_is_refused_with_those_there_are(result: Result) -> None:
    with pytest.raises(ValueError, match="no carriage 'left': the result has '1a', '1b', '2a' and '2b'"):
        plots.load_y(result, "left")


def test_paper_figures_are_7_to_11(result: Result) -> None:
    sheet = plots.paper_figures(result)
    assert [ax.get_title(loc="left") for ax in sheet] == [
        "Motor speed",
        *[f"Carriage {name}, {axis}" for name in ("1a", "1b", "2a", "2b") for axis in "yz"],
    ]
    assert len({ax.figure for ax in sheet}) == 1
    assert "free y, z, rx, ry, rz" in sheet[0].figure.get_suptitle()


def test_resultant_of_every_carriage_with_its_static_level(result: Result) -> None:
    ax = plots.resultant(result)
    for index, name in enumerate(result.data["carriage"].values):
        load, static, peak = ax.lines[3 * index : 3 * index + 3]
        np.testing.assert_array_equal(load.get_ydata(), result.data["resultant"].sel(carriage=name))
        level = np.hypot(*result.data["static_force"].sel(carriage=name, axis=["y", "z"]).values)
        assert set(static.get_ydata()) == {level}
        assert peak.get_ydata()[0] == load.get_ydata().max()
    assert ax.get_ylabel().endswith("[N]") and ax.get_xlabel() == "time [s]"


def test_moment_of_every_carriage_with_its_static_level(result: Result) -> None:
    ax = plots.moments(result)
    for index, name in enumerate(result.data["carriage"].values):
        moment, static, _ = ax.lines[3 * index : 3 * index + 3]
        drawn = result.data["moment"].sel(carriage=name).transpose("time", "axis").values
        np.testing.assert_allclose(moment.get_ydata() ** 2, (drawn**2).sum(axis=1), rtol=1e-12)
        level = np.linalg.norm(result.data["static_moment"].sel(carriage=name).values)
        assert static.get_ydata()[0] == pytest.approx(level, rel=1e-12)
        assert load_with_unit(moment.get_ydata().max(), "N m") in legend_text(ax)
    assert ax.get_ylabel().endswith("[N m]") and ax.get_xlabel() == "time [s]"


def test_pictures_tell_machine_and_free_dofs(result: Result) -> None:
    for picture in (plots.resultant, plots.moments, plots.spectrum):
        title = picture(result).get_title(loc="left")
        assert title.splitlines()[1] == f"{result.machine.name}: free y, z, rx, ry, rz"


def test_pictures_count_the_warnings_of_the_audit(machine: Machine) -> None:
    started = simulate(machine, Motion(TIME, along_x(np.where(TIME < 0.5, 2.2, 0.0))))
    assert len(started.audit.warnings) == 1
    for picture in (plots.resultant, plots.moments, plots.spectrum):
        assert picture(started).get_title(loc="left").endswith("; audit: 1 warning, see the report")


def cart_clear() -> Machine:
    cart = ref.cart()
    play = {"clearance_y": 5e-6, "clearance_z": 5e-6}
    carriages = [Carriage(**(part.model_dump(exclude_none=True) | play)) for part in cart.carriages]
    return Machine(**{**dict(cart), "carriages": carriages})


def test_lost_contact_is_marked_along_the_time_axis() -> None:
    """In load pictures that of the links along the axis, in the others that of all; where nothing is lost, nothing."""
    result = simulate(cart_clear(), ref.cycle())
    time, lost = result.data["time"].values, result.audit.contact.lost
    for index, (name, links) in enumerate(
        zip(result.data["carriage"].values, result.machine.links_of_carriages, strict=True)
    ):
        for offset, picture in enumerate((plots.load_y, plots.load_z)):
            ax, flags = picture(result, name), lost[:, links[offset::2]].any(axis=1)
            assert len(ax.collections) == flags.any()
            assert ("contact lost" in legend_text(ax)) == flags.any()
            if flags.any():
                (bar,) = ax.collections
                assert marked(bar, time)[flags].all()
                assert marked(bar, time).sum() <= flags.sum() + np.count_nonzero(np.diff(flags)) + 1
                assert tuple(bar.get_facecolor()[0]) == matplotlib.colors.to_rgba(carriage_look(index).color)
    for picture in (plots.resultant, plots.moments):
        ax = picture(result)
        assert len(ax.collections) == 4 and "contact lost" in legend_text(ax)
        heights = [path.vertices[:, 1].max() for bar in ax.collections for path in bar.get_paths()]
        assert max(heights) <= ax.transAxes.inverted().transform(ax.transData.transform((0.0, 0.0)))[1]


def test_pictures_say_what_their_modes_and_bars_mean() -> None:
    """A preloaded contact is not lost where one of its rows is open; modes are those at the nominal stiffness."""
    motion = ref.piece(ref.cycle(), 500, 900)
    light = {"preload_y": 300.0, "preload_z": 300.0, "rolling": "ball"}
    carriages = [part.model_copy(update=light) for part in ref.cart().carriages]
    result = simulate(ref.cart().model_copy(update={"carriages": carriages}), motion)
    assert result.audit.contact.share.max() > 0.5
    for ax in (plots.resultant(result), plots.load_y(result, "2b")):
        assert "a row open" in legend_text(ax) and "contact lost" not in legend_text(ax)
    for one, said in ((result, True), (simulate(ref.cart(), motion), False)):
        title = plots.modes(one.machine, one.modes)[0].figure.get_suptitle()
        assert ("nominal stiffness" in title) is said


def marked(bar: PolyCollection, time: np.ndarray) -> np.ndarray:
    """Which samples a bar covers."""
    spans = [path.vertices[:, 0] for path in bar.get_paths()]
    return np.any([(time >= span.min()) & (time <= span.max()) for span in spans], axis=0)


def test_a_carriage_has_one_colour_in_every_picture(result: Result) -> None:
    for index, name in enumerate(result.data["carriage"].values):
        color = carriage_look(index).color
        assert plots.load_y(result, name).lines[0].get_color() == color
        assert plots.load_z(result, name).lines[0].get_color() == color
        assert plots.resultant(result).lines[3 * index].get_color() == color
        drawn = [line for line in plots.spectrum(result).lines if line.get_label() == name]
        assert [line.get_color() for line in drawn] == [color]
    assert len({carriage_look(index) for index in range(24)}) == 24


def test_spectral_density_holds_the_mean_square_of_the_dynamic_load(result: Result) -> None:
    """Parseval: only the mean, the line at 0 Hz, is missing."""
    frequency, density = plots.load_density(result)
    dynamic = (result.data["force"] - result.data["static_force"]).sel(axis=["y", "z"])
    variance = dynamic.var("time").sum("axis").values
    np.testing.assert_allclose(density.sum(axis=0) * frequency[0], variance, rtol=1e-9)
    centers, means, widths = octave_bands(frequency, density)
    np.testing.assert_allclose(widths @ means, variance, rtol=1e-9)
    assert widths.sum() == pytest.approx(frequency[-1], rel=1e-12)
    assert np.all(np.diff(centers) > 0)


@pytest.mark.parametrize("count", [2000, 2001])
def test_spectral_density_of_a_tone_is_its_mean_square_at_its_frequency(result: Result, count: int) -> None:
    time = np.arange(count) * 1e-3
    frequency = 100 / (count * 1e-3)
    toned = tone(result, time, 30 * np.sin(2 * np.pi * frequency * time))
    found, density = plots.load_density(toned)
    assert found[density[:, 0].argmax()] == pytest.approx(frequency, rel=1e-12)
    assert density[:, 0].sum() * found[0] == pytest.approx(30**2 / 2, rel=1e-9)


def test_spectral_density_of_uneven_samples_is_near_that_of_even_ones(result: Result) -> None:
    uneven = np.sort(np.concatenate([np.arange(2001) * 1e-3, np.random.default_rng(3).uniform(0, 2, 500)]))
    for time in (uneven, np.repeat(uneven, 2)):  # twice the same stamp: a jump
        found, density = plots.load_density(tone(result, time, 30 * np.sin(2 * np.pi * 10 * time)))
        assert density[:, 0].sum() * found[0] == pytest.approx(30**2 / 2, rel=0.01)  # linear between samples
        assert found[density[:, 0].argmax()] == pytest.approx(10, abs=0.5)


def tone(result: Result, time: np.ndarray, load: np.ndarray) -> Result:
    """A result whose dynamic load is `load` along y, for each carriage."""
    data = result.data[["static_force"]].copy()
    force = np.zeros((time.size, data.sizes["carriage"], 3))
    force[..., 1] = load[:, None]
    data = data.assign_coords(time=time).assign(force=(("time", "carriage", "axis"), force))
    data["force"] = data["force"] + data["static_force"]

    class Toned:
        pass

    toned = Toned()
    toned.data, toned.modes = data, result.modes
    return toned


def test_spectrum_is_the_root_of_the_density_and_marks_the_modes(result: Result) -> None:
    ax = plots.spectrum(result)
    centers, means, _ = octave_bands(*plots.load_density(result))
    count = result.data.sizes["carriage"]
    for index, line in enumerate(ax.lines[:count]):
        np.testing.assert_array_equal(line.get_xdata(), centers)
        np.testing.assert_array_equal(line.get_ydata(), np.sqrt(means[:, index]))
    marks = sorted(line.get_xdata()[0] for line in ax.lines[count:])
    np.testing.assert_allclose(marks, np.sort(result.modes.frequency))
    assert ax.get_xlabel() == "frequency [Hz]" and ax.get_ylabel().endswith("[N/√Hz]")


def test_a_load_that_never_moves_is_drawn(machine: Machine) -> None:
    still = simulate(machine, Motion(TIME, np.zeros((TIME.size, 3))))
    for ax in (
        plots.spectrum(still),
        plots.resultant(still),
        plots.load_z(still, "1a"),
        plots.motor_speed(still),
    ):
        ax.figure.draw_without_rendering()
    low, high = plots.load_z(still, "1a").get_ylim()
    assert high - low > 1e-3  # rounding noise does not fill the picture


def test_equivalent_box_has_the_inertia_of_the_body(machine: Machine) -> None:
    """Eight corners' second moment is 3 times that of the homogeneous box."""
    corners = plots.equivalent_box(machine) - np.array(machine.body.center_of_mass)
    np.testing.assert_allclose(corners.mean(axis=0), 0, atol=1e-15)
    second = machine.body.mass / 3 * (corners.T @ corners) / 8
    inertia = np.trace(second) * np.eye(3) - second
    np.testing.assert_allclose(inertia, machine.body.central_inertia(), rtol=1e-12, atol=1e-9)


def test_scene_shows_loads_at_the_peak(machine: Machine, result: Result) -> None:
    ax = plots.scene(machine, result)
    instant = int(result.data["resultant"].max("carriage").values.argmax())
    text = legend_text(ax)
    assert f"{TIME[instant]:.3f} s" in text
    for load in np.linalg.norm(result.data["force"].values[instant], axis=1):
        assert load_with_unit(load) in text
    assert "N per 100 mm" in text
    assert all(label.endswith("[m]") for label in (ax.get_xlabel(), ax.get_ylabel(), ax.get_zlabel()))
    assert len([one for one in ax.collections if isinstance(one, Poly3DCollection)]) == 1 + len(
        machine.carriages
    )


def test_scene_without_result_has_no_loads(machine: Machine) -> None:
    assert "loads:" not in legend_text(plots.scene(machine))


def test_scene_has_one_scale_and_y_up(machine: Machine, result: Result) -> None:
    ax = plots.scene(machine, result)
    ax.figure.draw_without_rendering()
    lengths = [np.ptp(limits) for limits in (ax.get_zlim(), ax.get_xlim(), ax.get_ylim())]
    shares = ax._box_aspect / np.array(lengths)  # z, x, y: the picture's axes when y is up
    np.testing.assert_allclose(shares, shares[0], rtol=1e-12)
    middle = [np.mean(limits) for limits in (ax.get_xlim(), ax.get_ylim(), ax.get_zlim())]
    above = [middle[0], ax.get_ylim()[1], middle[2]]
    seen = [ax.get_proj() @ [*point, 1] for point in (middle, above)]
    (x0, y0), (x1, y1) = ((point / point[3])[:2] for point in seen)
    assert y1 > y0 and abs(x1 - x0) < 1e-9


def test_modes_are_titled_with_frequency_and_damping(machine: Machine, result: Result) -> None:
    axes = plots.modes(machine, result.modes)
    assert len(axes) == len(result.modes.frequency)
    for ax, frequency, ratio in zip(axes, result.modes.frequency, result.modes.damping_ratio, strict=True):
        assert f"{frequency:.4g} Hz" in ax.get_title()
        assert f"ζ {100 * ratio:.3g} %" in ax.get_title()


def test_axes_given_are_drawn_on_and_the_process_is_left_alone(machine: Machine, result: Result) -> None:
    before = dict(matplotlib.rcParams)
    for draw in (plots.motor_speed, plots.resultant, plots.spectrum):
        ax = Figure().add_subplot()
        assert draw(result, ax) is ax
    ax = Figure().add_subplot()
    assert plots.load_y(result, "1a", ax) is ax
    ax = Figure().add_subplot(projection="3d")
    assert plots.scene(machine, result, ax) is ax
    axes = [Figure().add_subplot(projection="3d") for _ in result.modes.frequency]
    assert plots.modes(machine, result.modes, axes) == axes
    with pytest.raises(ValueError, match="need 5 axes, got 2"):
        plots.modes(machine, result.modes, axes[:2])
    assert dict(matplotlib.rcParams) == before
    assert set(LOOK) <= set(before)


def test_save_all_writes_every_picture(result: Result, tmp_path: Path) -> None:
    paths = plots.save_all(result, tmp_path / "new" / "Bilder für Müller")
    assert sorted(path.name for path in paths) == sorted(PICTURES)
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in paths)


@pytest.mark.parametrize(
    ("value", "text"),
    [(-12258.3, "−12\u202f258 N"), (99.94, "99.9 N"), (0.1234, "0.123 N"), (1e-15, "0 N"), (0.0, "0 N")],
)
def test_loads_as_text(value: float, text: str) -> None:
    assert load_with_unit(value) == text
