"""Limits of the methods: stability regions, unstable steps, cost of adaptivity, errors over many periods.

Tested elsewhere: exact on defective,
overdamped, undamped and spread-out scenes and on jumps in test_exactness.py; tolerances below rounding in
test_methods.py and rust/core/tests/laws/stability.rs; pulses after rest in methods.rs and samples 1e-9 s apart in
excitation.rs there; a motion of one sample in test_motion.py; contacts in test_torture.py.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from fractions import Fraction
from functools import cache
from math import comb, factorial, pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import reference as ref
from command_line import MACHINE, guideload, write_trace
from numpy.typing import NDArray
from reference import DOFS, all_modes_critical, translating
from torture_scenes import scenes

from guideload import ArgumentError, Link, Machine, Motion, RunError, Stability, plots, simulate, stability
from guideload.base.methods import METHODS
from guideload.base.number_text import fixed
from guideload.machine.riders import Rider
from guideload.method_comparison.runner import work_precision
from guideload.method_comparison.step_stability import standard_move, step_ends
from guideload.reports.stability import stability_report
from guideload.simulation.stability_function import (
    RK45,
    error_per_period,
    longest_stable_steps,
    stability_function,
)

# ---- the stability functions, from the definitions of the methods

DORMAND_PRINCE = """
1/5
3/40 9/40
44/45 -56/15 32/9
19372/6561 -25360/2187 64448/6561 -212/729
9017/3168 -355/33 46732/5247 49/176 -5103/18656
35/384 0 500/1113 125/192 -2187/6784 11/84
"""


def test_rk45_equals_the_series_up_to_order_five_only() -> None:
    """R(z) = 1 + sum b A^(k-1) 1 z^k, in fractions; the sixth row is the result, a seventh stage adds nothing."""
    rows = [[Fraction(entry) for entry in line.split()] for line in DORMAND_PRINCE.split("\n") if line]
    *a, b = rows
    powers = [Fraction(1)] * 6  # A^(k-1) 1
    coefficients = [Fraction(1)]
    for _ in range(6):
        coefficients.append(sum(x * y for x, y in zip(b, powers, strict=True)))
        powers = [Fraction(0)] + [sum(x * y for x, y in zip(row, powers, strict=False)) for row in a]
    assert coefficients[:6] == [Fraction(1, factorial(k)) for k in range(6)]
    assert coefficients[6] == Fraction(1, 600)
    assert powers == [0] * 6  # no further power
    assert RK45.tolist() == [float(c) for c in coefficients]


def test_implicit_is_the_pade_approximation_of_order_nine() -> None:
    def pade(j: int, degree: int, sign: int) -> Fraction:
        return sign**j * Fraction(factorial(9 - j) * comb(degree, j), factorial(9))

    above, below = [pade(j, 4, 1) for j in range(5)], [pade(j, 5, -1) for j in range(6)]
    assert METHODS["implicit"].numerator == tuple(float(c) for c in above)
    assert METHODS["implicit"].denominator == tuple(float(c) for c in below)
    # above - below * exp(z): zero up to z^9, and not beyond.
    difference = [
        (above[k] if k < 5 else Fraction(0))
        - sum(below[j] * Fraction(1, factorial(k - j)) for j in range(min(k, 5) + 1))
        for k in range(11)
    ]
    assert difference[:10] == [0] * 10 and difference[10] != 0


def test_implicit_is_stable_everywhere_on_the_left() -> None:
    radii = np.geomspace(1e-3, 1e12, 400)
    z = radii[:, None] * np.exp(1j * np.linspace(pi / 2, pi, 91))
    assert np.abs(stability_function("implicit", z)).max() <= 1.0 + 1e-14
    assert abs(stability_function("implicit", -1e12)) < 1e-11  # and forgets what has died away


def one_dof(omega: float, damping_ratio: float) -> Machine:
    """A kilogram on a spring and a damper along y, without gravity."""
    links = [("y", (0.0, 1.0, 0.0), omega**2, 2.0 * damping_ratio * omega)]
    return translating(1.0, links).model_copy(update={"gravity": (0.0, 0.0, 0.0)})


def free_vibration(machine: Machine, method: str, force_until: float, stop: float, **options: Any) -> Any:
    """The result's data after a force of 1 N along y until `force_until` [s], and free vibration until `stop` [s]."""
    force = np.zeros((4, 6))
    force[:2, 1] = 1.0
    motion = Motion(np.array([0.0, force_until, force_until, stop]), np.zeros((4, 3)), wrench=force)
    return simulate(machine, motion, method, **({"times": motion.time} | options)).data


