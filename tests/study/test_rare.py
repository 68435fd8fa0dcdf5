"""Small probabilities against closed forms, by subset simulation alone and on machines of known loads."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import lives
import numpy as np
import pytest
import study_standin
from machines import having
from scipy import integrate
from scipy.special import ndtr
from scipy.stats import norm
from test_study import MACHINE, MASS, study

from guideload.base.errors import ArgumentError
from guideload.catalogue.product import Product
from guideload.machine.drive import Drive
from guideload.motion.motion import Motion
from guideload.reports.study import probability_report
from guideload.study.execution import run_study
from guideload.study.rare import (
    LEAST,
    PILOTS,
    SAMPLES,
    SHARE,
    RareProbability,
    exceedance_probability,
    subset_simulation,
    wanted_limits,
)

FACTORS, POPULATIONS = 10, 24
DIAGONAL = np.full(FACTORS, FACTORS**-0.5)
REST = Motion.along_x(time=[0.0, 0.1], acceleration=[0.0, 0.0])
PEAK = "peak_resultant_N[2b]"
ONE_OF_MANY = dict(path="body.mass", distribution="sample", values=[*[1e3] * 99_999, 1e6])


def parabola(bend: float, distance: float) -> float:
    """Probability that x + bend y^2 is above the distance, of normal x and y."""
    inside = integrate.quad(
        lambda y: norm.pdf(y) * ndtr(bend * y**2 - distance), -15, 15, epsabs=0.0, limit=200
    )
    return float(inside[0])


# Margins of normal scores, and the probability that they are positive.
LAWS: dict[str, tuple[Callable[[np.ndarray], np.ndarray], float]] = {
    "plane": (lambda u: u @ DIAGONAL - 4.75, ndtr(-4.75)),
    "two design points": (lambda u: np.abs(u @ DIAGONAL) - 4.75, 2 * ndtr(-4.75)),
    "two unequal design points": (
        lambda u: np.maximum(u[:, 0] - 4.0, -u[:, 1] - 4.2),
        ndtr(-4.0) + ndtr(-4.2),
    ),
    "parabola": (lambda u: u[:, 0] + 0.1 * u[:, 1] ** 2 - 4.0, parabola(0.1, 4.0)),
    "steps": (lambda u: np.floor(4 * (u @ DIAGONAL)) / 4 - 3.9, ndtr(-4.0)),
    "most on the limit": (lambda u: np.where(u[:, 0] > 2.0, 1.0, 0.0), ndtr(-2.0)),
    "often": (lambda u: u[:, 0] - 0.5, ndtr(-0.5)),
}


@pytest.mark.parametrize("law", LAWS)
def test_a_small_probability_is_that_of_the_closed_form(law: str) -> None:
    """Within what the scatter of the populations says, and the bias of 3 % that so many samples have."""
    margin, truth = LAWS[law]
    found, _ = subset_simulation(margin, FACTORS, POPULATIONS, 1e-12, np.random.default_rng(3))
    error = found.std(ddof=1) / POPULATIONS**0.5
    assert abs(found.mean() - truth) < 3.5 * error + 0.03 * truth
    assert error < 0.1 * truth


def test_margins_that_lead_nowhere_give_no_probability() -> None:
    for margin in (
        lambda u: np.full(len(u), -1.0),
        lambda u: ndtr(u[:, 0]) - 1.1,
        lambda u: np.full(len(u), -np.inf),
    ):
        assert not subset_simulation(margin, 2, 2, 1e-9, np.random.default_rng(0))[0].any()


@pytest.mark.parametrize("share", [0.0, 0.05])
def test_samples_that_do_not_get_on_bound_a_probability_as_a_count_does(share: float) -> None:
    """A margin of one or two steps, whose higher one has this share: none of 2000 samples came higher than it."""
    margins, truth = (lambda u: np.where(u[:, 0] > norm.isf(share), -0.5, -1.0)), share or 1.0
    estimates, bounds = subset_simulation(margins, 2, POPULATIONS, LEAST, np.random.default_rng(0))
    none_of = 1.0 - 0.025 ** (1.0 / SAMPLES)
    assert not estimates.any()
    error = 4.0 * np.sqrt((1.0 - truth) / (truth * SAMPLES))  # standard deviations of the counted share
    np.testing.assert_allclose(bounds, truth * none_of, rtol=error + 1e-12)
    reached = subset_simulation(lambda u: u[:, 0] - 9.0, 2, 3, LEAST, np.random.default_rng(0))
    assert not reached[0].any() and (reached[1] == LEAST).all()


def at_rest(**keys: Any) -> Any:
    """A study of the machine at rest, where all loads are proportional to mass and gravity, both lognormal."""
    sigma = {"distribution": "lognormal", "sigma": 0.05}
    vary = [dict(path="body.mass", **sigma), dict(path="gravity.y", median="9.8 m/s2", **sigma)]
    damping = dict(name="b", path="carriages.*.damping", **sigma)
    machine = MACHINE.model_copy(update={"gravity": (0.0, 9.8, 0.0)})
    return study(
        *vary,
        damping,
        machine=machine,
        motion=REST,
        correlation=[{"between": ["body.mass", "gravity.y"], "value": 0.5}],
        **keys,
    )


@pytest.fixture(scope="module")
def found() -> tuple[RareProbability, float]:
    """The probability of a load at rest, and the closed form: a product of correlated lognormal factors."""
    values = run_study(at_rest(samples=8), threads=1).table([PEAK, "body.mass", "gravity.y"])
    ratio = values[PEAK] / (values["body.mass"] * values["gravity.y"])
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-9)
    limit = float(ratio[0] * MACHINE.body.mass * 9.8 * np.exp(4.5 * 0.05 * 3**0.5))
    return exceedance_probability(at_rest(), PEAK, limit, coefficient_of_variation=0.15, threads=1), limit


def test_the_load_of_a_machine_at_rest_is_a_closed_form(found: tuple[RareProbability, float]) -> None:
    result, _ = found
    assert not result.doubts and 0.0 < result.coefficient_of_variation <= 0.15
    assert abs(result.probability / ndtr(-4.5) - 1) < 3 * result.coefficient_of_variation + 0.03
    assert result.low < result.probability < result.high and result.populations >= 10


def test_the_result_depends_neither_on_threads_nor_on_the_number_of_samples(
    found: tuple[RareProbability, float],
) -> None:
    result, limit = found
    text = f"{limit!r} N"
    assert (
        exceedance_probability(at_rest(samples=77), PEAK, text, coefficient_of_variation=0.15, threads=2)
        == result
    )


def test_what_cannot_be_estimated_is_said() -> None:
    bounded = exceedance_probability(study(MASS, motion=REST), "peak_resultant_N", "1 MN", most_runs=200_000)
    assert (bounded.probability, bounded.low, bounded.high) == (0.0, 0.0, 1e-9)
    assert "No population came to the limit" in bounded.doubts[0]
    levels = -np.log10(LEAST)  # each the best tenth of the one before, whose runs are not repeated
    assert bounded.populations == PILOTS and bounded.runs <= PILOTS * SAMPLES * (1 + (1 - SHARE) * levels)
    metadata = study(MASS).plan().metadata
    assert "below 1e-9" in probability_report(bounded, metadata).text()
    same = exceedance_probability(study(ONE_OF_MANY, motion=REST), "peak_resultant_N", "1 MN")
    assert same.probability == 0.0 and 1e-5 < same.high < 4.0 / SAMPLES  # the truth is 1e-5
    assert "changes in steps" in same.doubts[0]
    assert "not found, at most 0.0018 at 95 %" in " ".join(probability_report(same, metadata).text().split())
    doubtful = Product(**{**lives.PRODUCT, "unverified": ("dynamic",)})
    rated = having(metadata, machine=having(lives.cart(), products=(doubtful,)))
    for name in ("life_km[1a]", "static_safety", PEAK):
        warned = "not checked by a person" in probability_report(replace(bounded, name=name), rated).text()
        assert warned == (name != PEAK)
        noted = having(rated, life_notes=("What was left out.",))
        assert ("left out." in probability_report(replace(bounded, name=name), noted).text()) == warned
    failing = exceedance_probability(
        study_standin.plan(), "peak_resultant_N", 0.5, coefficient_of_variation=0.5
    )
    assert failing.probability == pytest.approx(1 - 0.5**4, abs=0.05)
    assert "had no solution" in failing.doubts[0] and "no equilibrium" in failing.doubts[0]
    few = exceedance_probability(
        study_standin.plan(), "peak_resultant_N", 0.5, coefficient_of_variation=1e-3, most_runs=20_000
    )
    assert "allow more runs than 20000" in few.doubts[0]


def test_what_has_no_probability_is_refused() -> None:
    given = study(vary=(), samples=None, cases={"body.mass [t]": [1.0]})
    plan = study(MASS, limits={"peak_resultant": "7 kN"}).plan()
    of = "peak_resultant_N"
    for refused, words in (
        ((given, of, 1.0), "given cases, which have no probability"),
        ((plan, "contact_lost"), "nothing tells how near"),
        ((plan, "peak_resultant", 1.0), "nearest: peak_resultant_N"),
        ((plan, of, "8 kW"), "limit on peak_resultant_N: .*kW"),
        ((plan, of, np.nan), "limit on peak_resultant_N: expected a finite number"),
        ((plan, "peak_Fy_N"), "expected a limit on peak_Fy_N"),
        *(
            ((plan, of, limit), "limit on peak_resultant_N: expected a")
            for limit in ("8", "8 mm", "nan N", np.inf)
        ),
    ):
        with pytest.raises(ArgumentError, match=words):
            exceedance_probability(*refused)
    rack = Drive(pinion_diameter=0.06, pressure_angle=0.35, push_direction=(0.0, 1.0, 0.0))
    with pytest.raises(ArgumentError, match="without pressure_angle, whose push would be the same"):
        exceedance_probability(study(MASS, machine=having(MACHINE, drive=rack)), of, 1.0)
    with pytest.raises(ArgumentError, match="from 20000 to 4294967296, got 100"):
        exceedance_probability(plan, of, most_runs=100)
    assert wanted_limits(plan, ()) == {"peak_resultant_N": 7000.0}
    assert wanted_limits(plan, ["peak_drive=9 kN", "peak_Fy[1a]=8 kN"]) == {
        "peak_drive_N": "9 kN",
        "peak_Fy_N[1a]": "8 kN",
    }
    with pytest.raises(ArgumentError, match='"peak_resultant=9 kN"'):
        wanted_limits(plan, ["peak_resultant 9 kN"])
