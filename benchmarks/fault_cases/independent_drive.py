"""The misbehaving slave of ``tests/support/slave`` in the place of a simulated drive.

The slave was written from CiA 301 and CiA 402 and shares nothing with winchkit: what stops it is
no idea of our own simulator. Its motor turns the simulated winch, whose instruments show it.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from winchkit.sim.drive.faults import FAULTS
from winchkit.sim.live.bench import LiveBench
from winchkit.sim.plant.plant import WinchPlant
from winchkit.sim.plant.servo import DriveCommand

__all__ = ["IndependentDrive", "replace_drives"]

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "support"))

from slave import Declared, Slave
from slave.frames import Frame, kind_from_host
from slave.power import State

_EDS = Path(__file__).parents[2] / "devices" / "generic-cia402" / "generic-cia402.eds"
_DECLARED = Declared(disabled_deceleration=1000.0)
"""A holding brake closes where there is no torque."""
_LEAST = 1e-5
_NAMES = {
    "enable input open": ("enable input open",),
    "reboot": ("reboots",),
    "heartbeat stop": ("heartbeat lost",),
    "silence": ("off the bus",),
    "map lost": ("rpdo unheard", "tpdo lost"),
}


class IndependentDrive:
    """What a winch of a simulated bench needs of its drive."""

    def __init__(
        self, send: Callable[[int, bytes], None], node: int, plant: WinchPlant, now: float
    ) -> None:
        self.node = node
        self.slave = Slave.from_file(_EDS, node, declared=_DECLARED)
        self._send, self._plant, self._now = send, plant, now
        self._origin = plant.motor_angle

    @property
    def enabled(self) -> bool:
        """Whether it is in operation enabled."""
        return self.slave.power.state is State.ENABLED

    @property
    def follows(self) -> bool:
        """Whether it follows set-points, no ramp of its own."""
        return self.enabled and not self.slave.power.braking

    @property
    def velocity(self) -> float:
        """Of its motor, rad/s."""
        return float(self.slave.motor.velocity)

    def hears(self, identifier: int, data: bytes) -> bool:
        """Whether it takes a frame of the host's kind that reaches it now."""
        slave = self.slave
        rpdos = slave.pdos.identifiers(0x1400)
        kind, number = kind_from_host(Frame(identifier, data), self.node, rpdos)
        return not slave._loses("unheard", kind, number)

    def advance(self, now: float) -> None:
        """Let time pass until ``now``."""
        passed = now - self._now
        if passed < _LEAST:
            return
        self._now = now
        self._say(self.slave.advance(passed))
        motor = self.slave.motor
        command = DriveCommand(speed=motor.velocity, angle=self._origin + motor.angle)
        self._plant.advance(passed, command)

    def receive(self, identifier: int, data: bytes, now: float) -> None:
        """Take a frame."""
        self.advance(now)
        self._say(self.slave.receive(Frame(identifier, data)))

    def listens(self, identifier: int) -> bool:
        """Whether it is one of its RPDOs."""
        return identifier in self.slave.pdos.identifiers(0x1400)

    def tick(self, now: float, _all_heard: bool = True) -> None:
        """Let time pass until ``now``."""
        self.advance(now)

    def inject(self, kind: str) -> None:
        """Make something go wrong, by the names of the simulated drive."""
        if kind == "recover":
            self.slave.mend_all()
        elif kind in FAULTS:
            self.slave.inject("drive fault", FAULTS[kind].code)
        else:
            for name in _NAMES[kind]:
                self.slave.inject(name)

    def _say(self, frames: list[Any]) -> None:
        for frame in frames:
            self._send(frame.identifier, frame.data)


def replace_drives(live: LiveBench) -> None:
    """Put a slave in the place of every drive of a bench in simulated time."""
    for name, winch in live.winches.items():
        servo = live.bench_spec.winch[name].servo
        send = partial(live._ports[servo.bus].send)
        winch.drive = IndependentDrive(  # type: ignore[assignment]
            send, servo.node or 1, winch.plant, live._now()
        )
