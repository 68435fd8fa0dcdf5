"""The audit: a law for every figure, a scene for every warning, and no warning for the example."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
import reference as ref
from machines import having

from guideload import Body, Link, Machine, Motion, Rail, Result, simulate
from guideload._core import Law
from guideload.audit.figures import BALL_ROW, ROLLERS
from guideload.audit.plausibility import free_at_rest, machine_warnings
from guideload.base.number_text import percent
from guideload.machine.modes import displacement
from guideload.reports import run as report
from guideload.reports.report import WIDTH

TIME = np.arange(1001) * 1e-3
PUSH = np.where((TIME > 0.2) & (TIME < 0.6), 2.2, 0.0)
PRELOAD = "times the preload would keep"


@cache
def cart_result() -> Result:
    return simulate(ref.cart(), ref.cycle())


@cache
def clear_result() -> Result:
    return simulate(ref.cart_clear(), ref.cycle())


@cache
def preloaded_result() -> Result:
    return simulate(ref.preloaded(), ref.piece(ref.cycle(), 500, 2000))


def pendulum(height: float) -> Machine:
    """A body that turns about z alone, on one link along y at 0.5 m: nothing but a lever."""
    return Machine(
        body=Body(mass=100, center_of_mass=(0.2, height, 0), inertia=np.eye(3).tolist()),
        links=[Link(name="spring", point=(0.5, 0, 0), direction=(0, 1, 0), stiffness=1e7, damping=1e4)],
        free=("rz",),
    )


# ---- rotation


@pytest.mark.parametrize("height", [-0.6, 0.3])
def test_second_order_of_a_lever_is_its_gravitational_stiffness(height: float) -> None:
    """At rest phi = -m g s / (k r^2), and the height h of the centre of mass changes the load by m g h / (k r^2)."""
    found = simulate(pendulum(height), Motion.along_x(TIME, 0 * TIME)).audit.rotation
    turn = 100 * 9.80665 / (1e7 * 0.5**2)
    assert found.largest == pytest.approx(turn * 0.2, rel=1e-12)
    assert found.second_order == pytest.approx(turn * abs(height), rel=1e-9)


def test_mode_shapes_of_a_machine_of_links_only_are_scaled_by_their_points() -> None:
    at = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)])
    along = [(0.0, 1.0, 0.0)] * 3 + [(0.0, 0.0, 1.0)] * 2
    links = tuple(
        Link(name=str(i), point=tuple(at[i]), direction=along[i], stiffness=1e6, damping=1e3)
        for i in range(5)
    )
    # The centre of mass is L, about which one of the modes turns.
    body = Body(mass=10.0, center_of_mass=(0.0, 0.0, 0.0), inertia=np.eye(3).tolist())
    result = simulate(Machine(body=body, links=links), Motion.along_x(TIME, PUSH))
    largest = [np.linalg.norm(displacement(at, shape), axis=1).max() for shape in result.modes.shape]
    assert largest == pytest.approx([1.0] * 5)
    assert "the travel excites no mode" in str(result.audit)


def test_largest_rotation_is_that_of_the_histories() -> None:
    data, found = cart_result().data, cart_result().audit.rotation
    turns = np.linalg.norm(data["displacement"].sel(dof=["rx", "ry", "rz"]), axis=1)
    assert found.largest == turns.max()
    assert found.time == data["time"].values[turns.argmax()]


@pytest.mark.parametrize(
    ("machine", "finite"), [(ref.cart, 5e-5), (ref.cart_stiff, 5e-5), (ref.paper, 2.9e-4)]
)
def test_second_order_is_what_finite_rotations_change(machine: Callable[[], Machine], finite: float) -> None:
    """The figures are differences to a multibody program with finite rotations."""
    found = simulate(machine(), ref.cycle()).audit.rotation.second_order
    assert finite / 1.3 < found < finite * 1.3


def test_second_order_of_play_has_the_right_size() -> None:
    assert 1.4e-4 / 5 < clear_result().audit.rotation.second_order < 1.4e-4 * 5


# ---- contact


def test_the_preload_needed_opens_a_row_at_the_largest_load() -> None:
    """An end has half of the carriage's preload; its row opens at 2^n times that."""
    result = cart_result()
    needed = result.audit.contact.preload_needed
    largest = np.abs(result.data["link_load_elastic"]).max("time").values
    for carriage, links in enumerate(result.machine.links_of_carriages):
        for axis in (0, 1):
            load = largest[links[axis::2]].max()
            for exponent, preload in (
                (1.5, needed[carriage, axis]),
                (10 / 9, ROLLERS * needed[carriage, axis]),
            ):
                law = Law.preloaded(6e7, preload / 2, exponent)
                assert law.force(law.edges)[-1] == pytest.approx(load, rel=1e-12)


