"""Distributions: quantiles invert distribution functions, moments are the textbook's, descriptions are understood."""

import math
from typing import Any

import numpy as np
import pytest

from guideload.base.config import ConfigModel
from guideload.base.errors import ConfigError, KeyRefused
from guideload.study.distributions import (
    HIGHEST,
    LOWEST,
    Distribution,
    Lognormal,
    Marginal,
    Normal,
    Sample,
    Triangular,
    Truncated,
    Uniform,
    in_words,
)
from guideload.study.varied_parameters import DistributionSpec, VariedParameter

GRID = (np.arange(200_000) + 0.5) / 200_000  # its sums are integrals over u, to about 1e-5
SMOOTH: list[Distribution] = [
    Normal(3.0, 0.5),
    Lognormal(2.0, 0.3),
    Uniform(-1.0, 4.0),
    Triangular(-1.0, 0.0, 3.0),
    Triangular(0.0, 0.0, 1.0),
    Triangular(0.0, 1.0, 1.0),
    Truncated(Normal(3.0, 0.5), 2.9, math.inf),
    Truncated(Normal(3.0, 0.5), -math.inf, 2.0),
    Truncated(Lognormal(2.0, 0.3), 1.5, 2.5),
    Truncated(Uniform(-1.0, 4.0), 0.0, 9.0),
    Truncated(Triangular(-1.0, 0.0, 3.0), 0.5, 2.0),
]


@pytest.mark.parametrize("of", SMOOTH, ids=repr)
def test_quantiles_invert_the_distribution_function_and_rise(of: Distribution) -> None:
    values = of.ppf(GRID)
    assert np.all(np.diff(values) > 0.0)
    smooth, low, high = (of.base, of.low, of.high) if isinstance(of, Truncated) else (of, -math.inf, math.inf)
    ends = smooth.cdf(low), smooth.cdf(high)
    back = np.array([(smooth.cdf(float(value)) - ends[0]) / (ends[1] - ends[0]) for value in values[::997]])
    assert np.abs(back - GRID[::997]).max() < 1e-12


@pytest.mark.parametrize("of", SMOOTH, ids=repr)
def test_no_uniform_number_leads_to_infinity_or_beyond_the_reach(of: Distribution) -> None:
    low, high = of.ppf(np.array([LOWEST, HIGHEST])).tolist()
    assert math.isfinite(low) and math.isfinite(high)
    assert of.reach[0] <= low < high <= of.reach[1]


def test_moments_are_those_of_the_textbook() -> None:
    def moments(of: Distribution) -> tuple[float, float]:
        values = of.ppf(GRID)
        return float(values.mean()), float(values.std())

    rest = 2e-4  # of the deviation: what the grid leaves out in the tails
    assert moments(Normal(3.0, 0.5)) == pytest.approx((3.0, 0.5), abs=rest)
    mean, variance = math.exp(0.045), math.expm1(0.09)
    assert moments(Lognormal(2.0, 0.3)) == pytest.approx((2 * mean, 2 * mean * math.sqrt(variance)), abs=rest)
    assert moments(Uniform(-1.0, 4.0)) == pytest.approx((1.5, 5 / math.sqrt(12)), abs=rest)
    a, b, c = -1.0, 3.0, 0.0
    spread = math.sqrt((a * a + b * b + c * c - a * b - a * c - b * c) / 18)
    assert moments(Triangular(a, c, b)) == pytest.approx(((a + b + c) / 3, spread), abs=rest)
    # Half a normal distribution: mean sigma sqrt(2/pi), variance sigma^2 (1 - 2/pi).
    half = Truncated(Normal(0.0, 1.0), 0.0, math.inf)
    assert moments(half) == pytest.approx((math.sqrt(2 / math.pi), math.sqrt(1 - 2 / math.pi)), abs=rest)


def test_lognormal_is_the_exponential_of_a_normal() -> None:
    exact = 2.0 * np.exp(Normal(0.0, 0.3).ppf(GRID))
    assert np.abs(Lognormal(2.0, 0.3).ppf(GRID) / exact - 1.0).max() < 1e-15