def amplitude(data: Any, eigenvalue: complex) -> NDArray[np.complex128]:
    """Complex amplitude of a mode along y."""
    position, velocity = (data[name].values[:, 1] for name in ("displacement", "velocity"))
    return np.asarray(velocity - np.conj(eigenvalue) * position)


@pytest.mark.parametrize("damping_ratio", [0.0, 0.3, 0.95])
@pytest.mark.parametrize("turn", [0.3, 0.9, 2.0])
@pytest.mark.parametrize("method", ["rk45", "implicit"])
def test_a_step_of_the_core_multiplies_by_r(method: str, turn: float, damping_ratio: float) -> None:
    """turn: h |λ|. Steps of the same length from the start on, so that instants of output are ends of steps."""
    machine = one_dof(100.0, damping_ratio)
    step = turn / 100.0
    times = step * np.array([2.0, 3.0, 4.0])
    eigenvalue = 100.0 * complex(-damping_ratio, sqrt(1.0 - damping_ratio**2))
    data = free_vibration(machine, method, step, times[-1], step=step, times=times)
    found = amplitude(data, eigenvalue)
    expected = complex(stability_function(method, step * eigenvalue))
    assert found[1:] / found[:-1] == pytest.approx(expected, rel=1e-11)


# ---- the longest stable step, by theory


def test_no_step_beyond_the_longest_is_stable_and_none_below_is_not() -> None:
    """On 200 rays of the left half plane, against a scan of |R|; on the imaginary axis |R| - 1 is 1e-4 at most."""
    angles = np.concatenate([np.linspace(pi / 2, pi, 100), pi / 2 + np.geomspace(1e-8, 0.1, 100)])
    rays = np.exp(1j * angles)
    rays.real[0] = 0.0
    limits = longest_stable_steps(rays)
    share = np.concatenate([np.linspace(0.05, 0.999, 400), np.linspace(1.001, 20.0, 4000)])
    size = np.abs(stability_function("rk45", rays[:, None] * limits[:, None] * share))
    assert np.all(size[:, :400] < 1.0)
    assert np.all(size[:, 400:] > 1.0)


def test_limits_that_are_known() -> None:
    # Hairer & Wanner, IV.2: 3.3 on the real axis. On the imaginary one |R|² = 1 - y^6/1800 + y^8/1600 - ...
    assert longest_stable_steps([-1.0, 1j, -1j, 0.0]) == pytest.approx(
        [3.3066, 0.99719, 0.99719, np.inf], rel=2e-5
    )
    assert longest_stable_steps(-2.0)[0] == 0.5 * longest_stable_steps(-1.0)[0]
    # What rounding adds to an undamped eigenvalue moves nothing; feeding is refused.
    assert longest_stable_steps(1e-13 + 1j)[0] == longest_stable_steps(1j)[0]
    with pytest.raises(ValueError, match="passive"):
        longest_stable_steps(1e-6 + 1j)


# ---- against trials


def near_massless() -> Machine:
    """A rod of 1250 kg along x: its moment of inertia about x is 1e-7 of the others."""
    inertia = ((4e-5, 0.0, 0.0), (0.0, 400.0, 0.0), (0.0, 0.0, 400.0))
    machine = ref.cart()
    return machine.model_copy(update={"body": ref.body(center_of_mass=(0.1, 0.0, 0.0), inertia=inertia)})


def damped_together() -> Machine:
    """Equal springs along y and z and one damper between them: one direction rings undamped, both look damped."""
    links = [("y", (0.0, 1.0, 0.0), 1e8, 0.0), ("z", (0.0, 0.0, 1.0), 1e8, 0.0)]
    damper = Link(name="damper", point=(0, 0, 0), direction=(0, 1, 1), stiffness=1.0, damping=1e5)
    machine = translating(100.0, links)
    return machine.model_copy(update={"links": (*machine.links, damper)})


