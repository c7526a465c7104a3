"""Units of drives against numbers worked by hand from the text of CiA 402-2 and CiA 303-2."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hand_made import Objects
from winchkit.drivers.can.cia402.units import CountScale, UnitObjects, read_scale, scale_of
from winchkit.errors import NotPermitted
from winchkit.schema.devices.servo import ServoSpec

SERVO = ServoSpec("x.eds", ("CSV",), increments_per_turn=10_000, rated_torque=3.0)
RPM = 0.10471975511965977


def ratio(index: int, above: int, below: int) -> dict[int | tuple[int, int], int]:
    return {(index, 1): above, (index, 2): below}


def test_a_drive_that_says_nothing_is_as_its_file_says() -> None:
    """10 000 increments a turn: one is 0.000 628 318 5 rad, and so is one a second."""
    scale = read_scale(Objects({}), SERVO)  # type: ignore[arg-type]
    assert scale.angle == pytest.approx(6.283185307e-4)
    assert scale.velocity == pytest.approx(6.283185307e-4)
    assert scale.torque == pytest.approx(0.003)
    assert scale.rated_torque == pytest.approx(3.0)
    assert math.isnan(scale.current)


def test_an_encoder_of_4096_on_a_motor_of_1_27_newton_metres() -> None:
    """608Fh 4096/1, 6076h 1270 mN m, 6075h 5300 mA: per mille 1.27 mN m and 5.3 mA."""
    objects = Objects({**ratio(0x608F, 4096, 1), 0x6076: 1270, 0x6075: 5300})
    scale = read_scale(objects, SERVO)  # type: ignore[arg-type]
    assert scale.angle == pytest.approx(2 * math.pi / 4096)
    assert scale.torque == pytest.approx(1.27e-3)
    assert scale.current == pytest.approx(5.3e-3)
    assert scale.torque_counts(0.635) == 500


def test_a_feed_constant_behind_a_gear() -> None:
    """36 000 units (hundredths of a degree) a shaft turn, 5 motor turns for one of it.

    A motor turn is then 7200 units whatever the encoder counts: 1 unit is 0.05 degrees of the
    motor, 8.726 646e-4 rad.
    """
    objects = Objects(
        {**ratio(0x608F, 20_000, 1), **ratio(0x6091, 5, 1), **ratio(0x6092, 36_000, 1)}
    )
    scale = read_scale(objects, SERVO)  # type: ignore[arg-type]
    assert scale.angle == pytest.approx(math.radians(0.05))
    assert scale.angle_counts(2 * math.pi) == 7200


def test_an_encoder_behind_a_gear_without_a_feed_constant() -> None:
    """10 000 increments a shaft turn, 7 motor turns for 2 of the shaft: 20 000/7 a motor turn."""
    objects = Objects({**ratio(0x608F, 10_000, 1), **ratio(0x6091, 7, 2)})
    scale = read_scale(objects, SERVO)  # type: ignore[arg-type]
    assert scale.angle_counts(7 * 2 * math.pi) == 20_000


@pytest.mark.parametrize(
    ("position", "degrees"),
    [
        (0xFF410000, 0.1),  # 10^-1 degree
        (0x00410000, 1.0),  # degree
        (0xFD100000, math.degrees(1e-3)),  # milliradian
    ],
)
def test_positions_in_a_rotary_si_unit(position: int, degrees: float) -> None:
    scale = scale_of(UnitObjects(encoder=4096, position=position), SERVO)
    assert scale.angle == pytest.approx(math.radians(degrees))


@pytest.mark.parametrize(
    ("unit", "velocity"),
    [
        (0x00B44700, RPM),  # revolutions a minute
        (0xFAB44700, RPM * 1e-6),  # millionths of it
        (0x00B40300, 2 * math.pi),  # revolutions a second
        (0x00410300, math.radians(1.0)),  # degrees a second
    ],
)
def test_speeds_in_an_si_unit_count_before_the_file(unit: int, velocity: float) -> None:
    assert scale_of(UnitObjects(velocity=unit), SERVO).velocity == pytest.approx(velocity)


def test_an_si_unit_at_the_shaft_counts_through_the_gear() -> None:
    """1 rpm of a shaft behind 5:1 is 5 rpm of the motor."""
    assert scale_of(UnitObjects(gear=5.0, velocity=0x00B44700), SERVO).velocity == pytest.approx(
        5 * RPM
    )


def test_a_linear_unit_reports_nothing_and_the_file_counts() -> None:
    units = UnitObjects(position=0xFD010000, velocity=0xFD010300, rated_current=1.0)
    assert scale_of(units, SERVO) == scale_of(UnitObjects(rated_current=1.0), SERVO)


@pytest.mark.parametrize(
    ("unit", "velocity"), [("rpm", RPM), ("0.1 rpm", RPM / 10), ("increments/s", math.pi / 5000)]
)
def test_speed_units_of_a_device_file(unit: str, velocity: float) -> None:
    servo = ServoSpec("x.eds", ("CSV",), increments_per_turn=10_000, speed_unit=unit)
    assert scale_of(UnitObjects(), servo).velocity == pytest.approx(velocity)


@pytest.mark.parametrize(
    ("unit", "counts"),
    [
        ("0.1 counts/s", 10_000 / 6 * 10),
        ("0.1 increments/s", 10_000 / 6 * 10),
        ("counts / 65536 / 250 us", 10_000 / 6 * 65536 * 250e-6),
        ("counts/2^16/1 ms", 10_000 / 6 * 65.536),
        ("1875 rpm / 512 / encoder", 10 * 512 * 10_000 / 1875),
        ("rpm * 1875 / 512 / encoder", 10 * 512 * 10_000 / 1875),
        ("1e-3 turn/s", 1000 / 6),
        ("mrad/s", 1000 * 2 * math.pi / 6),
        ("6 deg/s", 10.0),
        ("turn / min", 10.0),
    ],
)
def test_a_speed_unit_is_any_product(unit: str, counts: float) -> None:
    """The number that a drive of 10 000 increments a turn shows at 10 rpm, worked by hand."""
    servo = ServoSpec("x.eds", ("CSV",), increments_per_turn=10_000, speed_unit=unit)
    assert 10 * RPM / scale_of(UnitObjects(), servo).velocity == pytest.approx(counts, rel=1e-6)


@pytest.mark.parametrize(
    ("unit", "counts"),
    [
        ("0.1 deg", 3600),
        ("turn / 8192", 8192),
        ("10 counts", 1000),
        ("turn / encoder / 4", 40_000),
        ("mrad", 2000 * math.pi),
    ],
)
def test_a_position_unit_is_any_product(unit: str, counts: float) -> None:
    servo = ServoSpec(
        *("x.eds", ("CSV",)), increments_per_turn=10_000, units="file", position_unit=unit
    )
    scale = scale_of(UnitObjects(encoder=7.0, feed=3.0), servo)
    assert 2 * math.pi / scale.angle == pytest.approx(counts)
    assert scale.velocity == pytest.approx(scale.angle), "increments are units of 6064h"


def test_the_encoder_of_a_speed_unit_is_the_drives_where_it_says_it() -> None:
    servo = ServoSpec(
        *("x.eds", ("CSV",)), increments_per_turn=10_000, speed_unit="1875 rpm / 512 / encoder"
    )
    found = scale_of(UnitObjects(encoder=4096.0), servo).velocity
    assert found == pytest.approx(1875 * RPM / 512 / 4096)


def test_objects_that_stand_at_one_are_refused_and_the_file_can_overrule_them() -> None:
    """Some drives show 1/1 everywhere and count encoder increments all the same."""
    units = UnitObjects(encoder=1.0, gear=1.0, feed=1.0, velocity=0x00B44700, rated_current=1.0)
    with pytest.raises(NotPermitted, match=r'too few to move by.*servo.units = "file"'):
        scale_of(units, SERVO)
    servo = ServoSpec("x.eds", ("CSV",), increments_per_turn=10_000, units="file")
    assert scale_of(units, servo) == scale_of(UnitObjects(rated_current=1.0), servo)


def test_the_refusal_names_the_drive() -> None:
    with pytest.raises(NotPermitted, match=r"node 1 608Fh:1: by 608Fh"):
        read_scale(Objects(ratio(0x608F, 1, 1)), SERVO)  # type: ignore[arg-type]


@given(unit=st.floats(1e-9, 0.3), count=st.integers(-(2**31) + 1, 2**31 - 1))
def test_counts_are_the_nearest_and_never_wrap(unit: float, count: int) -> None:
    scale = CountScale(unit, unit, unit)
    assert scale.angle_counts(count * unit) == pytest.approx(count, abs=1e-6 * abs(count) + 1)
    for beyond in (2.0**31 * unit * 1.001, -(2.0**31) * unit * 1.001, math.inf, math.nan):
        with pytest.raises(NotPermitted, match="beyond the drive's range"):
            scale.angle_counts(beyond)
        with pytest.raises(NotPermitted):
            scale.velocity_counts(beyond)
    with pytest.raises(NotPermitted, match="N m"):
        scale.torque_counts(40_000 * unit)
