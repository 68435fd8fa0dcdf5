"""A life to be reached in travel, hours, years or cycles: one reader, and conversions that agree."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from guideload import LifeConditions
from guideload.base.errors import ConfigError
from guideload.base.number_text import rounded
from guideload.catalogue.life_target import CONTINUOUS, LifeTarget, Repetition, life_target

SIZES = st.floats(1e-2, 1e6)


@given(SIZES, SIZES, st.floats(1.0, 8784.0) | st.none(), st.floats(1e-3, 1e4))
def test_conversions_are_inverse(
    distance: float, duration: float, yearly: float | None, value: float
) -> None:
    one = Repetition(distance, duration, yearly)
    travels = {unit: one.travel(life_target(f"{value!r} {unit}")) for unit in ("km", "h", "years", "cycles")}
    assert travels["km"] == pytest.approx(1e3 * value, rel=1e-15)
    assert one.hours(travels["h"]) == pytest.approx(value, rel=1e-14)
    assert one.years(travels["years"]) == pytest.approx(value, rel=1e-14)
    assert one.hours(travels["years"]) == pytest.approx(value * (yearly or CONTINUOUS), rel=1e-14)
    assert travels["cycles"] == pytest.approx(value * distance, rel=1e-15)


@pytest.mark.parametrize(
    "text", ["20000 km", "2e7 m", "10000 h", "90 min", "1 year", "7.5 years", "5e6 cycles"]
)
def test_a_target_is_read_back_from_its_text(text: str) -> None:
    conditions = LifeConditions(life=text)
    assert LifeConditions.model_validate_json(conditions.model_dump_json()) == conditions
    assert life_target(str(conditions.life)) == conditions.life == life_target(conditions.life)


@pytest.mark.parametrize("value", [2000, 2e3, "2000"])
def test_a_number_alone_is_refused_with_each_unit_that_it_may_have(value: object) -> None:
    with pytest.raises(ConfigError) as refused:
        LifeConditions(life=value)
    for unit in ("km", "h", "years", "cycles"):
        number = f"{value} {unit}"
        assert f'"{number}"' in str(refused.value)
        assert life_target(number).value > 0.0


def test_words_are_short() -> None:
    assert LifeConditions(life="20000 km").life == LifeTarget(2e7, "m") == life_target("20000 km")
    words = [life_target(text).text for text in ("20000 km", "10000 h", "1 year", "5e6 cycles")]
    assert [word.replace("\N{NARROW NO-BREAK SPACE}", " ") for word in words] == [
        "20 000 km", "10 000 h", "1 year", "5 000 000 cycles",
    ]  # fmt: skip


@pytest.mark.parametrize(
    "value", ["10000 kg", "20000", "long", "1,5 years", True, "0 h", "-1 years", "1e9 years", "nan km"]
)
def test_what_is_no_life_is_refused_with_the_units(value: object) -> None:
    with pytest.raises(ConfigError, match=r"life: expected (a life in km, h, years|a life in years|> 0)"):
        LifeConditions(life=value)


def test_a_life_has_three_digits_and_readable_thousands() -> None:
    shown = [
        rounded(value).replace("\N{NARROW NO-BREAK SPACE}", " ")
        for value in (2335436.0, 12345.0, 4567.0, 99.96, 1.2345)
    ]
    assert shown == ["2 340 000", "12 300", "4570", "100", "1.23"]
