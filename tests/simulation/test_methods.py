"""The three methods against each other and against independent solvers; what simulate accepts and refuses."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any

import numpy as np
import pytest
import reference as ref
import scipy.signal
from machines import with_carriages
from numpy.typing import NDArray
from reference import DOFS

from guideload import ArgumentError, GuideloadError, Machine, Motion, RunError, peak_loads, simulate
from guideload.motion.motion import refined

Array = NDArray[np.float64]

MACHINES: dict[str, Callable[[], Machine]] = {
    "cart": ref.cart,
    "cart_stiff": ref.cart_stiff,
    "paper": ref.paper,
    "random damped": lambda: ref.random_machine(4, free=("y", "z", "rx", "ry", "rz"), carriages=3),
    "random undamped": lambda: ref.random_machine(6, damping=0.0, free=DOFS),
}
MOTIONS: dict[str, Callable[[], Motion]] = {
    "clean": lambda: ref.piece(ref.cycle(), 560, 860),  # rest, jerk, constant acceleration
    "noisy": lambda: ref.piece(ref.noisy(), 560, 860),
    "forces, jumps, uneven": lambda: ref.random_motion(8, wrench=True, times="ticks", jumps=True),
}


@cache
def machine_of(name: str) -> Machine:
    return MACHINES[name]()


@cache
def motion_of(name: str) -> Motion:
    return MOTIONS[name]()


@cache
def exact_loads(machine: str, motion: str) -> Array:
    return link_loads(machine_of(machine), motion_of(motion), "exact")


def link_loads(machine: Machine, motion: Motion, method: str, **options: Any) -> Array:
    loads: Array = (
        simulate(machine, motion, method, **({"times": motion.time} | options)).data["link_load"].values
    )
    return loads


def load_error(machine: Machine, motion: Motion, method: str, expected: Array, **options: Any) -> float:
    """Largest error of a link load over the load scale that rtol refers to."""
    data = simulate(machine, motion, method, **({"times": motion.time} | options)).data
    return float(np.abs(data["link_load"].values - expected).max() / data.attrs["load_scale_N"])


# ---- against each other


@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8, 1e-10])
@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("machine", MACHINES)
def test_methods_agree_within_ten_times_the_tolerance(machine: str, motion: str, rtol: float) -> None:
    for method in ("rk45", "implicit"):
        error = load_error(
            machine_of(machine), motion_of(motion), method, exact_loads(machine, motion), rtol=rtol
        )
        print(f"\n{machine}, {motion}, {method}, rtol {rtol:g}: {error / rtol:.2g} x rtol", end="")
        assert error <= 10.0 * rtol


@pytest.mark.parametrize("method", ["rk45", "implicit"])
def test_error_falls_with_a_fixed_step(method: str) -> None:
    """A fixed step of h / 2 and h / 4: the error falls by 2^5 (rk45); Radau IIA of order 9 is at rounding."""
    machine, motion = machine_of("cart"), motion_of("noisy")
    expected = exact_loads("cart", "noisy")
    coarse, fine = (load_error(machine, motion, method, expected, step=s) for s in (0.5e-3, 0.25e-3))
    assert fine <= coarse / 2.0**4.5 or fine <= 1e-13
    assert coarse <= 1e-3
    taken = [
        simulate(machine, motion, method, step=s).data.attrs["steps"] for s in (1e-3, 0.25e-3, 0.3e-3, 1.0)
    ]
    intervals = motion.time.size - 1
    # No step passes a sample, and 0.3 ms does not divide 1 ms: four equal steps of 0.25 ms.
    assert taken == [intervals, 4 * intervals, 4 * intervals, intervals]
    assert simulate(machine, motion, method, step=1e-3).data.attrs["step_s"] == 1e-3


def test_a_fixed_step_outside_the_stability_region_is_an_error_and_no_result() -> None:
    # 3.6e4 1/s times 1 ms is far outside the region of rk45 (3.3); the stiffly accurate method takes it.
    machine, motion = machine_of("cart_stiff"), motion_of("clean")
    with pytest.raises(RunError, match=r"t = 0\.\d+ s with a step of 1\.000e-3 s.*stability region.*exact"):
        simulate(machine, motion, "rk45", step=1e-3)
    assert load_error(machine, motion, "implicit", exact_loads("cart_stiff", "clean"), step=1e-3) < 1e-4


def test_an_error_advises_only_a_method_that_the_scene_allows() -> None:
    time = np.arange(60) * 0.05
    with pytest.raises(RunError, match='or use method "implicit"$'):
        simulate(ref.preloaded(), Motion.along_x(time, np.sin(time)), "rk45", step=0.05)


# ---- against SciPy


def state_space(machine: Machine) -> tuple[Array, Array, Array, Array]:
    """A, B of x = (q - q_rest, q') with the excitation a; C to link loads; static link loads."""
    m, c, k, weight, rows = ref.matrices(machine)
    free = [DOFS.index(dof) for dof in machine.free]
    n = len(free)
    square = np.ix_(free, free)
    inverse = np.linalg.inv(m[square])
    a = np.zeros((2 * n, 2 * n))
    a[:n, n:] = np.eye(n)
    a[n:, :n], a[n:, n:] = -inverse @ k[square], -inverse @ c[square]
    b = np.zeros((2 * n, 3))
    b[n:] = -inverse @ m[free, :3]
    table = machine.link_table()
    d = rows[:, free]
    recovery = np.hstack([table.stiffness[:, None] * d, table.damping[:, None] * d])
    static = table.stiffness * (d @ np.linalg.solve(k[square], weight[free]))
    return a, b, recovery, static


@pytest.mark.parametrize("motion", ["clean", "noisy"])
@pytest.mark.parametrize("machine", MACHINES)
def test_exact_agrees_with_scipy_lsim(machine: str, motion: str) -> None:
    a, b, recovery, static = state_space(machine_of(machine))
    system = scipy.signal.StateSpace(a, b, recovery, np.zeros((recovery.shape[0], 3)))
    part = motion_of(motion)
    time = np.arange(part.time.size) * 1e-3
    _, dynamic, _ = scipy.signal.lsim(system, part.acceleration, time, interp=True)
    expected = exact_loads(machine, motion)
    # lsim takes the exponential of metres and seconds as they stand, and so loses some digits.
    assert np.abs(static + dynamic - expected).max() <= 1e-9 * np.abs(expected).max()


# ---- output times


@pytest.mark.parametrize(("method", "rtol"), [("exact", 1e-12), ("rk45", 1e-6), ("implicit", 1e-6)])
def test_loads_between_the_samples(method: str, rtol: float) -> None:
    machine, motion = machine_of("cart"), motion_of("noisy")
    times = np.sort(np.random.default_rng(0).uniform(motion.time[0], motion.time[-1], 400))
    times = np.concatenate([motion.time[:1], times, motion.time[-1:]])
    stamps = np.union1d(motion.time, times)  # further samples where the motion is linear anyway
    finer = Motion.along_x(stamps, np.interp(stamps, motion.time, motion.acceleration[:, 0]))
    data = simulate(machine, finer, "exact", times=finer.time).data
    expected = data["link_load"].values[np.searchsorted(finer.time, times)]
    assert load_error(machine, motion, method, expected, times=times, rtol=rtol) <= 10.0 * rtol
    got = simulate(machine, motion, method, times=times).data
    assert np.array_equal(got["time"].values, times)
    at = np.interp(times, motion.time, motion.acceleration[:, 0])
    assert got["cart_acceleration"].values[:, 0] == pytest.approx(at, abs=1e-12)


@pytest.mark.parametrize("method", ["exact", "rk45", "implicit"])
def test_times_at_the_samples_are_the_samples(method: str) -> None:
    machine, motion = machine_of("cart"), motion_of("clean")
    loads = link_loads(machine, motion, method)
    # All samples would be no output between steps.
    again = link_loads(machine, motion, method, times=motion.time[:-1])
    assert np.abs(again - loads[:-1]).max() <= 1e-12 * np.abs(loads).max()


@pytest.mark.parametrize("machine", [ref.cart, ref.cart_clear])
@pytest.mark.parametrize("motion", MOTIONS)
def test_some_samples_and_some_twice_are_the_samples(machine: Callable[[], Machine], motion: str) -> None:
    """Also the two stamps of a jump."""
    time = motion_of(motion).time
    loads = link_loads(machine(), motion_of(motion), "exact")
    chosen = np.sort(np.random.default_rng(1).integers(0, time.size, time.size))
    some = link_loads(machine(), motion_of(motion), "exact", times=time[chosen])
    assert np.abs(some - loads[chosen]).max() <= 1e-12 * np.abs(loads).max()


def test_the_last_sample_may_be_asked_for_on_every_uniform_grid() -> None:
    time = (np.arange(168) + 37) / 1000.0
    motion = Motion.along_x(time, np.zeros(time.size))
    assert simulate(machine_of("cart"), motion, times=time).data["time"].values[-1] == time[-1]


def test_times_at_a_jump_and_a_single_time_and_none() -> None:
    machine = machine_of("cart")
    motion = Motion.along_x([0.0, 0.1, 0.1, 0.2], [0.0, 0.0, 1.0, 1.0])
    data = simulate(machine, motion, times=[0.1]).data
    assert data["link_load"].values[0] == pytest.approx(data["static_link_load"].values, rel=1e-12)
    assert simulate(machine, motion, times=[]).data.sizes["time"] == 0
    assert simulate(machine, motion, times=[0.05, 0.05]).data.sizes["time"] == 2


# ---- the same numbers with and without histories

MIXED: dict[str, Any] = {"preload_y": 1200.0, "rolling": "ball", "clearance_z": 3e-6}
LAWS: dict[str, Callable[[], Machine]] = {
    "linear": ref.cart,
    "linear, extra links": lambda: machine_of("random damped"),
    "play": ref.cart_clear,
    "preloaded": ref.preloaded,
    "a preload far above the loads": lambda: ref.preloaded(1e9),
    "rollers": lambda: ref.cart(preload_y=1200.0, preload_z=900.0, rolling="roller"),
    "balls and rollers": lambda: _with_balls(ref.cart(preload_y=900.0, preload_z=900.0, rolling="roller")),
    "preload and play": lambda: ref.cart(**MIXED),
    "preload and play, damped in contact": lambda: ref.cart(**MIXED, damping_in_contact=True),
}


def _with_balls(machine: Machine) -> Machine:
    """The machine with balls in its first carriage."""
    return with_carriages(machine, machine.carriages[0].name, rolling="ball")


@pytest.mark.parametrize("laws", LAWS)
@pytest.mark.parametrize("method", ["auto", "exact", "rk45", "implicit"])
@pytest.mark.parametrize("motion", ["noisy", "forces, jumps, uneven"])
def test_peak_loads_are_those_of_a_dense_run(laws: str, method: str, motion: str) -> None:
    """None of 15 instants between each two samples exceeds them, and at its time the load is as large as they say."""
    machine, given = LAWS[laws](), motion_of(motion)
    is_smooth = machine.scene.model_level == "smooth nonlinear"
    if is_smooth and method == "exact":
        return
    dense = refined(given, np.where(np.diff(given.time) > 0.0, 16, 1))
    for rtol in (1e-3, 1e-7):
        is_exact = not is_smooth and method in ("auto", "exact")
        error = 1e-11 if is_exact else 10.0 * rtol
        found = peak_loads(machine, given, method, rtol=rtol)
        loads = simulate(machine, dense, method, rtol=rtol).carriage_loads
        scale = np.abs(loads).max(axis=0)
        scale = np.stack([scale[:, :3].max(axis=1)] * 3 + [scale[:, 3:].max(axis=1)] * 3, axis=1)
        assert (found.largest[:, :6] >= loads.max(axis=0) - error * scale).all()
        assert (found.smallest[:, :6] <= loads.min(axis=0) + error * scale).all()
        if not is_exact:
            continue  # between its steps a method has errors of its own
        at = np.unique([found.time_of_largest[:, :6], found.time_of_smallest[:, :6]])
        there = simulate(machine, given, method, times=at).carriage_loads
        for values, times in (
            (found.largest, found.time_of_largest),
            (found.smallest, found.time_of_smallest),
        ):
            place = at.searchsorted(times[:, :6])
            carriage, axis = np.indices(place.shape)
            assert (np.abs(there[place, carriage, axis] - values[:, :6]) <= error * scale).all()


# ---- the choice, refusals


def test_auto_is_exact_for_linear_scenes_and_says_why() -> None:
    machine, motion = machine_of("cart"), motion_of("clean")
    auto, exact = (simulate(machine, motion, method).data for method in ("auto", "exact"))
    assert np.array_equal(auto["force"].values, exact["force"].values)
    assert auto.attrs["method"] == exact.attrs["method"] == "exact"
    assert "linear" in auto.attrs["method_reason"]
    assert exact.attrs["method_reason"] == "asked for"
    result = simulate(machine, motion, "rk45")
    assert (result.method, result.reason) == ("rk45", "asked for")


REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"method": "bdf"}, r"method: expected one of auto, exact, exponential, rk45, implicit, got 'bdf'"),
    ({"method": "exact", "step": 1e-3}, r'step: method "exact".*use rk45 or implicit'),
    ({"method": "auto", "step": 1e-3}, r'step: method "auto".*use rk45 or implicit'),
    ({"method": "exponential", "step": 1e-3}, r'step: method "exponential".*use rk45 or implicit'),
    ({"method": "rk45", "rtol": 0.0}, r"rtol: expected 1e-13 to 0.1.*got 0"),
    ({"method": "rk45", "rtol": -1e-6}, r"rtol: .*got -1e-6"),
    ({"method": "implicit", "rtol": 1e-15}, r'rtol: .*method "exact" has no step error'),
    ({"method": "implicit", "rtol": 0.5}, r"rtol: .*got 5e-1"),
    ({"method": "exact", "rtol": 5.0}, r"rtol: .*got 5e0"),
    ({"method": "auto", "rtol": float("inf")}, r"rtol: .*got inf"),
    ({"method": "rk45", "rtol": float("nan")}, r"rtol: .*got NaN"),
    ({"method": "rk45", "step": 0.0}, r"step: expected > 0 s, got 0"),
    ({"method": "rk45", "step": -1e-3}, r"step: expected > 0 s, got -0.001"),
    ({"method": "implicit", "step": float("inf")}, r"step: expected a finite time > 0 s, got inf"),
    ({"times": [0.0, 0.6]}, r"times\[0\]: expected 0.56 to 0.859 s, ascending, got 0 s"),
    ({"times": [0.6, 1.0]}, r"times\[1\]: expected 0.6 to 0.859 s, ascending, got 1 s"),
    ({"times": [0.7, 0.6]}, r"times\[1\]: expected 0.7 to 0.859 s, ascending, got 0.6 s"),
    ({"times": [float("nan")]}, r"times\[0\]: .*got NaN"),
    ({"times": [[0.6, 0.7]]}, r"times"),
    ({"times": ["soon"]}, r"times"),
]


