"""Mechanisms of host loss on an open bench: its control loop, reset, the last stop, closing."""

from __future__ import annotations

from pathlib import Path

import pytest

from slave import Reactions, State
from slave_bench import SlaveBench, served, write_bench
from winchkit.bench.bench import Bench
from winchkit.bench.commissioning.dialogue import AnswerFile
from winchkit.bench.commissioning.procedure import commission_bench
from winchkit.errors import MotionError, NotPermitted


def unheeded(bench: SlaveBench, opened: Bench) -> None:
    """Stop a winch whose drive obeys no control word: only silence is left."""
    opened.winch["A"].jog(pay_out=0.05)
    for _ in range(40):
        opened.winch["A"].refresh()
        bench.rig.wait(0.02)
    assert abs(bench.slave.motor.velocity) > 0.1
    bench.slave.inject("control word unheeded")
    bench.slave.inject("nmt unheard")
    opened.stop_now(wait=False)
    bench.rig.until(lambda: bench.slave.power.state is not State.ENABLED, within=1.0)
    assert any(trip.kind == "unresponsive" for trip in opened.snapshot.tripped)


@pytest.mark.parametrize("mechanism", ["guarding", "rpdo-timeout"])
def test_a_bench_moves_resets_and_closes_with_it(tmp_path: Path, mechanism: str) -> None:
    path = write_bench(tmp_path, host_loss=mechanism)
    with served(path) as bench:
        with bench.open() as opened:
            opened.winch["A"].move_by(pay_out=0.01)
            bench.slave.inject("reboots")
            bench.rig.wait(0.5)
            with pytest.raises(MotionError):
                opened.winch["A"].move_by(pay_out=0.01)
            opened.reset()
            opened.winch["A"].move_by(pay_out=0.01)
        sub = {"guarding": (0x100D, 0), "rpdo-timeout": (0x1400, 5)}[mechanism]
        assert bench.slave.objects.get(*sub) == 0, "a drive at rest minds no end of the host"
        bench.rig.wait(0.4)
        assert bench.slave.power.state is State.SWITCH_ON_DISABLED
        assert bench.slave.power.error == 0


@pytest.mark.parametrize("mechanism", ["heartbeat", "guarding", "rpdo-timeout"])
def test_the_last_method_is_silence_in_what_this_drive_watches(
    tmp_path: Path, mechanism: str
) -> None:
    path = write_bench(tmp_path, host_loss=mechanism)
    with served(path) as bench, bench.open() as opened:
        unheeded(bench, opened)
        bench.slave.mend("control word unheeded")
        bench.slave.mend("nmt unheard")
        opened.reset()
        opened.winch["A"].move_by(pay_out=0.01)


def test_a_mechanism_that_shows_nothing_disabled_permits_motion_once_it_was_seen(
    tmp_path: Path,
) -> None:
    """A loss of SYNC, on a bus without real drives too."""
    path = write_bench(tmp_path, host_loss="sync-loss", cycle="10 ms")
    with served(path, reactions=Reactions(sync_lost="quick stop")) as bench:
        with bench.open() as opened, pytest.raises(NotPermitted, match="sync-loss: the drive"):
            opened.winch["A"].move_by(pay_out=0.01)
        dialogue = AnswerFile(bench.answers, lambda _text: None)
        record = commission_bench(bench.spec, dialogue, bench.clock)
        loss = record.winch["A"].host_loss
        assert loss.noticed_after is None
        assert loss.stopped_after is not None
        with bench.open() as opened:
            unheeded(bench, opened)
