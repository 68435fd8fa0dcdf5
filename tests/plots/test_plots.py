"""The pictures show the data of the result, with units, and change no setting of the process."""

from pathlib import Path
from types import SimpleNamespace

import matplotlib
import matplotlib.image
import numpy as np
import pytest
import reference as ref
from lives import cart, moved
from machines import having
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from moves import GENTLE
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from guideload import plots
from guideload.base.errors import ArgumentError, WriteError
from guideload.base.number_text import load_with_unit
from guideload.base.quantities import Quantities, Quantity
from guideload.cli.inputs import EXAMPLES
from guideload.cli.outputs import PICTURE_ENDINGS, PICTURES
from guideload.life.life import life_of
from guideload.machine.machine import Machine
from guideload.machine.points import PointOfInterest
from guideload.motion.motion import Motion
from guideload.plots.saving import DOTS_PER_INCH
from guideload.plots.spectra import octave_bands
from guideload.plots.style import LOOK, carriage_look
from guideload.reports.compare import comparison_report
from guideload.simulation.result import Result
from guideload.simulation.simulation import simulate

CARRIAGES = ref.cart().carriages
TIME = np.linspace(0.0, 2.0, 2001)
MOVE = np.where((TIME > 0.3) & (TIME < 0.8), 2.2, 0.0) - np.where((TIME > 1.1) & (TIME < 1.6), 2.2, 0.0)


@pytest.fixture(scope="module")
def machine() -> Machine:
    return Machine.from_toml(str(EXAMPLES / "manipulator.toml"))


@pytest.fixture(scope="module")
def result(machine: Machine) -> Result:
    velocity = np.cumsum(MOVE) * (TIME[1] - TIME[0])
    motor_speed = velocity / machine.drive.speed_per_motor_speed
    return simulate(machine, Motion.along_x(TIME, MOVE, velocity=velocity, motor_speed=motor_speed))


def legend_text(ax: matplotlib.axes.Axes) -> str:
    return "\n".join(text.get_text() for text in ax.get_legend().get_texts())


def test_the_first_figure_is_the_motor_speed_or_says_what_it_shows_instead(
    machine: Machine, result: Result
) -> None:
    velocity = np.cumsum(MOVE) * 1e-3
    with_velocity = simulate(machine, Motion.along_x(TIME, MOVE, velocity=velocity))
    without_speed = simulate(machine, Motion.along_x(TIME, MOVE))
    turns_per_minute = result.data["motor_speed"].values * 60 / (2 * np.pi)
    for shown, values, label, title in (
        (result, turns_per_minute, "motor speed [1/min]", "Motor speed"),
        (with_velocity, velocity, "velocity along x [m/s]", "no motor speed"),
        (without_speed, MOVE, "acceleration [m/s²]", "neither motor speed"),
    ):
        ax = plots.motor_speed(shown)
        np.testing.assert_allclose(ax.lines[0].get_data(), (TIME, values), rtol=1e-14)
        assert (ax.get_xlabel(), ax.get_ylabel()) == ("time [s]", label)
        assert title in ax.get_title(loc="left")


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
    at_any_time = result.peaks().loc[carriage, f"peak_F{axis}_N"]
    assert load_with_unit(np.copysign(at_any_time, peak.get_ydata()[0])) in legend_text(ax)
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


def test_every_carriage_has_its_history_static_level_and_peak(result: Result) -> None:
    data = result.data
    for picture, quantity, axes, unit in (
        (plots.resultant, "force", ["y", "z"], "N"),
        (plots.moments, "moment", ["x", "y", "z"], "N m"),
    ):
        ax = picture(result)
        loads, levels = (
            np.sqrt((data[name].sel(axis=axes) ** 2).sum("axis")).transpose(..., "carriage").values
            for name in (quantity, f"static_{quantity}")
        )
        for index, (load, level) in enumerate(zip(loads.T, levels, strict=True)):
            drawn, static, peak = ax.lines[3 * index : 3 * index + 3]
            np.testing.assert_allclose(drawn.get_ydata(), load, rtol=1e-12)
            assert static.get_ydata()[0] == pytest.approx(level, rel=1e-12)
            assert load_with_unit(peak.get_ydata()[0], unit) in legend_text(ax)
            if picture is plots.moments:
                assert peak.get_ydata()[0] == drawn.get_ydata().max()
            else:  # the peak of the report, between the instants too; dashed: static with m a
                assert peak.get_ydata()[0] == result.peaks()["peak_resultant_N"].iloc[index]
                quasi_static = result.audit.simpler_models.quasi_static[index]
                assert static.get_ydata().max() == pytest.approx(quasi_static, rel=1e-12)
        assert ax.get_ylabel().endswith(f"[{unit}]") and ax.get_xlabel() == "time [s]"


