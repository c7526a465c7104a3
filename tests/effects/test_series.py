"""Series of harmonics, and grids and bounds of shapes that are placed in the range of the data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from effect_lines import CATALOGUE
from winchkit.effects import Term
from winchkit.effects.location import located
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.reference_motion import STANDARD_PROFILE, standard_motion
from winchkit.effects.series import fundamentals, harmonic_series, orders_of, single_orders
from winchkit.effects.transition import TRANSITION, with_free_transition
from winchkit.model.line import Line

COGGING = CATALOGUE["motor-cogging"]
SIZES = {7: (0.05, 0.3), 28: (0.03, -1.0), 12: (0.015, 2.0)}


def terms() -> list[Term]:
    return [
        Term(COGGING, {"amplitude": size, "phase": phase, "order": float(order)})
        for order, (size, phase) in SIZES.items()
    ]


def test_a_series_is_the_sum_of_its_orders() -> None:
    series, motion = harmonic_series(terms()), standard_motion()
    bare = Line(STANDARD_PROFILE).predict(motion)["motor_torque"]
    predicted = Line(STANDARD_PROFILE, (series.modifier(),)).predict(motion)["motor_torque"]
    angle = motion.at.motor_angle
    expected = sum(size * np.sin(k * angle + phase) for k, (size, phase) in SIZES.items())
    assert predicted - bare == pytest.approx(expected, abs=1e-12)
    assert series.effect.id == "motor-cogging"
    assert orders_of(series) == (7, 28, 12)
    assert series.label == "motor-cogging[7, 28, 12]"


def test_a_series_in_single_orders_is_what_it_was_made_of() -> None:
    series = harmonic_series(terms())
    std = {"amplitude": 1e-3, "amplitude_3": 3e-3, "phase_2": 0.2}
    singles = list(single_orders(series, std))
    assert [dict(term.values) for term, _ in singles] == [dict(t.values) for t in terms()]
    assert [own for _, own in singles] == [{"amplitude": 1e-3}, {"phase": 0.2}, {"amplitude": 3e-3}]
    longer = harmonic_series([series, Term(COGGING, {**COGGING.null, "order": 84.0})])
    assert orders_of(longer) == (7, 28, 12, 84)


def test_coordinates_of_a_series_are_two_per_order() -> None:
    series = harmonic_series(terms())
    coordinates = Coordinates(series.effect)
    assert (len(coordinates), coordinates.n_parameters) == (6, 9)
    back = coordinates.values(coordinates.vector(series.values), series.values)
    assert back == pytest.approx(dict(series.values))


@pytest.mark.parametrize(
    ("orders", "expected"),
    [
        ((7, 28, 14, 36, 12, 84), (7, 12)),
        ((4, 8, 24), (4,)),
        ((1, 2, 3), ()),
        ((5, 7, 11), ()),
        ((6, 12), ()),
    ],
)
def test_poles_and_slots_are_common_divisors(
    orders: tuple[int, ...], expected: tuple[int, ...]
) -> None:
    assert fundamentals(orders) == expected


@given(st.lists(st.integers(1, 200), min_size=3, max_size=8, unique=True))
def test_every_order_is_a_multiple_of_a_fundamental(orders: list[int]) -> None:
    found = fundamentals(orders)
    assert all(any(order % k == 0 for k in found) for order in orders) or not found
    assert 1 not in found


def test_an_extent_and_its_bound_are_shares_of_the_range() -> None:
    at = standard_motion().at
    effect, extent = CATALOGUE["motor-dahl"], np.ptp(at.motor_angle)
    declared, found = (e.parameter("distance") for e in (effect, located(effect, [at])))
    shares = [share for share in declared.grid if share * extent < declared.high]
    assert 0 < len(shares) < len(declared.grid), "a longer distance is no presliding"
    assert found.grid == pytest.approx([share * extent for share in shares])
    assert found.low == pytest.approx(found.grid[0] / 10)


def test_a_place_keeps_its_bounds_and_other_effects_are_unchanged() -> None:
    at = standard_motion().at
    effect = CATALOGUE["friction-at-place"]
    found = located(effect, [at]).parameter("place")
    assert (found.low, found.high) == (
        effect.parameter("place").low,
        effect.parameter("place").high,
    )
    assert located(CATALOGUE["motor-coulomb"], [at]) is CATALOGUE["motor-coulomb"]


@pytest.mark.parametrize(
    ("name", "parameter", "low"),
    [("torque-lag", "time_constant", 0.0), ("torque-lead", "lead", -0.2)],
)
def test_a_delay_is_within_a_filter_and_a_bus_or_two_samples(
    name: str, parameter: str, low: float
) -> None:
    at = standard_motion().at
    found = located(CATALOGUE[name], [at]).parameter(parameter)
    assert (found.low, found.high) == (low, 0.2)
    slow = replace(at, time=np.arange(len(at.time)) * 0.5)
    assert located(CATALOGUE[name], [slow]).parameter(parameter).high == 1.0


def test_a_transition_is_fitted_up_to_the_largest_that_is_one() -> None:
    found = with_free_transition(CATALOGUE["motor-coulomb"], 0.1).parameter(TRANSITION)
    assert 0.0 < found.low < found.high == 0.1
