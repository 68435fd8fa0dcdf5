"""The picture of the damage along the rails."""

import numpy as np
import pytest
from lives import cart, moved
from moves import GENTLE

from guideload import plots
from guideload.life.life import life_of
from guideload.motion.motion import Motion
from guideload.simulation.simulation import simulate


def test_the_area_under_the_damage_is_the_damage() -> None:
    life = life_of(simulate(cart(), moved(GENTLE, 200.0)))
    lines = plots.rail_damage(life).lines
    for line, place in zip(lines, life.places, strict=True):
        x, y = (np.asarray(values, dtype=float) for values in line.get_data())
        assert np.sum(y[:-1] * np.diff(x)) == pytest.approx(
            1e6 / life.distance * place.damage.sum(), rel=1e-9
        )


def test_without_position_the_picture_says_so() -> None:
    motion = moved(GENTLE, 200.0)
    unplaced = Motion.along_x(motion.time, motion.acceleration[:, 0], velocity=motion.velocity[:, 0])  # type: ignore[index]
    ax = plots.rail_damage(life_of(simulate(cart(), unplaced)))
    assert "unknown" in ax.texts[0].get_text()
