"""Work and memory are bounded: hostile numbers end in an error that says what to do."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from interrupts import run_process
from reference import cart, cart_clear, noisy, piece

from guideload import Machine, Motion, RunError, SceneError, peak_loads
from guideload._core import Scene

PRELOAD = {"preload_y": 1200.0, "preload_z": 1200.0, "rolling": "ball"}


def scene(machine: Machine, **changes: Any) -> Scene:
    """The core's scene of a machine with changed arguments: machine files refuse such values at their key."""
    table, size = machine.link_table(), machine.body
    values: dict[str, Any] = {"mass": size.mass, "inertia": size.central_inertia().tolist()}
    values |= {"points": table.points, "damping": table.damping}
    return Scene(
        center_of_mass=size.center_of_mass,
        gravity=machine.gravity,
        free=machine.free,
        directions=table.directions,
        laws=table.laws,
        damping_in_contact=table.damping_in_contact,
        **(values | changes),
    )


def far_rail(z: float) -> dict[str, Any]:
    """The second rail of the cart at z."""
    points = cart().link_table().points.copy()
    points[points[:, 2] > 0, 2] = z
    return {"points": points}


SLIGHT = {"mass": 1e-9, "inertia": (1e-9 * np.eye(3)).tolist()}


@pytest.mark.parametrize(
    ("changes", "method"),
    [
        # Each kind of loop with what uses up its budget, some five seconds for implicit, and with what ends before.
        pytest.param(far_rail(-1e9), "exact", id="rail at -1e9 m"),
        pytest.param(far_rail(1e6), "rk45", id="rail at 1e6 m"),
        pytest.param({"damping": np.full(16, 1e200)}, "rk45", id="damping 1e200"),
        pytest.param({"damping": np.full(16, 1e200)}, "exact", id="damping 1e200, exact"),
        pytest.param({"damping": np.full(16, 1e30)}, "implicit", id="damping 1e30"),
        *(
            pytest.param(SLIGHT, method, id=f"mass 1e-9 kg, {method}")
            for method in ("exact", "implicit", "rk45")
        ),
    ],
)
def test_extreme_values_end(changes: dict[str, Any], method: Any) -> None:
    """Values that no machine has end in a result or an error that gives the time reached and a way out."""
    motion = piece(noisy(), 0, 150)  # the budget grows with the samples, and with the time up to a limit
    time = 1e-6 * motion.time if method == "exact" else motion.time
    try:
        scene(cart_clear(), **changes).solve(time, motion.acceleration, method=method, rtol=1e-6)
    except SceneError:
        pass  # the static position is refused
    except RunError as error:
        # The time reached, or, known before the first step, the number of steps.
        assert any(words in str(error) for words in ("t = ", "steps or more", "range of numbers"))
        assert "method" in str(error) or "?" in str(error)


@pytest.mark.parametrize("damping", [1e300, 1e306, 2e306, 1e307, 1e308])
def test_eigenvalues_beyond_the_range_of_numbers(damping: float) -> None:
    """They are finite, or a typed error; no LinAlgError of NumPy."""
    try:
        values = scene(cart(**PRELOAD), damping=np.full(16, damping)).modes()
    except (RunError, SceneError):
        return
    assert all(np.isfinite(part).all() for part in values)


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
chain = lambda n: (np.ones(n - 1), np.ones(n), np.eye(4), np.zeros(n - 1, np.uint32), np.array([1e-3]), None)
samples = (np.ones(2 * count - 1), *[np.ones(2 * count)] * 2, np.zeros(4), *chain(2 * count)[2:])
machine = cart()
result = simulate(machine, small)
calls = {calls}
used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + {spare},) * 2)
print("begun", flush=True)
for name, call in calls.items():
    try:
        call()
    except MemoryError as error:
        print("refused", name, error, sep=": ")
print("alive", peak_loads(machine, small).largest.shape)
"""

CALLS = {
    "states": "simulate(machine, motion)",
    "smoothing": "estimate(time, np.sin(time) + 0.01 * np.random.default_rng(0).normal(size=count))",
    "smoother": "smooth_motion(samples)",
    "draws": "draw_motion(chain(1000), 2, 10**5, 1)",
    "draws beyond 64 bits": "draw_motion(chain(1000), 2, 2**62, 1)",
    "peaks": "draw_peaks(machine.scene, chain(2), 2, np.ones(2), np.arange(2.0), np.arange(2.0), np.ones((2, 4, 6)), "
    "np.ones((2, 4), bool), machine.links_of_carriages, machine.carriage_centers, {draws}, 1, 2)",
}
CALLS |= {f"{draws} peaks": CALLS["peaks"].format(draws=draws) for draws in ("5 * 10**6", "2**60")}
del CALLS["peaks"]


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="the used memory is read from /proc")
def test_too_little_memory_is_an_error() -> None:
    """Calls that need more than some 80 MB under that limit raise MemoryError, and the process goes on.

    Where less than a page of the heap is left, the next few bytes end any process; then with another limit.
    """
    calls = ", ".join(f"{name!r}: lambda: {call}" for name, call in CALLS.items())
    for spare in (80_000_000, 83_000_000, 86_000_000):
        ended = run_process(LIMITED.replace("{calls}", f"{{{calls}}}").replace("{spare}", str(spare)))
        if not re.search(r"memory allocation of \d{1,4} bytes failed", ended.stderr):
            break
    assert ended.returncode == 0, ended.stderr[-2000:]
    begun, *refused, alive = ended.stdout.splitlines()
    assert (begun, alive) == ("begun", "alive (4, 8)")
    assert [line.split(": ")[1] for line in refused] == [*CALLS]
    assert all(len(line.split(": ", 2)[2]) > 10 for line in refused)


@pytest.mark.parametrize("law", [{}, PRELOAD])
def test_a_motion_that_rk45_cannot_follow_is_refused_before_its_first_step(law: dict[str, Any]) -> None:
    """400 stamps 1e6 s apart; the way out is a method that can."""
    time = 1e6 * np.arange(400.0)
    acceleration = np.sin(np.arange(400.0))[:, None] * [1.0, 0.0, 0.0]
    machine = cart(**law)
    with pytest.raises(RunError, match=r"steps or more.*in s.*use method") as caught:
        peak_loads(machine, Motion(time, acceleration), "rk45")
    assert ("implicit" if law else "exact") in str(caught.value)
