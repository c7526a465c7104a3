"""Option codes, limits, cycle and profile as they are written to a drive's objects."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hand_made import SCALE, Objects
from winchkit.drivers.can.cia402.commission import set_cycle
from winchkit.drivers.can.cia402.limits import LimitsAtShaft, read_limits, set_limits
from winchkit.drivers.can.cia402.option_codes import merged, read_options, set_options
from winchkit.drivers.can.cia402.profile_parameters import HomingSpec, set_homing, set_profile
from winchkit.errors import NotPermitted
from winchkit.schema.devices.servo import OptionSpec, QuirkSpec, ServoSpec

SERVO = ServoSpec("x.eds", ("CSV",))
CODES = {0x605A: 2, 0x605B: 1, 0x605C: 1, 0x605D: 1, 0x605E: 2, 0x6007: 3}
KEYS = dict(
    zip(
        ("quick_stop", "shutdown", "disable_operation", "halt", "fault", "connection_lost"),
        CODES,
        strict=True,
    )
)


def test_what_is_configured_is_written_and_the_rest_left_alone() -> None:
    objects = Objects({**CODES, 0x6007: 0})
    options = set_options(objects, OptionSpec(quick_stop=6, connection_lost=3), brake=False)  # type: ignore[arg-type]
    assert objects.written == [(0x605A, 0, 6), (0x6007, 0, 3)]
    assert options["quick_stop"].value == 6
    assert "stay in quick stop" in str(options["quick_stop"])
    assert str(options["connection_lost"]) == "6007h loss of the host: 3 (quick stop)"


def test_a_code_that_is_right_already_is_not_written_again() -> None:
    objects = Objects(CODES)
    set_options(objects, OptionSpec(quick_stop=2, fault=2), brake=False)  # type: ignore[arg-type]
    assert objects.written == []


def test_the_bench_counts_before_the_device_file() -> None:
    both = merged(OptionSpec(quick_stop=2, halt=1), OptionSpec(quick_stop=6))
    assert both == OptionSpec(quick_stop=6, halt=1)


@pytest.mark.parametrize("key", [*KEYS])
@pytest.mark.parametrize("code", [*range(-3, 9)])
def test_without_a_brake_every_code_that_may_coast_is_refused(key: str, code: int) -> None:
    """By hand: 0 coasts everywhere but in 6007h, where 2 does; negative codes are the maker's."""
    lost = key == "connection_lost"
    harmless = code in (1, 3) if lost else code > 0
    top = {"quick_stop": 8, "shutdown": 1, "disable_operation": 1, "halt": 4, "fault": 4}
    harmless = harmless and (lost or code <= top[key])
    objects = Objects({**CODES, KEYS[key]: code})
    if harmless:
        set_options(objects, OptionSpec(), brake=False)  # type: ignore[arg-type]
    else:
        with pytest.raises(NotPermitted, match=f"{KEYS[key]:04X}h:0 is {code}"):
            set_options(objects, OptionSpec(), brake=False)  # type: ignore[arg-type]


@pytest.mark.parametrize("code", [0, 4, -1])
def test_a_brake_does_not_replace_the_watchdog(code: int) -> None:
    with pytest.raises(NotPermitted, match="go on moving when the host dies"):
        set_options(Objects({**CODES, 0x6007: code}), OptionSpec(), brake=True)  # type: ignore[arg-type]


def test_codes_that_a_drive_lacks_are_reported_and_accepted() -> None:
    objects = Objects({0x6007: 3})
    assert read_options(objects)["halt"].value is None  # type: ignore[arg-type]
    set_options(objects, OptionSpec(), brake=False)  # type: ignore[arg-type]


LIMITS: dict[int | tuple[int, int], int] = {
    (0x607D, 1): -(2**31),
    (0x607D, 2): 2**31 - 1,
    0x6065: 0xFFFFFFFF,
    0x6072: 3000,
    0x607F: 500_000,
}


def test_limits_are_written_in_counts_and_read_back_in_si() -> None:
    """Scale: 1 mrad, 1 mrad/s, 0.01 N m (a rated torque of 10 N m)."""
    objects = Objects(LIMITS)
    wanted = LimitsAtShaft(angle=(40.0, -2.5), following_error=0.5, torque=12.0)
    kept = set_limits(objects, SCALE, wanted)  # type: ignore[arg-type]
    assert objects.written == [
        (0x607D, 1, -2500),
        (0x607D, 2, 40_000),
        (0x6065, 0, 500),
        (0x6072, 0, 1200),
    ]
    assert kept.angle == (-2.5, 40.0)
    assert (kept.torque, kept.following_error) == (12.0, 0.5)
    assert kept.speed == pytest.approx(500.0)


