"""6064h counted over any number of turns, and compared with the integral of 606Ch."""

from __future__ import annotations

import math
import struct
from pathlib import Path

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from counter_agreement import (
    ACCELERATION,
    CYCLE,
    FILTERS,
    RADIUS,
    SPEED,
    agreement_of,
    drives,
    false_ones,
    slowest,
    smallest_jump,
)
from hand_made import NODE, RPDO, SCALE, TPDO, Bus, Clock, HandMade, codec
from winchkit import catalog
from winchkit.drivers.can.canopen.node import SdoNode
from winchkit.drivers.can.canopen.pdo import PdoCodec
from winchkit.drivers.can.cia402.position_counter import PositionCounter
from winchkit.drivers.can.cia402.state_machine import RequestedState
from winchkit.errors import NotPermitted
from winchkit.schema.devices.servo import PdoSpec

ENABLED = 0x0237
I32 = (-(2**31), 2**31 - 1)


def shown(true: int, low: int, high: int) -> int:
    """What a counter shows of a count that has no end."""
    return (true - low) % (high - low + 1) + low


@given(
    st.sampled_from([I32, (0, 2**24 - 1), (-(2**23), 2**23 - 1), (0, 4095)]),
    st.integers(-(2**33), 2**33),
    st.lists(st.floats(-0.499, 0.499), min_size=1, max_size=60),
)
def test_any_way_shorter_than_half_the_range_a_step_is_counted(
    limits: tuple[int, int], start: int, steps: list[float]
) -> None:
    low, high = limits
    counter = PositionCounter(low, high)
    true = start
    first = counter.take(shown(true, low, high), 0.0)
    for number, step in enumerate(steps, 1):
        true += int(step * (high - low + 1))
        assert counter.take(shown(true, low, high), 0.004 * number) - first == true - start
        assert not counter.doubt


def test_a_long_gap_makes_the_turns_unknown() -> None:
    """At 1000 counts/s half of 4096 counts may pass within 2.048 s."""
    counter = PositionCounter(0, 4095, fastest=1000.0)
    counter.take(100, 0.0)
    counter.take(100, 2.0)
    assert not counter.doubt
    counter.take(100, 4.1)
    assert counter.doubt
    counter.suspend()
    assert counter.take(5, 4.2) == 5
    counter.resume(None)
    assert counter.doubt, "a homing that found nothing changes nothing"
    counter.suspend()
    counter.resume("")
    assert not counter.doubt


@given(
    st.integers(0, 4095),
    st.lists(st.tuples(st.floats(-1.0, 1.0), st.floats(0.001, 1.0)), min_size=1, max_size=40),
)
def test_a_motion_up_to_the_greatest_speed_is_no_jump(
    start: int, steps: list[tuple[float, float]]
) -> None:
    counter, true, time = PositionCounter(0, 4095, fastest=1000.0), start, 0.0
    counter.take(start, time)
    for share, span in steps:
        true, time = true + round(share * 1000.0 * span), time + span
        counter.take(shown(true, 0, 4095), time)
    assert counter.jump == 0.0
    assert not counter.doubt


@pytest.mark.parametrize("after", [0.004, 0.5])
@pytest.mark.parametrize("jump", [-1, 1])
def test_a_change_faster_than_the_motor_can_turn_is_a_jump(after: float, jump: int) -> None:
    """1000 counts/s for the time in between, and 0.25 s of delay."""
    within = round(1000.0 * (after + 0.25))
    for size, jumped in ((within - 1, False), (within + 1, True)):
        counter = PositionCounter(-(2**31), 2**31 - 1, fastest=1000.0)
        counter.take(7, 0.0)
        counter.take(7 + jump * size, after)
        assert (counter.jump != 0.0, bool(counter.doubt)) == (jumped, jumped)
        if jumped:
            assert counter.jump == jump * size


def test_a_jump_across_the_end_is_measured_the_short_way() -> None:
    counter = PositionCounter(0, 4095, fastest=1000.0)
    counter.take(4000, 0.0)
    assert counter.take(1000, 0.004) == 5096
    assert counter.jump == 1096


def test_the_zero_that_a_homing_sets_is_no_jump() -> None:
    counter = PositionCounter(-(2**31), 2**31 - 1, fastest=1000.0)
    counter.take(100_000, 0.0)
    counter.suspend()
    counter.take(0, 0.004)
    counter.resume("")
    counter.take(1, 0.008)
    assert counter.jump == 0.0
    assert not counter.doubt


def test_a_drive_that_restarts_after_a_crossing_has_lost_its_turns() -> None:
    counter = PositionCounter(0, 4095)
    counter.take(4000, 0.0)
    counter.restart("")
    counter.take(3, 0.1)
    assert (counter.doubt, counter.offset) == ("", 0)
    counter.take(4000, 0.2)
    assert counter.offset == -4096
    assert counter.take(4001, 0.3) == -95
    counter.restart("")
    assert counter.take(7, 0.4) == 7
    assert "wrapped" in counter.doubt