SCENES: dict[str, Callable[[], Machine]] = {
    "cart": ref.cart,
    "cart_stiff": ref.cart_stiff,
    "paper": ref.paper,
    "cart undamped": lambda: ref.cart(0.0),
    "cart hardly damped": lambda: ref.cart(50.0),
    "random": lambda: ref.random_machine(3, free=DOFS),
    "random with carriages": lambda: ref.random_machine(4, free=("y", "z", "rx", "ry", "rz"), carriages=3),
    "random undamped": lambda: ref.random_machine(5, damping=0.0),
    "random overdamped": lambda: ref.random_machine(8, damping=300.0),
    "critical, one dof": lambda: translating(1250.0, [("y", (0, 1, 0), 5e7, 5e5)]),
    "critical, six dofs": all_modes_critical,
    "stiffness spread 1e8": lambda: ref.random_machine(15, stiffness=(1e2, 1e10), free=DOFS),
    "near-massless": near_massless,
    "damped together": damped_together,
}


@cache
def stability_of(name: str) -> Stability:
    return stability(SCENES[name]())


@cache
def noisy_cart() -> Stability:
    return stability(ref.cart(), ref.piece(ref.noisy(), 500, 1200))


@pytest.mark.parametrize("name", SCENES)
def test_runs_grow_without_bound_with_steps_above_the_longest_and_not_below(name: str) -> None:
    """By free vibration of all modes, with steps 1 % shorter and longer and enough of them to grow 1e5 times."""
    found = stability_of(name)
    scene, limit = found.machine.nominal_scene, found.predicted_step
    growth = np.abs(stability_function("rk45", 1.01 * limit * found.eigenvalues[found.limiting]))
    steps = np.log(1e5) / np.log(growth)
    shapes, mass = scene.modes()[2], scene.matrices()[0][0]
    kick = np.zeros((4, 6))  # a force over the first step, then none
    kick[:2] = mass @ (np.sqrt(2.0 + np.arange(len(shapes))) @ shapes)
    for step, unstable in ((0.99 * limit, False), (1.01 * limit, True)):
        stamps = step * np.array([0.0, 1.0, 1.0, 1.0 + steps])
        with pytest.raises(RunError, match="stability region") if unstable else nullcontext():
            scene.solve(stamps, np.zeros((4, 3)), kick, method="rk45", rtol=1e-6, step=step)


def test_eigenvalues_are_those_of_the_matrices_and_none_feeds() -> None:
    for name in ("random", "cart undamped", "cart_stiff"):
        found = stability_of(name)
        (mass, damping, stiffness), _ = found.machine.scene.matrices()
        free = [DOFS.index(dof) for dof in found.machine.free]
        square = np.ix_(free, free)
        for value in found.eigenvalues:
            parts = [value**2 * mass[square], value * damping[square], stiffness[square]]
            scale = sum(np.linalg.norm(part, 2) for part in parts)
            assert np.linalg.svd(sum(parts))[1][-1] <= 1e-10 * scale
        assert found.eigenvalues.real.max() <= 0.0
        assert np.all(np.diff(np.abs(found.eigenvalues)) >= 0.0)
    assert np.all(stability_of("cart undamped").eigenvalues.real == 0.0)


def test_the_mode_that_sets_the_step_is_named() -> None:
    # All of the cart's stiffness acts along z on all of its mass once, and along y with a far longer lever.
    assert stability_of("cart").moving(stability_of("cart").limiting) == ["z"]
    machine = translating(
        1.0, [("x", (1, 0, 0), 1e4, 1.0), ("z", (0, 0, 1), 1e8, 1.0), ("y", (0, 1, 0), 1e2, 1.0)]
    )
    found = stability(machine)
    assert [found.moving(i) for i in range(6)] == [["y"], ["y"], ["x"], ["x"], ["z"], ["z"]]
    assert found.eigenvalues[found.limiting].imag > 0.0


# ---- what adaptivity costs


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-8])
def test_rk45_pays_what_theory_says_where_a_scene_is_overdamped(rtol: float) -> None:
    """Whatever the tolerance; implicit and exact step from sample to sample as on the plain cart."""
    found = stability(SCENES["cart_stiff"](), ref.piece(ref.cycle(), 400, 2400), rtol=rtol)
    exact, rk45, implicit = found.costs
    assert rk45.steps is not None and implicit.steps is not None and rk45.rejected is not None
    assert rk45.steps == pytest.approx(rk45.needed, rel=0.1)
    assert rk45.rejected <= 0.25 * rk45.steps
    assert found.limited_by == "stability"
    assert (exact.steps, exact.rejected) == (1999, 0)
    assert implicit.steps <= 1.05 * 1999


