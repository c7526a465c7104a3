"""Every fault of the table on a moving winch: stopped in time, cause named, latched until a reset.

The winch pays out at 0.1 m/s under a key that is held all the time, heartbeat 50 ms. What the
shaft does is read from the slave, not from what winchkit says.
A lost RPDO shows in nothing while the same speed is commanded: it is tested with the dead-man's
expiry.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest

from slave import State
from slave.cell import Cell
from slave.held_key import HeldKey, jogging, observe, since
from slave.rig import Rig, bench_text
from winchkit.bench.bench import Bench
from winchkit.bench.control.snapshot import Trip
from winchkit.errors import LimitTripped, MotionError, NoReply, NotPermitted

_RAMP, _BRAKE = 628.0, 100.0
"""6085h of the slave, and what its brake does without torque, rad/s^2."""
_WITHIN = 0.15
"""Of the first stop, s: a heartbeat of 50 ms, a consumer time of 2.5 beats."""
_DEVIATES = 0.28
"""A deviation is debounced by 0.25 s: no fault of communication (docs/safety.md)."""
_WATCHED = 1.0
"""In which a drive would start again by itself, s: 20 heartbeats, 3 times its longest time-out."""
_LAG = 0.03
"""Five time constants of the slave's velocity loop, s."""


@dataclass(frozen=True)
class Row:
    """A fault, and what should come of it."""

    fault: str
    value: Any = None
    cause: str = "."
    """Regular expression of the first message."""
    without_torque: bool = False
    """The drive loses its torque at once: the brake stops the shaft."""
    within: float = _WITHIN
    reset: bool = True
    """Whether a reset brings it back."""

    @property
    def name(self) -> str:
        return self.fault if self.value is None else f"{self.fault} {self.value}"


_LEFT = "left operation enabled without a command"
_ROWS = (
    Row("enable input open", cause=_LEFT, without_torque=True),
    Row("second master disables", cause=_LEFT, without_torque=True),
    Row("reboots", cause="restarted", without_torque=True, within=0.05),
    Row("reset by a stranger", cause="restarted|left operation|NMT", without_torque=True),
    Row("stopped by a stranger", cause="NMT|" + _LEFT),
    Row("pre-operational by a stranger", cause="pre-operational"),
    Row("goes pre-operational", cause="pre-operational"),
    Row("drive fault", cause="fault", within=0.02),
    Row("mode changed", cause="mode of operation", within=0.02),
    Row("sync unheard", cause="no complete feedback"),
    Row("host frames lost", cause="feedback|operational|NMT|left"),
    Row("heartbeat unheard", cause="NMT|operational|" + _LEFT),
    Row("tpdo lost", cause="no complete feedback"),
    Row("tpdo lost", {1}, cause="no complete feedback"),
    Row("tpdo lost", {2}, cause="no complete feedback"),
    Row("heartbeat lost", cause="heartbeat is gone"),
    Row("silent", cause="heartbeat is gone|no complete feedback"),
    Row("off the bus", cause="heartbeat is gone|no complete feedback"),
    Row("follows wrongly", -1.0, cause="the other way"),
    Row("follows wrongly", 0.0, cause="does not follow", within=_DEVIATES),
    Row("follows wrongly", 3.0, cause="faster than commanded|beyond limits.speed"),
)


_QUICK = ("enable input open", "stopped by a stranger", "drive fault", "host frames lost", "silent")
"""One of each kind is tried by default, the others with the whole suite."""


@pytest.mark.parametrize(
    "row",
    [
        pytest.param(row, id=row.name, marks=() if row.fault in _QUICK else pytest.mark.slow)
        for row in _ROWS
    ],
)
def test_a_fault_under_a_held_key(rig: Rig, row: Row) -> None:
    slave = rig.slaves[0]
    with rig.opened() as bench:
        key = jogging(rig, bench)
        start = rig.time
        slave.inject(row.fault, row.value)
        rig.wait(1.0)
        mended = rig.time
        slave.mend_all()
        rig.wait(_WATCHED)
        after = since(rig, mended)
        assert not after.moved, "it moved again by itself"
        assert not after.enabled, "it was enabled again by itself"
        seen = observe(rig, key, start)
        ramp = _BRAKE if row.without_torque else _RAMP
        assert re.search(row.cause, seen.cause), seen.cause
        assert seen.told < 0.5
        if row.reset:
            resets(rig, bench, key)
        key.release()
        rig.wait(0.5)
    assert seen.left <= row.within, f"left after {seen.left:.3f} s: {seen.cause}"
    assert seen.rest <= row.within + seen.speed / ramp + _LAG