def test_limits_that_are_not_declared_are_left_alone() -> None:
    objects = Objects(LIMITS)
    kept = set_limits(objects, SCALE, LimitsAtShaft())  # type: ignore[arg-type]
    assert objects.written == []
    assert math.isnan(kept.following_error), "FFFFFFFFh is no limit"
    assert kept.speed == pytest.approx(500.0)


def test_a_limit_without_an_object_is_refused() -> None:
    objects = Objects({key: value for key, value in LIMITS.items() if key != 0x6072})
    with pytest.raises(NotPermitted, match="6072h:0: the drive has no such limit"):
        set_limits(objects, SCALE, LimitsAtShaft(torque=1.0))  # type: ignore[arg-type]
    assert math.isnan(read_limits(objects, SCALE).torque)  # type: ignore[arg-type]


@pytest.mark.parametrize("angle", [(1.0, 1.0), (0.0, math.inf), (math.nan, 1.0)])
def test_angles_that_are_no_limits_are_refused(angle: tuple[float, float]) -> None:
    objects = Objects(LIMITS)
    with pytest.raises(NotPermitted, match="are no limits"):
        set_limits(objects, SCALE, LimitsAtShaft(angle=angle))  # type: ignore[arg-type]
    assert objects.written == []


def interpolation(value: int, exponent: int) -> Objects:
    return Objects({(0x60C2, 1): value, (0x60C2, 2): exponent})


@given(milliseconds=st.sampled_from([0.5, 1.0, 2.0, 2.5, 4.0, 5.0, 8.0, 10.0, 20.0, 100.0, 250.0]))
def test_the_interpolation_period_is_the_cycle(milliseconds: float) -> None:
    objects = interpolation(1, -2)
    kept = set_cycle(objects, milliseconds * 1e-3)  # type: ignore[arg-type]
    value, exponent = objects.values[0x60C2, 1], objects.values[0x60C2, 2]
    assert 1 <= value <= 255
    assert value * 10.0**exponent == pytest.approx(milliseconds * 1e-3)
    assert kept == pytest.approx(milliseconds * 1e-3)


def test_a_drive_that_takes_one_exponent_only_gets_that_one() -> None:
    """As drives do that count tenths of a millisecond, or whole ones."""
    objects = interpolation(10, -4)
    objects.refuses = lambda _index, sub, value: sub == 2 and value != -4
    assert set_cycle(objects, 0.004) == pytest.approx(0.004)  # type: ignore[arg-type]
    assert objects.values == {(0x60C2, 1): 40, (0x60C2, 2): -4}


def test_an_exponent_that_cannot_be_written_is_used_as_it_is() -> None:
    """Yiyou's EuServo: 60C2h:2 is read-only and -3; the period itself can be written."""
    objects = interpolation(1, -3)
    objects.refuses = lambda _index, sub, _value: sub == 2
    assert set_cycle(objects, 0.004) == pytest.approx(0.004)  # type: ignore[arg-type]
    assert objects.values == {(0x60C2, 1): 4, (0x60C2, 2): -3}
    with pytest.raises(NotPermitted, match=r"cannot hold a cycle of 2\.5 ms"):
        set_cycle(objects, 0.0025)  # type: ignore[arg-type]


def test_a_drive_that_keeps_another_period_is_refused() -> None:
    objects = interpolation(1, -3)
    objects.refuses = lambda _index, _sub, _value: True
    with pytest.raises(NotPermitted, match=r"a cycle of 4 ms, the drive keeps 1 ms"):
        set_cycle(objects, 0.004)  # type: ignore[arg-type]
    with pytest.raises(NotPermitted, match=r"cannot hold a cycle of 3\.1416 ms"):
        set_cycle(interpolation(1, -3), 0.0031416)  # type: ignore[arg-type]


def test_a_period_that_is_right_is_not_written_and_none_is_needed() -> None:
    objects = interpolation(4, -3)
    assert set_cycle(objects, 0.004) == pytest.approx(0.004)  # type: ignore[arg-type]
    assert objects.written == []
    assert set_cycle(Objects({}), 0.004) is None  # type: ignore[arg-type]


PROFILE: dict[int | tuple[int, int], int] = {0x6081: 0, 0x6083: 0, 0x6084: 0}