def test_what_sets_the_steps_of_rk45_and_what_is_not_run() -> None:
    assert noisy_cart().limited_by == "samples"
    # On the straight parts of a smooth motion, where few steps would do for the tolerance.
    assert stability_of("cart").limited_by == "stability"
    assert stability_of("cart_stiff").limited_by == "stability"
    assert stability(ref.cart(), rtol=1e-12).limited_by == "tolerance"
    # Beyond what anyone waits for, it is not run.
    found = stability(ref.cart(1e9))
    rk45 = found.costs[1]
    assert rk45.needed > 1e7 and rk45.steps is None and "not worth" in rk45.note
    assert found.limited_by == "stability"
    found = stability(ref.preloaded())
    exact, rk45, _, exponential = found.costs
    assert (exact.steps, exact.note) == (None, "preloaded contacts have no exact solution")
    assert rk45.steps is not None
    assert exponential.method == "exponential" and exponential.steps is not None
    # One step for each sample, few of which need more.
    assert exponential.needed == found.motion.time.size - 1
    assert exponential.needed <= exponential.steps < 1.1 * exponential.needed
    assert not exponential.note and not rk45.note


def test_needed_steps_end_at_every_sample_and_rest_costs_one_each() -> None:
    # 0.5 s of rest, then a jump and three intervals of which two are longer than stable (0.0912 ms).
    time = [0.0, 0.5, 0.5, 0.50005, 0.5003, 0.5005]
    motion = Motion.along_x(time, [0.0, 0.0, 1.0, 1.0, 0.0, 0.0])
    exact, rk45, _ = stability(ref.cart_stiff(), motion).costs
    assert (exact.needed, rk45.needed) == (4, 1 + 1 + 3 + 3)


def test_no_step_passes_a_bend_and_those_of_exact_pass_no_sample() -> None:
    """Of a trapezoid with 100 samples to each side the four corners; of a scene with contact changes all samples."""
    time = np.arange(401) * 1e-3
    motion = Motion.along_x(time, np.interp(time, [0.1, 0.2, 0.3], [0.0, 2.0, 2.0]))
    cart = ref.cart()
    assert step_ends(cart, motion, "exact").size == 401
    np.testing.assert_array_equal(step_ends(cart, motion, "rk45"), [0, 100, 200, 400])
    jump = Motion.along_x([0.0, 0.1, 0.1, 0.2, 0.3], [1.0, 1.0, 1.0, 1.0, 1.0])
    np.testing.assert_array_equal(step_ends(cart, jump, "implicit"), [0, 1, 2, 4])
    assert step_ends(ref.cart_clear(), motion, "rk45").size == 401
    # What was counted is never less, however loose the tolerance.
    for found in (stability_of("cart"), noisy_cart(), stability(cart, motion, rtol=1e-2)):
        for cost in found.costs:
            assert cost.steps >= step_ends(cart, found.motion, cost.method).size - 1


def test_bad_tolerances_are_refused_as_by_simulate() -> None:
    with pytest.raises(ArgumentError, match="rtol"):
        stability(ref.cart(), rtol=1e-20)
    with pytest.raises(ArgumentError, match="motion: expected samples over some time, got all at 1 s"):
        stability(ref.cart(), Motion.along_x([1.0, 1.0], [0.0, 1.0]))


@pytest.mark.parametrize("compare", [stability, work_precision])
def test_a_rider_that_moves_is_refused(compare: Callable[[Machine, Motion], object]) -> None:
    """Methods are compared on riders at their positions."""
    keys = {"center_of_mass": (0, 0, 0), "inertia": np.eye(3).tolist(), "direction": (1, 0, 0)}
    rider = Rider(name="slide", mass=60.0, motion="slide.toml", **keys)
    with pytest.raises(ArgumentError, match='"slide" has the motion'):
        compare(ref.cart().model_copy(update={"riders": (rider,)}), standard_move())


# ---- what is hard, and which method fails


def features(machine: Machine, motion: Motion) -> dict[str, str]:
    return stability(machine, motion).difficulties