def test_links_that_pull_and_push_are_named() -> None:
    elastic = cart_result().data["link_load_elastic"]
    for link in elastic["link"].values:
        one = elastic.sel(link=link).values
        assert (str(link) in cart_result().audit.contact.changing_sign) == (one.min() < 0 < one.max())


def test_linear_links_never_lose_contact() -> None:
    found = cart_result().audit.contact
    assert not found.lost.any() and not found.share.any() and not found.never_touching and found.changes == 0


def test_contact_is_lost_where_play_leaves_no_elastic_load() -> None:
    result = clear_result()
    found = result.audit.contact
    elastic = result.data["link_load_elastic"].transpose("time", "link").values
    np.testing.assert_array_equal(found.lost, elastic == 0.0)
    assert 0 < found.share.max() < 1
    np.testing.assert_allclose(found.share, found.lost.mean(axis=0), atol=2e-4)
    assert found.changes >= np.abs(np.diff(found.lost.astype(int), axis=0)).sum()
    assert not found.never_touching


def test_links_that_never_touch_are_named() -> None:
    stop = {"point": (0, 0, 0), "direction": (0, 1, 0), "stiffness": 1e8, "damping": 0.0, "clearance": 1e-3}
    machine = Machine(**{**dict(ref.cart()), "links": [Link(name="stop", **stop)]})
    found = simulate(machine, Motion.along_x(TIME, PUSH)).audit
    assert found.model_level == "piecewise linear" and found.reason == "clearance in stop"
    assert found.contact.never_touching == ("stop",)
    assert any("never touching: stop" in line for line in found.lines)


def test_a_row_opens_beyond_its_multiple_of_the_preload() -> None:
    result = preloaded_result()
    elastic = np.abs(result.data["link_load_elastic"].transpose("time", "link").values)
    np.testing.assert_array_equal(result.audit.contact.lost, elastic >= BALL_ROW * 600.0)
    (warning,) = ref.warnings_of(result.audit)
    assert f"{elastic.max() / (BALL_ROW * 600.0):.3g} {PRELOAD}" in warning


def test_enough_preload_loses_nothing() -> None:
    audit = simulate(ref.preloaded(5000.0), ref.piece(ref.cycle(), 500, 2000)).audit
    assert not audit.contact.lost.any() and not ref.warnings_of(audit)


# ---- sampling and band


def test_band_of_tones_is_where_their_power_is() -> None:
    time = np.arange(2000) * 1e-3  # whole periods of both tones
    tones = {frequency: np.sin(2 * np.pi * frequency * time) for frequency in (5.0, 40.0)}
    for share, end in ((0.0, 5.0), (0.009, 5.0), (0.011, 40.0), (1.0, 40.0)):
        pull = np.sqrt(1 - share) * tones[5.0] + np.sqrt(share) * tones[40.0]
        found = simulate(ref.cart(), Motion.along_x(time, pull)).audit.sampling.band
        assert found == pytest.approx(end, rel=1e-9)


def test_band_counts_process_forces_and_needs_something_that_moves() -> None:
    time = np.arange(2000) * 1e-3
    tone = np.sin(2 * np.pi * 20.0 * time)
    still = Motion.along_x(time, 0 * time)
    pushed = still.with_force((0.1, 0, 0), np.stack([0 * time, 500.0 * tone, 0 * time], axis=1))
    assert simulate(ref.cart(), pushed).audit.sampling.band == pytest.approx(20.0, rel=1e-9)
    found = simulate(ref.cart(), still).audit
    assert found.sampling.band is None and found.energy.exchanged == 0.0
    assert [one.split(",")[0] for one in ref.warnings_of(found)] == ["Warning: the cart does not move"]


