"""Nothing moves again by itself: uncommanded changes are latched, a reset starts nothing."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fake_axis import CYCLE, Rig, moving_rig
from winchkit.bench.control.dead_man import DeadMan
from winchkit.bench.control.motion import Jog
from winchkit.bench.control.snapshot import Phase
from winchkit.drivers.can.cia402.state_machine import DriveState
from winchkit.errors import MotionError
from winchkit.schema.bench import LimitSpec

LIMITS = LimitSpec(0.5, 1.0, (0.5, 9.0))


def kinds(rig: Rig) -> list[str]:
    return [trip.kind for trip in rig.supervisor.tripped]


@pytest.mark.parametrize(
    "state",
    [
        DriveState.SWITCH_ON_DISABLED,
        DriveState.READY_TO_SWITCH_ON,
        DriveState.SWITCHED_ON,
        DriveState.QUICK_STOP_ACTIVE,
    ],
)
def test_a_drive_that_leaves_operation_enabled_is_latched(state: DriveState) -> None:
    rig = moving_rig(LIMITS)
    rig.axes["A"].state = state
    rig.step(3)
    assert kinds(rig) == ["state"]
    assert str(state) in rig.supervisor.tripped[0].message
    before = len(rig.axes["A"].words)
    for _ in range(40):
        rig.jog(0.2)
        rig.run(0.05)
    assert 0x0F not in rig.axes["A"].words[before:]
    assert 0x07 not in rig.axes["A"].words[before:]
    assert rig.axes["A"].velocity == 0.0


def test_a_drive_that_leaves_while_it_ramps_down_is_latched() -> None:
    rig = moving_rig(LIMITS)
    rig.controller().run_down()
    rig.step(5)
    rig.axes["A"].state = DriveState.SWITCHED_ON
    rig.step(3)
    assert kinds(rig) == ["state"]


def test_an_order_that_comes_with_the_trip_enables_nothing() -> None:
    rig = Rig(LIMITS, "AB")
    rig.axes["B"].state = DriveState.OPERATION_ENABLED
    rig.jog(0.2)
    rig.step(2)
    before = len(rig.axes["A"].words)
    rig.run(1.0)
    assert not {0x06, 0x07, 0x0F} & set(rig.axes["A"].words[before:])


def test_lost_targets_are_seen_once_the_dead_man_expires() -> None:
    """At constant speed nothing differs; from the release on it takes the response time."""
    rig = Rig(LIMITS, "A")
    source = rig.jog(0.2)
    rig.run(0.5)
    rig.axes["A"].hears_pdos = False
    rig.run(1.0)
    assert not kinds(rig)
    source.dead_man.end("released")
    released = rig.now
    while not kinds(rig):
        rig.step()
        assert rig.now - released < 0.15
    assert kinds(rig)[0] == "slowing down"
    while rig.axes["A"].state is DriveState.OPERATION_ENABLED:
        rig.step()
    assert rig.now - released < 0.15
    assert rig.axes["A"].sdo_stops >= 1
    rig.run(1.0)
    assert rig.axes["A"].velocity == 0.0


def test_a_sluggish_drive_is_not_taken_for_an_unresponsive_one() -> None:
    """A velocity loop whose time constant is just below half the response time."""
    rig = Rig(LIMITS, "A")
    axis = rig.axes["A"]
    send, lag = axis.send, 0.025

    def slow(*args: object, **keys: float) -> int:
        before = axis.velocity
        word = send(*args, **keys)  # type: ignore[arg-type]
        if axis.state is DriveState.OPERATION_ENABLED:
            axis.velocity = before + (axis.velocity - before) * 0.004 / lag
        return word

    axis.send = slow  # type: ignore[method-assign]
    for speed in (0.3, -0.2, 0.05, 0.3, 0.0):
        rig.jog(speed)
        rig.run(0.8)
    assert kinds(rig) == []


def test_an_exception_in_the_loop_stops_every_drive_from_prepared_frames() -> None:
    rig = moving_rig(LIMITS)

    def broken(*_: object) -> float:
        raise OverflowError("int too big to convert")

    rig.supervisor.check = broken  # type: ignore[method-assign, assignment]
    try:
        rig.loop.step(rig.now)
    except OverflowError as error:
        rig.loop.fail(error, rig.now)
    assert rig.axes["A"].words[-1] == 0x02
    assert rig.axes["A"].state is DriveState.QUICK_STOP_ACTIVE
    trip = rig.supervisor.tripped[0]
    assert trip.kind == "loop"
    assert "OverflowError: int too big to convert" in trip.message
    count = {name: len(axis.words) for name, axis in rig.axes.items()}
    for _ in range(250):
        rig.now += 0.004
        rig.loop.stop_step(rig.now)
    for name, axis in rig.axes.items():
        assert set(axis.words[count[name] :]) == {0x02}
        assert rig.controller(name).phase is Phase.DISABLED
    assert rig.loop.beating


def test_a_stall_of_this_computer_is_named_and_no_device_is_blamed() -> None:
    rig = moving_rig(LIMITS)
    rig.now += 1.0
    rig.loop.step(rig.now)
    assert kinds(rig) == ["computer"]
    assert "stood still for 1.0" in rig.supervisor.tripped[0].message
    rig.run(1.0)
    assert kinds(rig) == ["computer"]


@pytest.mark.parametrize(("since_the_beat", "named"), [(0.012, False), (0.040, True)])
def test_a_stall_at_rest_is_named_where_the_drives_have_missed_the_heartbeat(
    since_the_beat: float, named: bool
) -> None:
    """They count from the last heartbeat: 2.5 of 50 ms, not from the last cycle."""
    rig = Rig(LIMITS)
    sent = rig.bus.beats
    while rig.bus.beats == sent:
        rig.step()
    rig.run(since_the_beat)
    rig.now += 0.102
    rig.loop.step(rig.now)
    assert kinds(rig) == (["computer"] if named else [])


def test_a_short_standstill_makes_no_drive_silent() -> None:
    """80 ms after a heartbeat of a 100 ms old: the drive sent the next, which waits to be read."""
    rig = moving_rig(LIMITS)
    for axis in rig.axes.values():
        axis.heartbeat.timeout = 0.125
        axis.heartbeat.receive = lambda *_: None  # type: ignore[method-assign]
    rig.run(0.06)
    rig.now += 0.08
    rig.loop.step(rig.now)
    assert kinds(rig) == []
    for axis in rig.axes.values():
        axis.heartbeat.last = rig.now
    rig.run(0.1)
    assert kinds(rig) == []
    rig.run(0.1)
    assert kinds(rig) == ["heartbeat"] * 2, "a drive that stays silent is found"


@settings(max_examples=200)
@given(
    calls=st.lists(st.tuples(st.floats(0.0, 0.5), st.floats(0.001, 0.7)), max_size=30),
    looks=st.lists(st.floats(0.0, 0.3), min_size=30, max_size=30),
)
def test_a_permission_that_was_seen_to_have_expired_is_never_extended(
    calls: list[tuple[float, float]], looks: list[float]
) -> None:
    """Whatever refreshes come and whenever the loop looks: the plain rule of an unbroken chain."""
    now, expires, over = 10.0, 10.2, False
    dead_man = DeadMan(expires)
    for (gap, hold), look in zip(calls, looks, strict=False):
        now += gap
        if over or now >= expires:
            over = True
            with pytest.raises(MotionError):
                dead_man.refresh(now, now + hold)
        else:
            dead_man.refresh(now, now + hold)
            expires = now + hold
        now += look
        over = over or now >= expires
        assert dead_man.live(now) is not over


def test_what_was_ended_says_why() -> None:
    dead_man = DeadMan(10.2)
    dead_man.end("page 3 reset the bench")
    assert not dead_man.live(10.0)
    with pytest.raises(MotionError, match="page 3 reset the bench"):
        dead_man.refresh(10.0, 10.2)


@pytest.mark.parametrize("cycles", range(8))
def test_a_drive_is_not_enabled_for_a_permission_that_has_expired(cycles: int) -> None:
    """In none of the steps that lead to operation enabled."""
    rig = Rig(LIMITS, "A")
    expires = rig.now + (cycles + 0.5) * CYCLE
    rig.controller().begin(Jog(rig.cable(), LIMITS, 0.2, DeadMan(expires)))
    while rig.now < expires:
        rig.step()
    before, enabled = len(rig.axes["A"].words), rig.axes["A"].state is DriveState.OPERATION_ENABLED
    rig.run(1.0)
    assert rig.controller().phase is Phase.DISABLED
    assert not kinds(rig)
    if not enabled:
        assert not {0x06, 0x07, 0x0F} & set(rig.axes["A"].words[before:])