def test_what_is_hard_is_found_and_nothing_else() -> None:
    easy = ref.piece(ref.cycle(), 400, 1200)
    assert features(ref.cart(), easy) == {}
    assert features(ref.cart(0.0), easy) == {"damping": "5 vibrations damped by less than 0.1 %"}
    assert features(ref.cart_stiff(), ref.piece(ref.cycle(), 400, 1200)).keys() == {"damping"}
    jump = Motion.along_x([0.0, 0.1, 0.1, 0.2], [0.0, 0.0, 2.0, 2.0])
    assert features(ref.cart(), jump) == {"jumps of the excitation": "1"}
    late = Motion.along_x([0.0, 50.0, 50.01, 50.02, 50.03], [0.0, 0.0, 1.0, 0.0, 0.0])
    assert features(ref.cart(), late) == {"a pulse after a rest": "50 s of rest, then 0.01 s of excitation"}


def test_contact_changes_that_no_sample_shows_are_counted() -> None:
    """All of them show in samples that are dense enough; the motion is the same."""
    coarse = Motion.along_x(np.arange(120) * 4e-3, np.random.default_rng(0).normal(0.0, 3.0, 120))
    dense = np.linspace(0.0, coarse.time[-1], 119 * 400 + 1)
    fine = Motion.along_x(dense, np.interp(dense, coarse.time, coarse.acceleration[:, 0]))
    few, all_shown = (features(ref.cart_clear(), motion)["contact changes"] for motion in (coarse, fine))
    count, _, hidden = few.partition(", ")
    assert int(hidden.split()[0]) > 10
    assert all_shown == count


def test_a_method_that_fails_on_a_scene_is_named_and_the_others_are_tried() -> None:
    """The contact of 0.3 ms after a long rest, which `rk45` and `implicit` refuse and `exact` finds."""
    scene = next(one for one in scenes() if one.name == "late contact")
    report = stability_report(stability(scene.machine, scene.motion))
    assert "exact gives its loads within 10 times rtol; rk45 and implicit: see the note" in report.text(
        80
    ).replace("\n", " ")


# ---- a hundred thousand periods of an undamped mode

PERIODS = 100_000
OMEGA = 100.0


def drift(method: str, **options: Any) -> tuple[float, float, float]:
    """Gain of log amplitude and lead of phase [rad] over 1e5 periods, and the number of steps per period."""
    period = 2.0 * pi / OMEGA
    start, stop = period / 4.0, (0.25 + PERIODS) * period
    data = free_vibration(one_dof(OMEGA, 0.0), method, start, stop, **options)
    found = amplitude(data, 1j * OMEGA)
    ratio = found[3] / found[2]
    turned = OMEGA * (stop - start)
    return (
        float(np.log(np.abs(ratio))),
        float(np.angle(ratio * np.exp(-1j * turned))),
        data.attrs["steps"] / (PERIODS + 0.25),
    )


# What 6e5 rad leave of an angle is 1e-10 of it. The prediction loses some 1e-15 for each step.
ROUNDING = 1e-9
ROUNDING_OF_R = 5e-15


def predicted_drift(method: str, steps: float) -> tuple[complex, float]:
    """Gain of log amplitude and i times the lead over 1e5 periods, by R; and what rounding leaves of that."""
    z = 2j * pi / steps
    drifted = PERIODS * steps * np.log(stability_function(method, z) / np.exp(z))
    return complex(drifted), ROUNDING + ROUNDING_OF_R * PERIODS * steps


FIXED_STEPS = [("rk45", 30, None), ("implicit", 4, None)]
TOLERANCES = [("rk45", None, 1e-1), ("rk45", None, 1e-2), ("implicit", None, 1e-2), ("implicit", None, 1e-4)]


@pytest.mark.parametrize(("method", "steps", "rtol"), FIXED_STEPS + TOLERANCES)
def test_amplitude_and_phase_after_1e5_periods_are_those_of_r(
    method: str, steps: float | None, rtol: float | None
) -> None:
    """With fixed steps, and with steps that a tolerance chooses; for nothing damps, its errors add up."""
    gain, lead, taken = drift(method, **({"step": 2.0 * pi / OMEGA / steps} if steps else {"rtol": rtol}))
    expected, rounding = predicted_drift(method, steps or taken)
    assert gain == pytest.approx(expected.real, rel=0.1, abs=rounding)
    assert lead == pytest.approx(expected.imag, rel=0.1, abs=rounding)
    if steps:
        assert taken == pytest.approx(steps, rel=1e-4)
        assert gain < rounding  # energy, which goes as the square, never grows
    else:
        assert max(abs(gain), abs(lead)) <= 10.0 * rtol


