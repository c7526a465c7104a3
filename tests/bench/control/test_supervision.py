"""Every rule of the supervisor, through the loop, in simulated time."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fake_axis import CYCLE, Rig, moving_rig
from winchkit.bench.control.snapshot import Phase
from winchkit.drivers.can.cia402.state_machine import DriveState
from winchkit.drivers.reading import Quality
from winchkit.schema.bench import LimitSpec

LIMITS = LimitSpec(0.5, 1.0, (0.5, 9.0), tension_high=500.0, tension_slack=20.0)


def kinds(rig: Rig) -> set[str]:
    return {trip.kind for trip in rig.supervisor.tripped}


def assert_all_stopped(rig: Rig) -> None:
    rig.run(3.0)
    for name, axis in rig.axes.items():
        assert rig.controller(name).phase in (Phase.DISABLED, Phase.STOPPING)
        assert axis.state is not DriveState.OPERATION_ENABLED or not axis.alive


@pytest.mark.parametrize("victim", ["A", "B"])
def test_a_silent_drive_stops_every_winch(victim: str) -> None:
    rig = moving_rig(LIMITS)
    rig.axes[victim].alive = False
    rig.run(0.1)
    assert "feedback" in kinds(rig)
    rig.run(0.2)
    assert "heartbeat" in kinds(rig)
    assert_all_stopped(rig)


def test_a_reboot_is_latched_even_while_nothing_moves() -> None:
    rig = Rig(LIMITS, "AB")
    rig.axes["B"].heartbeat.receive(b"\x00", rig.now)
    rig.step()
    assert kinds(rig) == {"boot-up"}
    rig.supervisor.acknowledge({"A": 0, "B": 1})
    rig.supervisor.clear()
    rig.run(0.1)
    assert not kinds(rig)


@pytest.mark.parametrize(
    ("attribute", "value", "kind"), [("operational", False, "nmt"), ("mode_kept", False, "mode")]
)
def test_a_drive_that_changes_by_itself_stops_all(attribute: str, value: bool, kind: str) -> None:
    rig = moving_rig(LIMITS)
    setattr(rig.axes["B"], attribute, value)
    rig.step(2)
    assert kind in kinds(rig)
    assert_all_stopped(rig)


def test_a_drive_fault_stops_all_and_says_which() -> None:
    rig = moving_rig(LIMITS)
    rig.axes["B"].state = DriveState.FAULT
    rig.axes["B"].fault_text = "error 8611h following error"
    rig.step(3)
    assert "8611h following error" in str(rig.supervisor.tripped[0])
    assert "winch B" in str(rig.supervisor.tripped[0])
    assert_all_stopped(rig)


@pytest.mark.parametrize("idle_winch", [False, True])
def test_a_stale_cell_stops_all(idle_winch: bool) -> None:
    rig = moving_rig(LIMITS)
    rig.tension["B" if idle_winch else "A"] = None
    rig.run(0.2)
    assert not kinds(rig)
    rig.run(0.1)
    assert kinds(rig) == {"cell stale"}
    assert_all_stopped(rig)


def test_a_cell_without_a_number_stops_at_once() -> None:
    rig = moving_rig(LIMITS)
    rig.tension["A"] = None
    rig.cells["A"].read(math.nan, rig.now, Quality.OVERLOAD)
    rig.step(2)
    assert kinds(rig) == {"cell"}
    assert "overload" in str(rig.supervisor.tripped[0])


def test_high_tension_stops_winding_in_but_lets_pay_out() -> None:
    rig = moving_rig(LIMITS, 0.2)
    rig.tension["A"] = 510.0
    rig.step(2)
    assert kinds(rig) == {"tension high"}
    out = moving_rig(LIMITS, -0.2, "A")
    out.tension["A"] = 510.0
    out.run(0.3)
    assert not kinds(out)
    assert out.speeds[-1] == pytest.approx(-0.2)


def test_slack_has_a_debounce_and_lets_wind_in() -> None:
    rig = moving_rig(LIMITS, -0.2)
    rig.tension["A"] = 5.0
    rig.run(0.18)
    assert not kinds(rig)
    rig.run(0.05)
    assert kinds(rig) == {"slack"}
    wind = moving_rig(LIMITS, 0.2, "A")
    wind.tension["A"] = 5.0
    wind.run(1.0)
    assert not kinds(wind)


def test_a_short_slack_is_forgotten() -> None:
    rig = moving_rig(LIMITS, -0.2)
    for _ in range(5):
        rig.tension["A"] = 5.0
        rig.run(0.15)
        rig.tension["A"] = 100.0
        rig.step()
    assert not kinds(rig)


def test_other_winches_may_not_move_while_one_is_overloaded() -> None:
    rig = moving_rig(LIMITS, -0.2)
    rig.tension["B"] = 510.0
    rig.step(2)
    assert kinds(rig) == {"tension high"}


def test_length_and_speed_beyond_the_limits_trip() -> None:
    rig = moving_rig(LIMITS, 0.2)
    rig.axes["A"].angle = 720.0
    rig.step(2)
    assert kinds(rig) == {"length"}
    fast = moving_rig(LIMITS, 0.2)
    fast.axes["A"].velocity = 200.0
    fast.step(1)
    assert kinds(fast) == {"speed"}


def test_trouble_without_motion_blocks_but_is_not_latched() -> None:
    rig = Rig(LIMITS)
    rig.tension["A"] = None
    rig.run(1.0)
    assert not kinds(rig)
    snapshot = rig.loop.snapshot
    assert {trip.kind for trip in snapshot.blocked} == {"cell stale"}


def test_a_trip_stays_until_it_is_reset() -> None:
    rig = moving_rig(LIMITS)
    rig.tension["A"] = 510.0
    rig.step(2)
    rig.tension["A"] = 100.0
    rig.run(2.0)
    assert kinds(rig) == {"tension high"}
    rig.supervisor.acknowledge({"A": 0, "B": 0})
    rig.supervisor.clear()
    rig.run(0.5)
    assert not kinds(rig)


def test_a_callback_that_raises_stops_all_and_is_kept() -> None:
    rig = moving_rig(LIMITS)

    def broken(_snapshot: object) -> None:
        raise ZeroDivisionError("user's own")

    rig.loop.callbacks.append(broken)
    rig.run(3.0)
    assert isinstance(rig.loop.failure, ZeroDivisionError)
    assert all(axis.state is DriveState.SWITCH_ON_DISABLED for axis in rig.axes.values())


def test_the_host_heartbeat_is_tied_to_the_loop() -> None:
    rig = Rig(LIMITS)
    before = rig.bus.beats
    rig.run(1.0)
    assert 19 <= rig.bus.beats - before <= 21


@settings(max_examples=50, deadline=None)
@given(
    tensions=st.lists(st.floats(-100, 900) | st.just(math.nan), min_size=5, max_size=60),
    speed=st.sampled_from([-0.3, 0.3]),
)
def test_never_winds_in_above_the_high_limit(tensions: list[float], speed: float) -> None:
    """Whatever the cell says: two cycles after a reading above the limit nothing winds in."""
    rig = Rig(LIMITS)
    rig.jog(speed)
    rig.run(0.4)
    for tension in tensions:
        rig.tension["A"] = None
        rig.cells["A"].read(tension, rig.now)
        rig.run(0.02)
        if math.isnan(tension) or (tension > 500 and speed > 0):
            assert rig.controller().phase in (Phase.STOPPING, Phase.DISABLED)


ARM = 0.005


def jogging(winding_speed: float, length: float = 4.0) -> Rig:
    """A winch that jogs for a long time at a steady speed, from a cable length (m)."""
    rig = Rig(LIMITS)
    rig.axes["A"].angle = (4.0 - length) / ARM
    rig.step(2)
    rig.jog(winding_speed)
    rig.run(0.3)
    return rig


def turned(rig: Rig, winding_speed: float) -> None:
    """From now on the motor turns at this speed whatever is commanded."""
    axis = rig.axes["A"]
    send = axis.send

    def overrule(*args: object, **kwargs: object) -> int:
        word = send(*args, **kwargs)  # type: ignore[arg-type]
        axis.velocity = winding_speed / ARM
        return word

    axis.send = overrule  # type: ignore[method-assign]


@pytest.mark.parametrize(
    ("commanded", "kind", "tension", "length"),
    [
        (-0.02, "length", 100.0, 0.48),
        (0.02, "length", 100.0, 9.02),
        (-0.02, "tension high", 510.0, 4.0),
        (0.02, "slack", 10.0, 4.0),
    ],
)
def test_the_measured_direction_counts(
    commanded: float, kind: str, tension: float, length: float
) -> None:
    rig = jogging(commanded, length)
    axis = rig.axes["A"]
    rig.tension["A"] = tension
    rig.run(0.25)
    assert not rig.supervisor.tripped, "the commanded direction is allowed"
    turned(rig, -1.2 * commanded)
    begun, angle = rig.now, axis.angle
    while not rig.supervisor.tripped and rig.now < begun + 1.0:
        rig.step()
    assert [trip.kind for trip in rig.supervisor.tripped] == [kind]
    way = abs(axis.angle - angle) * ARM
    assert 1.9e-3 < way < 2e-3 + 0.024 * 3 * CYCLE
    assert rig.now - begun >= 0.05
    rig.step(2)
    assert rig.controller().phase in (Phase.STOPPING, Phase.DISABLED)


@pytest.mark.parametrize("amplitude", [0.9e-3, 1.9e-3])
@pytest.mark.parametrize("frequency", [2.0, 8.0])
def test_an_elastic_load_may_bounce_while_an_overload_is_paid_out(
    amplitude: float, frequency: float
) -> None:
    """The motor is turned back by less than 2 mm again and again."""
    rig = jogging(-0.02)
    rig.tension["A"] = 510.0
    axis = rig.axes["A"]
    send = axis.send
    rate = 2 * math.pi * frequency

    def bounce(*args: object, **kwargs: object) -> int:
        word = send(*args, **kwargs)  # type: ignore[arg-type]
        axis.velocity += amplitude / 2 * rate * math.cos(rate * rig.now) / ARM
        return word

    axis.send = bounce  # type: ignore[method-assign]
    rig.run(3.0)
    assert not rig.supervisor.tripped
