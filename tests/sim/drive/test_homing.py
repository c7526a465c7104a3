"""Homing of the simulated drive: where it ends, what the status word says, what it refuses."""

from __future__ import annotations

from dataclasses import replace
from math import inf, pi

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drive_rig import COUNT, SERVO, Flywheel, Rig, with_quirks
from winchkit.schema.devices.servo import Encoder, QuirkSpec, ServoSpec

HM, PP, CSV = 6, 1, 9
REACHED, ATTAINED, ERROR = 0x400, 0x1000, 0x2000
FAST, SLOW, RATE = 200_000, 20_000, 2_000_000
EDGE = 12.3
"""rad, of whichever switch is looked for."""


def homing(method: int, start: float, *, offset: int = 0, servo: ServoSpec = SERVO) -> Rig:
    rig = Rig(Flywheel(motor_angle=start), servo=servo)
    switches = rig.drive.switches
    if method in (17, 1):
        switches.negative = EDGE
    elif method in (18, 2):
        switches.positive = EDGE
    elif method in (19, 20, 3, 4):
        switches.home = (EDGE, inf)
    elif method in (21, 22, 5, 6):
        switches.home = (-inf, EDGE)
    switches.index = 0.7
    rig.write(0x6098, 0, method)
    rig.write(0x6099, 1, FAST)
    rig.write(0x6099, 2, SLOW)
    rig.write(0x609A, 0, RATE)
    rig.write(0x607C, 0, offset)
    rig.enable(HM)
    return rig


def until_done(rig: Rig, limit: float = 20.0) -> int:
    start = rig.now
    while not rig.status & (ATTAINED | ERROR) or not rig.status & REACHED:
        rig.run(0.01)
        assert rig.now - start < limit
    return rig.status & (ATTAINED | ERROR | REACHED)


def next_index(angle: float, direction: int) -> float:
    """By going there in small steps."""
    turns = (angle - 0.7) / (2 * pi)
    nearest = 0.7 + 2 * pi * round(turns)
    while (nearest - angle) * direction <= 0:
        nearest += direction * 2 * pi
    while (nearest - angle) * direction > 2 * pi:
        nearest -= direction * 2 * pi
    return nearest


@settings(max_examples=40, deadline=None)
@given(st.sampled_from([17, 18, 19, 20, 21, 22]), st.floats(-25.0, 25.0))
def test_a_switch_s_edge_is_home(method: int, away: float) -> None:
    """From either side; within the way of one slice at the slow speed."""
    rig = homing(method, EDGE + away)
    rig.control(0x1F)
    assert until_done(rig) == ATTAINED | REACHED
    rig.run(0.2)
    zero = rig.shaft.motor_angle - rig.read(0x6064) * COUNT
    assert zero == pytest.approx(EDGE, abs=SLOW * COUNT * 2e-3)
    assert rig.shaft.motor_velocity == 0


@settings(max_examples=30, deadline=None)
@given(st.sampled_from([1, 2, 3, 4, 5, 6]), st.floats(-15.0, 15.0))
def test_the_index_after_the_edge_is_home(method: int, away: float) -> None:
    """In the direction in which the edge was left."""
    rig = homing(method, EDGE + away)
    rig.control(0x1F)
    assert until_done(rig, 40.0) == ATTAINED | REACHED
    rig.run(0.2)
    direction = {1: 1, 2: -1, 3: -1, 4: 1, 5: 1, 6: -1}[method]
    zero = rig.shaft.motor_angle - rig.read(0x6064) * COUNT
    assert zero == pytest.approx(next_index(EDGE, direction), abs=COUNT)


@settings(max_examples=30, deadline=None)
@given(st.sampled_from([33, 34]), st.floats(-50.0, 50.0))
def test_the_next_index_is_home(method: int, start: float) -> None:
    rig = homing(method, start)
    rig.control(0x1F)
    assert until_done(rig, 10.0) == ATTAINED | REACHED
    rig.run(0.2)
    zero = rig.shaft.motor_angle - rig.read(0x6064) * COUNT
    expected = next_index(start, -1 if method == 33 else 1)
    assert zero == pytest.approx(expected, abs=COUNT)


@pytest.mark.parametrize("method", [35, 37])
@pytest.mark.parametrize("offset", [0, 5_000, -70_000])
def test_the_present_place_is_home_and_zero_lies_an_offset_further(
    method: int, offset: int
) -> None:
    """CiA 402: zero position = home position + home offset."""
    rig = homing(method, 4.2, offset=offset)
    rig.control(0x1F)
    assert until_done(rig) == ATTAINED | REACHED
    assert rig.shaft.motor_angle == pytest.approx(4.2)
    assert rig.read(0x6064) == -offset
    assert rig.read(0x6062) == -offset


