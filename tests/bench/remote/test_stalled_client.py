"""A client that stands still, whose keys wait meanwhile: nothing moves without a key that is down.

The operator's program (:class:`~winchkit.cli.bench.keyboard_jog.KeyboardJog`) and the owner are the
real ones, in simulated time; terminal and operator are made here, the slave's shaft is the witness.
"""

from __future__ import annotations

import contextlib
import os
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from slave.power import State
from slave.rig import Rig
from winchkit.bench.bench import Bench
from winchkit.bench.control.dead_man import DEAD_MAN, FIRST_PRESS, LIFE_SIGN
from winchkit.bench.remote.identity import Client
from winchkit.bench.remote.station import LocalStation
from winchkit.cli.bench.holding import hold_on
from winchkit.cli.bench.keyboard_jog import KeyboardJog
from winchkit.errors import MotionError, WinchkitError

_EXAMPLES = int(os.environ.get("WINCHKIT_SEQUENCES", "6"))
_DELAY, _REPEAT = 0.5, 0.033
"""Of a keyboard: until its first repeat, and between two, s."""
_KNOWN = FIRST_PRESS + DEAD_MAN
"""A terminal shows no release: a press may last for 0.7 s, and was read within 0.2 s."""
_RAMP = 0.1 + 0.25
"""From 0.1 m/s with 1 m/s², and the cycles until the drive is disabled, s."""


@dataclass
class Keyboard:
    """An operator's key and what the terminal keeps until it is read."""

    rig: Rig
    down: bool = False
    last_down: float = float("-inf")
    waiting: list[str] = field(default_factory=list)
    _due: float = float("inf")

    def __post_init__(self) -> None:
        self.rig.each.append(self._tick)

    def press(self) -> None:
        """Press the arrow, or go on holding it."""
        if not self.down:
            self.down, self._due = True, self.rig.time + _DELAY
            self.last_down = self.rig.time
            self.waiting.append("up")

    def release(self) -> None:
        """Release it."""
        self.down = False

    def _tick(self) -> None:
        if self.down:
            self.last_down = self.rig.time
            if self.rig.time >= self._due:
                self.waiting.append("up")
                self._due = self.rig.time + _REPEAT


class Ended(Exception):
    """The operator's program was ended from outside."""


@dataclass
class World:
    """One winch, its operator, and the times at which the operator's program stands still."""

    rig: Rig
    bench: Bench
    keyboard: Keyboard
    events: list[tuple[float, str, float]]
    """Time, what happens, and how long a stall lasts, s; in the order of time."""
    end: float
    """When the operator goes home, s; after all stalls."""
    wrong: list[str] = field(default_factory=list)
    late: float = 0.0
    """For how long the program stands still before it sends its next command, s."""
    _enabled: bool = False
    _stalled: bool = False

    def __post_init__(self) -> None:
        self.rig.each.append(self._look)

    def wait(self, duration: float) -> None:
        """Let time pass in the operator's program; stalls that are due happen."""
        self.rig.wait(duration)
        self.stall()

    def stall(self) -> None:
        """Stand still where it is time to."""
        while self.events and self.events[0][0] <= self.rig.time:
            _, what, duration = self.events.pop(0)
            if what == "end":
                raise Ended
            if what == "stall":
                self.rig.wait(duration)
            elif what == "late":
                self.late = duration
            elif what == "stop":
                self.bench.stop_now(wait=False)

    def _look(self) -> None:
        slave, now = self.rig.slaves[0], self.rig.time
        enabled = slave.power.state is State.ENABLED
        age = now - self.keyboard.last_down
        if enabled and not self._enabled and age > _KNOWN:
            self.wrong.append(f"{now:.2f} s: enabled {age:.2f} s after the key was down")
        if enabled and age > _KNOWN + _RAMP:
            self.wrong.append(f"{now:.2f} s: still enabled {age:.2f} s after the key was down")
        self._enabled = enabled


class Typed:
    """What the program reads, from the terminal; it may stand still before and after."""

    def __init__(self, world: World) -> None:
        self._world = world
        world.keyboard.waiting.clear()  # as setting up the terminal does

    def read(self, timeout: float) -> list[str]:
        """Keys within ``timeout`` s."""
        end = self._world.rig.time + timeout
        while not self._world.keyboard.waiting and self._world.rig.time < end:
            self._world.wait(0.002)
        keys, self._world.keyboard.waiting = self._world.keyboard.waiting, []
        return keys


class Distant:
    """A station whose caller may stand still before and after each call."""

    def __init__(self, world: World, station: LocalStation) -> None:
        self._world, self._station = world, station

    @property
    def clock(self) -> Any:
        return self._station.clock

    def __getattr__(self, name: str) -> Any:
        def call(*arguments: Any, **named: Any) -> Any:
            self._world.stall()
            if name in ("jog", "step"):
                late, self._world.late = self._world.late, 0.0
                self._world.wait(late)
            try:
                return getattr(self._station, name)(*arguments, **named)
            finally:
                self._world.wait(0.002)

        return call


