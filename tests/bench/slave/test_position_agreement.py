"""6064h and 606Ch that contradict each other stop the bench, and make the length unknown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pytest

from slave.held_key import HeldKey, observe, since
from slave.rig import Rig
from winchkit.bench.bench import Bench
from winchkit.errors import LimitTripped, NotPermitted

_BEFORE = 0.6
"""s."""


@dataclass(frozen=True)
class Row:
    """A fault of a measurement during a jog, and how much cable it may run before the stop."""

    fault: str
    value: Any = None
    speed: float = 0.1
    """m/s."""
    way: float = 0.02
    """m, of which the ramp of the quick stop takes v²/2a."""


_ROWS = (
    Row("position stuck"),
    Row("position stuck", speed=0.02, way=0.006),
    Row("position stuck", speed=0.003, way=0.006),
    Row("tpdo stale"),
    Row("position scaled", 2.0),
    Row("position scaled", 0.5),
    Row("position scaled", -1.0),
    Row("velocity scaled", 0.5, way=0.03),
    Row("position scaled", 2.0, speed=0.01, way=0.01),
)


@pytest.mark.parametrize("row", _ROWS, ids=lambda r: f"{r.fault} {r.value} at {r.speed} m/s")
def test_what_contradicts_stops_the_motion(rig: Rig, row: Row) -> None:
    slave = rig.slaves[0]
    with rig.opened() as bench:
        key = HeldKey(rig, bench, pay_out=row.speed).press()
        rig.wait(_BEFORE)
        start, angle = rig.time, slave.motor.angle
        slave.inject(row.fault, row.value)
        rig.wait(3.0)
        assert abs(slave.motor.velocity) < 0.1
        way = abs((slave.motor.angle - angle) * bench.winch["A"].cable.arm(0.0))
        assert bench.snapshot.tripped[0].kind == "counter"
        assert way < row.way
        assert "6064h changed by" in observe(rig, key, start).cause
        key.release()
        rig.wait(1.0)
        slave.mend_all()
        _unknown_until_homed(rig, bench)


def _unknown_until_homed(rig: Rig, bench: Bench) -> None:
    """After a reset nothing moves by a length that is wrong."""
    winch = bench.winch["A"]
    with pytest.raises(LimitTripped, match="latched"):
        winch.jog(pay_out=0.1)
    bench.reset()
    rig.wait(1.0)
    assert not bench.snapshot.winch["A"].length_known
    with pytest.raises(NotPermitted, match="home"):
        winch.move_by(pay_out=0.02)
    winch.home(at=2.0)
    winch.move_by(pay_out=0.02)
    assert winch.cable_length == pytest.approx(2.02, abs=2e-3)


@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("turns", [2.0, -0.3])
def test_a_jump_that_a_motion_could_explain_is_seen(
    rig: Rig, turns: float, *, moving: bool
) -> None:
    """Two turns are 37 mm, less than the motor turns in a quarter of a second at its limit."""
    slave = rig.slaves[0]
    with rig.opened() as bench:
        rig.wait(0.5)
        key = HeldKey(rig, bench, pay_out=0.1)
        if moving:
            key.press()
        rig.wait(_BEFORE)
        start = rig.time
        slave.motion.offset += round(turns * 65536)
        rig.wait(0.5)
        key.release()
        assert [trip.kind for trip in bench.snapshot.tripped] == ["counter"]
        assert since(rig, start + 0.3).enabled is False
        rig.wait(0.5)
        _unknown_until_homed(rig, bench)


@pytest.mark.parametrize("speed", [0.01, 0.3])
def test_a_scale_that_is_declared_wrongly_is_found_at_the_first_motion(
    rig: Rig, speed: float
) -> None:
    slave = rig.slaves[0]
    with rig.opened() as bench:
        slave.inject("position scaled", 2.0)
        rig.wait(0.5)
        angle = slave.motor.angle
        key = HeldKey(rig, bench, pay_out=speed).press()
        rig.wait(2.0)
        key.release()
        assert bench.snapshot.tripped[0].kind == "counter"
        way = abs((slave.motor.angle - angle) * bench.winch["A"].cable.arm(0.0))
        assert way < 0.01 + speed * 0.15 + speed * speed


@pytest.mark.parametrize("fault", ["tpdo repeated", "rpdo repeated"])
def test_frames_that_come_twice_are_no_contradiction(rig: Rig, fault: str) -> None:
    with rig.opened() as bench:
        rig.slaves[0].inject(fault)
        bench.winch["A"].jog(pay_out=0.1, duration=1.0)
        bench.winch["A"].move_by(wind_in=0.05)
        assert not bench.snapshot.tripped
