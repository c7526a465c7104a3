"""A client in another process that falls silent: its moves end by a ramp, and others see why."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import pytest

from slave.rig import Rig
from winchkit.bench.bench import Bench
from winchkit.bench.control.dead_man import LIFE_SIGN
from winchkit.bench.remote.identity import Client, LifeSign
from winchkit.bench.remote.station import LocalStation
from winchkit.errors import MotionError

REMOTE = "move (process 12, user x)"
SPEED, RAMP = 0.1, 0.3
"""m/s, and the longest time of the ramp, s."""


@dataclass
class Attached:
    """A client as the server has it: every request is heard."""

    rig: Rig
    bench: Bench
    client: Client

    def __post_init__(self) -> None:
        self.station = LocalStation(self.bench, self.client)

    def poll(self, duration: float) -> bool:
        """Ask every 50 ms, as a command does; whether the winch moves at the end."""
        moving = True
        for _ in range(round(duration / 0.05)):
            self.client.heard()
            moving = self.station.moving("A")
            self.rig.wait(0.05)
        return moving

    def stop_time(self) -> float:
        """How long (s) it takes until the motor stands still; NaN beyond 3 s."""
        begun = self.rig.time
        while self.rig.time - begun < 3.0:
            if abs(self.rig.slaves[0].motor.velocity) < 1e-3:
                return self.rig.time - begun
            self.rig.wait(0.01)
        return math.nan


@pytest.fixture
def attached(rig: Rig) -> Iterator[Attached]:
    with rig.opened() as bench:
        yield Attached(rig, bench, Client(REMOTE, life=LifeSign()))


ORDERS: dict[str, Callable[[LocalStation], None]] = {
    "move": lambda station: station.move("A", pay_out=1.0, speed=SPEED),
    "step": lambda station: station.step("A", pay_out=1.0, speed=SPEED),
}


def test_cycles_are_counted_by_the_time_since_the_one_before(attached: Attached) -> None:
    before = attached.station.status()
    attached.rig.wait(1.0)
    after = attached.station.status()
    period = after["cycle_time"]["period"]
    pairs = zip(before["cycle_time"]["counts"], after["cycle_time"]["counts"], strict=True)
    new = [later - earlier for earlier, later in pairs]
    assert sum(new) == after["cycle"] - before["cycle"]
    assert sum(new) == pytest.approx(1.0 / period, abs=2)
    assert new[9] + new[10] == sum(new), "simulated time has no late cycle"


@pytest.mark.parametrize("order", ORDERS)
def test_what_a_silent_client_ordered_ends_by_a_ramp(attached: Attached, order: str) -> None:
    ORDERS[order](attached.station)
    assert attached.poll(2.0), "it goes on as long as the client asks"
    assert abs(attached.rig.slaves[0].motor.velocity) > 1
    took = attached.stop_time()
    assert LIFE_SIGN - 0.06 < took < LIFE_SIGN + RAMP
    (warning,) = attached.bench.snapshot.warnings
    assert f"{REMOTE} gave no sign of life for 0.5 s" in str(warning)
    assert attached.bench.snapshot.tripped == (), "a ramp, and no trip"
    with pytest.raises(MotionError, match=r"the dead-man \(move \(process 12, user x\) was silent"):
        attached.station.moving("A")
    # A new order of a client that is heard again moves it.
    ORDERS[order](attached.station)
    assert attached.poll(1.0)
    attached.station.close()


def test_the_program_that_owns_the_bench_needs_no_sign(rig: Rig) -> None:
    with rig.opened() as bench:
        bench.winch["A"].move_by(pay_out=0.2, speed=SPEED)
        assert bench.snapshot.warnings == ()


def test_a_jog_keeps_its_own_hold(attached: Attached) -> None:
    """The first press of a key holds for 0.7 s, which is longer."""
    attached.station.jog("A", pay_out=SPEED, hold=0.7)
    attached.rig.wait(0.6)
    assert abs(attached.rig.slaves[0].motor.velocity) > 1
    attached.rig.wait(0.5)
    assert attached.bench.snapshot.warnings == ()


def test_silence_at_rest_is_no_silence_in_motion(attached: Attached) -> None:
    attached.station.move("A", pay_out=0.02, speed=SPEED)
    assert not attached.poll(2.0)
    attached.rig.wait(3.0)
    attached.station.move("A", pay_out=1.0, speed=SPEED)
    assert attached.poll(1.0)
    attached.station.close()
    assert attached.bench.snapshot.warnings == ()


def test_a_standstill_of_the_owner_is_not_the_clients() -> None:
    life = LifeSign()
    life.pass_by(0.004)
    life.pass_by(10.0)
    assert life.silence < 0.1
    for _ in range(200):
        life.pass_by(0.004)
    assert life.silence > LIFE_SIGN
    life.heard()
    life.pass_by(0.004)
    assert life.silence == 0.0


def test_a_motion_that_is_ended_before_its_first_cycle_has_ended(attached: Attached) -> None:
    attached.station.move("A", pay_out=1.0, speed=SPEED)
    attached.bench.winch["A"].run_down()
    attached.rig.wait(0.1)
    assert not attached.bench.winch["A"].moving