def test_titles_name_machine_and_free_dofs_and_count_the_warnings_of_the_audit(
    machine: Machine, result: Result
) -> None:
    under_way = simulate(machine, Motion.along_x(TIME, np.where(TIME < 0.5, 2.2, 0.0)))
    assert len(under_way.audit.warnings) == 1
    title = f"{machine.name}: free y, z, rx, ry, rz"
    for picture in (plots.resultant, plots.moments, plots.spectrum):
        assert picture(result).get_title(loc="left").splitlines()[1] == title
        second = picture(under_way).get_title(loc="left").splitlines()[1]
        assert second == f"{title}; audit: 1 warning, see the report"


def test_lost_contact_is_marked_along_the_time_axis() -> None:
    """In load pictures that of the links along the axis, in the others that of all; where nothing is lost, nothing."""
    result = simulate(ref.cart_clear(), ref.cycle())
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
    result = simulate(ref.cart(preload_y=300.0, preload_z=300.0, rolling="ball"), motion)
    assert result.audit.contact.share.max() > 0.5
    for ax in (plots.resultant(result), plots.load_y(result, "2b")):
        assert "a row open" in legend_text(ax) and "contact lost" not in legend_text(ax)
    for one, said in ((result, True), (simulate(ref.cart(), motion), False)):
        title = plots.modes(one.machine, one.modes)[0].figure.get_suptitle()
        assert ("nominal stiffness" in title) is said


def test_long_names_of_many_carriages_have_room() -> None:
    """The legend of the modes lies within the picture; names below the bars are turned."""
    carriages = [
        having(one, name=f"carriage {one.name} of the long rail {i}") for i in (1, 2) for one in CARRIAGES
    ]
    machine = having(ref.cart(), carriages=tuple(carriages))
    result = simulate(machine, ref.piece(ref.pulse(), 4995, 5060))
    figure = plots.modes(machine, result.modes)[0].figure
    figure.draw_without_rendering()
    legend, picture = figure.legends[0].get_window_extent(), figure.bbox
    assert legend.x0 >= picture.x0 and legend.x1 <= picture.x1
    _, below = plots.comparison({"first": result, "second": result})
    assert {text.get_rotation() for text in below.get_xticklabels()} == {60.0}


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


def tone(result: Result, time: np.ndarray, load: np.ndarray) -> SimpleNamespace:
    """A result whose dynamic load is `load` along y, for each carriage."""
    static = result.quantities["static_force"]
    along_y = load[:, None, None] * np.array([0.0, 1.0, 0.0])
    arrays = {"time": time, "static_force": static, "force": static + along_y}
    variables = {name: Quantity((), values, {}) for name, values in arrays.items()}
    return SimpleNamespace(quantities=Quantities(variables, {}))


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


def test_rounding_noise_of_a_load_that_never_moves_does_not_fill_the_picture(machine: Machine) -> None:
    still = simulate(machine, Motion.along_x(TIME, 0 * TIME))
    assert np.ptp(plots.load_z(still, "1a").get_ylim()) > 1e-3
    for picture in (plots.motor_speed, plots.resultant, plots.spectrum):
        ax = picture(still)
        ax.figure.draw_without_rendering()
        low, high = ax.get_ylim()
        assert low < high and all(low <= value <= high for value in ax.lines[0].get_ydata())


def test_equivalent_box_has_the_inertia_of_the_body(machine: Machine) -> None:
    """Eight corners' second moment is 3 times that of the homogeneous box."""
    corners = plots.equivalent_box(machine) - np.array(machine.body.center_of_mass)
    np.testing.assert_allclose(corners.mean(axis=0), 0, atol=1e-15)
    second = machine.body.mass / 3 * (corners.T @ corners) / 8
    inertia = np.trace(second) * np.eye(3) - second
    np.testing.assert_allclose(inertia, machine.body.central_inertia(), rtol=1e-12, atol=1e-9)


