"""The key figures of a run: levels by margins, and the verdict that follows from them."""

import lives
import pytest
from machines import with_carriages
from moves import BRISK, GENTLE

import guideload
from guideload.base.number_text import load_in_table, seconds
from guideload.machine.machine import DOFS
from guideload.reports import KeyFigures, key_figures
from guideload.reports.key_figures import _judged
from guideload.reports.run import result_report

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


@pytest.mark.parametrize(("margin", "level"), [(1.0, "near"), (1.2, "good")])
def test_a_margin_that_is_just_reached_is_reached(margin: float, level: str) -> None:
    assert _judged({"life": margin}, "life", "the life to be reached")[0] == level


@pytest.mark.parametrize("velocity", [True, False])
@pytest.mark.parametrize("products", [4, 1, 0])
def test_nothing_holds_of_which_a_part_is_not_judged(products: int, velocity: bool) -> None:
    """Without velocity there is no life; without product, no capacity. The drive force alone is not enough."""
    machine = lives.cart(life={"rule": "sum"}, drive={"linear_motor": True, "max_force": "1 MN"})
    for one in machine.carriages[products:]:
        machine = with_carriages(machine, one.name, product=None)
    motion = MOTION if velocity else guideload.Motion(MOTION.time, MOTION.acceleration)
    result = guideload.simulate(machine, motion)
    level, words = key_figures(result).verdict
    holds = products == 4 and velocity
    assert level == ("good" if holds else "near") and words.startswith("Holds" if holds else "Not all is")


def test_the_force_of_an_elastic_drive_is_judged() -> None:
    screw = {"name": "screw", "point": (0, 0, 0), "direction": (1, 0, 0), "stiffness": 2e7, "damping": 4e3}
    elastic = {"links": [screw], "free": DOFS}
    machine = lives.cart(life={"rule": "sum"}, drive={"linear_motor": True, "max_force": "10 N"}, **elastic)
    result = guideload.simulate(machine, MOTION)
    level, words = key_figures(result).verdict
    assert level == "bad" and "Drive force" in words
    assert "NOT REACHED by the drive: drive force." in result_report(result).answer


def test_the_worst_figure_gives_the_verdict() -> None:
    found = required(life="1 km", safety=1e3)
    level, words = found.verdict
    assert level == "bad" and words.startswith("Does not hold. Static safety: ")
    safe = required(safety=0.01)
    level, words = safe.verdict
    assert level == "good" and words.endswith(", static safety. No life to be reached is given")


def test_carriages_without_product_are_not_judged() -> None:
    machine = lives.cart(life={"rule": "sum", "life": "1 km", "safety": 0.01})
    first = machine.carriages[0].name
    found = key_figures(guideload.simulate(with_carriages(machine, first, product=None), MOTION))
    assert found.verdict == (
        "near",
        f"Not all is judged: no product with ratings is named at carriage {first}",
    )


@pytest.mark.parametrize("offset", [0.0, 0.01])
def test_the_largest_load_is_that_of_the_report(offset: float) -> None:
    """On the same carriage at the same time, also where peaks between coarse samples are nearly equal."""
    body = lives.cart().body.model_copy(update={"center_of_mass": (0.0, 0.3, offset)})
    machine = lives.cart().model_copy(update={"body": body})
    result = guideload.simulate(machine, lives.moved(BRISK, 90.0))
    card, largest, peaks = key_figures(result).figures[0], result.largest_load(), result.peaks()
    row = peaks.loc[largest.name]
    assert largest.size == row["peak_resultant_N"] and largest.time == row["time_of_peak_s"]
    assert largest.size == pytest.approx(peaks["peak_resultant_N"].max(), rel=1e-9)
    where = f"on carriage {largest.name} at {seconds(largest.time)} s"
    assert (card.value, card.place) == (f"{load_in_table(largest.size)} N", where)
    assert f"the largest load is {card.value}, {where}." in result_report(result).answer[0]


def test_without_requirements_nothing_is_judged() -> None:
    machine = guideload.Machine.from_text(guideload.file_template("two-rails"))
    found = key_figures(guideload.simulate(machine, MOTION))
    assert isinstance(found.life, str) and {one.level for one in found.figures} == {"open"}
    assert found.verdict[0] == "open"
