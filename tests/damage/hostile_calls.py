"""Public functions with hostile arguments: each call ends in a result or a GuideloadError that names the argument.

    python tests/damage/hostile_calls.py [NAME]

Every argument of every call below is replaced by every value of VALUES; the others stay valid. A test does the same.
"""

from __future__ import annotations

import math
import os
import signal
import sys
import tempfile
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1]))

from guideload import (
    LifeConditions,
    LoadCase,
    Machine,
    Modes,
    Motion,
    Moves,
    Study,
    duty_cycle,
    exceedance_probability,
    frequency_response,
    life_of,
    motion_from_trace,
    peak_loads,
    plots,
    read_forces,
    read_trace,
    run_study,
    sensitivities,
    simulate,
    stability,
    work_precision,
)
from guideload.base.errors import GuideloadError
from guideload.cli.inputs import EXAMPLES
from guideload.sensitivity import VariedMachine
from guideload.sizing import largest

SECONDS = 30  # of processor time for one call
HUGE = 10**400
VALUES: dict[str, Any] = {
    **{
        repr(one): one
        for one in (None, True, 0, 1, -1, 2, 0.0, -0.0, 0.5, 1e-300, 5e-324, 1e-9, 1e9, 1e300, 1e308)
    },
    **{
        repr(one): one
        for one in (math.nan, math.inf, -math.inf, 2**63, 2**64, 1j, "", "x", "1", "1 m", "nan", b"x")
    },
    **{
        repr(one): one
        for one in ((), [], {}, [1], [1, 2, 3], ["x"], [[1]], [math.nan], [1e308] * 3, [0, 0, 0], {1})
    },
    "10**400": HUGE,
    "[10**400]": [HUGE],
    "Decimal": Decimal("1.5"),
    "Fraction": Fraction(1, 3),
    "object": object(),
    "type": int,
    "function": len,
    "complex array": np.ones(200) * 1j,
    "nan array": np.full(200, np.nan),
    "text array": np.array(["a"] * 200),
    "object array": np.array([None] * 200, dtype=object),
    "empty array": np.zeros(0),
    "dates": np.array(["2024-01-01"] * 200, "M8[s]"),
    "flags": np.ones(200, np.bool_),
    "matrix": np.ones((200, 3)),
    "small steps": np.arange(200) * 5e-324,
    "large": np.full(200, 1e308),
    "numpy float": np.float32(0.1),
    "path": Path("/nonexistent/file.toml"),
}
TIME = np.arange(200) * 5e-3
PUSH = np.sin(6 * TIME) * np.sin(np.pi * TIME)


