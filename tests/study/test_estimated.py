"""Studies scatter stiffnesses that are estimated, by the interval of the estimate, unless the user says otherwise."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from lives import moved
from machines import machine
from moves import GENTLE
from samples import sample_machine

from guideload import Machine, Study, peak_loads, run_study
from guideload.base.errors import ConfigError
from guideload.catalogue.packaged import packaged_product
from guideload.machine.components import Rail
from guideload.reports.study import study_report

MOTION = moved(GENTLE, 200.0)
TITLE = "estimated stiffness of HGW25CC ZA"
ESTIMATE = packaged_product("HGW25CC").stiffness_estimate("ZA")
assert ESTIMATE is not None
MASS = {"path": "body.mass", "distribution": "normal", "sigma": "3 %"}
STIFFNESS = {"path": "carriages.*.stiffness_y", "distribution": "uniform", "plus_minus": "10 %"}


def cart(product: str = "HGW25CC", **keys: Any) -> Machine:
    """A cart on four carriages with the product; keys: of its first carriage."""
    rails = [Rail(name=name, position=(0.05, z)) for name, z in (("1", -0.35), ("2", 0.35))]
    shared = {"damping_y": 1e4, "damping_z": 1e4, "product": product, "preload_class": "ZA"}
    tables = [
        {"name": f"{rail}{end}", "rail": rail, "x": x, **shared}
        for rail in ("1", "2")
        for end, x in (("a", -0.5), ("b", 0.5))
    ]
    tables[0] |= keys
    return machine(*tables, rails=rails)


def study(built: Machine, *vary: dict[str, Any], **keys: Any) -> Study:
    return Study(machine=built, motion=MOTION, samples=64, seed=1, vary=vary, **keys)


def targets(found: Study) -> dict[str, tuple[str, ...]]:
    return {factor.name: factor.targets for factor in found.plan().factors}


def test_one_draw_scatters_all_carriages_by_the_interval_of_the_estimate() -> None:
    """90 % of the draws are within 30 %; a sample is a run with the stiffness that was drawn."""
    found = study(cart(), MASS)
    both = [f"carriages[{name}].stiffness_{axis}" for name in ("1a", "1b", "2a", "2b") for axis in "yz"]
    assert targets(found)[TITLE] == tuple(both)
    factor = found.plan().factors[1]
    assert factor.marginal is not None and factor.form == "factor"
    ends = factor.marginal.values(np.array([0.05, 0.5, 0.95]))
    assert ends == pytest.approx([1 / 1.3, 1, 1.3], rel=1e-4)
    result = run_study(found)
    peaks = peak_loads(sample_machine(found, 5), MOTION).largest[:, 6]
    drawn = result.table().filter(regex="^max_resultant_N").iloc[5].to_numpy(dtype=np.float64)
    assert drawn == pytest.approx(peaks, rel=1e-9)  # the methods agree to rounding
    assert TITLE in study_report(result).text()


def test_what_the_user_gives_or_varies_is_his() -> None:
    own = targets(study(cart(stiffness_y="80 N/um", stiffness_z="60 N/um"), MASS))[TITLE]
    assert len(own) == 6 and not any("[1a]" in path for path in own)
    varied = targets(study(cart(), STIFFNESS))
    assert varied[TITLE] == tuple(f"carriages[{name}].stiffness_z" for name in ("1a", "1b", "2a", "2b"))
    in_series = targets(study(cart(compliance_y="2 um/kN"), MASS))[TITLE]
    assert "carriages[1a].stiffness_y" not in in_series and len(in_series) == 7


def test_an_estimate_alone_makes_a_study() -> None:
    assert list(targets(study(cart()))) == [TITLE]
    with pytest.raises(ConfigError, match="vary"):  # its maker prints the stiffness
        study(cart("HGH25CA"))


def test_cases_are_run_as_they_are() -> None:
    found = Study(machine=cart(), motion=MOTION, cases={"body.mass": [1000.0, 1100.0]})
    assert list(targets(found)) == ["body.mass"]
