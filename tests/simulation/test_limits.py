"""Work and memory are bounded: hostile numbers end in an error that says what to do."""

from pathlib import Path
from typing import Any

import pytest
from interrupts import run_process
from reference import body, cart, cart_clear, noisy

from guideload import Machine, Rail, RunError, simulate

CLEARANCE = {"clearance_y": 5e-6, "clearance_z": 5e-6}


def far_rail(z: float) -> Machine:
    """The cart with clearance, its second rail at z."""
    machine = cart_clear()
    rails = [machine.rails[0], Rail(name="2", position=(0.05, z))]
    return Machine(body=machine.body, rails=rails, carriages=machine.carriages, free=machine.free)


def light(mass: float) -> Machine:
    """The cart with clearance, with a body of this mass and moments of inertia of this number."""
    inertia = ((mass, 0.0, 0.0), (0.0, mass, 0.0), (0.0, 0.0, mass))
    machine = cart_clear()
    changed = body(mass=mass, inertia=inertia)
    return Machine(body=changed, rails=machine.rails, carriages=machine.carriages, free=machine.free)


@pytest.mark.parametrize("method", ["exact", "implicit", "rk45"])
@pytest.mark.parametrize(
    "machine",
    [far_rail(-1e9), far_rail(1e6), cart(1e200, **CLEARANCE), cart(1e30, **CLEARANCE), light(1e-9)],
    ids=["rail at -1e9 m", "rail at 1e6 m", "damping 1e200", "damping 1e30", "mass 1e-9 kg"],
)
def test_extreme_values_end(machine: Machine, method: Any) -> None:
    """Values that no machine has end in a result or an error that gives the time reached and a way out."""
    try:
        simulate(machine, noisy(), method)
    except RunError as error:
        assert "t = " in str(error) or "range of numbers" in str(error)
        assert "method" in str(error) or "?" in str(error)


def test_eigenvalues_beyond_the_range_of_numbers() -> None:
    """They are no LinAlgError of NumPy."""
    machine = cart(2e306, preload_y=1200.0, preload_z=1200.0, rolling="ball")
    with pytest.raises(RunError, match="eigenvalues"):
        simulate(machine, noisy())


LIMITED = """
import resource
import numpy as np
from guideload import Motion, peak_loads, simulate
from guideload._core import draw_motion, draw_peaks, smooth_motion
from guideload.smoothing.estimation import estimate
from reference import cart, cycle
count = 1_000_000
time = 1e-3 * np.arange(count)
motion = Motion.along_x(time, np.sin(time))
small = cycle()
chain = lambda n: (np.ones(n - 1), np.ones(n), np.eye(4), np.zeros(n - 1, np.uint32), np.array([1e-3]))
machine = cart()
result = simulate(machine, small)
used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + 80_000_000,) * 2)
print("begun", flush=True)
try:
    {call}
except MemoryError as error:
    print("refused:", error)
print("alive", peak_loads(machine, small).largest.shape)
"""

CALLS = {
    "states": "simulate(machine, motion)",
    "smoothing": "estimate(time, np.sin(time))",
    "smoother": "smooth_motion((np.ones(count - 1), time, time + 1.0, np.zeros(4), *chain(count)[2:]))",
    "draws": "draw_motion(chain(1000), 2, 10**5, 1)",
    "draws beyond 64 bits": "draw_motion(chain(1000), 2, 2**62, 1)",
    "peaks": "draw_peaks(machine.scene, chain(2), 2, np.ones(2), np.arange(2.0), np.arange(2.0), np.ones((2, 4, 6)), "
    "np.ones((2, 4), bool), machine.links_of_carriages, machine.carriage_centers, {draws}, 1, 2)",
}
CALLS |= {f"{draws} peaks": CALLS["peaks"].format(draws=draws) for draws in ("5 * 10**6", "2**60")}
del CALLS["peaks"]


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="the used memory is read from /proc")
@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_too_little_memory_is_an_error(call: str) -> None:
    """A call that needs more than 80 MB under that limit raises MemoryError, and the process goes on."""
    ended = run_process(LIMITED.replace("{call}", call))
    assert ended.returncode == 0, ended.stderr[-2000:]
    begun, refused, alive = ended.stdout.splitlines()
    assert (begun, alive) == ("begun", "alive (4, 8)")
    assert refused.startswith("refused: ") and len(refused) > 20
