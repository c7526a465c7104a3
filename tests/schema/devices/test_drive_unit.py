"""Units of drives written as products: what they are worth, and what is no unit."""

from __future__ import annotations

from math import pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit.errors import UsageError
from winchkit.schema.devices.drive_unit import DriveUnit, product_of

_ANGLES = {"rad": 1.0, "deg": pi / 180, "turn": 2 * pi}
_TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0}


@given(
    numbers=st.lists(st.tuples(st.sampled_from("*/"), st.floats(1e-3, 1e6)), max_size=4),
    angle=st.sampled_from(list(_ANGLES)),
    time=st.sampled_from(list(_TIMES)),
    period=st.floats(0.1, 1000.0),
)
def test_a_product_is_worth_what_its_factors_are(
    numbers: list[tuple[str, float]], angle: str, time: str, period: float
) -> None:
    text, value = angle, _ANGLES[angle]
    for sign, number in numbers:
        text += f" {sign} {number!r}"
        value = value * number if sign == "*" else value / number
    found = product_of(f"{text} / {period!r} {time}", "speed")
    assert found.factor == pytest.approx(value / (period * _TIMES[time]), rel=1e-12)
    assert (found.increments, found.encoder) == (0, 0)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "is empty"),
        ("m/s", "unknown unit 'm'"),
        ("rpms", "did you mean 'rpm'"),
        ("counts", "is no angle per time"),
        ("rpm/s", "is no angle per time"),
        ("1 / 512 rpm", "is no angle per time"),
        ("0 rpm", "is not above zero"),
        ("-1 rpm", "cannot be read from '-1 rpm' on"),
        ("rpm *", "ends with a sign"),
        ("/ rpm", "has nothing before '/'"),
        ("16.16 counts per slow loop", "unknown unit 'per'"),
        ("rpm 10", "has no sign before 10"),
        ("1e999 rpm", "is not above zero"),
        ("rpm / 0", "divides by zero"),
        ("2^99999 rpm", "beyond what a number holds"),
    ],
)
def test_what_is_no_speed_is_refused_with_examples(text: str, reason: str) -> None:
    with pytest.raises(UsageError) as refused:
        DriveUnit("speed").read(text)
    assert reason in str(refused.value)
    assert '"1875 rpm / 512 / encoder"' in str(refused.value)


def test_a_number_alone_is_no_unit() -> None:
    with pytest.raises(UsageError, match="expected a unit of position"):
        DriveUnit("position").read(10)
    with pytest.raises(UsageError, match="is no angle"):
        DriveUnit("position").read("0.1 deg/s")