def frames_of(made: HandMade, count: int, velocity: int = 0) -> None:
    """A whole answer with 6064h as the drive shows it."""
    made.begin()
    made.bus.deliver(0x180 + NODE, struct.pack("<Hib", ENABLED, count, 9))
    made.bus.deliver(0x280 + NODE, struct.pack("<ihH", velocity, 0, 0))


@pytest.mark.parametrize("way", [1, -1])
def test_an_axis_counts_on_over_three_ends_of_32_bits(way: int) -> None:
    """Each step is a quarter of the range; twelve of them cross the end three times."""
    made = HandMade()
    step = way * 2**30
    for number in range(13):
        frames_of(made, shown(number * step, *I32))
        feedback = made.axis.feedback
        assert feedback.angle == pytest.approx(number * step * SCALE.angle, rel=1e-12)
        assert feedback.shown == shown(number * step, *I32)
        assert made.axis.position_doubt == ""


def test_a_velocity_mode_goes_on_beyond_the_end() -> None:
    """607Ah cannot hold the angle; it is not sent in CSV, so nothing is converted."""
    made = HandMade(rpdo=(RPDO[0], codec(2, 0x607A)))
    for number in range(9):
        frames_of(made, shown(number * 2**30, *I32))
        made.bus.sent.clear()
        made.axis.send(RequestedState.ENABLE, velocity=1.0)
        assert [identifier for identifier, _ in made.bus.sent] == [0x200 + NODE]
    assert made.bus.sent[-1][1] == struct.pack("<Hi", 0x0F, 1000)


def test_a_mapped_target_position_holds_what_the_drive_shows() -> None:
    """607Ah stands in the same RPDO as 60FFh here: it gets the drive's own count, which fits."""
    made = HandMade(rpdo=(codec(1, 0x6040, 0x60FF), codec(2, 0x607A, 0x6060)))
    for number in range(9):
        frames_of(made, shown(number * 2**30, *I32))
        made.bus.sent.clear()
        made.axis.send(RequestedState.ENABLE, velocity=-1.0)
        sent = dict(made.bus.sent)
        assert sent[0x300 + NODE] == struct.pack("<ib", shown(number * 2**30, *I32), 9)


@pytest.mark.parametrize("angle", [2.2e6, -2.2e6, math.nan, math.inf])
def test_a_position_mode_does_not_cross_the_end(angle: float) -> None:
    """2.2e6 rad are 2.2e9 counts here, beyond 2^31."""
    made = HandMade(mode="CSP")
    frames_of(made, 0)
    with pytest.raises(NotPermitted):
        made.axis.permit_angle(angle)
    with pytest.raises(NotPermitted):
        made.axis.send(RequestedState.ENABLE, angle=angle)
    made.axis.permit_angle(2.1e6)


def unsigned(folder: Path, *indices: int) -> Path:
    """The generic EDS with some objects declared UNSIGNED32."""
    text = (catalog.find("devices", "generic-cia402").parent / "generic-cia402.eds").read_text()
    for index in indices:
        begin = text.index(f"[{index:04X}]\n")
        end = text.index("\n\n", begin)
        text = text[:begin] + text[begin:end].replace("0x0004", "0x0007") + text[end:]
    path = folder / "unsigned.eds"
    path.write_text(text)
    return path


def test_an_unsigned_60ffh_is_written_as_twos_complement(tmp_path: Path) -> None:
    """Roboteq's EDS files declare it UNSIGNED32; -1000 is FFFF FC18h on the bus, RPDO and SDO."""
    bus = Bus(Clock())
    node = SdoNode(bus, NODE, unsigned(tmp_path, 0x60FF, 0x6064))  # type: ignore[arg-type]
    assert node.dictionary[0x60FF].data_type == 7
    spec = PdoSpec(1, ("0x6040", "0x60FF"))
    made = HandMade(
        rpdo=(PdoCodec(spec, [node.mapped(0x6040, 0), node.mapped(0x60FF, 0)]),),
        tpdo=(
            PdoCodec(TPDO[0].spec, [node.mapped(index, 0) for index in (0x6041, 0x6064, 0x6061)]),
            TPDO[1],
        ),
    )
    frames_of(made, -5)
    assert made.axis.feedback.angle == pytest.approx(-5 * SCALE.angle)
    made.axis.send(RequestedState.ENABLE, velocity=-1.0)
    assert made.bus.sent[-1] == (0x200 + NODE, bytes.fromhex("0f0018fcffff"))
    written: list[bytes] = []
    node.download = lambda _index, _sub, data: written.append(data)  # type: ignore[method-assign]
    node.write(0x60FF, 0, -1000)
    assert written == [bytes.fromhex("18fcffff")]
    with pytest.raises(NotPermitted, match="does not fit into its 32 bits"):
        node.write(0x60FF, 0, 2**31)
    node.write(0x1400, 1, 0x80000201)
    assert written[-1] == bytes.fromhex("01020080")