def test_samples_per_period_are_those_of_the_highest_mode() -> None:
    found = cart_result().audit.sampling
    assert found.per_period == pytest.approx(1e3 / cart_result().modes.frequency.max(), rel=1e-9)
    finer = simulate(ref.cart(), ref.cycle(), times=np.arange(2000) * 5e-4).audit.sampling
    assert finer.per_period == pytest.approx(2 * found.per_period, rel=1e-9)
    assert finer.trace_step == pytest.approx(1e-3, rel=1e-9)


def test_a_single_instant_has_an_audit() -> None:
    audit = simulate(ref.cart(), ref.cycle(), times=[0.8]).audit
    assert audit.sampling.per_period is None and audit.sampling.band is None
    assert audit.energy.exchanged == 0.0 and not ref.warnings_of(audit) and audit.lines


# ---- simpler models


def test_quasi_static_loads_are_the_limit_of_slow_motion() -> None:
    """The dampers' part falls as 1 / duration."""
    off = []
    for duration in (0.5, 2.0, 8.0):
        time = np.linspace(0.0, duration, 4001)
        pull = 2.2 * np.sin(np.pi * time / duration) ** 2
        models = simulate(ref.cart(), Motion.along_x(time, pull)).audit.simpler_models
        off.append([abs(models.deviation(models.quasi_static)[0]), abs(models.dynamic_deviation[0])])
    peaks, dynamic = np.array(off).T
    assert peaks[-1] < 1e-5 and dynamic[-1] < 1e-4
    assert np.all(dynamic[:-1] / dynamic[1:] > 3.5)


@pytest.mark.parametrize(("motion", "verdict"), [(ref.cycle, "is enough"), (ref.pulse, "is not enough")])
def test_statics_does_for_slow_motion_only(motion: Callable[[], Motion], verdict: str) -> None:
    audit = simulate(ref.cart(), motion()).audit
    (line,) = (line for line in audit.lines if line.startswith("static"))
    models = audit.simpler_models
    off, name = models.deviation(models.quasi_static)
    at = models.names.index(name)
    assert off == pytest.approx(models.quasi_static[at] / models.peak[at] - 1, rel=1e-9)
    assert verdict in line
    assert f"peaks are {models.dynamic_factor[at]:.2f} times its peaks ({name})" in line


def test_a_sudden_load_on_an_undamped_spring_has_a_dynamic_factor_of_two() -> None:
    machine = ref.translating(100.0, [("y", (0.0, 1.0, 0.0), 1e6, 0.0)])
    weightless = machine.model_copy(update={"gravity": (0.0, 0.0, 0.0)})
    time = np.arange(2001) * 1e-4
    sudden = Motion(time, np.tile([0.0, 3.0, 0.0], (time.size, 1)))
    models = simulate(weightless, sudden).audit.simpler_models
    assert models.quasi_static == pytest.approx([300.0], rel=1e-12)
    assert models.dynamic_factor == pytest.approx([2.0], rel=1e-5)
    still = simulate(weightless, Motion.along_x(TIME, 0 * TIME)).audit
    assert still.simpler_models.dynamic_factor == pytest.approx([1.0], rel=0.0)


def test_peaks_of_simpler_models_are_those_of_the_machines_that_they_describe() -> None:
    expected = cart_result().quantities["resultant"].max(axis=0)
    linear, loose = (result().audit.simpler_models for result in (cart_result, clear_result))
    np.testing.assert_allclose(linear.peak, expected, rtol=1e-12)
    np.testing.assert_allclose(loose.linear, expected, rtol=1e-9)
    assert linear.linear is None


def test_nothing_is_said_of_an_excitation_that_the_instants_do_not_show() -> None:
    """Every tenth sample would do as another motion."""
    for times in (ref.cycle().time[::10], ref.cycle().time[1000:]):
        assert simulate(ref.cart_clear(), ref.cycle(), times=times).audit.simpler_models.linear is None
    assert simulate(ref.cart(), ref.cycle(), times=ref.cycle().time[::10]).audit.sampling.band is None


def test_links_replace_missing_carriages() -> None:
    models = simulate(pendulum(0.0), Motion.along_x(TIME, PUSH)).audit.simpler_models
    assert models.names == ("spring",)


# ---- energy