def resets(rig: Rig, bench: Bench, key: HeldKey) -> None:
    """A reset under a held key starts nothing; a new press does."""
    bench.reset()
    start = rig.time
    rig.wait(_WATCHED)
    assert not since(rig, start).enabled, "enabled by a reset under a held key"
    key.release()
    rig.wait(1.0)
    again = rig.time
    fresh = HeldKey(rig, bench).press()
    rig.wait(1.0)
    assert since(rig, again).moved, fresh.errors
    fresh.release()
    rig.wait(1.5)
    assert rig.slaves[0].power.state is State.SWITCH_ON_DISABLED


@pytest.mark.parametrize("fault", ["second master enables", "enables itself"])
def test_enabled_by_somebody_else_at_rest_is_a_latched_trip(rig: Rig, fault: str) -> None:
    with rig.opened() as bench:
        rig.wait(0.5)
        start = rig.time
        rig.slaves[0].inject(fault)
        rig.wait(1.0)
        enabled = [s.time - start for s in since(rig, start).samples if s.state is State.ENABLED]
        assert enabled
        assert max(enabled) <= _WITHIN
        with pytest.raises(MotionError, match="enabled without a command"):
            bench.winch["A"].jog(pay_out=0.1)
        bench.reset()
        bench.winch["A"].move_by(pay_out=0.02)


def test_turning_while_disabled_is_a_latched_trip(rig: Rig) -> None:
    with rig.opened() as bench:
        rig.wait(0.5)
        rig.slaves[0].inject("turns while disabled", 5.0)
        rig.wait(0.5)
        rig.slaves[0].mend_all()
        rig.wait(0.5)
        with pytest.raises(LimitTripped, match="turns although rest is commanded"):
            bench.winch["A"].move_by(pay_out=0.02)
        bench.reset()
        bench.winch["A"].move_by(pay_out=0.02)


@pytest.mark.parametrize("fault", ["velocity stuck", "position stuck", "status frozen"])
def test_a_stuck_value_is_noticed_when_the_key_is_released(rig: Rig, fault: str) -> None:
    with rig.opened() as bench:
        key = jogging(rig, bench)
        start = rig.time
        rig.slaves[0].inject(fault)
        rig.wait(0.1)
        key.release()
        rig.wait(3.0)
        assert abs(rig.slaves[0].motor.velocity) < 0.1
        assert rig.slaves[0].power.state is not State.ENABLED, "it stays enabled"
        with pytest.raises(MotionError):
            bench.winch["A"].move_by(pay_out=0.02)
        assert since(rig, start).samples
        rig.slaves[0].mend_all()


@pytest.mark.parametrize("fault", ["rpdo unheard", "sync unheard", "host frames lost", "tpdo lost"])
def test_the_dead_man_expires_into_a_fault(rig: Rig, fault: str) -> None:
    with rig.opened() as bench:
        key = jogging(rig, bench)
        key.release()
        start = rig.time
        rig.slaves[0].inject(fault)
        rig.wait(2.0)
        seen = observe(rig, key, start)
        expires = 0.2
        assert seen.left <= expires + _WITHIN
        assert seen.rest <= expires + _WITHIN + seen.speed / _RAMP + _LAG


def test_an_over_tension_stops_winding_in_and_lets_it_out(rig: Rig) -> None:
    limits = {"tension_high": "200 N"}
    with rig.opened(bench_text(rig.channel, limits=limits)) as bench:
        tension = [100.0]
        Cell(rig, lambda: tension[0]).fit(bench)
        key = jogging(rig, bench, pay_out=-0.1)
        start = rig.time
        tension[0] = 250.0
        rig.wait(1.0)
        seen = observe(rig, key, start)
        assert seen.left <= 0.04
        assert "above tension_high" in seen.cause
        key.release()
        rig.wait(1.0)
        bench.reset()
        rig.wait(1.0)
        out = HeldKey(rig, bench, pay_out=0.1).press()
        rig.wait(1.0)
        assert abs(rig.slaves[0].motor.velocity) > 10
        out.release()
        rig.wait(1.0)


def test_an_emergency_without_a_fault_is_reported_and_trips_only_where_declared(
    rig: Rig,
) -> None:
    with rig.opened() as bench:
        key = jogging(rig, bench)
        rig.slaves[0].inject("emergency", 0x4210)
        rig.wait(0.5)
        assert abs(rig.slaves[0].motor.velocity) > 10, key.errors
        assert any("4210" in str(trip) for trip in bench.snapshot.warnings)
        key.release()
        rig.wait(1.0)