def test_measured_values_are_drawn_with_equal_probability() -> None:
    of = Sample(np.array([1.0, 1.0, 2.0, 5.0]))
    values, counts = np.unique(of.ppf(GRID), return_counts=True)
    assert values.tolist() == [1.0, 2.0, 5.0]
    assert (counts / GRID.size).tolist() == [0.5, 0.25, 0.25]
    assert of.ppf(np.array([LOWEST, HIGHEST])).tolist() == [1.0, 5.0] == list(of.reach)


def test_values_depend_on_their_index_alone() -> None:
    for of in SMOOTH:
        whole = of.ppf(GRID[:999])
        for start, stop in ((0, 1), (1, 8), (5, 21), (998, 999)):
            assert np.array_equal(of.ppf(GRID[start:stop]), whole[start:stop])
        assert np.array_equal(of.ppf(np.repeat(GRID[:999], 2)[::2]), whole)  # strided as well


# ---- descriptions


class Described(ConfigModel):
    vary: tuple[DistributionSpec, ...]


def described(**keys: Any) -> VariedParameter:
    return Described(vary=[{"path": "body.mass"} | keys]).vary[0]


def marginal(unit: str = "N/m", own: tuple[float, ...] = (200.0,), **keys: Any) -> Marginal:
    return described(**keys).marginal(unit, own)


def test_one_place_gets_its_value_and_several_a_factor_a_shift_or_one_value() -> None:
    ten = dict(distribution="uniform", plus_minus="10 %")
    assert marginal(**ten).form == "value"
    assert marginal(**ten).reach == pytest.approx((180.0, 220.0), rel=1e-15)
    both = marginal(own=(200.0, 300.0), **ten)
    assert (both.form, both.reach) == ("factor", (0.9, 1.1))
    shifted = marginal("m", (0.1, 0.5), distribution="normal", sigma="2 mm")
    assert (shifted.form, shifted.distribution) == ("shift", Normal(0.0, 0.002))
    same = marginal("m", (0.1, 0.5), distribution="normal", mean=0.3, sigma="2 mm")
    assert (same.form, same.distribution) == ("value", Normal(0.3, 0.002))


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        (dict(distribution="normal", sigma="3 %"), Normal(1.0, 0.03)),
        (dict(distribution="normal", mean="90 %", sigma="3 %"), Normal(0.9, 0.03)),
        (dict(distribution="normal", mean="90 %", sigma="4 N/m"), Normal(180.0, 4.0)),
        (dict(distribution="normal", sigma="4 N/m"), Normal(200.0, 4.0)),
        (dict(distribution="normal", mean=150.0, sigma="3 %"), Normal(150.0, 6.0)),
        (dict(distribution="lognormal", sigma=0.2), Lognormal(1.0, 0.2)),
        (dict(distribution="lognormal", median="0.2 N/mm", sigma=0.2), Lognormal(200.0, 0.2)),
        (dict(distribution="uniform", low="90 %", high="120 %"), Uniform(0.9, 1.2)),
        (dict(distribution="uniform", low=100, high="110 %"), Uniform(100.0, 220.00000000000003)),
        (dict(distribution="triangular", low="50 %", high="110 %"), Triangular(0.5, 1.0, 1.1)),
        (dict(distribution="triangular", low=90, high=220, mode=100), Triangular(90.0, 100.0, 220.0)),
        (dict(distribution="triangular", plus_minus="5 %"), Triangular(0.95, 1.0, 1.05)),
        (
            dict(distribution="normal", sigma="3 %", at_least="95 %"),
            Truncated(Normal(1.0, 0.03), 0.95, math.inf),
        ),
        (
            dict(distribution="lognormal", sigma=0.2, at_most=300),
            Truncated(Lognormal(200.0, 0.2), -math.inf, 300.0),
        ),
    ],
)
def test_parameters_left_out_are_the_machines(keys: dict[str, Any], expected: Distribution) -> None:
    assert marginal(**keys).distribution == expected


