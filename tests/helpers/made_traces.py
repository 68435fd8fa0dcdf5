"""Made traces with their truth: moves of drives, sampled and quantised as encoders do, drawn at random from a seed.

A move is known exactly: its acceleration is linear between corners (jumps allowed) or a sine squared, and a ringing one
is the closed-form answer of an oscillator to such an acceleration. Nothing here uses guideload.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import astuple, dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from oscillator import free_vibration
from scipy.interpolate import PPoly

Array: TypeAlias = NDArray[np.float64]
Truth: TypeAlias = Callable[[Array], tuple[Array, Array, Array]]  # position, velocity, acceleration at times

FAMILIES = ("jerk-limited", "trapezoid", "sin2", "ringing")
RATES = (100.0, 250.0, 1000.0, 4000.0)  # Hz
QUANTA = (5e-8, 1e-6, 1e-5, 8e-5)  # m
JITTERS = (0.0, 0.05, 0.15)  # of the step, uniform to either side
NOISES = (0.0, 0.0, 0.5, 3.0)  # rms in quanta before rounding, held to at most LOUDEST
LOUDEST = 2e-5  # m


@dataclass(frozen=True, eq=False)
class Case:
    """A trace and its truth at the stamps."""

    family: str
    rate: float
    quantum: float
    jitter: float
    noise: float  # m rms before rounding
    time: Array
    value: Array
    position: Array
    velocity: Array
    acceleration: Array

    @property
    def title(self) -> str:
        """The case in one line."""
        return (
            f"{self.family:12} {self.rate:5.0f} Hz  {self.quantum:7.0e} m  jitter {100 * self.jitter:2.0f} %  "
            f"noise {self.noise:7.1e} m  {self.time.size:6} samples"
        )


@dataclass(frozen=True)
class Piece:
    """Stretch of a move: its acceleration is linear, less ripple cos(2 pi s/length), s since its start."""

    length: float
    first: float
    last: float
    ripple: float = 0.0


def sine_squared(length: float, height: float) -> Piece:
    """Acceleration height sin^2(pi s/length)."""
    return Piece(length, height / 2, height / 2, height / 2)


def course(pieces: list[Piece]) -> Truth:
    """The pieces one after the other, from rest at 0; the last, which has no ripple, goes on for ever."""
    lengths, first, last, ripples = np.array([astuple(piece) for piece in pieces]).T
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    acceleration = PPoly([(last - first) / lengths, first], starts)
    velocity, position = acceleration.antiderivative(), acceleration.antiderivative(2)

    def truth(time: Array) -> tuple[Array, Array, Array]:
        number = np.clip(np.searchsorted(starts, time, side="right") - 1, 0, len(pieces) - 1)
        w, ripple = 2 * np.pi / lengths[number], ripples[number]
        phase = w * (time - starts[number])
        return (
            position(time) + ripple * (np.cos(phase) - 1) / w**2,
            velocity(time) - ripple * np.sin(phase) / w,
            acceleration(time) - ripple * np.cos(phase),
        )

    return truth


def ringing(corners: Array, heights: Array, frequency: float, damping: float) -> Truth:
    """Answer of an oscillator (Hz, damping ratio), driven at its foot by an acceleration linear between corners.

    d = x - u obeys d'' + 2 D w d' + w^2 d = -u''; for u'' = h + g s the particular answer is linear in s.
    """
    w = 2 * np.pi * frequency

    def drive(first: float, last: float, length: float) -> tuple[float, float]:
        slope = (last - first) / length
        return -first / w**2 + 2 * damping * slope / w**3, -slope / w**2

    foot = course(
        [
            Piece(float(b - a), float(f), float(g))
            for a, b, f, g in zip(corners[:-1], corners[1:], heights[:, 0], heights[:, 1], strict=True)
        ]
    )
    starts, states = [], []
    d, e = 0.0, 0.0

    def free(s: Array, d0: float, e0: float) -> tuple[Array, Array, Array]:
        y, y1 = free_vibration((1.0, w**2, 2 * damping * w), s, d0, e0)
        return y, y1, -2 * damping * w * y1 - w**2 * y

    for a, b, (first, last) in zip(corners[:-1], corners[1:], heights, strict=True):
        p, slope = drive(float(first), float(last), float(b - a))
        starts.append(float(a))
        states.append((p, slope, d - p, e - slope))
        y, y1, _ = free(np.array([b - a]), d - p, e - slope)
        d, e = p + slope * float(b - a) + float(y[0]), slope + float(y1[0])

    def truth(time: Array) -> tuple[Array, Array, Array]:
        x, v, a = foot(time)
        number = np.clip(np.searchsorted(starts, time, side="right") - 1, 0, len(starts) - 1)
        for i, (p, slope, d0, e0) in enumerate(states):
            here = number == i
            s = time[here] - starts[i]
            y, y1, y2 = free(s, d0, e0)
            x[here] += p + slope * s + y
            v[here] += slope + y1
            a[here] += y2
        return x, v, a

    return truth


def moves(family: str, rng: np.random.Generator) -> tuple[Truth, float]:
    """Two to four moves of a family, each with its own speed, acceleration and stroke, and dwells; the end time."""
    pieces: list[Piece] = []

    def add(length: float, first: float, last: float) -> None:
        pieces.append(Piece(length, first, last))

    sign = 1.0
    height = np.exp(rng.uniform(np.log(1.0), np.log(10.0)))
    add(rng.uniform(0.2, 0.5), 0.0, 0.0)
    for _ in range(rng.integers(2, 5)):
        peak = sign * height * rng.uniform(0.5, 1.0)
        hold, cruise = rng.uniform(0.06, 0.3), rng.uniform(0.0, 0.5)
        ramp = hold * rng.uniform(0.15, 0.6)
        if family == "sin2":
            for side in (1.0, -1.0):
                pieces.append(sine_squared(1.5 * hold, side * peak))
                if side > 0:
                    add(cruise + 1e-3, 0.0, 0.0)
        else:
            soft = family == "jerk-limited" or (family == "ringing" and rng.uniform() < 0.5)
            for side in (peak, -peak):
                if soft:
                    add(ramp, 0.0, side)
                add(hold, side, side)
                if soft:
                    add(ramp, side, 0.0)
                if side == peak:
                    add(cruise + 1e-3, 0.0, 0.0)
        add(rng.uniform(0.2, 0.6), 0.0, 0.0)
        sign = -sign
    lengths, firsts, lasts, _ = np.array([astuple(piece) for piece in pieces]).T
    end = float(np.sum(lengths))
    if family == "ringing":
        corners = np.concatenate([[0.0], np.cumsum(lengths)])
        frequency, damping = np.exp(rng.uniform(np.log(4.0), np.log(25.0))), rng.uniform(0.02, 0.15)
        return ringing(corners, np.column_stack([firsts, lasts]), frequency, damping), end
    return course(pieces), end


def case(
    family: str, rate: float, quantum: float, jitter: float, noise: float, rng: np.random.Generator
) -> Case:
    """One trace: stamps jitter and are known; the value is rounded to the quantum after noise (rms in quanta)."""
    truth, end = moves(family, rng)
    time = np.arange(int(end * rate)) / rate
    time = np.clip(time + jitter / rate * rng.uniform(-1.0, 1.0, time.size), 0.0, None)
    position, velocity, acceleration = truth(time)
    shift = rng.uniform(0.0, 1.0) * quantum
    level = min(noise * quantum, LOUDEST)
    raw = position + shift + level * rng.standard_normal(time.size)
    value = quantum * np.round(raw / quantum) - shift
    return Case(family, rate, quantum, jitter, level, time, value, position, velocity, acceleration)


def draw(seed: int, rounds: int = 1) -> Iterator[Case]:
    """`rounds` cases of each family, rate and quantum, jitter and noise at random."""
    rng = np.random.default_rng(seed)
    for _ in range(rounds):
        for family in FAMILIES:
            for rate in RATES:
                for quantum in QUANTA:
                    yield case(family, rate, quantum, rng.choice(JITTERS), rng.choice(NOISES), rng)