@pytest.mark.parametrize("damping", [5e4, 0.0])
def test_energy_residual_falls_at_the_order_of_its_quadrature(damping: float) -> None:
    """A kink every 8 ms, and 4 to 32 reported instants between two of them."""
    fine = np.arange(1601) * 2.5e-4
    knots = fine[::32]
    pull = np.random.default_rng(1).normal(size=knots.size) * (knots > 0)
    motion = Motion.along_x(knots, pull)
    found = [simulate(ref.cart(damping), motion, times=fine[::each]).audit.energy for each in (4, 2, 1)]
    residual = np.array([balance.residual for balance in found])
    np.testing.assert_allclose(np.log2(residual[:-1] / residual[1:]), 6.0, atol=0.1)
    assert all(balance.resolution > balance.residual for balance in found)


def test_energy_balances_over_jumps_or_is_unknown() -> None:
    """A jump is two samples at one instant: other instants show only one side of it."""
    time = np.array([0.0, 0.1, 0.1, 0.15, 0.15, 0.2])
    pull = np.array([0.0, 0.0, 2.0, 2.0, -3.0, -3.0])
    stamps = np.sort(np.concatenate([np.arange(201) * 1e-3, [0.1, 0.15]]))
    late = np.append(False, np.diff(stamps) == 0)
    sampled = np.where(late, 0, np.interp(stamps, [0, 0.1, 0.1 + 1e-9, 0.15, 0.15 + 1e-9, 0.2], pull))
    sampled[late] = (2.0, -3.0)
    assert simulate(ref.cart(), Motion.along_x(stamps, sampled)).audit.energy.residual < 1e-5
    hidden = simulate(ref.cart(), Motion.along_x(time, pull), times=np.arange(201) * 1e-3).audit
    assert hidden.energy is None and any("balance unknown" in line for line in hidden.lines)


def test_energy_balances_on_the_yardstick() -> None:
    assert cart_result().audit.energy.residual < 1e-8
    assert simulate(ref.cart(), ref.noisy()).audit.energy.residual < 1e-5
    assert clear_result().audit.energy.residual < 1e-4  # contact changes lie between the samples
    assert preloaded_result().audit.energy.residual < 1e-4


def test_energy_exchanged_by_a_slow_push_is_dissipated_and_stored() -> None:
    """From rest to rest the work is dissipated, so the exchanged energy is at least twice the dissipated one."""
    result = cart_result()
    damping = result.machine.link_table().damping
    lost = (result.data["link_load_damping"].transpose("time", "link").values ** 2 / damping).sum(axis=1)
    dissipated = np.sum(np.diff(result.data["time"].values) * (lost[1:] + lost[:-1])) / 2
    assert result.audit.energy.exchanged > 2 * dissipated * 0.99


# ---- warnings


def soft() -> Result:
    return simulate(ref.cart(stiffness_y=2e5, stiffness_z=2e5), ref.cycle())


def under_way() -> Result:
    return simulate(ref.cart(), Motion.along_x(TIME, np.where(TIME < 0.6, 2.0, 0.0)))


def overdamped() -> Result:
    time = np.arange(1000) * 2e-3
    pull = np.random.default_rng(1).normal(size=time.size) * (time > 0)
    return simulate(ref.cart_stiff(), Motion.along_x(time, pull))


@pytest.mark.parametrize("result", [cart_result, overdamped])
def test_a_right_result_has_no_warnings(result: Callable[[], Result]) -> None:
    """Of the overdamped cart the samples do not resolve the energy, but another method agrees."""
    assert not ref.warnings_of(result().audit)


def test_a_body_free_at_rest_is_described_by_its_dofs() -> None:
    """Nothing pushes the cart across: within its clearance it may move in z and turn about y."""
    audit = clear_result().audit
    assert {dof for motion in audit.free_at_rest for dof in motion} == {"z", "ry"}
    assert "z" in audit.warnings[0] and "ry" in audit.warnings[0]
    # With the weight at one corner both motions turn about y and slide along z: they are named once.
    body = having(ref.cart_clear().body, center_of_mass=(0.18, 0.0, -0.25))
    shifted = tuple(having(one, x=one.x - 0.09) for one in ref.cart_clear().carriages)
    aside = having(ref.cart_clear(), body=body, carriages=shifted)
    assert free_at_rest(aside) == (("ry", "z"), ("ry", "z"))
    assert "within its clearance in 2 motions of ry and z:" in machine_warnings(aside)[0]


