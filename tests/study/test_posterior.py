"""Laws of a study whose motion scatters: each sample has a draw of the trace's posterior."""

from __future__ import annotations

import pickle
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import reference as ref
from samples import assert_samples_are_runs
from scipy.stats import ks_2samp
from texts import one_line

from guideload import Machine, Motion, Study, _core, exceedance_probability, run_study, simulate
from guideload.base.errors import ArgumentError, ConfigError
from guideload.machine.payloads import Payload
from guideload.motion.uncertainty import Uncertainty
from guideload.reports.study import study_report
from guideload.study.metadata import DRAWN_MOTION
from guideload.study.tasks import run_chunk

COUNT, STEP = 75, 0.004  # samples, s: four blocks of 16 and a part of one
VARY = ({"path": "body.mass", "distribution": "uniform", "plus_minus": "10 %"},)
FIXED = ({"path": "body.mass", "distribution": "uniform", "plus_minus": "1e-9 %"},)


def uncertain(size: float = 0.3, states: int = 3) -> Motion:
    """A swing whose acceleration is known to about `size` m/s2."""
    posterior = Uncertainty(
        step=np.ones(COUNT - 1),
        variance=np.full(COUNT, 0.3),
        covariance=4.0 * np.eye(states),
        segment=np.zeros(COUNT - 1, np.uint32),
        density=np.array([0.5]),
        derivative=states - 1,
        unit=size * np.linspace(0.7, 1.3, COUNT),
    )
    time = STEP * np.arange(COUNT)
    turn = 2.0 * np.pi * time / time[-1]
    return Motion.along_x(time, 3.0 * np.sin(turn), velocity=1.0 - np.cos(turn), uncertainty=posterior)


def study_of(machine: Machine, motion: Motion, **options: Any) -> Study:
    options = {"vary": VARY, "samples": 11, "seed": 3, "rtol": 1e-9, "posterior": True} | options
    return Study(machine=machine, motion=motion, **options)


def with_payload(machine: Machine) -> Machine:
    """With a payload that is gripped and released between the stamps of the motion."""
    part = Payload(
        name="part", mass=80.0, center_of_mass=(0.1, 0.2, 0.3), inertia=np.diag([2.0, 3.0, 4.0]),
        times=[(0.0573, 0.1811)],
    )  # fmt: skip
    return machine.model_copy(update={"payloads": (part,)})


def pushed(motion: Motion) -> Motion:
    """With a process force that jumps between the stamps of the motion."""
    return motion.with_force((0.1, 0.0, 0.2), [[0.0, 0.0, 900.0]] * 2, time=[0.0513, 0.2017])


@pytest.mark.parametrize(
    ("machine", "motion", "options", "tolerance"),
    [
        (ref.cart(), uncertain(), {}, 1e-12),
        (ref.cart(), uncertain(states=2), {"start": "quasi-static"}, 1e-12),
        (ref.cart(), pushed(uncertain(states=4)), {}, 1e-12),
        (ref.cart(), replace(uncertain(), acceleration=np.zeros((COUNT, 3))), {}, 1e-12),
        (with_payload(ref.cart()), uncertain(), {}, 1e-12),
        (ref.cart_clear(), uncertain(), {}, 1e-12),
        (with_payload(ref.cart_clear()), pushed(uncertain()), {"start": "quasi-static"}, 1e-12),
        (ref.preloaded(), uncertain(), {"method": "rk45"}, 1e-9),
    ],
    ids=["linear", "under way", "pushed", "still", "payload", "clearance", "clearance, payload", "preloaded"],
)
def test_every_sample_is_the_run_of_its_machine_and_motion(
    machine: Machine, motion: Motion, options: dict[str, Any], tolerance: float
) -> None:
    study = study_of(machine, motion, **options)
    assert study.plan().metadata.parameters[-1].name == DRAWN_MOTION
    assert_samples_are_runs(study, (0, 4, 10), tolerance)
    assert not np.array_equal(study.sample_motion(0).acceleration, study.sample_motion(1).acceleration)


@pytest.mark.parametrize("options", [{}, {"posterior": False}])
@pytest.mark.parametrize("sample", [-1, 16, 999])
def test_the_motion_of_a_sample_that_does_not_exist_is_refused(options: dict[str, Any], sample: int) -> None:
    study = study_of(ref.cart(), uncertain(), samples=16, replicates=1, **options)
    with pytest.raises(ArgumentError, match=f"sample: expected 0 to 15, got {sample}"):
        study.sample_motion(sample)


