"""Conditions on the bench as a whole, each on a moving winch; switched off, a test fails.

They trip in the control loop and not in the supervisor's table, so that switching one off means
that its trip (or its warning) is dropped.
"""

from __future__ import annotations

import runpy
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from slave import State
from slave.held_key import HeldKey, jogging, observe, since
from slave.rig import Rig, bench_text
from slave.wire import GENERIC
from snippets import ROOT
from winchkit.bench.bench import Bench
from winchkit.bench.control.loop import ControlLoop
from winchkit.bench.control.snapshot import Trip
from winchkit.bench.control.supervisor import Supervisor
from winchkit.bench.winch import Winch
from winchkit.errors import LimitTripped, MotionError, NotPermitted

_WITHIN = 0.15
"""s."""


def _unplug(rig: Rig, _bench: Bench) -> None:
    """The adapter refuses every frame; the drive's own watchdog has to stop it."""

    def refuse(*_: Any) -> None:
        raise OSError(19, "No such device")

    for port in rig.ports:
        port.transmit = refuse  # type: ignore[method-assign]


def _stall(rig: Rig, _bench: Bench) -> None:
    rig.clock.stall(0.2)


def _raise_in_loop(_rig: Rig, bench: Bench) -> None:
    def picture(*_: Any) -> None:
        raise ZeroDivisionError("float division by zero")

    bench.loop._picture = picture  # type: ignore[method-assign, assignment]


def _target_out_of_range(_rig: Rig, bench: Bench) -> None:
    commander = bench.axes["A"]._commander
    assert commander is not None

    def frames(*_: Any) -> None:
        raise NotPermitted("motor velocity -1e9 rad/s is beyond the drive's range")

    commander.frames = frames  # type: ignore[method-assign, assignment]


def _heed_nothing(rig: Rig, bench: Bench) -> None:
    rig.slaves[0].inject("control word unheeded")
    rig.slaves[0].inject("nmt unheard")
    bench.stop_now(wait=False)


def _lose_the_latch_file(rig: Rig, bench: Bench) -> None:
    """A trip that comes afterwards cannot be kept."""
    Path(bench.spec.latch_file).unlink()
    Path(bench.spec.latch_file).mkdir()
    rig.slaves[0].inject("second master disables")


def _speak_over(rig: Rig, _bench: Bench) -> None:
    """A second SYNC producer, e.g. a drive with bit 30 of 1005h."""

    def produce() -> None:
        if round(rig.time / 1e-3) % 10 == 0:
            rig.from_stranger(0x080, b"")

    rig.each.append(produce)


def _fail_to_record(_rig: Rig, bench: Bench) -> None:
    def sample(_snapshot: object) -> None:
        raise OSError(28, "No space left on device")

    bench.loop.samplers.append(sample)


@dataclass(frozen=True)
class Case:
    """How a condition comes about."""

    kind: str
    begin: Callable[[Rig, Bench], None]
    stops: bool = True
    within: float = _WITHIN


CASES = (
    Case("bus", _unplug),
    Case("computer", _stall),
    Case("loop", _raise_in_loop, within=0.02),
    Case("target", _target_out_of_range, within=0.02),
    Case("unresponsive", _heed_nothing, within=0.3),
    Case("latch file", _lose_the_latch_file, within=0.02),
    Case("sync", _speak_over, stops=False),
    Case("recorder", _fail_to_record, stops=False),
)


def happens(folder: Path, case: Case) -> None:
    """The condition on a winch that pays out: the report, and what the drive does."""
    rig = Rig(folder)
    bench = rig.open()
    try:
        key = jogging(rig, bench)
        start = rig.time
        case.begin(rig, bench)
        rig.wait(0.6)
        seen = observe(rig, key, start)
        snapshot = bench.snapshot
        told = {trip.kind for trip in (*snapshot.tripped, *snapshot.warnings)}
        key.release()
        rig.slaves[0].mend_all()
    finally:
        rig.kill(bench)
    assert case.kind in told, told
    assert (seen.left <= case.within) is case.stops, f"left after {seen.left:.3f} s"


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.kind)
def test_a_condition_on_the_bench_is_named_and_stops_it(tmp_path: Path, case: Case) -> None:
    happens(tmp_path, case)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.kind)