def test_exact_keeps_amplitude_and_phase_for_1e5_periods() -> None:
    """In one step, and in a million from sample to sample."""
    gain, lead, _ = drift("exact")
    assert max(abs(gain), abs(lead)) <= ROUNDING
    step = 2.0 * pi / OMEGA / 10.0
    stamps = np.arange(PERIODS * 10 + 1) * step
    acceleration = np.zeros(stamps.size)
    acceleration[0] = 1.0  # dies away within one sample
    motion = Motion(stamps, np.outer(acceleration, [0.0, 1.0, 0.0]))
    data = simulate(one_dof(OMEGA, 0.0), motion, "exact", times=stamps[[10, -1]]).data
    found = amplitude(data, 1j * OMEGA)
    # Whole periods apart: the same, but for the rounding of a million stamps of up to 6283 s.
    assert abs(found[1] / found[0] - 1.0) <= ROUNDING


def test_no_implicit_step_damps_a_peak_that_is_real() -> None:
    """The table of the report, and the loads of the plain cart and the undamped one, from sample to sample."""
    lost = {steps: error_per_period("implicit", steps)[0] for steps in (4, 10, 30)}
    assert lost[4] < 1e-6 and lost[10] < 1e-9 and abs(lost[30]) < 1e-13
    motion = ref.piece(ref.pulse(), 4950, 5300)
    for machine in (ref.cart(), ref.cart(0.0)):
        exact, implicit = (
            np.abs(simulate(machine, motion, method, times=motion.time, **options).carriage_loads).max(axis=0)
            for method, options in (("exact", {}), ("implicit", {"step": 1e-3}))
        )
        assert implicit == pytest.approx(exact, rel=1e-6, abs=1e-6)


# ---- any tolerance on scenes at the edge

HARD = (
    "critical, one dof",
    "critical, six dofs",
    "random overdamped",
    "random undamped",
    "stiffness spread 1e8",
)


@pytest.mark.parametrize("method", ["rk45", "implicit"])
@pytest.mark.parametrize("scene", HARD)
def test_every_tolerance_is_met_on_hard_scenes(scene: str, method: str) -> None:
    machine, given = SCENES[scene](), ref.random_motion(11, wrench=True)
    exact = simulate(machine, given, "exact", times=given.time).data["link_load"].values
    for rtol in (1e-4, 1e-7):
        data = simulate(machine, given, method, rtol=rtol, times=given.time).data
        assert np.abs(data["link_load"].values - exact).max() <= 10.0 * rtol * data.attrs["load_scale_N"]


def test_a_near_massless_axis_is_exact_and_costs_rk45_what_theory_says() -> None:
    machine, motion = near_massless(), ref.piece(ref.cycle(), 560, 640)
    expected = ref.reference(machine, motion).link_load
    exact = simulate(machine, motion, "exact", times=motion.time).data["link_load"].values
    assert np.abs(exact - expected).max() <= 1e-10 * np.abs(expected).max()
    data = simulate(machine, motion, "implicit", rtol=1e-8, times=motion.time).data
    assert np.abs(data["link_load"].values - expected).max() <= 1e-7 * data.attrs["load_scale_N"]
    found = stability_of("near-massless")
    assert found.predicted_step < 1e-7 and found.moving(found.limiting) == ["rx"]
    assert found.costs[1].steps is None or found.limited_by == "stability"


@pytest.mark.parametrize("method", ["exact", "rk45", "implicit"])
def test_resonance_grows_as_it_must(method: str) -> None:
    """A sine at the frequency of an undamped mode for 200 periods: q = A / (2 ω²) (ω t cos ω t - sin ω t).

    Straight lines between 64 samples to a period have sinc²(π/64) of the sine in them, and harmonics from the 63rd
    on, of 1/63² of it and less, which move the mode by 1/63² of that: 6e-8 of the static answer.
    """
    periods, count = 200, 64
    time = np.arange(periods * count + 1) * (2.0 * pi / OMEGA / count)
    sine = np.sin(OMEGA * time)
    motion = Motion(time, np.outer(sine, [0.0, 1.0, 0.0]))
    data = simulate(one_dof(OMEGA, 0.0), motion, method, rtol=1e-8).data
    share = np.sinc(1.0 / count) ** 2
    expected = share / (2.0 * OMEGA**2) * (OMEGA * time * np.cos(OMEGA * time) - sine)
    error = np.abs(data["displacement"].values[:, 1] - expected).max() / np.abs(expected).max()
    assert error <= 1e-8