def test_loads_scatter_as_the_covariance_says_and_peaks_as_those_of_the_bands() -> None:
    machine, motion, count = ref.cart(), uncertain(1.0), 4096
    plan = study_of(machine, motion, vary=FIXED, samples=count).plan()
    values = plan.values(0, count)
    histories, _ = plan.batch_at_stamps().histories(values)
    loads = np.ascontiguousarray(
        simulate(machine, replace(motion, uncertainty=None), times=motion.time).carriage_loads
    )
    posterior = motion.uncertainty
    assert posterior is not None
    given = posterior.model, posterior.derivative, posterior.unit, motion.time
    groups = machine.links_of_carriages, machine.carriage_places
    _, exact, *_ = _core.load_spread(machine.scene, *given, motion.time, loads, *groups)
    scale = exact.max(axis=(0, 1))
    # 5 standard errors of a standard deviation and of a mean of so many normal numbers.
    assert np.all(np.abs(histories.std(axis=0) - exact) <= 5.0 * exact / np.sqrt(2.0 * count) + 1e-9 * scale)
    assert np.all(np.abs(histories.mean(axis=0) - loads) <= 5.0 * exact / np.sqrt(count) + 1e-9 * scale)
    rows, _ = plan.batch_at_stamps().run(values, 1)
    everywhere = np.ones(loads.shape[:2], bool)
    peaks = _core.draw_peaks(machine.scene, *given, motion.time, loads, everywhere, *groups, count, 1, 1)
    for i, name in enumerate(plan.metadata.carriages):
        column = plan.metadata.measures.index(("resultant", i, "max"))
        assert ks_2samp(rows[:, column], peaks[i]).pvalue > 1e-3, name


def test_bits_do_not_depend_on_threads_chunks_width_processes_and_resumption(tmp_path: Path) -> None:
    study = study_of(ref.cart(), uncertain(), samples=203)
    plan = study.plan()
    values = plan.values(0, 203)
    rows, _ = plan.batch().run(values, 1)
    for threads, width in ((2, "widest"), (1, "four"), (1, "one")):
        assert np.array_equal(plan.batch().run(values, threads, width)[0], rows)
    for start, stop in ((0, 3), (3, 101), (102, 103)):
        assert np.array_equal(run_chunk(pickle.dumps(plan), 1, start, stop).rows, rows[start:stop])
    run_study(study_of(ref.cart(), uncertain(), samples=90), tmp_path, chunk=50)
    result = run_study(study, tmp_path, resume=True, chunk=64)
    columns = [result.column(name) for name in plan.metadata.columns]
    assert np.array_equal(np.column_stack(columns), rows)
    other = uncertain(0.31)
    with pytest.raises(ArgumentError, match="holds another study"):
        run_study(study_of(ref.cart(), other, samples=203), tmp_path, resume=True)


def test_scenes_of_other_kinds_between_linear_ones_do_not_disturb_them() -> None:
    vary = (
        {
            "path": "carriages.*.clearance_y",
            "name": "play",
            "distribution": "uniform",
            "low": "1 um",
            "high": "9 um",
        },
    )
    plan = study_of(ref.cart_clear(), uncertain(), vary=vary, samples=24).plan()
    values = plan.values(0, 24)
    values[[0, 3, 4, 9, 17, 23], 0] = 0.0
    rows, failures = plan.batch().run(values, 1)
    assert not failures
    for i, row in enumerate(rows):
        assert np.array_equal(plan.batch().run(values[i : i + 1], 1)[0][0], row)


def test_the_motion_is_one_of_the_causes() -> None:
    study = study_of(ref.cart(), uncertain(), samples=64, sensitivity=True)
    plan = study.plan()
    drawn = plan.values(0, 8)[:, -1]
    # A, B, A with the mass of B, A with the motion of B.
    assert drawn.tolist() == [0.0, 1.0, 0.0, 1.0, 2.0, 3.0, 2.0, 3.0]
    result = run_study(study)
    assert list(result.sensitivity().index) == ["body.mass", DRAWN_MOTION]
    assert DRAWN_MOTION in study_report(result).text()
    fixed = run_study(study_of(ref.cart(), uncertain(), vary=FIXED, samples=64, sensitivity=True))
    indices = fixed.sensitivity()
    assert indices["total_low"][DRAWN_MOTION] > 0.5 > indices["total_high"]["body.mass"]
    ranks = run_study(study_of(ref.cart(), uncertain(), samples=64)).rank_correlation()
    assert list(ranks.index) == ["body.mass"]


def test_a_file_asks_for_it_and_a_motion_without_uncertainty_refuses_it(tmp_path: Path) -> None:
    example = files("guideload") / "examples"
    for name in ("manipulator.toml", "manipulator.csv", "moves.toml"):
        (tmp_path / name).write_bytes((example / name).read_bytes())
    text = (
        'machine = "manipulator.toml"\ntrace = "{}"\nsamples = 4\nseed = 1\nmotion.posterior = true\n'
        '[[vary]]\npath = "body.mass"\ndistribution = "uniform"\nplus_minus = "10 %"\n'
    )
    file = tmp_path / "study.toml"
    file.write_text(text.format("manipulator.csv"))
    result = run_study(file)
    assert result.metadata.draws_motion and "posterior of the trace" in study_report(result).text()
    with pytest.raises(ArgumentError, match=r"motion\.posterior"):
        exceedance_probability(file, "peak_resultant_N", 9e3)
    file.write_text(text.format("moves.toml"))
    with pytest.raises(ConfigError) as refused:
        Study.from_toml(file)
    assert "row 5: motion.posterior: expected false for a motion without uncertainty" in one_line(
        str(refused.value)
    )
    plain = replace(uncertain(), uncertainty=None)
    with pytest.raises(ConfigError, match="without uncertainty"):
        study_of(ref.cart(), plain)
    cases = {"body.mass": [400.0, 500.0]}
    with pytest.raises(ConfigError, match="false beside cases"):
        Study(machine=ref.cart(), motion=uncertain(), cases=cases, posterior=True)