def test_scene_shows_loads_at_the_peak(machine: Machine, result: Result) -> None:
    """As the report tells it, also between the instants."""
    ax = plots.scene(machine, result)
    peaks, largest = result.peaks(), result.largest_load()
    text = legend_text(ax)
    assert f"{largest.time:.3f} s" in text
    peak = peaks.loc[largest.name]
    assert f"carriage {largest.name}: {load_with_unit(peak['peak_resultant_N'])}" in text
    sizes = np.linalg.norm(result.data["force"].values[largest.instant], axis=1)
    for name, load in zip(peaks.index, sizes, strict=True):
        if abs(peaks.loc[name, "time_of_peak_s"] - largest.time) > 2 * TIME[1]:
            assert f"carriage {name}: {load_with_unit(load)}" in text
    assert "N per 100 mm" in text and "loads:" in text
    assert "loads:" not in legend_text(plots.scene(machine))
    assert all(label.endswith("[m]") for label in (ax.get_xlabel(), ax.get_ylabel(), ax.get_zlabel()))
    assert len([one for one in ax.collections if isinstance(one, Poly3DCollection)]) == 1 + len(
        machine.carriages
    )


@pytest.mark.parametrize(
    "down", [(0, -9.81, 0), (-9.81, 0, 0), (9.81, 0, 0), (0, 9.81, 1), (0, 1, -9.81), (0, 0, 0)]
)
def test_up_is_against_gravity_and_points_are_drawn(
    machine: Machine, down: tuple[float, float, float]
) -> None:
    tool = PointOfInterest(name="tool", at=(0.1, -0.2, 0.3))
    ax = plots.scene(machine.model_copy(update={"gravity": down, "points": (tool,)}))
    ax.figure.draw_without_rendering()
    middle = np.array([np.mean(limits) for limits in (ax.get_xlim(), ax.get_ylim(), ax.get_zlim())])
    fall = np.array(down if any(down) else (0.0, -1.0, 0.0))
    largest = np.where(np.abs(fall) == np.abs(fall).max(), fall, 0.0)
    higher = middle - 0.1 * largest / np.linalg.norm(largest)
    (x0, y0), (x1, y1) = (
        (seen / seen[3])[:2] for seen in (ax.get_proj() @ [*point, 1] for point in (middle, higher))
    )
    assert y1 > y0 and abs(x1 - x0) < 1e-9
    assert any(np.array_equal(np.ravel(line.get_data_3d()), tool.at) for line in ax.lines)
    assert any("tool" in text.get_text() for text in ax.texts)


def test_scene_has_one_scale(machine: Machine, result: Result) -> None:
    ax = plots.scene(machine, result)
    ax.figure.draw_without_rendering()
    lengths = [np.ptp(limits) for limits in (ax.get_zlim(), ax.get_xlim(), ax.get_ylim())]
    shares = ax._box_aspect / np.array(lengths)  # z, x, y: the picture's axes when y is up
    np.testing.assert_allclose(shares, shares[0], rtol=1e-12)


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