def test_resonance_with_damping_settles_at_the_textbook_amplitude() -> None:
    """1 / (2 zeta) times the quasi-static answer."""
    zeta, count = 0.01, 200
    time = np.arange(300 * count + 1) * (2.0 * pi / OMEGA / count)
    motion = Motion(time, np.outer(np.sin(OMEGA * time), [0.0, 1.0, 0.0]))
    position = simulate(one_dof(OMEGA, zeta), motion, "exact").data["displacement"].values[:, 1]
    peak = np.abs(position[-10 * count :]).max() * OMEGA**2
    assert peak == pytest.approx(np.sinc(1.0 / count) ** 2 / (2.0 * zeta), rel=1e-5)


@pytest.mark.parametrize("method", ["rk45", "implicit", "exact"])
@pytest.mark.parametrize("scene", ["cart", "cart_stiff"])
@pytest.mark.parametrize("size", [1e-300, 1e-150, 1e150, 1e290, 1e306])
def test_histories_at_the_ends_of_the_range_give_an_error_or_finite_loads(
    method: str, scene: str, size: float
) -> None:
    """Through the core, as a Motion refuses accelerations that no machine has."""
    machine, time = SCENES[scene](), np.array([0.0, 1e-3, 2e-3, 3e-3])
    acceleration = np.zeros((4, 3))
    acceleration[1:3, 0] = size, -size
    groups = machine.links_of_carriages, machine.carriage_centers
    try:
        solution = machine.scene.solve(time, acceleration, method=method, rtol=1e-6)
        assert np.all(np.isfinite(solution.group_loads(*groups, "total")))
    except RunError as error:
        assert "range" in str(error) or "step" in str(error)


# ---- report and picture


def test_the_report_names_the_limit_and_its_cost() -> None:
    found = stability_of("cart_stiff")
    expected = {
        "cart_stiff": (
            f"stable up to {1e3 * found.predicted_step:.4g} ms:",
            "Stability limits the steps of rk45",
            "Use exact or implicit here",
            " ".join(fixed(found.costs[1].steps).split()),
            "No mode of this machine vibrates",
        ),
        "noisy": ("The samples limit the steps of rk45",),
        "cart": (
            "Stability limits the steps of rk45",
            "This takes little time here",
            "its peaks are accurate",
        ),
        "cart undamped": ("almost without damping",),
    }
    for name, sentences in expected.items():
        text = " ".join(
            stability_report(noisy_cart() if name == "noisy" else stability_of(name)).text().split()
        )
        assert all(sentence in text for sentence in sentences) and "-0 " not in text


def test_the_command_reports_and_draws(tmp_path: Path) -> None:
    picture = tmp_path / "stability.png"
    printed = guideload("stability", MACHINE, "-o", picture).stdout
    assert "rk45 is stable up to" in printed and "standard move" in printed
    assert picture.read_bytes().startswith(b"\x89PNG")
    trace = write_trace(tmp_path / "trace.csv", 800, 0.2)
    measured = guideload("stability", MACHINE, trace, "--free", "rx,ry,rz").stdout
    assert "trace.csv" in measured and "free rx, ry, rz" in measured


def test_the_picture_shows_every_eigenvalue_at_both_steps() -> None:
    for name in ("cart", "cart_stiff"):
        found = stability_of(name)
        region, periods = plots.stability(found)
        upper = found.eigenvalues[found.eigenvalues.imag >= 0.0]
        drawn = np.concatenate(
            [line.get_xdata() + 1j * line.get_ydata() for line in region.lines if line.get_marker() in "oD"]
        )
        assert np.isin(np.round(found.predicted_step * upper, 12), np.round(drawn, 12)).all()
        outside = sum(line.get_marker() in ("<", "^") for line in region.lines)
        assert outside + drawn.size == 2 * upper.size
        assert periods.get_xscale() == periods.get_yscale() == "log"
    with pytest.raises(ValueError, match="2 axes"):
        plots.stability(found, [region])