def test_percent_of_a_negative_value_still_rises_with_the_number() -> None:
    drawn = marginal("m", (-0.65,), distribution="uniform", low="90 %", high="120 %")
    assert drawn.reach == pytest.approx((-0.78, -0.585), rel=1e-15)
    values = drawn.values(GRID)
    assert np.all(np.diff(values) > 0.0)
    assert drawn.values(np.array([LOWEST, HIGHEST])) == pytest.approx([-0.78, -0.585], rel=1e-15)
    cut = marginal("m", (-0.65,), distribution="normal", sigma="0.2 m", at_least="90 %", at_most="110 %")
    assert cut.reach == pytest.approx((-0.715, -0.585), rel=1e-15)


NORMAL, TRIANGULAR = dict(distribution="normal"), dict(distribution="triangular", low="90 %", high="110 %")


@pytest.mark.parametrize(
    ("percent", "metres"),
    [
        (NORMAL | dict(sigma="5 %"), NORMAL | dict(sigma="32.5 mm")),
        (TRIANGULAR | dict(mode="104 %"), TRIANGULAR | dict(mode="-676 mm")),
    ],
)
@pytest.mark.parametrize("bound", [dict(at_least="94 %"), dict(at_most="108 %"), {}])
@pytest.mark.parametrize("nominal", [-0.65, 0.65])
def test_a_bound_in_percent_is_the_same_beside_widths_and_modes_of_both_kinds(
    percent: dict[str, Any], metres: dict[str, Any], bound: dict[str, Any], nominal: float
) -> None:
    """Of a negative value as the mirror image of the positive one: it still rises with the number."""
    if nominal > 0.0 and "mode" in metres:
        metres = metres | dict(mode="676 mm")
    one, other = (marginal("m", (nominal,), **keys, **bound) for keys in (percent, metres))
    np.testing.assert_allclose(one.values(GRID), other.values(GRID), rtol=1e-12)


def test_ends_of_which_one_is_in_percent_of_a_negative_value_are_refused() -> None:
    """90 % of it lies above 110 %, so that one cannot tell which end is meant."""
    for keys in (
        dict(distribution="uniform", low="110 %", high="-600 mm"),
        dict(distribution="normal", sigma="5 %", at_least="-700 mm", at_most="90 %"),
    ):
        with pytest.raises(KeyRefused, match="both in percent or both with a unit"):
            marginal("m", (-0.65,), **keys)


def test_a_bound_to_one_side_is_told_without_the_other() -> None:
    for keys, words in (
        ({"at_most": 300}, "at most 300 N"),
        ({"at_least": 150}, "at least 150 N"),
        ({"at_least": 150, "at_most": 300}, "from 150 to 300 N"),
    ):
        found = marginal(distribution="normal", sigma=50, **keys)
        told = in_words(found.distribution, found.scale, " N")
        assert told == f"normal with mean 200 N and sigma 50 N, {words}"


