"""The pictures in README and docs; those of benchmarks are written by tests/benchmarks."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from example import EXAMPLES, identified, machine, motion, result, study
from numpy.typing import NDArray

from guideload import Inspection, Machine, Motion, plots, read_trace, simulate, stability

ROOT = Path(__file__).resolve().parents[1]
IMAGES = ROOT / "docs" / "images"


def encoder() -> Path:
    inspection = Inspection.of(read_trace(EXAMPLES / "manipulator.csv"), machine())
    return plots.save(plots.encoder(inspection)[0], IMAGES / "encoder.png")


def validation() -> Path:
    """A mass on links against the closed form of its step response; rk45 and implicit against exact on the example."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    time, simulated, closed = step_response()
    left.plot(1e3 * time, closed, color="0.75", linewidth=4, label="closed form")
    left.plot(1e3 * time, simulated, color="C0", linewidth=1, label="exact")
    left.set(xlabel="time in ms", ylabel="deflection in µm", title="A mass after a step of acceleration")
    largest = np.abs(simulated - closed).max() / np.abs(closed).max()
    left.legend(frameon=False, title=f"largest difference {largest:.0e}")
    tolerances = 10.0 ** -np.arange(3.0, 11.5)
    for method, color in (("rk45", "C1"), ("implicit", "C2")):
        right.loglog(tolerances, errors(method, tolerances), "o-", color=color, label=method)
    right.loglog(tolerances, tolerances, color="0.75", label="error = rtol")
    right.set(xlabel="rtol", ylabel="error of the loads, part of the largest")
    right.set_title("Example: difference from exact")
    right.legend(frameon=False)
    path = IMAGES / "validation.png"
    figure.savefig(path, dpi=130)
    return path


def step_response() -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Times [s], and deflection [µm] by the program and in closed form, of a mass that y alone lets move."""
    mass, stiffness, damping, step = 100.0, 4e8, 1e4, 2.0
    spring = {"name": "spring", "point": [0, 0, 0], "direction": [0, 1, 0]}
    link = spring | {"stiffness": stiffness, "damping": damping}
    body = {"mass": mass, "center_of_mass": [0, 0, 0], "inertia": np.eye(3).tolist()}
    held = Machine(body=body, links=[link], free=["y"], gravity=[0, 0, 0])
    acceleration = np.zeros((4, 3))
    acceleration[2:, 1] = step
    time = np.linspace(0.0, 0.08, 801)
    result = simulate(held, Motion([0.0, 0.01, 0.01, 0.08], acceleration), times=time)
    omega = np.sqrt(stiffness / mass)
    zeta = damping / (2.0 * mass * omega)
    since = np.maximum(time - 0.01, 0.0)
    ring = omega * np.sqrt(1.0 - zeta**2)
    decay = np.exp(-zeta * omega * since)
    swing = np.cos(ring * since) + zeta * omega / ring * np.sin(ring * since)
    closed = -step / omega**2 * (1.0 - decay * swing)
    return time, 1e6 * result.data["displacement"].sel(dof="y").values, 1e6 * closed


def errors(method: str, tolerances: NDArray[np.float64]) -> list[float]:
    """Largest difference of any carriage's force to `exact` on the example, as a part of the largest force."""
    true = result().carriage_loads[:, :, :3]
    runs = [simulate(machine(), motion(), method=method, rtol=float(rtol)) for rtol in tolerances]
    return [float(np.abs(run.carriage_loads[:, :, :3] - true).max() / np.abs(true).max()) for run in runs]


def wavy_rails() -> Path:
    """The resultants over random rails, by the code of their page."""
    page = (ROOT / "docs" / "how-to" / "rails-that-are-not-straight.md").read_text(encoding="utf-8")
    names: dict[str, Any] = {}
    for code in re.findall(r"```python\n(.*?)```", page, re.DOTALL):
        exec(re.sub("plots.save.*", "", code), names)
    return plots.save(plots.resultant(names["result"]), IMAGES / "wavy-rails.png")


PICTURES: dict[str, Callable[[], Path]] = {
    "resultant": lambda: plots.save(plots.resultant(result()), IMAGES / "resultant.png"),
    "scene": lambda: plots.save(plots.scene(machine(), result()), IMAGES / "scene.png"),
    "modes": lambda: plots.save(plots.modes(machine(), result().modes)[0], IMAGES / "modes.png"),
    "spectrum": lambda: plots.save(plots.spectrum(result()), IMAGES / "spectrum.png"),
    "encoder": encoder,
    "exceedance": lambda: plots.save(plots.exceedance(study()), IMAGES / "exceedance.png"),
    "drivers": lambda: plots.save(plots.tornado(study()), IMAGES / "drivers.png"),
    "stability": lambda: plots.save(plots.stability(stability(machine()))[0], IMAGES / "stability.png"),
    "validation": validation,
    "wavy-rails": wavy_rails,
    "identified": lambda: plots.save(plots.identified_numbers(identified()), IMAGES / "identified.png"),
    "modal-test": lambda: plots.save(plots.modal_test(identified())[0], IMAGES / "modal-test.png"),
}
