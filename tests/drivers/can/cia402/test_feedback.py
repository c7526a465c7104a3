"""Feedback from TPDOs: complete, of one SYNC, never extended beyond what was received."""

from __future__ import annotations

import itertools
import math
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hand_made import CYCLE, NODE, RPDO, SCALE, TPDO, HandMade, codec
from winchkit.drivers.can.cia402.feedback import Gathering, check_feedback
from winchkit.drivers.can.cia402.state_machine import DriveState, RequestedState, StatusBit
from winchkit.errors import FileError

ENABLED, READY, DISABLED = 0x0237, 0x0231, 0x0250


def test_all_of_an_answer_in_si() -> None:
    made = HandMade()
    made.answer(ENABLED | 0x0C00, angle=12.5, velocity=-3.25, torque=0.75, error=0x8611)
    feedback = made.axis.feedback
    assert (feedback.angle, feedback.velocity) == (12.5, -3.25)
    assert feedback.torque == pytest.approx(0.75)
    assert (feedback.state, feedback.error_code) == (DriveState.OPERATION_ENABLED, 0x8611)
    assert feedback.limited
    assert feedback.status & StatusBit.TARGET_REACHED


def test_an_answer_of_which_a_part_came_late_is_not_torn() -> None:
    """TPDO 2 of SYNC 1 comes after SYNC 2: it is not paired with TPDO 1 of SYNC 2."""
    made = HandMade()
    made.begin()
    made.first(ENABLED, angle=1.0)
    made.begin()
    made.second(velocity=1.0)
    made.first(ENABLED, angle=2.0)
    assert made.axis.feedback is None
    made.second(velocity=2.0)
    assert (made.axis.feedback.angle, made.axis.feedback.velocity) == (2.0, 2.0)
    assert (made.axis.health.torn, made.axis.health.missed) == (1, 1)


def test_an_answer_that_came_wholly_late_is_followed_by_the_right_one() -> None:
    made = HandMade()
    made.begin()
    made.begin()
    for angle in (1.0, 2.0):
        made.first(ENABLED, angle=angle)
        made.second(velocity=angle)
    assert (made.axis.feedback.angle, made.axis.feedback.velocity) == (2.0, 2.0)
    assert (made.axis.health.late, made.axis.health.torn) == (1, 0)


def test_a_drive_that_answers_in_another_order_is_understood() -> None:
    made = HandMade()
    for angle in (1.0, 2.0, 3.0):
        made.begin()
        made.second(velocity=angle)
        made.first(ENABLED, angle=angle)
    assert made.axis.feedback.angle == 3.0
    made.answer(ENABLED, angle=4.0)
    assert made.axis.feedback.angle == 3.0, "the order of numbers is now the wrong one"


@pytest.mark.parametrize("order", list(itertools.permutations((1, 2, 3))))
def test_any_order_of_three_is_learnt(order: tuple[int, int, int]) -> None:
    three = (codec(1, 0x6041, 0x6064), codec(2, 0x606C), codec(3, 0x6077))
    frames = {1: struct.pack("<Hi", ENABLED, 0), 2: bytes(4), 3: bytes(2)}
    gathering = Gathering(three, SCALE, CYCLE)
    receivers = {item.spec.number: gathering.receiver(item) for item in three}
    for sync in range(1, 6):
        gathering.begin(sync, float(sync))
        for number in order:
            receivers[number](frames[number], sync + 0.001)
    assert gathering.feedback.sync == 5
    assert gathering.health.complete >= 3


def test_lost_frames_are_counted_and_nothing_is_made_of_the_rest() -> None:
    made = HandMade()
    made.answer(ENABLED, angle=1.0)
    for lost in ("first", "second", "both"):
        made.begin()
        if lost != "first" and lost != "both":
            made.first(ENABLED, angle=9.0)
        if lost != "second" and lost != "both":
            made.second(velocity=9.0)
    made.begin()
    assert (made.axis.feedback.angle, made.axis.feedback.sync) == (1.0, 1)
    assert made.axis.health.missed == 3
    assert made.axis.health.complete == 1


