"""Numbers as people read them."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit.quantity_text import (
    between,
    percent,
    quantity,
    scale_for,
    significant,
    unbroken,
    with_std,
)


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.00163, "m", "1.63 mm"),
        (30e-6, "m", "30.0 µm"),
        (2.5466, "m", "2.55 m"),
        (-0.00349, "m", "−3.49 mm"),
        (0.742, "N", "0.742 N"),
        (249_900.0, "N", "250 kN"),
        (1_642_542.0, "N", "1.64 MN"),
        (0.0030, "N m", "3.00 mN m"),
        (2.8e-5, "N m", "28.0 µN m"),
        (203.5, "N m s", "204 N m s"),
        (4.5476e-5, "N m s", "45.5 µN m s"),
        (1e-6, "rad/s", "1.00 µrad/s"),
        (0.05, "rad/s", "50.0 mrad/s"),
        (3e-6, "N m/s", "3.00 µN m/s"),
        (-0.052, "N m/rad", "−52.0 mN m/rad"),
        (0.004, "N s/m", "4.00 mN s/m"),
        (2e-5, "m/s", "20.0 µm/s"),
        (200_000.0, "N/m", "200 N/mm"),
        (1e-4, "kg m^2", "1.00 kg cm²"),
        (0.14, "kg/m", "0.140 kg/m"),
        (1.1e-5, "1/K", "11.0·10⁻⁶/K"),
        (0.0196, "%", "1.96 %"),
        (0.02, "1", "0.0200"),
        (math.pi, "rad", "180°"),
        (0.0002, "rad", "0.200 mrad"),
        (0.0, "N", "0 N"),
        (float("inf"), "N", "∞ MN"),
        (float("nan"), "N", "unknown"),
        (3.0, "furlong", "3.00 furlong"),
    ],
)
def test_a_quantity_gets_the_prefix_of_its_size(value: float, unit: str, text: str) -> None:
    if math.isinf(value):
        assert quantity(value, unit).startswith("∞")
    else:
        assert quantity(value, unit) == text


@pytest.mark.parametrize(
    ("value", "std", "unit", "text"),
    [
        (249_900.0, 7_000.0, "N", "249.9 ± 7.0 kN"),
        (247_387.0, 6_079.0, "N", "247.4 ± 6.1 kN"),
        (0.014988, 0.000098, "1", "0.014988 ± 0.000098"),
        (0.019623, 0.000306, "%", "1.962 ± 0.031 %"),
        (1_640_000.0, 233_000.0, "N", "1.64 ± 0.23 MN"),
        (-0.0005, 0.00012, "m", "−0.50 ± 0.12 mm"),
        (0.0, 0.003, "m", "0.0 ± 3.0 mm"),
        (1.0, 0.0999, "m", "1.00 ± 0.10 m"),
        (1.1e-5, 2e-6, "1/K", "(11.0 ± 2.0)·10⁻⁶/K"),
        (12_345.0, 4_321.0, "furlong", "12300 ± 4300 furlong"),
        (5.0, float("nan"), "N", "5.00 N"),
        (5.0, 0.0, "N", "5.00 N"),
    ],
)
def test_the_standard_deviation_sets_the_digits(
    value: float, std: float, unit: str, text: str
) -> None:
    assert with_std(value, std, unit) == text


@given(st.floats(1e-6, 1e8), st.integers(2, 5), st.booleans())
def test_significant_digits_read_back_as_the_number(
    size: float, digits: int, negative: bool
) -> None:
    value = -size if negative else size
    text = significant(value, digits).replace("−", "-")
    assert float(text) == pytest.approx(value, rel=0.5000001 * 10 ** (1 - digits))
    assert "e" not in text


@given(st.floats(1e-9, 1e9), st.sampled_from(["m", "N", "N m", "N/m", "s", "kg", "rad", "kg m^2"]))
def test_a_scale_changes_the_unit_and_not_the_value(size: float, unit: str) -> None:
    scale = scale_for(size, unit)
    shown = float(scale.text(size, 6).removesuffix(scale.label).strip().replace("−", "-"))
    assert shown * scale.worth == pytest.approx(size, rel=1e-5)


def test_one_scale_serves_several_sizes_by_the_largest_that_is_finite() -> None:
    scale = scale_for([float("nan"), 0.0003, float("inf"), 0.0016], "m")
    assert [scale.text(0.0003), scale.text(0.0016)] == ["0.300 mm", "1.60 mm"]


def test_numbers_beyond_reach_are_written_in_powers_of_ten() -> None:
    assert significant(3.2e-9, 2) == "3.2e−09"
    assert significant(float("-inf")) == "−∞"
    assert significant(9.999, 2) == "10"


@pytest.mark.parametrize(
    ("share", "text"),
    [(0.934, "93 %"), (0.02, "2.0 %"), (0.0, "0.0 %"), (1e-5, "under 0.1 %"), (1.0, "100 %")],
)
def test_shares_read_in_per_cent(share: float, text: str) -> None:
    assert percent(share) == text


def test_an_unknown_share_says_so() -> None:
    assert percent(float("nan")) == "unknown"


def test_figures_keep_together_with_their_units() -> None:
    kept = unbroken("falls to 3.0 ± 0.1 mN m s in it")
    assert kept.split(" ") == [
        "falls",
        "to",
        "3.0\u00a0±\u00a00.1\u00a0mN\u00a0m\u00a0s",
        "in",
        "it",
    ]


def test_an_interval_without_one_of_its_ends() -> None:
    """As of a stiffness, which may be infinite."""
    assert between(236e3, 259e3, "N") == "236 to 259 kN"
    assert between(751.7e3, math.inf, "N") == "above 752 kN"
    assert between(-math.inf, 0.02, "m") == "below 20.0 mm"
    assert between(-math.inf, math.inf, "N") == "any value"


def test_an_interval_has_the_unit_of_its_value() -> None:
    of_value = scale_for((0.0999, 0.0006), "N m")
    assert between(0.0987, 0.1011, "N m") == "0.0987 to 0.1011 N m"
    assert between(0.0987, 0.1011, "N m", of_value) == "98.7 to 101.1 mN m"
    assert between(0.0987, math.inf, "N m", of_value) == "above 98.7 mN m"