def test_a_condition_on_the_bench_that_is_switched_off_makes_a_test_fail(
    tmp_path: Path, case: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    latch, warn = Supervisor.latch, ControlLoop.warn

    def without(before: Callable[[Any, Trip], None]) -> Callable[[Any, Trip], None]:
        def drop(self: Any, trip: Trip) -> None:
            if trip.kind != case.kind:
                before(self, trip)

        return drop

    monkeypatch.setattr(Supervisor, "latch", without(latch))
    monkeypatch.setattr(ControlLoop, "warn", without(warn))
    with pytest.raises(AssertionError):
        happens(tmp_path, case)


ELSEWHERE = {
    *("tension control", "motion", "owner", "position record"),
    *("correction", "cable forces", "tracker age", "tracker jump", "tracker disagreement"),
}
"""Conditions of a motion that is no jog, of its end, and of records: test_tension_control.py,
test_motor_that_does_not_turn.py, test_power_cycle.py, test_position_file.py."""


def test_every_condition_on_the_bench_has_a_case() -> None:
    rows = runpy.run_path(str(ROOT / "docs/make_safety.py"))["BENCH_CONDITIONS"]
    assert {case.kind for case in CASES} | ELSEWHERE == {row.kind for row in rows}


@pytest.mark.parametrize("change", ["removed", "replaced"])
def test_a_trip_is_kept_although_the_latch_file_was_changed(rig: Rig, change: str) -> None:
    bench = rig.open()
    path = Path(bench.spec.latch_file)
    if change == "removed":
        path.unlink()
    else:
        copy = path.with_suffix(".copy")
        copy.write_bytes(path.read_bytes())
        copy.replace(path)
    rig.slaves[0].inject("second master enables")
    rig.wait(0.5)
    rig.kill(bench)
    rig.wait(0.5)
    with rig.opened() as again, pytest.raises(LimitTripped):
        again.winch["A"].move_by(pay_out=0.02)


_MOTIONS: dict[str, Callable[[Winch], None]] = {
    "jog by 0.3 m at a sixth of the limit": lambda w: w.jog(pay_out=0.05, duration=6.0),
    "jog by 10 mm": lambda w: w.jog(wind_in=0.02, duration=0.5),
    "move by 5 mm": lambda w: w.move_by(wind_in=0.005, speed=0.01),
}


@pytest.mark.parametrize("motion", _MOTIONS)
@pytest.mark.parametrize("share", [0.0, 0.3])
def test_a_motion_that_is_not_made_is_an_error(rig: Rig, motion: str, share: float) -> None:
    """``share`` of what is commanded is what the motor does."""
    with rig.opened() as bench:
        rig.wait(0.3)
        rig.slaves[0].inject("follows wrongly", share)
        if share and "move" in motion:
            _MOTIONS[motion](bench.winch["A"])  # the position loop makes up for it
            return
        long = "0.3 m" in motion
        with pytest.raises(MotionError, match=r"was commanded to .* and moved 0\.0"):
            _MOTIONS[motion](bench.winch["A"])
        rig.wait(0.05)
        assert [trip.kind for trip in bench.snapshot.tripped] == ["missing motion"] * long
        assert [warning.kind for warning in bench.snapshot.warnings] == ["motion"] * (not long)
        rig.slaves[0].mend_all()
        rig.wait(0.5)
        bench.reset()
        _MOTIONS[motion](bench.winch["A"])
        assert not bench.snapshot.tripped


def test_an_encoder_that_stands_still_with_the_speed_derived_from_it_is_seen_after_20_mm(
    rig: Rig,
) -> None:
    """The motor turns as commanded, 6064h and 606Ch stand still: the lag is all that shows."""
    slave = rig.slaves[0]
    with rig.opened() as bench:
        rig.wait(0.3)
        slave.inject("position stuck")
        slave.inject("velocity stuck")
        angle = slave.motor.angle
        with pytest.raises(LimitTripped, match=r"was commanded to pay out .* and moved 0\.000 m"):
            bench.winch["A"].jog(pay_out=0.05, duration=10.0)
        assert abs((slave.motor.angle - angle) * bench.winch["A"].cable.arm(0.0)) < 0.06


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["CSV", "CSP", "PV"])
@pytest.mark.parametrize("pay_out", [0.2, -0.2])
def test_a_jog_in_every_mode_ends_at_the_length_limit(
    tmp_path: Path, mode: str, pay_out: float
) -> None:
    """It is slowed down before the limit; the way back is free."""
    device = tmp_path / mode
    shutil.copytree(GENERIC.parent, device)
    file = device / "device.toml"
    text = file.read_text(encoding="utf-8")
    file.write_text(
        text.replace('motion_mode = "CSV"', f'motion_mode = "{mode}"'), encoding="utf-8"
    )
    rig = Rig(tmp_path)
    bench_file = bench_text(rig.channel, device=str(file)) + 'length = ["3.8 m", "4.2 m"]\n'
    with rig.opened(bench_file) as bench:
        winch = bench.winch["A"]
        assert winch.cable_length == pytest.approx(4.0, abs=0.01)
        key = HeldKey(rig, bench, pay_out=pay_out).press()
        rig.wait(3.0)
        key.release()
        rig.wait(0.5)
        assert key.errors == []
        assert not bench.snapshot.tripped
        left = 0.2 - abs(winch.cable_length - 4.0)
        assert 0.0 <= left < 0.005, "at rest just before the limit, m"
        assert rig.slaves[0].power.state is not State.ENABLED
        again = HeldKey(rig, bench, pay_out=pay_out).press()
        rig.wait(1.0)
        again.release()
        rig.wait(0.5)
        assert abs(winch.cable_length - 4.0) <= 0.2, "held again, it goes no further"
        start = rig.time
        winch.jog(**{"wind_in" if pay_out > 0 else "pay_out": 0.1}, duration=0.5)
        assert since(rig, start).moved
        assert abs(winch.cable_length - 4.0) < 0.17
