"""Samples of a study as single runs of machines that are built with their values."""

import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from guideload import Machine, Study, peak_loads, simulate
from guideload.parameters.parameters import Parameters, changed

LOADS = ("Fx", "Fy", "Fz", "Mx", "My", "Mz", "resultant")


def with_value(of: Machine, path: str, value: float) -> Machine:
    """The machine built with another value of one parameter, by the keys of its file."""
    values = of.model_dump(mode="json")
    *keys, last = (key.strip('"') for key in re.split(r"\]\.|[.\[]", path))
    part: Any = values
    for key in keys:
        part = part[key] if isinstance(part, dict) else next(one for one in part if one["name"] == key)
    if isinstance(part, dict):
        part[last] = value
    elif last == "scale":
        part[:] = [(d, value * force) for d, force in part]
    elif len(last) == 2:
        i, j = map("xyz".index, last)
        part[i][j] = part[j][i] = value
    else:
        part[("yz" if len(part) == 2 else "xyz").index(last)] = value
    return Machine(**values)


def sample_machine(study: Study, sample: int) -> Machine:
    """The machine of a sample."""
    plan, machine = study.plan(), study.machine
    parameters = Parameters(machine, plan.motion)
    for factor, number in zip(plan.factors, plan.values(sample, sample + 1)[0].tolist(), strict=False):
        for path in factor.targets:
            (parameter,) = parameters.at(path)
            machine = with_value(machine, path, changed(parameter.value, factor.form, number))
    return machine


def assert_samples_are_runs(study: Study, samples: Sequence[int], tolerance: float) -> None:
    """Statistics and histories at the stamps, and peaks at any time, are those of single runs."""
    plan = study.plan()
    measures, time = plan.metadata.measures, plan.motion.time
    values = plan.values(0, plan.runs)[list(samples)]
    rows, failures = plan.batch_at_stamps().run(values, 1)
    at_any_time, _ = plan.batch().run(values, 1)
    histories, _ = plan.batch_at_stamps().histories(values)
    assert not failures
    options: dict[str, Any] = {key: getattr(plan.metadata, key) for key in ("method", "rtol", "start")}
    weights = np.convolve(np.diff(time), [0.5, 0.5]) / (time[-1] - time[0])
    for sample, row, any_time, history in zip(samples, rows, at_any_time, histories, strict=True):
        run = sample_machine(study, sample), study.sample_motion(sample)
        data = simulate(*run, times=time, **options).quantities
        resultant, drive = data["resultant"], data["reaction"][:, 0]
        loads = np.concatenate([data["force"], data["moment"], resultant[:, :, None]], axis=2)
        assert np.abs(history - loads[:, :, :6]).max() <= tolerance * resultant.max()
        peaks = peak_loads(*run, **options).largest[:, 6]
        for (load, carriage, statistic), found, other in zip(measures, row, any_time, strict=True):
            if load not in (*LOADS, "drive"):
                continue
            of = drive if load == "drive" else loads[:, carriage, LOADS.index(load)]
            size = np.abs(drive).max() if load == "drive" else resultant.max()
            if statistic.startswith("time_of"):
                extreme = of.min() if statistic.endswith("min") else of.max()
                assert np.abs(of[time == found] - extreme).min() <= 1e-9 * size
                continue
            expected = {"min": of.min(), "max": of.max(), "start": of[0], "rms": np.sqrt(weights @ of**2)}
            if (load, statistic) == ("resultant", "rms"):
                size = expected["rms"]
            assert abs(found - expected[statistic]) <= tolerance * size, (load, carriage, statistic)
            if (load, statistic) == ("resultant", "max"):
                assert abs(other - peaks[carriage]) <= 1e2 * tolerance * size
