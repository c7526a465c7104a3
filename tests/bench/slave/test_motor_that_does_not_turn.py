"""A motor that does not turn ends its motion with an error, however slow the motion was."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from slave.rig import Rig
from winchkit.bench.winch import Winch
from winchkit.errors import LimitTripped, MotionError

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
