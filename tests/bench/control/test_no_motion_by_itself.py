"""Nothing moves again by itself: uncommanded changes are latched, a reset starts nothing."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fake_axis import CYCLE, Rig
from winchkit.bench.control.dead_man import DeadMan
from winchkit.bench.control.motion import Jog
from winchkit.bench.control.snapshot import Phase
from winchkit.drivers.can.cia402.state_machine import DriveState
from winchkit.errors import MotionError, NotPermitted
from winchkit.schema.bench import LimitSpec

LIMITS = LimitSpec(0.5, 1.0, (0.5, 9.0))


def moving_rig(speed: float = 0.2, names: str = "AB") -> Rig:
    rig = Rig(LIMITS, names)
    jog(rig, speed)
    rig.run(0.5)
    assert rig.speeds[-1] == pytest.approx(speed)
    return rig


def jog(rig: Rig, speed: float = 0.2) -> Jog:
    source = Jog(rig.cable(), rig.limits, speed, DeadMan(rig.now + 1e6))
    rig.controller().begin(source)
    return source


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
    rig = moving_rig()
    rig.axes["A"].state = state
    rig.step(3)
    assert kinds(rig) == ["state"]
    assert str(state) in rig.supervisor.tripped[0].message
    before = len(rig.axes["A"].words)
    for _ in range(40):
        jog(rig)
        rig.run(0.05)
    assert 0x0F not in rig.axes["A"].words[before:]
    assert 0x07 not in rig.axes["A"].words[before:]
    assert rig.axes["A"].velocity == 0.0


def test_a_drive_that_leaves_while_it_ramps_down_is_latched() -> None:
    rig = moving_rig()
    rig.controller().run_down()
    rig.step(5)
    rig.axes["A"].state = DriveState.SWITCHED_ON
    rig.step(3)
    assert kinds(rig) == ["state"]


def test_a_drive_that_somebody_else_enables_is_disabled_and_latched() -> None:
    rig = Rig(LIMITS, "AB")
    rig.axes["B"].state = DriveState.OPERATION_ENABLED
    rig.step(3)
    assert kinds(rig) == ["state"]
    assert rig.axes["B"].state is not DriveState.OPERATION_ENABLED
    rig.run(0.5)
    assert rig.controller("B").phase is Phase.DISABLED


def test_an_order_that_comes_with_the_trip_enables_nothing() -> None:
    rig = Rig(LIMITS, "AB")
    rig.axes["B"].state = DriveState.OPERATION_ENABLED
    jog(rig)
    rig.step(2)
    before = len(rig.axes["A"].words)
    rig.run(1.0)
    assert not {0x06, 0x07, 0x0F} & set(rig.axes["A"].words[before:])


def test_a_motor_that_turns_at_rest_is_latched_after_the_brake_has_settled() -> None:
    rig = Rig(LIMITS, "A")
    axis = rig.axes["A"]

    class Turned(type(axis)):  # type: ignore[misc]
        def begin_cycle(self, sync: int, now: float) -> None:
            super().begin_cycle(sync, now)
            self.velocity = 10.0
            self.feedback = self.feedback._replace(velocity=10.0)

    axis.__class__ = Turned
    rig.run(0.08)
    assert not kinds(rig)
    rig.run(0.05)
    assert kinds(rig) == ["motion at rest"]


def test_lost_targets_are_seen_once_the_dead_man_expires() -> None:
    """At constant speed nothing differs; from the release on it takes the response time."""
    rig = Rig(LIMITS, "A")
    source = jog(rig)
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
        jog(rig, speed)
        rig.run(0.8)
    assert kinds(rig) == []


def test_an_exception_in_the_loop_stops_every_drive_from_prepared_frames() -> None:
    rig = moving_rig()

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


def test_a_target_beyond_the_drives_range_is_a_trip_of_that_winch() -> None:
    rig = moving_rig()
    send = rig.axes["A"].send

    def refuses(requested: object, **keys: float) -> int:
        if keys.get("velocity"):
            raise NotPermitted("motor angle 1e9 rad is beyond the drive's range")
        return send(requested, **keys)  # type: ignore[arg-type]

    rig.axes["A"].send = refuses  # type: ignore[method-assign, assignment]
    rig.step(2)
    assert kinds(rig) == ["target"]
    rig.run(1.0)
    assert rig.axes["A"].state is DriveState.SWITCH_ON_DISABLED


def test_a_stall_of_this_computer_is_named_and_no_device_is_blamed() -> None:
    rig = moving_rig()
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
    rig = moving_rig()
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


def test_a_recorder_that_fails_is_a_warning_and_stops_nothing() -> None:
    rig = moving_rig()

    def full(_snapshot: object) -> None:
        raise OSError(28, "No space left on device")

    rig.loop.samplers.append(full)
    rig.step(3)
    assert not kinds(rig)
    assert rig.loop.snapshot is not None
    assert "No space left" in str(rig.loop.snapshot.warnings[0])
    assert rig.speeds[-1] == pytest.approx(0.2)


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
