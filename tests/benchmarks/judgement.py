"""How often the audit doubts a right result, and how often it does not doubt a wrong one, over random machines.

    python tests/benchmarks/judgement.py [MACHINES] [FIRST_SEED]

Each seed is one of the damped_mixtures, whose links are linear, have play, are preloaded or mixed. Its loads are
computed in one of the WAYS, by method auto, rk45 or implicit, at rtol 1e-3 to 1e-8. Truth is exact or, with preload,
implicit at 1e-12; it is trusted where another method agrees with it to 1e-7 of the load scale. A result is right if its
error is at most what the audit says to be explained, wrong if it is more than twice that, or if its numbers were
changed. Results read from a file with other instants than the samples ("read") are solved again from the motion that is
stored beside them.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

import damped_mixtures
from damped_mixtures import TRUSTED

from guideload import GuideloadError, Machine, Motion, Result, simulate
from guideload.audit.verification import explained_error

KINDS = {
    "linear": ("linear",),
    "play": ("sides", "play", "curve"),
    "preloaded": ("preload",),
    "mixed": damped_mixtures.KINDS,
}
# As computed (twice as often), at given instants, the same as read from a file, with a
# fixed step, with a looser tolerance than it claims, with numbers changed afterwards.
WAYS = ("plain", "plain", "times", "read", "step", "claim", "changed")
RTOLS = (1e-3, 1e-4, 1e-6, 1e-8)
MOST_STEPS = 2e5  # of rk45, at its limit of stability


def truth_of(machine: Machine, motion: Motion, times: np.ndarray) -> np.ndarray | None:
    """Link loads of a trusted reference at these times; None if two methods differ."""
    scene, loads = machine.scene, []
    ways = [("implicit", 1e-12), ("rk45", 1e-11)]
    if scene.model_level != "smooth nonlinear":
        ways[0] = ("exact", 1e-6)
    if 10 * np.abs(scene.modes()[3]).max() * np.ptp(motion.time) > MOST_STEPS:
        ways[1] = ("implicit", 1e-11)
    for method, rtol in ways:
        inputs = motion.time, motion.acceleration, motion.wrench
        found = scene.solve(*inputs, method=method, rtol=rtol, times=times)
        loads.append(found.link_loads("total"))
    gap = np.abs(loads[0] - loads[1]).max() / found.load_scale
    return loads[0] if gap <= TRUSTED else None


def result_of(rng: np.random.Generator, machine: Machine, motion: Motion) -> tuple[str, Result]:
    """A result and the way in which it was computed."""
    explicit = 10 * np.abs(machine.scene.modes()[3]).max() * np.ptp(motion.time) < MOST_STEPS
    method = ("auto", "rk45" if explicit else "auto", "implicit")[rng.integers(3)]
    rtol, way = float(rng.choice(RTOLS)), WAYS[rng.integers(len(WAYS))]
    if way in ("times", "read"):
        fineness = 1 if way == "times" else 10
        times = np.sort(rng.uniform(motion.time[0], motion.time[-1], fineness * motion.time.size))
        found = simulate(machine, motion, method, rtol=rtol, times=times)
        if way == "times":
            return way, found
        if rng.random() < 0.5:
            loose = simulate(machine, motion, "implicit", rtol=0.1, times=times)
            return "read", _changed(loose, lambda data: None, rtol=1e-7)
        return way, _changed(found, lambda data: None)
    if way == "step":
        step = 10 ** rng.uniform(-1.5, 0) * float(np.median(np.diff(motion.time)))
        return way, simulate(machine, motion, "implicit", step=step)
    if way == "claim":
        return way, _changed(simulate(machine, motion, "implicit", rtol=0.1), lambda data: None, rtol=1e-7)
    found = simulate(machine, motion, method, rtol=rtol)
    if way == "plain":
        return way, found

    def change(data: dict[str, np.ndarray]) -> None:
        name = ("link_load", "velocity", "acceleration")[rng.integers(3)]
        data[name][rng.integers(1, len(data[name])) :] *= 1.0 + 10 ** rng.uniform(-4, 0)

    return way, _changed(found, change)


def _changed(result: Result, change: Callable[[dict[str, np.ndarray]], None], **attrs: float) -> Result:
    """The result as read from a file, after a change of its arrays and attributes."""
    data = result.data.copy(deep=True)
    change({name: data[name].values for name in data.data_vars})
    return Result(result.machine, data.assign_attrs(attrs))


def judge(seed: int) -> tuple[str, str, str, str]:
    """Kind and way of a seed, whether its result is right, and the judgement of the audit."""
    rng = np.random.default_rng(seed)
    kind = list(KINDS)[seed % len(KINDS)]
    try:
        machine, motion = damped_mixtures.scene(seed, KINDS[kind])
        way, result = result_of(rng, machine, motion)
    except GuideloadError as error:
        return kind, "", "refused", str(error)
    data = result.quantities
    truth = truth_of(machine, motion, data["time"])
    found = "; ".join(result.audit.doubts)
    if way == "changed":
        return kind, way, "wrong", found
    if truth is None:
        return kind, way, "untrusted", found
    error = (
        np.abs(data["link_load"] - truth).max()
        / float(data.attrs["load_scale_N"])
        / explained_error(data.attrs)
    )
    return kind, way, "right" if error <= 1.0 else "wrong" if error > 2.0 else "between", found


def main() -> None:
    count, first = (int(x) for x in (sys.argv[1:] + ["1000", "0"][len(sys.argv) - 1 :]))
    table: Counter[tuple[str, str, str, bool]] = Counter()
    for seed in range(first, first + count):
        kind, way, state, found = judge(seed)
        table[kind, way, state, bool(found)] += 1
        if (
            (state == "right" and found)
            or (state == "wrong" and not found)
            or state in ("untrusted", "refused")
        ):
            print(f"{seed} {kind} {way} {state}: {found[:200]}", flush=True)
    for kind in KINDS:
        for way in WAYS[1:]:
            cells = []
            for state in ("right", "between", "wrong", "untrusted"):
                doubted, believed = (table[kind, way, state, doubt] for doubt in (True, False))
                if doubted + believed:
                    cells.append(f"{state} {doubted + believed} (doubted {doubted})")
            print(f"{kind:10} {way:8} {', '.join(cells)}")
    for state, doubted, words in (("right", True, "false alarms"), ("wrong", False, "misses")):
        keys = [key for key in table if key[2] == state]
        hits = sum(table[key] for key in keys if key[3] == doubted)
        print(f"{words}: {hits} of {sum(table[key] for key in keys)}")


if __name__ == "__main__":
    main()