def test_a_speed_beyond_the_range_is_refused_by_name() -> None:
    made = HandMade()
    frames_of(made, 0)
    with pytest.raises(NotPermitted, match="beyond the drive's range"):
        made.axis.send(RequestedState.ENABLE, velocity=3e6)


DRIVES = drives()


@pytest.mark.parametrize("name", DRIVES)
def test_live_measurements_agree_in_the_units_of_every_shipped_drive(name: str) -> None:
    for number, shown in enumerate(FILTERS.values()):
        assert false_ones(DRIVES[name], shown, 60.0, seed=number) == 0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["generic-cia402", "maxon-epos4"])
def test_the_smallest_jump_and_the_slowest_motion_are_those_of_the_safety_page(name: str) -> None:
    rpm = name == "maxon-epos4"
    scale = DRIVES[name]
    assert smallest_jump(scale, 0.0) <= (3.15e-3 if rpm else 3.05e-3)
    assert smallest_jump(scale, SPEED) <= (6.25e-3 if rpm else 5.75e-3)
    assert slowest(scale) <= (4.8e-3 if rpm else 0.85e-3)


@settings(max_examples=50, deadline=None)
@given(
    speed=st.floats(0.02, SPEED).flatmap(lambda v: st.sampled_from([v, -v])),
    multiple=st.sampled_from([-1.0, 0.0, 0.5, 0.8, 1.25, 2.0, 10.0]),
    before=st.floats(0.0, 6.0),
)
def test_a_counter_that_counts_another_multiple_is_seen(
    speed: float, multiple: float, before: float
) -> None:
    """Within 4 s, and within 20 mm where it is wrong by a factor of two or more.

    The tolerance of a speed that never changed is 0.15 rad/s for 4 s, and 0.06 rad of a late one.
    """
    assume(4.0 * abs(speed) / RADIUS * (abs(multiple - 1.0) - 0.05) > 0.7)
    compare = agreement_of(DRIVES["generic-cia402"])
    velocity, angle, now = speed / RADIUS, 0.0, 0.0
    while now < before:
        now, angle = now + CYCLE, angle + velocity * CYCLE
        assert not compare.take(now, angle, velocity)
    begun = now
    while not compare.take(now, angle, velocity):
        now, angle = now + CYCLE, angle + multiple * velocity * CYCLE
        assert now < begun + 4.2
    far = multiple in (-1.0, 0.0, 2.0, 10.0)
    assert not far or abs(speed) * (now - begun) < 0.02 + abs(speed) * 0.1


def test_an_unknown_speed_can_be_compared_with_nothing() -> None:
    compare = agreement_of(DRIVES["generic-cia402"])
    assert not any(compare.take(k * CYCLE, float(k), math.nan) for k in range(1000))
    assert not any(compare.take(4 + k * CYCLE, 1000.0, 0.0) for k in range(1000))
    assert compare.take(8.0, 1001.0, 0.0) is False, "a late speed would explain it"
    assert any(compare.take(8.0 + k * CYCLE, 1001.0, 0.0) for k in range(1, 20))


def test_a_homing_and_a_reset_begin_anew() -> None:
    compare = agreement_of(DRIVES["generic-cia402"])
    for k in range(100):
        compare.take(k * CYCLE, 0.0, 0.0)
    compare.suspend()
    assert not any(compare.take(k * CYCLE, 50.0, 0.0) for k in range(100, 200))
    compare.resume()
    assert not any(compare.take(k * CYCLE, 50.0, 0.0) for k in range(200, 300))
    assert any(compare.take(k * CYCLE, 60.0, 0.0) for k in range(300, 400))
    assert str(compare.found).startswith("6064h changed by 1.592 turns of the motor within")
    compare.forget()
    assert not any(compare.take(k * CYCLE, 60.0, 0.0) for k in range(400, 500))


@settings(max_examples=50, deadline=None)
@given(
    span=st.floats(0.02, 0.2),
    begun=st.floats(0.3, 1.0),
    turned=st.just(1.0) | st.floats(-1.0, 0.5),
)
def test_a_gap_in_the_feedback_hides_no_wrong_counter(
    span: float, begun: float, turned: float
) -> None:
    """A jog speeds up from 0.4 s on, and stands again at 1.2 s; nothing is heard for a while."""
    compare = agreement_of(DRIVES["generic-cia402"])
    angle, speed, found = 0.0, 0.0, False
    for k in range(300):
        now = k * CYCLE
        ramp = min(now - 0.4, 1.2 - now) * ACCELERATION
        speed = min(max(ramp, 0.0), SPEED) / RADIUS
        angle += (1.0 if now < 0.4 else turned) * speed * CYCLE
        if not begun < now < begun + span:
            found = compare.take(now, angle, speed)
    assert found == (turned != 1.0)