def calls(folder: Path) -> dict[str, tuple[Callable[..., Any], dict[str, Any]]]:
    """Functions with valid arguments."""
    machine = Machine.from_toml(EXAMPLES / "manipulator.toml")
    gantry = Machine.from_toml(EXAMPLES / "gantry.toml")
    motion = Motion.along_x(TIME, PUSH, velocity=0.1 + 0 * TIME)
    moves = Moves(moves=[{"distance": 0.5, "speed": 1, "acceleration": 5, "jerk": 200}])
    result = simulate(machine, motion)
    rated = _rated(machine)
    life = simulate(rated, motion)
    trace = read_trace({"t_s": TIME, "v_m_s": np.round(0.1 * np.sin(6 * TIME), 4)})
    vary = [{"path": "body.mass", "distribution": "uniform", "plus_minus": "10 %"}]
    brief = Motion.along_x(TIME[:5], PUSH[:5], velocity=0.1 + 0 * TIME[:5])
    study = Study(machine=machine, motion=brief, samples=8, seed=1, vary=vary)
    done = run_study(study, folder / "study", threads=1)
    varied = VariedMachine(gantry, ["body.mass"])
    both = dict(machine=machine, motion=motion)
    run = dict(rtol=1e-4, step=None, start="auto")
    return {
        "simulate": (simulate, both | dict(method="auto", riders=None, times=[0.1, 0.2], strict=False) | run),
        "simulate rk45": (simulate, both | dict(method="rk45", rtol=1e-3, step=1e-3)),
        "peak_loads": (peak_loads, both | dict(method="implicit") | run),
        "sensitivities": (
            sensitivities,
            dict(machine=gantry, motion=motion, of="resultant", to="body.mass", start="rest"),
        ),
        "VariedMachine": (VariedMachine, dict(machine=gantry, to=["body.mass"], motion=motion)),
        "VariedMachine.at": (varied.at, dict(values=[50.0])),
        "VariedMachine.run": (varied.run, dict(motion=motion, values=[50.0], start="rest")),
        "frequency_response": (
            frequency_response,
            dict(machine=gantry, frequency=[1.0, 2.0], force_at="head", direction="x"),
        ),
        "Linearised.response": (
            varied.at().response,
            dict(frequency=[1.0, 2.0], point=[0, 0, 0], direction=(1, 0, 0)),
        ),
        "life_of": (life_of, dict(result=life, conditions=LifeConditions())),
        "Life.hours": (life_of(life).hours, dict(life=1e6)),
        "duty_cycle": (duty_cycle, dict(cases=[LoadCase("a", rated, motion, 10.0)], period=3600.0)),
        "stability": (stability, dict(machine=machine, motion=motion, rtol=1e-4)),
        "work_precision": (work_precision, dict(machine=machine, motion=brief, budget=0.01)),
        "largest": (
            largest,
            dict(
                machine=rated,
                motion=motion,
                quantity="payload",
                at=(0, 0, 0),
                conditions=LifeConditions(safety=0.1),
            ),
        ),
        "Motion": (
            Motion,
            dict(time=TIME, acceleration=np.zeros((200, 3)), velocity=None, position=None, wrench=None),
        ),
        "Motion.along_x": (Motion.along_x, dict(time=TIME, acceleration=PUSH, velocity=None, position=None)),
        "with_force": (motion.with_force, dict(point=[0, 0, 0], force=[1, 0, 0], moment=None, time=None)),
        "Moves.with_limit": (moves.with_limit, dict(name="speed", factor=0.5)),
        "Moves.limit": (moves.limit, dict(name="speed")),
        "Moves": (
            Moves,
            dict(
                moves=[{"distance": 1}],
                limits=dict(speed=1, acceleration=1, jerk=9),
                start=0,
                repeat=1,
                rate=99,
            ),
        ),
        "Moves.from_texts": (
            Moves.from_texts,
            dict(texts=["distance=1 m, speed=1 m/s, acceleration=1 m/s^2, jerk=9 m/s^3"]),
        ),
        "read_trace": (
            read_trace,
            dict(table={"t_s": TIME, "v_m_s": PUSH}, column="v_m_s", rate=None, quantum=None, hold=1),
        ),
        "read_forces": (read_forces, dict(table={"t_s": TIME, "Fx_N": PUSH}, time=None, rate=None)),
        "motion_from_trace": (
            motion_from_trace,
            dict(trace=trace, drive=None, smoothing="savitzky_golay", window=0.05),
        ),
        "run_study": (run_study, dict(study=study, output=None, threads=1, chunk=4, in_flight=None)),
        "exceedance_probability": (
            exceedance_probability,
            dict(
                study=study,
                name="peak_resultant_N",
                limit="4 kN",
                coefficient_of_variation=0.3,
                most_runs=20_000,
                threads=1,
            ),
        ),
        "StudyResult.quantiles": (
            done.quantiles,
            dict(name="peak_resultant_N", levels=[0.5], confidence=0.9),
        ),
        "StudyResult.exceedance": (done.exceedance, dict(name="peak_resultant_N", confidence=0.9)),
        "StudyResult.probability_above": (done.probability_above, dict(name="peak_resultant_N", limit=4e3)),
        "StudyResult.table": (done.table, dict(columns=["body.mass"])),
        "Result.settling": (result.settling, dict(window="10 um")),
        "Result.to_csv": (result.to_csv, dict(path=folder / "loads.csv")),
        "Result.to_netcdf": (result.to_netcdf, dict(path=folder / "loads.nc")),
        "Result.load": (type(result).load, dict(path=folder / "loads.nc")),
        "StudyResult.load": (type(done).load, dict(folder=folder / "study")),
        "Machine.from_toml": (Machine.from_toml, dict(file=EXAMPLES / "gantry.toml")),
        "Machine.with_free": (machine.with_free, dict(free=["y", "z"])),
        "Machine.with_payloads": (machine.with_payloads, dict(payloads=[])),
        "Machine.point": (gantry.point, dict(name="head")),
        "plots.resultant": (plots.resultant, dict(result=result)),
        "plots.load_y": (plots.load_y, dict(result=result, carriage="1a", ax=None)),
        "plots.modes": (plots.modes, dict(machine=machine, modes=Modes.of(machine))),
        "plots.scene": (plots.scene, dict(machine=machine, result=result)),
    }


def _rated(machine: Machine) -> Machine:
    """The machine with products that have ratings."""
    rating = {"value": "27 kN", "base": "50 km"}
    moments = {"roll": 300, "pitch": 300, "yaw": 300}
    product = dict(
        name="p", maker="m", edition="e", type="ball", dynamic=rating, static="40 kN", static_moments=moments
    )
    carriages = [one.model_dump(exclude_none=True) | {"product": "p"} for one in machine.carriages]
    return Machine(**machine.model_dump(exclude_none=True) | {"products": [product], "carriages": carriages})


class Slow(BaseException):
    """A call took too long."""


def _stop(number: int, frame: FrameType | None) -> None:
    raise Slow


def outcome(function: Callable[..., Any], arguments: dict[str, Any]) -> str:
    """`answered`, `refused`, or what is wrong with a call."""
    signal.signal(signal.SIGPROF, _stop)
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            function(**arguments)
    except GuideloadError as error:
        text = str(error)
        return "refused" if text and len(text) < 4000 else f"a message of {len(text)} characters"
    except Slow:
        return f"more than {SECONDS} s"
    except MemoryError:
        return "refused"
    except BaseException as error:
        return f"{type(error).__name__}: {' '.join(str(error).split())[:160]}"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
    return "answered"


def outcomes(folder: Path, only: str = "") -> Iterator[tuple[str, str, str, str]]:
    """Call, argument, value and outcome."""
    before = Path.cwd()
    os.chdir(folder)  # some values are names of files and folders that a call may write
    try:
        for name, (function, valid) in calls(folder).items():
            if only not in name:
                continue
            yield name, "", "", outcome(function, valid)
            for key in valid:
                for text, value in VALUES.items():
                    yield name, key, text, outcome(function, valid | {key: value})
    finally:
        os.chdir(before)


def main() -> None:
    """Print what went wrong, and the counts."""
    counts: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        for name, key, text, found in outcomes(Path(folder), *sys.argv[1:2]):
            kind = found if found in ("answered", "refused") else "failed"
            counts[kind] += 1
            if kind == "failed" or (not key and found != "answered"):
                print(f"{name}({key}={text}): {found}", flush=True)
    print(", ".join(f"{count} {kind}" for kind, count in sorted(counts.items())))
    sys.exit(counts["failed"] > 0)


if __name__ == "__main__":
    main()