REQUESTED_STATES = (
    RequestedState.ENABLE,
    RequestedState.RUN_DOWN,
    RequestedState.HALT,
    RequestedState.DISABLE,
)
STATUS = st.sampled_from([ENABLED, 0x0233, READY, DISABLED, 0x0217, 0x0218]) | st.integers(
    0, 0xFFFF
)


@pytest.mark.slow
@given(
    events=st.lists(
        st.tuples(
            st.sampled_from(["sync", "first", "second", "garbage", "boot", "beat", "requested"]),
            STATUS,
            st.integers(0, 7),
        ),
        max_size=80,
    )
)
@settings(max_examples=300, deadline=None)
def test_no_frames_make_a_drive_enabled_that_does_not_say_so(
    events: list[tuple[str, int, int]],
) -> None:
    """It counts as enabled only by a status word that says so, in a whole answer since it
    booted; a ramp is kept up only by one of the last five SYNCs.
    """
    made, requested, said, booted = HandMade(), RequestedState.ENABLE, set[int](), False
    for kind, status, number in events:
        booted = booted or kind == "boot"
        if kind == "sync":
            made.begin()
        elif kind == "first":
            made.first(status)
            said.add(status)
        elif kind == "second":
            made.second()
        elif kind == "garbage":
            made.bus.deliver(0x180 + NODE, struct.pack("<Hi", ENABLED, 0)[: min(number, 6)])
        elif kind == "requested":
            requested = REQUESTED_STATES[number % len(REQUESTED_STATES)]
        else:
            made.bus.deliver(0x700 + NODE, b"\0" if kind == "boot" else b"\x05")
        feedback, axis = made.axis.feedback, made.axis
        if axis.state is DriveState.OPERATION_ENABLED:
            assert feedback.status in said
            assert feedback.status & 0x6F == 0x27
            assert not booted
        word = axis.send(requested)
        if word & 0x0F == 0x0F:
            assert feedback is not None
            assert not axis.mapping_lost
            if requested is not RequestedState.ENABLE:
                assert requested is not RequestedState.DISABLE
                assert feedback.status & 0x6F == 0x27
                assert feedback.sync >= made.sync - 5


def test_a_ramp_is_not_kept_up_on_old_words() -> None:
    """0Fh goes out again while the status word is at most five SYNCs old, then 02h."""
    made = HandMade()
    made.enable()
    made.answer(ENABLED)
    words = [made.axis.send(RequestedState.RUN_DOWN)]
    for _ in range(7):
        made.begin()
        words.append(made.axis.send(RequestedState.RUN_DOWN))
    made.answer(ENABLED)
    words.append(made.axis.send(RequestedState.RUN_DOWN))
    assert words == [0x0F] * 6 + [0x02] * 3, "nor taken up again after a quick stop"


def test_what_a_drive_said_long_ago_is_not_accepted() -> None:
    made = HandMade()
    made.answer(ENABLED)
    made.begin()
    assert made.axis.state is DriveState.OPERATION_ENABLED
    for _ in range(math.ceil(0.1 / CYCLE) + 1):
        made.begin()
    assert made.axis.state is DriveState.UNKNOWN
    assert made.axis.send(RequestedState.ENABLE) == 0x02


def test_a_reboot_ends_all_belief_until_it_is_commissioned_again() -> None:
    made = HandMade()
    made.answer(ENABLED)
    made.bus.deliver(0x700 + NODE, b"\0")
    assert made.axis.mapping_lost
    assert not made.axis.operational
    made.answer(ENABLED)
    assert made.axis.state is DriveState.UNKNOWN
    assert made.axis.send(RequestedState.ENABLE, velocity=1.0) == 0x02


