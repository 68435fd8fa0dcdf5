"""The verification of a study: wrong and unpredictable samples are counted and told, right ones are not doubted."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import reference as ref
from samples import sample_machine
from study_standin import stops_at

from guideload import (
    DoubtfulResult,
    Machine,
    Motion,
    Study,
    StudyInterrupted,
    StudyResult,
    run_study,
    simulate,
)
from guideload._core import Batch
from guideload.reports.study import study_report
from guideload.study.metadata import FILE, StudyVerification
from guideload.study.plan import Plan
from guideload.study.verification import samples_solved_again

PULL = np.random.default_rng(1).normal(size=120)
PULL[0] = 0.0
MOTION = Motion.along_x(np.arange(120) * 4e-3, PULL)
SHAKEN = Motion.along_x(np.arange(1200) * 1e-3, 0.3 * np.tile(PULL, 10))
MASS = dict(path="body.mass", distribution="uniform", plus_minus="10 %")


def study(machine: Machine, samples: int = 20, motion: Motion = MOTION, **keys: Any) -> Study:
    return Study(machine=machine, motion=motion, samples=samples, seed=1, vary=(MASS,), **keys)


def verification_of(result: StudyResult) -> StudyVerification:
    assert isinstance(result.verification, StudyVerification)
    return result.verification


@pytest.fixture
def loose(monkeypatch: pytest.MonkeyPatch) -> None:
    """The core solves the samples with a tolerance that is 1e7 times that of the study."""
    batch = Plan._batch_with

    def solves(self: Plan, *given: Any, rtol: float | None = None, **keys: Any) -> Batch:
        of_study = self.metadata.rtol
        return batch(self, *given, rtol=1e7 * of_study if rtol in (None, of_study) else rtol, **keys)

    monkeypatch.setattr(Plan, "_batch_with", solves)


@pytest.mark.parametrize("machine", [ref.cart, ref.cart_stiff])
def test_linear_samples_without_step_error_need_no_second_solution(machine: Any) -> None:
    result = run_study(study(machine()))
    assert "not needed" in str(result.verification) and not result.doubts
    assert "not needed" in study_report(result).text().replace("\n", " ")


@pytest.mark.parametrize("machine", [ref.cart, ref.cart_clear, ref.preloaded])
@pytest.mark.parametrize("method", ["auto", "exponential", "rk45", "implicit"])
def test_right_samples_are_not_doubted(machine: Any, method: str) -> None:
    for rtol in (1e-3, 1e-6):
        result = run_study(study(machine(), method=method, rtol=rtol))
        assert not result.doubts
        if isinstance(found := result.verification, StudyVerification):
            assert found.solved >= 20 and found.failed == 0 and found.difference <= found.explained
            assert f"{found.solved} samples solved again" in repr(result)


@pytest.mark.parametrize("machine", [ref.cart, ref.cart_clear, ref.preloaded])
def test_wrong_samples_are_doubted_by_the_error_of_their_worst_peak(machine: Any, loose: None) -> None:
    """The error is that of a single run with the same loose tolerance, for the sample that is named."""
    of = study(machine(), method="implicit", rtol=1e-8)
    result = run_study(of)
    found = verification_of(result)
    named = sample_machine(of, found.difference_in)
    wrong, right = (
        simulate(named, MOTION, "implicit", rtol=rtol, times=MOTION.time).data["link_load"].values
        for rtol in (0.1, 1e-11)
    )
    ends = [np.stack([load.min(axis=0), load.max(axis=0)]) for load in (wrong, right)]
    error = np.abs(ends[0] - ends[1]).max() / np.abs(wrong).max()
    assert found.doubtful > 0 and found.unpredictable == 0
    assert found.difference == pytest.approx(error, rel=1e-3)
    assert f"sample {found.difference_in}" in result.doubts[0]


@pytest.mark.parametrize("method", ["auto", "rk45", "implicit"])
def test_samples_that_impacts_make_unpredictable_are_told_on_every_method(method: str) -> None:
    """The figure is what a motion larger by 1e-9 really changes."""
    of = study(ref.rattling(), 20, SHAKEN, method=method, rtol=1e-8)
    result = run_study(of)
    found = verification_of(result)
    assert found.unpredictable > 10 and found.doubtful == 0
    assert "impacts amplify small differences" in result.doubts[0]
    named, larger = sample_machine(of, found.sensitivity_in), (1.0 + found.perturbation) * SHAKEN.acceleration
    one, other = (
        simulate(named, motion, times=motion.time).data["link_load"].values
        for motion in (SHAKEN, replace(SHAKEN, acceleration=larger))
    )
    change = max(np.abs(end(one, 0) - end(other, 0)).max() for end in (np.min, np.max)) / np.abs(one).max()
    assert found.sensitivity == pytest.approx(change, rel=0.1)


def test_doubts_stand_first_and_strict_makes_them_an_error(tmp_path: Path) -> None:
    doubtful = study(ref.rattling(), 20, SHAKEN)
    with pytest.raises(DoubtfulResult, match="impacts"):
        run_study(doubtful, tmp_path, strict=True)
    result = StudyResult.load(tmp_path)  # the samples are there all the same
    assert result.finished == 20 and result.doubts and result.doubts[0] in repr(result)
    lines = study_report(result).text().splitlines()
    assert any("Doubtful: " in line for line in lines[:10])
    assert run_study(study(ref.cart_clear()), strict=True).finished == 20


def test_the_same_samples_are_judged_however_the_study_runs(tmp_path: Path) -> None:
    whole = study(ref.cart_clear(), 60)
    run_study(whole, tmp_path / "whole", threads=1)
    with pytest.raises(StudyInterrupted) as stopped:
        run_study(whole, tmp_path / "resumed", chunk=20, progress=stops_at(40))
    unfinished = stopped.value.result
    assert unfinished.verification is None and "not judged" in repr(unfinished)
    assert "not judged" in study_report(unfinished).text().replace("\n", " ")
    run_study(whole, tmp_path / "resumed", resume=True)
    with ThreadPoolExecutor(2) as executor:
        run_study(whole, tmp_path / "executor", executor=executor)
    files = {(tmp_path / name / FILE).read_bytes() for name in ("whole", "resumed", "executor")}
    assert len(files) == 1


def test_the_worst_sample_is_always_among_those_solved_again() -> None:
    """A case of twice the mass has the largest load."""
    masses = np.full(1000, ref.cart().body.mass)
    masses[501] *= 2.0
    cases = Study(machine=ref.cart(), motion=MOTION, cases=pd.DataFrame({"body.mass": masses}))
    chosen = samples_solved_again(cases.plan(), run_study(cases))
    assert 501 in chosen and chosen.size == 21 and np.unique(chosen).size == 21
