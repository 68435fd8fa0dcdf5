"""Runs the jobs of the chart: each method and setting on each scene, errors first, then times."""

from __future__ import annotations

import gc
import signal
import statistics
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from harness import installed, timed
from peers.problem import Array, At
from peers.roster import roster
from scenes import Case

from guideload import GuideloadError, simulate
from guideload.base.methods import Method

OURS = ("exact", "exponential", "rk45", "implicit")
TOLERANCES = tuple(10.0**-power for power in range(3, 11))
FAST, MODERATE, SLOW = 0.03, 0.3, 0.5  # s; timed in every round, in every third; slow ones only once
ROUNDING = 1e-12  # errors below it are rounding, and count as equal
MISSED = 0.5  # of the dynamic part: such a run has not seen the motion


@dataclass(frozen=True)
class Pace:
    """How much time the script takes."""

    patience: float  # s that a method may spend on a scene, from which on its tighter settings are left out
    limit: float  # s that a call may take
    rounds: int
    calls: int  # of fast jobs in a round
    thin: int  # every which setting is taken

    def taken(self, settings: tuple[float, ...]) -> tuple[float, ...]:
        """Of loose to tight, so that 1e-6 is among them."""
        return settings[self.thin - 1 :: self.thin] or settings


FULL = Pace(patience=2.0, limit=6.0, rounds=9, calls=3, thin=1)
QUICK = Pace(patience=0.3, limit=2.0, rounds=3, calls=2, thin=2)


@dataclass(eq=False)
class Job:
    """One method with one setting on one scene."""

    name: str
    call: Callable[[], Array]
    error: float  # of the load
    dynamic: float  # of its dynamic part
    times: list[float]  # s
    pareto_optimal: bool = False

    @property
    def ours(self) -> bool:
        return self.name.startswith("guideload")

    @property
    def rank(self) -> float:
        """Its error, but none below rounding."""
        return max(self.error, ROUNDING)

    @property
    def median(self) -> float:
        return statistics.median(self.times)


@dataclass(eq=False)
class Measured:
    """A scene and its jobs, those with a result that is a number."""

    case: Case
    jobs: list[Job] = field(default_factory=list)

    @property
    def valid(self) -> list[Job]:
        """Those that have seen the motion."""
        return [job for job in self.jobs if job.dynamic < MISSED]

    def of(self, name: str) -> list[Job]:
        """Those of one method that have seen the motion."""
        return [job for job in self.valid if job.name == name]

    def mark_front(self) -> None:
        """Pareto: no other job is at least as fast and as accurate, and better in one."""
        for job in self.valid:
            job.pareto_optimal = not any(
                other.median <= job.median
                and other.rank <= job.rank
                and (other.median < job.median or other.rank < job.rank)
                for other in self.valid
            )


def measure(cases: list[Case], pace: Pace) -> list[Measured]:
    """All jobs of all scenes; failures are told to stderr as they come."""
    scenes = []
    for case in cases:
        print(f"{case.title}: {case.truth.how}", file=sys.stderr)
        scene = Measured(case)
        for method in OURS:
            settings = (1e-6,) if method == "exact" else pace.taken(TOLERANCES)
            # Where nothing is preloaded, exponential is exact.
            if method != "exponential" or case.machine().model_level == "smooth nonlinear":
                scene.jobs += series(case, f"guideload {method}", ours(case, method), settings, pace)
        for peer in roster(case.linear()):
            if peer.charted and installed(peer.package) and not (peer.only_linear and case.law):
                with quiet():
                    at = peer.prepare(case.problem)
                scene.jobs += series(case, peer.name, at, pace.taken(peer.settings), pace)
        scenes.append(scene)
    time_again([job for scene in scenes for job in scene.jobs], pace)
    for scene in scenes:
        scene.mark_front()
    return scenes


def ours(case: Case, method: Method) -> At:
    """guideload's public call; of the exact method at the samples alone, where the others end their steps anyway."""
    machine, motion = case.machine(), case.motion
    times = motion.time if method == "exact" else None
    return lambda rtol: simulate(machine, motion, method=method, rtol=rtol, times=times).carriage_loads


def series(case: Case, name: str, at: At, settings: tuple[float, ...], pace: Pace) -> list[Job]:
    """From loose to tight, each called for its error, and again for its time where it is quick or was compiled."""
    jobs: list[Job] = []
    begun = time.perf_counter()
    for value in settings:
        if time.perf_counter() - begun > pace.patience:
            break
        call = partial(at, value)
        try:
            with quiet(), limited(pace.limit):
                start = time.perf_counter()
                loads = call()
                seconds = time.perf_counter() - start
                if seconds < SLOW or not jobs:
                    seconds = timed(call)
        except (RuntimeError, ArithmeticError, ValueError, TimeoutError, GuideloadError) as error:
            print(f"{name} at {value:g}: {error}", file=sys.stderr)
            continue
        error, dynamic = case.truth.errors(forces(loads))
        if np.isfinite(error):
            jobs.append(Job(name, call, error, dynamic, [seconds]))
    return jobs


def quickest(jobs: list[Job], error: float) -> Job | None:
    """The quickest that is at least that accurate."""
    enough = [job for job in jobs if job.error <= error]
    return min(enough, key=lambda job: job.median, default=None)


def time_again(jobs: list[Job], pace: Pace) -> None:
    """Let all jobs take turns, so that what else the machine does hits them alike."""
    first = {id(job): job.times[0] for job in jobs}
    gc.disable()
    for turn in range(pace.rounds):
        for job in jobs:
            with quiet():
                if first[id(job)] < FAST:
                    job.times += [timed(job.call) for _ in range(pace.calls)]
                elif first[id(job)] < MODERATE and turn % 3 == 0:
                    job.times.append(timed(job.call))
        gc.collect()
    gc.enable()


@contextmanager
def quiet() -> Iterator[None]:
    """Fixed steps beyond their limit overflow; the result says so."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Raises TimeoutError in code that comes by Python: some solvers never end beside a kink."""

    def stop(number: int, frame: Any) -> None:
        raise TimeoutError(f"no end within {seconds:g} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def forces(loads: Array) -> Array:
    """(time, carriage, 2) along y and z of either shape."""
    return loads[:, :, 1:3] if loads.shape[2] == 6 else loads


# ---- the pulse

PULSE_TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6)


def pulse_errors(case: Case) -> dict[str, list[float]]:
    """Error of the dynamic part of every method left to its tolerance, at each of PULSE_TOLERANCES."""
    table: dict[str, list[float]] = {}

    def put(name: str, at: At, settings: tuple[float, ...]) -> None:
        table[name] = []
        for value in settings:
            try:
                with quiet():
                    error = case.truth.errors(forces(at(value)))[1]
            except (RuntimeError, GuideloadError):
                error = np.inf
            table[name].append(error)

    for method in (method for method in OURS if method != "exponential"):  # there it is exact
        settings = (1e-6,) if method == "exact" else PULSE_TOLERANCES
        put(f"guideload {method}", ours(case, method), settings)
    for peer in roster(case.machine()):
        if peer.from_rest and installed(peer.package):
            alone = peer.fixed or peer.only_linear
            put(peer.name, peer.prepare(case.problem), peer.settings[:1] if alone else PULSE_TOLERANCES)
    return table
