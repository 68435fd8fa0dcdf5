"""Simulation of a machine under a motion, by a given integration method or the cheapest one."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from guideload.base.arguments import checked, real_array
from guideload.base.arrays import Array, median_step
from guideload.base.errors import ArgumentError
from guideload.base.methods import CHOICES, METHODS, Method
from guideload.base.number_text import digits
from guideload.machine.machine import Machine
from guideload.motion.motion import Motion
from guideload.simulation.finer_histories import with_visible_vibration
from guideload.simulation.instants import fastest_vibration
from guideload.simulation.payload_changes import with_changes
from guideload.simulation.peaks import Peaks, peaks_of
from guideload.simulation.rack_push import with_rack_push
from guideload.simulation.result import Result
from guideload.simulation.riders import with_riders
from guideload.simulation.run import Run
from guideload.simulation.start import Start, start_of
from guideload.simulation.straightness_loads import with_straightness_loads

LONGEST_STEP = 2.0  # of exponential, in radians of the fastest vibration


@checked
def simulate(
    machine: Machine,
    motion: Motion,
    method: Method = "auto",
    *,
    riders: Mapping[str, Motion] | None = None,
    rtol: float = 1e-6,
    step: float | None = None,
    times: ArrayLike | None = None,
    start: Start = "auto",
    strict: bool = False,
) -> Result:
    """The load of every carriage of a machine under a motion.

    If the drive has a pressure angle, the push of its rack acts too: see `guideload.simulation.rack_push`.

    method  exact (matrix exponential between samples and contact changes: no step error; not for preloaded
            contacts), exponential (for preloaded contacts: the linear part exactly, the rest by collocation of order 4;
            not beside clearance, sides or curves; without preload it is exact), rk45 (Dormand-Prince 5(4)), implicit
            (Radau IIA of order 9), or auto: the cheapest method that the scene allows; `Result.reason` explains the
            choice
    riders  the motion of each rider that moves, by its name: along x, which is its travel; the methods are then rk45
            and implicit. A rider without a motion is fixed to the body at its `position`
    rtol    1e-13 to 0.1, tolerated error of link loads with exponential, rk45 and implicit, as a share of the load
            scale: largest link load at rest plus quasi-static link load under the peaks of the motion (`load_scale_N`
            of the result)
    step    s, fixed step of exponential, rk45 and implicit instead of step-size control; steps end at samples of the
            motion
    times   (m,) s, instants to report, ascending; default: the samples of the motion, and where loads vibrate between
            them by more than 1 % of the largest dynamic load, instants in between; `times=motion.time` has the samples
            alone, with the peaks at any time (where a rack pushes, with the instants that its push needs)
    start   rest (static equilibrium under the weight), quasi-static (static equilibrium under the weight, the first
            acceleration and the first external load, as if they had acted for long), or auto:
            quasi-static for a record that begins under way, else rest; see `guideload.simulation.start`
    strict  compute the audit, and raise DoubtfulResult if it doubts the result: see `Audit.doubts`

    Raises SceneError (unsupported body), ArgumentError (method, rtol, step, times or start), RunError (with time and
    step).
    """
    run = prepared_run(machine, motion, method, rtol, step, times, start, riders, finer=times is None)
    result = Result.of_run(run)
    if strict:
        result.raise_if_doubtful()
    return result


@checked
def peak_loads(
    machine: Machine,
    motion: Motion,
    method: Method = "auto",
    *,
    riders: Mapping[str, Motion] | None = None,
    rtol: float = 1e-6,
    step: float | None = None,
    start: Start = "auto",
    strict: bool = False,
) -> Peaks:
    """The extremes of the load of every carriage at any time, without histories: between the samples too.

    Arguments and errors as for `simulate`. Only strict=True judges the loads: it computes a result and its audit too.
    """
    if strict:
        simulate(machine, motion, method, riders=riders, rtol=rtol, step=step, start=start, strict=True)
    run = prepared_run(machine, motion, method, rtol, step, None, start, riders)
    return peaks_of(run)


def prepared_run(
    machine: Machine,
    motion: Motion,
    method: str,
    rtol: float,
    step: float | None,
    times: ArrayLike | None,
    start: str | Array,
    riders: Mapping[str, Motion] | None = None,
    *,
    finer: bool = False,
) -> Run:
    """A run with its method chosen, with the push of a rack, not solved yet. Arguments and errors as for `simulate`.

    finer: with instants between the samples where loads vibrate, as always where a rack pushes. start: also a state
    (2, 6) of L in the travelling frame, such as `Solution.end` of the run before.
    """
    machine, motion, travel = with_riders(machine, motion, riders)
    machine, motion, straightness_loads = with_straightness_loads(machine, motion)
    chosen, reason = _method_and_reason(machine, motion, method, step, travel is not None)
    if straightness_loads is not None:
        machine.require_no_payloads("a run over rails that are not straight")
    motion, stretches = with_changes(machine, motion)
    instants = None if times is None else _instants(times)
    if instants is not None and np.array_equal(instants, motion.time):
        instants = None
    begin = start if isinstance(start, np.ndarray) else start_of(machine, motion, start)
    run = Run(
        machine, motion, chosen, reason, rtol, step, instants, begin, stretches, straightness_loads, travel
    )
    pushed = with_rack_push(run)
    return with_visible_vibration(run) if finer and pushed is run else pushed


def _instants(times: ArrayLike) -> Array:
    """A copy of the instants to report."""
    instants = real_array("times", times)
    if instants.ndim != 1:
        raise ArgumentError(f"times: expected shape (m,), got {instants.shape}")
    return instants


def _method_and_reason(
    machine: Machine, motion: Motion, method: str, step: float | None, riding: bool
) -> tuple[str, str]:
    """The integration method and the reason for it. riding: whether a rider moves."""
    if method not in CHOICES:
        raise ArgumentError(f"method: expected one of {', '.join(CHOICES)}, got {method!r}")
    if step is not None and not step < np.inf:
        raise ArgumentError(f"step: expected a finite time > 0 s, got {step:g} s")
    if method in ("auto", "exact") and step is not None:
        others = "rk45 or implicit, or exponential for preloaded contacts"
        raise ArgumentError(f'step: method "{method}" has none; leave step out, or use {others}')
    if method == "exponential" and machine.scene.model_level != "smooth nonlinear" and not riding:
        if step is not None:
            raise ArgumentError(
                'step: method "exponential" has none where no contact is preloaded, because it is exact there; leave '
                "step out, or use rk45 or implicit"
            )
        return "exact", "exponential was asked for, which is exact where no contact is preloaded"
    if method != "auto":
        return method, "asked for"
    if riding:
        return _by_stability(machine, motion, "a rider moves, so the mass matrix changes")
    if machine.scene.model_level == "linear":
        return "exact", "all links are linear: the matrix exponential is cheapest and has no step error"
    if machine.scene.model_level == "piecewise linear":
        return "exact", "links are linear between contact changes, which are located: no step error"
    if not machine.scene.has_segments:
        return _by_vibration(machine, motion)
    return _by_stability(machine, motion, "preloaded contacts beside clearance, sides or curves")


def _by_vibration(machine: Machine, motion: Motion) -> tuple[str, str]:
    """exponential, unless the fastest vibration limits its steps so much that implicit is cheaper."""
    sample_step = median_step(motion.time)
    fastest = fastest_vibration(machine)
    if LONGEST_STEP * METHODS["implicit"].cost / METHODS["exponential"].cost < fastest * sample_step:
        return "implicit", (
            f"preloaded contacts are not linear; the fastest vibration limits steps of exponential to "
            f"{digits(1e3 * LONGEST_STEP / fastest)} ms, far below the {digits(1e3 * sample_step)} ms between samples"
        )
    return (
        "exponential",
        "preloaded contacts are not linear: the linear part has no step error, the rest a small one",
    )


def _by_stability(machine: Machine, motion: Motion, cause: str) -> tuple[str, str]:
    """rk45, unless stability limits its steps so much that implicit is cheaper."""
    from guideload.simulation.stability_function import longest_stable_steps  # other scenes do not need it

    sample_step = median_step(motion.time)
    values = machine.scene.modes()[3]
    values = values[values.imag >= 0.0]  # one of each pair
    passive = np.minimum(values.real, 0.0) + 1j * values.imag
    longest = float(longest_stable_steps(passive).min())
    why = f"{cause}; rk45 is stable up to steps of {digits(1e3 * longest)} ms"
    if longest * METHODS["implicit"].cost / METHODS["rk45"].cost < sample_step:
        return (
            "implicit",
            f"{why}, far below the {digits(1e3 * sample_step)} ms between samples: the scene is stiff",
        )
    return "rk45", f"{why}: the scene is not stiff"
