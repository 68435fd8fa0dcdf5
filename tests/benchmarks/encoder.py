"""From samples to acceleration against filters chosen with the truth: `python tests/benchmarks/encoder.py`.

    --seed N, --rounds N   made moves: 64 cases a round (tests/helpers/made_traces.py)
    --cases                a line per case
    --peers N              PyNumDiff's methods at their own automatic choice, on cases up to N samples (minutes each)
    --random               cover of motions that are random at all times, as the model says
    --alike                share of bands that cover as asked, as they are and scaled by a factor that is best for
                           other moves of the same family, rate, quantum, jitter and noise

A case's ratio is the rms error of the acceleration over that of the best Savitzky-Golay filter, chosen with the truth
over orders 2, 4, 5, 6, some 40 windows each, and (with jitter) over taking the stamps for uniform or resampling by a
cubic spline. Cover is the share of true accelerations within +-1.96 standard deviations.
"""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import harness
import numpy as np
from made_traces import FAMILIES, JITTERS, NOISES, QUANTA, RATES, Array, Case, case, draw, moves
from peers.spline import smoothing_spline
from scipy.interpolate import CubicSpline
from scipy.signal import savgol_filter

from guideload import Machine, Motion, simulate
from guideload.cli.inputs import EXAMPLES
from guideload.smoothing.estimation import MotionEstimate, estimate

COVER = 0.90, 0.98  # of a case, beyond which the table counts it
LONG = 1_000_000  # samples
EXAMPLE = Machine.from_toml(EXAMPLES / "manipulator.toml")
PEERS = ("savgoldiff", "butterdiff", "kerneldiff", "polydiff", "splinediff", "spectraldiff", "rtsdiff")


@dataclass(frozen=True)
class Score:
    """One case."""

    case: Case
    best: float  # m/s2 rms, of the filter chosen with the truth
    how: str
    ratio: float
    cover: float
    order: int
    spline: float  # ratio of the smoothing spline
    load_cover: float  # share of true loads within the band, y and z of all carriages of the example
    peaks_held: float  # share of the carriages whose true peak lies within its band


def rms(x: Array) -> float:
    return float(np.sqrt(np.mean(np.square(x))))


def best_filter(case: Case) -> tuple[float, str]:
    """Rms error and name of the best Savitzky-Golay filter."""
    count = case.time.size
    step = float(case.time[-1] - case.time[0]) / (count - 1)
    even = case.time[0] + step * np.arange(count)
    views = [("as uniform", case.value)]
    if case.jitter:
        views.append(("resampled", CubicSpline(case.time, case.value)(even)))
    best = (np.inf, "")
    for name, value in views:
        for order in (2, 4, 5, 6):
            lengths = np.unique(
                np.geomspace(order + 1, min(count - 1, 0.5 / step), 40).astype(int) // 2 * 2 + 1
            )
            here, worse = np.inf, 0
            for length in lengths[(lengths > order) & (lengths <= count)]:
                found = savgol_filter(value, int(length), order, deriv=2, delta=step)
                if name == "resampled":
                    found = np.interp(case.time, even, found)
                error = rms(found - case.acceleration)
                best = min(best, (error, f"order {order}, {length} samples, {name}"))
                worse = 0 if error < here else worse + 1
                here = min(here, error)
                if worse > 8:
                    break
    return best


def score(case: Case) -> Score:
    """All of one case."""
    best, how = best_filter(case)
    found = estimate(case.time, case.value, "position", case.quantum)
    error = found.acceleration - case.acceleration
    cover = float(np.mean(np.abs(error) < 1.96 * np.sqrt(found.acceleration_variance)))
    by_spline = smoothing_spline(case.time, case.value, case.quantum)
    spline = rms(by_spline - case.acceleration) / best
    return Score(case, best, how, rms(error) / best, cover, found.order, spline, *loads(case, found))