def operate(world: World) -> None:
    """Run the program by the keyboard until the end, again where it was ended."""
    while world.rig.time < world.end:
        station = LocalStation(world.bench, Client("jog"))
        try:
            program = KeyboardJog(Distant(world, station), "A", 0.1)  # type: ignore[arg-type]
            keys = Typed(world)
            while world.rig.time < world.end:
                for key in program.current(keys.read(0.1)):
                    program.press(key)
                Distant(world, station).status()
        except Ended:
            pass
        finally:
            with contextlib.suppress(WinchkitError):
                station.close()


_HAPPENS = st.lists(
    st.tuples(
        st.floats(0.0, 0.9),
        st.sampled_from(["press", "release", "press", "release", "stall", "late", "stop", "end"]),
        st.sampled_from([0.05, 0.15, 0.25, 0.6, 1.5, 4.0]),
    ),
    min_size=4,
    max_size=14,
)


@settings(
    max_examples=_EXAMPLES,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
@given(_HAPPENS)
@example([(0.3, "press", 0.0), (0.9, "stall", 4.0), (0.1, "release", 0.0)])
@example([(0.3, "press", 0.0), (0.05, "release", 0.0), (0.2, "stall", 1.5), (0.5, "stall", 0.6)])
@example([(0.3, "press", 0.0), (0.0, "release", 0.0)])
@example([(0.2, "late", 1.5), (0.2, "press", 0.0), (0.05, "release", 0.0)])
@example([(0.2, "late", 0.6), (0.2, "press", 0.0), (0.05, "release", 0.0)])
@example([(0.3, "press", 0.0), (0.6, "stop", 0.0), (0.9, "stall", 0.25), (0.5, "end", 0.0)])
def test_no_drive_is_enabled_without_a_key_that_is_down(
    happens: list[tuple[float, str, float]],
) -> None:
    with tempfile.TemporaryDirectory() as folder:
        rig = Rig(Path(folder))
        keyboard = Keyboard(rig)
        with rig.opened() as bench:
            hands, program, time = [], [], rig.time
            for gap, what, duration in happens:
                time += gap
                (hands if what in ("press", "release") else program).append((time, what, duration))
            end = time + 1.5 + sum(duration for _, what, duration in program if what != "stop")

            def act() -> None:
                while hands and hands[0][0] <= rig.time:
                    _, what, _ = hands.pop(0)
                    keyboard.press() if what == "press" else keyboard.release()

            rig.each.insert(0, act)
            world = World(rig, bench, keyboard, program, end)
            operate(world)
            keyboard.release()
            rig.wait(_KNOWN + _RAMP)
            assert not world.wrong, world.wrong[:3]
            assert not bench.snapshot.tripped


def test_the_keyboard_of_this_test_moves_the_winch(rig: Rig) -> None:
    """Else nothing above could fail."""
    keyboard = Keyboard(rig)
    with rig.opened() as bench:
        world = World(rig, bench, keyboard, [], rig.time + 3.0)
        keyboard.press()
        before = bench.winch["A"].cable_length

        def press() -> None:
            keyboard.press()

        rig.each.append(press)
        operate(world)
        assert before - bench.winch["A"].cable_length > 0.2
        assert not world.wrong


@pytest.mark.parametrize("order", ["jog", "hold"])
def test_a_loop_that_stood_still_ends_and_moves_nothing(rig: Rig, order: str) -> None:
    with rig.opened() as bench:
        station = LocalStation(bench, Client("jog"))
        station.jog("A", pay_out=0.1)
        stalled = [False]

        class Clock:
            def now(self) -> float:
                return rig.time

            def sleep(self, duration: float) -> None:
                rig.wait(duration)
                if not stalled[0] and rig.time > begun + 1.0:
                    stalled[0] = True
                    rig.wait(8.0)

        class Stalled(LocalStation):
            @property
            def clock(self) -> Any:
                return Clock()

        begun = rig.time
        station.__class__ = Stalled
        with pytest.raises(MotionError, match=r"winch A: the refresh came 7\.\d\d s after"):
            hold_on(station, "A", 20.0)
        end = rig.time
        rig.wait(1.0)
        late = [sample for sample in rig.samples[0] if sample.time > end - 7.0]
        assert all(sample.state is not State.ENABLED for sample in late)
        assert bench.snapshot.tripped == (), "a ramp, and no trip"
        station.jog("A", pay_out=0.1, hold=0.5)
        rig.wait(0.4)
        assert rig.slaves[0].motor.velocity != 0.0, "a new command moves it"


def test_a_homing_that_was_led_too_late_goes_on_to_no_further_motion(rig: Rig) -> None:
    with rig.opened() as bench:
        station = LocalStation(bench, Client("home"))
        station.home("A", None, 2.0, None)
        rig.wait(LIFE_SIGN + 3.0)
        before = len(rig.samples[0])
        with pytest.raises(MotionError, match="dead-man"):
            station.homing()
        rig.wait(2.0)
        assert all(s.state is not State.ENABLED for s in rig.samples[0][before + 50 :])
        assert not station.homing()