def test_a_reset_that_fails_leaves_the_latch(rig: Rig) -> None:
    slave = rig.slaves[0]
    with rig.opened() as bench:
        key = jogging(rig, bench)
        slave.inject("drive fault")
        rig.wait(1.0)
        key.release()
        rig.wait(1.0)
        with pytest.raises(MotionError):
            bench.reset()
        slave.mend_all()
        rig.wait(1.0)
        start = rig.time
        again = HeldKey(rig, bench).press()
        rig.wait(1.0)
        assert not since(rig, start).enabled
        again.release()
        bench.reset()
        rig.wait(1.0)
        bench.winch["A"].move_by(pay_out=0.02)


@pytest.mark.parametrize("same_kind", [False, True])
def test_what_trips_during_a_reset_after_the_drives_were_looked_at_stays(
    rig: Rig, *, same_kind: bool
) -> None:
    with rig.opened() as bench:
        rig.from_stranger(0x000, b"\x02\x01")
        rig.wait(0.3)
        supervisor = bench.loop.supervisor
        acknowledge, late = supervisor.acknowledge, Trip("bus", "", "cannot send", latches=True)
        if same_kind:
            first = bench.snapshot.tripped[0]
            late = replace(late, kind=first.kind, winch=first.winch)

        def then_trip(boot_ups: Mapping[str, int]) -> tuple[Trip, ...]:
            rig.clock.call_at(rig.time + 0.006, lambda: supervisor.latch(late))
            return acknowledge(boot_ups)

        supervisor.acknowledge = then_trip  # type: ignore[method-assign]
        with pytest.raises(LimitTripped, match=r"tripped anew during the reset: .*cannot send"):
            bench.reset()
        rig.wait(0.1)
        assert bench.snapshot.tripped == (late,)
        supervisor.acknowledge = acknowledge  # type: ignore[method-assign]
        kept = json.loads(Path(bench.loop._latch.path).read_text(encoding="utf-8"))
        assert [row["kind"] for row in kept["tripped"]] == [late.kind], "for later processes, too"
        assert bench.reset() == [str(late)]
        bench.winch["A"].move_by(pay_out=0.02)


def test_a_reset_says_what_tripped_while_it_set_drives_up(rig: Rig) -> None:
    with rig.opened() as bench:
        rig.from_stranger(0x000, b"\x02\x01")
        rig.wait(0.3)
        late = Trip("bus", "", "cannot send", latches=True)
        rig.clock.call_at(rig.time + 0.1, lambda: bench.loop.supervisor.latch(late))
        cleared = bench.reset()
        assert "cannot send" in cleared
        assert not any("boot" in words for words in cleared), "of which the reset is the cause"


@pytest.mark.parametrize("boot_time", [0.02, 0.3, 0.8])
def test_a_drive_that_restarts_during_a_reset_is_set_up_anew(boot_time: float, rig: Rig) -> None:
    """Its last feedback, operation enabled, is no motion to wait for."""
    slave = rig.slaves[0]
    with rig.opened() as bench:
        key = jogging(rig, bench)
        slave.network.boot_time = boot_time
        slave.inject("reboots")
        key.release()
        rig.wait(0.002)
        start = rig.time
        try:
            bench.reset()
        except NoReply:
            assert boot_time > 0.5, "an SDO client waits as long"
            assert rig.time - start < 2.0
            with pytest.raises(LimitTripped):
                bench.winch["A"].jog(pay_out=0.1)
            rig.wait(1.0)
            bench.reset()
        assert not since(rig, start).enabled
        assert slave.objects.get(0x1A00, 0), "mapped anew"
        bench.winch["A"].move_by(pay_out=0.02)


@pytest.mark.parametrize("moving", [False, True])
def test_a_position_that_jumps_ends_the_motion_and_is_unknown_until_homed(
    moving: bool, rig: Rig
) -> None:
    slave = rig.slaves[0]
    with rig.opened() as bench:
        winch = bench.winch["A"]
        if moving:
            key = jogging(rig, bench)
        start = rig.time
        slave.inject("position wraps", 1000)
        rig.wait(0.5)
        assert [trip.kind for trip in bench.snapshot.tripped] == ["position"]
        if moving:
            key.release()
            seen = observe(rig, key, start)
            assert "turns of the motor from one answer to the next" in seen.cause
            assert seen.left <= _WITHIN
        angle = slave.motor.angle
        with pytest.raises(LimitTripped, match="latched"):
            winch.jog(pay_out=0.1)
        bench.reset()
        rig.wait(1.0)
        for motion in (winch.jog, winch.move_by):
            with pytest.raises(NotPermitted, match="home"):
                motion(pay_out=0.05)
        rig.wait(0.5)
        assert slave.motor.angle == pytest.approx(angle, abs=0.05), "nothing has moved since"
        winch.home(at=2.0)
        winch.move_by(pay_out=0.02)
        assert winch.cable_length == pytest.approx(2.02, abs=2e-3)