def test_measured_values_come_from_a_list_or_a_table_in_their_unit(tmp_path: Any) -> None:
    listed = marginal(distribution="sample", values=["3 N/mm", "1 N/mm", 2000.0])
    assert listed.distribution.ppf(np.array([0.1, 0.5, 0.9])).tolist() == [1000.0, 2000.0, 3000.0]
    file = tmp_path / "k.csv"
    file.write_text("k [N/mm],share [%],other\n3,50,1\n1,150,1\n")
    of_table = marginal(distribution="sample", file=str(file), column="k [N/mm]")
    assert of_table.reach == (1000.0, 3000.0)
    share = marginal(own=(200.0, 400.0), distribution="sample", file=str(file), column="share [%]")
    assert (share.form, share.reach) == ("factor", (0.5, 1.5))
    cut = marginal(distribution="sample", values=[1, 2, 3, 4], at_least=2, at_most="3 N/m")
    assert cut.reach == (2.0, 3.0)
    with pytest.raises(KeyRefused, match=r"name of a column.*k.csv has k \[N/mm\], share"):
        marginal(distribution="sample", file=str(file))
    with pytest.raises(KeyRefused, match="a mass in kg.*is a stiffness"):
        marginal("kg", distribution="sample", file=str(file), column="k [N/mm]")
    file.write_text("k [N/mm]\n")
    with pytest.raises(KeyRefused, match=r"at least one value in column k \[N/mm\]") as caught:
        marginal(distribution="sample", file=str(file))
    assert caught.value.key == "file"


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        (
            dict(distribution="gauss"),
            r'vary\[0\].distribution: expected one of "normal", .*"sample", got "gauss"',
        ),
        (dict(mean=1), r"vary\[0\].distribution: expected .*, got nothing; add the key"),
        (
            dict(distribution="normal"),
            r"vary\[0\].sigma: expected standard deviation, .*, got nothing; add the key",
        ),
        (
            dict(distribution="normal", sigma=1, low=1),
            r"vary\[0\].low: expected a known key, got \"low\"; keys known here: .*, mean, sigma",
        ),
        (
            dict(distribution="uniform", plus_minus=1, width=1),
            r"vary\[0\].width: expected a known key, got \"width\"",
        ),
        (dict(distribution="uniform", low=1), "expected either plus_minus, or low and high"),
        (dict(distribution="uniform", low=1, high=2, plus_minus=1), "expected either plus_minus, or low and"),
        (dict(distribution="triangular", mode=1, plus_minus=1), "expected no mode beside plus_minus"),
        (dict(distribution="sample"), "expected either values or file"),
        (dict(distribution="sample", values=[1], column="k"), "expected no column without a file"),
        (dict(distribution="sample", values=[]), "values: expected at least one entry"),
        (dict(distribution="uniform", plus_minus=[1]), "plus_minus: expected a number, or text with a unit"),
        (dict(distribution="lognormal", sigma="2 N/m"), r"vary\[0\].sigma: .*a plain number"),
        (dict(distribution="lognormal", sigma="15 %"), "that of the logarithm, a plain number: 0.15"),
    ],
)
def test_incomplete_and_unknown_keys_are_refused(keys: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        described(**keys)


@pytest.mark.parametrize(
    ("key", "keys", "words"),
    [
        ("low", dict(distribution="uniform", low="1 kg", high=2), 'a stiffness in N/m, got "1 kg"'),
        ("low", dict(distribution="uniform", low=2, high=1), "low < high"),
        ("low", dict(distribution="uniform", low="-10 %", high="+10 %"), "without a sign.*plus_minus"),
        ("plus_minus", dict(distribution="uniform", plus_minus="0 %"), "> 0"),
        ("sigma", dict(distribution="normal", sigma=-1), "> 0"),
        ("median", dict(distribution="lognormal", median=-2, sigma=0.1), "> 0"),
        (
            "mode",
            dict(distribution="triangular", low=1, high=2),
            "a mode from 1 to 2, got 200.*machine's value if none is given: give one",
        ),
        ("at_least", dict(distribution="uniform", plus_minus=1, at_least=5, at_most=4), "at_least < at_most"),
        ("at_least", dict(distribution="normal", sigma=1, at_least=300), "only 0 of the distribution"),
        ("at_most", dict(distribution="uniform", plus_minus=1, at_most=150), "only 0 of the distribution"),
        ("values", dict(distribution="sample", values=[1, 2], at_least=3), "within at_least and at_most"),
    ],
)
def test_impossible_parameters_are_refused_by_key(key: str, keys: dict[str, Any], words: str) -> None:
    with pytest.raises(KeyRefused, match=words) as caught:
        marginal(**keys)
    assert caught.value.key == key


def test_percent_of_nothing_and_mixed_amounts_for_several_places_are_refused() -> None:
    for own in ((0.0,), (0.0, 0.0)):
        with pytest.raises(KeyRefused, match="other than 0"):
            marginal("m", own, distribution="lognormal", sigma=0.1)
    for mixed in (
        dict(distribution="normal", mean="110 %", sigma="1 mm"),
        dict(distribution="normal", sigma="1 mm", at_most="0.3 m"),
        dict(distribution="sample", values=["110 %", "0.3 m"]),
    ):
        with pytest.raises(KeyRefused, match="a single value.*got 2.*each"):
            marginal("m", (0.1, 0.2), **mixed)
    ends = dict(distribution="triangular", low="1 mm", high="0.3 m")
    with pytest.raises(
        KeyRefused, match="most likely value, because the 2 values have no common one"
    ) as caught:
        marginal("m", (0.1, 0.2), **ends)
    assert caught.value.key == "mode"
    assert marginal("m", (0.1, 0.2), **ends, mode="2 mm").form == "value"