def test_profiles_in_counts_and_for_drives_that_count_ramps_in_milliseconds() -> None:
    objects = Objects(PROFILE)
    set_profile(objects, SERVO, SCALE, speed=20.0, acceleration=50.0)  # type: ignore[arg-type]
    assert objects.written == [(0x6081, 0, 20_000), (0x6083, 0, 50_000), (0x6084, 0, 50_000)]
    times = ServoSpec("x.eds", ("PV",), quirks=QuirkSpec(ramps_are_times=True))
    objects = Objects(PROFILE)
    set_profile(objects, times, SCALE, acceleration=314.159265)  # type: ignore[arg-type]
    assert objects.written == [(0x6083, 0, 1000), (0x6084, 0, 1000)], "1 s to 3000 rpm"


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan])
def test_profiles_that_would_never_end_are_refused(value: float) -> None:
    objects = Objects(PROFILE)
    with pytest.raises(NotPermitted, match="not above zero"):
        set_profile(objects, SERVO, SCALE, acceleration=value)  # type: ignore[arg-type]
    with pytest.raises(NotPermitted, match="not above zero"):
        set_profile(objects, SERVO, SCALE, speed=value)  # type: ignore[arg-type]
    assert objects.written == []


def test_a_homing_is_written_in_the_drive_s_units() -> None:
    objects = Objects({0x6098: 0, (0x6099, 1): 0, (0x6099, 2): 0, 0x609A: 0, 0x607C: 0})
    set_homing(objects, SERVO, SCALE, HomingSpec(18, 5.0, 0.5, 30.0, offset=-1.5))  # type: ignore[arg-type]
    assert objects.written == [
        (0x6098, 0, 18),
        (0x6099, 1, 5000),
        (0x6099, 2, 500),
        (0x609A, 0, 30_000),
        (0x607C, 0, -1500),
    ]
    del objects.values[0x607C, 0]
    objects.written.clear()
    with pytest.raises(NotPermitted, match=r"607C.*no such object.*--here"):
        set_homing(objects, SERVO, SCALE, HomingSpec(18, 5.0, 0.5, 30.0, offset=1.0))  # type: ignore[arg-type]
    with pytest.raises(NotPermitted, match="no homing method 300"):
        set_homing(objects, SERVO, SCALE, HomingSpec(300, 5.0, 0.5, 30.0))  # type: ignore[arg-type]
    assert objects.written == [], "what is missing is read before anything is written"
    set_homing(objects, SERVO, SCALE, HomingSpec(18, 5.0, 0.5, 30.0))  # type: ignore[arg-type]
    assert objects.written[0] == (0x6098, 0, 18), "without 607Ch it homes without an offset"


@pytest.mark.parametrize(
    ("method", "missing", "said"),
    [(18, (0x6098, 0), "6098"), (18, (0x6099, 1), "6099.*1"), (18, (0x6099, 2), "6099.*2")],
)
def test_a_homing_names_what_the_drive_lacks(
    method: int, missing: tuple[int, int], said: str
) -> None:
    objects = Objects({0x6098: 0, (0x6099, 1): 0, (0x6099, 2): 0, 0x609A: 0})
    del objects.values[missing]
    with pytest.raises(NotPermitted, match=said):
        set_homing(objects, SERVO, SCALE, HomingSpec(method, 5.0, 0.5, 30.0))  # type: ignore[arg-type]
    assert objects.written == []


def test_a_homing_here_needs_no_speeds_and_takes_a_makers_home_position() -> None:
    """The EPOS4 has no 607Ch; its home position is 30B0h."""
    servo = ServoSpec("x.eds", ("CSV",), home_offset="0x30B0")
    objects = Objects({0x6098: 0, 0x30B0: 0})
    set_homing(objects, servo, SCALE, HomingSpec(37, 5.0, 0.5, 30.0, offset=2.0))  # type: ignore[arg-type]
    assert objects.written == [(0x6098, 0, 37), (0x30B0, 0, 2000)]


@pytest.mark.parametrize("code", [-1, -3, 9, 300])
def test_a_quick_stop_that_may_do_nothing_is_refused_even_with_a_brake(code: int) -> None:
    objects = Objects({**CODES, 0x605A: code})
    with pytest.raises(NotPermitted, match="may ignore a quick stop"):
        set_options(objects, OptionSpec(), brake=True)  # type: ignore[arg-type]
    set_options(objects, OptionSpec(quick_stop=2), brake=True)  # type: ignore[arg-type]
    assert (0x605A, 0, 2) in objects.written