def test_for_some_drives_home_has_the_offset_s_position() -> None:
    rig = Rig(Flywheel(motor_angle=4.2), servo=with_quirks(QuirkSpec(home_gets_offset=True)))
    rig.write(0x607C, 0, 5_000)
    rig.enable(HM)
    rig.control(0x1F)
    rig.run(0.05)
    assert rig.read(0x6064) == 5_000


def test_positions_and_limits_count_from_the_new_zero() -> None:
    rig = homing(35, 3.0)
    rig.control(0x1F, 0x0F)
    rig.run(0.05)
    rig.write(0x6060, 0, PP)
    rig.write(0x607D, 1, -50_000)
    rig.write(0x607D, 2, 50_000)
    rig.set_point(90_000, 0x1F)
    rig.run(3.0)
    assert rig.read(0x6064) == pytest.approx(50_000, abs=1)
    assert rig.shaft.motor_angle == pytest.approx(3.0 + 50_000 * COUNT, abs=2 * COUNT)


def test_the_search_is_fast_for_the_switch_and_slow_for_the_edge() -> None:
    rig = homing(17, EDGE + 20.0)
    rig.control(0x1F)
    fastest, slowest = 0.0, 0.0
    while not rig.status & ATTAINED:
        rig.run(1e-3)
        fastest = min(fastest, rig.shaft.motor_velocity)
        slowest = max(slowest, rig.shaft.motor_velocity)
        assert not rig.status & ERROR
    assert fastest == pytest.approx(-FAST * COUNT, rel=1e-3)
    assert slowest == pytest.approx(SLOW * COUNT, rel=1e-3)


def test_what_the_status_word_says_on_the_way() -> None:
    rig = homing(17, EDGE + 20.0)
    bits = ATTAINED | ERROR | REACHED
    assert rig.status & bits == REACHED, "not started"
    rig.control(0x1F)
    rig.run(0.1)
    assert rig.status & bits == 0, "under way"
    rig.control(0x0F)
    rig.run(0.3)
    assert rig.status & bits == REACHED, "interrupted"
    assert rig.shaft.motor_velocity == 0
    rig.control(0x1F)
    assert until_done(rig) == ATTAINED | REACHED


def test_halt_interrupts_a_search_and_its_end_goes_on() -> None:
    rig = homing(17, EDGE + 20.0)
    rig.control(0x1F)
    rig.run(0.1)
    rig.control(0x11F)
    rig.run(0.5)
    assert rig.shaft.motor_velocity == 0
    rig.control(0x1F)
    assert until_done(rig) == ATTAINED | REACHED


@pytest.mark.parametrize("method", [17, 18, 19, 22])
def test_a_switch_that_is_not_fitted_is_an_error(method: int) -> None:
    rig = homing(35, 0.0)
    rig.write(0x6098, 0, method)
    rig.control(0x1F)
    rig.run(0.05)
    assert rig.status & (ATTAINED | ERROR | REACHED) == ERROR | REACHED
    assert rig.shaft.motor_velocity == 0


def test_a_limit_switch_before_the_home_switch_is_an_error() -> None:
    rig = homing(19, 0.0)
    rig.drive.switches.positive = 6.0
    rig.control(0x1F)
    assert until_done(rig) == ERROR | REACHED
    assert 6.0 <= rig.shaft.motor_angle < EDGE


def test_a_search_without_a_speed_is_an_error() -> None:
    rig = homing(33, 0.0)
    rig.write(0x6099, 2, 0)
    rig.control(0x1F)
    rig.run(0.05)
    assert rig.status & ERROR


def test_a_disabled_drive_does_not_home() -> None:
    rig = Rig(Flywheel(motor_angle=2.0))
    rig.write(0x6060, 0, HM)
    rig.control(0x16)
    rig.run(0.05)
    assert rig.read(0x6064) == round(2.0 / COUNT)


@pytest.mark.parametrize("encoder", ["absolute", "incremental"])
def test_a_reboot_keeps_the_zero_of_an_absolute_encoder_only(encoder: Encoder) -> None:
    rig = homing(35, 2.0, servo=replace(SERVO, encoder=encoder))
    rig.control(0x1F)
    rig.run(0.05)
    assert rig.read(0x6064) == 0
    rig.shaft.motor_angle += 1.0
    rig.drive.inject("reboot")
    rig.run(1.5)
    assert rig.read(0x6064) == (round(1.0 / COUNT) if encoder == "absolute" else 0)


def test_digital_inputs_show_the_switches() -> None:
    rig = Rig(Flywheel(motor_angle=5.0))
    switches = rig.drive.switches
    seen = []
    for switches.negative, switches.positive, switches.home in (
        (0.0, 10.0, (inf, inf)),
        (5.0, 10.0, (inf, inf)),
        (0.0, 5.0, (inf, inf)),
        (0.0, 10.0, (4.0, 6.0)),
    ):
        rig.run(0.002)
        seen.append(rig.read(0x60FD))
    assert seen == [0, 1, 2, 4]