@pytest.mark.parametrize(("options", "text"), REFUSED, ids=[str(options) for options, _ in REFUSED])
def test_bad_arguments_are_refused_with_numbers(options: dict[str, Any], text: str) -> None:
    with pytest.raises(GuideloadError, match=text) as caught:
        simulate(machine_of("cart"), motion_of("clean"), **options)
    assert isinstance(caught.value, ArgumentError)
    assert isinstance(caught.value, TypeError) == (options == {"times": ["soon"]})
    if "times" not in options:
        with pytest.raises(ArgumentError, match=text):
            peak_loads(machine_of("cart"), motion_of("clean"), **options)


# ---- determinism


@pytest.mark.parametrize("method", ["exact", "rk45", "implicit"])
def test_the_same_bits_every_time_and_from_every_thread(method: str) -> None:
    def run(name: str) -> bytes:
        return simulate(machine_of(name), motion_of("noisy"), method).carriage_loads.tobytes()

    names = ["cart", "paper"] * 8
    alone = {name: run(name) for name in ("cart", "paper")}
    fresh = simulate(ref.cart(), motion_of("noisy"), method).carriage_loads
    assert fresh.tobytes() == alone["cart"]
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(run, names)) == [alone[name] for name in names]


def test_the_interpreter_is_free_during_a_run() -> None:
    machine, motion = machine_of("cart"), motion_of("clean")
    _ = machine.scene  # made before the clock starts
    thread = threading.Thread(target=lambda: simulate(machine, motion, "rk45", step=2e-7))  # some 0.3 s
    thread.start()
    turns = 0
    while thread.is_alive():
        turns += 1
    thread.join()
    # A held interpreter would leave this loop a few switches of 5 ms, of some ten thousand turns each.
    assert turns > 100_000


@pytest.mark.parametrize("given", ["machine.toml", None])
def test_wrong_arguments_are_refused_with_the_way_out(given: Any) -> None:
    with pytest.raises(TypeError, match="machine: expected a Machine, as from Machine.from_toml"):
        simulate(given, motion_of("clean"))
    with pytest.raises(TypeError, match="motion: expected a Motion, as from motion_from_trace"):
        simulate(machine_of("cart"), given)
    with pytest.raises(ArgumentError, match='step: expected a number or None, got "1 ms"'):
        simulate(machine_of("cart"), motion_of("clean"), "rk45", step="1 ms")
