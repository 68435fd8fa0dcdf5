"""Laws of the warnings: each limit has a scene beyond it that is told, and no example or real trace is beyond one."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import lives
import numpy as np
import pytest
from command_line import EXAMPLES, MACHINE, guideload
from machines import with_mass
from moves import GENTLE, Move

from guideload import (
    Drive,
    Inspection,
    Machine,
    Motion,
    Moves,
    Result,
    motion_from_trace,
    read_trace,
    simulate,
)
from guideload.audit.motion_plausibility import longest_move, motion_warnings
from guideload.audit.plausibility import machine_warnings
from guideload.base.warnings import LIMITS, WarningText, verdict
from guideload.catalogue.product import Product
from guideload.cli.inputs import MACHINE_KINDS
from guideload.cli.templates import FILES
from guideload.reports.machine import machine_report
from guideload.reports.run import result_report
from guideload.reports.trace import encoder_report

Found = Iterable[str]
MOVES = Moves.from_texts(["distance=0.6 m, speed=1 m/s, acceleration=2 m/s^2, jerk=50 m/s^3"])
TIME = np.arange(2000) * 1e-3
SWEEP = 0.1 * (1.0 - np.cos(2.0 * np.pi * TIME))  # m
MINUTES = Motion.along_x(TIME, 2.0 * np.cos(TIME), velocity=0.12 * np.sin(TIME))  # a speed in km/min


def machine(**changes: Any) -> Machine:
    """The packaged example of two rails, with changes of the machine or, beyond that, of all its carriages."""
    given = Machine.from_toml(EXAMPLES / "machine.toml")
    of_carriages = {key: changes.pop(key) for key in [*changes] if key not in Machine.model_fields}
    carriages = [type(one)(**{**dict(one), **of_carriages}) for one in given.carriages]
    return Machine(**{**dict(given), "carriages": carriages, **changes})


def scaled(**factors: float) -> Machine:
    """The example with numbers of its carriages times a factor."""
    one = machine().carriages[0]
    return machine(**{key: factor * getattr(one, key) for key, factor in factors.items()})


def estimated() -> Machine:
    """A vertical axis with a product whose stiffness the catalogue does not print."""
    stated = ("length", "width", "stiffness")
    lines = (EXAMPLES / "kinds" / "vertical.toml").read_text(encoding="utf-8").splitlines()
    text = "\n".join(line for line in lines if not line.startswith(stated))
    wagon = "[carriage_types.wagon]"
    text = text.replace(wagon, f'{wagon}\nproduct = "SHS25C"\npreload_class = "C0"')
    with TemporaryDirectory() as folder:
        file = Path(folder) / "machine.toml"
        file.write_text(text, encoding="utf-8")
        return Machine.from_toml(file)


def rated(mass: float = 1250.0, **drive: Any) -> Machine:
    """A cart with a product."""
    cart = lives.cart(drive=Drive(gear_ratio=12.0, pinion_diameter=0.1273, **drive))
    return with_mass(cart, mass)


def static_in_newtons() -> Machine:
    """A cart with a product whose static rating has N in place of kN; so light that it is no load at rest."""
    product = Product(**{**lives.PRODUCT, "static": "60 N"})
    return rated(10.0).model_copy(update={"products": (product,)})


def moments_in_kilonewtons() -> Machine:
    """A cart with a product whose rated moments have kN m in place of N m."""
    moments = {"roll": 0.6, "pitch": 0.5, "yaw": 0.5}
    product = Product(**{**lives.PRODUCT, "static_moments": moments})
    return lives.cart().model_copy(update={"products": (product,)})


def with_empty_rail() -> Machine:
    bare = machine()
    return bare.model_copy(update={"rails": (*bare.rails, bare.rails[0].model_copy(update={"name": "3"}))})


def heavier_to_turn(factor: float) -> Machine:
    """The cart with so many times its moments of inertia."""
    body = machine().body
    inertia = (factor * body.central_inertia()).tolist()
    update = {"inertia": inertia, "inertia_about": "center_of_mass"}
    return machine().model_copy(update={"body": body.model_copy(update=update)})


def rails_swapped() -> Machine:
    """The cart with y and z of its rails exchanged."""
    rails = [one.model_copy(update={"position": one.position[::-1]}) for one in machine().rails]
    return machine().model_copy(update={"rails": tuple(rails)})


def record(value: np.ndarray, time: np.ndarray = TIME, **options: Any) -> Motion:
    return motion_from_trace(
        read_trace({"t": time, "q": value}, kind="position", unit="m", time="t", **options)
    )


def noisy() -> np.ndarray:
    return SWEEP + np.random.default_rng(0).normal(0.0, 5e-3, SWEEP.size)


def stuck() -> np.ndarray:
    value = SWEEP.copy()
    value[301:304] = value[300]
    return value


def run(given: Machine, motion: Motion | None = None, **options: Any) -> Found:
    return result_report(simulate(given, motion or MOVES.motion(), **options)).warnings


def at_samples(motion: Motion) -> Found:
    return run(machine(), motion, times=motion.time[:-1])


def two_columns(speed: float = 1.0, **options: Any) -> Motion:
    """A move, its position and the speed times a factor, every 4 ms."""
    time = np.arange(1000) * 4e-3
    place, velocity, _ = GENTLE.motion(time)
    columns = {"t_s": time, "x_position_m": place, "x_velocity_m_s": speed * velocity}
    return motion_from_trace(read_trace(columns, column="x_position_m", **options))


def softer() -> Machine:
    """A vertical axis with the stiffness of the template beside a product."""
    text = (EXAMPLES / "kinds" / "vertical.toml").read_text(encoding="utf-8")
    wagon = "[carriage_types.wagon]"
    text = text.replace(wagon, f'{wagon}\nproduct = "HGH25CA"\npreload_class = "ZA"')
    return Machine.from_text(text)


def not_judged() -> Found:
    found = simulate(machine(), MOVES.motion(), "rk45", times=np.arange(400) * 1.1e-3)
    return Result(found.machine, found.data.drop_dims("motion_time")).audit.warnings


def lost(motion: Motion, step: int) -> Motion:
    """Every so many samples of a motion."""
    kept = {key: getattr(motion, key)[::step] for key in ("time", "acceleration", "velocity", "position")}
    return replace(motion, **kept)


def ringing() -> Motion:
    """A push that sets the fastest mode ringing, known exactly at three instants per period."""
    rate = 3.0 * float(simulate(machine(), MOVES.motion()).modes.frequency.max())
    time = np.arange(200) / rate
    jumps = np.repeat(time, 2)[1:-1]
    return Motion.along_x(jumps, np.repeat(np.where(np.arange(199) % 60 < 30, 6.0, -6.0), 2), exact=True)


# By the key of the limit: what is told of a scene made for it, and words of the sentence with its number.
SCENES: dict[str, tuple[Callable[[], Found], str]] = {
    "distance": (
        lambda: machine_warnings(machine(x=90.0)),
        "carriages[0].x is 90 m, beyond 20 m: is it in mm?",
    ),
    "distance in lengths": (lambda: machine_warnings(scaled(length=1e-3)), "beyond 500 times the length"),
    "inertia": (
        lambda: machine_warnings(heavier_to_turn(1e3)),
        "mm from its centre: are mass in kg and inertia in kg m2?",
    ),
    "overlap": (
        lambda: machine_warnings(machine(length=3.0)),
        "mm apart, their length is 3000 mm: is x that of the centre",
    ),
    "stacked rails": (
        lambda: machine_warnings(rails_swapped()),
        "mm apart along y of their carriages, so one stands above the other",
    ),
    "load at rest": (
        lambda: machine_warnings(rated(6e4)),
        "at rest, more than its static load rating C0 of 60 kN",
    ),
    "load ratings": (
        lambda: machine_warnings(static_in_newtons()),
        "C0 of 20 is 60 N, 0.00189 times its dynamic one for 100 km, 31.7 kN",
    ),
    "rated moments": (
        lambda: machine_warnings(moments_in_kilonewtons()),
        "roll moment of 20, 0.6 N m, is its C0 at an arm of 0.01 mm",
    ),
    "empty rail": (
        lambda: machine_warnings(with_empty_rail()),
        "no carriage runs on rail 3: is one forgotten",
    ),
    "unused type": (
        lambda: machine_warnings(machine().model_copy(update={"carriage_types": {"L2": {"length": 0.1}}})),
        "no carriage names the carriage type L2: does a carriage lack its key type",
    ),
    "sag": (lambda: machine_warnings(scaled(stiffness_y=1e-3)), "mm: are stiffness in N/m and mass in kg"),
    "frequency": (
        lambda: machine_warnings(scaled(stiffness_y=1e-6, stiffness_z=1e-6)),
        "outside 2 to 5000 Hz",
    ),
    "damping": (lambda: machine_warnings(scaled(damping_y=0.1, damping_z=0.1)), "outside 0.5 to 15 %"),
    "clearance": (lambda: machine_warnings(machine(clearance_y=5.0)), "5000 mm to either side: is it in m?"),
    "gravity": (
        lambda: machine_warnings(machine(gravity=(0.0, -1.0, 0.0))),
        "gravity is 1 m/s2, not 9.81 m/s2: is it in m/s2",
    ),
    "weight on the side": (
        lambda: machine_warnings(machine(gravity=(0.0, 0.0, -9.80665))),
        "100 % of gravity acts on the sides of all carriages (z)",
    ),
    "weight on the constraint": (
        lambda: machine_warnings(machine().with_free(["rx", "ry", "rz"])),
        "y of L is held",
    ),
    "free at rest": (lambda: machine_warnings(machine(clearance_z=5e-6)), "free within its clearance in z"),
    "estimated stiffness": (
        lambda: machine_warnings(estimated()),
        "stiffness of all carriages (SHS25C C0) estimated, within 30 %",
    ),
    "own stiffness": (
        lambda: machine_warnings(softer()),
        "220 N/um instead of 539 N/um of HGH25CA ZA; the machine file counts",
    ),
    "open row": (lambda: run(machine(preload_y=10.0, rolling="ball")), "times the preload would keep"),
    "speed": (
        lambda: motion_warnings(record(1e3 * SWEEP)),
        "m/s, beyond 10 m/s: is the column in mm (--unit",
    ),
    "acceleration": (
        lambda: motion_warnings(record(1e3 * SWEEP)),
        "m/s2, beyond 98.0665 m/s2: is the column in mm (--unit",
    ),
    "travel": (
        lambda: motion_warnings(record(1e3 * SWEEP)),
        "moves over 200 m, beyond 20 m: is the column in mm (--unit",
    ),
    "time of a move": (lambda: motion_warnings(record(SWEEP, 2e3 * TIME)), "a move lasts"),
    "no motion": (lambda: motion_warnings(record(0.0 * TIME)), "the cart does not move"),
    "velocity": (
        lambda: motion_warnings(MINUTES),
        "1.88 m/s, 94 % of the largest",
    ),
    "position": (
        lambda: motion_warnings(
            Motion.along_x(TIME, np.cos(TIME), velocity=np.sin(TIME), position=-np.cos(TIME / 2))
        ),
        "of the largest: is one of them in another unit",
    ),
    "gap": (
        lambda: motion_warnings(
            record(np.delete(SWEEP, slice(300, 330)), np.delete(TIME, slice(300, 330)), repair="all")
        ),
        "1 gap in time",
    ),
    "other speed": (
        lambda: motion_warnings(two_columns(speed=2.0)),
        "has 2 times the speed by column x_position_m: check unit, scale and sign",
    ),
    "other rate": (
        lambda: motion_warnings(two_columns(rate="10 Hz")),
        "has samples every 4 ms, the given rate every 100 ms",
    ),
    "suspect samples": (
        lambda: motion_warnings(record(stuck(), max_speed="20 m/s")),
        "3 samples repeat the value before",
    ),
    "noise": (lambda: motion_warnings(record(noisy())), "% of the signal's range"),
    "hidden load": (lambda: run(machine(), replace(lost(MOVES.motion(), 40), exact=False)), "Record at"),
    "not judged": (not_judged, "Not judged: "),
    "rotation": (lambda: run(scaled(stiffness_y=1e-4)), "the body rotates by"),
    "sudden start": (
        lambda: run(machine(), Motion.along_x(TIME, np.where(TIME < 1.0, 2.0, -2.0))),
        "the motion begins",
    ),
    "samples": (lambda: at_samples(lost(MOVES.motion(), 10)), "Leave times out"),
    "missed vibration": (lambda: at_samples(ringing()), "Leave times out"),
    "motor": (
        lambda: run(rated(rated_torque=1e-3), lives.moved(Move(1.0, 2.0, 50.0))),
        "the motor overheats",
    ),
    "motor speed": (
        lambda: run(rated().model_copy(update={"drive": Drive(screw_lead="2 mm")})),
        "rpm, beyond 10 000 rpm: is the travel per turn right",
    ),
    "life": (lambda: run(rated(10.0), lives.moved(Move(1.0, 2.0, 50.0))), "beyond 1 000 000 h"),
}


# The other warnings of a scene, by its key.
OF_UNITS = {"sag", "frequency", "damping"}
TOGETHER = {
    "distance": {"inertia", "overlap", *OF_UNITS},
    "inertia": {"damping"},
    "load at rest": {"damping"},
    "load ratings": {"damping", "inertia", "rated moments"},
    "rated moments": {"damping"},
    "sag": {"damping"},
    "frequency": {"damping", "sag"},
    "clearance": {"sag"},
    "estimated stiffness": {"damping"},
    "speed": {"travel", "acceleration"},
    "acceleration": {"travel", "speed"},
    "travel": {"speed", "acceleration"},
    "time of a move": {"acceleration"},
    "gap": {"acceleration"},
    "other rate": {"other speed"},
    "suspect samples": {"acceleration"},
    "rotation": OF_UNITS,
    "missed vibration": {"sudden start"},
    "motor": {"damping"},
    "motor speed": {"damping"},
    "life": {"inertia", "damping"},
}


def keys(found: Found) -> set[str]:
    return {text.key for text in found if isinstance(text, WarningText)}


def test_a_run_tells_of_histories_that_do_not_belong_together() -> None:
    (text,) = motion_warnings(MINUTES)
    assert str(text) in simulate(machine(), MINUTES).audit.warnings
    whole = simulate(machine(), replace(MINUTES, velocity=MINUTES.velocity / 0.06), times=TIME[::500])
    assert not any("integral" in text for text in whole.audit.warnings)  # of the stamps, not of the instants


def test_a_run_at_rest_is_told_unless_forces_act() -> None:
    rest = Motion.along_x(TIME, 0.0 * TIME)
    assert any("does not move" in text for text in simulate(machine(), rest).audit.warnings)
    for motion in (rest.with_force((0, 0, 0), (0, 50.0, 0)), replace(rest, velocity=rest.acceleration + 0.5)):
        assert "no motion" not in keys(motion_warnings(motion))


def test_every_limit_has_a_scene() -> None:
    assert [*SCENES] == [*LIMITS]


@pytest.mark.parametrize("key", LIMITS)
def test_a_scene_beyond_a_limit_is_told_with_its_number_and_nothing_else(key: str) -> None:
    scene, words = SCENES[key]
    found = [*scene()]
    assert found
    told = [text for text in found if isinstance(text, WarningText) and text.key == key]
    assert len(told) == 1, found
    assert keys(found) == {key} | TOGETHER.get(key, set())
    assert all(
        isinstance(text, WarningText) or text.startswith("Warning: no preload is known") for text in found
    )
    assert words in told[0].replace("\u202f", " ")
    assert "e+" not in told[0]  # as in 1.25e+03 Hz
    assert any(sign.isdigit() for sign in told[0]) or key in ("free at rest", "not judged")


# ---- no false alarms


@pytest.mark.parametrize("kind", MACHINE_KINDS)
def test_machines_of_init_have_no_warnings(kind: str) -> None:
    given = Machine.from_toml(EXAMPLES / FILES[kind])
    assert not machine_report(given).warnings
    assert not result_report(simulate(given, Moves.from_toml(EXAMPLES / "moves.toml").motion())).warnings


def test_the_examples_have_no_warnings() -> None:
    manipulator = Machine.from_toml(EXAMPLES / "manipulator.toml")
    trace = read_trace(EXAMPLES / "manipulator.csv")
    assert not encoder_report(Inspection.of(trace, manipulator)).warnings
    for given in (manipulator, machine()):
        for motion in (
            motion_from_trace(trace, given.drive),
            Moves.from_toml(EXAMPLES / "moves.toml").motion(),
        ):
            assert not machine_report(given).warnings and not result_report(simulate(given, motion)).warnings


def test_real_traces_have_no_warnings(shared_data: Path) -> None:
    """But for what their smoothing doubts: one axis of the mill, at 10 Hz, is noisy and twice 0 between moves."""
    emps = read_trace(shared_data / "emps_bangbang_1kHz.csv")
    assert not encoder_report(Inspection.of(emps)).warnings
    assert not result_report(simulate(machine(), motion_from_trace(emps))).warnings
    options = {"column": "Z1_ActualVelocity", "unit": "mm/s", "rate": 10, "cross_check": False}
    mill = read_trace(shared_data / "michigan_cnc_experiment_01.csv", **options)
    assert keys(motion_warnings(motion_from_trace(mill))) <= {"suspect samples", "noise"}


# ---- single laws


def test_a_header_in_the_wrong_unit_is_told_in_reports_and_in_the_check(tmp_path: Path) -> None:
    """Millimetres under [m], and milliseconds under [s], as a log may have them."""
    for factors, question in (((1e3, 1.0), "is the column in mm (--unit"), ((1.0, 1e3), "is the time in ms")):
        file = tmp_path / "log.csv"
        rows = (f"{t},{q:.9f}" for t, q in zip(factors[1] * TIME, factors[0] * SWEEP, strict=True))
        file.write_text("t [s],q [m]\n" + "\n".join(rows), encoding="utf-8")
        for command in (
            ["check", MACHINE, file],
            ["encoder", file],
            ["run", MACHINE, file, "-o", tmp_path / "out"],
        ):
            options = ["--no-pictures", "--overwrite"] if command[0] == "run" else []
            head = guideload(*command, *options).stdout.split("free y, z")[0].split("Trace\n")[0]
            assert question in " ".join(head.split()), command


@pytest.mark.parametrize("speed", [0.5, -0.02])
def test_the_longest_move_is_that_of_the_planned_moves(speed: float) -> None:
    """Speeds below the standstill share are left out at both ends: with a trapezoid, 1 % of the ramps."""
    time = np.linspace(0.0, 12.0, 12001)
    velocity = speed * np.clip(np.minimum(time - 1.0, 9.0 - time), 0.0, 1.0) - 0.5 * speed * (time > 10.0)
    assert longest_move(time, velocity) == pytest.approx(8.0 - 2 * 0.01, abs=2e-3)


def test_a_cart_that_is_held_or_reported_at_rest_is_not_slow() -> None:
    held = record(1e-6 * np.round(np.random.default_rng(2).normal(0.0, 1.0, TIME.size)))
    constant = Motion.along_x(TIME, 0.0 * TIME, velocity=0.0 * TIME + 0.5, position=0.5 * TIME)
    assert "acceleration" not in keys([*motion_warnings(held), *motion_warnings(constant)])
    rest = simulate(machine(), MOVES.motion(), times=[0.0, 1e-9]).audit.warnings
    assert "acceleration" not in keys(rest)


def test_carriages_side_by_side_do_not_overlap_and_nearer_ones_do() -> None:
    """Of one rail only: each has a neighbour beside it on the other. The length is that of the product."""
    given = lives.cart()
    first, second = (one for one in given.carriages if one.rail == given.carriages[0].rail)
    product = given.products[0].model_copy(update={"carriage_length": 0.08})

    def found(apart: float) -> set[str]:
        moved = second.model_copy(update={"x": first.x + apart})
        carriages = [moved if one is second else one for one in given.carriages]
        changes = {"carriages": carriages, "products": (product,)}
        return keys(machine_warnings(given.model_copy(update=changes)))

    assert "overlap" not in found(0.08) | found(-0.08)
    assert "overlap" in found(0.0799) & found(-0.0799) & found(0.0)


def test_damping_of_roll_on_one_rail_is_explained_not_asked_about() -> None:
    kind = Machine.from_toml(EXAMPLES / "kinds" / "one-rail.toml")
    carriages = [one.model_copy(update={"damping_y": 0.5 * one.damping_y}) for one in kind.carriages]
    (text,) = machine_warnings(kind.model_copy(update={"carriages": carriages}))
    assert "roll on one rail, which the rows at width/2 damp with damping_y" in text and "?" not in text
    (other,) = machine_warnings(scaled(damping_y=0.1, damping_z=0.1))
    assert "roll on one rail" not in other


def test_a_warning_keeps_its_key_in_a_copy() -> None:
    text = WarningText("speed", "fast")
    again = pickle.loads(pickle.dumps(text))
    assert (again, again.key) == ("fast", "speed")
    with pytest.raises(KeyError):
        WarningText("unknown", "")
    assert [verdict(["a"] * count) for count in range(3)] == ["No warnings.", "1 warning:", "2 warnings:"]


def test_the_table_of_the_docs_is_that_of_the_code() -> None:
    page = (Path(__file__).resolve().parents[2] / "docs" / "methods.md").read_text(encoding="utf-8")
    assert all(f"| {limit.figure} | {limit.text} | {limit.reason} |" in page for limit in LIMITS.values())
