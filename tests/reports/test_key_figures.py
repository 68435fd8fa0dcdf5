"""The key figures of a run: levels by margins, and the verdict that follows from them."""

import lives
import pytest
from moves import GENTLE

import guideload
from guideload.reports import KeyFigures, key_figures

MOTION = lives.moved(GENTLE)


def required(**life: object) -> KeyFigures:
    machine = lives.cart(life={"rule": "sum", **life})
    return key_figures(guideload.simulate(machine, MOTION))


@pytest.mark.parametrize(
    ("margin", "level"), [(0.99, "bad"), (1.001, "near"), (1.19, "near"), (1.21, "good")]
)
def test_a_life_is_judged_by_its_margin(margin: float, level: str) -> None:
    reached = guideload.life_of(guideload.simulate(lives.cart(life={"rule": "sum"}), MOTION)).machine
    found = required(life=f"{reached / margin / 1e3!r} km", safety=0.01)
    assert found.margins["life"] == pytest.approx(margin)
    life = next(one for one in found.figures if one.name == "Life")
    assert life.level == level and "to be reached" in life.reason
    assert found.verdict[0] == level


def test_the_worst_figure_gives_the_verdict() -> None:
    found = required(life="1 km", safety=1e3)
    level, words = found.verdict
    assert level == "bad" and words.startswith("Does not hold. Static safety: ")
    safe = required(safety=0.01)
    level, words = safe.verdict
    assert level == "good" and words.endswith(", static safety. No life to be reached is given")


def test_carriages_without_product_are_not_judged() -> None:
    machine = lives.cart(life={"rule": "sum", "life": "1 km", "safety": 0.01})
    first, *others = machine.carriages
    bare = first.model_copy(update={"product": None})
    found = key_figures(guideload.simulate(machine.model_copy(update={"carriages": (bare, *others)}), MOTION))
    assert found.left_out == (first.name,)
    assert found.verdict == (
        "near",
        f"Not all is judged: no product with ratings is named at carriage {first.name}",
    )


def test_without_requirements_nothing_is_judged() -> None:
    machine = guideload.Machine.from_text(guideload.file_template("two-rails"))
    found = key_figures(guideload.simulate(machine, MOTION))
    assert isinstance(found.life, str) and {one.level for one in found.figures} == {"open"}
    assert found.verdict[0] == "open"
