"""Ctrl-C ends every call that takes long."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from reference import cart, cart_clear, cycle, preloaded

from guideload import Motion, peak_loads, simulate
from guideload._core import draw_motion, draw_peaks
from guideload.smoothing.estimation import estimate

INTO = 0.2  # s from the start of the call to Ctrl-C


def repeated(times: int) -> Motion:
    """The cycle again and again."""
    acceleration = np.tile(cycle().acceleration[:, 0], times)
    return Motion.along_x(1e-3 * np.arange(acceleration.size), acceleration)


def chain_of(count: int) -> tuple[Any, ...]:
    """A model of the smoother with so many samples."""
    segment = np.zeros(count - 1, np.uint32)
    return np.ones(count - 1), np.ones(count), np.eye(4), segment, np.array([1e-3]), None


@pytest.fixture(scope="module")
def motion() -> Motion:
    """2 million samples: each call with them takes more than a second."""
    return repeated(300)


def peaks_of_draws(motion: Motion) -> None:
    count, time, machine = motion.time.size, motion.time, cart()
    loads, judged = np.ones((count, 4, 6)), np.ones((count, 4), bool)
    carriages = machine.links_of_carriages, machine.carriage_centers
    draw_peaks(
        machine.scene, chain_of(count), 2, np.ones(count), time, time, loads, judged, *carriages, 10_000, 1, 2
    )


CALLS: dict[str, Callable[[Motion], object]] = {
    "simulate, implicit": lambda motion: simulate(preloaded(), motion, "implicit", rtol=1e-12),
    "simulate, rk45, preload": lambda motion: simulate(preloaded(), motion, "rk45", rtol=1e-12),
    "simulate, exponential": lambda motion: simulate(preloaded(), motion, "exponential", rtol=1e-13),
    "simulate, exact, contacts": lambda motion: [simulate(cart_clear(), motion) for _ in range(99)],
    "peak_loads": lambda motion: peak_loads(preloaded(), motion, "implicit", rtol=1e-12),
    "output times": lambda motion: simulate(
        cart(), motion, times=np.linspace(0.0, motion.time[-1], 30_000_000)
    ),
    "smoothing": lambda motion: estimate(motion.time, np.sin(0.7 * motion.time)),
    "draws of the motion": lambda motion: draw_motion(chain_of(motion.time.size), 2, 40, 1),
    "peaks": peaks_of_draws,
}


@contextmanager
def ctrl_c(handler: Callable[..., object] = signal.default_int_handler) -> Iterator[None]:
    """Send SIGINT to this process a while after the start of the block, and let this handler answer it."""
    before = signal.signal(signal.SIGINT, handler)
    timer = threading.Timer(INTO, signal.raise_signal, [signal.SIGINT])
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
        signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_ctrl_c_ends_a_call(call: Callable[[Motion], object], motion: Motion) -> None:
    with pytest.raises(KeyboardInterrupt), ctrl_c():
        call(motion)


def test_a_handler_of_the_user_decides() -> None:
    """The exception of a signal handler is raised unchanged; without an exception the call goes on to its end."""
    handled = []

    def refuses(*_: object) -> None:
        raise LookupError("mine")

    motion = repeated(15)  # half a second; runs to its end once
    with pytest.raises(LookupError, match="mine"), ctrl_c(refuses):
        peak_loads(preloaded(), motion, "implicit", rtol=1e-12)
    with ctrl_c(lambda *_: handled.append("handled")):
        peak_loads(preloaded(), motion, "implicit", rtol=1e-12)
    assert handled == ["handled"]
