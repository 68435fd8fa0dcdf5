"""Small probabilities against closed forms: `python tests/benchmarks/rare_events.py [--estimates 100]`

Each estimate is one of `exceedance_probability`, with its own seed, until its coefficient of variation is 10 %. The
table gives the mean over the truth, the scatter of the estimates (which should be what they tell), how many of the
95 % intervals hold the truth, and the runs of one.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace
from unittest.mock import patch

import numpy as np
from scipy import integrate
from scipy.special import ndtr
from scipy.stats import chi2, norm

from guideload import Machine, Motion, Study
from guideload.cli.inputs import EXAMPLES
from guideload.study import rare as module
from guideload.study.rare import LimitState

FACTORS = 13
DIAGONAL = np.full(FACTORS, FACTORS**-0.5)
Margin = Callable[[np.ndarray], np.ndarray]


def cases() -> dict[str, tuple[Margin, float]]:
    """Margins of normal scores, and the probability that they are positive."""
    parabola, _ = integrate.quad(
        lambda y: norm.pdf(y) * ndtr(0.1 * y**2 - 4.5), -15, 15, epsabs=0.0, limit=200
    )
    radius = float(chi2(FACTORS).isf(1e-6))
    planes = {
        f"plane, beta = {beta}": (lambda u, b=beta: u @ DIAGONAL - b, ndtr(-beta))
        for beta in (2.0, 3.0, 4.0, 4.75)
    }
    return planes | {
        "parabola": (lambda u: u[:, 0] + 0.1 * u[:, 1] ** 2 - 4.5, parabola),
        "two design points": (lambda u: np.abs(u @ DIAGONAL) - 4.75, 2 * ndtr(-4.75)),
        "two unequal ones": (lambda u: np.maximum(u[:, 0] - 4.5, -u[:, 1] - 4.7), ndtr(-4.5) + ndtr(-4.7)),
        "outside a sphere": (lambda u: (u**2).sum(axis=1) - radius, 1e-6),
    }


def plan() -> object:
    """A plan with as many factors; its machine does not run."""
    motion = Motion.along_x(time=[0.0, 1.0], acceleration=[0.0, 0.0])
    machine = Machine.from_toml(EXAMPLES / "manipulator.toml")
    vary = [{"path": "body.mass", "distribution": "normal", "sigma": "1 %"}]
    one = Study(machine=machine, motion=motion, samples=1, seed=0, vary=vary).plan()
    return replace(one, factors=one.factors * FACTORS)


def line(name: str, truth: float, found: list[module.RareProbability]) -> None:
    values = np.array([one.probability for one in found]) / truth
    held = np.mean([one.low <= truth <= one.high for one in found])
    told = np.mean([one.coefficient_of_variation for one in found])
    runs = np.mean([one.runs for one in found])
    print(
        f"| {name} | {truth:.2e} | {values.mean():.2f} | {100 * values.std(ddof=1):.1f} % | {100 * told:.1f} % "
        f"| {100 * held:.0f} % | {1e-3 * runs:.0f} 000 |",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description="Small probabilities against closed forms.")
    parser.add_argument("--estimates", type=int, default=100)
    options = parser.parse_args()
    print("| limit state | truth | mean over truth | scatter | told | intervals that hold it | runs |")
    print("|---|---:|---:|---:|---:|---:|---:|")
    base = plan()
    for name, (margin, truth) in cases().items():

        def of_scores(self: LimitState, scores: np.ndarray, margin: Margin = margin) -> np.ndarray:
            self.runs += len(scores)
            return margin(scores)

        found = []
        with patch.object(LimitState, "__call__", of_scores):
            for seed in range(options.estimates):
                metadata = base.metadata.model_copy(update={"seed": seed})
                found.append(
                    module.exceedance_probability(replace(base, metadata=metadata), "peak_resultant_N", 1.0)
                )
        line(name, truth, found)


if __name__ == "__main__":
    main()