def test_a_stall_of_this_computer_is_named(rig: Rig) -> None:
    with rig.opened() as bench:
        key = jogging(rig, bench)
        start = rig.time
        rig.clock.stall(1.0)
        rig.wait(2.0)
        seen = observe(rig, key, start)
        assert "this computer stood still for 1.0" in seen.cause
        assert seen.left <= _WITHIN, "the drive's own watchdog"
        key.release()
        rig.wait(0.5)


@dataclass(frozen=True)
class LoopFault:
    """Something that the control loop raises."""

    name: str
    break_: Callable[[Bench], None]


def _unsigned_target(bench: Bench) -> None:
    """60FFh is UNSIGNED32 in five makers' files: a negative speed does not fit."""

    def encode(*_: Any) -> bytes:
        raise OverflowError("can't convert negative int to unsigned")

    commander = bench.axes["A"]._commander
    commander.frames = encode  # type: ignore[method-assign, assignment]


def _snapshot(bench: Bench) -> None:
    def picture(*_: Any) -> None:
        raise ZeroDivisionError("float division by zero")

    bench.loop._picture = picture  # type: ignore[method-assign, assignment]


def _supervisor(bench: Bench) -> None:
    def check(*_: Any) -> None:
        raise KeyError("A")

    bench.loop.supervisor.check = check  # type: ignore[method-assign, assignment]


@pytest.mark.parametrize("break_", [_unsigned_target, _snapshot, _supervisor])
def test_an_exception_in_the_control_loop_stops_the_drive_and_is_named(
    rig: Rig, break_: Callable[[Bench], None]
) -> None:
    with rig.opened() as bench:
        key = jogging(rig, bench)
        start = rig.time
        break_(bench)
        rig.wait(1.0)
        seen = observe(rig, key, start)
        assert seen.left <= 0.02
        assert seen.rest <= 0.02 + seen.speed / _RAMP + _LAG
        assert re.search("OverflowError|ZeroDivisionError|KeyError", seen.cause), seen.cause
        # What was measured before the failure is shown no longer; the power state is that of now.
        winch = bench.snapshot.winch["A"]
        assert math.isnan(winch.cable_speed)
        assert math.isnan(winch.cable_length)
        assert winch.state not in {"", "operation enabled"}
        key.release()
        rig.wait(0.5)
    with rig.opened() as again, pytest.raises(LimitTripped, match="control loop failed"):
        again.winch["A"].jog(pay_out=0.1)


def test_a_drive_stopped_by_another_master_comes_back_with_a_reset(rig: Rig) -> None:
    with rig.opened() as bench:
        rig.from_stranger(0x000, b"\x02\x01")
        rig.wait(0.5)
        with pytest.raises(LimitTripped, match="stopped"):
            bench.winch["A"].move_by(pay_out=0.02)
        bench.reset()
        bench.winch["A"].move_by(pay_out=0.02)
    rig.from_stranger(0x000, b"\x02\x01")
    rig.wait(0.1)
    with rig.opened() as bench:
        bench.winch["A"].move_by(pay_out=0.02)


def test_the_latch_outlives_a_killed_process(rig: Rig) -> None:
    bench = rig.open()
    key = jogging(rig, bench)
    rig.slaves[0].inject("second master disables")
    rig.wait(0.5)
    key.release()
    rig.kill(bench)
    rig.wait(1.0)
    with rig.opened() as again:
        with pytest.raises(LimitTripped, match="left operation enabled"):
            again.winch["A"].jog(pay_out=0.1)
        again.reset()
        again.winch["A"].move_by(pay_out=0.02)
    assert not Path(again.spec.latch_file).exists()


@pytest.mark.parametrize("turned", [0.6, -0.6])
def test_a_brake_that_lets_the_load_creep_is_noticed(rig: Rig, turned: float) -> None:
    """At 1.8 mm/s of cable: below every speed that counts as a motion at rest."""
    with rig.opened() as bench:
        for length in (3.0, 4.0, 3.0):  # another zero is no motion
            bench.winch["A"].home(at=length)
            rig.wait(1.0)
        assert not bench.snapshot.tripped
        begun = rig.slaves[0].motor.angle
        rig.slaves[0].inject("turns while disabled", turned)
        rig.until(lambda: bool(bench.snapshot.tripped), within=30.0)
        assert "since rest was commanded" in str(bench.snapshot.tripped[0])
        assert abs(rig.slaves[0].motor.angle - begun) * 3e-3 == pytest.approx(0.02, abs=2e-3)
        rig.slaves[0].mend_all()
        bench.reset()
        rig.wait(1.0)
        bench.winch["A"].move_by(pay_out=0.05)
        assert not bench.snapshot.tripped