def loads(case: Case, found: MotionEstimate) -> tuple[float, float]:
    """Cover of the loads, and share of the peaks within their bands."""
    true = simulate(EXAMPLE, Motion.along_x(case.time, case.acceleration), times=case.time)
    motion = Motion.along_x(case.time, found.acceleration, uncertainty=found.uncertainty)
    result = simulate(EXAMPLE, motion, times=case.time)
    across = {"axis": ["y", "z"]}
    error = result.data["force"].sel(across).values - true.data["force"].sel(across).values
    peaks, right = result.peaks(), true.peaks().peak_resultant_N
    held = (peaks.peak_lower_N <= right) & (right <= peaks.peak_upper_N)
    inside = np.abs(error) < 1.96 * result.data["force_sd"].sel(across).values
    return float(inside.mean()), float(held.mean())


def table(scores: list[Score]) -> None:
    """A line per family and one for all."""
    print(f"{'':14}cases  ratio spline   cover within   less   more")
    for family in (*FAMILIES, "all"):
        part = [s for s in scores if family in (s.case.family, "all")]
        cover = np.array([s.cover for s in part])
        less, more = np.mean(cover < COVER[0]), np.mean(cover > COVER[1])
        ratio, spline = (
            np.exp(np.mean(np.log(x))) for x in ([s.ratio for s in part], [s.spline for s in part])
        )
        print(
            f"{family:14}{len(part):>5}{ratio:>7.2f}{spline:>7.2f}{cover.mean():>8.3f}"
            f"{1.0 - less - more:>7.0%}{less:>7.0%}{more:>7.0%}"
        )
    cover, held = (np.mean(x) for x in ([s.load_cover for s in scores], [s.peaks_held for s in scores]))
    print(f"loads of the example: cover {cover:.3f}; {held:.0%} of true peaks within their bands")


def long_trace() -> None:
    """Time of a million samples, the best of three runs."""
    truth, end = moves("jerk-limited", np.random.default_rng(0))
    stamps = np.arange(LONG) * 1e-3
    turns, since = np.divmod(stamps, end)  # the moves again and again, each from where the last ended
    value = np.round((truth(since)[0] + turns * truth(np.array([end]))[0]) / 1e-6) * 1e-6
    taken = [harness.timed(lambda: estimate(stamps, value, "position", 1e-6)) for _ in range(3)]
    print(f"\n{LONG} samples: {min(taken):.2f} s")


def random_motions() -> None:
    """Cover of motions whose derivative of order N is stationary white noise, 2 s at 1 kHz with 1 um of noise."""
    rng = np.random.default_rng(0)
    for order, step in ((3, 2.0), (4, 20.0), (5, 300.0)):
        covers = []
        for _ in range(5):
            state = np.zeros((order, 2000))
            state[-1] = np.cumsum(step * rng.standard_normal(2000))
            for row in range(order - 2, -1, -1):
                state[row, 1:] = np.cumsum(0.5 * (state[row + 1, 1:] + state[row + 1, :-1])) * 1e-3
            found = estimate(np.arange(2000) * 1e-3, state[0] + 1e-6 * rng.standard_normal(2000), "position")
            error = np.abs(found.acceleration - state[2])
            covers.append(np.mean(error < 1.96 * np.sqrt(found.acceleration_variance)))
        print(f"random motion of order {order}: cover {np.mean(covers):.2f}")


