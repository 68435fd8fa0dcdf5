"""Modal tests: exact derivatives, pairing of modes, and the machine that made the data is found again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hammer_tests import derivative_errors, hammer_test, unknown, with_corners
from reference import cart

from guideload.identification.fit import fit
from guideload.identification.modal_test import MeasuredMode
from guideload.identification.model import Model, SensorPlace
from guideload.identification.unknowns import UnknownTable

NONE = np.zeros(0)
TRUTH = np.array([0.2, -0.1, 0.3, -0.3, 0.15, -0.4])


@pytest.fixture(scope="module")
def model() -> Model:
    machine = with_corners(cart())
    tables = (
        UnknownTable(path="carriages.*.stiffness_y", each="carriage"),
        UnknownTable(path="carriages.*.stiffness_z"),
        UnknownTable(path=("carriages.*.damping_y", "carriages.*.damping_z"), name="damping"),
    )
    return Model(machine, unknown(machine, *tables))


def test_derivatives_of_frequency_damping_and_shape(model: Model) -> None:
    """Against central differences, whose error here is below 1e-7 of the largest."""
    rng = np.random.default_rng(1)
    truth = 0.3 * rng.standard_normal(6)
    errors, _ = derivative_errors(hammer_test(model, truth, rng), model, 0.8 * truth, NONE)
    assert errors.max() < 1e-7


def test_exact_data_give_the_machine_back(model: Model) -> None:
    """Without noise the residuals vanish at the truth, up to the pull of what was assumed before."""
    test = hammer_test(model, TRUTH, np.random.default_rng(0), noise=(0, 0, 0))
    found = fit(model, [test])
    assert found.minimum.x == pytest.approx(TRUTH, abs=5e-3)
    assert not found.messages and abs(found.residuals).max() < 0.1


def test_modes_in_another_order_change_nothing(model: Model) -> None:
    test = hammer_test(model, TRUTH, np.random.default_rng(3))
    turned = replace(test, modes=test.modes[::-1])
    assert fit(model, [turned]).minimum.x == pytest.approx(fit(model, [test]).minimum.x, abs=1e-6)


def test_a_mode_that_the_machine_does_not_have_is_left_out(model: Model) -> None:
    """A vibration of one corner alone resembles no motion of a rigid body."""
    test = hammer_test(model, TRUTH, np.random.default_rng(3))
    foreign = MeasuredMode(80.0, 0.02, np.eye(10)[0])
    found = fit(model, [replace(test, modes=(*test.modes[:2], foreign, *test.modes[2:]))])
    pairs = found.objective.data[0].pairs(model.at(found.minimum.x))
    assert [pair.computed for pair in pairs] == [0, 1, None, 2, 3, 4]
    assert "MAC" in pairs[2].reason
    assert found.minimum.x == pytest.approx(fit(model, [test]).minimum.x, abs=1e-6)


def test_a_place_that_no_mode_moves_leaves_numbers_finite(model: Model) -> None:
    """L along x is held: no mode moves it, so none resembles a shape that was measured there."""
    held = SensorPlace("L x", np.zeros(3), np.array([1.0, 0.0, 0.0]))
    test = hammer_test(model, np.zeros(6), np.random.default_rng(3))
    modes = tuple(replace(mode, shape=np.ones(1)) for mode in test.modes)
    seen = replace(test, places=(held,), modes=modes)
    found = seen.prepared_for(model.at(np.zeros(6)), NONE).residuals(model.at(np.zeros(6)), NONE)
    assert np.isfinite(found.values).all() and np.isfinite(found.by_unknowns).all()
