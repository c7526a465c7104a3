"""Each method of the stop table is used when it is due, and only then; without it a test fails.

A winch that pays out under a held key gets a quick stop while its drive does not receive what the
method before say. Which method stopped it is read from the bus.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from slave import State
from slave.frames import Frame
from slave.held_key import jogging, observe
from slave.oracle import ESCALATED
from slave.rig import Rig
from winchkit.bench.control import stop_escalation
from winchkit.bench.control.stop_escalation import STOP_TABLE, StopMethod
from winchkit.errors import MotionError, WinchkitError

_RAMP, _LAG = 628.0, 0.03
_WITHIN = 0.15
"""Of the first stop, s."""
_SDO_STOP = bytes.fromhex("2b406000")
_NMT_STOP = bytes.fromhex("0201")
_BEAT = 0x77F
_DEAD_MAN, _RAMP_DOWN = 0.2, 0.3
"""Of a jog that is not repeated, and of the ramp from limits.speed, s."""


def _is_sdo_stop(frame: Frame) -> bool:
    """A download of 6040h = 02h, in any of the two ways to write its size."""
    head = frame.data[:4]
    return frame.identifier == 0x601 and head in (_SDO_STOP, b"\x22\x40\x60\x00")


def _is_nmt_stop(frame: Frame) -> bool:
    return frame.identifier == 0x000 and frame.data == _NMT_STOP


def _is_beat(frame: Frame) -> bool:
    return frame.identifier == _BEAT


@dataclass(frozen=True)
class Case:
    """What is not heard, and what has to be seen on the bus in the half second after the stop."""

    method: StopMethod
    unheard: tuple[str, ...]
    says: tuple[tuple[Callable[[Frame], bool], bool], ...]
    """Kinds of frames, and whether they come."""


CASES = (
    Case(StopMethod.PDO, (), ((_is_sdo_stop, False), (_is_nmt_stop, False), (_is_beat, True))),
    Case(
        StopMethod.SDO,
        ("rpdo unheard",),
        ((_is_sdo_stop, True), (_is_nmt_stop, False), (_is_beat, True)),
    ),
    Case(
        StopMethod.NMT,
        ("rpdo unheard", "sdo refused"),
        ((_is_sdo_stop, True), (_is_nmt_stop, True), (_is_beat, True)),
    ),
    Case(
        StopMethod.SILENCE,
        ("rpdo unheard", "sdo unheard", "nmt unheard"),
        ((_is_sdo_stop, True), (_is_beat, False)),
    ),
)


def stopped(folder: Path, case: Case) -> None:
    """A quick stop in this case: in time, and by this method."""
    rig = Rig(folder)
    slave = rig.slaves[0]
    with rig.opened() as bench:
        if case.method is StopMethod.NMT:
            # As after a commissioning that has seen the drive leave operation enabled on it.
            bench.axes["A"].take_commissioning(seen_stopping=True, stops_on_nmt=True)
        key = jogging(rig, bench)
        for name in case.unheard:
            slave.inject(name)
        rig.wait(0.05)
        start = rig.time
        key.release()
        bench.stop_now(wait=False)
        rig.wait(0.5)
        seen = observe(rig, key, start)
        frames = [frame for time, frame in rig.frames if time > start + 0.1 or not _is_beat(frame)]
        said = [(kind, any(kind(frame) for frame in frames)) for kind, _ in case.says]
        slave.mend_all()
        rig.wait(0.5)
    # Silence takes the consumer time of 2.5 heartbeats, from the last of them.
    within = _WITHIN + (0.125 if case.method is StopMethod.SILENCE else 0.0)
    assert seen.left <= within, f"left after {seen.left:.3f} s"
    assert seen.rest <= within + seen.speed / _RAMP + _LAG
    assert said == list(case.says)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.method.name)
def test_a_method_stops_the_drive_that_receives_none_before(tmp_path: Path, case: Case) -> None:
    stopped(tmp_path, case)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.method.name)
def test_a_method_that_is_switched_off_makes_a_test_fail(
    tmp_path: Path, case: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    table = tuple(row for row in STOP_TABLE if row.method is not case.method)
    monkeypatch.setattr(stop_escalation, "STOP_TABLE", table)
    with pytest.raises(AssertionError):
        stopped(tmp_path, case)


def test_every_method_has_a_case() -> None:
    assert {case.method for case in CASES} == {row.method for row in STOP_TABLE} == set(StopMethod)


def test_a_reset_during_a_motion_withholds_no_way_to_stop(rig: Rig) -> None:
    """Only silence stops a drive that follows no control word, also while a reset waits."""
    slave = rig.slaves[0]
    with rig.opened() as bench:
        jogging(rig, bench)
        slave.inject("control word unheeded")
        begin = rig.time
        with pytest.raises(WinchkitError):
            bench.reset()  # the jog is not repeated meanwhile: the dead-man expires
        enabled = [s.time for s in rig.samples[0] if s.state is State.ENABLED]
        assert max(enabled) - begin < _DEAD_MAN + _RAMP_DOWN + ESCALATED
        assert "does not obey the stop" in str(bench.snapshot.tripped)
        slave.mend_all()
        rig.wait(1.0)
        bench.reset()
        assert not bench.snapshot.tripped


@pytest.mark.parametrize("motion", ["move", "jog"])
def test_a_reset_ends_a_motion_by_a_ramp_and_says_so(rig: Rig, motion: str) -> None:
    with rig.opened() as bench:
        winch = bench.winch["A"]
        if motion == "jog":
            jogging(rig, bench)
        else:
            winch.move_to(winch.cable_length + 1.0, speed=0.1, wait=False)
            rig.wait(1.0)
        begin = rig.time
        assert bench.reset() == ["winch A: a motion under way"]
        enabled = [s.time for s in rig.samples[0] if s.state is State.ENABLED]
        assert max(enabled) - begin < _RAMP_DOWN + 0.1
        assert not bench.snapshot.tripped
        rest = winch.cable_length
        with pytest.raises(MotionError, match="stopped"):
            winch.wait() if motion == "move" else winch.refresh()
        rig.wait(0.5)
        assert winch.cable_length == pytest.approx(rest, abs=1e-4)


def test_a_stop_in_any_cycle_of_enabling_is_no_trip(rig: Rig) -> None:
    """In one of them the drive is enabled and has not shown it yet: it "left" that state."""
    with rig.opened() as bench:
        winch = bench.winch["A"]
        for number in range(12):
            winch.jog(pay_out=0.05, hold=1.0)
            rig.wait(number * bench.loop.cycle)
            bench.stop()
            assert not bench.snapshot.tripped, number
            rig.wait(1.0)


def test_targets_that_come_again_after_a_loss_move_no_faster_than_a_fifth_of_the_limit(
    rig: Rig,
) -> None:
    """The lag of a second was made up at limits.speed, which then tripped as a runaway."""
    with rig.opened() as bench:
        winch, speeds = bench.winch["A"], list[float]()
        limits = winch.wiring.limits
        bench.on_cycle(lambda seen: speeds.append(abs(seen.winch["A"].cable_speed)))
        speed = 0.4 * limits.speed
        winch.move_to(winch.cable_length + 1.5 * speed, speed=speed, wait=False)
        rig.until(lambda: abs(winch.snapshot.cable_speed) > 0.7 * speed)
        rig.host_mute = lambda frame: 0x200 <= frame.identifier < 0x280
        rig.wait(1.0)
        rig.host_mute = lambda _frame: False
        rig.wait(2.0)
        assert not bench.snapshot.tripped
        assert max(speeds) < speed + 0.22 * limits.speed
