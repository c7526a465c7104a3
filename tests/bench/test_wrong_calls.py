"""Motion calls with numbers that cannot be meant, and calls from within the control loop."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from slave.power import State
from slave.rig import Rig
from winchkit.bench.bench import Bench
from winchkit.bench.control.snapshot import BenchSnapshot
from winchkit.bench.ownership import connect_to_owner
from winchkit.bench.remote.client import RemoteStation
from winchkit.errors import UsageError

NO_NUMBERS: list[Any] = ["0.1", "0.1 m/s", math.nan, math.inf, True, [0.1], {}]
NOT_POSITIVE: list[Any] = [0, -1, -0.1]


@pytest.fixture
def station(bench: Bench) -> Iterator[RemoteStation]:
    connection = connect_to_owner(bench.spec)
    assert connection is not None
    with RemoteStation(connection) as attached:
        yield attached


OWNED: dict[str, tuple[Callable[[Bench, Any], object], bool]] = {
    "jog": (lambda b, x: b.winch["A"].jog(wind_in=x), True),
    "jog, duration": (lambda b, x: b.winch["A"].jog(wind_in=0.1, duration=x), True),
    "jog, hold": (lambda b, x: b.winch["A"].jog(wind_in=0.1, hold=x), True),
    "refresh": (lambda b, x: b.winch["A"].refresh(pay_out=x), True),
    "refresh, hold": (lambda b, x: b.winch["A"].refresh(hold=x), True),
    "move_to": (lambda b, x: b.winch["A"].move_to(x), False),
    "move_to, speed": (lambda b, x: b.winch["A"].move_to(3.0, x), False),
    "move_to, acceleration": (lambda b, x: b.winch["A"].move_to(3.0, 0.1, x), False),
    "move_by": (lambda b, x: b.winch["A"].move_by(pay_out=x), True),
    "move_together": (lambda b, x: b.move_together({"A": x}), False),
    "hold_tension, travel": (lambda b, x: b.winch["A"].hold_tension(100.0, travel=x), True),
    "hold_tension, duration": (lambda b, x: b.winch["A"].hold_tension(100.0, duration=x), True),
    "home, at": (lambda b, x: b.winch["A"].home(at=x), False),
    "home, method": (lambda b, x: b.winch["A"].home(x), False),
    "home, speed": (lambda b, x: b.winch["A"].home(37, at=2.0, speed=x), False),
}
ATTACHED: dict[str, Callable[[RemoteStation, Any], object]] = {
    "jog": lambda s, x: s.jog("A", wind_in=x),
    "jog, hold": lambda s, x: s.jog("A", wind_in=0.1, hold=x),
    "refresh": lambda s, x: s.refresh("A", hold=x),
    "step": lambda s, x: s.step("A", pay_out=x),
    "step, speed": lambda s, x: s.step("A", pay_out=0.1, speed=x),
    "move": lambda s, x: s.move("A", to=x),
    "move, speed": lambda s, x: s.move("A", to=3.0, speed=x),
    "hold_tension": lambda s, x: s.hold_tension("A", x, 0.2, {}),
    "home": lambda s, x: s.home("A", None, x, None),
}


def unmoved(rig: Rig) -> bool:
    rig.wait(0.3)
    return all(sample.state is not State.ENABLED for sample in rig.samples[0])


@pytest.mark.parametrize("call", OWNED)
def test_the_owner_refuses_what_is_no_number_before_anything_moves(
    rig: Rig, bench: Bench, call: str
) -> None:
    order, positive = OWNED[call]
    for value in (*NO_NUMBERS, *(NOT_POSITIVE if positive else ())):
        with pytest.raises(UsageError, match=r"pass a number|is not a|is more than"):
            order(bench, value)
    if "duration" in call or call in ("move_to", "hold_tension"):
        with pytest.raises(UsageError, match="pass a number"):
            order(bench, object())
    assert not bench.winch["A"].moving
    assert unmoved(rig)


@pytest.mark.parametrize("call", ATTACHED)
def test_an_attached_client_is_refused_in_the_same_words(
    rig: Rig, station: RemoteStation, call: str
) -> None:
    for value in NO_NUMBERS:
        words = r"pass a number|is not a|is more than|has no unit|not of force"
        with pytest.raises(UsageError, match=words):
            ATTACHED[call](station, value)
    assert unmoved(rig)


def in_cycle(rig: Rig, bench: Bench, call: Callable[[], object]) -> list[BaseException | None]:
    """What a call raises in an on_cycle function."""
    raised: list[BaseException | None] = []

    def function(_snapshot: BenchSnapshot) -> None:
        if not raised:
            try:
                call()
                raised.append(None)
            except Exception as error:  # noqa: BLE001 - judged by the test
                raised.append(error)

    remove = bench.on_cycle(function)
    rig.until(lambda: bool(raised), within=0.1)
    remove()
    return raised


WAITING: dict[str, Callable[[Bench], object]] = {
    "stop": lambda b: b.stop(),
    "stop of a winch": lambda b: b.winch["A"].stop(),
    "reset": lambda b: b.reset(),
    "close": lambda b: b.close(),
    "move_to": lambda b: b.winch["A"].move_to(3.0),
    "move_by": lambda b: b.winch["A"].move_by(pay_out=0.1),
    "move_together": lambda b: b.move_together({"A": 3.0}),
    "jog": lambda b: b.winch["A"].jog(pay_out=0.1, duration=1.0),
    "home": lambda b: b.winch["A"].home(at=2.0),
    "tare": lambda b: b.winch["A"].tare(),
    "wait": lambda b: b.winch["A"].wait(),
}


@pytest.mark.parametrize("call", WAITING)
def test_what_waits_for_the_loop_is_refused_within_it(rig: Rig, bench: Bench, call: str) -> None:
    (error,) = in_cycle(rig, bench, lambda: WAITING[call](bench))
    assert isinstance(error, UsageError)
    assert "waits for the control loop, and was called in an on_cycle function" in str(error)
    assert not bench.winch["A"].moving
    assert unmoved(rig)
    bench.winch["A"].move_by(pay_out=0.01)


def test_a_quick_stop_within_the_loop_acts_at_once_and_returns(rig: Rig, bench: Bench) -> None:
    winch = bench.winch["A"]
    winch.move_to(3.0, wait=False)
    rig.wait(1.0)
    assert abs(rig.slaves[0].motor.velocity) > 1
    cycles: list[int] = []

    def stop() -> None:
        cycles.append(bench.loop.count)
        bench.stop_now()
        cycles.append(bench.loop.count)

    assert in_cycle(rig, bench, stop) == [None]
    assert cycles[0] == cycles[1], "it waits for nothing"
    begun = rig.time
    rig.until(lambda: rig.slaves[0].power.state is not State.ENABLED, within=0.05)
    assert rig.time - begun < 0.05
    bench.wait_at_rest("A")
    assert bench.loop.failure is None


def test_what_does_not_wait_may_be_called_within_the_loop(rig: Rig, bench: Bench) -> None:
    winch = bench.winch["A"]
    start = winch.cable_length
    move = in_cycle(rig, bench, lambda: winch.move_by(pay_out=0.1, speed=0.1, wait=False))
    assert move == [None]
    rig.wait(0.8)
    assert in_cycle(rig, bench, lambda: bench.stop(wait=False)) == [None]
    rig.wait(1.0)
    assert bench.snapshot.at_rest
    assert 0.01 < winch.cable_length - start < 0.1


def test_another_thread_may_wait_meanwhile(bench: Bench) -> None:
    assert not bench.loop.asks_here
    seen: list[bool] = []
    thread = threading.Thread(target=lambda: seen.append(bench.loop.asks_here))
    thread.start()
    thread.join()
    assert seen == [False]
