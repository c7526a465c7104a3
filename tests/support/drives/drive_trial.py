"""One trial of a drive on the rig: a held key, a move, and the death of the host."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from slave import State
from slave.held_key import HeldKey
from slave.rig import Rig


def moves(rig: Rig, text: str, dead: Callable[[Rig], None] | None = None) -> None:
    """Jog for a while and release; then move, and let the host die."""
    slave = rig.slaves[0]
    with rig.opened(text) as bench:
        if not bench.winch["A"].snapshot.length_known:
            bench.winch["A"].home(at=2.0)
        key = HeldKey(rig, bench, pay_out=0.05).press()
        rig.wait(1.0)
        assert abs(slave.motor.velocity) > 1.0, key.errors
        key.release()
        rig.wait(2.0)
        assert not key.errors
        assert slave.power.state is not State.ENABLED
        here = bench.winch["A"].cable_length
        bench.winch["A"].move_by(wind_in=0.02)
        assert bench.winch["A"].cable_length == pytest.approx(here - 0.02, abs=2e-3)
        if dead is not None:
            key.press()
            rig.wait(0.8)
            assert slave.power.state is State.ENABLED
            key.release()
            rig.kill(bench)
            rig.wait(0.5)
            dead(rig)


def stopped(rig: Rig) -> None:
    assert rig.slaves[0].power.state is not State.ENABLED
    assert rig.slaves[0].motor.at_rest