def test_later_instants_of_a_motion_that_begins_under_way_have_no_warning() -> None:
    motion = Motion.along_x(TIME, np.ones_like(TIME))
    assert ref.warnings_of(simulate(ref.cart(), motion, times=TIME[500:]).audit) == ()


# ---- energy and impacts


def test_dampers_that_set_in_between_two_instants_are_not_held_against_the_solution() -> None:
    """The energy they take is known to one interval only: the resolution says so, and falls with the interval."""
    residuals, resolutions = [], []
    for count in (1, 4, 16):
        times = np.linspace(0.0, 1.0, 1000 * count + 1)
        found = simulate(ref.rattling(), Motion.along_x(TIME, PUSH), times=times).audit.energy
        assert found is not None and found.residual < found.resolution
        residuals.append(found.residual)
        resolutions.append(found.resolution)
    assert residuals[-1] < 0.3 * residuals[0]
    np.testing.assert_allclose(resolutions[1:], np.array(resolutions[:-1]) / 4, rtol=0.3)


# ---- words, files


def test_lost_contact_and_open_rows_are_distinguished() -> None:
    """Half of the carriages have clearance, the others preload."""
    loose, pressed = ref.cart_clear(), ref.preloaded(300.0)
    machine = loose.model_copy(update={"carriages": (*loose.carriages[:2], *pressed.carriages[2:])})
    audit = simulate(machine, ref.piece(ref.cycle(), 500, 2000)).audit
    (line,) = (line for line in audit.lines if line.startswith("contact"))
    share = audit.contact.share
    assert f"contact lost or a row open in {np.count_nonzero(share)} of 16 links" in line
    assert f"up to {percent(share.max())} of the time" in line
    links = machine.links_of_carriages
    words = [audit.contact.words(np.concatenate(some)) for some in (links[:2], links[2:], links)]
    assert words == ["contact lost", "a row open", "contact lost or a row open"]


ALWAYS = ("model", "excitation", "trace", "static")


@pytest.mark.parametrize(
    ("result", "sometimes"),
    [
        (cart_result, ("preload",)),
        (soft, ("rotation", "preload")),
        (clear_result, ("contact", "preload", "linear", "verification")),
        (preloaded_result, ("contact", "preload", "linear", "verification")),
    ],
)
def test_only_lines_that_matter_are_printed(result: Callable[[], Result], sometimes: tuple[str, ...]) -> None:
    audit = result().audit
    assert sorted(line.split()[0] for line in audit.lines) == sorted(ALWAYS + sometimes)
    text = report.result_report(result()).text()
    section = text[text.index("\nAudit\n") :]
    assert max(map(len, section.splitlines())) <= WIDTH
    for line in audit.lines:
        assert " ".join(line.split()) in " ".join(section.split())
    count = len(audit.warnings)
    plural = "" if count == 1 else "s"
    assert audit.verdict == (f"{count} warning{plural}:" if count else "No warnings.")
    assert str(audit).startswith(audit.verdict)


@pytest.mark.parametrize(
    ("result", "level", "reason"),
    [
        (cart_result, "linear", "every link is linear"),
        (clear_result, "piecewise linear", "clearance in 1a:-y, 1a:-z and 14 more"),
        (preloaded_result, "smooth nonlinear", "preload in 1a:-y, 1a:-z and 14 more"),
    ],
)
def test_level_of_the_model_and_the_links_that_need_it(
    result: Callable[[], Result], level: str, reason: str
) -> None:
    audit = result().audit
    assert (audit.model_level, audit.reason) == (level, reason)
    assert f"{level}, solved by method {audit.method}: {reason}" in audit.lines[0]


def test_extra_rails_without_carriages_do_no_harm() -> None:
    machine = Machine(
        **{**dict(ref.cart()), "rails": [*ref.cart().rails, Rail(name="spare", position=(1, 1))]}
    )
    with_spare, without = (simulate(one, Motion.along_x(TIME, PUSH)) for one in (machine, ref.cart()))
    np.testing.assert_array_equal(with_spare.carriage_loads, without.carriage_loads)
    (warning,) = ref.warnings_of(with_spare.audit)
    assert "no carriage runs on rail spare" in warning
