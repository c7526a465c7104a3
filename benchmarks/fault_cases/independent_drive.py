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

from winchkit.sim.clock.lines import SimulatedCanBus, SimulatedCanPort
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.drive.drive import FAULTS
from winchkit.sim.live.bench import LiveBench
from winchkit.sim.plant.plant import WinchPlant
from winchkit.sim.plant.servo import DriveCommand

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "support"))

from slave import Declared, Slave
from slave.frames import Frame, kind_from_host
from slave.power import State

_EDS = Path(__file__).parents[2] / "devices" / "generic-cia402" / "generic-cia402.eds"
_DECLARED = Declared(disabled_deceleration=1000.0)
"""A holding brake closes where there is no torque."""
_LEAST = 1e-5
_FRAME = 50e-6
"""Of a remote frame at 1 Mbit/s, s."""
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
        self.slave.motion.offset = round(self._origin / self.slave.motion.unit)

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

    def poll(self, now: float) -> None:
        """Take a remote frame of node guarding."""
        self.advance(now)
        self._say(self.slave.receive(Frame(0x700 + self.node, b"", True)))

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


class _GuardingPort(SimulatedCanPort):
    """A port that carries remote frames, to the drives of a bench."""

    def __init__(self, bus: SimulatedCanBus, clock: SimulatedClock, live: LiveBench) -> None:
        super().__init__(bus, clock)
        self._live = live

    def send(self, message: Any, timeout: float | None = None) -> None:
        """Send a message of python-can."""
        if not message.is_remote_frame:
            super().send(message, timeout)
            return
        node = message.arbitration_id - 0x700
        self._clock.call_at(self._clock.now() + _FRAME, partial(self._poll, node))

    def _poll(self, node: int) -> None:
        with self._live.up_to_date():
            for winch in self._live.winches.values():
                if isinstance(winch.drive, IndependentDrive) and winch.drive.node == node:
                    winch.drive.poll(self._clock.now())


def carry_remote_frames(live: LiveBench, clock: SimulatedClock) -> None:
    """Let the CAN buses of a bench in simulated time carry the polls of node guarding."""
    for name, bus in live._ports.items():

        def connect(bus: SimulatedCanBus = bus) -> _GuardingPort:  # type: ignore[assignment]
            bus.ports.append(port := _GuardingPort(bus, clock, live))
            return port

        clock.serve_can(live.bench_spec.bus[name].channel or "", connect)


def replace_drives(live: LiveBench) -> None:
    """Put a slave in the place of every drive of a bench in simulated time."""
    for name, winch in live.winches.items():
        servo = live.bench_spec.winch[name].servo
        send = partial(live._ports[servo.bus].send)
        winch.drive = IndependentDrive(  # type: ignore[assignment]
            send, servo.node or 1, winch.plant, live._now()
        )
