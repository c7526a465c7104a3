"""A person who holds a jog key, and what the shaft did meanwhile."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from slave.power import State
from slave.rig import Rig, Sample
from winchkit.bench.bench import Bench
from winchkit.bench.remote.identity import Client
from winchkit.errors import WinchkitError

_REPEAT = 0.05
_MOVES = 0.5
"""rad/s of the motor; 1.5 mm/s of cable."""
_RUNNING = 0.6
"""From the press of the key to steady motion, s."""


@dataclass
class HeldKey:
    """Calls ``jog`` and then, every 50 ms while it is held, ``refresh``, whatever comes of it."""

    rig: Rig
    bench: Bench
    winch: str = "A"
    pay_out: float = 0.1
    """m/s; negative winds in."""
    errors: list[tuple[float, WinchkitError]] = field(default_factory=list)
    held: bool = False
    client: Client | None = None
    """For whom; None for the program that owns the bench."""
    accepted: Callable[[], None] = field(default=lambda: None)
    """Called after each call that was not refused."""
    first: float = math.inf
    """When it was first asked for, s."""
    _next: float = 0.0
    _pressed: bool = False
    _busy: bool = False

    def press(self) -> HeldKey:
        """Begin to hold."""
        if not self.held:
            self.held, self._next, self._pressed = True, self.rig.time, False
            self.rig.each.append(self._repeat)
        return self

    def release(self) -> None:
        """Release the key."""
        if self.held:
            self.held = False
            self.rig.each.remove(self._repeat)

    def _repeat(self) -> None:
        if self._busy or self.rig.time < self._next:
            return
        self._busy, self._next = True, self.rig.time + _REPEAT
        self.first = min(self.first, self.rig.time)
        try:
            commanders = self.bench.commanders
            with commanders.acting(self.client or commanders.owner):
                self._jog()
            self.accepted()
        except WinchkitError as error:
            self.errors.append((self.rig.time, error))
        finally:
            self._busy = False

    def _jog(self) -> None:
        winch = self.bench.winch[self.winch]
        if self._pressed:
            winch.refresh()
            return
        self._pressed = True
        winch.release()
        if self.pay_out > 0:
            winch.jog(pay_out=self.pay_out)
        else:
            winch.jog(wind_in=-self.pay_out)


@dataclass(frozen=True)
class Outcome:
    """What a fault led to; times from the fault, s, infinity where it never came."""

    left: float
    """Until the drive had left operation enabled or was in its quick stop."""
    rest: float
    """Until the shaft stood still for good."""
    cause: str
    """The first message."""
    told: float
    """When."""
    speed: float
    """Of the motor at the fault, rad/s."""


@dataclass(frozen=True)
class Record:
    """What a slave did from a moment on."""

    samples: list[Sample]

    @property
    def moved(self) -> bool:
        """Whether the shaft turned."""
        return any(abs(sample.velocity) > _MOVES for sample in self.samples)

    @property
    def enabled(self) -> bool:
        """Whether the drive was enabled."""
        return any(sample.state is State.ENABLED for sample in self.samples)


def jogging(rig: Rig, bench: Bench, pay_out: float = 0.1, winch: str = "A") -> HeldKey:
    """A winch that a held key moves at a steady speed."""
    key = HeldKey(rig, bench, winch, pay_out).press()
    rig.wait(_RUNNING)
    assert not key.errors, key.errors
    slave = rig.slaves["ABCDEFGH".index(winch)]
    assert abs(slave.motor.velocity) > 10 * abs(pay_out) / 0.1
    return key


def since(rig: Rig, start: float, number: int = 0) -> Record:
    """What a slave did since ``start``."""
    return Record([sample for sample in rig.samples[number] if sample.time > start])


def observe(rig: Rig, key: HeldKey, start: float, number: int = 0) -> Outcome:
    """What came of a fault at ``start``."""
    samples = since(rig, start, number).samples
    left = next((s.time - start for s in samples if s.state is not State.ENABLED), math.inf)
    moving = [s.time - start for s in samples if abs(s.velocity) > _MOVES]
    rest = math.inf if moving and moving[-1] > samples[-1].time - start - 0.2 else 0.0
    rest = moving[-1] if moving and not rest else rest
    told = [(time - start, str(error)) for time, error in key.errors if time > start]
    at, cause = told[0] if told else (math.inf, "")
    return Outcome(left, rest, cause, at, abs(samples[0].velocity))
