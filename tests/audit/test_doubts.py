"""Doubts of the audit: wrong and unpredictable results have one, right results have none, strict makes it an error."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import reference as ref
from command_line import MACHINE, guideload, names, refused

from guideload import DoubtfulResult, Machine, Motion, Result, peak_loads, simulate
from guideload.audit.verification import NO_MOTION, SENSITIVE
from guideload.reports import run as report

BALANCE, DIFFERS, IMPACTS = "do not belong together", "another solution", "impacts amplify small differences"


def rough(count: int = 400, step: float = 4e-3, size: float = 1.0) -> Motion:
    """Random acceleration, in samples that are coarse against the modes of the cart."""
    pull = size * np.random.default_rng(1).normal(size=count)
    return Motion.along_x(np.arange(count) * step, np.where(np.arange(count) > 0, pull, 0.0))


def rattling_and_preloaded() -> Machine:
    """Three rattling carriages, and a preloaded one."""
    loose, pressed = ref.rattling(), ref.preloaded(3000.0)
    return loose.model_copy(update={"carriages": (*loose.carriages[:3], *pressed.carriages[3:])})


def shaken() -> Motion:
    return rough(3001, 1e-3, 0.3)


def changed(result: Result, change: Callable[[dict[str, np.ndarray]], object]) -> Result:
    """A result as read from a file, after a change of its arrays."""
    data = result.data.copy(deep=True)
    change({str(name): data[name].values for name in data.data_vars})
    return Result(result.machine, data)


# ---- wrong results


@pytest.mark.parametrize("name", ["link_load", "velocity", "acceleration", "displacement"])
@pytest.mark.parametrize("machine", [ref.cart, ref.cart_clear, ref.preloaded])
def test_numbers_that_do_not_belong_together_are_doubted(machine: Callable[[], Machine], name: str) -> None:
    """One number, changed in its sixth digit."""
    result = simulate(machine(), rough())
    at = np.unravel_index(np.abs(result.data[name].values).argmax(), result.data[name].shape)

    def change(data: dict[str, np.ndarray]) -> None:
        data[name][at] *= 1.0 + 1e-6

    assert not changed(result, lambda data: None).audit.doubts
    doubts = changed(result, change).audit.doubts
    assert BALANCE in doubts[0]
    assert f"{result.data['time'].values[at[0]]:.6g} s" in doubts[0]


def test_a_number_that_is_not_finite_is_doubted() -> None:
    for name in ("link_load", "velocity", "reaction"):
        found = changed(simulate(ref.cart(), rough()), lambda data, name=name: data[name].fill(np.nan)).audit
        assert not found.force_balance.holds and BALANCE in found.doubts[0]


def test_loads_of_another_motion_are_doubted() -> None:
    """They balance at every instant, but another solution under the motion of the result differs."""
    one, other = (simulate(ref.cart_clear(), motion) for motion in (rough(), rough(400, 4.01e-3)))
    mixed = Result(one.machine, other.data.assign_coords(time=one.data["time"]))
    assert mixed.audit.force_balance.holds and DIFFERS in mixed.audit.doubts[0]


@pytest.mark.parametrize("machine", [ref.cart, ref.cart_clear, ref.preloaded])
def test_the_difference_is_the_error_in_newtons(machine: Callable[[], Machine]) -> None:
    """Of a solution that is far too loose; a fine one is the truth."""
    found = simulate(machine(), rough(), "implicit", rtol=0.1)
    truth = simulate(machine(), rough(), "implicit", rtol=1e-10).data["link_load"]
    error = np.abs(found.data["link_load"] - truth)
    look = found.audit.verification
    assert look is not None and not isinstance(look, str)
    if look.agrees:
        assert float(error.max()) <= 1.01 * look.explained * found.data.attrs["load_scale_N"]
    else:
        assert look.newtons == pytest.approx(float(error.max()), rel=1e-3)
        assert float(error.sel(link=look.link).max()) == pytest.approx(look.newtons, rel=1e-3)
        assert f"{look.newtons:.3g} N in the load of {look.link}" in found.audit.doubts[0]


@pytest.mark.parametrize("machine", [ref.cart, ref.cart_clear, ref.preloaded])
def test_a_fixed_step_that_is_too_long_is_doubted_and_a_short_one_is_not(
    machine: Callable[[], Machine],
) -> None:
    long, short = (simulate(machine(), rough(50, 0.04), "implicit", step=step) for step in (0.04, 2e-4))
    assert DIFFERS in long.audit.doubts[0] and "Use a shorter step" in long.audit.doubts[0]
    assert not short.audit.doubts


def test_energy_alone_doubts_a_result_that_cannot_be_repeated() -> None:
    """Other instants than the samples, without the motion: a tenth of a millisecond resolves the modes."""
    times = np.arange(15000) * 1e-4
    for rtol, doubted in ((0.1, True), (1e-8, False)):
        result = simulate(ref.cart(), rough(), "rk45", rtol=rtol, times=times)
        bare = Result(result.machine, result.data.drop_dims("motion_time"))
        found = bare.audit
        assert found.verification == NO_MOTION
        assert doubted or (NO_MOTION in found.warnings[0] and NO_MOTION in repr(bare))
        assert any("does not balance" in doubt for doubt in found.doubts) == doubted


@pytest.mark.parametrize("machine", [ref.cart, ref.cart_clear, ref.preloaded])
@pytest.mark.parametrize("ending", ["nc", "parquet"])
def test_a_file_with_other_instants_is_judged_like_the_run(
    machine: Callable[[], Machine], ending: str, tmp_path: Path
) -> None:
    """The samples of the motion are stored beside the instants, process forces included."""
    motion = replace(rough(60), wrench=np.tile([0.0, 5.0, 0.0, 0.0, 1.0, 0.0], (60, 1)))
    times = np.sort(np.random.default_rng(2).uniform(0.0, motion.time[-1], 50))
    for rtol in (0.1, 1e-6):
        result = simulate(machine(), motion, "implicit", rtol=rtol, times=times)
        write = {"nc": result.to_netcdf, "parquet": result.to_parquet}[ending]
        write(tmp_path / f"loads.{ending}")
        again = Result.load(tmp_path / f"loads.{ending}")
        assert again.audit.verification == result.audit.verification is not None
        assert again.audit.doubts == result.audit.doubts


# ---- right results


@pytest.mark.parametrize("machine", [ref.cart, ref.cart_stiff, ref.cart_clear, ref.preloaded])
@pytest.mark.parametrize("step", [5e-2, 4e-3, 1e-3])
def test_coarse_samples_do_not_make_a_right_result_doubtful(
    machine: Callable[[], Machine], step: float
) -> None:
    """Energy does not balance in the quadrature over coarse samples; exact is right all the same."""
    motion = rough(200, step)
    found = simulate(machine(), motion, times=motion.time).audit
    assert found.energy is not None and not found.doubts
    if step == 5e-2:
        assert found.energy.residual > 0.1


@pytest.mark.parametrize(("damping", "other"), [(5e4, "rk45"), (2e6, "implicit")])
def test_a_result_by_exponential_is_checked_by_a_method_that_does_not_share_its_errors(
    damping: float, other: str
) -> None:
    """rk45 where stability allows its steps to be as long as those of the result."""
    machine = ref.cart(damping, preload_y=1200.0, preload_z=1200.0, rolling="ball")
    found = simulate(machine, rough(), "exponential").audit
    assert found.verification.method == other and found.verification.agrees and not found.doubts


def test_a_fixed_step_of_exponential_that_is_too_long_is_doubted() -> None:
    loose = simulate(ref.preloaded(), rough(50, 0.04), "exponential", step=0.04).audit
    assert DIFFERS in loose.doubts[0] and "Use a shorter step" in loose.doubts[0]


def test_given_instants_do_not_matter_to_the_verification() -> None:
    """They need not contain the samples: the run itself is repeated."""
    times = np.sort(np.random.default_rng(2).uniform(0.0, 1.5, 300))
    for machine in (ref.cart_clear(), ref.preloaded()):
        found = simulate(machine, rough(), times=times).audit
        assert not found.doubts and found.verification is not None


# ---- impacts


@pytest.mark.parametrize("method", ["exact", "rk45", "implicit"])
def test_impacts_that_amplify_small_differences_are_told_on_every_method(method: str) -> None:
    """The figure is what a motion larger by 1e-9 really changes; where damping always acts, that is nothing."""
    motion = shaken()
    result = simulate(ref.rattling(), motion, method, times=motion.time)
    larger = replace(motion, acceleration=(1.0 + 1e-9) * motion.acceleration)
    load, other = (
        simulate(ref.rattling(), one, times=one.time).data["link_load"].values for one in (motion, larger)
    )
    change = np.abs(load - other).max() / np.abs(result.data["link_load"].values).max()
    look = result.audit.verification
    assert look is not None and not isinstance(look, str) and look.sensitivity is not None
    assert change > SENSITIVE and look.sensitivity == pytest.approx(change, rel=1e-3)
    assert IMPACTS in result.audit.doubts[0]
    settled = simulate(ref.cart_clear(), shaken(), method).audit
    assert not settled.doubts and settled.verification.sensitivity < 1e-5


@pytest.mark.parametrize("method", ["rk45", "implicit"])
def test_impacts_beside_preload_are_told(method: str) -> None:
    audit = simulate(rattling_and_preloaded(), shaken(), method).audit
    assert not audit.verification.predictable and IMPACTS in audit.doubts[0]


# ---- where it is told


def test_strict_makes_a_doubt_an_error() -> None:
    for call in (simulate, peak_loads):
        with pytest.raises(DoubtfulResult, match=IMPACTS):
            call(ref.rattling(), shaken(), strict=True)
    right = simulate(ref.cart_clear(), rough(), strict=True)
    assert right.audit.verification is not None
    np.testing.assert_array_equal(
        peak_loads(ref.cart(), rough(), strict=True).largest, peak_loads(ref.cart(), rough()).largest
    )


def test_the_first_lines_of_the_report_and_the_representation_tell_a_doubt() -> None:
    doubtful, right = simulate(ref.rattling(), shaken()), simulate(ref.cart(), rough())
    head = " ".join(" ".join(report.result_report(doubtful).text().split("\n\n")[:3]).split())
    assert "warnings: Doubtful: " in head and IMPACTS in head
    assert IMPACTS in repr(doubtful)
    assert "Doubtful" not in repr(right) and f"{len(right.audit.warnings)} warning" in repr(right)
    assert "no instants" in repr(simulate(ref.cart(), rough(), times=[]))


def test_the_command_line_refuses_a_doubtful_result_if_asked(tmp_path: Path) -> None:
    """Steps of 20 ms cannot follow modes of 166 Hz."""
    trace, out = tmp_path / "trace.csv", tmp_path / "out"
    time, step = np.arange(100) * 0.02, 0.02
    speed = np.cumsum(np.random.default_rng(1).normal(size=100)) * 0.02
    trace.write_text(
        "time_s,velocity_m_s\n" + "".join(f"{t},{v}\n" for t, v in zip(time, speed, strict=True))
    )
    call = ["run", MACHINE, trace, "--no-pictures", "--method", "implicit", "--step", step, "-o", out]
    assert DIFFERS in " ".join(refused(*call, "--strict", code=1).split())
    assert not out.exists()
    assert "Doubtful: " in guideload(*call).stdout and "report.txt" in names(out)
