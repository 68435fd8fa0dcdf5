"""Held against measurement: what one part of a record identifies predicts another. The page is docs/measured.md."""

from __future__ import annotations

from pathlib import Path

import measured_cases as cases
import pytest


def test_half_a_record_predicts_the_force_of_the_other(shared_data: Path) -> None:
    """95 % of 4900 values; those of one move are alike, so the share is as uncertain as that of 50 independent ones."""
    _, result = cases.emps_halves(shared_data)
    assert result.inside == pytest.approx(0.95, abs=0.03)
    assert result.relative < 0.05  # the authors' own fit of all of it: 4.1 %


def test_acceleration_from_positions_alone_is_force_over_mass(shared_data: Path) -> None:
    """The band of the encoder is narrower than the scatter of the force, 2.18 N as printed; with it 95 % are inside."""
    band, both = cases.emps_acceleration(shared_data)
    assert both.inside == pytest.approx(0.95, abs=0.03)
    assert band.half.mean() < 0.2 * both.half.mean()


@pytest.mark.parametrize("axis", ["X", "Y"])
def test_friction_of_a_mill_predicts_its_current_also_with_a_worn_tool(shared_data: Path, axis: str) -> None:
    """Cutting forces differ between the logs and are in no model: fewer than 95 % may be inside, but not much fewer."""
    for result in cases.mill(shared_data, axis):
        assert 0.88 < result.inside < 0.98
        assert result.relative < 0.65  # nothing predicted would give 1


def test_a_log_whose_rows_are_not_in_order_is_refused(shared_data: Path) -> None:
    assert "contradict" in cases.refusal(shared_data / "michigan_cnc_experiment_18.csv")
    assert not cases.refusal(shared_data / "michigan_cnc_experiment_01.csv")
