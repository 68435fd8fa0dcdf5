"""Rails that are not straight excite the body through the feet of the links, by the position of the cart."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from machines import bouncing, having
from numpy.typing import NDArray
from oscillator import free_vibration
from reference import cart, cart_clear, cycle, example, preloaded

from guideload import (
    ArgumentError,
    ConfigError,
    Machine,
    Motion,
    Moves,
    Rail,
    SceneError,
    Study,
    simulate,
)
from guideload.audit.histories import Histories
from guideload.life.load_parts import load_parts
from guideload.machine.straightness import Waviness
from guideload.method_comparison import work_precision
from guideload.motion.motion import refined
from guideload.reports.machine import machine_report

Array = NDArray[np.float64]
WAVES = {"rms": ("10 um", "5 um"), "wavelengths": ("100 mm", "2 m"), "seed": 3}


def on(machine: Machine, *profiles: dict[str, Any]) -> Machine:
    """The machine with these keys of its rails; the last ones hold for all further rails."""
    keys = [*profiles, *[profiles[-1]] * len(machine.rails)]
    rails = (having(rail, **update) for rail, update in zip(machine.rails, keys, strict=False))
    return having(machine, rails=tuple(rails))


def move(speed: str = "1 m/s", distance: str = "1.5 m") -> Motion:
    keys = {"acceleration": "3 m/s^2", "jerk": "60 m/s^3", "dwell": "0.2 s"}
    return Moves(moves=[{"distance": distance, "speed": speed, **keys}]).motion()


def wave(
    length: float, amplitude: float, low: float, high: float, points: int
) -> tuple[tuple[float, ...], ...]:
    x = np.linspace(low, high, points)
    return tuple(
        zip(x.tolist(), (amplitude * np.sin(2.0 * np.pi * x / length)).tolist(), [0.0] * points, strict=True)
    )


def at_constant_speed(time: Array, speed: float, start: float = 0.0) -> Motion:
    still = np.zeros_like(time)
    return Motion.along_x(time, still, velocity=still + speed, position=start + speed * time)


# ---- laws


def test_a_slow_passage_gives_the_loads_at_rest_of_each_place() -> None:
    """Cart and profile: 50 um over 1 m, at 5 mm/s, a thousand times slower than the modes."""
    machine = on(cart(), {"straightness": wave(1.0, 50e-6, -1.0, 2.0, 61)}, {"waviness": WAVES | {"seed": 4}})
    result = simulate(machine, move("5 mm/s", "100 mm"))
    place = result.data["cart_position"].values[:, 0]
    straight = cart().static_carriage_loads
    size = np.abs(machine.static_carriage_loads - straight).max()
    places = range(0, place.size, place.size // 7)
    at_rest = {k: having(machine, rest_at=float(place[k])).static_carriage_loads for k in places}
    for k, here in at_rest.items():
        np.testing.assert_allclose(result.carriage_loads[k], here, atol=2e-3 * size)
    # Not while it starts and stops, which excites vibration.
    steady = slice(place.size // 4, 3 * place.size // 4)
    histories = Histories(result.machine, result.quantities)
    quasi_static = histories.machine.resultants(histories.quasi_static + histories.rail_load)
    np.testing.assert_allclose(
        result.data["resultant"].values[steady], quasi_static[steady], atol=2e-3 * size
    )
    parts = load_parts(result)
    assert np.abs(parts["vibration"][steady]).max() < 2e-3 * size
    # The cause of what the bent rails add at each place is the rails, and the weight is that on straight ones.
    assert "process force" not in parts
    np.testing.assert_allclose(parts["weight"][0], straight, atol=1e-9 * size)
    for k, here in at_rest.items():
        np.testing.assert_allclose(parts["rail error"][k], here - straight, atol=2e-3 * size)


def test_the_static_calculation_knows_no_errors_of_rails() -> None:
    """It is that at rest on straight rails, where the gravity of the machine is g - a."""
    motion, errors = move(distance="0.7 m"), {"waviness": WAVES, "mounting_error": (20e-6, 5e-6)}
    wavy = on(cart(), errors, {"waviness": WAVES | {"seed": 4}})
    gx, gy, gz = cart().gravity
    at_rest = [having(cart(), gravity=(gx - a, gy, gz)) for a in (*np.unique(motion.acceleration[:, 0]), 0.0)]
    by_hand = [np.linalg.norm(one.static_carriage_loads[:, 1:3], axis=1) for one in at_rest]
    result = simulate(wavy, motion)
    models, of_parts = result.audit.simpler_models, load_parts(result).quasi_static
    peak = np.linalg.norm(of_parts[:, :, 1:3], axis=2).max(axis=0)
    for found in (models.quasi_static, peak, models.at_any_time / models.dynamic_factor):
        np.testing.assert_allclose(found, np.max(by_hand, axis=0), rtol=1e-9)
    assert models.dynamic_factor.max() > 1.2
    assert any("is not enough" in line for line in result.audit.lines if line.startswith("static"))


def test_a_constant_profile_is_a_mounting_error() -> None:
    flat = ((-5.0, 20e-6, -4e-6), (0.0, 20e-6, -4e-6), (5.0, 20e-6, -4e-6))
    profile = on(cart(), {"straightness": flat}, {"straightness": ((-5.0, 0.0, 3e-6), (5.0, 0.0, 3e-6))})
    error = on(cart(), {"mounting_error": (20e-6, -4e-6)}, {"mounting_error": (0.0, 3e-6)})
    loads = [simulate(one, move()).carriage_loads for one in (profile, error)]
    np.testing.assert_allclose(loads[0], loads[1], atol=1e-7)


def test_rails_that_rise_are_a_machine_that_turns() -> None:
    """Along rails with the slope s the body follows the motion s x along y as well, to first order in s."""
    slope, motion = 2e-4, move()
    motion = refined(
        motion, np.full(motion.time.size - 1, 10)
    )  # e is a polygon through the stamps: error h^2 k s a / 8
    points = tuple((x, slope * x, 0.0) for x in (-3.0, 0.0, 4.0))
    loads = simulate(on(cart(), {"straightness": points}), motion)
    assert motion.position is not None
    also_up = motion.acceleration.copy()
    also_up[:, 1] = slope * motion.acceleration[:, 0]
    turned = simulate(cart(), Motion(motion.time, also_up)).carriage_loads
    straight = simulate(cart(), motion).carriage_loads
    at = np.searchsorted(loads.data["time"].values, motion.time, side="left")
    change = np.abs(turned - straight).max()
    np.testing.assert_allclose(loads.carriage_loads[at], turned, atol=1e-4 * change)


def test_one_mode_over_a_wave_follows_the_closed_form() -> None:
    """m y'' + b y' + k y = k e + b e' with e = A sin(w t), from rest: transmissibility and transient."""
    mass, k, b, length, speed, amplitude = 100.0, 4e6, 1200.0, 0.05, 0.7, 8e-6
    points = wave(length, amplitude, -0.1, 0.2, 9_001)
    machine = on(bouncing(mass, k, b, length=0.01), {"straightness": points})
    time = np.linspace(0.0, 0.1, 160_001)
    load = simulate(machine, at_constant_speed(time, speed)).data["force"].sel(carriage="1", axis="y").values

    # The two ends of the carriage see the wave before and after its centre.
    e = amplitude * np.cos(np.pi * 0.01 / length)
    w = 2.0 * np.pi * speed / length
    factor = (k + 1j * b * w) / (k - mass * w**2 + 1j * b * w)
    forced = e * factor * np.exp(1j * w * time)
    forced_rate = 1j * w * forced
    y, rate = free_vibration((mass, k, b), time, -forced[0].imag, -forced_rate[0].imag)
    y, rate = y + forced.imag, rate + forced_rate.imag
    wanted = k * (y - e * np.sin(w * time)) + b * (rate - e * w * np.cos(w * time)) - mass * 9.80665
    # 28 000 stamps in a wave: the error of a polygon is (2 pi / 28 000)^2 / 12 = 4e-9 of k e, 1.6e-9 of the load.
    assert np.abs(load - wanted).max() < 5e-9 * np.abs(wanted + mass * 9.80665).max()


def test_doubling_a_profile_doubles_what_it_adds() -> None:
    motion, straight = move(), simulate(cart(), move())
    points = np.array(wave(0.5, 10e-6, -1.0, 3.0, 81))
    added = [
        simulate(on(cart(), {"straightness": points * [1.0, factor, 1.0]}), motion).carriage_loads
        - simulate(on(cart(), {"straightness": points * [1.0, 0.0, 1.0]}), motion).carriage_loads
        for factor in (1.0, 2.0)
    ]
    np.testing.assert_allclose(added[1], 2.0 * added[0], atol=1e-8 * np.abs(straight.carriage_loads).max())


# ---- profiles


def test_a_random_profile_has_its_rms_its_wavelengths_and_its_slope() -> None:
    profile, x = Waviness(**WAVES), np.linspace(0.0, 400.0, 20_001)
    displacement, slope = profile.at(x)
    np.testing.assert_allclose(displacement.std(axis=0), [10e-6, 5e-6], rtol=0.05)
    h = 1e-6
    difference = (profile.at(x + h)[0] - profile.at(x - h)[0]) / (2.0 * h)
    np.testing.assert_allclose(slope, difference, atol=1e-7 * np.abs(slope).max())
    power = np.abs(np.fft.rfft(displacement[:, 0] * np.hanning(x.size))) ** 2
    inside = (np.fft.rfftfreq(x.size, x[1]) > 0.45) & (np.fft.rfftfreq(x.size, x[1]) < 10.5)
    assert power[~inside].sum() < 1e-6 * power.sum()
    np.testing.assert_array_equal(Waviness(**WAVES).at(x)[0], displacement)
    assert np.abs(Waviness(**WAVES | {"seed": 5}).at(x)[0] - displacement).max() > 1e-5


def test_points_may_be_in_a_file(tmp_path: Path) -> None:
    (tmp_path / "rail.csv").write_text(
        "x [mm],dz [um],dy [um]\n-2000,1,0\n0,2,30\n3000,0,0\n", encoding="utf-8"
    )
    text = Path("python/guideload/examples/manipulator.toml").read_text(encoding="utf-8")
    assert text.count('name = "1"') == 1
    (tmp_path / "machine.toml").write_text(
        text.replace('name = "1"', 'name = "1"\nstraightness_file = "rail.csv"'), encoding="utf-8"
    )
    machine = Machine.from_toml(tmp_path / "machine.toml")
    assert machine.rails[0].straightness == ((-2.0, 0.0, 1e-6), (0.0, 30e-6, 2e-6), (3.0, 0.0, 0.0))
    assert (
        "rail 1 is not straight: known from -2 to 3 m, shortest wavelength 8 m"
        in machine_report(machine).text()
    )
    (tmp_path / "rail.csv").write_text("x [mm],dy [um],dz [um]\n0,1,x\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"rails\[0\]\.straightness_file: .*row 2 of .*rail\.csv"):
        Machine.from_toml(tmp_path / "machine.toml")
    (tmp_path / "rail.csv").write_text("x [mm],dy [kg],dz [um]\n0,1,1\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="a length"):
        Machine.from_toml(tmp_path / "machine.toml")
    (tmp_path / "rail.csv").unlink()
    with pytest.raises(ConfigError, match="relative to the machine file"):
        Machine.from_toml(tmp_path / "machine.toml")


# ---- results


def test_bands_are_those_of_the_trace() -> None:
    machine, motion = example()
    long = WAVES | {"wavelengths": ("1 m", "3 m")}
    straight, wavy = simulate(machine, motion), simulate(on(machine, {"waviness": long}), motion)
    at = np.isin(wavy.data["time"].values, motion.time)
    deviations = [one.data["force_sd"].values for one in (straight, wavy)]
    np.testing.assert_allclose(deviations[1][at], deviations[0], rtol=1e-6, atol=1e-6)


# ---- refusals


@pytest.mark.parametrize("make", [cart_clear, preloaded])
def test_links_that_are_not_linear_are_refused(make: Any) -> None:
    with pytest.raises(ArgumentError, match="rail 1 is not straight, but the machine is .*linear links only"):
        simulate(on(make(), {"waviness": WAVES}), move())


def test_what_is_not_known_is_refused() -> None:
    wavy = on(cart(), {"waviness": WAVES})
    blind = Motion(move().time, move().acceleration)
    with pytest.raises(ArgumentError, match="expected a motion with position and velocity"):
        simulate(wavy, blind)
    short = on(cart(), {"straightness": ((-0.7, 0.0, 0.0), (1.0, 1e-5, 0.0))})
    with pytest.raises(
        SceneError,
        match=r"rail 1: straightness: expected points from .* to 1\.06 m, where carriage 1a runs, .*-0.7 to 1 m",
    ):
        simulate(short, move())
    with pytest.raises(SceneError, match="rest_at"):
        _ = on(cart(), {"straightness": ((1.0, 0.0, 0.0), (2.0, 1e-5, 0.0))}).scene
    with pytest.raises(ConfigError, match="straight rails in a study"):
        Study(
            machine=wavy,
            motion=cycle(),
            samples=8,
            seed=1,
            vary=[{"path": "body.mass", "distribution": "normal", "sigma": "1 %"}],
        )
    with pytest.raises(ArgumentError, match="straight rails only"):
        work_precision(wavy, move())
    fine = on(cart(), {"waviness": WAVES | {"wavelengths": ("1 um", "2 m")}})
    with pytest.raises(ArgumentError, match="stamps, more than 5000000"):
        simulate(fine, move())


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"straightness": [[0.0, 0.0, 0.0]]}, "at least two points"),
        ({"straightness": [[0.0, 0.0, 0.0], [0.0, 1e-6, 0.0]]}, "ascending order of x"),
        ({"straightness": [[0.0, 0.0], [1.0, 1e-6]]}, r"\[x, dy, dz\]"),
        ({"straightness_file": "rail.csv"}, "no straightness_file in code"),
        ({"waviness": WAVES | {"wavelengths": ("2 m", "1 m")}}, "the first below the second"),
        ({"waviness": {"rms": (1e-5, 1e-5), "wavelengths": (0.1, 1.0)}}, "seed"),
        ({"waviness": WAVES | {"rms": (-1e-5, 1e-5)}}, r"rms\[0\]: expected >= 0 m"),
        *(
            ({"waviness": WAVES | {"seed": seed}}, "seed: expected a whole number")
            for seed in ("7", True, 2.0)
        ),
    ],
)
def test_impossible_profiles_are_refused(keys: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        Rail(name="1", position=(0.0, 0.0), **keys)