def alike(settings: int = 6, number: int = 14) -> None:
    """Whether scaling by what is known of a trace helps: each move with the factor of the others of its setting."""
    rng = np.random.default_rng(4242)
    for family in FAMILIES:
        shares = []
        for _ in range(settings):
            rate, quantum = rng.choice(RATES[:3]), rng.choice(QUANTA)
            jitter, noise = rng.choice(JITTERS), rng.choice(NOISES)
            ranges = []  # of the logarithm of the factor with which a band covers as asked
            for seed in range(number):
                one = case(family, rate, quantum, jitter, noise, np.random.default_rng(7000 + seed))
                found = estimate(one.time, one.value, "position", one.quantum)
                error = np.abs(found.acceleration - one.acceleration) / np.sqrt(found.acceleration_variance)
                ranges.append(np.log(np.quantile(error / 1.96, COVER)))
            lower, upper = np.array(ranges).T
            middle = 0.5 * (lower + upper)
            factor = np.array([np.median(np.delete(middle, k)) for k in range(number)])
            shares.append([np.mean((lower < x) & (x < upper)) for x in (0.0, factor)])
        as_they_are, scaled = 100 * np.mean(shares, axis=0)
        print(
            f"{family:14} bands that cover as asked: {as_they_are:.0f} %, scaled as others alike {scaled:.0f} %"
        )


def twice(peer: str, case: Case) -> float:
    """Rms error of a PyNumDiff method applied twice, each time with the parameters that its optimiser chooses.

    The optimiser wants the band of the signal: it gets the truth's, to 99 % of the acceleration's power.
    """
    import pynumdiff
    from pynumdiff.optimize import optimize

    method: Callable[..., tuple[Array, Array]] = getattr(pynumdiff, peer)
    step = float(case.time[-1] - case.time[0]) / (case.time.size - 1)
    power = np.cumsum(np.abs(np.fft.rfft(case.acceleration)) ** 2)
    band = float(np.searchsorted(power, 0.99 * power[-1]) / (step * case.time.size))
    signal = case.value
    with warnings.catch_warnings(), open(os.devnull, "w") as nowhere:
        warnings.simplefilter("ignore")
        shown, sys.stderr = sys.stderr, nowhere
        try:
            for _ in range(2):
                chosen, _ = optimize(method, signal, step, bandlimit=band, parallel=False, maxiter=5)
                signal = method(signal, step, **chosen)[1]
        finally:
            sys.stderr = shown
    return rms(signal - case.acceleration)


def peers(scores: list[Score], longest: int) -> None:
    """PyNumDiff on every case of at most `longest` samples, the shortest first; how many of them it wins."""
    print(f"\nratio to the best filter{'':47}{'ours':>6}" + "".join(f"{peer:>14}" for peer in PEERS))
    lost = 0
    short = sorted((s for s in scores if s.case.time.size <= longest), key=lambda s: s.case.time.size)
    for one in short:
        cells = []
        for peer in PEERS:
            try:
                ratio = twice(peer, one.case) / one.best
                lost += ratio < one.ratio
                cells.append(f"{ratio:>14.2f}")
            except Exception as error:  # a method may refuse a case; the others go on
                cells.append(f"{type(error).__name__[:13]:>14}")
        print(f"{one.case.title[:70]:<70}{one.ratio:>6.2f}{''.join(cells)}", flush=True)
    print(f"{len(short)} cases, {len(PEERS)} methods: better than ours {lost} times")


def main() -> None:
    """Measure all, print all."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--cases", action="store_true", help="a line per case")
    parser.add_argument("--peers", type=int, metavar="N", help="PyNumDiff as well, on cases up to N samples")
    parser.add_argument("--random", action="store_true", help="motions that are random at all times as well")
    parser.add_argument("--alike", action="store_true", help="bands scaled as those of other moves alike")
    asked = parser.parse_args()
    long_trace()
    with ProcessPoolExecutor(2) as pool:
        scores = list(pool.map(score, draw(asked.seed, asked.rounds)))
    if asked.cases:
        for s in scores:
            print(
                f"{s.case.title}  {s.best:8.2g} m/s2 ({s.how})  {s.ratio:.2f} {s.cover:.3f} order {s.order}"
            )
    print()
    table(scores)
    if asked.random:
        random_motions()
    if asked.alike:
        alike()
    if asked.peers:
        peers(scores, asked.peers)


if __name__ == "__main__":
    main()