def slow(transmission: int, event_timer: float = 0.0) -> tuple[Gathering, object]:
    base = codec(2, 0x606C, transmission=transmission)
    spec = type(base.spec)(2, base.spec.objects, transmission, event_timer=event_timer)
    base.spec = spec
    return Gathering((TPDO[0], base), SCALE, CYCLE), base


@pytest.mark.parametrize(
    ("transmission", "event_timer", "kept"),
    [(5, 0.0, 15 * CYCLE), (255, 0.02, 0.06), (254, 0.0, math.inf), (0, 0.0, math.inf)],
)
def test_slower_tpdos_are_joined_until_they_are_too_old(
    transmission: int, event_timer: float, kept: float
) -> None:
    gathering, base = slow(transmission, event_timer)
    first, second = gathering.receiver(TPDO[0]), gathering.receiver(base)  # type: ignore[arg-type]
    second(struct.pack("<i", 1500), 10.0)
    ages = [0.0, 0.9 * min(kept, 100.0), 1.1 * min(kept, 100.0)]
    seen = []
    for sync, age in enumerate(ages, start=1):
        gathering.begin(sync, 10.0 + age)
        first(struct.pack("<Hib", ENABLED, 0, 9), 10.0 + age)
        assert gathering.feedback.sync == sync
        seen.append(gathering.feedback.velocity)
    assert seen[:2] == [1.5, 1.5]
    assert seen[2] == 1.5 if math.isinf(kept) else math.isnan(seen[2])


def test_a_speed_that_is_not_known_is_not_rest() -> None:
    made = HandMade(tpdo=(TPDO[0], codec(2, 0x606C, transmission=255)), rpdo=RPDO)
    made.begin()
    made.first(DISABLED)
    assert math.isnan(made.axis.feedback.velocity)
    assert not made.axis.at_rest


def test_the_moment_of_sampling_lies_between_sync_and_answer() -> None:
    made = HandMade()
    made.begin()
    sent = made.clock.time
    made.clock.time += 1e-3
    made.first(ENABLED)
    made.clock.time += 1e-3
    made.second()
    assert made.axis.feedback.time == pytest.approx(sent + 0.5e-3)


@pytest.mark.parametrize(
    ("tpdo", "words"),
    [
        ((codec(1, 0x6041, 0x6064),), "lacks 606Ch"),
        ((codec(1, 0x6041, 0x606C),), "lacks 6064h"),
        (
            (codec(1, 0x6041, transmission=255), codec(2, 0x6064, 0x606C)),
            "6041h has to come with every SYNC",
        ),
    ],
)
def test_mappings_without_state_or_position_are_refused(
    tpdo: tuple[object, ...], words: str
) -> None:
    with pytest.raises(FileError, match=words):
        check_feedback("drive", tpdo)  # type: ignore[arg-type]


def test_every_order_of_frames_of_two_syncs_gives_only_true_pairs() -> None:
    """Angle and velocity of one SYNC are equal here; no shuffle may mix them, once in order."""
    frames = [("sync", 1), ("first", 1), ("second", 1), ("sync", 2), ("first", 2), ("second", 2)]
    for order in itertools.permutations(frames):
        place = {frame: k for k, frame in enumerate(order)}
        if any(place[a, n] > place[b, n] for n in (1, 2) for a, b in PAIRS):
            continue
        if place["sync", 1] > place["sync", 2] or place["first", 1] > place["first", 2]:
            continue
        if place["second", 1] > place["second", 2] or place["second", 1] > place["first", 2]:
            continue
        made = HandMade()
        for kind, number in order:
            if kind == "sync":
                made.begin()
            elif kind == "first":
                made.first(ENABLED, angle=float(number))
            else:
                made.second(velocity=float(number))
            feedback = made.axis.feedback
            assert feedback is None or feedback.angle == feedback.velocity
        assert made.axis.feedback.angle == 2.0


PAIRS = (("sync", "first"), ("first", "second"))