def test_save_all_saves_the_pictures_of_the_result(
    result: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They hold the data that each picture of the result holds by the other tests."""

    def data(ax: matplotlib.axes.Axes) -> list[np.ndarray]:
        return [np.asarray(line.get_data()) for one in ax.figure.axes for line in one.lines]

    saved = {}
    monkeypatch.setattr(plots.saving, "save", lambda ax, path: saved.setdefault(path, ax) and path)
    folder = tmp_path / "new" / "Bilder für Müller"
    assert set(plots.save_all(result, folder)) == {folder / name for name in PICTURES} and folder.is_dir()
    for name, ax in {
        "scene.png": plots.scene(result.machine, result),
        "modes.png": plots.modes(result.machine, result.modes)[0],
        "figures_7_to_11.png": plots.paper_figures(result)[0],
        "resultant.png": plots.resultant(result),
        "moments.png": plots.moments(result),
        "spectrum.png": plots.spectrum(result),
    }.items():
        for drawn, expected in zip(data(saved[folder / name]), data(ax), strict=True):
            np.testing.assert_array_equal(drawn, expected)
    sheet = saved[folder / "figures_7_to_11.png"].figure.axes
    force = result.data["force"].transpose("carriage", "axis", "time").values[:, 1:].reshape(8, -1)
    np.testing.assert_array_equal([ax.lines[0].get_ydata() for ax in sheet[1:]], force)


def test_a_saved_picture_holds_what_was_drawn(tmp_path: Path) -> None:
    figure = Figure(figsize=(2.0, 1.0))
    ax = figure.subfigures(1, 1).add_subplot()
    ax.set_axis_off()
    ax.axhspan(0.0, 0.5, color="#ff0000")
    ax.set_ylim(0.0, 1.0)
    pixels = matplotlib.image.imread(plots.save(ax, tmp_path / "a.png"))[..., :3]
    assert pixels.shape == (DOTS_PER_INCH, 2 * DOTS_PER_INCH, 3)
    red = (pixels == (1.0, 0.0, 0.0)).all(axis=2)
    box = ax.get_position()
    assert red.mean() == pytest.approx(0.5 * box.width * box.height, rel=0.03)
    assert red[DOTS_PER_INCH // 2 :].sum() > 0.9 * red.sum()  # the lower half


SIGNATURES = {
    ".png": b"\x89PNG",
    ".svg": b"<?xml",
    ".pdf": b"%PDF",
    ".eps": b"%!PS",
    ".jpg": b"\xff\xd8",
    ".tif": b"II*\0",
    ".webp": b"RIFF",
}


@pytest.mark.parametrize("ending", PICTURE_ENDINGS)
def test_every_ending_writes_its_format(tmp_path: Path, ending: str) -> None:
    path = plots.save(Figure(figsize=(1.0, 1.0)).add_subplot(), tmp_path / f"a{ending}")
    assert path.read_bytes().startswith(SIGNATURES[ending])


def test_the_area_under_the_damage_is_the_damage() -> None:
    life = life_of(simulate(cart(), moved(GENTLE, 200.0)))
    for line, place in zip(plots.rail_damage(life).lines, life.places, strict=True):
        x, y = (np.asarray(values, dtype=float) for values in line.get_data())
        damage = 1e6 / life.distance * place.damage.sum()
        assert np.sum(y[:-1] * np.diff(x)) == pytest.approx(damage, rel=1e-9)


def test_without_position_the_damage_has_no_place() -> None:
    motion = moved(GENTLE, 200.0)
    unplaced = Motion.along_x(motion.time, motion.acceleration[:, 0], velocity=motion.velocity[:, 0])
    assert "unknown" in plots.rail_damage(life_of(simulate(cart(), unplaced))).texts[0].get_text()


def test_a_picture_that_is_laid_out_first_is_the_same_to_the_pixel(result: Result, tmp_path: Path) -> None:
    """Saving draws it once; Matplotlib alone draws it twice. The figure keeps its layout for the next change."""
    for draw in (plots.resultant, plots.spectrum, lambda one: plots.scene(one.machine, one)):
        figure = draw(result).figure
        figure.savefig(tmp_path / "plain.png", dpi=DOTS_PER_INCH)
        ax = draw(result)
        plots.save(ax, tmp_path / "saved.png")
        np.testing.assert_array_equal(
            matplotlib.image.imread(tmp_path / "saved.png"), matplotlib.image.imread(tmp_path / "plain.png")
        )
        assert ax.figure.get_layout_engine() is not None and ax.figure.dpi == figure.dpi


def test_what_cannot_be_drawn_or_saved_is_refused(machine: Machine, result: Result, tmp_path: Path) -> None:
    motion = Motion.along_x(TIME, MOVE)
    for times in ([], [0.5]):
        few = simulate(machine, motion, times=times)
        with pytest.raises(ArgumentError, match="times: expected at least 2 instants"):
            plots.load_density(few)
        if not times:
            with pytest.raises(ArgumentError, match="times: the result reports no instant"):
                plots.scene(machine, few)
    for compared in (plots.comparison, comparison_report):
        with pytest.raises(ArgumentError, match="results: expected at least one result"):
            compared({})
    axes = plots.load_y(result, "1a")
    for name in ("x.docx", "x"):
        with pytest.raises(ArgumentError, match=f"path: expected a name that ends in .*{name}"):
            plots.save(axes, tmp_path / name)
    for name in ("none/x.png", "\0.png"):
        with pytest.raises(WriteError, match="cannot be written"):
            plots.save(axes, tmp_path / name)
    assert not list(tmp_path.iterdir())
