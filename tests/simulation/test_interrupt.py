"""Ctrl-C ends every call that takes long; a thread that writes into an array meanwhile changes nothing."""

import threading

import numpy as np
import pytest
from interrupts import run_process

from guideload._core import draw_motion

LONG = """
import numpy as np
from reference import cart, cart_clear, cycle, preloaded
from guideload import Motion, peak_loads, simulate
from guideload._core import draw_motion, draw_peaks
from guideload.smoothing.estimation import estimate
once = cycle()
repeats = 300  # 2 million samples: each call takes more than a second
motion = Motion.along_x(1e-3 * np.arange(repeats * once.time.size), np.tile(once.acceleration[:, 0], repeats))
noise = np.random.default_rng(0).normal(0.0, 1e-6, motion.time.size)
position = 0.4 * np.sin(0.7 * motion.time) + noise
count = motion.time.size
chain = (
    np.ones(count - 1), np.ones(count), np.eye(4), np.zeros(count - 1, np.uint32), np.array([1e-3]), None
)
"""

CALLS = {
    "simulate, implicit": 'simulate(preloaded(), motion, "implicit", rtol=1e-12)',
    "simulate, rk45, preload": 'simulate(preloaded(), motion, "rk45", rtol=1e-12)',
    "simulate, exponential": 'simulate(preloaded(), motion, "exponential", rtol=1e-13)',
    "simulate, exact, contacts": "[simulate(cart_clear(), motion) for _ in range(99)]",
    "peak_loads": 'peak_loads(preloaded(), motion, "implicit", rtol=1e-12)',
    "output times": "simulate(cart(), motion, times=np.linspace(0.0, motion.time[-1], 30_000_000))",
    "smoothing": "estimate(motion.time, position)",
    "draws of the motion": "draw_motion(chain, 2, 40, 1)",
    "peaks": (
        "draw_peaks(cart().scene, chain, 2, np.ones(count), motion.time, motion.time, np.ones((count, 4, 6)), "
        "np.ones((count, 4), bool), cart().links_of_carriages, cart().carriage_centers, 10_000, 1, 2)"
    ),
}


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_ctrl_c_ends_a_call(call: str) -> None:
    """The call raises KeyboardInterrupt, and is not at its end."""
    ended = run_process(f"{LONG}\nprint('begun', flush=True)\n{call}\nprint('finished')", interrupt=True)
    assert ended.stdout == "begun\n", ended.stderr[-2000:]
    assert ended.stderr.rstrip().endswith("KeyboardInterrupt"), ended.stderr[-2000:]


def test_a_handler_of_the_user_decides() -> None:
    """The exception of a signal handler is raised unchanged; without an exception the call goes on to its end."""
    handler = """
import signal
def handle(*_):
    print("handled", flush=True)
    {action}
signal.signal(signal.SIGINT, handle)
"""
    call = "peak_loads(preloaded(), motion, 'implicit', rtol=1e-12)"
    long = LONG.replace("repeats = 300", "repeats = 60")  # runs to its end once
    setup = f"{long}{handler}\nprint('begun', flush=True)\n{call}\nprint('finished')"
    ended = run_process(setup.format(action="raise LookupError('mine')"), interrupt=True)
    assert ended.stdout == "begun\nhandled\n" and "LookupError: mine" in ended.stderr
    ended = run_process(setup.format(action="pass"), interrupt=True)
    assert ended.stdout == "begun\nhandled\nfinished\n", ended.stderr[-2000:]


def test_arrays_that_another_thread_changes_during_a_call() -> None:
    """A call checks the numbers that it uses: it is refused, or gives the result of the numbers it found sound."""
    count = 20_000
    segment = np.zeros(count - 1, np.uint32)
    chain = np.ones(count - 1), np.ones(count), np.eye(4), segment, np.array([1e-3]), None
    expected, over = draw_motion(chain, 2, 4, 1), threading.Event()

    def spoil() -> None:
        while not over.is_set():
            segment[:] = 7  # there is only segment 0
            segment[:] = 0

    thread = threading.Thread(target=spoil)
    thread.start()
    try:
        for _ in range(100):
            try:
                np.testing.assert_array_equal(draw_motion(chain, 2, 4, 1), expected)
            except ValueError as error:
                assert "lengths do not agree" in str(error)
    finally:
        over.set()
        thread.join()
    np.testing.assert_array_equal(draw_motion(chain, 2, 4, 1), expected)
